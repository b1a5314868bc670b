# SPDX-License-Identifier: LGPL-2.1-or-later
"""What every route gets: the server's parts, who is calling, and how an answer is written."""

from __future__ import annotations

import json
import secrets
from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Annotated, Any

import anyio.to_thread
import pydantic_core
from fastapi import Depends, Query, Request
from starlette.datastructures import FormData
from starlette.responses import Response

from silo.api.wire import ErrorBody
from silo.bom.errors import AuthError, ForbiddenError, RejectedError
from silo.bom.numbers import whole_number
from silo_server.background import Probe
from silo_server.db.engine import Database, Tx
from silo_server.events.hub import Hub
from silo_server.files import FileStore
from silo_server.operation.requests import info_of
from silo_server.services.access.credentials import actor_by_token
from silo_server.services.access.logins import actor_by_session
from silo_server.settings import Settings
from silo_server.values import Actor, Role

SESSION_COOKIE = "silo_session"
SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
FORM_TYPES = ("application/x-www-form-urlencoded", "multipart/form-data")
# A decision about all lines of the largest BOM has a field for each.
MOST_FIELDS = 25_000

_SHAPE = {"model": ErrorBody}
READ_ERRORS: dict[int | str, dict[str, Any]] = {
    400: {**_SHAPE, "description": "The request is unusable; all problems are listed"},
    401: {**_SHAPE, "description": "No token, or one that is not known"},
    403: {**_SHAPE, "description": "The role is too low"},
    404: {**_SHAPE, "description": "There is no such item, line, revision or route"},
    409: {**_SHAPE, "description": "Two truths met: a cycle, a duplicate, a change in between"},
    503: {**_SHAPE, "description": "Read-only, or the database is not there; try again later"},
}
WRITE_ERRORS: dict[int | str, dict[str, Any]] = {
    **READ_ERRORS,
    412: {**_SHAPE, "description": "The BOM has another version than If-Match says"},
    413: {**_SHAPE, "description": "More than the server takes in one request"},
}


@dataclass(frozen=True)
class Server:
    """The parts of a running server; one per process, in ``app.state.server``."""

    settings: Settings
    db: Database
    hub: Hub
    files: FileStore
    probe: Probe


def server_of(request: Request) -> Server:
    """The server that this request came to."""
    server: Server = request.app.state.server
    return server


ServerDep = Annotated[Server, Depends(server_of)]


class FormSecretError(ForbiddenError):
    """The secret of a form is not that of the session: another site's form, or one of an earlier session."""


@dataclass(frozen=True, slots=True)
class Call:
    """A request that was let in: from whom, and to which server."""

    request: Request
    server: Server
    actor: Actor

    def read(self) -> AbstractContextManager[Tx]:
        """One consistent snapshot of the database, for this caller."""
        return self.server.db.read(self.actor)

    def write(self, *, even_when_read_only: bool = False) -> AbstractContextManager[Tx]:
        """A transaction in this caller's name."""
        return self.server.db.write(self.actor, even_when_read_only=even_when_read_only)


class Guard:
    """A dependency that lets a caller of at least ``role`` in: Bearer token first, then session cookie."""

    def __init__(self, role: Role) -> None:
        self.role = role

    async def __call__(self, request: Request) -> Call:
        actor = await anyio.to_thread.run_sync(find_actor, request)
        info_of(request.scope).user = actor.username if actor else None
        if actor is None:
            raise AuthError("a valid token is needed: send it as 'Authorization: Bearer silo_…'")
        if not actor.role.covers(self.role):
            raise ForbiddenError(
                f"{actor.username} is {actor.role}, this needs {self.role}; an admin can change that"
            )
        if actor.auth_source == "session" and request.method not in SAFE_METHODS:
            await _check_csrf(request, actor)
        return Call(request, server_of(request), actor)


