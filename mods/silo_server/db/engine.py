# SPDX-License-Identifier: LGPL-2.1-or-later
"""Engine, transactions, and what differs between SQLite and PostgreSQL; nothing else in the server asks.

Reads see one snapshot (SQLite: a transaction of its WAL; PostgreSQL: REPEATABLE READ, read only).

Every wait ends. Readers and writers have connections of their own, so that reads work while a writer
waits for another process, a locked row or a disk. Writers queue in a turnstile and are sent away (503,
BusyError) if too many wait or it takes too long; PostgreSQL has time-outs for locks and statements, and a
connection whose server does not answer at all is given up by us.

Writes: SQLite has one writer at a time (``BEGIN IMMEDIATE``); inside a process the turnstile queues them,
between processes SQLite's busy time-out does. On PostgreSQL writers of one BOM queue on the parent's row, and
two advisory locks keep the rest in order: :data:`STRUCTURE_LOCK` while edges are added (so that two merges
cannot close a cycle together), :data:`EVENT_LOCK` from the first event to the commit (so that event ids
become visible in their order, which replay by id relies on). They are always taken in that order.

A turnstile is a bounded queue before something scarce: the database's writers, the memory of a password
hash.

Many rows go in one statement, by the quick way of each database. SQLite: ``executemany`` of a prepared
statement, sets as one JSON parameter. PostgreSQL: arrays through ``UNNEST``, one round trip however many
rows there are.

Answers are kept for repeated requests: key → hash of the whole request → answer. The key is ``sync_id`` in
a merge, ``Idempotency-Key`` in an upload and an import, the UUID of a new item. A client whose connection
broke sends the request again and gets the first answer. Another request under the same key is refused: the
answer to the first would drop its content in silence. Housekeeping deletes old answers.
"""

from __future__ import annotations

import hashlib
import json
import threading
import time
from collections import deque
from collections.abc import Callable, Collection, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

from sqlalchemy import (
    Column,
    ColumnElement,
    Connection,
    Engine,
    Select,
    Table,
    TableValuedAlias,
    any_,
    bindparam,
    cast,
    create_engine,
    delete,
    event,
    func,
    insert,
    literal,
    select,
    text,
    update,
)
from sqlalchemy.dialects.postgresql import ARRAY

from silo.bom.errors import BusyError, ConflictError, ReadOnlyError
from silo.platform import data_folder, private_file, private_folder
from silo_server.actors import SYSTEM, Actor
from silo_server.db.tables import answers, bom_lines, events, items, product_summaries, server_state
from silo_server.settings import Settings
from silo_server.times import Clock, stamp, utc_now
from silo_server.values import NewEvent


class Turnstile:
    """Lets ``places`` threads in at once; ``waiting`` more wait, each at most ``seconds``; the rest go away.

    who
        what those inside do, for the message of the BusyError (503) that the others get.
    """

    def __init__(self, places: int, waiting: int, seconds: float, who: str) -> None:
        self._free = threading.Semaphore(places)
        self._room = places + waiting
        self._here = 0
        self._lock = threading.Lock()
        self._seconds = seconds
        self._who = who
        self._closed = False

    @contextmanager
    def enter(self) -> Iterator[None]:
        """Wait for a place, and stay inside until the block ends. Raises BusyError; then nothing was done."""
        with self._lock:
            if self.full:
                raise BusyError(f"too many {self._who} are waiting; nothing was changed, try again later")
            self._here += 1
        try:
            if not self._free.acquire(timeout=self._seconds):
                raise BusyError(
                    f"other {self._who} took longer than {self._seconds:g} s; nothing was changed, "
                    "try again later"
                )
            try:
                self.check()
                yield
            finally:
                self._free.release()
        finally:
            with self._lock:
                self._here -= 1

    def close(self) -> None:
        """Send all away, as the server stops: those who wait now, those inside at the next :meth:`check`."""
        self._closed = True
        self._free.release(self._room)

    def check(self) -> None:
        """Raise BusyError if the server is stopping."""
        if self._closed:
            raise BusyError("the server is stopping; try again later")

    @property
    def here(self) -> int:
        """Return how many threads are inside or wait."""
        return self._here

    @property
    def full(self) -> bool:
        """Return True if the next thread is sent away."""
        return self._here >= self._room


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


