# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a server can do, learned from its answers and kept for a day."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from pathlib import Path

from pydantic import BaseModel, ValidationError

from silo.platform.memory_file import read_memory, write_memory
from silo.platform.user_folders import cache_folder

log = logging.getLogger("silo.api")

KEPT_S = 24 * 3600.0


class Abilities(BaseModel):
    """What a server can do, kept for a day, so that each run need not try it again; None: not tried yet.

    Rights and modes are not kept, they change.

    batch
        many identities in one question.
    boms
        the BOMs of many items in one question.
    look_alikes
        the items that many components may be already, in one question.
    strict
        it refuses keys that it does not know.
    keeps_item_ids
        a new item gets the UUID that the client proposes.
    schemas
        the part-number schema that is taken for a wanted one.
    """

    batch: bool | None = None
    boms: bool | None = None
    look_alikes: bool | None = None
    strict: bool = False
    keeps_item_ids: bool = False
    schemas: dict[str, str] = {}


class _KeptAbilities(Abilities):
    learned_at: float


def abilities_path() -> Path:
    """Return the file in which this user's programs keep what they learned about servers."""
    return cache_folder() / "servers.json"


def load_abilities(path: Path, server: str, *, clock: Callable[[], float] = time.time) -> Abilities:
    """Read what is known of a server; nothing if that is older than a day."""
    try:
        memory = _KeptAbilities.model_validate(read_memory(path).get(server), strict=True)
    except ValidationError:
        return Abilities()
    fresh = 0 <= clock() - memory.learned_at < KEPT_S
    return Abilities(**memory.model_dump(exclude={"learned_at"})) if fresh else Abilities()


def save_abilities(
    path: Path, server: str, abilities: Abilities, *, clock: Callable[[], float] = time.time
) -> None:
    """Write what is known of a server into one small JSON file for all servers. Ignores a failed write.

    It is only a memory: a file that is lost, old or damaged costs some requests, never an answer.
    """
    content = {**read_memory(path), server: {**abilities.model_dump(), "learned_at": clock()}}
    if (error := write_memory(path, content)) is not None:
        log.info("%s: what was learned about %s is not kept (%s)", path, server, error)
