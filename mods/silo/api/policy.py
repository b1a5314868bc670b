# SPDX-License-Identifier: LGPL-2.1-or-later
"""The one retry and error policy: for single requests, the queue, the event listener, timers and batches.

Three questions about an error have their answer here and nowhere else:

* :func:`may_repeat`: may this very request be sent again at once?
* :func:`judge`: whom does the error concern, and who can mend it?
* :class:`Backoff`: how long is the pause before the next attempt? A :class:`Pause` is that of one server.

=========================================  =============  ==================================================
error                                      concerns       then
=========================================  =============  ==================================================
no answer, 5xx, a proxy's web page         one or all (1) retry
429, 503 with Retry-After, read-only       all            retry, not before the time that the server named
401, an unusable configuration             all            a person: token, settings
cancelled                                  all            retry when a person wants it
403, a request that the server lacks       one kind (2)   a person (403); retry (a newer server may have it)
404                                        one            retry (the server may be another one for a while)
409, 412, other 4xx, bad input             one            a person
=========================================  =============  ==================================================

1. ``alive`` finds out: where the server answers a plain question, only this entry has trouble.
2. A run that sends one kind of request stops. A queue continues: rights may differ between items.

The one place where foreign errors become ours: requests, urllib3, ssl, sockets, JSON, pydantic.

``translated`` wraps the code that may raise them. A test holds the table complete: each exception class that
these libraries define has a line here, so a new one does not slip through as itself.

What came back: a status and bytes, read as data or as one of our errors. No network in here.

Error bodies are read in every form that is seen: ``{"error": code, "message": text}``, ``{"error": text}``, a
bare string, FastAPI's ``detail``, and the HTML page of a proxy in between.
"""

from __future__ import annotations

import html
import http.client
import json
import math
import random
import re
import socket
import ssl
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from email.utils import parsedate_to_datetime
from enum import StrEnum
from typing import Any, TypeVar
from urllib.parse import parse_qsl, urlsplit

import pydantic
import requests
import urllib3.exceptions as u3
from pydantic import BaseModel, TypeAdapter
from requests import exceptions as rq

