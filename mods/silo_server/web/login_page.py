# SPDX-License-Identifier: LGPL-2.1-or-later
"""The way in and out: who may see and do what on the pages, the login form, the one-time link, log out."""

from __future__ import annotations

from typing import Annotated
from urllib.parse import quote, urlsplit

import anyio.to_thread
from fastapi import APIRouter, Depends, Query, Request
from starlette.responses import RedirectResponse, Response

from silo.bom.errors import AuthError, ForbiddenError
from silo_server.errors import TooManyAttemptsError
from silo_server.routes.auth import set_session_cookie
from silo_server.routes.context import (
    FORM_TYPES,
    SAFE_METHODS,
    SESSION_COOKIE,
    Call,
    FormSecretError,
    Guard,
    ServerDep,
    client_address,
    find_actor,
    form_of,
    server_of,
)
from silo_server.services.access import logins
from silo_server.values import Actor, Role
from silo_server.web.forms import (
    MOST_KEPT,
    Form,
    Kept,
    back,
    kept_form,
    local_path,
    own_site,
    password_of,
    text,
    unpacked,
)
from silo_server.web.render import page_for

router = APIRouter(include_in_schema=False)


class LoginNeededError(Exception):
    """Nobody is logged in; the login page leads back to ``target``, or to the form that was ``kept``."""

    def __init__(self, target: str, kept: Kept | None = None) -> None:
        super().__init__(target)
        self.target, self.kept = target, kept


class OldFormError(Exception):
    """A form of ours that was shown in an earlier session; the person is asked whether to send it now."""

    def __init__(self, actor: Actor, kept: Kept) -> None:
        super().__init__(kept.path)
        self.actor, self.kept = actor, kept


class PageGuard(Guard):
    """As :class:`Guard`, for people: what they typed is kept over a login."""

    async def __call__(self, request: Request) -> Call:
        try:
            return await super().__call__(request)
        except FormSecretError:
            kept, actor = await _kept(request), await anyio.to_thread.run_sync(find_actor, request)
            if kept is None or actor is None or not own_site(request):
                raise
            raise OldFormError(actor, kept) from None
        except AuthError as error:
            kept = await _kept(request)
            if error.status_hint != 401:
                request.state.kept = kept
                raise
            raise LoginNeededError(_here(request), kept if own_site(request) else None) from None


async def _kept(request: Request) -> Kept | None:
    """What the request's form holds; None where it is none, or too large to be carried along."""
    length = request.headers.get("content-length", "")
    small = length.isdigit() and int(length) <= MOST_KEPT
    is_form = request.headers.get("content-type", "").startswith(FORM_TYPES)
    if request.method in SAFE_METHODS or not is_form or not small:
        return None
    return kept_form(request.url.path, await form_of(request))


Reader = Annotated[Call, Depends(PageGuard(Role.VIEWER))]
Writer = Annotated[Call, Depends(PageGuard(Role.EDITOR))]
Administrator = Annotated[Call, Depends(PageGuard(Role.ADMIN))]


def own_form(request: Request) -> None:
    """For the one form without a session, the login: ForbiddenError where another site sent it.

    A browser says where a form comes from; a page elsewhere must not log somebody in under its own name.
    """
    if own_site(request) is False:
        raise ForbiddenError("this form was sent by another site; log in on the login page itself")


def _here(request: Request) -> str:
    if request.method in SAFE_METHODS:
        query = f"?{request.url.query}" if request.url.query else ""
        return request.url.path + query
    # A form cannot be sent again by a link; the page before it is the best that is left.
    referer = urlsplit(request.headers.get("referer", ""))
    path = referer.path.removeprefix(server_of(request).settings.root_path)
    return path if referer.netloc == request.headers.get("host") and path else "/"


def _login_page(
    request: Request, target: str, problem: str = "", status: int = 200, kept: Kept | None = None
) -> Response:
    values = {"target": target, "problem": problem, "kept": kept}
    return page_for(request, None, "login.html", status=status, **values)


async def to_login(request: Request, error: Exception) -> Response:
    """Lead visitors who are not logged in to the login page."""
    assert isinstance(error, LoginNeededError)
    if error.kept is None:
        return RedirectResponse("/login?next=" + quote(error.target, safe="/"), 303)
    return await anyio.to_thread.run_sync(_login_page, request, error.target, "", 401, error.kept)


async def send_again(request: Request, error: Exception) -> Response:
    """Ask whether a form of an earlier session is to be sent."""
    assert isinstance(error, OldFormError)
    actor, kept = error.actor, error.kept
    return await anyio.to_thread.run_sync(
        lambda: page_for(request, actor, "again.html", status=403, kept=kept)
    )


START = "/"
Next = Annotated[str, Query(max_length=500)]


@router.get("/login")
def login_form(request: Request, next: Next = START) -> Response:
    """The login form; users who are logged in already are sent on."""
    if find_actor(request) is not None:
        return back(local_path(next))
    return _login_page(request, local_path(next))


@router.post("/login", dependencies=[Depends(own_form)])
def log_in(request: Request, server: ServerDep, form: Form) -> Response:
    """Begin a session and go on to ``next``, or to the form that was being sent when the last one ended."""
    target = local_path(text(form, "next"))
    packed = form.get("kept")
    kept = unpacked(packed) if isinstance(packed, str) and packed else None

    if "already" in form:
        actor = find_actor(request)
        if actor is None:
            return _login_page(request, target, "You are not logged in yet in this browser.", 401, kept)
        return page_for(request, actor, "again.html", kept=kept) if kept else back(target)
    try:
        session = logins.log_in(
            server.db, text(form, "username", 200), password_of(form, "password"), client_address(request)
        )
    except (AuthError, TooManyAttemptsError) as error:
        return _login_page(request, target, str(error), error.status_hint, kept)
    if kept is None:
        return _with_session(request, session, target)
    actor = logins.actor_by_session(server.db, session.secret, client_address(request))
    shown = page_for(request, actor, "again.html", kept=kept)
    set_session_cookie(shown, request, session)
    return shown


@router.get("/login/link/{secret}")
def login_link(request: Request, secret: str, next: Next = START) -> Response:
    """Ask whether to use the link up: what only looks at links (mail scanners, previews) must not do that."""
    return page_for(request, None, "login_link.html", secret=secret, target=local_path(next))


@router.post("/login/link/{secret}", dependencies=[Depends(own_form)])
def use_link(request: Request, server: ServerDep, secret: str, form: Form) -> Response:
    """Begin a session by a one-time link; one that was used already leads on where the session lives."""
    target = local_path(text(form, "next"))
    try:
        session = logins.use_login_link(server.db, secret, client_address(request))
    except AuthError as error:
        if find_actor(request) is not None:
            return back(target)
        return _login_page(request, target, str(error), 401)
    return _with_session(request, session, target)


@router.post("/logout")
def log_out(call: Reader) -> Response:
    """End the session."""
    logins.log_out(call.server.db, call.actor)
    response = RedirectResponse("/login", 303)
    response.delete_cookie(SESSION_COOKIE)
    return response


def _with_session(request: Request, session: logins.NewSession, target: str) -> Response:
    response = back(target)
    set_session_cookie(response, request, session)
    return response
