# SPDX-License-Identifier: LGPL-2.1-or-later
"""Health, events, modules, mode.

Login, tokens, users, audit.
"""

from __future__ import annotations

import re
from dataclasses import asdict
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Path, Query, Request
from prometheus_client import CONTENT_TYPE_LATEST
from pydantic import BaseModel, ConfigDict, Field, StrictBool, WithJsonSchema
from sqlalchemy.exc import SQLAlchemyError
from starlette.responses import Response

from silo.api.wire import ErrorBody
from silo.bom.errors import RejectedError
from silo_server.actors import Role, Scope
from silo_server.db.state import mode_of
from silo_server.events import log
from silo_server.events.stream import EventResponse
from silo_server.fields import to_wire
from silo_server.housekeeping import (
    HEALTH_SECONDS,
    READY_SECONDS,
    ServerStanding,
    last_run,
    standing,
)
from silo_server.routes import context
from silo_server.routes.context import (
    READ_ERRORS,
    SESSION_COOKIE,
    WRITE_ERRORS,
    Admin,
    Call,
    PageFrom,
    ServerDep,
    Viewer,
    client_address,
    find_actor,
    json_answer,
    server_of,
)
from silo_server.routes.models import RequestBody, Short, Text
from silo_server.services import access
from silo_server.services.mode import change_mode

router = APIRouter(tags=["system"])
EVENT_ID = re.compile(r"(?P<number>[0-9]{1,18})(?:-(?P<tag>[0-9a-f]{8}))?")
MODULES = (
    "core",
    "schemas",
    "bom",
    "bom_merge",
    "bom_history",
    "events",
    "files",
    "auth",
    "export",
    "import",
)


class ModeBody(BaseModel):
    """``PUT /api/admin/mode``."""

    mode: Literal["normal", "read-only"]


@router.get("/health")
async def health(server: ServerDep) -> dict[str, Any]:
    """Answer that the process lives, and in which mode. Waits for nothing that others wait for."""
    state = await server.probe.look(HEALTH_SECONDS) or server.probe.last
    return {"status": "ok", "mode": state.mode}


@router.api_route("/health", methods=["HEAD", "OPTIONS"], include_in_schema=False)
@router.api_route("/ready", methods=["OPTIONS"], include_in_schema=False)
async def looked_at() -> Response:
    """Answer load balancers and browsers that test an address before they use it."""
    return Response(status_code=204, headers={"Allow": "GET, HEAD, OPTIONS"})


@router.api_route("/ready", methods=["HEAD"], include_in_schema=False)
@router.get("/ready", responses={503: {"description": "The database or the file store is not there"}})
async def ready(server: ServerDep) -> Response:
    """Say if the server can work: 200, or 503 while database or file store cannot be reached or are full."""
    state = await server.probe.look(READY_SECONDS) or ServerStanding(
        "degraded", "unreachable", server.probe.last.files
    )
    body = {
        "status": "ready" if state.ready else "not ready",
        "mode": state.mode,
        "database": state.database,
        "files": state.files,
        "sse_clients": server.hub.listeners,
        "takes_item_ids": True,
        "browser_login": True,
        "freecad": server.settings.freecad_version,
    }
    return json_answer(body, 200 if state.ready else 503)


@router.get(
    "/metrics",
    response_class=Response,
    responses={**READ_ERRORS, 200: {"content": {"text/plain": {}}, "description": "The numbers"}},
)
def metrics(call: Viewer) -> Response:
    """Return the metrics for Prometheus; the role viewer is enough."""
    rendered = call.request.app.state.metrics.render(call.server.db, call.server.hub, call.server.files)
    return Response(rendered, headers={"Content-Type": CONTENT_TYPE_LATEST})


@router.get(
    "/api/events",
    response_class=Response,
    responses={**READ_ERRORS, 200: {"content": {"text/event-stream": {}}, "description": "The events"}},
)
async def stream_events(
    call: Viewer,
    item: Annotated[list[str] | None, Query(max_length=100)] = None,
    last_event_id: Annotated[str | None, Query(max_length=40)] = None,
) -> Response:
    """Stream events: those since ``Last-Event-ID`` (or ``last_event_id``), then new ones as they happen.

    ``item`` (part numbers or UUIDs, repeatable): only events of these items. The event ``reset`` means: the
    log does not go back that far, so read everything again.
    """
    last = _event_id(call.request.headers.get("last-event-id") or last_event_id)

    def still_allowed() -> bool:
        try:
            return find_actor(call.request) is not None
        except SQLAlchemyError:
            return True  # a lost database is no reason to end the streams

    return EventResponse(call.server.hub, last, item or (), still_allowed)


