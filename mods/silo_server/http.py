# SPDX-License-Identifier: LGPL-2.1-or-later
"""Around the whole application: an id for each request, a line of log, metrics, the sub-path.

The id is the caller's own ``X-Request-ID`` if it has a plain one; it is in the answer's headers, in the
log line, and in the log of a fault. Log lines are JSON on standard error (``SILO_REQUEST_LOG``); they never
hold a query, a token or a login link's secret.

Every error of every route in one JSON shape (:class:`silo.api.wire.ErrorBody`); never a stack trace.

Around every route: the limit of a request's size, headers that keep a browser strict, compression.
"""

from __future__ import annotations

import asyncio
import errno
import json
import logging
import re
import secrets
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from sqlalchemy.exc import DataError, DBAPIError, IntegrityError, OperationalError
from sqlalchemy.exc import TimeoutError as PoolTimeoutError
from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import ClientDisconnect
from starlette.responses import JSONResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from silo.bom.errors import (
    BusyError,
    CycleError,
    NewerRevisionError,
    ReadOnlyError,
    RejectedError,
    RouteMissingError,
    SiloError,
)
from silo_server.errors import InDoubtError, TooManyAttemptsError, cause_of
from silo_server.housekeeping import Metrics
from silo_server.settings import MIB, Settings
from silo_server.times import stamp, utc_now

request_logger = logging.getLogger("silo_server.requests")

HEADER = "X-Request-ID"
KEY = "silo.request"
_PLAIN = re.compile(r"[A-Za-z0-9._-]{1,64}")
_SECRET_PATH = re.compile(r"^/login/link/.+")


@dataclass(slots=True)
class RequestInfo:
    """What the log says of a request; ``user`` once it is known."""

    id: str
    user: str | None = None


def info_of(scope: Scope) -> RequestInfo:
    """Return the info of a request; a new one if the application runs without :class:`Observed`."""
    info = scope.get(KEY)
    return info if isinstance(info, RequestInfo) else RequestInfo("-")


class Observed:
    """The application with ids, log and metrics; nothing that it raises goes further.

    A fault was logged with its request id by ``failures`` already; uvicorn would write it a second time.
    """

    def __init__(self, app: ASGIApp, settings: Settings, metrics: Metrics) -> None:
        self.app = app
        self._root = settings.root_path
        self._metrics = metrics
        self._log = settings.request_log

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        given = Headers(scope=scope).get(HEADER, "")
        info = RequestInfo(given if _PLAIN.fullmatch(given) else secrets.token_hex(8))
        inner = self._without_root({**scope, KEY: info})
        status = 0
        started = time.perf_counter()

        async def observed(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                headers = MutableHeaders(scope=message)
                headers[HEADER] = info.id
                target = headers.get("location", "")
                if self._root and target.startswith("/") and not target.startswith("//"):
                    headers["location"] = self._root + target
            await send(message)

        try:
            await self.app(inner, receive, observed)
        except Exception as error:
            if not status:
                request_logger.error("request %s was not answered", info.id, exc_info=error)
        finally:
            self._note(inner, info, status, time.perf_counter() - started)

    def _without_root(self, scope: Scope) -> Scope:
        # A proxy may pass the sub-path on or not; from here on there is none.
        path: str = scope["path"]
        if self._root and (path == self._root or path.startswith(self._root + "/")):
            return {**scope, "path": path[len(self._root) :] or "/"}
        return scope

    def _note(self, scope: Scope, info: RequestInfo, status: int, seconds: float) -> None:
        route = getattr(scope.get("route"), "path", "")
        self._metrics.request(scope["method"], route or "unknown", status, seconds)
        if not self._log:
            return
        client = scope.get("client")
        request_logger.info(
            json.dumps(
                {
                    "time": stamp(utc_now()),
                    "id": info.id,
                    "method": scope["method"],
                    "path": _SECRET_PATH.sub("/login/link/…", scope["path"]),
                    "status": status,
                    "ms": round(seconds * 1000, 1),
                    "user": info.user,
                    "address": client[0] if client else None,
                },
                ensure_ascii=False,
            )
        )


def log_to_stderr(settings: Settings) -> None:
    """Write a line of JSON for each request to standard error, if the settings ask for it."""
    if settings.request_log:
        handler: logging.Handler = logging.StreamHandler(sys.stderr)
        handler.setFormatter(logging.Formatter("%(message)s"))
        request_logger.addHandler(handler)
        request_logger.propagate = False
        request_logger.setLevel(logging.INFO)


logger = logging.getLogger("silo_server")
RETRY_SECONDS = "5"


def install(app: FastAPI) -> None:
    """Make ``app`` answer each error in the one JSON shape."""
    app.add_exception_handler(SiloError, _silo_error)
    app.add_exception_handler(RequestValidationError, _validation_error)
    app.add_exception_handler(HTTPException, _http_exception)
    app.add_exception_handler(DBAPIError, _database_error)
    app.add_exception_handler(PoolTimeoutError, _database_error)
    app.add_exception_handler(UnicodeEncodeError, _unicode_error)
    app.add_exception_handler(OSError, _disk_error)
    app.add_exception_handler(ClientDisconnect, _disconnected)
    app.add_exception_handler(Exception, _fault)


def error_answer(
    status: int,
    code: str,
    message: str,
    *,
    problems: Sequence[str] = (),
    path: Sequence[str] = (),
    revision: Mapping[str, Any] | None = None,
    headers: Mapping[str, str] | None = None,
) -> Response:
    """Answer with an error in the one JSON shape; empty details are left out."""
    body: dict[str, Any] = {"error": code, "message": message}
    if problems:
        body["problems"] = list(problems)
    if path:
        body["path"] = list(path)
    if revision is not None:
        body["revision"] = dict(revision)
    return JSONResponse(body, status, dict(headers) if headers else None)


async def _silo_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, SiloError)
    headers: dict[str, str] = {}
    if error.status_hint == 401:
        headers["WWW-Authenticate"] = "Bearer"
    if isinstance(error, ReadOnlyError | BusyError):
        headers["Retry-After"] = RETRY_SECONDS
    if isinstance(error, TooManyAttemptsError):
        headers["Retry-After"] = str(error.retry_after)
    return error_answer(
        error.status_hint,
        error.code,
        str(error),
        problems=error.problems if isinstance(error, RejectedError) else (),
        path=error.path if isinstance(error, CycleError) else (),
        revision=error.revision if isinstance(error, NewerRevisionError) else None,
        headers=headers,
    )


