# SPDX-License-Identifier: LGPL-2.1-or-later
"""The durable event log: what is announced, how it is read back, how it is trimmed.

Names: the spec's ``bom_merge``; the real Silo's ``item.created``, ``item.updated``, ``item.deleted``,
``revision.created``, ``server.state``; ours ``bom.updated`` for changes of a BOM that are no merge, and
``document.revised`` for a file that is no item's.

One dispatcher per process, any number of listeners, no queue and no thread per listener.

The log in the database is the truth. The hub keeps the newest part of it in memory (the ring) as ready-made
frames and wakes all listeners when it grows. A listener is only a cursor, the id of the last event it was
given; it takes what is newer from the ring or, if it is too slow or was away, from the log. So a slow
client blocks nobody, costs nothing and loses nothing; only one that is behind the log's horizon is sent
``reset`` and must read everything again.

News arrive by a call after a commit in this process, by PostgreSQL's NOTIFY from another, and at the latest
by the poll (``Settings.poll_seconds``).

``GET /api/events`` as an ASGI response: replay, live events, filters, heartbeat, until the client goes.
"""

from __future__ import annotations

import asyncio
import logging
import threading
import zlib
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, LargeBinary, Select, cast, delete, func, select
from sqlalchemy.exc import SQLAlchemyError
from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from silo_server.db.engine import Database, Tx, get_state, mode_of, newest_first, put_state
from silo_server.db.tables import events, items
from silo_server.errors import cause_of
from silo_server.fields import from_row
from silo_server.services import access
from silo_server.times import spec_time
from silo_server.user_json import dumps
from silo_server.values import Document, Item, NewEvent, Revision

HORIZON = "event_horizon"


@dataclass(frozen=True, slots=True)
class LoggedEvent:
    """An event of the log; ``data`` is JSON. ``item_uuid`` and ``part_number_key`` are for filters."""

    id: int
    name: str
    data: str
    at: str
    item_uuid: str | None = None
    part_number_key: str | None = None
    username: str | None = None

    @property
    def mark(self) -> EventMark:
        """Return the mark that a listener sends when it comes back after this event."""
        return EventMark(self.id, f"{zlib.crc32(f'{self.name} {self.at} {self.data}'.encode()):08x}")


@dataclass(frozen=True, slots=True)
class EventMark:
    """A place in the log: an event's number, and a tag of what it said; "" if there is no event.

    A restored database gives the numbers that it had given out since the backup to other events. The tag
    shows that: it is the log's epoch, for each event alone, so that however a database is put back, a
    listener that saw what is no more gets a ``reset``.
    """

    id: int
    tag: str = ""

    def __str__(self) -> str:
        return f"{self.id}-{self.tag}" if self.tag else str(self.id)


def item_created(tx: Tx, item: Item) -> None:
    _about(tx, "item.created", item, {**_named(item), "item_type": item.item_type})


def item_updated(tx: Tx, item: Item, summary: str = "changed") -> None:
    data = {**_named(item), "revision": item.current_revision, "summary": summary}
    _about(tx, "item.updated", item, data)


def item_deleted(tx: Tx, item: Item) -> None:
    _about(tx, "item.deleted", item, {"part_number": item.part_number, "id": item.uuid})


def revision_created(tx: Tx, of: Item | Document, revision: Revision) -> None:
    data = {
        "revision_number": revision.revision_number,
        "comment": revision.comment,
        "file_name": revision.file_name,
        "user": revision.created_by,
    }
    if isinstance(of, Item):
        _about(tx, "revision.created", of, {"part_number": of.part_number, "id": of.uuid, **data})
    else:
        tx.emit(NewEvent("document.revised", dumps({"document": of.uuid, **data})))


def bom_updated(tx: Tx, item: Item, kind: str, summary: str) -> None:
    data = {
        "item": item.part_number,
        "kind": kind,
        "user": tx.actor.username,
        "timestamp": spec_time(tx.stamp),
        "summary": summary,
    }
    _about(tx, "bom.updated", item, data)


def bom_merged(tx: Tx, item: Item, data: Mapping[str, Any]) -> None:
    _about(tx, "bom_merge", item, data)


def released(tx: Tx, item: Item, label: str, what: str) -> None:
    """Announce what became of a revision of a product: submitted, approved, released, rejected, …"""
    data = {**_named(item), "revision": label, "status": what, "user": tx.actor.username}
    _about(tx, "revision.released" if what == "released" else "revision.reviewed", item, data)


