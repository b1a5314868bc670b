# SPDX-License-Identifier: LGPL-2.1-or-later
"""A call: a request that was let in, from whom, and to which server."""

from __future__ import annotations

import secrets
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import Annotated

import anyio.to_thread
from fastapi import Depends, Request

from silo.bom.errors import AuthError, ForbiddenError
from silo.bom.message import message
from silo_server.actors import Actor, Role
from silo_server.db.database import Database
from silo_server.db.transaction import Tx
from silo_server.db.turnstile import Turnstile
from silo_server.events.hub import Hub
from silo_server.http.request_log import info_of
from silo_server.http.unknown_callers import NEEDS_TOKEN
from silo_server.probe import Probe
from silo_server.routes.masked_secret import unmasked
from silo_server.routes.requests import FORM_TYPES, form_of
from silo_server.services.access.sessions import actor_by_session
from silo_server.services.access.tokens import actor_by_token
from silo_server.services.file_store import FileStore
from silo_server.settings import Settings

SESSION_COOKIE = "silo_session"
SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})


@dataclass(frozen=True)
class Server:
    """The parts of a running server; one per process, in ``app.state.server``."""

    settings: Settings
    db: Database
    hub: Hub
    files: FileStore
    probe: Probe
    # Reads that may take seconds and much memory: one at a time, so that all others continue.
    large_reads: Turnstile = field(default_factory=lambda: Turnstile(1, 16, 60, "exports and large reads"))


def server_of(request: Request) -> Server:
    """Return the server that received this request."""
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
        """Open a read transaction for this caller: one consistent snapshot of the database."""
        return self.server.db.read(self.actor)

    def write(self, *, even_when_read_only: bool = False) -> AbstractContextManager[Tx]:
        """Open a write transaction in the name of this caller."""
        return self.server.db.write(self.actor, even_when_read_only=even_when_read_only)


class Guard:
    """A dependency that lets a caller of at least ``role`` in: Bearer token first, then session cookie."""

    def __init__(self, role: Role) -> None:
        self.role = role

    async def __call__(self, request: Request) -> Call:
        actor = await anyio.to_thread.run_sync(find_actor, request)
        info_of(request.scope).user = actor.username if actor else None
        if actor is None:
            raise AuthError(NEEDS_TOKEN)
        if not actor.role.covers(self.role):
            raise ForbiddenError(
                message(
                    "{username} is {role}, this needs {needed}; an admin can change that",
                    username=actor.username,
                    role=actor.role,
                    needed=self.role,
                )
            )
        if actor.auth_source == "session" and request.method not in SAFE_METHODS:
            await _check_csrf(request, actor)
        return Call(request, server_of(request), actor)


Viewer = Annotated[Call, Depends(Guard(Role.VIEWER))]
Editor = Annotated[Call, Depends(Guard(Role.EDITOR))]
Admin = Annotated[Call, Depends(Guard(Role.ADMIN))]


def find_actor(request: Request) -> Actor | None:
    """Find who sends the request; None if unknown. A wrong token is refused even with a good cookie."""
    server, address = server_of(request), client_address(request)
    header = request.headers.get("authorization")
    if header is not None:
        scheme, _, secret = header.partition(" ")
        if scheme.lower() != "bearer" or not secret.strip():
            return None
        return actor_by_token(server.db, secret.strip(), address)
    cookie = request.cookies.get(SESSION_COOKIE)
    return actor_by_session(server.db, cookie, address) if cookie else None


def find_user(request: Request) -> int | None:
    """Find the id of the user who sends the request; None if unknown."""
    actor = find_actor(request)
    return actor.user_id if actor else None


def client_address(request: Request) -> str:
    """Return the caller's network address: that of the connection, or what a trusted proxy says."""
    return request.client.host if request.client else ""


async def _check_csrf(request: Request, actor: Actor) -> None:
    sent: object = request.headers.get("x-csrf-token")
    if sent is None and request.headers.get("content-type", "").startswith(FORM_TYPES):
        sent = (await form_of(request)).get("csrf_token")
    wanted = actor.csrf_token or ""
    if not isinstance(sent, str) or not secrets.compare_digest(unmasked(sent), wanted.encode()):
        raise FormSecretError(message("the form's secret is missing or old; load the page again and repeat"))
