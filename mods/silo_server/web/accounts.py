# SPDX-License-Identifier: LGPL-2.1-or-later
"""One's own password and API tokens; for admins users, everybody's tokens, the mode, and the audit list.

The way in and out: who may see and do what on the pages, the login form, the one-time link, log out.
"""

from __future__ import annotations

import secrets
from collections.abc import Mapping
from datetime import datetime
from functools import partial
from typing import Annotated
from urllib.parse import quote, urlsplit

import anyio.to_thread
from fastapi import APIRouter, Depends, Path, Query, Request
from starlette.responses import RedirectResponse, Response

from silo.bom.errors import AuthError, ConflictError, ForbiddenError, RejectedError, SiloError
from silo.bom.message import message
from silo_server.actors import Actor, Role, Scope
from silo_server.db.state import mode_of
from silo_server.errors import TooManyAttemptsError
from silo_server.housekeeping import last_run
from silo_server.http.unknown_callers import UNKNOWN_BODY
from silo_server.routes.call import (
    SAFE_METHODS,
    SESSION_COOKIE,
    Call,
    FormSecretError,
    Guard,
    ServerDep,
    client_address,
    find_actor,
    server_of,
)
from silo_server.routes.requests import FORM_TYPES, NumberedRoute, PageFrom, form_of
from silo_server.routes.sessions import set_session_cookie
from silo_server.routes.tokens import revoke
from silo_server.routes.users import login_path
from silo_server.services import audit
from silo_server.services.access import sessions, users
from silo_server.services.access.login_links import use_login_link
from silo_server.services.access.passwords import MIN_PASSWORD
from silo_server.services.access.sessions import NewSession, actor_by_session, set_own_password
from silo_server.services.access.signing import signing_key
from silo_server.services.access.tokens import (
    Children,
    ChildrenError,
    create_own_token,
    list_tokens,
    secret_of_form,
)
from silo_server.services.access.users import get_user, list_users
from silo_server.services.mode import change_mode
from silo_server.standing import standing
from silo_server.web.forms import (
    Form,
    back,
    back_with_secret,
    compared,
    own_site,
    password_of,
    secret_of,
    take_away_secret,
    text,
)
from silo_server.web.local_path import local_path
from silo_server.web.render import LANGUAGE_COOKIE, LANGUAGES, _, page, page_for, part_of
from silo_server.web.unsent_form import UnsentForm, read_signed, unsent_form

router = APIRouter(route_class=NumberedRoute, include_in_schema=False)


class LoginNeededError(Exception):
    """The caller is not logged in; the login page leads back to ``target``, or to the form that was ``kept``.

    lost
        True for a form that was too large to be read before the login.
    """

    def __init__(self, target: str, kept: UnsentForm | None = None, lost: bool = False) -> None:
        super().__init__(target)
        self.target, self.kept, self.lost = target, kept, lost


class OldFormError(Exception):
    """A form of ours that was shown in an earlier session; the person is asked whether to send it now."""

    def __init__(self, actor: Actor, kept: UnsentForm) -> None:
        super().__init__(kept.path)
        self.actor, self.kept = actor, kept


class PageGuard(Guard):
    """As :class:`Guard`, for people: what they typed is kept over a login."""

    async def __call__(self, request: Request) -> Call:
        try:
            return await super().__call__(request)
        except FormSecretError:
            kept, actor = await _pending_form(request), await anyio.to_thread.run_sync(find_actor, request)
            if kept is None or actor is None or not own_site(request):
                raise
            raise OldFormError(actor, kept) from None
        except AuthError as error:
            if error.status_hint != 401:
                request.state.kept = await _pending_form(request)
                raise
            if not own_site(request) or not _sends_form(request):
                raise LoginNeededError(_referring_page(request)) from None
            # A caller who is not known has no form read that could not be kept.
            if not _is_short(request):
                raise LoginNeededError(_referring_page(request), lost=True) from None
            raise LoginNeededError(_referring_page(request), await _pending_form(request)) from None


async def _pending_form(request: Request) -> UnsentForm | None:
    """Read the form that a request sends; None if it sends none."""
    return unsent_form(request.url.path, await form_of(request)) if _sends_form(request) else None


def _sends_form(request: Request) -> bool:
    is_form = request.headers.get("content-type", "").startswith(FORM_TYPES)
    return is_form and request.method not in SAFE_METHODS


def _is_short(request: Request) -> bool:
    length = request.headers.get("content-length", "")
    return length.isdecimal() and int(length) <= UNKNOWN_BODY


Reader = Annotated[Call, Depends(PageGuard(Role.VIEWER))]
Writer = Annotated[Call, Depends(PageGuard(Role.EDITOR))]
Administrator = Annotated[Call, Depends(PageGuard(Role.ADMIN))]