def set_mode(tx: Tx, mode: str) -> str:
    """Set the mode, ``normal`` or ``read-only`` (no changes); return the mode that now counts."""
    access.note(tx, "mode.set", mode, f"{mode_of(tx)} → {mode}")
    put_state(tx, "mode", mode)
    tx.emit(NewEvent("server.state", dumps({"mode": mode_of(tx)})))
    return mode_of(tx)


def read_after(tx: Tx, after: int, limit: int = 500) -> list[LoggedEvent]:
    """Read the next events after id ``after``, oldest first."""
    rows = tx.conn.execute(select(events).where(events.c.id > after).order_by(events.c.id).limit(limit)).all()
    return [from_row(LoggedEvent, row) for row in rows]


@dataclass(frozen=True, slots=True)
class EventQuery:
    """Which events; "" and none: all.

    part_number
        of this item, under whatever number it had.
    since, until
        the first and the last day, in UTC.
    inside
        of the items that this selects by their internal ids, instead of the one.
    """

    names: Sequence[str] = ()
    username: str = ""
    part_number: str = ""
    since: str = ""
    until: str = ""
    inside: Select[Any] | None = None


def newest(
    tx: Tx,
    asked: EventQuery,
    limit: int,
    before: int | None = None,
    after: int | None = None,
) -> list[LoggedEvent]:
    """Read the newest of the events that ``asked`` describes, newest first.

    ``before`` and ``after`` are ids to page from.
    """
    query = select(events)
    if asked.names:
        query = query.where(events.c.name.in_(asked.names))
    if asked.username:
        query = query.where(events.c.username == asked.username)
    if asked.since:
        query = query.where(events.c.at >= asked.since)
    if asked.until:
        query = query.where(events.c.at < f"{asked.until}U")  # behind each time of this day
    if asked.inside is not None:
        query = query.where(events.c.item_uuid.in_(select(items.c.uuid).where(items.c.id.in_(asked.inside))))
    elif asked.part_number:
        key = asked.part_number.casefold()
        item = select(items.c.uuid).where(items.c.part_number_key == key).scalar_subquery()
        query = query.where((events.c.part_number_key == key) | (events.c.item_uuid == item))
    rows = newest_first(tx, query, events.c.id, limit, before, after)
    return [from_row(LoggedEvent, row) for row in rows]


def usernames(tx: Tx) -> list[str]:
    """List all users with events, by name."""
    scalars = tx.conn.scalars(select(events.c.username).distinct().where(events.c.username.is_not(None)))
    return sorted(scalars, key=str.casefold)


def horizon_of(tx: Tx) -> int:
    """Find the newest id that was trimmed away; 0 if none was."""
    return int(get_state(tx, HORIZON) or 0)


def bounds(tx: Tx) -> tuple[int, int]:
    """Find (horizon, head): the newest id that was trimmed away, and the newest id of all."""
    horizon = horizon_of(tx)
    head = tx.conn.scalar(select(func.max(events.c.id))) or 0
    return horizon, max(head, horizon)


def head(tx: Tx) -> EventMark:
    """Find the mark of the newest event."""
    return mark_at(tx, bounds(tx)[1])


def reaches(tx: Tx, mark: EventMark) -> bool:
    """Check if the log has all events after ``mark``, without a gap.

    False if the mark was trimmed away, is in the future, or now belongs to another event.
    """
    horizon, newest_id = bounds(tx)
    if not horizon <= mark.id <= newest_id:
        return False
    return not mark.tag or mark.id == horizon or mark_at(tx, mark.id) == mark


def mark_at(tx: Tx, event_id: int) -> EventMark:
    """Find the mark of the event with this id; without a tag if there is no such event any more."""
    row = tx.conn.execute(select(events).where(events.c.id == event_id)).one_or_none()
    return from_row(LoggedEvent, row).mark if row is not None else EventMark(event_id)


