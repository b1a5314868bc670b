# SPDX-License-Identifier: LGPL-2.1-or-later
"""The accounts of users: making them, changing them, and what ends with a change.

The server always has an active admin. A change that takes access away ends what was granted before it:
sessions, login links and tokens.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy import func, insert, select, update

from silo.bom.errors import ConflictError, ForbiddenError, NotFoundError, RejectedError
from silo.bom.message import message
from silo_server.actors import Role
from silo_server.db.tables import api_tokens, device_logins, login_links, sessions, users
from silo_server.db.transaction import ADMIN_LOCK, Tx
from silo_server.errors import DuplicateError
from silo_server.fields import from_row
from silo_server.services.access.passwords import hash_password
from silo_server.services.access.tokens import check_lasting
from silo_server.services.audit import note

NO_TOKEN = message("a token cannot set the password of its own account; log in in a browser for that")

USERNAME_FORM = re.compile(r"[A-Za-z0-9][A-Za-z0-9._@-]{0,63}")


@dataclass(frozen=True, slots=True)
class User:
    """A user. ``has_password`` False means: only tokens and login links let this user in.

    approver
        may release revisions of products, whatever the role.
    """

    id: int
    username: str
    display_name: str
    role: Role
    active: bool
    approver: bool
    has_password: bool
    created_at: str


def to_user(row: Any) -> User:
    """Make a user from its row."""
    has_password = row.password_hash is not None
    return from_row(
        User,
        row,
        role=Role(row.role),
        active=bool(row.active),
        approver=bool(row.approver),
        has_password=has_password,
    )


def list_users(tx: Tx) -> list[User]:
    """Read all users, sorted by name."""
    return [to_user(row) for row in tx.conn.execute(select(users).order_by(users.c.username_key))]


def get_user(tx: Tx, username: str) -> User:
    """Find a user by name, in upper or lower case; NotFoundError if there is none."""
    row = row_of(tx, username)
    if row is None:
        raise NotFoundError(message("there is no user {username}", username=repr(username)))
    return to_user(row)


def row_of(tx: Tx, username: str) -> Any:
    """Find the row of a user by name, in upper or lower case; None if there is none."""
    return tx.conn.execute(select(users).where(users.c.username_key == username.casefold())).one_or_none()


def create_user(
    tx: Tx, username: str, role: Role, *, display_name: str = "", password: str | None = None
) -> User:
    """Make a user; RejectedError for an unusable name or password, DuplicateError for a taken name."""
    if not USERNAME_FORM.fullmatch(username):
        raise RejectedError(
            message(
                "username: wanted 1 to 64 letters, digits or . _ @ - beginning with a letter or digit, got "
                "{username}",
                username=repr(username),
            )
        )
    if password is not None:
        check_lasting(tx, message("give a password"))
    if row_of(tx, username) is not None:
        raise DuplicateError(message("username {username} is taken", username=username))
    tx.conn.execute(
        insert(users).values(
            username=username,
            username_key=username.casefold(),
            display_name=display_name or username,
            role=role.value,
            password_hash=hash_password(password) if password is not None else None,
            active=True,
            created_at=tx.stamp,
        )
    )
    note(tx, "user.created", username, f"role {role.value}")
    return get_user(tx, username)


def change_user(
    tx: Tx,
    username: str,
    *,
    role: Role | None = None,
    display_name: str | None = None,
    active: bool | None = None,
    approver: bool | None = None,
    password: str | None = None,
) -> User:
    """Change a user. ConflictError if no active admin would be left.

    A new password ends the user's sessions and login links, another role the login links. Deactivation ends
    both, and revokes the tokens: a user who is let in again makes new ones.
    """
    if role is not None or active is not None:
        # Two admins who demote each other at the same time must not leave the server without an admin.
        tx.lock(ADMIN_LOCK)
    user = get_user(tx, username)
    if password is not None and tx.actor.by_token and tx.actor.user_id == user.id:
        raise ForbiddenError(NO_TOKEN)
    if role is not None and not user.role.covers(role):
        check_lasting(tx, message("give a higher role"))
    if active and not user.active:
        check_lasting(tx, message("let a user in again"))
    if approver and not user.approver:
        check_lasting(tx, message("give the right to approve"))
    if password is not None:
        check_lasting(tx, message("set a password"))
    loses = (role is not None and role is not Role.ADMIN) or active is False
    admins = select(func.count()).where(users.c.role == Role.ADMIN.value, users.c.active)
    if loses and user.role is Role.ADMIN and user.active and tx.conn.execute(admins).scalar_one() <= 1:
        raise ConflictError(
            message("{username} is the last admin; make another user an admin first", username=user.username)
        )
    given: dict[str, object] = {
        "role": role and role.value,
        "display_name": display_name,
        "active": active,
        "approver": approver,
        "password_hash": None if password is None else hash_password(password),
    }
    if values := {name: value for name, value in given.items() if value is not None}:
        tx.conn.execute(update(users).where(users.c.id == user.id).values(**values))
        note(tx, "user.changed", user.username, _what_changed(user, values))
    ended = [sessions, device_logins] if password is not None or active is False else []
    if ended or role not in (None, user.role):
        ended.append(login_links)
    if ended:
        tx.end_access()
    for table in ended:
        tx.conn.execute(table.delete().where(table.c.user_id == user.id))
    if active is False:
        theirs = (api_tokens.c.user_id == user.id) & api_tokens.c.revoked_at.is_(None)
        tx.conn.execute(update(api_tokens).where(theirs).values(revoked_at=tx.stamp))
    return get_user(tx, username)


def _what_changed(user: User, values: Mapping[str, object]) -> str:
    """Describe a change for the audit list: ``role viewer → editor``; never shows a password."""
    before: dict[str, object] = {
        "role": user.role.value,
        "display_name": user.display_name,
        "active": user.active,
        "approver": user.approver,
    }
    changes = [
        f"{name.replace('_', ' ')} {old} → {values[name]}"
        for name, old in before.items()
        if values.get(name, old) != old
    ]
    return ", ".join([*changes, *(["password"] if "password_hash" in values else [])]) or "nothing"


def make_admin(tx: Tx, username: str) -> User:
    """Make this user an active admin; make the user if there is none."""
    tx.lock(ADMIN_LOCK)
    if row_of(tx, username) is None:
        return create_user(tx, username, Role.ADMIN)
    return change_user(tx, username, role=Role.ADMIN, active=True)
