# SPDX-License-Identifier: LGPL-2.1-or-later
"""Bring a database to the newest schema; run at every start, by one process at a time.

A revision that rebuilds a table on SQLite uses :func:`rebuilt`, which keeps what such a rebuild loses.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from alembic import command, op
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.operations import BatchOperations
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, func, select, text

from silo.bom.errors import ConfigError
from silo_server.db.engine import MIGRATION_LOCK, Database

_SCRIPTS = Path(__file__).parent / "migrations"


def alembic_config(connection: Connection | None = None, more: Path | None = None) -> Config:
    """Alembic's configuration without an ini file: the scripts are inside the package.

    more
        a further folder of revisions, such as those that a test adds on top of ours.
    """
    config = Config()
    config.set_main_option("script_location", str(_SCRIPTS))
    config.set_main_option("path_separator", "os")
    folders = [str(_SCRIPTS / "versions"), *([str(more)] if more else [])]
    config.set_main_option("version_locations", os.pathsep.join(folders))
    config.attributes["connection"] = connection
    return config


def newest_revision() -> str:
    """The revision of the schema that this version works with."""
    head = ScriptDirectory.from_config(alembic_config()).get_current_head()
    assert head is not None
    return head


def upgrade(db: Database, revision: str = "head", more: Path | None = None) -> None:
    """Apply what is missing up to ``revision``, in one transaction: all of it or nothing.

    SQLite's write transaction and PostgreSQL's advisory lock keep a second server that starts at the same
    time waiting until the first is through. Raises ConfigError for a database of a newer version, and where
    rows would be left that refer to nothing.
    """
    with db.engine.execution_options(silo_write=True).connect() as connection:
        sqlite = connection.dialect.name == "sqlite"
        if not sqlite:
            with connection.begin():
                connection.execute(select(func.pg_advisory_xact_lock(MIGRATION_LOCK)))
                _apply(connection, revision, more)
            return
        # A rebuilt table is dropped for a moment. SQLite ignores this setting inside a transaction, and with
        # it on, it would refuse to drop a table that others refer to.
        _set_foreign_keys(connection, on=False)
        try:
            with connection.begin():
                if _apply(connection, revision, more):
                    _check_foreign_keys(connection)
        finally:
            _set_foreign_keys(connection, on=True)


@contextmanager
def rebuilt(table: str) -> Iterator[BatchOperations]:
    """``op.batch_alter_table`` that keeps AUTOINCREMENT, the highest id ever given out, and triggers.

    On SQLite most changes of a table make a new one and copy the rows; Alembic's copy loses all three.
    """
    connection = op.get_bind()
    if connection.dialect.name != "sqlite":
        with op.batch_alter_table(table) as batch:
            yield batch
        return
    created = connection.scalar(
        text("SELECT sql FROM sqlite_master WHERE type = 'table' AND name = :name"), {"name": table}
    )
    counts_up = "AUTOINCREMENT" in str(created).upper()
    highest = (
        connection.scalar(text("SELECT seq FROM sqlite_sequence WHERE name = :name"), {"name": table})
        if counts_up
        else None
    )
    triggers = connection.execute(
        text("SELECT name, sql FROM sqlite_master WHERE type = 'trigger' AND tbl_name = :name"),
        {"name": table},
    ).all()
    options: dict[str, Any] = {"sqlite_autoincrement": True} if counts_up else {}
    with op.batch_alter_table(table, table_kwargs=options) as batch:
        yield batch
    if highest is not None:
        connection.execute(text("DELETE FROM sqlite_sequence WHERE name = :name"), {"name": table})
        connection.execute(
            text("INSERT INTO sqlite_sequence (name, seq) VALUES (:name, :seq)"),
            {"name": table, "seq": highest},
        )
    there = set(connection.scalars(text("SELECT name FROM sqlite_master WHERE type = 'trigger'")))
    for name, sql in triggers:
        if name not in there:
            connection.exec_driver_sql(sql)


def check_revision(revision: str, more: Path | None = None) -> None:
    """Raise ConfigError for the schema of a newer version."""
    known = {
        script.revision for script in ScriptDirectory.from_config(alembic_config(more=more)).walk_revisions()
    }
    if revision not in known:
        raise ConfigError(
            f"the database has the schema {revision} of a newer silo-mod, and this version knows schemas up "
            f"to {max(known)}; nothing was changed. Start the newer version or restore a backup"
        )


def _apply(connection: Connection, revision: str, more: Path | None) -> bool:
    """True where something was applied."""
    before = MigrationContext.configure(connection).get_current_revision()
    if before is not None:
        check_revision(before, more)
    command.upgrade(alembic_config(connection, more), revision)
    return MigrationContext.configure(connection).get_current_revision() != before


def _check_foreign_keys(connection: Connection) -> None:
    orphans = connection.exec_driver_sql("PRAGMA foreign_key_check").all()
    if orphans:
        tables = sorted({f"{row[0]} to {row[2]}" for row in orphans})
        raise ConfigError(
            f"the database cannot be brought up to date: {len(orphans)} rows refer to rows that do not exist "
            f"({', '.join(tables)}); nothing was changed"
        )


def _set_foreign_keys(connection: Connection, *, on: bool) -> None:
    # On the driver's connection: SQLAlchemy would begin a transaction first.
    driver: Any = connection.connection.dbapi_connection
    driver.execute(f"PRAGMA foreign_keys = {'ON' if on else 'OFF'}")