def trim(tx: Tx, keep: int, keep_bytes: int | None = None, limit: int | None = None) -> int:
    """Delete all events but the newest ``keep``, and of these all beyond ``keep_bytes`` of data.

    At most ``limit`` at once, the oldest first. Returns how many were deleted; the last is the new horizon.
    """
    horizon, head = bounds(tx)
    cut = head - keep
    if keep_bytes is not None:
        sizes = select(events.c.id, bytes_of(tx, events.c.data))
        cut = max(cut, beyond(tx, sizes.order_by(events.c.id.desc()), keep_bytes) or 0)
    if limit is not None:
        oldest = select(events.c.id).where(events.c.id <= cut).order_by(events.c.id).limit(limit)
        cut = max(tx.conn.scalars(oldest), default=0)
    gone = tx.conn.execute(delete(events).where(events.c.id <= cut)).rowcount
    if cut > horizon:
        put_state(tx, HORIZON, str(cut))
    return gone


def bytes_of(tx: Tx, written: ColumnElement[str]) -> ColumnElement[int]:
    """Make the expression for the size of a text [bytes], uncompressed."""
    return func.octet_length(written) if tx.postgres else func.length(cast(written, LargeBinary))


def beyond(tx: Tx, newest: Select[Any], budget: int) -> Any:
    """Find the newest row at which the sizes pass ``budget`` [bytes]; None if they never do.

    newest
        selects (key, size in bytes), newest first. Returns a key; never that of the first row.
    """
    total = 0
    with tx.conn.execute(newest, execution_options={"yield_per": 1000}) as rows:
        for number, (key, size) in enumerate(rows):
            total += size
            if total > budget and number:
                return key
    return None


def _named(item: Item) -> dict[str, Any]:
    return {
        "part_number": item.part_number,
        "id": item.uuid,
        "name": item.name,
        "description": item.description,
    }


def _about(tx: Tx, name: str, item: Item, data: Mapping[str, Any]) -> None:
    tx.emit(NewEvent(name, dumps(data), item.uuid, item.part_number))


logger = logging.getLogger("silo_server.events")

RING_EVENTS = 2048
RING_BYTES = 16 * 1024 * 1024
PAGE = 500


@dataclass(frozen=True, slots=True)
class Frame:
    """An event as it goes over the wire, with what filters look at."""

    mark: EventMark
    item_uuid: str | None
    part_number_key: str | None
    payload: bytes

    @property
    def id(self) -> int:
        return self.mark.id


@dataclass(frozen=True, slots=True)
class Batch:
    """What a listener gets next: frames, its new cursor, and whether it must re-read everything first."""

    frames: Sequence[Frame]
    cursor: EventMark
    reset: bool = False


def to_frame(event: LoggedEvent) -> Frame:
    """Write an event as a frame: ``id:``, ``event:``, ``data:`` (JSON, so no line break), an empty line."""
    mark = event.mark
    payload = f"id: {mark}\nevent: {event.name}\ndata: {event.data}\n\n".encode()
    return Frame(mark, event.item_uuid, event.part_number_key, payload)


