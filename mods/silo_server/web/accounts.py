# SPDX-License-Identifier: LGPL-2.1-or-later
"""One's own password and API tokens; for admins users, everybody's tokens, the mode, and the audit list."""

from __future__ import annotations

import secrets
from collections.abc import Mapping
from functools import partial
from typing import Annotated

from fastapi import APIRouter, Path
from starlette.responses import Response

from silo.bom.errors import ConflictError, RejectedError, SiloError
from silo_server.db.engine import mode_of
from silo_server.errors import TooManyAttemptsError
from silo_server.operation.housekeeping import last_run
from silo_server.routes.context import SESSION_COOKIE, Call, PageFrom
from silo_server.services import events
from silo_server.services.access import accounts, audit, credentials, logins
from silo_server.values import Role, Scope
from silo_server.web.forms import (
    Form,
    back,
    back_with_secret,
    compared,
    password_of,
    secret_of,
    take_away_secret,
    text,
)
from silo_server.web.login_page import Administrator, Reader
from silo_server.web.render import page, sentence
from silo_server.web.tables import part_of

router = APIRouter(include_in_schema=False)

AUDIT_SIZE = 100
MODES = ("normal", "read-only")


@router.get("/users")
def users_page(call: Administrator) -> Response:
    """All users and tokens; a login link that was just made is shown once."""
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
            accounts.create_user(
                tx,
                username,
                _role(typed["role"]),
                display_name=typed["display_name"],
                password=password_of(form, "password") or None,
            )
    except SiloError as error:
        return _show(call, problem=str(error), status=error.status_hint, typed=typed)
    return back("/users", f"User {username} is made.")


@router.post("/users/{username}")
def change_user(call: Administrator, username: str, form: Form) -> Response:
    """Change what the admin changed: a user's role, or whether anybody gets in under this name."""
    typed = {name: text(form, name) for name in ("role", "active") if name in form}
    seen = {name: text(form, f"was_{name}") for name in typed if f"was_{name}" in form}
    try:
        with call.write(even_when_read_only=True) as tx:
            user = accounts.get_user(tx, username)
            now = {"role": user.role.value, "active": "yes" if user.active else "no"}
            edit = compared(now, seen, typed)
            if edit.clashes:
                raise ConflictError(
                    f"{username} was changed by somebody else meanwhile, and stays as this page shows it now"
                )
            role, active = edit.mine.get("role"), edit.mine.get("active")
            accounts.change_user(
                tx,
                username,
                role=_role(role) if role is not None else None,
                active=active == "yes" if active is not None else None,
            )
    except SiloError as error:
        return _show(call, problem=str(error), status=error.status_hint)
    return back("/users", f"User {username} is changed." if edit.mine else "Nothing was different.")


@router.post("/users/{username}/login-link")
def create_login_link(call: Administrator, username: str) -> Response:
    """A link that lets this user in once; it is shown once, on the page that this leads to."""
    with call.write(even_when_read_only=True) as tx:
        secret = logins.create_login_link(tx, username)
        audit.note(tx, "login_link.created", username)
    # Not by the Host header, which the caller chooses: the link is sent on, and lets its holder in.
    link = f"{call.server.settings.public_url or ''}/login/link/{secret}"
    return back_with_secret(call.request, "/users", username, link)


@router.post("/mode")
def set_mode(call: Administrator, form: Form) -> Response:
    """Take changes, or take none until set otherwise."""
    mode = text(form, "mode")
    if mode not in MODES:
        raise RejectedError("mode: wanted normal or read-only; load the page again")
    with call.write(even_when_read_only=True) as tx:
        events.set_mode(tx, mode)
    return back(
        "/users", "The server takes changes." if mode == "normal" else "The server takes no changes now."
    )


