# SPDX-License-Identifier: LGPL-2.1-or-later
"""What was learned about a server, kept for a day: so that each run need not try it again.

One small JSON file for all servers. It is only a memory: a file that is lost, old or damaged costs some
requests, never an answer. Rights and modes are not kept, they change.
"""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

from silo.durable import replacing
from silo.folders import cache_folder

log = logging.getLogger("silo.api")

KEPT_S = 24 * 3600.0


@dataclass
class Abilities:
    """What a server can do; None where nobody tried yet.

    batch
        many identities in one question.
    boms
        the BOMs of many items in one question.
    strict
        it refuses keys that it does not know.
    keeps_item_ids
        a new item gets the UUID that the client proposes.
    schemas
        the part-number schema that is taken for a wanted one.
    """

    batch: bool | None = None
    boms: bool | None = None
    strict: bool = False
    keeps_item_ids: bool = False
    schemas: dict[str, str] = field(default_factory=dict)


def default_path() -> Path:
    """The user's file."""
    return cache_folder() / "servers.json"


def load(path: Path, server: str, *, clock: Callable[[], float] = time.time) -> Abilities:
    """What is known of a server; nothing where that is older than a day."""
    known = _read(path).get(server)
    if not isinstance(known, dict) or not 0 <= clock() - _number(known.get("learned_at")) < KEPT_S:
        return Abilities()
    values = {f.name: known[f.name] for f in fields(Abilities) if f.name in known}
    maybe = (bool, type(None))
    wanted = {"batch": maybe, "boms": maybe, "strict": bool, "keeps_item_ids": bool, "schemas": dict}
    if not all(isinstance(value, wanted[name]) for name, value in values.items()):  # type: ignore[arg-type]
        return Abilities()
    return Abilities(**values)


def save(path: Path, server: str, known: Abilities, *, clock: Callable[[], float] = time.time) -> None:
    """Remember; what cannot be written is not remembered."""
    content = {**_read(path), server: {**asdict(known), "learned_at": clock()}}
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as file:
            file.write(json.dumps(content, indent=1).encode())
    except OSError as error:
        log.info("%s: what was learned about %s is not kept (%s)", path, server, error)


def _read(path: Path) -> dict[str, Any]:
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return data if isinstance(data, dict) else {}


def _number(value: Any) -> float:
    return float(value) if isinstance(value, (int, float)) else 0.0