@dataclass
class Tx:
    """A unit of work: what every service function gets. ``pending`` events are written at its end."""

    conn: Connection
    actor: Actor
    at: datetime
    settings: Settings
    clock: Clock = utc_now
    pending: list[NewEvent] = field(default_factory=list)
    ends_access: bool = False
    # UUIDs of items that changed without an event.
    touched: set[str] = field(default_factory=set)
    # Where a read leaves the summaries that it made (services.bom.summary); a change leaves none.
    built: deque[Any] | None = None

    @property
    def stamp(self) -> str:
        """Return the time of the transaction, as it is stored; it has only one."""
        return stamp(self.at)

    def take_time(self, after: str) -> None:
        """Take the time again behind a lock; later than ``after``, whatever the clock says.

        Otherwise a change would have an earlier time than the change that it waited for.
        """
        self.at = max(self.clock(), datetime.fromisoformat(after) + timedelta(microseconds=1))

    @property
    def postgres(self) -> bool:
        return self.conn.dialect.name == "postgresql"

    def emit(self, new: NewEvent) -> None:
        """Announce ``new`` together with the commit, or not at all."""
        self.pending.append(new)

    def end_access(self) -> None:
        """Make every event stream check, after the commit, if its caller may still read it."""
        self.ends_access = True
        if self.postgres:
            self.conn.execute(select(func.pg_notify(EVENT_CHANNEL, "access")))

    def lock(self, key: int | str) -> None:
        """Take this lock, or that of a text, until the commit; SQLite needs none: it has one writer."""
        if self.postgres:
            if isinstance(key, str):
                key = int(hashlib.sha256(key.encode()).hexdigest()[:15], 16)
            self.conn.execute(select(func.pg_advisory_xact_lock(key)))


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
            self.engine = self._reads = self._writes = _sqlite_engine(settings)
        else:
            self.engine = _postgres_engine(settings, 1)
            self._reads = _postgres_engine(settings, READERS, READ_SECONDS)
            self._writes = _postgres_engine(settings, WRITERS, WRITE_SECONDS)
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
                    "this server is read-only at the moment; nothing was changed, the same request may be "
                    "sent again later"
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


def mode_of(tx: Tx) -> str:
    """Read the mode, ``normal`` or ``read-only``: of the settings, else of the database (all processes)."""
    if tx.settings.read_only:
        return "read-only"
    return get_state(tx, "mode") or "normal"


def get_state(tx: Tx, key: str) -> str | None:
    """Read the value that is stored under ``key``; None if there is none."""
    return tx.conn.scalar(select(server_state.c.value).where(server_state.c.key == key))


def put_state(tx: Tx, key: str, value: str) -> None:
    """Store ``value`` under ``key``."""
    # In one statement: another process may store the first value under this key at the same moment.
    put = "INSERT INTO server_state VALUES (:key, :value) ON CONFLICT (key) DO UPDATE SET value = :value"
    tx.conn.execute(text(put), {"key": key, "value": value})


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


def uses_of(which: ColumnElement[bool], *, kept: bool = False) -> Select[Any]:
    """Select the ids of these items and of all that they are in, on any level.

    kept
        only items with a summary; above an item without one, nothing has one.
    """
    above = select(items.c.id).where(which).cte("above", recursive=True)
    step = select(bom_lines.c.parent_id).join(above, bom_lines.c.child_id == above.c.id)
    if kept:
        step = step.join(product_summaries, product_summaries.c.item_id == bom_lines.c.parent_id)
    return select(above.union(step).c.id)


def _postgres_engine(settings: Settings, connections: int, seconds: float | None = None) -> Engine:
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


def _sqlite_engine(settings: Settings) -> Engine:
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
        for pragma in ("journal_mode=WAL", "synchronous=FULL", "foreign_keys=ON", "cache_size=-32000"):
            connection.execute(f"PRAGMA {pragma}").close()
    except BaseException:
        connection.close()  # the pool does not know it yet
        raise


def _begin_sqlite(conn: Connection) -> None:
    write = conn.get_execution_options().get("silo_write", False)
    conn.exec_driver_sql("BEGIN IMMEDIATE" if write else "BEGIN")


FEW = 500


def one_of(tx: Tx, column: ColumnElement[Any], values: Collection[Any]) -> ColumnElement[bool]:
    """Make the condition that ``column`` is one of ``values``; they are one parameter, however many."""
    listed = list(values)
    if tx.postgres:
        array: ColumnElement[Any] = cast(literal(listed, ARRAY(column.type)), ARRAY(column.type))
        # A long constant misleads the planner into looking at each row.
        return among(tx, column, select(func.unnest(array))) if len(listed) >= FEW else column == any_(array)
    each = func.json_each(json.dumps(listed)).table_valued("value")
    return column.in_(select(each.c.value))


