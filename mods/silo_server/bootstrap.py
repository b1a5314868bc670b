# SPDX-License-Identifier: LGPL-2.1-or-later
"""The first start: newest schema, a first admin, a first token; every start: old things are cleared away."""

from __future__ import annotations

from dataclasses import dataclass

from sqlalchemy import func, select

from silo.bom.errors import ConfigError
from silo_server.db.engine import Database, Tx
from silo_server.db.migrate import upgrade
from silo_server.db.tables import users
from silo_server.files import FileStore
from silo_server.operation.housekeeping import START_TOKEN, tidy
from silo_server.services import accounts, credentials, logins, search
from silo_server.values import Role

START_TOKEN_DAYS = 30.0


@dataclass(frozen=True, slots=True)
class Welcome:
    """What the person who starts the server is told. ``login_secret`` belongs behind ``/login/link/``."""

    username: str
    token: str
    login_secret: str
    first_start: bool


def prepare(db: Database, token: str | None = None) -> Welcome:
    """Bring the database up to date and let the first admin in.

    token
        ``SILO_API_TOKEN``, made a token of the first admin; a new one is made where None.
    """
    upgrade(db)
    with db.write(even_when_read_only=True) as tx:
        first = (tx.conn.scalar(select(func.count()).select_from(users)) or 0) == 0
        if first:
            settings = tx.settings
            accounts.create_user(tx, settings.admin_username, Role.ADMIN, password=settings.admin_password)
        admin = _first_admin(tx)
        secret = _give_token(tx, admin, token)
        link = logins.create_login_link(tx, admin.username)
        search.ensure_index(tx)
    tidy(db, FileStore(db.settings.storage))
    return Welcome(admin.username, secret, link, first)


def _first_admin(tx: Tx) -> accounts.User:
    row = tx.conn.execute(
        select(users).where(users.c.role == Role.ADMIN.value, users.c.active).order_by(users.c.id).limit(1)
    ).one()
    return accounts.to_user(row)


def _give_token(tx: Tx, admin: accounts.User, token: str | None) -> str:
    if token is None:
        return credentials.create_token(tx, admin.id, START_TOKEN, days=START_TOKEN_DAYS)[1]
    if not token or not token.isascii() or not token.isprintable() or " " in token:
        raise ConfigError("SILO_API_TOKEN: wanted visible ASCII characters without spaces")
    if not credentials.has_secret(tx, token):
        credentials.create_token(tx, admin.id, "SILO_API_TOKEN", secret=token)
    return token
