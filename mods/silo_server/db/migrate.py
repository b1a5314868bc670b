# SPDX-License-Identifier: LGPL-2.1-or-later
"""Bring a database to the newest schema; run at every start, by one process at a time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from sqlalchemy import Connection, func, select

from silo.bom.errors import ConfigError
from silo_server.db.engine import MIGRATION_LOCK, Database

if TYPE_CHECKING:
    from alembic.config import Config


def alembic_config(connection: Connection | None = None) -> Config:
    """Return Alembic's configuration without an ini file: the scripts are inside the package."""
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", str(Path(__file__).parent / "migrations"))
    config.set_main_option("path_separator", "os")
    config.attributes["connection"] = connection
    return config


def upgrade(db: Database, revision: str = "head") -> None:
    """Apply what is missing up to ``revision``, in one transaction: all of it or nothing.

    SQLite's write transaction and PostgreSQL's advisory lock keep a second server that starts at the same
    time waiting until the first is through. Raises ConfigError for a schema that this version does not read.
    """
    from alembic import command
    from alembic.migration import MigrationContext

    with db.engine.execution_options(silo_write=True).connect() as connection, connection.begin():
        if connection.dialect.name == "postgresql":
            connection.execute(select(func.pg_advisory_xact_lock(MIGRATION_LOCK)))
        before = MigrationContext.configure(connection).get_current_revision()
        if before is not None:
            check_revision(before)
        command.upgrade(alembic_config(connection), revision)


def check_revision(revision: str, holder: str = "database") -> None:
    """Raise ConfigError if this version does not read the schema ``revision`` of the ``holder``."""
    from alembic.script import ScriptDirectory

    readable = {script.revision for script in ScriptDirectory.from_config(alembic_config()).walk_revisions()}
    oldest, newest = min(readable), max(readable)
    if revision in readable:
        return
    if revision < oldest:
        raise ConfigError(
            f"the {holder} has the schema {revision} of a silo-mod before the first release, and this "
            f"version reads schemas from {oldest} on; nothing was changed. Start the version before this one "
            "once, or begin with a new database"
        )
    raise ConfigError(
        f"the {holder} has the schema {revision} of a newer silo-mod, and this version reads schemas up to "
        f"{newest}; nothing was changed. Start the newer version or restore a backup"
    )