async def _validation_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    problems = [_problem(entry) for entry in error.errors()]
    return error_answer(400, "rejected", f"the request is unusable: {problems[0]}", problems=problems)


def _problem(entry: Mapping[str, Any]) -> str:
    where = [str(part) for part in entry["loc"] if part not in ("body", "query", "path", "header")]
    return f"{'.'.join(where) or 'body'}: {entry['msg'].removeprefix('Value error, ')}"


async def _http_exception(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    codes = {404: RouteMissingError.code, 405: RouteMissingError.code, 413: "too_large"}
    message = str(error.detail)
    if message == HTTPStatus(error.status_code).phrase:
        message = f"{message}: {request.method} {request.url.path}"
    code = codes.get(error.status_code, "rejected" if error.status_code < 500 else "server_fault")
    return error_answer(error.status_code, code, message, headers=error.headers)


async def _database_error(request: Request, error: Exception) -> Response:
    if isinstance(error, DataError):
        return error_answer(400, "rejected", "a value cannot be stored: it is too long, too large or no text")
    if isinstance(error, IntegrityError):
        return error_answer(409, "conflict", "somebody else changed the same thing just now; read it again")
    is_lost = getattr(error, "connection_invalidated", False)  # such as one that was idle for too long
    if is_lost or isinstance(error, OperationalError | PoolTimeoutError):
        logger.error("request %s: the database: %s", info_of(request.scope).id, cause_of(error))
        if request.method not in ("GET", "HEAD") and is_lost:
            # The commit may have come through before the connection was lost; Retry-After would deny that.
            doubt = InDoubtError(
                "the connection to the database was lost; the change may be stored or not. Read it again "
                "before you send it once more"
            )
            return await _silo_error(request, doubt)
        busy = BusyError("the database cannot be reached at the moment; nothing was changed, try again later")
        full = _NO_SPACE.search(cause_of(error)) is not None
        return await _silo_error(request, _FULL if full else busy)
    return await _fault(request, error)


async def _unicode_error(request: Request, error: Exception) -> Response:
    return error_answer(400, "rejected", "a text in the request is no valid Unicode (a lone surrogate)")


async def _fault(request: Request, error: Exception) -> Response:
    number = info_of(request.scope).id
    logger.error("request %s: %s %s failed", number, request.method, request.url.path, exc_info=error)
    return error_answer(
        500, "server_fault", f"the server made a mistake; its log says more about the request {number}"
    )


_FULL = BusyError("the server's disk is full; nothing was changed. Make room on it, then try again")
# SQLite's words, and PostgreSQL's.
_NO_SPACE = re.compile("disk is full|No space left", re.IGNORECASE)


async def _disk_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, OSError)
    logger.error("request %s: the disk: %s", info_of(request.scope).id, error)
    busy = BusyError("a file cannot be written or read at the moment; nothing was changed, try again later")
    return await _silo_error(request, _FULL if error.errno in (errno.ENOSPC, errno.EDQUOT) else busy)


