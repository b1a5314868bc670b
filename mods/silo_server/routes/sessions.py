# SPDX-License-Identifier: LGPL-2.1-or-later
"""Browser sessions: log in, log out, who am I, and one's own password."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Request
from starlette.responses import Response

from silo.api.wire import ErrorBody
from silo_server.routes.answers import READ_ERRORS, WRITE_ERRORS, json_answer
from silo_server.routes.call import SESSION_COOKIE, ServerDep, Viewer, client_address, server_of
from silo_server.routes.models import RequestBody, Short, Text
from silo_server.routes.requests import BoundedRoute
from silo_server.routes.users import NewPassword
from silo_server.services.access import sessions
from silo_server.services.access.sessions import NewSession, set_own_password

router = APIRouter(route_class=BoundedRoute, prefix="/api", tags=["auth"])

LOGIN_ERRORS: dict[int | str, dict[str, Any]] = {
    400: {"model": ErrorBody},
    401: {"model": ErrorBody},
    429: {"model": ErrorBody, "description": "Too many failed logins; Retry-After says for how long"},
    503: {"model": ErrorBody},
}


class LoginBody(RequestBody):
    """``POST /api/auth/login``."""

    username: Short
    password: Short


class PasswordBody(RequestBody):
    """``PUT /api/auth/password``: the new password, and the old one, except after a login link."""

    password: NewPassword
    current_password: Text | None = None


@router.post("/auth/login", responses=LOGIN_ERRORS)
def log_in(server: ServerDep, request: Request, body: LoginBody) -> Response:
    """Begin a browser session: set the cookie, and answer with the CSRF secret for later requests."""
    session = sessions.log_in(server.db, body.username, body.password, client_address(request))
    response = json_answer({"username": session.username, "csrf_token": session.csrf_token})
    set_session_cookie(response, request, session)
    return response


@router.post("/auth/logout", status_code=204, responses=READ_ERRORS)
def log_out(call: Viewer) -> Response:
    """End this browser session."""
    sessions.log_out(call.server.db, call.actor)
    response = Response(status_code=204)
    response.delete_cookie(SESSION_COOKIE)
    return response


@router.post("/auth/logout-everywhere", responses=WRITE_ERRORS)
def log_out_everywhere(call: Viewer) -> dict[str, int]:
    """End all sessions of the caller, and every token and link that was made in any of them."""
    return {"ended": sessions.log_out_everywhere(call.server.db, call.actor)}


@router.get("/auth/me", responses=READ_ERRORS)
def who_am_i(call: Viewer) -> dict[str, Any]:
    """Return the user of this token or session."""
    return {
        "username": call.actor.username,
        "display_name": call.actor.display_name,
        "role": call.actor.role.value,
        "auth_source": call.actor.auth_source,
    }


@router.put("/auth/password", status_code=204, responses={**LOGIN_ERRORS, **WRITE_ERRORS})
def set_password(call: Viewer, body: PasswordBody) -> Response:
    """Set the caller's password and end all their sessions. Not with a token; needs the old password."""
    set_own_password(call.server.db, call.actor, body.password, body.current_password)
    return Response(status_code=204)


def set_session_cookie(response: Response, request: Request, session: NewSession) -> None:
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
