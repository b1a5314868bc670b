# SPDX-License-Identifier: LGPL-2.1-or-later
"""Browser sessions: login with a password or a one-time link, rate-limited; each has a CSRF secret."""

from __future__ import annotations

import math
import secrets
from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy import delete, func, insert, select

from silo.bom.errors import AuthError, ForbiddenError, RejectedError
from silo_server.clock import stamp
from silo_server.db.engine import LOGIN_LOCK, Database, Tx
from silo_server.db.tables import login_failures, login_links, sessions, users
from silo_server.errors import TooManyAttemptsError
from silo_server.services.access import accounts, audit
from silo_server.services.access.credentials import secret_hash
from silo_server.values import Actor, Role

WRONG = "user name or password is wrong"


@dataclass(frozen=True, slots=True)
class NewSession:
    """A session just begun: the cookie's secret, the CSRF secret and whose it is."""

    secret: str
    csrf_token: str
    username: str
    expires_at: str


def log_in(db: Database, username: str, password: str, address: str) -> NewSession:
    """Begin a session; AuthError where name or password is wrong, TooManyAttemptsError after too many."""
    user = _proved(db, username, password, address)
    with db.write(Actor(username[:64], Role.VIEWER, address=address), even_when_read_only=True) as tx:
        audit.note(tx, "login")
        return _begin(tx, user.id, user.username)


def set_own_password(db: Database, actor: Actor, new: str, current: str | None) -> None:
    """Set the caller's password, which ends all sessions of theirs.

    Asks for the old one, but for a session that a login link began, which is there for a forgotten password.
    Raises ForbiddenError for a token, RejectedError, TooManyAttemptsError.
    """
    if actor.by_token:
        raise ForbiddenError(accounts.NO_TOKEN)
    if not actor.by_link:
        try:
            _proved(db, actor.username, current or "", actor.address)
        except AuthError:
            raise RejectedError("current password: wanted the one you have now, got another") from None
    with db.write(actor, even_when_read_only=True) as tx:
        accounts.change_user(tx, actor.username, password=new)


def _proved(db: Database, username: str, password: str, address: str) -> accounts.User:
    """The user whose password this is; AuthError, TooManyAttemptsError."""
    actor = Actor(username[:64], Role.VIEWER, address=address)
    # An attempt counts as failed from the moment it is made: what comes at the same time is counted as well.
    with db.write(actor, even_when_read_only=True) as tx:
        tx.lock(LOGIN_LOCK)
        _check_rate(tx, username, address)
        attempt = _note_attempt(tx, username, address)
        claimed = accounts.row_of(tx, username)
    if not accounts.password_fits(claimed, password):
        with db.write(actor, even_when_read_only=True) as tx:
            audit.note(tx, "login.failed", username[:64])
        raise AuthError(WRONG)
    with db.write(actor, even_when_read_only=True) as tx:
        tx.conn.execute(delete(login_failures).where(login_failures.c.id == attempt))
    return accounts.to_user(claimed)


def create_login_link(tx: Tx, username: str) -> str:
    """A secret that lets this user in once, for a while; for the first start, where nobody has a password."""
    user = accounts.get_user(tx, username)
    if tx.actor.expires_at is not None and tx.actor.user_id == user.id:
        raise ForbiddenError(
            "a token that ends cannot make a login link for its own account; log in for that"
        )
    secret = secrets.token_urlsafe(32)
    expires = stamp(tx.at + timedelta(seconds=tx.settings.login_link_seconds))
    tx.conn.execute(delete(login_links).where(login_links.c.expires_at <= tx.stamp))
    tx.conn.execute(
        insert(login_links).values(token_hash=secret_hash(secret), user_id=user.id, expires_at=expires)
    )
    return secret


def use_login_link(db: Database, secret: str, address: str) -> NewSession:
    """Begin a session by a link; AuthError where it is unknown, used or too old."""
    with db.write(Actor("link", Role.VIEWER, address=address), even_when_read_only=True) as tx:
        row = tx.conn.execute(
            delete(login_links)
            .where(login_links.c.token_hash == secret_hash(secret))
            .returning(login_links.c.user_id, login_links.c.expires_at)
        ).one_or_none()
        if row is not None and row.expires_at > tx.stamp:
            user = tx.conn.execute(
                select(users).where(users.c.id == row.user_id, users.c.active)
            ).one_or_none()
            if user is not None:
                audit.note(tx, "login.link", user.username)
                return _begin(tx, user.id, user.username, by_link=True)
    raise AuthError("this login link was used already or is too old; start the server again for a new one")


def actor_by_session(db: Database, secret: str, address: str) -> Actor | None:
    """Who this session cookie is; None where it is unknown or over."""
    with db.read() as tx:
        row = tx.conn.execute(
            select(
                sessions.c.id_hash,
                sessions.c.csrf_token,
                sessions.c.by_link,
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
    )


def log_out(db: Database, actor: Actor) -> None:
    """End the session; nothing to do for a token."""
    if actor.session_hash is None:
        return
    with db.write(actor, even_when_read_only=True) as tx:
        tx.conn.execute(delete(sessions).where(sessions.c.id_hash == actor.session_hash))
        audit.note(tx, "logout")


def _begin(tx: Tx, user_id: int, username: str, *, by_link: bool = False) -> NewSession:
    secret, csrf = secrets.token_urlsafe(32), secrets.token_urlsafe(32)
    expires = stamp(tx.at + timedelta(seconds=tx.settings.session_seconds))
    tx.conn.execute(delete(sessions).where(sessions.c.expires_at <= tx.stamp))
    tx.conn.execute(
        insert(sessions).values(
            id_hash=secret_hash(secret),
            user_id=user_id,
            csrf_token=csrf,
            by_link=by_link,
            created_at=tx.stamp,
            expires_at=expires,
        )
    )
    return NewSession(secret, csrf, username, expires)


def _check_rate(tx: Tx, username: str, address: str) -> None:
    window = tx.settings.login_window_seconds
    since = stamp(tx.at - timedelta(seconds=window))
    name, allowed = username.casefold()[:64], tx.settings.login_failures
    by_name, by_address = login_failures.c.username_key == name, login_failures.c.address == address[:64]
    # One name from one address is held back soon; one address with many names later; one name from many
    # addresses last, because that lets a stranger keep somebody out.
    limits = ((by_name & by_address, allowed), (by_address, allowed * 4), (by_name, allowed * 20))
    for condition, limit in limits:
        count, oldest = tx.conn.execute(
            select(func.count(), func.min(login_failures.c.at)).where(condition, login_failures.c.at > since)
        ).one()
        if count >= limit:
            passed = (tx.at - datetime.fromisoformat(oldest)).total_seconds()
            wait = max(1, math.ceil(window - passed))
            raise TooManyAttemptsError(f"too many failed logins; try again in {wait} seconds", wait)


def _note_attempt(tx: Tx, username: str, address: str) -> int:
    old = stamp(tx.at - timedelta(seconds=tx.settings.login_window_seconds))
    tx.conn.execute(delete(login_failures).where(login_failures.c.at <= old))
    attempt: int = tx.conn.execute(
        insert(login_failures)
        .values(username_key=username.casefold()[:64], address=address[:64], at=tx.stamp)
        .returning(login_failures.c.id)
    ).scalar_one()
    return attempt
