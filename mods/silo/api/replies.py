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
from urllib.parse import parse_qsl, urlsplit

from pydantic import BaseModel, TypeAdapter

from silo.api.foreign import Where, translated
from silo.api.pause import LONGEST_TOLD
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
    duration,
)
from silo.bom.message import from_json, joined, message
from silo.bom.numbers import whole_number
from silo.bounded_json import read_json
from silo.budget import Budget, OverBudgetError
from silo.proposed_command import proposed

Model = TypeVar("Model", bound=BaseModel)

# The largest BOM that is asked for at once has 200 000 lines of some twenty values; a hostile server can
# write thirty times as many containers into as many bytes.
ANSWER = Budget(bytes=1 << 30, objects=1_000_000, cells=8_000_000, depth=1000, text=1 << 30)
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
        """Return True if the answer is a web page; no route of the API sends one."""
        kind = self.headers.get("Content-Type", "").lower()
        return "html" in kind or self.content[:200].lstrip()[:1] == b"<"

    @property
    def total(self) -> int:
        """Return how many things there are on all pages; 0 if the server does not say."""
        data = self.data() if "X-Total-Count" not in self.headers else None
        header = data.get("total") if isinstance(data, dict) else self.headers.get("X-Total-Count", "")
        return whole_number(str(header)) or 0

    @property
    def next(self) -> dict[str, str]:
        """Return the parameters of the next page that the answer names; {} if it names none."""
        data = self.data()
        links = re.search(r'<([^<>]*)>;[^,<]*rel="?next\b', self.headers.get("Link", ""))
        address = links[1] if links else data.get("next") if isinstance(data, dict) else None
        return dict(parse_qsl(urlsplit(address).query)) if isinstance(address, str) else {}

    def data(self) -> Any:
        """Read the JSON of a good answer. Raises :class:`ServerFaultError` if it is none."""
        if self.is_html:
            raise ServerFaultError(
                message(
                    "{asked} answered with a web page instead of data{titled}; check that the address is "
                    "that of a Silo server",
                    asked=self.where.asked,
                    titled=_titled(self),
                )
            )
        with translated(self.where):
            try:
                return read_json(self.content, ANSWER, self.where.asked)
            except OverBudgetError as error:
                raise ServerFaultError(str(error)) from None

    def mapping(self, accept: Sequence[int] = ()) -> dict[str, Any]:
        """Read the answer as a JSON object; a bad status that is not in ``accept`` raises the error of
        :func:`error_of`.
        """
        if not self.ok and (self.status not in accept or self.is_html):
            raise error_of(self)
        data = self.data()
        if not isinstance(data, dict):
            raise ServerFaultError(
                message("{asked} answered no object where one was wanted", asked=self.where.asked)
            )
        return data

    def version(self) -> str | None:
        """Return the version in the answer: its ETag, or ``version`` in its body; None if it has neither."""
        tag = self.headers.get("ETag", "").removeprefix("W/").strip('"')
        data = self.data() if not tag else None
        return tag or (str(data["version"]) if isinstance(data, dict) and "version" in data else None)

    def model(self, kind: type[Model]) -> Model:
        """Read the answer as one of the wire models."""
        data = self.data()
        with translated(self.where):
            return kind.model_validate(data)

    def is_null(self, *keys: str) -> bool:
        """Return True if the answer has null in place of the list: as a whole, or under one of ``keys``."""
        return _under(self.data(), keys) is None

    def models(self, kind: type[Model], *keys: str) -> list[Model]:
        """Read the answer as a list of models: a bare list, or an object that holds the list under one of
        ``keys``.
        """
        models_read = _under(self.data(), keys)
        if models_read is None:
            models_read = []  # Go's empty list
        if not isinstance(models_read, list):
            raise ServerFaultError(
                message(
                    "{asked} answered no list where one was wanted ({keys})",
                    asked=self.where.asked,
                    keys=", ".join(keys),
                )
            )
        with translated(self.where):
            return TypeAdapter(list[kind]).validate_python(models_read)  # type: ignore[valid-type]