@router.get("/api/modules", responses=READ_ERRORS)
async def modules(call: Viewer) -> dict[str, Any]:
    """Return the modules of this server."""
    return {"modules": {name: {"enabled": True} for name in MODULES}}


@router.get("/api/admin/mode", responses=READ_ERRORS)
def get_mode(call: Admin) -> dict[str, Any]:
    """Return the mode: ``normal`` or ``read-only``."""
    with call.read() as tx:
        return {"mode": mode_of(tx)}


@router.get("/api/admin/system", responses=READ_ERRORS)
def get_system(call: Admin) -> dict[str, Any]:
    """Return version, database, disk, last backup and housekeeping, queues, counts, warnings of the start."""
    server = call.server
    return standing(server.db, server.hub, server.files, server.large_reads)


@router.get("/api/admin/housekeeping", responses=READ_ERRORS)
def get_housekeeping(call: Admin) -> dict[str, Any]:
    """Return when old rows and files were last deleted, how many, and what failed; null if never."""
    with call.read() as tx:
        run = last_run(tx)
    return {"last_run": asdict(run) if run else None}


@router.put("/api/admin/mode", responses=READ_ERRORS)
def set_mode(call: Admin, body: ModeBody) -> dict[str, Any]:
    """Allow changes, or refuse them (503) until the mode is set again; all processes follow at once."""
    with call.write(even_when_read_only=True) as tx:
        return {"mode": change_mode(tx, body.mode)}


def _event_id(text: str | None) -> log.EventMark | None:
    if text is None or text == "":
        return None
    match = EVENT_ID.fullmatch(text)
    if match is None:
        raise RejectedError(f"Last-Event-ID: wanted the id of an event (a number), got {text[:40]!r}")
    return log.EventMark(int(match["number"]), match["tag"] or "")


auth_router = APIRouter(prefix="/api", tags=["auth"])

LOGIN_ERRORS: dict[int | str, dict[str, Any]] = {
    400: {"model": ErrorBody},
    401: {"model": ErrorBody},
    429: {"model": ErrorBody, "description": "Too many failed logins; Retry-After says for how long"},
    503: {"model": ErrorBody},
}


NewPassword = Annotated[Text, WithJsonSchema(context.PASSWORD)]


class LoginBody(RequestBody):
    """``POST /api/auth/login``."""

    username: Short
    password: Short


class TokenBody(RequestBody):
    """``POST /api/auth/tokens``.

    expires_in_days
        null = until revoked; absent = as long as the token that asks (a session: until revoked).
    scopes
        ``read``, ``write``, ``admin``, each with those before it; absent = all that the caller may.

    Unknown keys are refused: a misspelt limit must not make a token without it.
    """

    model_config = ConfigDict(extra="forbid")

    name: Annotated[Short, Field(min_length=1), WithJsonSchema(context.text(200, minLength=1))]
    expires_in_days: Annotated[float, Field(gt=0, le=3650, strict=True)] | None = None
    scopes: Annotated[list[Scope], Field(min_length=1, max_length=3)] | None = None


class NewUserBody(RequestBody):
    """``POST /api/users``; without a password only tokens and login links let the user in."""

    username: Annotated[Short, WithJsonSchema(context.USERNAME)]
    role: Role = Role.VIEWER
    display_name: Short = ""
    password: NewPassword | None = None


class UserChangeBody(RequestBody):
    """``PUT /api/users/{username}``: what is absent or null stays."""

    role: Role | None = None
    display_name: Short | None = None
    active: StrictBool | None = None
    approver: StrictBool | None = None
    password: NewPassword | None = None


class PasswordBody(RequestBody):
    """``PUT /api/auth/password``: the new password, and the old one, except after a login link."""

    password: NewPassword
    current_password: Text | None = None


@auth_router.post("/auth/login", responses=LOGIN_ERRORS)
def log_in(server: ServerDep, request: Request, body: LoginBody) -> Response:
    """Begin a browser session: set the cookie, and answer with the CSRF secret for later requests."""
    session = access.log_in(server.db, body.username, body.password, client_address(request))
    response = json_answer({"username": session.username, "csrf_token": session.csrf_token})
    set_session_cookie(response, request, session)
    return response


@auth_router.post("/auth/logout", status_code=204, responses=READ_ERRORS)
def log_out(call: Viewer) -> Response:
    """End this browser session."""
    access.log_out(call.server.db, call.actor)
    response = Response(status_code=204)
    response.delete_cookie(SESSION_COOKIE)
    return response


@auth_router.get("/auth/me", responses=READ_ERRORS)
def who_am_i(call: Viewer) -> dict[str, Any]:
    """Return the user of this token or session."""
    return {
        "username": call.actor.username,
        "display_name": call.actor.display_name,
        "role": call.actor.role.value,
        "auth_source": call.actor.auth_source,
    }