class Hub:
    """The dispatcher of one process; lives on its event loop."""

    def __init__(self, db: Database) -> None:
        self._db = db
        self._ring: deque[Frame] = deque()
        self._ring_bytes = 0
        self._ring_start = 0  # the ring holds every event with an id above this
        self.head = EventMark(0)
        self.epoch = 0  # counts how often the log turned out to be another one
        self.listeners = 0
        self.closed = False
        self.beats = 0
        self._news = asyncio.Event()
        self._poke = asyncio.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._tasks: list[asyncio.Task[None]] = []
        self._listener: _PostgresListener | None = None

    async def start(self) -> None:
        """Start the dispatcher at the present end of the log."""
        self._loop = asyncio.get_running_loop()
        self.head = await asyncio.to_thread(self._read_head)
        self._ring_start = self.head.id
        self._db.on_events, self._db.on_access = self.poke, self.beat
        if not self._db.settings.is_sqlite:
            self._listener = _PostgresListener(self._db, self.poke, self.beat)
            self._listener.start()
        self._tasks = [asyncio.create_task(self._dispatch()), asyncio.create_task(self._beat())]

    async def stop(self) -> None:
        """End all streams and the dispatcher."""
        self.close()
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        if self._listener is not None:
            await asyncio.to_thread(self._listener.stop)

    def close(self) -> None:
        """End all streams; the server is about to stop."""
        self.closed = True
        self._wake()

    def poke(self) -> None:
        """Look for news in the log; any thread may call this."""
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._poke.set)

    async def wait(self) -> None:
        """Wait until there is news, a heartbeat is due, or the hub closes."""
        await self._news.wait()

    async def take(self, cursor: EventMark) -> Batch:
        """Read what comes after ``cursor``: from the ring if it goes back far enough, else from the log."""
        if cursor.id >= self.head.id:
            return Batch((), cursor)
        if cursor.id >= self._ring_start:
            return Batch(self._newer(cursor.id), self.head)
        return await asyncio.to_thread(self._read_log, cursor)

    def _newer(self, cursor: int) -> list[Frame]:
        # From the new end: a thousand listeners look here for one event each time.
        newer: list[Frame] = []
        for frame in reversed(self._ring):
            if frame.id <= cursor:
                break
            newer.append(frame)
        newer.reverse()
        return newer

    async def place(self, last: EventMark | None) -> tuple[EventMark, bool]:
        """Find (cursor to begin at, whether a ``reset`` is due) for a client that last saw ``last``."""
        # The log and not the ring says where "now" is: the ring may be a moment behind a commit.
        return await asyncio.to_thread(self._read_place, last)

    async def _dispatch(self) -> None:
        away = False
        while True:
            with suppress(TimeoutError):
                await asyncio.wait_for(self._poke.wait(), self._db.settings.poll_seconds)
            self._poke.clear()
            try:
                await self._read_news()
                away = False
            except SQLAlchemyError as error:
                # The database is away; the poll finds out when it is back, and nothing is lost meanwhile.
                if not away:
                    logger.warning("the event log cannot be read at the moment: %s", cause_of(error))
                away = True

    async def _read_news(self) -> None:
        while True:
            page = await asyncio.to_thread(self._read_page, self.head)
            if page is None:
                await self._begin_again()
                continue
            if not page:
                return
            for frame in page:
                self._ring.append(frame)
                self._ring_bytes += len(frame.payload)
            while len(self._ring) > RING_EVENTS or (self._ring_bytes > RING_BYTES and len(self._ring) > 1):
                gone = self._ring.popleft()
                self._ring_bytes -= len(gone.payload)
                self._ring_start = gone.id
            self.head = page[-1].mark
            self._wake()

    async def _begin_again(self) -> None:
        """Make all listeners read everything again.

        The log was trimmed beyond them, or the database was restored.
        """
        logger.warning("the event log is another one than before; every listener gets a reset")
        self.head = await asyncio.to_thread(self._read_head)
        self._ring.clear()
        self._ring_bytes, self._ring_start = 0, self.head.id
        self.epoch += 1
        self._wake()

    async def _beat(self) -> None:
        while True:
            await asyncio.sleep(self._db.settings.heartbeat_seconds)
            self._beat_now()

    def beat(self) -> None:
        """Send a heartbeat now, at which each stream checks if it may continue; any thread may call this."""
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._beat_now)

    def _beat_now(self) -> None:
        self.beats += 1
        self._wake()

    def _wake(self) -> None:
        # All who wait now are released; later ones wait for the next time.
        news, self._news = self._news, asyncio.Event()
        if self.closed:
            self._news.set()
        news.set()

    def _read_page(self, after: EventMark) -> list[Frame] | None:
        """Read the frames that come after ``after``; None if that is no place of this log."""
        with self._db.read() as tx:
            if not reaches(tx, after):
                return None
            return [to_frame(event) for event in read_after(tx, after.id, PAGE)]

    def _read_head(self) -> EventMark:
        with self._db.read() as tx:
            return head(tx)

    def _read_place(self, last: EventMark | None) -> tuple[EventMark, bool]:
        with self._db.read() as tx:
            if last is not None and reaches(tx, last):
                return mark_at(tx, last.id), False
            return head(tx), last is not None

    def _read_log(self, cursor: EventMark) -> Batch:
        with self._db.read() as tx:
            if not reaches(tx, cursor):
                return Batch((), head(tx), reset=True)
            frames = [to_frame(event) for event in read_after(tx, cursor.id, PAGE)]
            return Batch(frames, frames[-1].mark if frames else head(tx))