from silo.api.config import LONGEST_TOLD, Pause
from silo.bom.errors import (
    AuthError,
    BusyError,
    CancelledError,
    ConfigError,
    ConflictError,
    CycleError,
    ForbiddenError,
    InputError,
    MissingRevisionError,
    NewerRevisionError,
    NotFoundError,
    NotSentError,
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
from silo.bom.numbers import whole_number

FOREIGN: tuple[type[Exception], ...] = (
    rq.RequestException,
    u3.HTTPError,
    http.client.HTTPException,
    pydantic.ValidationError,
    pydantic.PydanticUserError,
    RecursionError,
    ValueError,
    OSError,
)


@dataclass(frozen=True)
class Where:
    """What a message needs: whom we asked, for what, and how long we were ready to wait (seconds)."""

    host: str
    subject: str = ""
    connect: float = 0.0
    read: float = 0.0

    @property
    def asked(self) -> str:
        """Return ``host``, or with the subject ``host (the BOM of ASM-001)``."""
        return f"{self.host} ({self.subject})" if self.subject else self.host


_Kind = tuple[type[SiloError], str]

_REFUSED: _Kind = (
    NotSentError,
    "nothing answers at {host}: is the Silo server running, and is the address right? "
    "`silo-mod serve` starts one on this computer",
)
_UNKNOWN_NAME: _Kind = (
    NotSentError,
    "the name in {host} is not known here: check the address, the network or the VPN",
)
_SLOW_CONNECT: _Kind = (
    NotSentError,
    "{host} could not be reached within {connect:g} s: check the network or the VPN",
)
_SLOW_ANSWER: _Kind = (
    UnreachableError,
    "{asked} was silent for {read:g} s; try again, or allow a longer time",
)
_BROKEN: _Kind = (
    UnreachableError,
    "{asked} closed the connection before the answer was complete; try again",
)
_TLS: _Kind = (
    NotSentError,
    "no secure connection to {host}: its certificate is not trusted here, or it speaks no https. "
    "For an own certificate authority give its file in SILO_SSL_VERIFY",
)
_PROXY: _Kind = (NotSentError, "the proxy on the way to {host} does not let us through; check its settings")
_ADDRESS: _Kind = (
    ConfigError,
    "{host}: this server address cannot be used; write it like https://silo.example.com",
)
# The library's own text quotes the header's value, which may be the token.
_HEADER: _Kind = (ConfigError, "{host}: the token or a header holds characters that HTTP does not allow")
_LOOP: _Kind = (ServerFaultError, "{asked} redirects in a circle; check the server address")
_GARBLED: _Kind = (
    ServerFaultError,
    "{asked} answered something that cannot be understood; is this the address of a Silo server?",
)
_OURS: _Kind = (InputError, "{asked}: what was to be sent cannot be put into a request")

_REQUESTS: tuple[tuple[_Kind, str], ...] = (
    (_BROKEN, "RequestException ConnectionError ChunkedEncodingError RetryError"),
    (_SLOW_CONNECT, "ConnectTimeout"),
    (_SLOW_ANSWER, "ReadTimeout Timeout"),
    (_TLS, "SSLError"),
    (_PROXY, "ProxyError InvalidProxyURL"),
    (_GARBLED, "ContentDecodingError StreamConsumedError InvalidJSONError JSONDecodeError HTTPError"),
    (_LOOP, "TooManyRedirects"),
    (_ADDRESS, "URLRequired MissingSchema InvalidSchema InvalidURL"),
    (_HEADER, "InvalidHeader"),
    (_OURS, "UnrewindableBodyError"),
)
_URLLIB3: tuple[tuple[_Kind, str], ...] = (
    (
        _BROKEN,
        "HTTPError PoolError RequestError MaxRetryError ProtocolError IncompleteRead "
        "InvalidChunkLength EmptyPoolError ClosedPoolError ResponseError FullPoolError",
    ),
    (_LOOP, "HostChangedError"),
    (_TLS, "SSLError"),
    (_PROXY, "ProxyError ProxySchemeUnknown ProxySchemeUnsupported"),
    (_GARBLED, "DecodeError ResponseNotChunked BodyNotHttplibCompatible InvalidHeader HeaderParsingError"),
    (_SLOW_ANSWER, "TimeoutError TimeoutStateError ReadTimeoutError"),
    (_SLOW_CONNECT, "ConnectTimeoutError"),
    (_REFUSED, "NewConnectionError"),
    (_ADDRESS, "LocationValueError LocationParseError URLSchemeUnknown"),
    (_OURS, "UnrewindableBodyError"),
    (_UNKNOWN_NAME, "NameResolutionError"),
)
# The most specific class wins, by the order in the class's own ancestry (its MRO).
TABLE: dict[type, _Kind] = {
    getattr(library, name): kind
    for library, rows in ((rq, _REQUESTS), (u3, _URLLIB3))
    for kind, names in rows
    for name in names.split()
    if hasattr(library, name)  # some are of urllib3 2 alone
}
TABLE |= {
    http.client.HTTPException: _BROKEN,
    pydantic.ValidationError: _GARBLED,
    pydantic.PydanticUserError: _GARBLED,
    UnicodeError: _GARBLED,
    RecursionError: _GARBLED,
    ValueError: _GARBLED,
    ssl.SSLError: _TLS,
    socket.gaierror: _UNKNOWN_NAME,
    ConnectionRefusedError: _REFUSED,
    TimeoutError: _SLOW_ANSWER,
    OSError: _BROKEN,
}

# Wrappers that say less than the error inside them.
_WRAPPERS = (rq.ConnectionError, rq.ChunkedEncodingError, u3.MaxRetryError, u3.ProtocolError)


def translate(error: Exception, where: Where) -> SiloError:
    """Turn an error of another library into one of ours, in plain words. It never quotes a header."""
    exception = _innermost(error)
    kind, text = next((TABLE[cause] for cause in type(exception).__mro__ if cause in TABLE), _GARBLED)
    return kind(text.format(host=where.host, asked=where.asked, connect=where.connect, read=where.read))


@contextmanager
def translated(where: Where) -> Iterator[None]:
    """Turn errors of other libraries inside the block into ours."""
    try:
        yield
    except SiloError:
        raise
    except FOREIGN as error:
        if isinstance(error, requests.RequestException):
            # They hold the whole request, including the token in its headers; no caller needs that.
            error.request = error.response = None
        raise translate(error, where) from error


def _innermost(error: Exception) -> Exception:
    """Follow wrapped errors to the innermost: "max retries exceeded" is only the outside of "connection
    refused".
    """
    for _ in range(8):
        inner = getattr(error, "reason", None) or next(iter(error.args), None)
        if type(error) not in _WRAPPERS or not isinstance(inner, Exception):
            return error
        error = inner
    return error


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
        links = re.search(r'<([^>]*)>;[^,]*rel="?next\b', self.headers.get("Link", ""))
        address = links[1] if links else data.get("next") if isinstance(data, dict) else None
        return dict(parse_qsl(urlsplit(address).query)) if isinstance(address, str) else {}

    def data(self) -> Any:
        """Read the JSON of a good answer. Raises :class:`ServerFaultError` if it is none."""
        if self.is_html:
            raise ServerFaultError(
                f"{self.where.asked} answered with a web page instead of data{_titled(self)}; "
                "check that the address is that of a Silo server"
            )
        with translated(self.where):
            return json.loads(self.content)

    def mapping(self, accept: Sequence[int] = ()) -> dict[str, Any]:
        """Read the answer as a JSON object; a bad status that is not in ``accept`` raises the error of
        :func:`error_of`.
        """
        if not self.ok and (self.status not in accept or self.is_html):
            raise error_of(self)
        data = self.data()
        if not isinstance(data, dict):
            raise ServerFaultError(f"{self.where.asked} answered no object where one was wanted")
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
                f"{self.where.asked} answered no list where one was wanted ({', '.join(keys)})"
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
    """Return the error that a bad status means. A 503 while ``writing`` can mean a read-only server."""
    reported = complaint(reply)
    detail = f": {reported.text}" if reported.text else ""
    asked, host, status = reply.where.asked, reply.where.host, reply.status
    if status == 401 and not reply.secret:
        return AuthError(
            f"{host} wants a token, and none was given. `silo-mod login URL` asks for one and keeps it; "
            "SILO_API_TOKEN or the settings name one too"
        )
    if status == 401:
        return AuthError(
            f"{host} does not accept the token{detail}. Give a valid one (SILO_API_TOKEN, or the settings; "
            "`silo-mod doctor` shows which one is used)"
        )
    if status == 403:
        return ForbiddenError(f"{asked}: this token may not do that{detail}. Ask for the editor role")
    if status == 404 and reply.is_html:
        return WebPageError(
            f"{asked}: not found, says a web page{detail}; is this the address of a Silo server?"
        )
    if status in (405, 501) or (status == 404 and _router_speaks(reported)):
        return RouteMissingError(f"{asked}: this server does not know the request ({status}){detail}")
    if status in (404, 410):
        return NotFoundError(f"{asked}: not found{detail}")
    if status == 409:
        if reported.code == NewerRevisionError.code and reported.revision is not None:
            return NewerRevisionError(f"{asked}{detail}", reported.revision)
        if reported.code == MissingRevisionError.code:
            return MissingRevisionError(f"{asked}{detail}")
        cycle = len(reported.path) > 1
        return (
            CycleError(reported.path)
            if cycle
            else ConflictError(f"{asked}: in conflict with the present data{detail}")
        )
    if status == 412:
        return VersionConflictError(
            f"{asked}: somebody changed it meanwhile{detail}. Read it again, then repeat"
        )
    later = retry_after(reply) if status in _LATER else None
    if status == 503 and writing and not reply.is_html and _read_only(reported, later):
        closed = ReadOnlyError(f"{host} takes no changes now{detail}. Nothing is lost; it can be sent later")
        closed.named = _names_read_only(reported)
        return _put_off(closed, later)
    if status == 429 or (status == 503 and later is not None):
        when = f"in {duration(later)}" if later is not None else "later"
        return _put_off(BusyError(f"{host} is busy ({status}){detail}. Try again {when}"), later)
    if status in _LATER:
        gone = UnreachableError(f"{host} cannot answer now ({status}){detail}. Try again later")
        gone.refused = status == 503
        return _put_off(gone, later)
    if 400 <= status < 500:
        what = "; ".join(reported.problems[:10]) or reported.text or "no reason given"
        rejected = RejectedError(f"{asked}: not accepted ({status}): {what}", reported.problems)
        rejected.status = status
        return rejected
    return ServerFaultError(f"{asked}: the server failed ({status}){detail}")


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
    return f" ({_clean(html.unescape(match[1]), reply.secret)})" if match else ""


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


class ErrorScope(StrEnum):
    """What an error concerns."""

    ENTRY = "entry"  # this item or entry; others may succeed
    KIND = "kind"  # every request of this kind
    ALL = "all"  # everything for this server


class Then(StrEnum):
    """Who can mend it."""

    RETRY = "retry"  # nobody needs to do anything: try again later
    PERSON = "person"  # the answer stays the same until a person changes something


@dataclass(frozen=True)
class Verdict:
    """What to do after an error. ``wait``: seconds that the server asked for; None where it named none."""

    scope: ErrorScope
    then: Then
    wait: float | None = None


def judge(error: SiloError, alive: Callable[[], object] | None = None) -> Verdict:
    """Decide whom ``error`` concerns, and what helps.

    alive
        a plain question to the server, such as ``client.ready``; raises SiloError if it gets no answer. Asked
        only if the error itself does not show whether it concerns one entry or all.
    """
    wait = told_wait(error)
    if isinstance(error, (BusyError, ReadOnlyError, CancelledError)):
        return Verdict(ErrorScope.ALL, Then.RETRY, wait)
    if isinstance(error, ForbiddenError):
        return Verdict(ErrorScope.KIND, Then.PERSON)
    if isinstance(error, (AuthError, ConfigError)):
        return Verdict(ErrorScope.ALL, Then.PERSON)
    if isinstance(error, NotSentError):
        return Verdict(ErrorScope.ALL, Then.RETRY)
    if isinstance(error, (UnreachableError, ServerFaultError, WebPageError)):
        scope = ErrorScope.ALL if alive is None and isinstance(error, UnreachableError) else ErrorScope.ENTRY
        try:
            if alive is not None:
                alive()
        except SiloError:
            scope = ErrorScope.ALL
        return Verdict(scope, Then.RETRY, wait)
    if isinstance(error, RouteMissingError):
        return Verdict(ErrorScope.KIND, Then.RETRY)
    if isinstance(error, NotFoundError):
        return Verdict(ErrorScope.ENTRY, Then.RETRY, wait)
    return Verdict(ErrorScope.ENTRY, Then.PERSON)


def is_certain(error: SiloError) -> bool:
    """Return True if the server certainly did not do what was asked, and the error concerns only that: the
    rest may be sent.
    """
    if isinstance(error, ReadOnlyError):
        return not error.named
    if isinstance(error, UnreachableError):
        return error.refused
    lost = isinstance(error, ServerFaultError | WebPageError)
    return not lost and judge(error, lambda: None).scope is not ErrorScope.ALL


def ends_run(error: SiloError, api: object = None) -> bool:
    """Return True if a run that sends one kind of request for many items must not try the next item.

    api
        the server's client; its ``ready`` shows if only this item had trouble.
    """
    return judge(error, getattr(api, "ready", None)).scope is not ErrorScope.ENTRY


def told_wait(error: SiloError) -> float | None:
    """Return the pause that the server named with this error, in seconds, within bounds."""
    value = getattr(error, "retry_after", None)
    return None if value is None else min(float(value), LONGEST_TOLD)


def may_repeat(error: SiloError, *, harmless: bool) -> bool:
    """Return True if the same request may be sent again without a person.

    harmless
        the request may arrive twice: a question, or a change that names itself.

    Any other change is repeated only if the server certainly did not process it: it never left this computer,
    or the server asked to wait (429, 503 with Retry-After).
    """
    return isinstance(error, (NotSentError, BusyError)) or (harmless and isinstance(error, UnreachableError))


@dataclass(frozen=True)
class Backoff:
    """Growing pauses, in seconds: each is twice as long as the last."""

    first: float = 1.0
    longest: float = 60.0

    def pause(self, attempt: int, chance: float, wanted_s: float | None = None) -> float:
        """Return the pause [s] after failed attempt ``attempt`` (from 1).

        ``chance`` in [0, 1) takes off up to half, so that many clients do not return in one moment.
        ``wanted_s`` is the server's own wish: the pause is never shorter.
        """
        full = min(self.longest, self.first * 2.0 ** min(attempt - 1, 60))
        return max(full * (1.0 - chance / 2.0), wanted_s or 0.0)


# Of the queue of commits.
QUEUE_PAUSES = Backoff(first=5.0, longest=900.0)


def pause_after(
    error: SiloError, before: Pause | None, now: float, backoff: Backoff, chance: float, failures: int = 0
) -> Pause:
    """Make the pause after an error; ``failures`` counts the errors in a row before it, as ``before`` does.

    The known pause ``before`` is kept if it ends later, because another request was promised that time.
    """
    failures = max(failures, before.failures if before is not None else 0) + 1
    wait = told_wait(error)
    refused = isinstance(error, AuthError | ConfigError)
    if isinstance(error, UnreachableError):  # a person who is back in the network wants to see it soon
        backoff = replace(backoff, longest=max(backoff.first, min(backoff.longest, 60.0)))
    until = math.inf if refused else now + backoff.pause(failures, chance, wait)
    if before is not None and before.until > until:
        return before
    return Pause(until, str(error), error.code, failures, wait is not None)


@dataclass(frozen=True)
class Retries:
    """How often one request is tried in all, the first pause and the longest one (seconds).

    ``busy_tries``: the same for a server that puts us off (429, 503 with Retry-After); None: ``tries``.
    ``chance`` gives numbers in [0, 1) that spread many clients out; ``sleep`` waits; ``tell`` gets the
    seconds of each pause and its error before.
    """

    tries: int = 3
    first: float = 0.25
    longest: float = 10.0
    chance: Callable[[], float] = random.random
    sleep: Callable[[float], object] = time.sleep
    busy_tries: int | None = None
    tell: Callable[[float, SiloError], object] = lambda _seconds, _error: None

    def pause(self, attempt: int, error: SiloError, *, harmless: bool) -> float | None:
        """Return how many seconds to wait after failed attempt ``attempt`` (from 1); None: give up and report
        the error.
        """
        value = getattr(error, "retry_after", None)
        tries = self.busy_tries if self.busy_tries and isinstance(error, BusyError) else self.tries
        if attempt >= tries or not may_repeat(error, harmless=harmless):
            return None
        if value is not None:
            return float(value) if value <= self.longest else None
        return Backoff(self.first, self.longest).pause(attempt, self.chance())


# A job at night waits for a server that is busy.
NIGHT = Retries(busy_tries=12, longest=120.0)
