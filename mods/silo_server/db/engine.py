# SPDX-License-Identifier: LGPL-2.1-or-later
"""Engine, transactions, and what differs between SQLite and PostgreSQL; nothing else in the server asks.

Reads see one snapshot (SQLite: a transaction of its WAL; PostgreSQL: REPEATABLE READ, read only).

Every wait ends. Readers and writers have connections of their own, so that reads work while a writer
waits for another process, a locked row or a disk. Writers queue in a turnstile and are sent away (503,
BusyError) where too many wait or it takes too long; PostgreSQL has time-outs for locks and statements, and a
connection whose server does not answer at all is given up by us.

Writes: SQLite has one writer at a time (``BEGIN IMMEDIATE``); inside a process the turnstile queues them,
between processes SQLite's busy time-out does. On PostgreSQL writers of one BOM queue on the parent's row, and
two advisory locks keep the rest in order: :data:`STRUCTURE_LOCK` while edges are added (so that two merges
cannot close a cycle together), :data:`EVENT_LOCK` from the first event to the commit (so that event ids
become visible in their order, which replay by id relies on). They are always taken in that order.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, Engine, create_engine, event, func, insert, select, update

from silo.bom.errors import ReadOnlyError
from silo.durable import private_file, private_folder
from silo.folders import data_folder
from silo_server.clock import Clock, stamp, utc_now
from silo_server.db.tables import events, server_state
from silo_server.settings import Settings
from silo_server.turnstile import Turnstile
from silo_server.values import SYSTEM, Actor, NewEvent

STRUCTURE_LOCK = 0x51_10_0001
EVENT_LOCK = 0x51_10_0002
MIGRATION_LOCK = 0x51_10_0003
LOGIN_LOCK = 0x51_10_0004
ADMIN_LOCK = 0x51_10_0005
EVENT_CHANNEL = "silo_events"
# [s] For so long a writer waits: in our own queue, and then for another process or another transaction.
WAIT_SECONDS = 10
# [s] For so long one statement may run; far more than the largest merge needs.
READ_SECONDS, WRITE_SECONDS = 20, 40
CONNECT_SECONDS = 5
WRITERS_WAITING = 64
# Connections to PostgreSQL, per process.
READERS, WRITERS = 10, 6


@dataclass(frozen=True)
class Tx:
    """A unit of work: what every service function gets. ``pending`` events are written at its end."""

    conn: Connection
    actor: Actor
    at: datetime
    settings: Settings
    pending: list[NewEvent] = field(default_factory=list)

    @property
    def stamp(self) -> str:
        """The transaction's one time, as stored."""
        return stamp(self.at)

    @property
    def postgres(self) -> bool:
        return self.conn.dialect.name == "postgresql"

    def emit(self, new: NewEvent) -> None:
        """Announce ``new`` together with the commit, or not at all."""
        self.pending.append(new)

    def lock(self, key: int) -> None:
        """From here to the commit nobody else has this lock; SQLite's writers are alone anyhow."""
        if self.postgres:
            self.conn.execute(select(func.pg_advisory_xact_lock(key)))

    def lock_structure(self) -> None:
        """From here to the commit nobody else adds a BOM edge."""
        self.lock(STRUCTURE_LOCK)


