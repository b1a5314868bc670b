# SPDX-License-Identifier: LGPL-2.1-or-later
"""The engines for SQLite and PostgreSQL: their connections, and the time after which each wait ends.

PostgreSQL has time-outs for locks and statements, and a connection whose server does not answer at all is
given up by us.
"""

from __future__ import annotations

import sqlite3
import time
from collections.abc import Callable, Generator
from contextlib import suppress
from pathlib import Path
from typing import Any

from sqlalchemy import (
    Connection,
    Engine,
    create_engine,
    event,
)

from silo.platform.user_folders import data_folder
from silo.platform.whole_files import private_file, private_folder
from silo_server.settings import Settings

# [s] For so long a writer waits: in our own queue, and then for another process or another transaction.
WAIT_SECONDS = 10
# [s] For so long one statement may run; far more than the largest merge needs.
READ_SECONDS, WRITE_SECONDS = 20, 40
CONNECT_SECONDS = 5
# [s] Between two tries to change the journal of a database.
WAL_SECONDS = 0.02
# Connections to PostgreSQL, per process.
READERS, WRITERS = 10, 6


def postgres_engine(settings: Settings, connections: int, seconds: float | None = None) -> Engine:
    """Make an engine. ``seconds``: the longest time for one statement; None: no limit."""

    # Compiling a query takes longer than running any of ours; an index is read from memory.
    options = ["-c jit=off -c random_page_cost=1.1"]
    if seconds is not None:
        milliseconds = {
            "statement_timeout": seconds,
            "lock_timeout": WAIT_SECONDS,
            "idle_in_transaction_session_timeout": seconds,
        }
        options += [f"-c {k}={int(v * 1000)}" for k, v in milliseconds.items()]
    arguments = {"connect_timeout": CONNECT_SECONDS, "options": " ".join(options)}
    engine = create_engine(
        settings.sqlalchemy_url,
        pool_size=connections,
        max_overflow=0,
        pool_timeout=WAIT_SECONDS,
        pool_pre_ping=True,
        connect_args=arguments,
    )
    if seconds is not None:
        # A server that is frozen keeps none of its own time-outs.
        def connect(_dialect: Any, _record: Any, args: Any, named: Any) -> Any:
            return _patient_connection(seconds + 2, *args, **named)

        event.listen(engine, "do_connect", connect)
    return engine


def _patient_connection(seconds: float, *args: Any, **named: Any) -> Any:
    """Connect to PostgreSQL; a statement that brings no answer within ``seconds`` is an OperationalError.

    psycopg alone waits without end for a server that is stopped or frozen.
    """
    import psycopg  # late: a server on SQLite never needs it

    class Connection(psycopg.Connection[Any]):
        def wait(self, gen: Generator[Any, Any, Any], *more: Any, **named: Any) -> Any:
            return super().wait(self._bounded(gen), *more, **named)

        def _bounded(self, gen: Generator[Any, Any, Any]) -> Generator[Any, Any, Any]:
            # psycopg resumes its generator several times a second, even if the server says nothing.
            end = time.monotonic() + seconds
            try:
                wanted = next(gen)
                while True:
                    ready = yield wanted
                    if not ready and time.monotonic() > end:
                        self.pgconn.finish()
                        raise psycopg.OperationalError(f"the database did not answer for {seconds:g} s")
                    wanted = gen.send(ready)
            except StopIteration as done:
                return done.value

    return Connection.connect(*args, **named)


def sqlite_engine(settings: Settings) -> Engine:
    path = settings.sqlite_path
    assert path is not None  # the caller asked
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    with suppress(OSError):  # SQLite reports what is wrong with the place
        _keep_private(path)
    engine = create_engine(
        settings.sqlalchemy_url,
        connect_args={"timeout": WAIT_SECONDS, "check_same_thread": False},
        pool_size=16,
        max_overflow=32,
        pool_timeout=WAIT_SECONDS,
    )
    event.listen(engine, "connect", _prepare_sqlite)
    event.listen(engine, "begin", _begin_sqlite)
    return engine


def _keep_private(path: Path) -> None:
    """Keep the database private: it has password hashes. SQLite gives its other files the same rights."""
    if path.parent == data_folder():
        private_folder(path.parent)
    private_file(path)
    for beside in (path.with_name(path.name + end) for end in ("-wal", "-shm")):
        if beside.exists():
            private_file(beside)


def _prepare_sqlite(connection: Any, _record: Any) -> None:
    # The driver must not begin or commit by itself: a merge is exactly one transaction of ours.
    connection.isolation_level = None
    try:
        write_ahead(connection)
        for pragma in ("synchronous=FULL", "foreign_keys=ON", "cache_size=-32000"):
            connection.execute(f"PRAGMA {pragma}").close()
    except BaseException:
        connection.close()  # the pool does not know it yet
        raise


def write_ahead(
    connection: sqlite3.Connection,
    seconds: float = WAIT_SECONDS,
    pause: Callable[[float], object] = time.sleep,
) -> None:
    """Change the journal of the database to WAL; wait up to ``seconds`` for another connection that writes.

    The busy time-out of SQLite does not hold for this change: if another process writes to a database that is
    not WAL yet, the answer is SQLITE_BUSY at once. That is so while two servers start over a new database.
    """
    until = time.monotonic() + seconds
    while True:
        try:
            connection.execute("PRAGMA journal_mode=WAL").close()
            return
        except sqlite3.OperationalError as error:
            # The low byte is the kind; the others are its reason.
            if error.sqlite_errorcode & 0xFF != sqlite3.SQLITE_BUSY or time.monotonic() >= until:
                raise
        pause(WAL_SECONDS)


def _begin_sqlite(conn: Connection) -> None:
    write = conn.get_execution_options().get("silo_write", False)
    conn.exec_driver_sql("BEGIN IMMEDIATE" if write else "BEGIN")
