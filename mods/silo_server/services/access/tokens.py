# SPDX-License-Identifier: LGPL-2.1-or-later
"""API tokens: making, finding and revoking them, and what a token may not do.

A token (``silo_…``) is shown once and stored as SHA-256; it has a name, an end, a scope and a last use. It
makes none that may do more, or lives longer, than itself.
"""

from __future__ import annotations

import hashlib
import hmac
import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import timedelta
from enum import StrEnum
from typing import Any

from sqlalchemy import insert, select, update

from silo.bom.errors import ConflictError, ForbiddenError, NotFoundError, RejectedError, listed
from silo.bom.message import message
from silo_server.actors import Actor, Role, Scope
from silo_server.db.database import Database
from silo_server.db.rows import update_rows
from silo_server.db.tables import api_tokens, credentials, users
from silo_server.db.transaction import Tx
from silo_server.fields import from_row
from silo_server.services.access.credentials import Credential, Kind, below, end_below, new_credential
from silo_server.services.audit import note
from silo_server.times import stamp, wire_time


def check_lasting(tx: Tx, what: str) -> None:
    """Raise ForbiddenError for an expiring token: it must not grant access that outlives it."""
    if tx.actor.expires_at is not None:
        raise ForbiddenError(
            message(
                "a token that ends on {expires_at} cannot {what}, which would last longer; log in in a "
                "browser for that",
                expires_at=wire_time(tx.actor.expires_at),
                what=what,
            )
        )


PREFIX = "silo_"

# Names of tokens that the server makes by itself: from its environment, and if that has none.
CONFIGURED, START_TOKEN = "SILO_API_TOKEN", "given out at start"

# Writing down the last use of a token on every request would make every read a write.
LAST_USE_SECONDS = 60

# A form that is sent twice comes twice within this time.
REPEAT_SECONDS = 60


@dataclass(frozen=True, slots=True)
class Parent:
    """The credential that made a token; ``known`` is false if an older version made the token."""

    credential_id: int | None
    kind: str
    name: str
    known: bool


@dataclass(frozen=True, slots=True)
class Token:
    """An API token as it may be shown: never its secret.

    parent
        None if the server itself made it.
    """

    id: int
    username: str
    name: str
    prefix: str
    scope: Scope
    created_at: str
    expires_at: str | None
    last_used_at: str | None
    revoked_at: str | None
    credential_id: int
    parent: Parent | None


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
) -> tuple[Token, str]:
    """Make a token for the caller. A token cannot make one that lives longer or may do more than itself.

    days, forever
        its lifetime [days]; with neither it lives as long as the token that makes it.
    secret
        of :func:`secret_of_form`, whose token may have been made a moment ago.
    Raises ForbiddenError; ConflictError if the form was sent long ago.
    """
    actor = tx.actor
    check_may_change(actor)
    if name in (CONFIGURED, START_TOKEN):
        raise RejectedError(
            message("name: {name} is what the server calls its own token; choose another name", name=name)
        )
    if scope is not None and not actor.scope.covers(scope):
        raise ForbiddenError(
            message(
                "a token with the scope {scope} cannot make one with the scope {wanted}",
                scope=actor.scope,
                wanted=scope,
            )
        )
    expires = stamp(tx.at + timedelta(days=days)) if days is not None else None
    if actor.expires_at is not None:
        if forever or (expires is not None and expires > actor.expires_at):
            raise ForbiddenError(
                message(
                    "a token that ends on {expires_at} cannot make one that lives longer; log in in a "
                    "browser for that",
                    expires_at=wire_time(actor.expires_at),
                )
            )
        expires = expires or actor.expires_at
    if secret is not None and (token := _made_before(tx, actor.own_id, secret)) is not None:
        return token, secret
    return create_token(tx, actor.own_id, name, expires=expires, scope=scope or actor.scope, secret=secret)


def _made_before(tx: Tx, user_id: int, secret: str) -> Token | None:
    # A repeat that comes while the first request is under way waits for it.
    hashed = secret_hash(secret)
    tx.lock(hashed)
    token_id = tx.conn.scalar(select(api_tokens.c.id).where(api_tokens.c.token_hash == hashed))
    if token_id is None:
        return None
    token = next(other for other in list_tokens(tx, user_id) if other.id == token_id)
    if token.revoked_at or token.created_at < stamp(tx.at - timedelta(seconds=REPEAT_SECONDS)):
        raise ConflictError(
            message("this form made the token {name} before; its secret was shown once", name=token.name)
        )
    return token