def own_form(request: Request) -> None:
    """Check the login, the one form without a session: ForbiddenError if another site sent it.

    A browser says where a form comes from; a page elsewhere must not log somebody in under its own name.
    """
    if own_site(request) is False:
        raise ForbiddenError(_("this form was sent by another site; log in on the login page itself"))


def _referring_page(request: Request) -> str:
    if request.method in SAFE_METHODS:
        query = f"?{request.url.query}" if request.url.query else ""
        return request.url.path + query
    # A form cannot be sent again by a link; the page before it is the best that is left.
    referer = urlsplit(request.headers.get("referer", ""))
    path = referer.path.removeprefix(server_of(request).settings.root_path)
    return path if referer.netloc == request.headers.get("host") and path else "/"


def _login_page(
    request: Request,
    target: str,
    problem: str = "",
    status: int = 200,
    kept: UnsentForm | None = None,
    lost: bool = False,
) -> Response:
    signed = kept.signed(_signing_key(request)) if kept is not None else ""
    lost = lost or (kept is not None and not signed)
    values = {"target": target, "problem": problem, "signed": signed, "lost": lost}
    return page_for(request, None, "login.html", status=status, **values)


def _signing_key(request: Request) -> bytes:
    with server_of(request).db.read() as tx:
        return signing_key(tx)


async def to_login(request: Request, error: Exception) -> Response:
    """Lead visitors who are not logged in to the login page."""
    assert isinstance(error, LoginNeededError)
    if error.kept is None and not error.lost:
        return RedirectResponse("/login?next=" + quote(error.target, safe="/"), 303)
    return await anyio.to_thread.run_sync(_login_page, request, error.target, "", 401, error.kept, error.lost)


async def send_again(request: Request, error: Exception) -> Response:
    """Ask whether to send a form of an earlier session now."""
    assert isinstance(error, OldFormError)
    actor, kept = error.actor, error.kept
    return await anyio.to_thread.run_sync(
        lambda: page_for(request, actor, "again.html", status=403, kept=kept)
    )


START = "/"
LANGUAGE_SECONDS = 400 * 86_400  # no browser keeps a cookie for longer
Next = Annotated[str, Query(max_length=500)]


@router.get("/login")
def login_form(request: Request, next: Next = START) -> Response:
    """Show the login form; redirect users who are logged in already."""
    if find_actor(request) is not None:
        return back(local_path(next))
    return _login_page(request, local_path(next))


@router.post("/login", dependencies=[Depends(own_form)])
def log_in(request: Request, server: ServerDep, form: Form) -> Response:
    """Begin a session and lead to ``next``, or to the form that was being sent when the last one ended."""
    target = local_path(text(form, "next"))
    signed = form.get("kept")
    kept = read_signed(signed, _signing_key(request)) if isinstance(signed, str) and signed else None

    if "already" in form:
        actor = find_actor(request)
        if actor is None:
            return _login_page(request, target, _("You are not logged in yet in this browser."), 401, kept)
        return page_for(request, actor, "again.html", kept=kept) if kept else back(target)
    try:
        session = sessions.log_in(
            server.db, text(form, "username", 200), password_of(form, "password"), client_address(request)
        )
    except (AuthError, TooManyAttemptsError) as error:
        return _login_page(request, target, str(error), error.status_hint, kept)
    if kept is None:
        return _with_session(request, session, target)
    actor = actor_by_session(server.db, session.secret, client_address(request))
    shown = page_for(request, actor, "again.html", kept=kept)
    set_session_cookie(shown, request, session)
    return shown


@router.get("/login/link/{secret}")
def login_link(request: Request, secret: str, next: Next = START) -> Response:
    """Ask before the link is used up: mail scanners and previews open links, and must not do that."""
    return page_for(request, None, "login_link.html", secret=secret, target=local_path(next))


@router.post("/login/link/{secret}", dependencies=[Depends(own_form)])
def use_link(request: Request, server: ServerDep, secret: str, form: Form) -> Response:
    """Begin a session by a one-time link; a used one still leads on in a browser that is logged in."""
    target = local_path(text(form, "next"))
    try:
        session = use_login_link(server.db, secret, client_address(request))
    except AuthError as error:
        if find_actor(request) is not None:
            return back(target)
        return _login_page(request, target, str(error), 401)
    return _with_session(request, session, target)


@router.post("/logout")
def log_out(call: Reader) -> Response:
    """End the session."""
    sessions.log_out(call.server.db, call.actor)
    response = RedirectResponse("/login", 303)
    response.delete_cookie(SESSION_COOKIE)
    return response