class Database:
    """The way to the database: ``with db.read() as tx`` and ``with db.write(actor) as tx``."""

    def __init__(self, settings: Settings, clock: Clock = utc_now) -> None:
        self.settings = settings
        self.clock = clock
        self.on_events: Callable[[], None] = lambda: None
        # Token id → when it was used last, until a background thread writes it down.
        self.token_uses: dict[int, str] = {}
        if settings.is_sqlite:
            # ``engine`` is for those who look after the database as a whole, such as the migrations.
            self.engine = self._reads = self._writes = _sqlite_engine(settings)
        else:
            self.engine = _postgres_engine(settings, 1)
            self._reads = _postgres_engine(settings, READERS, READ_SECONDS)
            self._writes = _postgres_engine(settings, WRITERS, WRITE_SECONDS)
        self._reader = self._reads.execution_options(**_reader_options(settings))
        self._writer = self._writes.execution_options(silo_write=True)
        places = 1 if settings.is_sqlite else WRITERS
        self._turn = Turnstile(places, WRITERS_WAITING, WAIT_SECONDS, "changes")

    @contextmanager
    def read(self, actor: Actor = SYSTEM) -> Iterator[Tx]:
        """One consistent snapshot; changes nothing."""
        with self._reader.connect() as conn, conn.begin():
            yield Tx(conn, actor, self.clock(), self.settings)

    @contextmanager
    def write(self, actor: Actor = SYSTEM, *, even_when_read_only: bool = False) -> Iterator[Tx]:
        """All or nothing: state, history and events are committed together.

        Raises ReadOnlyError while the server takes no changes, BusyError where it would wait too long.
        """
        with self._turn.enter(), self._writer.connect() as conn, conn.begin():
            tx = Tx(conn, actor, self.clock(), self.settings)
            if not even_when_read_only and mode_of(tx) != "normal":
                raise ReadOnlyError(
                    "this server is read-only at the moment; nothing was changed, the same request may be "
                    "sent again later"
                )
            yield tx
            _flush_events(tx)
        if tx.pending:
            self.on_events()

    @property
    def connections(self) -> int:
        """How many are in use now, by readers, writers and those who look after the whole."""
        pools: list[Any] = [engine.pool for engine in {self.engine, self._reads, self._writes}]
        return sum(pool.checkedout() for pool in pools)

    def close(self) -> None:
        """Give all connections back."""
        for engine in (self.engine, self._reads, self._writes):
            engine.dispose()


def mode_of(tx: Tx) -> str:
    """``normal`` or ``read-only``; kept in the database, so that all processes agree."""
    if tx.settings.read_only:
        return "read-only"
    return get_state(tx, "mode") or "normal"


def get_state(tx: Tx, key: str) -> str | None:
    """The value kept under ``key``, None where there is none."""
    return tx.conn.scalar(select(server_state.c.value).where(server_state.c.key == key))


def put_state(tx: Tx, key: str, value: str) -> None:
    """Keep ``value`` under ``key``."""
    done = tx.conn.execute(update(server_state).where(server_state.c.key == key).values(value=value))
    if done.rowcount == 0:
        tx.conn.execute(insert(server_state).values(key=key, value=value))


def _flush_events(tx: Tx) -> None:
    if not tx.pending:
        return
    if tx.postgres:
        tx.conn.execute(select(func.pg_advisory_xact_lock(EVENT_LOCK)))
    tx.conn.execute(
        insert(events),
        [
            {
                "name": new.name,
                "item_uuid": new.item_uuid,
                "part_number_key": new.part_number.casefold() if new.part_number else None,
                "data": new.data,
                "at": tx.stamp,
                "username": tx.actor.username[:64],
            }
            for new in tx.pending
        ],
    )
    if tx.postgres:
        tx.conn.execute(select(func.pg_notify(EVENT_CHANNEL, "")))


def _reader_options(settings: Settings) -> dict[str, Any]:
    if settings.is_sqlite:
        return {}
    return {"isolation_level": "REPEATABLE READ", "postgresql_readonly": True}


def _postgres_engine(settings: Settings, connections: int, seconds: float | None = None) -> Engine:
    """``seconds``: how long one statement may take, None = as long as it takes."""
    from silo_server.db.patience import connect

    # Compiling a query costs more than any of ours takes.
    options = ["-c jit=off"]
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
        event.listen(engine, "do_connect", lambda _d, _r, args, named: connect(seconds + 2, *args, **named))
    return engine


def _sqlite_engine(settings: Settings) -> Engine:
    path = settings.sqlite_path
    assert path is not None  # the caller asked
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    with suppress(OSError):  # what is wrong with the place, SQLite says
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
    """The database has password hashes in it. SQLite gives the files beside it the rights that it has."""
    if path.parent == data_folder():
        private_folder(path.parent)
    private_file(path)
    for beside in (path.with_name(path.name + end) for end in ("-wal", "-shm")):
        if beside.exists():
            private_file(beside)


def _prepare_sqlite(connection: Any, _record: Any) -> None:
    # The driver must not begin or commit by itself: a merge is exactly one transaction of ours.
    connection.isolation_level = None
    cursor = connection.cursor()
    for pragma in ("journal_mode=WAL", "synchronous=FULL", "foreign_keys=ON", "cache_size=-32000"):
        cursor.execute(f"PRAGMA {pragma}")
    cursor.close()


def _begin_sqlite(conn: Connection) -> None:
    write = conn.get_execution_options().get("silo_write", False)
    conn.exec_driver_sql("BEGIN IMMEDIATE" if write else "BEGIN")