Viewer = Annotated[Call, Depends(Guard(Role.VIEWER))]
Editor = Annotated[Call, Depends(Guard(Role.EDITOR))]
Admin = Annotated[Call, Depends(Guard(Role.ADMIN))]


def find_actor(request: Request) -> Actor | None:
    """Who calls, None where nobody known does. A wrong token is not saved by a good cookie."""
    server, address = server_of(request), client_address(request)
    header = request.headers.get("authorization")
    if header is not None:
        scheme, _, secret = header.partition(" ")
        if scheme.lower() != "bearer" or not secret.strip():
            return None
        return actor_by_token(server.db, secret.strip(), address)
    cookie = request.cookies.get(SESSION_COOKIE)
    return actor_by_session(server.db, cookie, address) if cookie else None


def client_address(request: Request) -> str:
    """The caller's address, as given by the connection (or by a proxy that uvicorn trusts)."""
    return request.client.host if request.client else ""


async def _check_csrf(request: Request, actor: Actor) -> None:
    sent: object = request.headers.get("x-csrf-token")
    if sent is None and request.headers.get("content-type", "").startswith(FORM_TYPES):
        sent = (await form_of(request)).get("csrf_token")
    wanted = actor.csrf_token or ""
    if not isinstance(sent, str) or not secrets.compare_digest(unmasked(sent), wanted.encode()):
        raise FormSecretError("the form's secret is missing or old; load the page again and repeat")


async def form_of(request: Request) -> FormData:
    """The request's form, which whoever asks first reads, and Starlette keeps."""
    return await request.form(max_files=1, max_fields=MOST_FIELDS)


def masked(secret: str) -> str:
    """A secret as a page shows it: another text each time, so that the size of a compressed page that also
    shows what somebody else made up says nothing about it (the BREACH attack)."""
    raw = secret.encode()
    mask = secrets.token_bytes(len(raw))
    return _MASKED + (mask + bytes(a ^ b for a, b in zip(mask, raw, strict=True))).hex()


def unmasked(sent: str) -> bytes:
    """What :func:`masked` was given; a text that it did not make as it is."""
    if not sent.startswith(_MASKED):
        return sent.encode()
    try:
        both = bytes.fromhex(sent.removeprefix(_MASKED))
    except ValueError:
        return b""
    half = len(both) // 2
    return bytes(a ^ b for a, b in zip(both[:half], both[half:], strict=False))


_MASKED = "m."


def json_answer(value: Any, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """``value`` as JSON, by the quick writer that pydantic brings along.

    It writes all that :mod:`silo_server.json_values` lets in. Call it before the commit: an answer that
    cannot be written must not leave anything behind.
    """
    return raw_json(pydantic_core.to_json(value), status, headers)


def raw_json(text: str | bytes, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """JSON that is written already."""
    return Response(text, status, headers, media_type="application/json")


async def json_body(request: Request) -> Any:
    """The request's JSON body; RejectedError where it is none. NaN and Infinity are no JSON."""
    body = await request.body()

    def parse() -> Any:
        try:
            return json.loads(body, parse_constant=_no_constant)
        except (ValueError, RecursionError) as error:
            raise RejectedError(f"body: wanted JSON, got something else ({error})") from None

    return await anyio.to_thread.run_sync(parse)


def _no_constant(name: str) -> Any:
    raise ValueError(f"{name} is no JSON number")


def etag_of(version: int) -> str:
    """The ETag of a BOM's version."""
    return f'"v{version}"'


def expected_version(request: Request) -> int | None:
    """The version in ``If-Match``, None where there is none (or ``*``); -1 for one that cannot be ours."""
    header = request.headers.get("if-match", "").strip()
    if header in ("", "*"):
        return None
    version = whole_number(header.removeprefix("W/").strip('"').removeprefix("v"), 9)
    return -1 if version is None else version


ExpectedVersion = Annotated[int | None, Depends(expected_version)]
# The id of a row, to page a list from.
PageFrom = Annotated[int | None, Query(ge=0, le=2**62)]
