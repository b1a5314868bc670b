# SPDX-License-Identifier: LGPL-2.1-or-later
"""Bring a database to the newest schema; run at every start, by one process at a time."""

from __future__ import annotations

from pathlib import Path

from alembic import command
from alembic.config import Config
from sqlalchemy import Connection, func, select

from silo_server.db.engine import MIGRATION_LOCK, Database


def alembic_config(connection: Connection | None = None) -> Config:
    """Alembic's configuration without an ini file: the scripts lie inside the package."""
    config = Config()
    config.set_main_option("script_location", str(Path(__file__).parent / "migrations"))
    config.set_main_option("path_separator", "os")
    config.attributes["connection"] = connection
    return config


def upgrade(db: Database, revision: str = "head") -> None:
    """Apply what is missing up to ``revision``, in one transaction: all of it or nothing.

    SQLite's write transaction and PostgreSQL's advisory lock keep a second server that starts at the same
    time waiting until the first is through.
    """
    with db.engine.execution_options(silo_write=True).connect() as connection, connection.begin():
        if connection.dialect.name == "postgresql":
            connection.execute(select(func.pg_advisory_xact_lock(MIGRATION_LOCK)))
        command.upgrade(alembic_config(connection), revision)