@dataclass(frozen=True)
class Complaint:
    """What an error body says, whatever its form: machine code, text for people, and the list of problems."""

    code: str = ""
    text: str = ""
    problems: tuple[str, ...] = ()
    path: tuple[str, ...] = ()
    revision: dict[str, Any] | None = None


def complaint(reply: Reply) -> Complaint:
    """Read the body of an error answer; never fails, whatever the bytes are."""
    if reply.is_html:
        return Complaint(text=_clean(_titled(reply).strip(" ()"), reply.secret))
    try:
        body = read_json(reply.content, ANSWER, reply.where.asked)
    except (ValueError, OverBudgetError):
        return Complaint(text=_clean(reply.content[: 8 * _MAX_TEXT].decode("utf-8", "replace"), reply.secret))
    if not isinstance(body, dict):
        return Complaint(text=_clean(body, reply.secret))
    error, message, detail = (body.get(key) for key in ("error", "message", "detail"))
    if isinstance(error, dict):  # {"error": {"code": …, "message": …}}
        message, error = message or error.get("message"), error.get("code")
    problems = _problems(body, reply) or _texts(detail, reply)
    text = message or (detail if isinstance(detail, str) else "") or error or ""
    return Complaint(
        code=error if isinstance(error, str) and " " not in error else "",
        text=_with_values(_clean(text, reply.secret), body),
        problems=problems,
        path=_texts(body.get("path"), reply),
        revision=newer if isinstance(newer := body.get("revision"), dict) else None,
    )


def error_of(reply: Reply, *, writing: bool = False) -> SiloError:
    """Return the error that a bad status means. A 503 while ``writing`` can mean a read-only server."""
    reported = complaint(reply)
    detail = message(": {text}", text=reported.text) if reported.text else ""
    asked, host, status = reply.where.asked, reply.where.host, reply.status
    if status == 401 and not reply.secret:
        login = proposed("login", reply.where.host)
        return AuthError(
            message(
                "{host} wants a token, and none was given. {login} asks for one and keeps it; "
                "SILO_API_TOKEN or the settings name one too",
                host=host,
                login=login,
            )
        )
    if status == 401:
        return AuthError(
            message(
                "{host} does not accept the token{detail}. Give a valid one (SILO_API_TOKEN, or the "
                "settings; `silo-mod doctor` shows which one is used)",
                host=host,
                detail=detail,
            )
        )
    if status == 403:
        return ForbiddenError(
            message(
                "{asked}: this token may not do that{detail}. Ask for the editor role",
                asked=asked,
                detail=detail,
            )
        )
    if status == 404 and reply.is_html:
        return WebPageError(
            message(
                "{asked}: not found, says a web page{detail}; is this the address of a Silo server?",
                asked=asked,
                detail=detail,
            )
        )
    if status in (405, 501) or (status == 404 and _router_speaks(reported)):
        return RouteMissingError(
            message(
                "{asked}: this server does not know the request ({status}){detail}",
                asked=asked,
                status=status,
                detail=detail,
            )
        )
    if status in (404, 410):
        return NotFoundError(message("{asked}: not found{detail}", asked=asked, detail=detail))
    if status == 409:
        if reported.code == NewerRevisionError.code and reported.revision is not None:
            return NewerRevisionError(joined("", (asked, detail)), reported.revision)
        if reported.code == MissingRevisionError.code:
            return MissingRevisionError(joined("", (asked, detail)))
        cycle = len(reported.path) > 1
        return (
            CycleError(reported.path)
            if cycle
            else ConflictError(
                message("{asked}: in conflict with the present data{detail}", asked=asked, detail=detail)
            )
        )
    if status == 412:
        return VersionConflictError(
            message(
                "{asked}: somebody changed it meanwhile{detail}. Read it again, then repeat",
                asked=asked,
                detail=detail,
            )
        )
    later = retry_after(reply) if status in _LATER else None
    if status == 503 and writing and not reply.is_html and _read_only(reported, later):
        closed = ReadOnlyError(
            message(
                "{host} takes no changes now{detail}. Nothing is lost; it can be sent later",
                host=host,
                detail=detail,
            )
        )
        closed.named = _names_read_only(reported)
        return _put_off(closed, later)
    if status == 429 or (status == 503 and later is not None):
        # The same time as that of the pause: a server that names years is asked again after an hour.
        soon = None if later is None else min(later, LONGEST_TOLD)
        when = message("in {later}", later=duration(soon)) if soon is not None else "later"
        return _put_off(
            BusyError(
                message(
                    "{host} is busy ({status}){detail}. Try again {when}",
                    host=host,
                    status=status,
                    detail=detail,
                    when=when,
                )
            ),
            later,
        )
    if status in _LATER:
        gone = UnreachableError(
            message(
                "{host} cannot answer now ({status}){detail}. Try again later",
                host=host,
                status=status,
                detail=detail,
            )
        )
        gone.refused = status == 503
        return _put_off(gone, later)
    if 400 <= status < 500:
        what = joined("; ", reported.problems[:10]) or reported.text or message("no reason given")
        rejected = RejectedError(
            message("{asked}: not accepted ({status}): {what}", asked=asked, status=status, what=what),
            reported.problems,
        )
        rejected.status = status
        return rejected
    return ServerFaultError(
        message("{asked}: the server failed ({status}){detail}", asked=asked, status=status, detail=detail)
    )