def check_may_change(actor: Actor) -> None:
    """Raise ForbiddenError for a token that may only read."""
    if actor.by_token and actor.scope is Scope.READ:
        raise ForbiddenError(message("this token may only read; use one with the scope write"))


def create_token(
    tx: Tx,
    user_id: int,
    name: str,
    *,
    expires: str | None = None,
    secret: str | None = None,
    scope: Scope = Scope.ADMIN,
) -> tuple[Token, str]:
    """Make a token for a user; return it with its secret, which is never shown again."""
    secret = secret or PREFIX + secrets.token_hex(20)
    credential = new_credential(tx, Kind.TOKEN, user_id, name, tx.actor.credential_id)
    token_id = add_token(tx, user_id, name, secret, credential=credential, scope=scope, expires=expires)
    return next(t for t in list_tokens(tx, user_id) if t.id == token_id), secret


def add_token(
    tx: Tx, user_id: int, name: str, secret: str, *, credential: int, scope: Scope, expires: str | None
) -> int:
    """Store a token under a credential that there is; return its id."""
    token_id: int = tx.conn.execute(
        insert(api_tokens)
        .values(
            user_id=user_id,
            name=name,
            token_hash=secret_hash(secret),
            prefix=shown_prefix(secret) or PREFIX,
            scope=scope.value,
            created_at=tx.stamp,
            expires_at=expires,
            credential_id=credential,
        )
        .returning(api_tokens.c.id)
    ).scalar_one()
    note(tx, "token.created", name)
    return token_id


def shown_prefix(secret: str) -> str:
    """Return the part of a secret that may be shown; less of a secret chosen by a user."""
    return secret[: min(9, len(secret) // 4)]


def list_tokens(tx: Tx, user_id: int | None = None) -> list[Token]:
    """Read the tokens of a user, or of everybody, newest first."""
    above = credentials.alias()
    query = (
        select(
            api_tokens,
            users.c.username,
            credentials.c.known,
            above.c.id.label("parent_id"),
            above.c.kind.label("parent_kind"),
            above.c.name.label("parent_name"),
        )
        .join(users, users.c.id == api_tokens.c.user_id)
        .join(credentials, credentials.c.id == api_tokens.c.credential_id)
        .outerjoin(above, above.c.id == credentials.c.parent_id)
        .order_by(api_tokens.c.id.desc())
    )
    if user_id is not None:
        query = query.where(api_tokens.c.user_id == user_id)
    return [
        from_row(Token, row, scope=Scope(row.scope), parent=_parent(row)) for row in tx.conn.execute(query)
    ]


def _parent(row: Any) -> Parent | None:
    if not row.known:
        return Parent(None, "", "", known=False)
    if row.parent_id is None:
        return None
    return Parent(row.parent_id, row.parent_kind, row.parent_name, known=True)


class ChildrenError(ConflictError):
    """A token has credentials below it that live on; who revokes it says what becomes of them."""

    def __init__(self, name: str, living: Sequence[Credential]) -> None:
        names = listed([f"{each.kind} {each.name or each.username}" for each in living], 8)
        super().__init__(
            message(
                "token {name}: below it live {names}; say if they end as well (children=end, as after a "
                "leak) or stay (children=keep)",
                name=name,
                names=names,
            )
        )
        self.living = tuple(living)


class Children(StrEnum):
    """What becomes of the credentials below a token that is revoked."""

    KEEP = "keep"
    END = "end"


def revoke_token(tx: Tx, token_id: int, user_id: int | None, children: Children | None = None) -> None:
    """Revoke a token at once: one of the user or, if ``user_id`` is None, anybody's.

    Raises ChildrenError if credentials below it live on and ``children`` does not say what becomes of them.
    """
    query = select(api_tokens.c.name, api_tokens.c.credential_id).where(api_tokens.c.id == token_id)
    if user_id is not None:
        query = query.where(api_tokens.c.user_id == user_id)
    row = tx.conn.execute(query).one_or_none()
    if row is None:
        raise NotFoundError(message("there is no token {token_id} of yours", token_id=token_id))
    name = row.name
    if children is None and (living := below(tx, [row.credential_id])):
        raise ChildrenError(name, living)
    if children is Children.END and (ended := end_below(tx, [row.credential_id])):
        note(tx, "token.children_ended", name, str(ended))
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
                api_tokens.c.credential_id,
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
        credential_id=row.credential_id,
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