def insert_rows(tx: Tx, table: Table, rows: Sequence[Mapping[str, Any]]) -> None:
    """Insert all ``rows``, which have the same keys, into ``table``."""
    if not rows:
        return
    if not tx.postgres:
        tx.conn.execute(insert(table), [dict(row) for row in rows])
        return
    names = list(rows[0])
    source = _unnest(table, names, rows)
    tx.conn.execute(insert(table).from_select(names, select(*[source.c[name] for name in names])))


def update_rows(tx: Tx, table: Table, key: str, rows: Sequence[Mapping[str, Any]]) -> None:
    """Set the other columns of each row where ``table.key`` is the row's ``key``."""
    if not rows:
        return
    names = [name for name in rows[0] if name != key]
    if tx.postgres:
        source = _unnest(table, [key, *names], rows)
        changes = {name: source.c[name] for name in names}
        tx.conn.execute(update(table).where(table.c[key] == source.c[key]).values(changes))
        return
    statement = (
        update(table)
        .where(table.c[key] == bindparam("by_key"))
        .values({name: bindparam(f"to_{name}") for name in names})
    )
    tx.conn.execute(
        statement, [{"by_key": row[key], **{f"to_{name}": row[name] for name in names}} for row in rows]
    )


def _unnest(table: Table, names: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> TableValuedAlias:
    columns: list[Column[Any]] = [table.c[name] for name in names]
    arrays = [
        cast(bindparam(None, [row[c.name] for row in rows], ARRAY(c.type)), ARRAY(c.type)) for c in columns
    ]
    return (
        func.unnest(*arrays)
        .table_valued(*[Column(c.name, c.type) for c in columns], name="given")
        .render_derived()
    )


def among(tx: Tx, column: ColumnElement[Any], query: Select[Any]) -> ColumnElement[bool]:
    """Make the condition that ``column`` is one of those that ``query`` selects.

    PostgreSQL does not know how many they are, and would rather read all of a table; so they are an array (66
    000 parents: 0.1 s instead of 45 s).
    """
    if not tx.postgres:
        return column.in_(query)
    return column == any_(func.array(query.scalar_subquery(), type_=ARRAY(column.type)))


def newest_first(
    tx: Tx,
    query: Select[Any],
    column: ColumnElement[int],
    limit: int,
    before: int | None = None,
    after: int | None = None,
) -> list[Any]:
    """Read a page of a list by its ids, newest first: those before an id, or the nearest after one."""
    if before is not None:
        query = query.where(column < before)
    if after is None:
        return list(tx.conn.execute(query.order_by(column.desc()).limit(limit)))
    return list(tx.conn.execute(query.where(column > after).order_by(column).limit(limit)))[::-1]


@dataclass(frozen=True, slots=True)
class KeyedRequest:
    """A request that may come again.

    subject
        what it is about (``merge 12``: internal id), within which the ``key`` is unique.
    """

    subject: str
    key: str
    hash: str

    @classmethod
    def of(cls, subject: str, key: str | None, *content: Any) -> KeyedRequest | None:
        """Make the request with this content (JSON values); None if the request has no key."""
        if not key:
            return None
        written = json.dumps(content, sort_keys=True, separators=(",", ":"))
        return cls(subject, key, hashlib.sha256(written.encode()).hexdigest())


@dataclass(frozen=True, slots=True)
class KeptAnswer:
    """What was answered: text, version, and the change of a BOM that the text needs to be whole."""

    text: str
    version: int = 0
    change_id: int | None = None


def earlier_answer(tx: Tx, request: KeyedRequest | None) -> KeptAnswer | None:
    """Find the answer that the same request got before; None if there was none.

    The caller holds a lock that makes two repeats wait for one another. ConflictError if the key
    was used for another request.
    """
    if request is None:
        return None
    row = tx.conn.execute(
        select(answers).where(answers.c.subject == request.subject, answers.c.key == request.key)
    ).one_or_none()
    if row is None:
        return None
    if row.request_hash != request.hash:
        name = {"merge": "sync_id", "item": "id"}.get(request.subject.partition(" ")[0], "Idempotency-Key")
        raise ConflictError(
            f"{name} {request.key!r} was used before for another request, which was carried out; send a new "
            "one with new content"
        )
    return KeptAnswer(row.answer, row.version, row.change_id)


def keep_answer(tx: Tx, request: KeyedRequest | None, answer: KeptAnswer) -> None:
    """Keep the answer to a request that was carried out, together with what it changed."""
    if request is not None:
        tx.conn.execute(
            insert(answers).values(
                subject=request.subject,
                key=request.key,
                request_hash=request.hash,
                answer=answer.text,
                version=answer.version,
                change_id=answer.change_id,
                at=tx.stamp,
            )
        )
