# SPDX-License-Identifier: LGPL-2.1-or-later
"""Every error of every route in one JSON shape (:class:`silo.api.wire.ErrorBody`); never a stack trace."""

from __future__ import annotations

import errno
import logging
import re
from collections.abc import Mapping, Sequence
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from sqlalchemy.exc import DataError, DBAPIError, IntegrityError, OperationalError
from sqlalchemy.exc import TimeoutError as PoolTimeoutError
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.responses import JSONResponse, Response

from silo.bom.errors import (
    BusyError,
    CycleError,
    NewerRevisionError,
    ReadOnlyError,
    RejectedError,
    RouteMissingError,
    SiloError,
)
from silo.bom.message import beside, message
from silo_server.errors import InDoubtError, TooManyAttemptsError, cause_of
from silo_server.http.request_log import info_of

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


async def answer_of(request: Request, error: Exception) -> Response:
    """Answer an error that was noticed before any route had the request, as the application would."""
    handlers = request.app.exception_handlers
    handler = next(handlers[kind] for kind in type(error).__mro__ if kind in handlers)
    response: Response = await handler(request, error)
    return response


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
    """Answer with an error in the one JSON shape; empty details are left out.

    A sentence that is a message has its template and values beside it.
    """
    body: dict[str, Any] = {"error": code, "message": message, **beside(message)}
    if problems:
        body["problems"] = list(problems)
        told = [beside(problem) for problem in problems]
        if any(told):
            body["problem_messages"] = told
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
    return error_answer(
        400, "rejected", message("the request is unusable: {problem}", problem=problems[0]), problems=problems
    )


def _problem(entry: Mapping[str, Any]) -> str:
    where = [str(part) for part in entry["loc"] if part not in ("body", "query", "path", "header")]
    return f"{'.'.join(where) or 'body'}: {entry['msg'].removeprefix('Value error, ')}"


async def _http_exception(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    missing = RouteMissingError.code
    codes = {404: missing, 405: missing, 413: "too_large", 503: BusyError.code}
    message = str(error.detail)
    if message == HTTPStatus(error.status_code).phrase:
        message = f"{message}: {request.method} {request.url.path}"
    code = codes.get(error.status_code, "rejected" if error.status_code < 500 else "server_fault")
    return error_answer(error.status_code, code, message, headers=error.headers)


async def _database_error(request: Request, error: Exception) -> Response:
    if isinstance(error, DataError):
        return error_answer(
            400, "rejected", message("a value cannot be stored: it is too long, too large or no text")
        )
    if isinstance(error, IntegrityError):
        return error_answer(
            409, "conflict", message("somebody else changed the same thing just now; read it again")
        )
    is_lost = getattr(error, "connection_invalidated", False)  # such as one that was idle for too long
    if is_lost or isinstance(error, OperationalError | PoolTimeoutError):
        logger.error("request %s: the database: %s", info_of(request.scope).id, cause_of(error))
        if request.method not in ("GET", "HEAD") and is_lost:
            # The commit may have come through before the connection was lost; Retry-After would deny that.
            doubt = InDoubtError(
                message(
                    "the connection to the database was lost; the change may be stored or not. Read it again "
                    "before you send it once more"
                )
            )
            return await _silo_error(request, doubt)
        busy = BusyError(
            message("the database cannot be reached at the moment; nothing was changed, try again later")
        )
        full = _NO_SPACE.search(cause_of(error)) is not None
        return await _silo_error(request, _FULL if full else busy)
    return await _fault(request, error)


async def _unicode_error(request: Request, error: Exception) -> Response:
    return error_answer(
        400, "rejected", message("a text in the request is no valid Unicode (a lone surrogate)")
    )


async def _fault(request: Request, error: Exception) -> Response:
    number = info_of(request.scope).id
    logger.error("request %s: %s %s failed", number, request.method, request.url.path, exc_info=error)
    return error_answer(
        500,
        "server_fault",
        message("the server made a mistake; its log says more about the request {request}", request=number),
    )


_FULL = BusyError(message("the server's disk is full; nothing was changed. Make room on it, then try again"))
# SQLite's words, and PostgreSQL's.
_NO_SPACE = re.compile("disk is full|No space left", re.IGNORECASE)


async def _disk_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, OSError)
    logger.error("request %s: the disk: %s", info_of(request.scope).id, error)
    busy = BusyError(
        message("a file cannot be written or read at the moment; nothing was changed, try again later")
    )
    return await _silo_error(request, _FULL if error.errno in (errno.ENOSPC, errno.EDQUOT) else busy)


async def _disconnected(request: Request, error: Exception) -> Response:
    # This answer is not read; the request was never whole, so nothing was done.
    logger.info("request %s: the client went away in the middle of its body", info_of(request.scope).id)
    return error_answer(400, "rejected", message("the request's body ended too soon"))
