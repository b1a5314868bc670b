# SPDX-License-Identifier: LGPL-2.1-or-later
"""Engine, transactions, and what differs between SQLite and PostgreSQL; nothing else in the server asks.

Reads see one snapshot (SQLite: a transaction of its WAL; PostgreSQL: REPEATABLE READ, read only).

Writes: SQLite has one writer at a time (``BEGIN IMMEDIATE``); inside a process a lock queues them fairly,
between processes SQLite's busy time-out does. On PostgreSQL writers of one BOM queue on the parent's row, and
two advisory locks keep the rest in order: :data:`STRUCTURE_LOCK` while edges are added (so that two merges
cannot close a cycle together), :data:`EVENT_LOCK` from the first event to the commit (so that event ids
become visible in their order, which replay by id relies on). They are always taken in that order.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from sqlalchemy import Connection, Engine, create_engine, event, func, insert, select
from sqlalchemy.exc import OperationalError

from silo.bom.errors import ReadOnlyError
from silo_server.clock import Clock, stamp, utc_now
from silo_server.db.tables import events, server_state
from silo_server.settings import Settings
from silo_server.values import SYSTEM, Actor, NewEvent

STRUCTURE_LOCK = 0x51_10_0001
EVENT_LOCK = 0x51_10_0002
MIGRATION_LOCK = 0x51_10_0003
EVENT_CHANNEL = "silo_events"
BUSY_SECONDS = 60


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

    def lock_structure(self) -> None:
        """From here to the commit nobody else adds a BOM edge."""
        if self.postgres:
            self.conn.execute(select(func.pg_advisory_xact_lock(STRUCTURE_LOCK)))


class Database:
    """The way to the database: ``with db.read() as tx`` and ``with db.write(actor) as tx``."""

    def __init__(self, settings: Settings, clock: Clock = utc_now) -> None:
        self.settings = settings
        self.clock = clock
        self.engine = _engine(settings)
        self.on_events: Callable[[], None] = lambda: None
        self._reader = self.engine.execution_options(**_reader_options(settings))
        self._writer = self.engine.execution_options(silo_write=True)
        self._turn: AbstractContextManager[Any] = threading.Lock() if settings.is_sqlite else nullcontext()

    @contextmanager
    def read(self, actor: Actor = SYSTEM) -> Iterator[Tx]:
        """One consistent snapshot; changes nothing."""
        with self._reader.connect() as conn, conn.begin():
            yield Tx(conn, actor, self.clock(), self.settings)

    @contextmanager
    def write(self, actor: Actor = SYSTEM, *, even_when_read_only: bool = False) -> Iterator[Tx]:
        """All or nothing: state, history and events are committed together.

        Raises ReadOnlyError while the server takes no changes.
        """
        with self._turn, self._writer.connect() as conn, conn.begin():
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

    def close(self) -> None:
        """Give all connections back."""
        self.engine.dispose()


def mode_of(tx: Tx) -> str:
    """``normal`` or ``read-only``; kept in the database, so that all processes agree."""
    if tx.settings.read_only:
        return "read-only"
    mode = tx.conn.scalar(select(server_state.c.value).where(server_state.c.key == "mode"))
    return mode or "normal"


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


def _engine(settings: Settings) -> Engine:
    path = settings.sqlite_path
    if path is None:
        return create_engine(settings.sqlalchemy_url, pool_size=8, max_overflow=8, pool_pre_ping=True)
    path.parent.mkdir(parents=True, exist_ok=True)
    engine = create_engine(
        settings.sqlalchemy_url,
        connect_args={"timeout": BUSY_SECONDS, "check_same_thread": False},
        pool_size=16,
        max_overflow=32,
    )
    event.listen(engine, "connect", _prepare_sqlite)
    event.listen(engine, "begin", _begin_sqlite)
    return engine


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


def is_unavailable(error: Exception) -> bool:
    """True for a database that cannot be reached or is too busy now; the same request may succeed later."""
    return isinstance(error, OperationalError)
