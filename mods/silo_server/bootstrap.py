# SPDX-License-Identifier: LGPL-2.1-or-later
"""The first start: newest schema, a first admin, a first token; every start: old things are cleared away."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import timedelta

from sqlalchemy import func, select

from silo.bom.errors import ConfigError
from silo_server.clock import stamp
from silo_server.db.engine import Database, Tx
from silo_server.db.migrate import upgrade
from silo_server.db.tables import users
from silo_server.files import FileStore
from silo_server.operation.housekeeping import START_TOKEN, tidy
from silo_server.services import search
from silo_server.services.access import accounts, credentials, logins
from silo_server.values import Role

START_TOKEN_DAYS = 30.0


@dataclass(frozen=True, slots=True)
class Welcome:
    """What the person who starts the server sees. ``login_secret`` belongs behind ``/login/link/``.

    Without an active admin there is no user, no token and no link.
    """

    username: str | None
    token: str | None
    login_secret: str | None


def prepare(db: Database, token: str | None = None, *, reset_admin: str | None = None) -> Welcome:
    """Bring the database up to date and let the first admin in.

    token
        ``SILO_API_TOKEN``, made a token of the first admin; a new one is made where None.
    reset_admin
        the user with this name becomes an active admin, is made where there is none, and is let in: the way
        back for those who locked themselves out.
    """
    upgrade(db)
    with db.write(even_when_read_only=True) as tx:
        if tx.conn.scalar(select(func.count()).select_from(users)) == 0:
            settings = tx.settings
            accounts.create_user(tx, settings.admin_username, Role.ADMIN, password=settings.admin_password)
        if reset_admin is not None:
            accounts.make_admin(tx, reset_admin)
        admin = accounts.get_user(tx, reset_admin) if reset_admin else _first_admin(tx)
        secret = _give_token(tx, admin, token) if admin else None
        link = logins.create_login_link(tx, admin.username) if admin else None
        search.ensure_index(tx)
    tidy(db, FileStore(db.settings.storage))
    return Welcome(admin.username if admin else None, secret, link)


def _first_admin(tx: Tx) -> accounts.User | None:
    row = tx.conn.execute(
        select(users).where(users.c.role == Role.ADMIN.value, users.c.active).order_by(users.c.id).limit(1)
    ).one_or_none()
    return accounts.to_user(row) if row is not None else None


def _give_token(tx: Tx, admin: accounts.User, token: str | None) -> str:
    if token is None:
        expires = stamp(tx.at + timedelta(days=START_TOKEN_DAYS))
        return credentials.create_token(tx, admin.id, START_TOKEN, expires=expires)[1]
    if not token or not token.isascii() or not token.isprintable() or " " in token:
        raise ConfigError("SILO_API_TOKEN: wanted visible ASCII characters without spaces")
    if not credentials.has_secret(tx, token):
        credentials.create_token(tx, admin.id, "SILO_API_TOKEN", secret=token)
    return token
