# SPDX-License-Identifier: LGPL-2.1-or-later
"""Credentials as a tree: each token, session and login link knows the credential that made it.

* A credential outlives an ordinary end of its parent: a session that was logged out has its tokens still.
* A leak ends all below: tokens are revoked, sessions end, login links are gone.
* A credential of an older version has no parent, and is known as such.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from enum import StrEnum

from sqlalchemy import delete, insert, select, update

from silo_server.db.tables import api_tokens, credentials, device_logins, login_links, sessions, users
from silo_server.db.transaction import Tx


class Kind(StrEnum):
    """What lets a caller in."""

    TOKEN = "token"
    SESSION = "session"
    LINK = "link"


@dataclass(frozen=True, slots=True)
class Credential:
    """A credential that still lets its user in, as it may be shown.

    depth
        how far below the one that was asked about.
    """

    id: int
    kind: Kind
    username: str
    name: str
    created_at: str
    depth: int


def new_credential(tx: Tx, kind: Kind, user_id: int, name: str, parent: int | None) -> int:
    """Note a new credential below ``parent``; None for one that a password or the server itself made."""
    row = insert(credentials).values(
        parent_id=parent, kind=kind.value, user_id=user_id, name=name, known=True, created_at=tx.stamp
    )
    return int(tx.conn.execute(row.returning(credentials.c.id)).scalar_one())


def below(tx: Tx, roots: Collection[int]) -> list[Credential]:
    """Read the credentials below these that still let their users in, parents first."""
    rows = tx.conn.execute(
        select(credentials.c.id, credentials.c.parent_id).where(credentials.c.parent_id.is_not(None))
    )
    children: dict[int, list[int]] = {}
    for row in rows:
        children.setdefault(row.parent_id, []).append(row.id)
    depths: dict[int, int] = dict.fromkeys(roots, 0)
    order: list[int] = []
    waiting = sorted(roots, reverse=True)
    while waiting:
        each = waiting.pop()
        for child in sorted(children.get(each, ()), reverse=True):
            if child not in depths:
                depths[child] = depths[each] + 1
                waiting.append(child)
        if depths[each]:
            order.append(each)
    alive = _alive(tx)
    query = select(credentials, users.c.username).join(users, users.c.id == credentials.c.user_id)
    found = {row.id: row for row in tx.conn.execute(query)}
    return [
        Credential(
            each,
            Kind(found[each].kind),
            found[each].username,
            found[each].name,
            found[each].created_at,
            depths[each],
        )
        for each in order
        if each in alive
    ]


def _alive(tx: Tx) -> set[int]:
    """Find the credentials that let somebody in now."""
    tokens = select(api_tokens.c.credential_id).where(
        api_tokens.c.revoked_at.is_(None),
        api_tokens.c.expires_at.is_(None) | (api_tokens.c.expires_at > tx.stamp),
    )
    begun = select(sessions.c.credential_id).where(sessions.c.expires_at > tx.stamp)
    links = select(login_links.c.credential_id).where(login_links.c.expires_at > tx.stamp)
    allowed = select(device_logins.c.credential_id).where(
        device_logins.c.credential_id.is_not(None), device_logins.c.expires_at > tx.stamp
    )
    return {each for query in (tokens, begun, links, allowed) for each in tx.conn.scalars(query)}


def end_below(tx: Tx, roots: Collection[int], *, themselves: bool = False) -> int:
    """End all credentials below these, and these as well if asked. Returns how many were ended."""
    ended = [each.id for each in below(tx, roots)] + (list(roots) if themselves else [])
    for each in ended:
        tx.conn.execute(
            update(api_tokens)
            .where(api_tokens.c.credential_id == each, api_tokens.c.revoked_at.is_(None))
            .values(revoked_at=tx.stamp)
        )
        tx.conn.execute(delete(sessions).where(sessions.c.credential_id == each))
        tx.conn.execute(delete(login_links).where(login_links.c.credential_id == each))
        tx.conn.execute(delete(device_logins).where(device_logins.c.credential_id == each))
    if ended:
        tx.end_access()
    return len(ended)


def end_sessions_of(tx: Tx, user_id: int) -> int:
    """End all sessions of a user, and all that was made in any of them. Returns how many were ended.

    A session that is over has left its credential, so that what was made in it is found.
    """
    query = select(credentials.c.id).where(
        credentials.c.user_id == user_id, credentials.c.kind == Kind.SESSION.value
    )
    return end_below(tx, list(tx.conn.scalars(query)), themselves=True)