class _PostgresListener:
    """A thread that waits for NOTIFY on its own connection and comes back when that is lost."""

    def __init__(self, db: Database, heard: Callable[[], None], access: Callable[[], None]) -> None:
        self._db = db
        self._heard, self._access = heard, access
        self._away = False
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="silo-listen", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        self._stopping.set()
        self._thread.join(timeout=5)

    def _run(self) -> None:
        from psycopg import Error

        while not self._stopping.is_set():
            try:
                self._listen()
            except (Error, OSError) as error:
                if not self._away:
                    logger.warning("PostgreSQL cannot be listened to, trying again: %s", cause_of(error))
                self._away = True
                self._stopping.wait(1.0)

    def _listen(self) -> None:
        import psycopg

        from silo_server.db.engine import EVENT_CHANNEL

        url = self._db.engine.url.set(drivername="postgresql").render_as_string(hide_password=False)
        with psycopg.connect(url, autocommit=True) as connection:
            connection.execute(psycopg.sql.SQL("LISTEN {}").format(psycopg.sql.Identifier(EVENT_CHANNEL)))
            self._away = False
            self._heard()  # what happened before the LISTEN is in the log
            self._access()
            while not self._stopping.is_set():
                for notice in connection.notifies(timeout=0.5):
                    (self._access if notice.payload == "access" else self._heard)()
                    if self._stopping.is_set():
                        return


HEADERS = {
    "cache-control": "no-store",
    "x-accel-buffering": "no",  # nginx passes every event on at once
}
HEARTBEAT = b"event: heartbeat\ndata: {}\n\n"


class EventResponse(Response):
    """The stream. ``last``: what the client saw last, None = only what is new from now on.

    ``items`` (UUIDs or part numbers) lets only their events through, and those of no item.
    ``still_allowed`` is asked at the start and with every heartbeat: a stream must not outlive its token.
    """

    media_type = "text/event-stream"

    def __init__(
        self,
        hub: Hub,
        last: EventMark | None,
        items: Sequence[str] = (),
        still_allowed: Callable[[], bool] = lambda: True,
    ) -> None:
        super().__init__(headers=HEADERS)
        del self.headers["content-length"]
        self._hub = hub
        self._last = last
        self._still_allowed = still_allowed
        self._items = frozenset(item.casefold() for item in items)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": self.raw_headers})
        gone = asyncio.ensure_future(_disconnected(receive))
        stream = asyncio.ensure_future(self._run(send))
        self._hub.listeners += 1
        try:
            await asyncio.wait((gone, stream), return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._hub.listeners -= 1
            gone.cancel()
            stream.cancel()
            results = await asyncio.gather(gone, stream, return_exceptions=True)
        ended = results[1]
        if isinstance(ended, Exception) and not isinstance(ended, OSError):
            raise ended

    async def _run(self, send: Send) -> None:
        hub = self._hub
        # No beat yet: the credential may have been revoked since the request was let in, so look first.
        beats, epoch = -1, hub.epoch
        cursor, reset = await hub.place(self._last)
        # The first bytes show proxies and clients that the stream stands.
        await _send(send, _hello(cursor) + (_reset(cursor) if reset else b""))
        while not hub.closed:
            if hub.epoch != epoch:
                epoch, cursor = hub.epoch, hub.head
                await _send(send, _reset(cursor))
            batch = await hub.take(cursor)
            cursor = batch.cursor
            payload = self._payload(batch)
            if hub.beats != beats:
                payload = payload or HEARTBEAT * (beats >= 0)
                beats = hub.beats
                if not await asyncio.to_thread(self._still_allowed):
                    break
            if payload:
                await _send(send, payload)
            if cursor.id >= hub.head.id and (beats, epoch) == (hub.beats, hub.epoch) and not hub.closed:
                await hub.wait()
        await send({"type": "http.response.body", "body": b"", "more_body": False})

    def _passes(self, frame: Frame) -> bool:
        if not self._items:
            return True
        about = {frame.item_uuid, frame.part_number_key} - {None}
        return not about or bool(about & self._items)

    def _payload(self, batch: Batch) -> bytes:
        frames = b"".join(frame.payload for frame in batch.frames if self._passes(frame))
        return _reset(batch.cursor) + frames if batch.reset else frames


def _hello(cursor: EventMark) -> bytes:
    # With the id a listener that is cut off before its first event can ask for what it missed.
    return f": connected\nid: {cursor}\nretry: 2000\n\n".encode()


def _reset(cursor: EventMark) -> bytes:
    return f"id: {cursor}\nevent: reset\ndata: {{}}\n\n".encode()


async def _send(send: Send, payload: bytes) -> None:
    await send({"type": "http.response.body", "body": payload, "more_body": True})


async def _disconnected(receive: Receive) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass
