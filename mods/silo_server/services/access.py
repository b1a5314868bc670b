# SPDX-License-Identifier: LGPL-2.1-or-later
"""Users, their passwords, tokens and sessions, and the list of who did what.

The audit list is append-only, and never has a secret in it. Passwords are kept as argon2id. API tokens
(``silo_…``) are shown once and stored as SHA-256; they have a name, an end, a last use, and can be revoked.
Browser sessions begin with a password or with a link that is used once; each has a CSRF secret.
"""

from __future__ import annotations

import hashlib
import hmac
import math
import re
import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from functools import cache
from typing import Any

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError
from sqlalchemy import ColumnElement, delete, func, insert, select, update

from silo.bom.errors import (
    AuthError,
    ConfigError,
    ConflictError,
    ForbiddenError,
    NotFoundError,
    RejectedError,
)
from silo_server.actors import Actor, Role, Scope
from silo_server.db.database import Database
from silo_server.db.rows import newest_first, update_rows
from silo_server.db.tables import api_tokens, audit, login_attempts, login_links, sessions, users
from silo_server.db.transaction import ADMIN_LOCK, LOGIN_LOCK, Tx
from silo_server.db.turnstile import Turnstile
from silo_server.errors import DuplicateError, TooManyAttemptsError
from silo_server.fields import from_row
from silo_server.times import stamp, wire_time


@dataclass(frozen=True, slots=True)
class AuditEntry:
    """One line of the audit list."""

    id: int
    at: str
    username: str
    action: str
    target: str
    detail: str
    address: str


def note(tx: Tx, action: str, target: str = "", detail: str = "") -> None:
    """Write a line of the audit list, in the same transaction as what it records."""
    tx.conn.execute(
        insert(audit).values(
            at=tx.stamp,
            username=tx.actor.username,
            action=action,
            target=target,
            detail=detail,
            address=tx.actor.address[:64],
        )
    )


def list_entries(
    tx: Tx, limit: int = 100, before: int | None = None, after: int | None = None
) -> list[AuditEntry]:
    """Read the audit list, newest first; ``before`` and ``after`` are ids to page from."""
    rows = newest_first(tx, select(audit), audit.c.id, limit, before, after)
    return [from_row(AuditEntry, row) for row in rows]


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
    # Verified if there is no such user, so that the time of the answer gives nothing away.
    with _HASHING.enter():
        return _hasher().hash("a password that nobody has")


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
        raise NotFoundError(f"there is no user {username!r}")
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
        check_lasting(tx, "give a higher role")
    if active and not user.active:
        check_lasting(tx, "let a user in again")
    if approver and not user.approver:
        check_lasting(tx, "give the right to approve")
    if password is not None:
        check_lasting(tx, "set a password")
    loses = (role is not None and role is not Role.ADMIN) or active is False
    admins = select(func.count()).where(users.c.role == Role.ADMIN.value, users.c.active)
    if loses and user.role is Role.ADMIN and user.active and tx.conn.execute(admins).scalar_one() <= 1:
        raise ConflictError(f"{user.username} is the last admin; make another user an admin first")
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
    """Raise ForbiddenError for an expiring token: it must not grant access that outlives it."""
    if tx.actor.expires_at is not None:
        raise ForbiddenError(
            f"a token that ends on {wire_time(tx.actor.expires_at)} cannot {what}, which would last longer; "
            "log in in a browser for that"
        )


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


def password_fits(claimed: Any, password: str) -> bool:
    """Check if the password is that of an active user; takes as long for an unknown name.

    claimed
        the row of :func:`row_of` for the name that somebody gave.

    Do not call it inside a transaction: a hash takes long, and 64 MiB. BusyError if too many wait.
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
    """Hash a password with argon2id; RejectedError if it is too short or absurdly long."""
    if not MIN_PASSWORD <= len(password) <= MAX_PASSWORD:
        raise RejectedError(
            f"password: wanted {MIN_PASSWORD} to {MAX_PASSWORD} characters, got {len(password)}"
        )
    with _HASHING.enter():
        return _hasher().hash(password)


PREFIX = "silo_"
# Names of tokens that the server makes by itself: from its environment, and if that has none.
CONFIGURED, START_TOKEN = "SILO_API_TOKEN", "given out at start"
SHORTEST_SECRET = 20
_PLACEHOLDER = re.compile(
    "change.?me|change.?this|example|placeholder|your.?(own|token|secret)", re.IGNORECASE
)
# Writing down the last use of a token on every request would make every read a write.
LAST_USE_SECONDS = 60
# A form that is sent twice comes twice within this time.
REPEAT_SECONDS = 60
# A program that was let in by its user asks again after so many days.
PROGRAM_DAYS = 90


@dataclass(frozen=True, slots=True)
class Token:
    """An API token as it may be shown: never its secret."""

    id: int
    username: str
    name: str
    prefix: str
    scope: Scope
    created_at: str
    expires_at: str | None
    last_used_at: str | None
    revoked_at: str | None


def secret_hash(secret: str) -> str:
    """Hash a secret, to be stored. Secrets are long and random, so that a plain SHA-256 is enough."""
    return hashlib.sha256(secret.encode("utf-8", "surrogatepass")).hexdigest()


def secret_of_form(actor: Actor, *sent: str) -> str | None:
    """Derive the secret of the token that a form asks for; the same form gives the same secret again.

    sent
        what the form holds, with a key that is new each time the form is shown. None for a caller without
        a session.
    """
    if actor.csrf_token is None:
        return None
    digest = hmac.new(actor.csrf_token.encode(), repr(sent).encode("utf-8", "surrogatepass"), "sha256")
    return PREFIX + digest.hexdigest()[:40]


def create_own_token(
    tx: Tx,
    name: str,
    *,
    days: float | None,
    forever: bool,
    scope: Scope | None = None,
    secret: str | None = None,
    hashed: str = "",
) -> tuple[Token, str]:
    """Make a token for the caller. A token cannot make one that lives longer or may do more than itself.

    days, forever
        its lifetime [days]; with neither it lives as long as the token that makes it.
    secret
        of :func:`secret_of_form`, whose token may have been made a moment ago.
    hashed
        of a secret that only a program knows; the secret that is returned is then empty.
    Raises ForbiddenError; ConflictError if the form was sent long ago.
    """
    actor = tx.actor
    check_may_change(actor)
    if name in (CONFIGURED, START_TOKEN):
        raise RejectedError(f"name: {name} is what the server calls its own token; choose another name")
    if scope is not None and not actor.scope.covers(scope):
        raise ForbiddenError(f"a token with the scope {actor.scope} cannot make one with the scope {scope}")
    expires = stamp(tx.at + timedelta(days=days)) if days is not None else None
    if actor.expires_at is not None:
        if forever or (expires is not None and expires > actor.expires_at):
            raise ForbiddenError(
                f"a token that ends on {wire_time(actor.expires_at)} cannot make one that lives longer; "
                "log in in a browser for that"
            )
        expires = expires or actor.expires_at
    if secret is not None and (token := _made_before(tx, actor.own_id, secret)) is not None:
        return token, secret
    return create_token(
        tx, actor.own_id, name, expires=expires, scope=scope or actor.scope, secret=secret, hashed=hashed
    )


def let_program_in(tx: Tx, name: str, hashed: str) -> None:
    """Make a token for a program that sent the SHA-256 of its own secret; only one for each secret."""
    tx.lock(hashed)
    if tx.conn.scalar(select(api_tokens.c.id).where(api_tokens.c.token_hash == hashed)) is None:
        create_own_token(tx, name, days=PROGRAM_DAYS, forever=False, scope=Scope.WRITE, hashed=hashed)


def _made_before(tx: Tx, user_id: int, secret: str) -> Token | None:
    # A repeat that comes while the first request is under way waits for it.
    hashed = secret_hash(secret)
    tx.lock(hashed)
    token_id = tx.conn.scalar(select(api_tokens.c.id).where(api_tokens.c.token_hash == hashed))
    if token_id is None:
        return None
    token = next(other for other in list_tokens(tx, user_id) if other.id == token_id)
    if token.revoked_at or token.created_at < stamp(tx.at - timedelta(seconds=REPEAT_SECONDS)):
        raise ConflictError(f"this form made the token {token.name} before; its secret was shown once")
    return token


def check_may_change(actor: Actor) -> None:
    """Raise ForbiddenError for a token that may only read."""
    if actor.by_token and actor.scope is Scope.READ:
        raise ForbiddenError("this token may only read; use one with the scope write")


def create_token(
    tx: Tx,
    user_id: int,
    name: str,
    *,
    expires: str | None = None,
    secret: str | None = None,
    scope: Scope = Scope.ADMIN,
    hashed: str = "",
) -> tuple[Token, str]:
    """Make a token for a user; return it with its secret, which is never shown again."""
    secret = "" if hashed else secret or PREFIX + secrets.token_hex(20)
    token_id = tx.conn.execute(
        insert(api_tokens)
        .values(
            user_id=user_id,
            name=name,
            token_hash=hashed or secret_hash(secret),
            prefix=shown_prefix(secret) or PREFIX,
            scope=scope.value,
            created_at=tx.stamp,
            expires_at=expires,
        )
        .returning(api_tokens.c.id)
    ).scalar_one()
    note(tx, "token.created", name)
    return next(t for t in list_tokens(tx, user_id) if t.id == token_id), secret


def shown_prefix(secret: str) -> str:
    """Return the part of a secret that may be shown; less of a secret chosen by a person."""
    return secret[: min(9, len(secret) // 4)]


def take_configured_token(tx: Tx, user_id: int, secret: str) -> str:
    """Make the secret of the server's environment a token of the user, and revoke its predecessors.

    Returns why it lets nobody in, or "" if it works. A token that was revoked stays revoked.
    """
    query = select(api_tokens, users.c.active).join(users, users.c.id == api_tokens.c.user_id)
    row = tx.conn.execute(query.where(api_tokens.c.token_hash == secret_hash(secret))).one_or_none()
    if row is None:
        create_token(tx, user_id, CONFIGURED, secret=secret)
    elif row.revoked_at is not None:
        return f"it was revoked on {wire_time(row.revoked_at)}"
    elif not row.active or (row.expires_at is not None and row.expires_at <= tx.stamp):
        return "its user is not active" if not row.active else f"it ended on {wire_time(row.expires_at)}"
    others = (api_tokens.c.name == CONFIGURED) & (api_tokens.c.token_hash != secret_hash(secret))
    gone = update(api_tokens).where(others, api_tokens.c.revoked_at.is_(None)).values(revoked_at=tx.stamp)
    if tx.conn.execute(gone).rowcount:
        note(tx, "token.revoked", CONFIGURED, "the environment has another")
    return ""


def check_configured_secret(secret: str) -> None:
    """Raise ConfigError for a secret of the environment that others may guess or have read."""
    if not secret.isascii() or not secret.isprintable() or " " in secret:
        problem = "visible ASCII characters without spaces, got others"
    elif _PLACEHOLDER.search(secret):
        problem = "a secret of your own, got a placeholder that others know"
    elif len(secret) < SHORTEST_SECRET:
        problem = f"at least {SHORTEST_SECRET} characters, got {len(secret)}"
    else:
        return
    raise ConfigError(f"{CONFIGURED}: wanted {problem}. This makes one: echo silo_$(openssl rand -hex 20)")


def list_tokens(tx: Tx, user_id: int | None = None) -> list[Token]:
    """Read the tokens of a user, or of everybody, newest first."""
    query = (
        select(api_tokens, users.c.username)
        .join(users, users.c.id == api_tokens.c.user_id)
        .order_by(api_tokens.c.id.desc())
    )
    if user_id is not None:
        query = query.where(api_tokens.c.user_id == user_id)
    return [from_row(Token, row, scope=Scope(row.scope)) for row in tx.conn.execute(query)]


def revoke_token(tx: Tx, token_id: int, user_id: int | None) -> None:
    """Revoke a token at once: one of the user or, if ``user_id`` is None, anybody's."""
    query = select(api_tokens.c.name).where(api_tokens.c.id == token_id)
    if user_id is not None:
        query = query.where(api_tokens.c.user_id == user_id)
    name = tx.conn.scalar(query)
    if name is None:
        raise NotFoundError(f"there is no token {token_id} of yours")
    tx.conn.execute(
        update(api_tokens)
        .where(api_tokens.c.id == token_id, api_tokens.c.revoked_at.is_(None))
        .values(revoked_at=tx.stamp)
    )
    note(tx, "token.revoked", name)
    tx.end_access()


def actor_by_token(db: Database, secret: str, address: str) -> Actor | None:
    """Find the user of a token; None if it is unknown, expired or revoked, or its user is not active."""
    with db.read() as tx:
        row = tx.conn.execute(
            select(
                api_tokens.c.id,
                api_tokens.c.last_used_at,
                api_tokens.c.scope,
                api_tokens.c.expires_at,
                users.c.id.label("user_id"),
                users.c.username,
                users.c.display_name,
                users.c.role,
            )
            .join(users, users.c.id == api_tokens.c.user_id)
            .where(
                api_tokens.c.token_hash == secret_hash(secret),
                api_tokens.c.revoked_at.is_(None),
                (api_tokens.c.expires_at.is_(None)) | (api_tokens.c.expires_at > tx.stamp),
                users.c.active,
            )
        ).one_or_none()
        stale = stamp(tx.at - timedelta(seconds=LAST_USE_SECONDS))
    if row is None:
        return None
    if row.last_used_at is None or row.last_used_at < stale:
        db.token_uses[row.id] = stamp(db.clock())
    role, scope = Role(row.role), Scope(row.scope)
    return Actor(
        row.username,
        role if scope.role.covers(role) else scope.role,
        row.user_id,
        row.display_name,
        "token",
        address,
        scope=scope,
        expires_at=row.expires_at,
    )