@auth_router.put("/auth/password", status_code=204, responses={**LOGIN_ERRORS, **WRITE_ERRORS})
def set_password(call: Viewer, body: PasswordBody) -> Response:
    """Set the caller's password and end all their sessions. Not with a token; needs the old password."""
    access.set_own_password(call.server.db, call.actor, body.password, body.current_password)
    return Response(status_code=204)


@auth_router.get("/auth/tokens", responses=READ_ERRORS)
def list_tokens(call: Viewer) -> list[dict[str, Any]]:
    """Return the caller's tokens; never their secrets."""
    with call.read() as tx:
        return [_token(token) for token in access.list_tokens(tx, call.actor.own_id)]


@auth_router.post("/auth/tokens", status_code=201, responses=WRITE_ERRORS)
def create_token(call: Viewer, body: TokenBody) -> dict[str, Any]:
    """Make a token. Only this answer shows its secret."""
    forever = "expires_in_days" in body.model_fields_set and body.expires_in_days is None
    scope = max(body.scopes, key=list(Scope).index) if body.scopes else None
    with call.write(even_when_read_only=True) as tx:
        token, secret = access.create_own_token(
            tx, body.name, days=body.expires_in_days, forever=forever, scope=scope
        )
        return {**_token(token), "token": secret}


@auth_router.delete("/auth/tokens/{token_id}", status_code=204, responses=WRITE_ERRORS)
def revoke_token(call: Viewer, token_id: Annotated[int, Path(ge=1, le=2**62)]) -> Response:
    """Revoke a token: one's own, or anybody's for an admin."""
    revoke(call, token_id)
    return Response(status_code=204)


def revoke(call: Call, token_id: int) -> None:
    """Revoke a token of the caller's own, or anybody's for an admin."""
    access.check_may_change(call.actor)
    owner = None if call.actor.role is Role.ADMIN else call.actor.own_id
    with call.write(even_when_read_only=True) as tx:
        access.revoke_token(tx, token_id, owner)


@auth_router.get("/users", responses=READ_ERRORS)
def list_users(call: Admin) -> list[dict[str, Any]]:
    """Return all users."""
    with call.read() as tx:
        return [_user(user) for user in access.list_users(tx)]


@auth_router.post("/users", status_code=201, responses=WRITE_ERRORS)
def create_user(call: Admin, body: NewUserBody) -> dict[str, Any]:
    """Make a user."""
    with call.write(even_when_read_only=True) as tx:
        user = access.create_user(
            tx, body.username, body.role, display_name=body.display_name, password=body.password
        )
        return _user(user)


@auth_router.put("/users/{username}", responses=WRITE_ERRORS)
def change_user(call: Admin, username: str, body: UserChangeBody) -> dict[str, Any]:
    """Change a user's role, name, password or right to approve, or block all access of the user."""
    with call.write(even_when_read_only=True) as tx:
        user = access.change_user(tx, username, **body.model_dump())
        return _user(user)


@auth_router.post("/users/{username}/login-link", status_code=201, responses=WRITE_ERRORS)
def create_login_link(call: Admin, username: str) -> dict[str, Any]:
    """Make a link that lets this user in once; for a new colleague or a forgotten password."""
    path, public = login_path(call, username), call.server.settings.public_url
    return {"path": path, "url": f"{public}{path}" if public else None}


def login_path(call: Call, username: str) -> str:
    """Make a login link for a user; return its path."""
    with call.write(even_when_read_only=True) as tx:
        secret = access.create_login_link(tx, username)
        access.note(tx, "login_link.created", username)
        return f"/login/link/{secret}"


@auth_router.get("/admin/audit", responses=READ_ERRORS)
def list_audit(
    call: Admin, limit: Annotated[int, Query(ge=1, le=1000)] = 100, before: PageFrom = None
) -> list[dict[str, Any]]:
    """Return the audit list, newest first: who did what."""
    with call.read() as tx:
        entries = access.list_entries(tx, limit, before)
    return [to_wire(entry) for entry in entries]


def set_session_cookie(response: Response, request: Request, session: access.NewSession) -> None:
    """Set the session's cookie: not for scripts or other sites, and only over TLS if there is TLS."""
    settings = server_of(request).settings
    response.set_cookie(
        SESSION_COOKIE,
        session.secret,
        max_age=int(settings.session_seconds),
        httponly=True,
        samesite="lax",
        secure=settings.secure_cookies or request.url.scheme == "https",
    )


def _token(token: access.Token) -> dict[str, Any]:
    return {
        **to_wire(token, "username", "scope"),
        "scopes": [scope.value for scope in Scope if token.scope.covers(scope)],
    }


def _user(user: access.User) -> dict[str, Any]:
    return to_wire(user, "id")
