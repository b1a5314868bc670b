# SPDX-License-Identifier: LGPL-2.1-or-later
"""Login links: each lets its user in once, to set a password without the old one."""

from __future__ import annotations

import secrets
from datetime import timedelta

from sqlalchemy import delete, insert, select

from silo.bom.errors import AuthError, ForbiddenError
from silo.bom.message import message
from silo_server.actors import Actor, Role
from silo_server.db.database import Database
from silo_server.db.tables import login_links, users
from silo_server.db.transaction import Tx
from silo_server.services.access.credentials import Kind, new_credential
from silo_server.services.access.sessions import NewSession, begin_session
from silo_server.services.access.tokens import check_lasting, secret_hash
from silo_server.services.access.users import get_user
from silo_server.services.audit import note
from silo_server.times import stamp


def create_login_link(tx: Tx, username: str) -> str:
    """Make a secret that lets this user in once, for a while, to set a password without the old one.

    ForbiddenError for the caller's own account: its session or token alone must not be enough to set a
    password.
    """
    user = get_user(tx, username)
    check_lasting(tx, message("make a login link"))
    if tx.actor.user_id == user.id:
        raise ForbiddenError(
            message(
                "you cannot make a login link for your own account; set the password on the account page, "
                "or ask another admin"
            )
        )
    secret = secrets.token_urlsafe(32)
    expires = stamp(tx.at + timedelta(seconds=tx.settings.login_link_seconds))
    tx.conn.execute(delete(login_links).where(login_links.c.expires_at <= tx.stamp))
    credential = new_credential(tx, Kind.LINK, user.id, "", tx.actor.credential_id)
    tx.conn.execute(
        insert(login_links).values(
            token_hash=secret_hash(secret), user_id=user.id, expires_at=expires, credential_id=credential
        )
    )
    return secret


def use_login_link(db: Database, secret: str, address: str) -> NewSession:
    """Begin a session by a login link; AuthError if the link is unknown, used or too old."""
    with db.write(Actor("link", Role.VIEWER, address=address), even_when_read_only=True) as tx:
        row = tx.conn.execute(
            delete(login_links)
            .where(login_links.c.token_hash == secret_hash(secret))
            .returning(login_links.c.user_id, login_links.c.expires_at, login_links.c.credential_id)
        ).one_or_none()
        if row is not None and row.expires_at > tx.stamp:
            user = tx.conn.execute(
                select(users).where(users.c.id == row.user_id, users.c.active)
            ).one_or_none()
            if user is not None:
                note(tx, "login.link", user.username)
                return begin_session(tx, user.id, user.username, by_link=True, parent=row.credential_id)
    raise AuthError(
        message("this login link was used already or is too old; start the server again for a new one")
    )
