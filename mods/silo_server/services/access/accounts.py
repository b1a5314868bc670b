# SPDX-License-Identifier: LGPL-2.1-or-later
"""Users and their passwords (argon2id through argon2-cffi)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError
from sqlalchemy import func, insert, select, update

from silo.bom.errors import ConflictError, ForbiddenError, NotFoundError, RejectedError
from silo_server.db.engine import ADMIN_LOCK, Turnstile, Tx
from silo_server.db.tables import api_tokens, login_links, sessions, users
from silo_server.services.access import audit
from silo_server.settings import DuplicateError, wire
from silo_server.values import Role, from_row

MIN_PASSWORD = 10
NO_TOKEN = "a token cannot set the password of its own account; log in in a browser for that"
MAX_PASSWORD = 200
# Each hash takes 64 MiB for as long as it takes.
_HASHING = Turnstile(places=2, waiting=64, seconds=20, who="log-ins")
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


@cache
def _hasher() -> PasswordHasher:
    return PasswordHasher()


@cache
def _decoy() -> str:
    # Verified against when there is no such user, so that the answer's time gives nothing away.
    with _HASHING.enter():
        return _hasher().hash("a password that nobody has")


def to_user(row: Any) -> User:
    """A frozen user from its row."""
    known = row.password_hash is not None
    return from_row(
        User,
        row,
        role=Role(row.role),
        active=bool(row.active),
        approver=bool(row.approver),
        has_password=known,
    )


def list_users(tx: Tx) -> list[User]:
    """All users by name."""
    return [to_user(row) for row in tx.conn.execute(select(users).order_by(users.c.username_key))]


def get_user(tx: Tx, username: str) -> User:
    """The user, in whatever case; NotFoundError where there is none."""
    row = row_of(tx, username)
    if row is None:
        raise NotFoundError(f"there is no user {username!r}")
    return to_user(row)


def row_of(tx: Tx, username: str) -> Any:
    """The row of this user, None where there is none."""
    return tx.conn.execute(select(users).where(users.c.username_key == username.casefold())).one_or_none()


def create_user(
    tx: Tx, username: str, role: Role, *, display_name: str = "", password: str | None = None
) -> User:
    """Make a user; RejectedError for an unusable name or password, DuplicateError for a taken name."""
    if not USERNAME_FORM.fullmatch(username):
        raise RejectedError(
            "username: wanted 1 to 64 letters, digits or . _ @ - beginning with a letter or digit, "
            f"got {username!r}"
        )
    if password is not None:
        check_lasting(tx, "give a password")
    if row_of(tx, username) is not None:
        raise DuplicateError(f"username {username} is taken")
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
    audit.note(tx, "user.created", username, f"role {role.value}")
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
    """Change a user; the last active admin cannot be taken away.

    A new password ends the user's sessions and login links, another role the login links. Deactivation ends
    both, and revokes the tokens: who is let in again later makes new ones.
    """
    if role is not None or active is not None:
        # Two admins who demote each other at once must not both be the one but last.
        tx.lock(ADMIN_LOCK)
    user = get_user(tx, username)
    if password is not None and tx.actor.by_token and tx.actor.user_id == user.id:
        raise ForbiddenError(NO_TOKEN)
    if role is not None and not user.role.covers(role):
        check_lasting(tx, "give a higher role")
    if active and not user.active:
        check_lasting(tx, "let a user in again")
    if approver and not user.approver:
        check_lasting(tx, "give the right to approve")
    if password is not None:
        check_lasting(tx, "set a password")
    loses = (role is not None and role is not Role.ADMIN) or active is False
    if loses and user.role is Role.ADMIN and user.active and _active_admins(tx) <= 1:
        raise ConflictError(f"{user.username} is the last admin; make another user an admin first")
    values: dict[str, object] = {}
    if role is not None:
        values["role"] = role.value
    if display_name is not None:
        values["display_name"] = display_name
    if active is not None:
        values["active"] = active
    if approver is not None:
        values["approver"] = approver
    if password is not None:
        values["password_hash"] = hash_password(password)
    if values:
        tx.conn.execute(update(users).where(users.c.id == user.id).values(**values))
        audit.note(tx, "user.changed", user.username, _what_changed(user, values))
    ended = [sessions] if password is not None or active is False else []
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


def check_lasting(tx: Tx, what: str) -> None:
    """Raise ForbiddenError for a token that ends: it must not let anybody in for longer than itself."""
    if tx.actor.expires_at is not None:
        raise ForbiddenError(
            f"a token that ends on {wire(tx.actor.expires_at)} cannot {what}, which would last longer; log "
            "in in a browser for that"
        )


def _what_changed(user: User, values: Mapping[str, object]) -> str:
    """``role viewer → editor``; never a password."""
    before: dict[str, object] = {
        "role": user.role.value,
        "display_name": user.display_name,
        "active": user.active,
        "approver": user.approver,
    }
    told = [
        f"{name.replace('_', ' ')} {old} → {values[name]}"
        for name, old in before.items()
        if values.get(name, old) != old
    ]
    return ", ".join([*told, *(["password"] if "password_hash" in values else [])]) or "nothing"


def make_admin(tx: Tx, username: str) -> User:
    """The user as an active admin; made where there is none."""
    tx.lock(ADMIN_LOCK)
    if row_of(tx, username) is None:
        return create_user(tx, username, Role.ADMIN)
    return change_user(tx, username, role=Role.ADMIN, active=True)


def password_fits(claimed: Any, password: str) -> bool:
    """True where the password is that of an active user; takes as long for an unknown name.

    claimed
        the row of :func:`row_of` for the name that somebody gave.

    Not to be called inside a transaction: a hash takes long, and 64 MiB. BusyError where too many wait.
    """
    stored = claimed.password_hash if claimed is not None else None
    checked = stored or _decoy()  # before a place is taken: the decoy takes one of its own
    with _HASHING.enter():
        try:
            _hasher().verify(checked, password[:MAX_PASSWORD])
        except (VerificationError, InvalidHashError):
            return False
    return bool(stored and claimed.active)


def hash_password(password: str) -> str:
    """An argon2id hash; RejectedError for a password that is too short or absurdly long."""
    if not MIN_PASSWORD <= len(password) <= MAX_PASSWORD:
        raise RejectedError(
            f"password: wanted {MIN_PASSWORD} to {MAX_PASSWORD} characters, got {len(password)}"
        )
    with _HASHING.enter():
        return _hasher().hash(password)


def _active_admins(tx: Tx) -> int:
    query = select(func.count()).select_from(users)
    return tx.conn.scalar(query.where(users.c.role == Role.ADMIN.value, users.c.active)) or 0
