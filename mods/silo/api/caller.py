# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the calls of a client share: how a question becomes a request, and an answer a list or a model."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from silo.api.abilities import Abilities
from silo.api.address import ServerAddress
from silo.api.replies import Reply
from silo.api.transport import ApiCall, Cancel, Transport, stop_if
from silo.bom.errors import (
    BusyError,
    ForbiddenError,
    InputError,
    NotFoundError,
    ReadOnlyError,
    RejectedError,
    ServerFaultError,
)
from silo.bom.message import message
from silo.bom.text import character_problem, with_allowed_characters


def as_json(data: object) -> bytes:
    """Write the data as strict JSON. Raises :class:`InputError` for NaN, bytes, or a value that holds itself.

    A character that no server takes, as in the name of a file, becomes U+FFFD.
    """
    try:
        written = json.dumps(data, ensure_ascii=False, allow_nan=False)
        if "\\u00" in written or character_problem(written):
            written = json.dumps(_sendable(json.loads(written)), ensure_ascii=False)
        return written.encode()
    except (TypeError, ValueError, RecursionError) as error:
        raise InputError(message("this cannot be sent as JSON: {error}", error=error)) from error


def _sendable(value: Any) -> Any:
    if isinstance(value, dict):
        return {with_allowed_characters(key): _sendable(below) for key, below in value.items()}
    if isinstance(value, list):
        return [_sendable(below) for below in value]
    return with_allowed_characters(value) if isinstance(value, str) else value


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
        """Send a GET request, which may be repeated freely."""
        return self._transport.send(
            ApiCall(
                "GET",
                self._address.api(*segments),
                subject,
                params=params or {},
                headers={"Accept": "application/json"},
                repeatable=True,
            )
        )

    def _all(
        self, kind: type[Body], subject: str, *segments: str, keys: Sequence[str] = (), **params: str | int
    ) -> Iterator[tuple[list[Body], int]]:
        """Yield the rows of a list to its end, page by page, each page with the total number of rows.

        Raises :class:`ServerFaultError` if the server has more rows and does not show them: an incomplete
        list is no answer.
        """
        more, rows, last = dict(params), 0, list[Body]()
        while True:
            reply = self._get(subject, *segments, params=more)
            page = reply.models(kind, *keys, *LISTS)
            fresh = [] if page == last else page  # a server that knows no pages sends the same once more
            rows, following = rows + len(fresh), reply.next if page else {}
            total = max(reply.total, rows + bool(following))
            yield fresh, total
            if rows >= total:
                return
            if not fresh:
                raise ServerFaultError(
                    message(
                        "{subject}: {host} has more of them than the {rows} that it shows, whatever page is "
                        "asked for. Its administrator can make the pages of lists larger",
                        subject=subject,
                        host=self._address.host,
                        rows=rows,
                    )
                )
            last, more = page, {**params, **(following or {"offset": rows})}

    def _ask(self, subject: str, *segments: str, cancelled: Cancel | None = None, **asked: Any) -> Reply:
        """Ask a question that is too long for an address: a POST that may be repeated freely."""
        return self._change("POST", subject, *segments, body=asked, repeatable=True, cancelled=cancelled)

    def _change(
        self,
        method: str,
        subject: str,
        *segments: str,
        body: BaseModel | Mapping[str, Any],
        headers: Mapping[str, str] | None = None,
        repeatable: bool = False,
        cancelled: Cancel | None = None,
        extensions: Sequence[str] = (),
    ) -> Reply:
        """Send a model, or the values for one, as JSON.

        extensions
            keys that only our own server knows, also inside lists of objects. A strict server refuses them:
            it gets the request once more without them, and never gets any again.
        """
        # Not pydantic's own JSON, which writes NaN as null: a value that JSON lacks is an error, not a gap.
        values = body.model_dump(by_alias=True, exclude_none=True) if isinstance(body, BaseModel) else body
        bare = _without(values, extensions)

        def send(data: Any) -> Reply:
            content = as_json(data)
            return self._transport.send(
                ApiCall(
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

        if self.abilities.strict or bare == values:
            return send(bare)
        try:
            return send(values)
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
        """Ask about many things: in few requests if the server can answer these, else one by one in a bounded
        pool.

        ability
            the field of :class:`Abilities` that says if the server has such a request.
        """
        wanted = list(dict.fromkeys(keys))
        answers: dict[K, T] = {}
        chunks = [wanted[start : start + MAX_IN_BATCH] for start in range(0, len(wanted), MAX_IN_BATCH)]
        while chunks:
            stop_if(cancelled)
            chunk = chunks.pop(0)
            answer = None
            if ability not in self._refused and getattr(self.abilities, ability) is not False:
                try:
                    answer = batch(chunk)
                    setattr(self.abilities, ability, True)
                except NotFoundError:
                    setattr(self.abilities, ability, False)
                except (ForbiddenError, ReadOnlyError, BusyError):
                    # No POST for viewers and on a read-only server: GET is allowed anyway.
                    self._refused = self._refused | {ability}
                except RejectedError:
                    # Too many at once, or a malformed key, which spoils the batch: alone, it is unknown.
                    if len(chunk) > 1:
                        half = len(chunk) // 2
                        chunks[:0] = [chunk[:half], chunk[half:]]
                        continue
            answers.update(_one_by_one(chunk, single, cancelled) if answer is None else answer)
        return answers

    def _delete(self, subject: str, *segments: str) -> None:
        self._transport.send(ApiCall("DELETE", self._address.api(*segments), subject))


def body(kind: type[Body], values: Mapping[str, Any], thing: str) -> Body:
    """Make a request from the values. :class:`InputError` lists all values that do not fit."""
    unknown = sorted(set(values) - set(kind.model_fields) - {"schema"})
    if unknown:
        text = ", ".join(kind.model_fields)
        raise InputError(
            message(
                "{unknown}: no field of {thing}; wanted some of {text}",
                unknown=", ".join(unknown),
                thing=thing,
                text=text,
            )
        )
    try:
        return kind.model_validate(values)
    except ValidationError as error:
        wrong = "; ".join(f"{'.'.join(map(str, e['loc']))}: {e['msg']}" for e in error.errors())
        raise InputError(
            message("these values do not fit {thing}: {wrong}", thing=thing, wrong=wrong)
        ) from error


def _one_by_one(keys: Sequence[K], single: Callable[[K], T | None], cancelled: Cancel | None) -> dict[K, T]:
    def one(key: K) -> T | None:
        stop_if(cancelled)
        return single(key)

    with ThreadPoolExecutor(min(MAX_WORKERS, len(keys)), "silo-lookup") as pool:
        try:
            results = list(pool.map(one, keys))
        except BaseException:
            # One failed, so the rest is no longer needed.
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return {key: value for key, value in zip(keys, results, strict=True) if value is not None}


def _without(data: Any, keys: Sequence[str]) -> Any:
    """Return the data without these keys, here and in lists of objects; other values stay as they are."""
    if not keys or not isinstance(data, dict):
        return data
    return {
        key: [_without(member, keys) for member in value] if isinstance(value, list) else value
        for key, value in data.items()
        if key not in keys
    }