@router.post("/language", dependencies=[Depends(own_form)])
def choose_language(form: Form) -> Response:
    """Keep the language that a user chose, in a cookie of this browser."""
    chosen = text(form, "language")
    if chosen not in LANGUAGES:
        raise RejectedError(
            message(
                "language: wanted one of {known}, got {got}", known=", ".join(LANGUAGES), got=repr(chosen)
            )
        )
    response = back(local_path(text(form, "next")))
    response.set_cookie(LANGUAGE_COOKIE, chosen, max_age=LANGUAGE_SECONDS, httponly=True, samesite="lax")
    return response


def _with_session(request: Request, session: NewSession, target: str) -> Response:
    response = back(target)
    set_session_cookie(response, request, session)
    return response


AUDIT_SIZE = 100
MODES = ("normal", "read-only")


@router.get("/users")
def users_page(call: Administrator) -> Response:
    """Show all users and tokens, and once a login link that was just made."""
    link = secret_of(call.request)
    response = _show(call, link=link)
    return take_away_secret(call.request, response, "/users") if link else response


@router.post("/users")
def create_user(call: Administrator, form: Form) -> Response:
    """Make a user; without a password a login link lets the user in."""
    typed = {name: text(form, name, 200) for name in ("username", "display_name", "role")}
    username = typed["username"]
    try:
        with call.write(even_when_read_only=True) as tx:
            users.create_user(
                tx,
                username,
                _role(typed["role"]),
                display_name=typed["display_name"],
                password=password_of(form, "password") or None,
            )
    except SiloError as error:
        return _show(call, problem=str(error), status=error.status_hint, typed=typed)
    return back("/users", _("User %(username)s was added.", username=username))


@router.post("/users/{username}")
def change_user(call: Administrator, username: str, form: Form) -> Response:
    """Save what the admin changed: a user's role, right to approve, or whether the user may log in."""
    typed = {name: text(form, name) for name in ("role", "active", "approver") if name in form}
    seen = {name: text(form, f"was_{name}") for name in typed if f"was_{name}" in form}
    try:
        with call.write(even_when_read_only=True) as tx:
            user = get_user(tx, username)
            now = {
                "role": user.role.value,
                "active": "yes" if user.active else "no",
                "approver": "yes" if user.approver else "no",
            }
            edit = compared(now, seen, typed)
            if edit.clashes:
                raise ConflictError(
                    _(
                        "somebody else changed %(username)s meanwhile; nothing was saved, and this page "
                        "shows the present state",
                        username=username,
                    )
                )
            role, active, approver = map(edit.mine.get, ("role", "active", "approver"))
            users.change_user(
                tx,
                username,
                role=_role(role) if role is not None else None,
                active=active == "yes" if active is not None else None,
                approver=approver == "yes" if approver is not None else None,
            )
    except SiloError as error:
        return _show(call, problem=str(error), status=error.status_hint)
    return back(
        "/users",
        _("User %(username)s is changed.", username=username)
        if edit.mine
        else _("Nothing differs, so nothing was saved."),
    )


@router.post("/users/{username}/login-link")
def create_login_link(call: Administrator, username: str) -> Response:
    """Make a link that lets this user in once; the page that follows shows it once."""
    # Not by the Host header, which the caller chooses: the link is sent on, and lets its holder in.
    link = f"{call.server.settings.public_url or ''}{login_path(call, username)}"
    return back_with_secret(call.request, "/users", username, link)


@router.post("/mode")
def set_mode(call: Administrator, form: Form) -> Response:
    """Allow changes, or refuse them until the mode is set again."""
    mode = text(form, "mode")
    if mode not in MODES:
        raise RejectedError(_("mode: wanted normal or read-only; load the page again"))
    with call.write(even_when_read_only=True) as tx:
        change_mode(tx, mode)
    return back(
        "/users",
        _("The server takes changes.") if mode == "normal" else _("The server takes no changes now."),
    )


@router.get("/system")
def system_page(call: Administrator) -> Response:
    """Show the state of the server to an administrator."""
    server = call.server
    state = standing(server.db, server.hub, server.files, server.large_reads)
    with call.read() as tx:
        last = state["backup"]
        days = (tx.at - datetime.fromisoformat(last["at"])).days if last else None
    return page(call, "system.html", told=state, backup_days=days)


@router.get("/audit")
def audit_page(call: Administrator, before: PageFrom = None, after: PageFrom = None) -> Response:
    """Show the audit list, newest first."""
    with call.read() as tx:
        part = part_of(partial(audit.list_entries, tx), AUDIT_SIZE, before, after)
    return page(call, "audit.html", entries=part.rows, part=part)


