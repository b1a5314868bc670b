# SPDX-License-Identifier: LGPL-2.1-or-later
"""Browser sessions: they begin with a password or a login link, and end by logging out.

Each has a CSRF secret. Only hashes of the secrets are stored.
"""

from __future__ import annotations

import secrets
from dataclasses import dataclass
from datetime import timedelta

from sqlalchemy import delete, insert, select

from silo.bom.errors import AuthError, ForbiddenError, RejectedError
from silo.bom.message import message
from silo_server.actors import Actor, Role
from silo_server.db.database import Database
from silo_server.db.tables import sessions, users
from silo_server.db.transaction import LOGIN_LOCK, Tx
from silo_server.services.access.credentials import Kind, end_sessions_of, new_credential
from silo_server.services.access.login_attempts import (
    FAILED,
    PROVED,
    check_rate,
    reserve_attempt,
    settle_attempt,
)
from silo_server.services.access.passwords import password_fits
from silo_server.services.access.tokens import check_may_change, secret_hash
from silo_server.services.access.users import NO_TOKEN, User, change_user, row_of, to_user
from silo_server.services.audit import note
from silo_server.times import stamp

WRONG = message("user name or password is wrong")


@dataclass(frozen=True, slots=True)
class NewSession:
    """A session just begun: the cookie's secret, the CSRF secret and whose it is."""

    secret: str
    csrf_token: str
    username: str
    expires_at: str


def log_in(db: Database, username: str, password: str, address: str) -> NewSession:
    """Begin a session; AuthError if name or password is wrong, TooManyAttemptsError after too many."""
    user = _proved(db, username, password, address)
    with db.write(Actor(username[:64], Role.VIEWER, address=address), even_when_read_only=True) as tx:
        note(tx, "login")
        return begin_session(tx, user.id, user.username)


def set_own_password(db: Database, actor: Actor, new: str, current: str | None) -> None:
    """Set the caller's password and end all sessions of the caller.

    Needs the old one, except in a session that a login link began: that is for a forgotten password.
    Raises ForbiddenError for a token, RejectedError, TooManyAttemptsError.
    """
    if actor.by_token:
        raise ForbiddenError(NO_TOKEN)
    if not actor.by_link:
        try:
            _proved(db, actor.username, current or "", actor.address)
        except AuthError:
            raise RejectedError(
                message("current password: wanted your present password, got another one")
            ) from None
    with db.write(actor, even_when_read_only=True) as tx:
        change_user(tx, actor.username, password=new)


def _proved(db: Database, username: str, password: str, address: str) -> User:
    """Check name and password; return the user. Raises AuthError, TooManyAttemptsError."""
    actor = Actor(username[:64], Role.VIEWER, address=address)
    # Reserved before the password is checked, so that attempts at the same time are counted as well.
    with db.write(actor, even_when_read_only=True) as tx:
        tx.lock(LOGIN_LOCK)
        check_rate(tx, username, address)
        attempt = reserve_attempt(tx, username, address)
        claimed = row_of(tx, username)
    outcome = None  # if the password cannot be checked: the server may be too busy
    try:
        outcome = PROVED if password_fits(claimed, password) else FAILED
    finally:
        with db.write(actor, even_when_read_only=True) as tx:
            settle_attempt(tx, attempt, outcome)
            if outcome == FAILED:
                note(tx, "login.failed", username[:64])
    if outcome == FAILED:
        raise AuthError(WRONG)
    return to_user(claimed)


def actor_by_session(db: Database, secret: str, address: str) -> Actor | None:
    """Find the user of a session cookie; None if it is unknown or over."""
    with db.read() as tx:
        row = tx.conn.execute(
            select(
                sessions.c.id_hash,
                sessions.c.csrf_token,
                sessions.c.by_link,
                sessions.c.credential_id,
                users.c.id,
                users.c.username,
                users.c.display_name,
                users.c.role,
            )
            .join(users, users.c.id == sessions.c.user_id)
            .where(
                sessions.c.id_hash == secret_hash(secret), sessions.c.expires_at > tx.stamp, users.c.active
            )
        ).one_or_none()
    if row is None:
        return None
    return Actor(
        row.username,
        Role(row.role),
        row.id,
        row.display_name,
        "session",
        address,
        row.csrf_token,
        row.id_hash,
        by_link=bool(row.by_link),
        credential_id=row.credential_id,
    )


def log_out(db: Database, actor: Actor) -> None:
    """End the session; nothing to do for a token."""
    if actor.session_hash is None:
        return
    with db.write(actor, even_when_read_only=True) as tx:
        tx.conn.execute(delete(sessions).where(sessions.c.id_hash == actor.session_hash))
        note(tx, "logout")


def log_out_everywhere(db: Database, actor: Actor) -> int:
    """End all sessions of the caller and what was made in them; return how many credentials ended."""
    with db.write(actor, even_when_read_only=True) as tx:
        check_may_change(actor)
        ended = end_sessions_of(tx, actor.own_id)
        note(tx, "logout.everywhere", actor.username, f"{ended} ended")
        return ended


def begin_session(
    tx: Tx, user_id: int, username: str, *, by_link: bool = False, parent: int | None = None
) -> NewSession:
    """Begin a session of a user, below the credential ``parent``; sessions that are over are deleted."""
    secret, csrf = secrets.token_urlsafe(32), secrets.token_urlsafe(32)
    expires = stamp(tx.at + timedelta(seconds=tx.settings.session_seconds))
    tx.conn.execute(delete(sessions).where(sessions.c.expires_at <= tx.stamp))
    credential = new_credential(tx, Kind.SESSION, user_id, tx.actor.address, parent)
    tx.conn.execute(
        insert(sessions).values(
            id_hash=secret_hash(secret),
            user_id=user_id,
            csrf_token=csrf,
            by_link=by_link,
            created_at=tx.stamp,
            expires_at=expires,
            credential_id=credential,
        )
    )
    return NewSession(secret, csrf, username, expires)
