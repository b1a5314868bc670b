# SPDX-License-Identifier: LGPL-2.1-or-later
"""The way to the database: reads of one snapshot, and writes that are committed whole or not at all.

Reads see one snapshot (SQLite: a transaction of its WAL; PostgreSQL: REPEATABLE READ, read only).

Every wait ends. Readers and writers have connections of their own, so that reads work while a writer
waits for another process, a locked row or a disk. Writers queue in a turnstile and are sent away (503,
BusyError) if too many wait or it takes too long.

Writes: SQLite has one writer at a time (``BEGIN IMMEDIATE``); inside a process the turnstile queues them,
between processes SQLite's busy time-out does.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from sqlalchemy import delete, func, insert, select

from silo.bom.errors import ReadOnlyError
from silo.bom.message import message
from silo_server.actors import SYSTEM, Actor
from silo_server.db.engine import (
    READ_SECONDS,
    READERS,
    WAIT_SECONDS,
    WRITE_SECONDS,
    WRITERS,
    postgres_engine,
    sqlite_engine,
)
from silo_server.db.rows import one_of
from silo_server.db.state import mode_of
from silo_server.db.tables import events, items, product_summaries
from silo_server.db.transaction import EVENT_CHANNEL, EVENT_LOCK, Tx
from silo_server.db.turnstile import Turnstile
from silo_server.db.usage import uses_of
from silo_server.settings import Settings
from silo_server.times import Clock, utc_now

WRITERS_WAITING = 64


class Database:
    """The way to the database: ``with db.read() as tx`` and ``with db.write(actor) as tx``."""

    def __init__(self, settings: Settings, clock: Clock = utc_now) -> None:
        self.settings = settings
        self.clock = clock
        self.on_events: Callable[[], None] = lambda: None
        self.on_access: Callable[[], None] = lambda: None
        # Token id → when it was used last, until a background thread writes it down.
        self.token_uses: dict[int, str] = {}
        # What reads made of products, until the same thread keeps it; what is pushed out is made again.
        self.built: deque[Any] = deque(maxlen=64)
        # (User, item) → when the page of the product was shown, until the same thread notes it.
        self.looks: dict[tuple[int, int], str] = {}
        if settings.is_sqlite:
            # ``engine`` is for those who look after the database as a whole, such as the migrations.
            self.engine = self._reads = self._writes = sqlite_engine(settings)
        else:
            self.engine = postgres_engine(settings, 1)
            self._reads = postgres_engine(settings, READERS, READ_SECONDS)
            self._writes = postgres_engine(settings, WRITERS, WRITE_SECONDS)
        snapshot: dict[str, Any] = {"isolation_level": "REPEATABLE READ", "postgresql_readonly": True}
        self._reader = self._reads.execution_options(**({} if settings.is_sqlite else snapshot))
        self._writer = self._writes.execution_options(silo_write=True)
        places = 1 if settings.is_sqlite else WRITERS
        self.turn = Turnstile(places, WRITERS_WAITING, WAIT_SECONDS, "changes")

    @contextmanager
    def read(self, actor: Actor = SYSTEM) -> Iterator[Tx]:
        """Open one consistent snapshot; change nothing."""
        with self._reader.connect() as conn, conn.begin():
            yield Tx(conn, actor, self.clock(), self.settings, self.clock, built=self.built)

    @contextmanager
    def write(self, actor: Actor = SYSTEM, *, even_when_read_only: bool = False) -> Iterator[Tx]:
        """Open a transaction: state, history and events are committed together, or nothing is.

        Raises ReadOnlyError while the server takes no changes, BusyError if it would wait too long.
        """
        with self.turn.enter(), self._writer.connect() as conn, conn.begin():
            tx = Tx(conn, actor, self.clock(), self.settings, self.clock)
            if not even_when_read_only and mode_of(tx) != "normal":
                raise ReadOnlyError(
                    message(
                        "this server is read-only at the moment; nothing was changed, the same request "
                        "may be sent again later"
                    )
                )
            yield tx
            _flush_events(tx)
        if tx.pending:
            self.on_events()
        if tx.ends_access:
            self.on_access()

    @property
    def connections(self) -> int:
        """Return how many connections are in use now."""
        pools: list[Any] = [engine.pool for engine in {self.engine, self._reads, self._writes}]
        return sum(pool.checkedout() for pool in pools)

    def close(self) -> None:
        """Close all connections."""
        for engine in (self.engine, self._reads, self._writes):
            engine.dispose()


def _flush_events(tx: Tx) -> None:
    concerned = tx.touched.union(new.item_uuid for new in tx.pending if new.item_uuid)
    if concerned or tx.pending:
        tx.lock(EVENT_LOCK)
    if concerned:
        which = one_of(tx, items.c.uuid, concerned)
        outdated = product_summaries.c.item_id.in_(uses_of(which, kept=True))
        tx.conn.execute(delete(product_summaries).where(outdated))
    if not tx.pending:
        return
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
