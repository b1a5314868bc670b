# SPDX-License-Identifier: LGPL-2.1-or-later
"""What came back: a status and bytes, read as data or as one of our errors. No network in here.

Error bodies are read in every form that is seen: ``{"error": code, "message": text}``, ``{"error": text}``, a
bare string, FastAPI's ``detail``, and the HTML page of a proxy in between.
"""

from __future__ import annotations

import html
import json
import re
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from email.utils import parsedate_to_datetime
from typing import Any, TypeVar

from pydantic import BaseModel, TypeAdapter

from silo.api.failures import Where, translated
from silo.bom.errors import (
    AuthError,
    BusyError,
    ConflictError,
    CycleError,
    ForbiddenError,
    MissingRevisionError,
    NewerRevisionError,
    NotFoundError,
    ReadOnlyError,
    RejectedError,
    RemoteError,
    RouteMissingError,
    ServerFaultError,
    SiloError,
    UnreachableError,
    VersionConflictError,
)
from silo.bom.numbers import whole_number

Model = TypeVar("Model", bound=BaseModel)

_MAX_TEXT = 400
_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069]+")
_TITLE = re.compile(r"<title[^>]*>(.{1,200}?)</title>", re.IGNORECASE | re.DOTALL)
# What routers, not handlers, say to a path they do not know: Go's net/http and chi; Starlette and FastAPI.
_ROUTER_SAYS = {"404 page not found", "Not Found", "Method Not Allowed"}
# Codes of a 503 that says "I am not well", not "I take no changes".
_AWAY = {"unavailable", "busy", "degraded", "overloaded"}
_READ_ONLY = re.compile(r"read.?only", re.IGNORECASE)
_LATER = (408, 429, 502, 503, 504)


class WebPageError(RouteMissingError):
    """404 with a web page: a proxy's, or that of a server which is no Silo at all."""


@dataclass(frozen=True)
class Reply:
    """One answer of a server. ``headers`` is read without regard to case."""

    status: int
    content: bytes
    where: Where
    headers: Mapping[str, str] = field(default_factory=dict)
    secret: str | None = field(default=None, repr=False)

    @property
    def ok(self) -> bool:
        return 200 <= self.status < 300

    @property
    def is_html(self) -> bool:
        """True for a web page, which no route of the API answers."""
        kind = self.headers.get("Content-Type", "").lower()
        return "html" in kind or self.content[:200].lstrip()[:1] == b"<"

    @property
    def total(self) -> int:
        """How many things there are on all pages; 0 where the server does not say."""
        return whole_number(self.headers.get("X-Total-Count", "")) or 0

    def data(self) -> Any:
        """The JSON of a good answer; raises :class:`ServerFaultError` where it is none."""
        if self.is_html:
            raise ServerFaultError(
                f"{self.where.asked} answered with a web page instead of data{_titled(self)}; "
                "check that the address is that of a Silo server"
            )
        with translated(self.where):
            return json.loads(self.content)

    def mapping(self, accept: Sequence[int] = ()) -> dict[str, Any]:
        """The answer as a plain object; a bad status that is not in ``accept`` raises by :func:`error_of`."""
        if not self.ok and (self.status not in accept or self.is_html):
            raise error_of(self)
        data = self.data()
        if not isinstance(data, dict):
            raise ServerFaultError(f"{self.where.asked} answered no object where one was wanted")
        return data

    def version(self) -> str | None:
        """The version that the answer bears: its ETag, else ``version`` in its body."""
        tag = self.headers.get("ETag", "").removeprefix("W/").strip('"')
        data = self.data() if not tag else None
        return tag or (str(data["version"]) if isinstance(data, dict) and "version" in data else None)

    def model(self, kind: type[Model]) -> Model:
        """The answer as one of the wire models."""
        data = self.data()
        with translated(self.where):
            return kind.model_validate(data)

    def is_null(self, *keys: str) -> bool:
        """True where null stands for the list, by itself or under one of ``keys``."""
        return _under(self.data(), keys) is None

    def models(self, kind: type[Model], *keys: str) -> list[Model]:
        """The answer as a list of models: a bare list, or an object that holds it under one of ``keys``."""
        found = _under(self.data(), keys)
        if found is None:
            found = []  # Go's empty list
        if not isinstance(found, list):
            raise ServerFaultError(
                f"{self.where.asked} answered no list where one was wanted ({', '.join(keys)})"
            )
        with translated(self.where):
            return TypeAdapter(list[kind]).validate_python(found)  # type: ignore[valid-type]


@dataclass(frozen=True)
class Complaint:
    """What an error body says, whatever its form: machine code, text for people, and the list of problems."""

    code: str = ""
    text: str = ""
    problems: tuple[str, ...] = ()
    path: tuple[str, ...] = ()
    revision: dict[str, Any] | None = None


def complaint(reply: Reply) -> Complaint:
    """Read an error body; never fails, whatever the bytes are."""
    if reply.is_html:
        return Complaint(text=_clean(_titled(reply).strip(" ()"), reply.secret))
    try:
        body = json.loads(reply.content)
    except (ValueError, RecursionError):
        return Complaint(text=_clean(reply.content[: 8 * _MAX_TEXT].decode("utf-8", "replace"), reply.secret))
    if not isinstance(body, dict):
        return Complaint(text=_clean(body, reply.secret))
    error, message, detail = (body.get(key) for key in ("error", "message", "detail"))
    if isinstance(error, dict):  # {"error": {"code": …, "message": …}}
        message, error = message or error.get("message"), error.get("code")
    problems = _texts(body.get("problems"), reply) or _texts(detail, reply)
    text = message or (detail if isinstance(detail, str) else "") or error or ""
    return Complaint(
        code=error if isinstance(error, str) and " " not in error else "",
        text=_clean(text, reply.secret),
        problems=problems,
        path=_texts(body.get("path"), reply),
        revision=newer if isinstance(newer := body.get("revision"), dict) else None,
    )