def note_token_uses(db: Database) -> None:
    """Write down when tokens were used last; what cannot be written now is kept for the next time.

    No request waits for this, or fails with it: reading must work while nothing can be written.
    """
    used = dict(db.token_uses)
    if not used:
        return
    with db.write(even_when_read_only=True) as tx:
        rows = [{"id": token_id, "last_used_at": when} for token_id, when in sorted(used.items())]
        update_rows(tx, api_tokens, "id", rows)
    for token_id, when in used.items():
        if db.token_uses.get(token_id) == when:
            del db.token_uses[token_id]


WRONG = "user name or password is wrong"


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
        return _begin(tx, user.id, user.username)


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
            raise RejectedError("current password: wanted your present password, got another one") from None
    with db.write(actor, even_when_read_only=True) as tx:
        change_user(tx, actor.username, password=new)


def _proved(db: Database, username: str, password: str, address: str) -> User:
    """Check name and password; return the user. Raises AuthError, TooManyAttemptsError."""
    actor = Actor(username[:64], Role.VIEWER, address=address)
    # Reserved before the password is checked, so that attempts at the same time are counted as well.
    with db.write(actor, even_when_read_only=True) as tx:
        tx.lock(LOGIN_LOCK)
        _check_rate(tx, username, address)
        attempt = _reserve(tx, username, address)
        claimed = row_of(tx, username)
    outcome = None  # if the password cannot be checked: the server may be too busy
    try:
        outcome = PROVED if password_fits(claimed, password) else FAILED
    finally:
        with db.write(actor, even_when_read_only=True) as tx:
            _settle(tx, attempt, outcome)
            if outcome == FAILED:
                note(tx, "login.failed", username[:64])
    if outcome == FAILED:
        raise AuthError(WRONG)
    return to_user(claimed)


def create_login_link(tx: Tx, username: str) -> str:
    """Make a secret that lets this user in once, for a while, to set a password without the old one.

    ForbiddenError for the caller's own account: its session or token alone must not be enough to set a
    password.
    """
    user = get_user(tx, username)
    check_lasting(tx, "make a login link")
    if tx.actor.user_id == user.id:
        raise ForbiddenError(
            "you cannot make a login link for your own account; set the password on the account page, or ask "
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
    """Begin a session by a login link; AuthError if the link is unknown, used or too old."""
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
                note(tx, "login.link", user.username)
                return _begin(tx, user.id, user.username, by_link=True)
    raise AuthError("this login link was used already or is too old; start the server again for a new one")


def actor_by_session(db: Database, secret: str, address: str) -> Actor | None:
    """Find the user of a session cookie; None if it is unknown or over."""
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
        note(tx, "logout")


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
    """Raise TooManyAttemptsError if the next try has to wait, longer after each failure.

    One name from one address waits soon. All names from one address, and one name from all addresses, wait
    only if this name has never logged in from this address: so a stranger keeps nobody out.
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
    """Write down the outcome of an attempt. A right password deletes the failed attempts before it."""
    own = tx.conn.execute(select(login_attempts).where(login_attempts.c.id == attempt)).one_or_none()
    if own is None:
        return  # housekeeping deleted it, after a very long wait
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
