# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the calls of a client share: how a question becomes a request, and what was learned of the server."""

from __future__ import annotations

import logging
import re
import time
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from silo.api.address import ServerAddress
from silo.api.replies import Reply
from silo.api.transport import Call, Cancel, Transport, as_json, stop_if
from silo.bom.errors import BusyError, ForbiddenError, InputError, NotFoundError, ReadOnlyError, RejectedError
from silo.durable import read_memory, write_memory
from silo.folders import cache_folder

log = logging.getLogger("silo.api")

KEPT_S = 24 * 3600.0


class Abilities(BaseModel):
    """What a server can do, kept for a day, so that each run need not try it again; None: nobody tried yet.

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


class _Kept(Abilities):
    learned_at: float


def abilities_path() -> Path:
    """The user's file of what was learned about servers."""
    return cache_folder() / "servers.json"


def load_abilities(path: Path, server: str, *, clock: Callable[[], float] = time.time) -> Abilities:
    """What is known of a server; nothing where that is older than a day."""
    try:
        known = _Kept.model_validate(read_memory(path).get(server), strict=True)
    except ValidationError:
        return Abilities()
    fresh = 0 <= clock() - known.learned_at < KEPT_S
    return Abilities(**known.model_dump(exclude={"learned_at"})) if fresh else Abilities()


def save_abilities(
    path: Path, server: str, known: Abilities, *, clock: Callable[[], float] = time.time
) -> None:
    """Remember; what cannot be written is not remembered. One small JSON file for all servers.

    It is only a memory: a file that is lost, old or damaged costs some requests, never an answer.
    """
    content = {**read_memory(path), server: {**known.model_dump(), "learned_at": clock()}}
    if (error := write_memory(path, content)) is not None:
        log.info("%s: what was learned about %s is not kept (%s)", path, server, error)


T = TypeVar("T")
K = TypeVar("K", bound=Hashable)
Body = TypeVar("Body", bound=BaseModel)

LISTS = ("items", "entries", "lines", "bom", "results", "data")
"""The keys under which servers put a list that is not bare."""

MAX_IN_BATCH = 1000
"""Things in one batch question."""

MAX_WORKERS = 8
"""Questions at once where the server has no batch look-up."""

_UNKNOWN_KEY = re.compile(
    r"(unknown|unrecogni[sz]ed|unexpected|additional|extra|unsupported)\s+(json\s+)?"
    r"(fields?|keys?|propert|inputs?|parameters?|attributes?)|not permitted",
    re.IGNORECASE,
)

Params = Mapping[str, str | int]


class Caller:
    """Base of the client's parts: an address and a transport."""

    _address: ServerAddress
    _transport: Transport
    abilities: Abilities
    _refused: frozenset[str] = frozenset()  # batch requests, for this token and mode

    def _get(self, subject: str, *segments: str, params: Params | None = None) -> Reply:
        """Ask; a question may be repeated freely."""
        return self._transport.send(
            Call(
                "GET",
                self._address.api(*segments),
                subject,
                params=params or {},
                headers={"Accept": "application/json"},
                repeatable=True,
            )
        )

    def _ask(self, subject: str, *segments: str, body: BaseModel, cancelled: Cancel | None = None) -> Reply:
        """Ask what is too long for an address: a POST that may be repeated freely."""
        return self._change("POST", subject, *segments, body=body, repeatable=True, cancelled=cancelled)

    def _change(
        self,
        method: str,
        subject: str,
        *segments: str,
        body: BaseModel,
        headers: Mapping[str, str] | None = None,
        repeatable: bool = False,
        cancelled: Cancel | None = None,
        extensions: Sequence[str] = (),
    ) -> Reply:
        """Send a model as JSON.

        extensions
            keys that only our own server knows, also inside lists of objects. A strict server refuses them:
            it is asked once more without them, and never sent any again.
        """
        # Not pydantic's own JSON, which writes NaN as null: what cannot be said is an error, no gap.
        said = body.model_dump(by_alias=True, exclude_none=True)
        bare = _without(said, extensions)

        def send(data: Any) -> Reply:
            content = as_json(data)
            return self._transport.send(
                Call(
                    method,
                    self._address.api(*segments),
                    subject,
                    body=lambda: content,
                    headers={
                        "Accept": "application/json",
                        "Content-Type": "application/json",
                        **(headers or {}),
                    },
                    repeatable=repeatable,
                    cancelled=cancelled,
                )
            )

        if self.abilities.strict or bare == said:
            return send(bare)
        try:
            return send(said)
        except RejectedError as error:
            if not _UNKNOWN_KEY.search(f"{error} {' '.join(error.problems)}"):
                raise
        reply = send(bare)
        self.abilities.strict = True
        return reply

    def _many(
        self,
        ability: str,
        keys: Iterable[K],
        batch: Callable[[Sequence[K]], Mapping[K, T]],
        single: Callable[[K], T | None],
        cancelled: Cancel | None = None,
    ) -> dict[K, T]:
        """Ask about many things, in few requests where the server can, else in a bounded pool of single ones.

        ability
            the field of :class:`Abilities` that says whether the server has such a request.
        """
        wanted = list(dict.fromkeys(keys))
        found: dict[K, T] = {}
        for start in range(0, len(wanted), MAX_IN_BATCH):
            stop_if(cancelled)
            chunk = wanted[start : start + MAX_IN_BATCH]
            answer = None
            if ability not in self._refused and getattr(self.abilities, ability) is not False:
                try:
                    answer = batch(chunk)
                    setattr(self.abilities, ability, True)
                except NotFoundError:
                    setattr(self.abilities, ability, False)
                except (ForbiddenError, ReadOnlyError, BusyError):
                    # No POST for viewers and on a read-only server: GET is allowed all the same.
                    self._refused = self._refused | {ability}
                except RejectedError:
                    pass  # one malformed key spoils the batch; asked one by one, only that one is unknown
            found.update(_one_by_one(chunk, single, cancelled) if answer is None else answer)
        return found

    def _delete(self, subject: str, *segments: str) -> None:
        """Remove."""
        self._transport.send(Call("DELETE", self._address.api(*segments), subject))


def body(kind: type[Body], values: Mapping[str, Any], thing: str) -> Body:
    """The values as a request; raises :class:`InputError` with all that does not fit at once."""
    unknown = sorted(set(values) - set(kind.model_fields) - {"schema"})
    if unknown:
        known = ", ".join(kind.model_fields)
        raise InputError(f"{', '.join(unknown)}: no field of {thing}; wanted some of {known}")
    try:
        return kind.model_validate(values)
    except ValidationError as error:
        wrong = "; ".join(f"{'.'.join(map(str, e['loc']))}: {e['msg']}" for e in error.errors())
        raise InputError(f"these values do not fit {thing}: {wrong}") from error


def _one_by_one(keys: Sequence[K], single: Callable[[K], T | None], cancelled: Cancel | None) -> dict[K, T]:
    def one(key: K) -> T | None:
        stop_if(cancelled)
        return single(key)

    with ThreadPoolExecutor(min(MAX_WORKERS, len(keys)), "silo-lookup") as pool:
        try:
            found = list(pool.map(one, keys))
        except BaseException:
            # One failed, so the rest is not wanted any more.
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return {key: value for key, value in zip(keys, found, strict=True) if value is not None}


def _without(data: Any, keys: Sequence[str]) -> Any:
    """The data without these keys, here and in lists of objects; what a user put into a value stays."""
    if not keys or not isinstance(data, dict):
        return data
    return {
        key: [_without(one, keys) for one in value] if isinstance(value, list) else value
        for key, value in data.items()
        if key not in keys
    }
