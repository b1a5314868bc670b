# SPDX-License-Identifier: LGPL-2.1-or-later
"""For admins: users, everybody's tokens, the server's mode, and the audit list."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Annotated

from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from silo.bom.errors import ConflictError, RejectedError, SiloError
from silo_server.db.engine import mode_of
from silo_server.db.state import put_state
from silo_server.operation.housekeeping import last_run
from silo_server.routes.context import Server, ServerDep
from silo_server.services import events
from silo_server.services.access import accounts, audit, credentials, logins
from silo_server.values import Actor, Role
from silo_server.web.account_page import password_of
from silo_server.web.forms import (
    Form,
    back,
    back_with_secret,
    compared,
    secret_of,
    take_away_secret,
    text,
)
from silo_server.web.guard import Administrator
from silo_server.web.render import page
from silo_server.web.tables import part_of

router = APIRouter(include_in_schema=False)

AUDIT_SIZE = 100
Point = Annotated[int | None, Query(ge=0, le=2**62)]
MODES = ("normal", "read-only")


@router.get("/users")
def users_page(request: Request, server: ServerDep, caller: Administrator) -> Response:
    """All users and tokens; a login link that was just made is shown once."""
    link = secret_of(request)
    response = _show(request, server, caller, link=link)
    return take_away_secret(request, response, "/users") if link else response


@router.post("/users")
def create_user(request: Request, server: ServerDep, caller: Administrator, form: Form) -> Response:
    """Make a user; without a password a login link lets the user in."""
    typed = {name: text(form, name, 200) for name in ("username", "display_name", "role")}
    username = typed["username"]
    try:
        with server.db.write(caller, even_when_read_only=True) as tx:
            accounts.create_user(
                tx,
                username,
                _role(typed["role"]),
                display_name=typed["display_name"],
                password=password_of(form, "password") or None,
            )
    except SiloError as error:
        return _show(request, server, caller, problem=str(error), status=error.status_hint, typed=typed)
    return back("/users", f"User {username} is made.")


@router.post("/users/{username}")
def change_user(
    request: Request, server: ServerDep, caller: Administrator, username: str, form: Form
) -> Response:
    """Change what the admin changed: a user's role, or whether anybody gets in under this name."""
    typed = {name: text(form, name) for name in ("role", "active") if name in form}
    seen = {name: text(form, f"was_{name}") for name in typed if f"was_{name}" in form}
    try:
        with server.db.write(caller, even_when_read_only=True) as tx:
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
        return _show(request, server, caller, problem=str(error), status=error.status_hint)
    return back("/users", f"User {username} is changed." if edit.mine else "Nothing was different.")


@router.post("/users/{username}/login-link")
def create_login_link(request: Request, server: ServerDep, caller: Administrator, username: str) -> Response:
    """A link that lets this user in once; it is shown once, on the page that this leads to."""
    with server.db.write(caller, even_when_read_only=True) as tx:
        secret = logins.create_login_link(tx, username)
        audit.note(tx, "login_link.created", username)
    # Not by the Host header, which the caller chooses: the link is sent on, and lets its holder in.
    link = f"{server.settings.public_url or ''}/login/link/{secret}"
    return back_with_secret(request, "/users", username, link)


@router.post("/mode")
def set_mode(server: ServerDep, caller: Administrator, form: Form) -> Response:
    """Take changes, or take none until set otherwise."""
    mode = text(form, "mode")
    if mode not in MODES:
        raise RejectedError("mode: wanted normal or read-only; load the page again")
    with server.db.write(caller, even_when_read_only=True) as tx:
        audit.note(tx, "mode.set", mode, f"{mode_of(tx)} → {mode}")
        put_state(tx, "mode", mode)
        events.server_state(tx, mode_of(tx))
    return back(
        "/users", "The server takes changes." if mode == "normal" else "The server takes no changes now."
    )


@router.get("/audit")
def audit_page(
    request: Request,
    server: ServerDep,
    caller: Administrator,
    before: Point = None,
    after: Point = None,
) -> Response:
    """Who did what, newest first."""
    with server.db.read(caller) as tx:
        part = part_of(partial(audit.list_entries, tx), AUDIT_SIZE, before, after)
    return page(request, "audit.html", caller, entries=part.rows, part=part)


def _show(
    request: Request,
    server: Server,
    caller: Actor,
    *,
    problem: str = "",
    status: int = 200,
    link: tuple[str, str] | None = None,
    typed: Mapping[str, str] | None = None,
) -> Response:
    with server.db.read(caller) as tx:
        users = accounts.list_users(tx)
        tokens = [token for token in credentials.list_tokens(tx) if token.revoked_at is None]
        now, mode = tx.stamp, mode_of(tx)
        run = last_run(tx)
    return page(
        request,
        "users.html",
        caller,
        status=status,
        users=users,
        tokens=tokens,
        now=now,
        mode=mode,
        run=run,
        fixed=server.settings.read_only,
        roles=list(Role),
        problem=problem[:1].upper() + problem[1:],
        link=link,
        typed=typed or {},
        minutes=int(server.settings.login_link_seconds // 60),
        shortest=accounts.MIN_PASSWORD,
    )


def _role(name: str) -> Role:
    try:
        return Role(name)
    except ValueError:
        raise RejectedError(f"role: wanted one of {', '.join(Role)}, got {name!r}") from None