def retry_after(reply: Reply) -> float | None:
    """Return the pause, in seconds, that the answer asks for; None if it names none that can be read."""
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


def _read_only(reported: Complaint, later: float | None) -> bool:
    # A server that names a time is busy, unless it says itself that it is read-only.
    return _names_read_only(reported) or (later is None and reported.code not in _AWAY)


def _names_read_only(reported: Complaint) -> bool:
    return _READ_ONLY.search(f"{reported.code} {reported.text}") is not None


def _router_speaks(reported: Complaint) -> bool:
    named = reported.code == RouteMissingError.code or reported.text.startswith("Not Found: ")
    return named or (not reported.code and reported.text in _ROUTER_SAYS)


def _under(data: Any, keys: Sequence[str]) -> Any:
    return next((data[key] for key in keys if key in data), data) if isinstance(data, dict) else data


def _titled(reply: Reply) -> str:
    match = _TITLE.search(reply.content[:20_000].decode("utf-8", "replace"))
    return message(" ({secret})", secret=_clean(html.unescape(match[1]), reply.secret)) if match else ""


def _texts(value: Any, reply: Reply) -> tuple[str, ...]:
    if not isinstance(value, list):
        return ()
    return tuple(_clean(_problem(entry), reply.secret) for entry in value[:1000])


def _problems(body: dict[str, Any], reply: Reply) -> tuple[str, ...]:
    texts, told = _texts(body.get("problems"), reply), body.get("problem_messages")
    if not isinstance(told, list) or len(told) < len(texts):
        return texts
    return tuple(_with_values(text, entry) for text, entry in zip(texts, told, strict=False))


def _with_values(text: str, told: object) -> str:
    """Return a sentence with the template and values that a server sends beside it, so that it can be shown
    in the user's language; the sentence as it is, if they do not make it.
    """
    made = from_json(told)
    return made if made is not None and made == text else text


def _problem(entry: Any) -> Any:
    if isinstance(entry, dict) and "msg" in entry:  # pydantic's form, as FastAPI sends it
        place = ".".join(str(part) for part in entry.get("loc", ()) if part != "body")
        return message("{place}: {entry}", place=place, entry=entry["msg"]) if place else entry["msg"]
    return entry


def _clean(value: Any, secret: str | None) -> str:
    # A server's text is shown to people: one line, bounded, no terminal codes, and never our own token.
    text = value if isinstance(value, str) else json.dumps(value, ensure_ascii=False, default=str)
    if secret:
        text = text.replace(secret, "[token]")
    text = " ".join(_CONTROL.sub(" ", text).split())
    return text if len(text) <= _MAX_TEXT else text[: _MAX_TEXT - 1] + "…"
