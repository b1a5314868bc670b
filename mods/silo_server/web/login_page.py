# SPDX-License-Identifier: LGPL-2.1-or-later
"""The way in and out: the login form, the one-time link, log out."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Query, Request
from starlette.datastructures import FormData
from starlette.responses import RedirectResponse, Response

from silo.bom.errors import AuthError
from silo_server.errors import TooManyAttemptsError
from silo_server.routes.auth import set_session_cookie
from silo_server.routes.context import SESSION_COOKIE, ServerDep, client_address, find_actor
from silo_server.services.access import logins
from silo_server.web.forms import Form, back, local_path, text, unpacked
from silo_server.web.guard import Reader, own_form
from silo_server.web.render import page

router = APIRouter(include_in_schema=False)

START = "/"
Next = Annotated[str, Query(max_length=500)]


@router.get("/login")
def login_form(request: Request, next: Next = START) -> Response:
    """The login form; users who are logged in already are sent on."""
    if find_actor(request) is not None:
        return back(local_path(next))
    return page(request, "login.html", None, target=local_path(next), problem="", kept=None)


@router.post("/login", dependencies=[Depends(own_form)])
def log_in(request: Request, server: ServerDep, form: Form) -> Response:
    """Begin a session and go on to ``next``, or to the form that was being sent when the last one ended."""
    target = local_path(text(form, "next"))
    packed = form.get("kept")
    kept = unpacked(packed) if isinstance(packed, str) and packed else None

    def again(problem: str, status: int) -> Response:
        values = {"target": target, "problem": problem, "kept": kept}
        return page(request, "login.html", None, status=status, **values)

    if "already" in form:
        actor = find_actor(request)
        if actor is None:
            return again("You are not logged in yet in this browser.", 401)
        return page(request, "again.html", actor, kept=kept) if kept else back(target)
    try:
        session = logins.log_in(
            server.db, text(form, "username", 200), _password(form), client_address(request)
        )
    except (AuthError, TooManyAttemptsError) as error:
        return again(str(error), error.status_hint)
    if kept is None:
        return _with_session(request, server, session, target)
    actor = logins.actor_by_session(server.db, session.secret, client_address(request))
    shown = page(request, "again.html", actor, kept=kept)
    set_session_cookie(shown, server, session, request)
    return shown


@router.get("/login/link/{secret}")
def login_link(request: Request, secret: str, next: Next = START) -> Response:
    """Ask whether to use the link up: what only looks at links (mail scanners, previews) must not do that."""
    return page(request, "login_link.html", None, secret=secret, target=local_path(next))


@router.post("/login/link/{secret}", dependencies=[Depends(own_form)])
def use_link(request: Request, server: ServerDep, secret: str, form: Form) -> Response:
    """Begin a session by a one-time link; one that was used already leads on where the session lives."""
    target = local_path(text(form, "next"))
    try:
        session = logins.use_login_link(server.db, secret, client_address(request))
    except AuthError as error:
        if find_actor(request) is not None:
            return back(target)
        return page(request, "login.html", None, status=401, target=target, problem=str(error), kept=None)
    return _with_session(request, server, session, target)


@router.post("/logout")
def log_out(server: ServerDep, caller: Reader) -> Response:
    """End the session."""
    logins.log_out(server.db, caller)
    response = RedirectResponse("/login", 303)
    response.delete_cookie(SESSION_COOKIE)
    return response


def _password(form: FormData) -> str:
    # Spaces at the ends belong to a password.
    value = form.get("password")
    return value[:200] if isinstance(value, str) else ""


def _with_session(request: Request, server: ServerDep, session: logins.NewSession, target: str) -> Response:
    response = back(target)
    set_session_cookie(response, server, session, request)
    return response