def _show(
    call: Call,
    *,
    problem: str = "",
    status: int = 200,
    link: tuple[str, str] | None = None,
    typed: Mapping[str, str] | None = None,
) -> Response:
    with call.read() as tx:
        everyone = list_users(tx)
        valid_tokens = [token for token in list_tokens(tx) if token.revoked_at is None]
        now, mode = tx.stamp, mode_of(tx)
        run = last_run(tx)
    return page(
        call,
        "users.html",
        status=status,
        users=everyone,
        tokens=valid_tokens,
        now=now,
        mode=mode,
        run=run,
        fixed=call.server.settings.read_only,
        roles=list(Role),
        problem=problem,
        link=link,
        typed=typed or {},
        minutes=int(call.server.settings.login_link_seconds // 60),
        shortest=MIN_PASSWORD,
    )


def _role(name: str) -> Role:
    try:
        return Role(name)
    except ValueError:
        raise RejectedError(
            _("role: wanted one of %(roles)s, got %(name)r", roles=", ".join(Role), name=name)
        ) from None


LIFETIMES = {"30": 30, "90": 90, "365": 365, "": None}
TokenId = Annotated[int, Path(ge=1, le=2**62)]


@router.get("/account")
def account_page(call: Reader) -> Response:
    """Show the person's own tokens (never their secrets), and a form for the password."""
    fresh = secret_of(call.request)
    response = _own_page(call, fresh=fresh)
    return take_away_secret(call.request, response, "/account") if fresh else response


@router.post("/account/tokens")
def create_token(call: Reader, form: Form) -> Response:
    """Make a token. The page that follows shows its secret once."""
    name, ends, wanted = text(form, "name"), text(form, "days"), text(form, "scope") or Scope.WRITE
    if not 0 < len(name) <= 200:
        return _own_page(call, problem=_("A token needs a name of at most 200 characters."))
    if ends not in LIFETIMES or wanted not in list(Scope):
        return _own_page(call, problem=_("Choose a lifetime and a scope."))
    days, scope, secret = LIFETIMES[ends], Scope(wanted), None
    if key := text(form, "key"):
        secret = secret_of_form(call.actor, key, name, ends, wanted)
    try:
        with call.write(even_when_read_only=True) as tx:
            _token, secret = create_own_token(
                tx, name, days=days, forever=days is None, scope=scope, secret=secret
            )
    except ConflictError as error:
        return _own_page(call, problem=str(error))
    return back_with_secret(call.request, "/account", name, secret)


@router.post("/account/tokens/{token_id}/revoke")
def revoke_token(call: Reader, token_id: TokenId, form: Form) -> Response:
    """Revoke a token: one's own, or anybody's for an admin. What was made with it is shown first."""
    origin, chosen = "users" if text(form, "from") == "users" else "account", text(form, "children")
    try:
        revoke(call, token_id, Children(chosen) if chosen in list(Children) else None)
    except ChildrenError as error:
        return page(call, "token_children.html", token_id=token_id, living=error.living, origin=origin)
    return back(f"/{origin}", _("The token is revoked."))


@router.post("/account/logout-everywhere")
def log_out_everywhere(call: Reader) -> Response:
    """End all sessions of the user, and what was made in them."""
    sessions.log_out_everywhere(call.server.db, call.actor)
    response = back(
        "/login", _("You are logged out everywhere. Tokens that were made in your sessions have ended.")
    )
    response.delete_cookie(SESSION_COOKIE)
    return response


@router.post("/account/password")
def set_password(call: Reader, form: Form) -> Response:
    """Set the person's password and end all their sessions. Needs the old one, but not after a login link."""
    password, again = password_of(form, "password"), password_of(form, "again")
    try:
        if password != again:
            raise RejectedError(_("The two passwords differ."))
        set_own_password(call.server.db, call.actor, password, password_of(form, "current"))
    except (RejectedError, TooManyAttemptsError) as error:
        return _own_page(call, problem=str(error))
    response = back("/login", _("The password is set. Log in with it."))
    response.delete_cookie(SESSION_COOKIE)
    return response


def _own_page(call: Call, *, problem: str = "", fresh: tuple[str, str] | None = None) -> Response:
    with call.read() as tx:
        own_tokens = list_tokens(tx, call.actor.own_id)
        now = tx.stamp
        user = get_user(tx, call.actor.username)
    return page(
        call,
        "account.html",
        status=400 if problem else 200,
        tokens=own_tokens,
        now=now,
        user=user,
        lifetimes=[days for days in LIFETIMES.values() if days],
        key=secrets.token_hex(16),
        scopes=[scope for scope in Scope if call.actor.role.covers(scope.role)],
        asks_password=not call.actor.by_link,
        problem=problem,
        fresh=fresh,
        shortest=MIN_PASSWORD,
    )
