# SPDX-License-Identifier: LGPL-2.1-or-later
"""Browser sessions: login with a password or a one-time link, rate-limited; each has a CSRF secret."""

from __future__ import annotations

import math
import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy import ColumnElement, delete, func, insert, select, update

from silo.bom.errors import AuthError, ForbiddenError, RejectedError
from silo_server.db.engine import LOGIN_LOCK, Database, Tx
from silo_server.db.tables import login_attempts, login_links, sessions, users
from silo_server.services.access import accounts, audit
from silo_server.services.access.credentials import secret_hash
from silo_server.settings import TooManyAttemptsError, stamp
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
    # Reserved before the password is looked at: what comes at the same time is counted as well.
    with db.write(actor, even_when_read_only=True) as tx:
        tx.lock(LOGIN_LOCK)
        _check_rate(tx, username, address)
        attempt = _reserve(tx, username, address)
        claimed = accounts.row_of(tx, username)
    outcome = None  # as long as the password was not looked at, for which the server may be too busy
    try:
        outcome = PROVED if accounts.password_fits(claimed, password) else FAILED
    finally:
        with db.write(actor, even_when_read_only=True) as tx:
            _settle(tx, attempt, outcome)
            if outcome == FAILED:
                audit.note(tx, "login.failed", username[:64])
    if outcome == FAILED:
        raise AuthError(WRONG)
    return accounts.to_user(claimed)


def create_login_link(tx: Tx, username: str) -> str:
    """A secret that lets this user in once, for a while, to set a password without the old one.

    So nobody makes a link for the own account: who holds its session or token is not asked for the password.
    """
    user = accounts.get_user(tx, username)
    accounts.check_lasting(tx, "make a login link")
    if tx.actor.user_id == user.id:
        raise ForbiddenError(
            "nobody makes a login link for the own account; set the password on the account page, or ask "
            "another admin"
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


# What an attempt to log in came to. PROVED is remembered for months, as a place that a name logs in from.
PENDING, FAILED, PROVED = "pending", "failed", "proved"


def _check_rate(tx: Tx, username: str, address: str) -> None:
    """Raise TooManyAttemptsError where the next try has to wait, longer after each failure.

    One name from one address waits soon. All names from one address, and one name from all addresses, wait
    only where this name has never logged in from this address: so a stranger keeps nobody out.
    """
    window, allowed = tx.settings.login_window_seconds, tx.settings.login_failures
    name = login_attempts.c.username_key == username.casefold()[:64]
    place = login_attempts.c.address == address[:64]
    _check_limit(tx, name & place, (PENDING, FAILED), allowed, window)
    proved = select(login_attempts.c.id).where(name, place, login_attempts.c.outcome == PROVED).limit(1)
    if tx.conn.scalar(proved) is None:
        # Those under way are not counted here: many people behind one address may come at once.
        _check_limit(tx, place, (FAILED,), allowed * 4, window)
        _check_limit(tx, name, (FAILED,), allowed * 20, window)


def _check_limit(
    tx: Tx, which: ColumnElement[bool], outcomes: Sequence[str], allowed: int, window: float
) -> None:
    since = stamp(tx.at - timedelta(seconds=window))
    counted = (which, login_attempts.c.outcome.in_(outcomes), login_attempts.c.at > since)
    count, newest = tx.conn.execute(select(func.count(), func.max(login_attempts.c.at)).where(*counted)).one()
    if count < allowed:
        return
    delay = min(window, 8.0 ** min(1 + count - allowed, 9))
    wait = math.ceil(delay - (tx.at - datetime.fromisoformat(newest)).total_seconds())
    if wait > 0:
        raise TooManyAttemptsError(f"too many failed logins; try again in {wait} seconds", wait)


def _reserve(tx: Tx, username: str, address: str) -> int:
    reserved = {"username_key": username.casefold()[:64], "address": address[:64], "outcome": PENDING}
    attempt: int = tx.conn.execute(
        insert(login_attempts).values(**reserved, at=tx.stamp).returning(login_attempts.c.id)
    ).scalar_one()
    return attempt


def _settle(tx: Tx, attempt: int, outcome: str | None) -> None:
    """Write down what an attempt came to. One that proved the password gives its failures back."""
    own = tx.conn.execute(select(login_attempts).where(login_attempts.c.id == attempt)).one_or_none()
    if own is None:
        return  # housekeeping, after a wait without end
    same = (login_attempts.c.username_key == own.username_key) & (login_attempts.c.address == own.address)
    if outcome is None:
        tx.conn.execute(delete(login_attempts).where(login_attempts.c.id == attempt))
        return
    if outcome == PROVED:
        gone = (login_attempts.c.id != attempt) & (login_attempts.c.outcome != PENDING)
        tx.conn.execute(delete(login_attempts).where(same, gone))
    tx.conn.execute(
        update(login_attempts).where(login_attempts.c.id == attempt).values(outcome=outcome, at=tx.stamp)
    )