def error_of(reply: Reply, *, writing: bool = False) -> SiloError:
    """The error that a bad status stands for; 503 on ``writing`` is a read-only server, else no server."""
    said = complaint(reply)
    told = f": {said.text}" if said.text else ""
    asked, host, status = reply.where.asked, reply.where.host, reply.status
    if status == 401 and not reply.secret:
        return AuthError(
            f"{host} wants a token, and none was given. `silo-mod login URL` asks for one and keeps it; "
            "SILO_API_TOKEN or the settings name one too"
        )
    if status == 401:
        return AuthError(
            f"{host} does not accept the token{told}. Give a valid one (SILO_API_TOKEN, or the settings; "
            "`silo-mod doctor` shows which one is used)"
        )
    if status == 403:
        return ForbiddenError(f"{asked}: this token may not do that{told}. Ask for the editor role")
    if status == 404 and reply.is_html:
        return WebPageError(
            f"{asked}: not found, says a web page{told}; is this the address of a Silo server?"
        )
    if status in (405, 501) or (status == 404 and _router_speaks(said)):
        return RouteMissingError(f"{asked}: this server does not know the request ({status}){told}")
    if status in (404, 410):
        return NotFoundError(f"{asked}: not found{told}")
    if status == 409:
        if said.code == NewerRevisionError.code and said.revision is not None:
            return NewerRevisionError(f"{asked}{told}", said.revision)
        if said.code == MissingRevisionError.code:
            return MissingRevisionError(f"{asked}{told}")
        cycle = len(said.path) > 1
        return (
            CycleError(said.path)
            if cycle
            else ConflictError(f"{asked}: in conflict with what is there{told}")
        )
    if status == 412:
        return VersionConflictError(
            f"{asked}: somebody changed it meanwhile{told}. Read it again, then repeat"
        )
    later = retry_after(reply) if status in _LATER else None
    if status == 503 and writing and not reply.is_html and _read_only(said, later):
        return _put_off(
            ReadOnlyError(f"{host} takes no changes now{told}. Nothing is lost; it can be sent later"), later
        )
    if status == 429 or (status == 503 and later is not None):
        when = f"in {_duration(later)}" if later is not None else "later"
        return _put_off(BusyError(f"{host} is busy ({status}){told}. Try again {when}"), later)
    if status in _LATER:
        gone = UnreachableError(f"{host} cannot answer now ({status}){told}. Try again later")
        return _put_off(gone, later)
    if 400 <= status < 500:
        what = "; ".join(said.problems[:10]) or said.text or "no reason given"
        rejected = RejectedError(f"{asked}: not accepted ({status}): {what}", said.problems)
        rejected.status = status
        return rejected
    return ServerFaultError(f"{asked}: the server failed ({status}){told}")


def retry_after(reply: Reply) -> float | None:
    """The pause that the answer asks for, in seconds; None where it names none that can be read."""
    text = reply.headers.get("Retry-After", "").strip()
    if (seconds := whole_number(text, 300)) is not None:
        return float(seconds)
    try:
        return max(0.0, parsedate_to_datetime(text).timestamp() - time.time())
    except (ValueError, TypeError, OverflowError):
        return None


def _put_off(error: RemoteError, seconds: float | None) -> RemoteError:
    error.retry_after = seconds
    return error


def _read_only(said: Complaint, later: float | None) -> bool:
    # A server that names a time is busy, unless it says itself that it is read-only.
    named = _READ_ONLY.search(f"{said.code} {said.text}") is not None
    return named or (later is None and said.code not in _AWAY)


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} min"


def _router_speaks(said: Complaint) -> bool:
    named = said.code == RouteMissingError.code or said.text.startswith("Not Found: ")
    return named or (not said.code and said.text in _ROUTER_SAYS)


def _under(data: Any, keys: Sequence[str]) -> Any:
    return next((data[key] for key in keys if key in data), data) if isinstance(data, dict) else data


def _titled(reply: Reply) -> str:
    found = _TITLE.search(reply.content[:20_000].decode("utf-8", "replace"))
    return f" ({_clean(html.unescape(found[1]), reply.secret)})" if found else ""


def _texts(value: Any, reply: Reply) -> tuple[str, ...]:
    if not isinstance(value, list):
        return ()
    return tuple(_clean(_problem(entry), reply.secret) for entry in value[:1000])


def _problem(entry: Any) -> Any:
    if isinstance(entry, dict) and "msg" in entry:  # pydantic's form, as FastAPI sends it
        place = ".".join(str(part) for part in entry.get("loc", ()) if part != "body")
        return f"{place}: {entry['msg']}" if place else entry["msg"]
    return entry


def _clean(value: Any, secret: str | None) -> str:
    # A server's text is shown to people: one line, bounded, no terminal codes, and never our own token.
    text = value if isinstance(value, str) else json.dumps(value, ensure_ascii=False, default=str)
    if secret:
        text = text.replace(secret, "[token]")
    text = " ".join(_CONTROL.sub(" ", text).split())
    return text if len(text) <= _MAX_TEXT else text[: _MAX_TEXT - 1] + "…"