async def _disconnected(request: Request, error: Exception) -> Response:
    # Nobody reads this answer; the request was never whole, so nothing was done.
    logger.info("request %s: the client went away in the middle of its body", info_of(request.scope).id)
    return error_answer(400, "rejected", "the request's body ended too soon")


# A body may take another second for each BODY_PACE bytes.
BODY_PACE = 8 * 1024
# [s] So often a request that waits for its body checks if the server is about to stop.
CLOSING_SECONDS = 0.5
CLOSE = {"Connection": "close"}
# Answers from this size on are compressed; a packet or two are sent as they are.
COMPRESSED_BYTES = 1400
# Half the time of the highest level for a tenth more bytes.
COMPRESSION = 5
# A stream of events must not be held back, a file keeps its length and its ranges.
_AS_IT_IS = re.compile(r"/(?:events|thumbnail|geometry|structure|file(?:/[0-9]+)?|export\.xlsx)$")
UPLOAD_PATH = re.compile(r"/(?:api/)?(?:items|documents)/[^/]+/file$")

SECURITY_HEADERS = {
    "Content-Security-Policy": (
        "default-src 'self'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
        "object-src 'none'; base-uri 'none'; frame-ancestors 'none'; form-action 'self'"
    ),
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=()",
    "Cache-Control": "no-store",
}


class SecurityHeaders:
    """Adds the headers that are not there yet; a route may be stricter by itself."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in SECURITY_HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        await self.app(scope, receive, send_with_headers)


class Compressed:
    """Compresses answers for callers that take it. For this a page shows its secret masked."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app
        self._gzip = GZipMiddleware(app, minimum_size=COMPRESSED_BYTES, compresslevel=COMPRESSION)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        as_it_is = scope["type"] != "http" or _AS_IT_IS.search(scope["path"])
        await (self.app if as_it_is else self._gzip)(scope, receive, send)


class BodyLimit:
    """413 for a body above the limit, announced or sent; uploads have a limit of their own."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self.app = app
        self.settings = settings

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        limit = self._limit(scope["path"])
        message = f"the request is larger than this server takes ({limit / MIB:g} MiB)"
        # A browser gets its answer from inside, where errors become pages.
        headers = Headers(scope=scope)
        length = headers.get("content-length", "")
        from_browser = "text/html" in headers.get("accept", "")
        if length.isdecimal() and int(length) > limit and not from_browser:
            await error_answer(413, "too_large", message)(scope, receive, send)
            return
        taken = 0
        whole = False
        begun = time.monotonic()

        async def counted() -> Message:
            nonlocal taken, whole
            if whole:
                return await receive()
            # A body must come at some pace: else half a request could be kept open without end.
            end = begun + self.settings.request_body_seconds + taken / BODY_PACE
            while True:
                left = end - time.monotonic()
                try:
                    part = await asyncio.wait_for(receive(), min(max(left, 0.01), CLOSING_SECONDS))
                    break
                except TimeoutError:
                    if scope["app"].state.server.hub.closed:
                        raise HTTPException(503, "the server is stopping; try again later", CLOSE) from None
                    if left <= CLOSING_SECONDS:
                        raise HTTPException(408, "the request's body came too slowly", CLOSE) from None
            whole = not part.get("more_body", False)
            taken += len(part.get("body", b""))
            if taken > limit:
                raise HTTPException(413, message)
            return part

        await self.app(scope, counted, send)

    def _limit(self, path: str) -> int:
        # A form has some bytes around its file.
        if UPLOAD_PATH.match(path):
            return self.settings.max_file_bytes + 64 * 1024
        return self.settings.max_body_bytes
