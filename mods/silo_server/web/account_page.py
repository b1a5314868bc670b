# SPDX-License-Identifier: LGPL-2.1-or-later
"""One's own password and API tokens."""

from __future__ import annotations

import secrets
from typing import Annotated

from fastapi import APIRouter, Path, Request
from starlette.datastructures import FormData
from starlette.responses import Response

from silo.bom.errors import ConflictError, RejectedError
from silo_server.errors import TooManyAttemptsError
from silo_server.routes.context import SESSION_COOKIE, Server, ServerDep
from silo_server.services.access import accounts, credentials, logins
from silo_server.values import Actor, Role, Scope
from silo_server.web.forms import (
    Form,
    back,
    back_with_secret,
    secret_of,
    take_away_secret,
    text,
)
from silo_server.web.guard import Reader
from silo_server.web.render import page

router = APIRouter(include_in_schema=False)

LIFETIMES = {"30": 30, "90": 90, "365": 365, "": None}
TokenId = Annotated[int, Path(ge=1, le=2**62)]


@router.get("/account")
def account_page(request: Request, server: ServerDep, caller: Reader) -> Response:
    """The own tokens, never their secrets, and a form for the password."""
    fresh = secret_of(request)
    response = _show(request, server, caller, fresh=fresh)
    return take_away_secret(request, response, "/account") if fresh else response


@router.post("/account/tokens")
def create_token(request: Request, server: ServerDep, caller: Reader, form: Form) -> Response:
    """Make a token. Its secret is shown once, on the page that this leads to."""
    name, ends, wanted = text(form, "name"), text(form, "days"), text(form, "scope") or Scope.WRITE
    if not 0 < len(name) <= 200:
        return _show(request, server, caller, problem="A token needs a name of at most 200 characters.")
    if ends not in LIFETIMES:
        return _show(request, server, caller, problem="Choose one of the lifetimes.")
    try:
        scope = Scope(wanted)
    except ValueError:
        return _show(request, server, caller, problem="Choose one of the scopes.")
    days, secret = LIFETIMES[ends], None
    if key := text(form, "key"):
        secret = credentials.secret_of_form(caller, key, name, ends, wanted)
    try:
        with server.db.write(caller, even_when_read_only=True) as tx:
            _, secret = credentials.create_own_token(
                tx, name, days=days, forever=days is None, scope=scope, secret=secret
            )
    except ConflictError as error:
        return _show(request, server, caller, problem=str(error))
    return back_with_secret(request, "/account", name, secret)


@router.post("/account/tokens/{token_id}/revoke")
def revoke_token(server: ServerDep, caller: Reader, token_id: TokenId, form: Form) -> Response:
    """Revoke a token: one's own, or anybody's for an admin."""
    credentials.check_may_change(caller)
    owner = None if caller.role is Role.ADMIN else _user_id(caller)
    with server.db.write(caller, even_when_read_only=True) as tx:
        credentials.revoke_token(tx, token_id, owner)
    return back("/users" if text(form, "from") == "users" else "/account", "The token is revoked.")


@router.post("/account/password")
def set_password(request: Request, server: ServerDep, caller: Reader, form: Form) -> Response:
    """Set the own password; ends all own sessions. Asks for the old one, but after a login link."""
    password, again = password_of(form, "password"), password_of(form, "again")
    try:
        if password != again:
            raise RejectedError("The two passwords differ.")
        logins.set_own_password(server.db, caller, password, password_of(form, "current"))
    except (RejectedError, TooManyAttemptsError) as error:
        return _show(request, server, caller, problem=str(error))
    response = back("/login", "The password is set. Log in with it.")
    response.delete_cookie(SESSION_COOKIE)
    return response


def password_of(form: FormData, name: str) -> str:
    """A password as it was typed: spaces at its ends belong to it."""
    value = form.get(name)
    return value[: accounts.MAX_PASSWORD + 1] if isinstance(value, str) else ""


def _show(
    request: Request,
    server: Server,
    caller: Actor,
    *,
    problem: str = "",
    fresh: tuple[str, str] | None = None,
) -> Response:
    with server.db.read(caller) as tx:
        tokens = credentials.list_tokens(tx, _user_id(caller))
        now = tx.stamp
        user = accounts.get_user(tx, caller.username)
    return page(
        request,
        "account.html",
        caller,
        status=400 if problem else 200,
        tokens=tokens,
        now=now,
        user=user,
        lifetimes=[days for days in LIFETIMES.values() if days],
        key=secrets.token_hex(16),
        scopes=[scope for scope in Scope if caller.role.covers(scope.role)],
        asks_password=not caller.by_link,
        problem=problem[:1].upper() + problem[1:],
        fresh=fresh,
        shortest=accounts.MIN_PASSWORD,
    )


def _user_id(caller: Actor) -> int:
    assert caller.user_id is not None  # every caller that a guard let in is a user
    return caller.user_id