@router.get("/audit")
def audit_page(call: Administrator, before: PageFrom = None, after: PageFrom = None) -> Response:
    """Who did what, newest first."""
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
        users = accounts.list_users(tx)
        tokens = [token for token in credentials.list_tokens(tx) if token.revoked_at is None]
        now, mode = tx.stamp, mode_of(tx)
        run = last_run(tx)
    return page(
        call,
        "users.html",
        status=status,
        users=users,
        tokens=tokens,
        now=now,
        mode=mode,
        run=run,
        fixed=call.server.settings.read_only,
        roles=list(Role),
        problem=sentence(problem),
        link=link,
        typed=typed or {},
        minutes=int(call.server.settings.login_link_seconds // 60),
        shortest=accounts.MIN_PASSWORD,
    )


def _role(name: str) -> Role:
    try:
        return Role(name)
    except ValueError:
        raise RejectedError(f"role: wanted one of {', '.join(Role)}, got {name!r}") from None


LIFETIMES = {"30": 30, "90": 90, "365": 365, "": None}
TokenId = Annotated[int, Path(ge=1, le=2**62)]


@router.get("/account")
def account_page(call: Reader) -> Response:
    """The own tokens, never their secrets, and a form for the password."""
    fresh = secret_of(call.request)
    response = _own_page(call, fresh=fresh)
    return take_away_secret(call.request, response, "/account") if fresh else response


@router.post("/account/tokens")
def create_token(call: Reader, form: Form) -> Response:
    """Make a token. Its secret is shown once, on the page that this leads to."""
    name, ends, wanted = text(form, "name"), text(form, "days"), text(form, "scope") or Scope.WRITE
    if not 0 < len(name) <= 200:
        return _own_page(call, problem="A token needs a name of at most 200 characters.")
    if ends not in LIFETIMES or wanted not in list(Scope):
        return _own_page(call, problem="Choose one of the lifetimes, and one of the scopes.")
    days, scope, secret = LIFETIMES[ends], Scope(wanted), None
    if key := text(form, "key"):
        secret = credentials.secret_of_form(call.actor, key, name, ends, wanted)
    try:
        with call.write(even_when_read_only=True) as tx:
            _, secret = credentials.create_own_token(
                tx, name, days=days, forever=days is None, scope=scope, secret=secret
            )
    except ConflictError as error:
        return _own_page(call, problem=str(error))
    return back_with_secret(call.request, "/account", name, secret)


@router.post("/account/tokens/{token_id}/revoke")
def revoke_token(call: Reader, token_id: TokenId, form: Form) -> Response:
    """Revoke a token: one's own, or anybody's for an admin."""
    credentials.check_may_change(call.actor)
    owner = None if call.actor.role is Role.ADMIN else call.actor.own_id
    with call.write(even_when_read_only=True) as tx:
        credentials.revoke_token(tx, token_id, owner)
    return back("/users" if text(form, "from") == "users" else "/account", "The token is revoked.")


@router.post("/account/password")
def set_password(call: Reader, form: Form) -> Response:
    """Set the own password; ends all own sessions. Asks for the old one, but after a login link."""
    password, again = password_of(form, "password"), password_of(form, "again")
    try:
        if password != again:
            raise RejectedError("The two passwords differ.")
        logins.set_own_password(call.server.db, call.actor, password, password_of(form, "current"))
    except (RejectedError, TooManyAttemptsError) as error:
        return _own_page(call, problem=str(error))
    response = back("/login", "The password is set. Log in with it.")
    response.delete_cookie(SESSION_COOKIE)
    return response


def _own_page(call: Call, *, problem: str = "", fresh: tuple[str, str] | None = None) -> Response:
    with call.read() as tx:
        tokens = credentials.list_tokens(tx, call.actor.own_id)
        now = tx.stamp
        user = accounts.get_user(tx, call.actor.username)
    return page(
        call,
        "account.html",
        status=400 if problem else 200,
        tokens=tokens,
        now=now,
        user=user,
        lifetimes=[days for days in LIFETIMES.values() if days],
        key=secrets.token_hex(16),
        scopes=[scope for scope in Scope if call.actor.role.covers(scope.role)],
        asks_password=not call.actor.by_link,
        problem=sentence(problem),
        fresh=fresh,
        shortest=accounts.MIN_PASSWORD,
    )
