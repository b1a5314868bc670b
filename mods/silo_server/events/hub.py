# SPDX-License-Identifier: LGPL-2.1-or-later
"""The hub: one dispatcher per process, any number of listeners, no queue and no thread per listener.

The log in the database is the truth. The hub keeps the newest part of it in memory (the ring) as ready-made
frames and wakes all listeners when it grows. A listener is only a cursor, the id of the last event it was
given; it takes what is newer from the ring or, if it is too slow or was away, from the log. So a slow
client blocks no other, costs nothing and loses nothing; only one that is behind the log's horizon is sent
``reset`` and must read everything again.

News arrive by a call after a commit in this process, by PostgreSQL's NOTIFY from another, and at the latest
by the poll (``Settings.poll_seconds``).
"""

from __future__ import annotations

import asyncio
import logging
from collections import Counter, deque
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

from sqlalchemy.exc import SQLAlchemyError

from silo_server.db.database import Database
from silo_server.errors import cause_of
from silo_server.events.log import EventMark, LoggedEvent, head, mark_at, reaches, read_after
from silo_server.events.postgres import PostgresListener

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
        self.streams: Counter[tuple[int | None, str]] = Counter()  # of a user at an address
        self.closed = False
        self.beats = 0
        self._news = asyncio.Event()
        self._poke = asyncio.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._tasks: list[asyncio.Task[None]] = []
        self._listener: PostgresListener | None = None

    async def start(self) -> None:
        """Start the dispatcher at the present end of the log."""
        self._loop = asyncio.get_running_loop()
        self.head = await asyncio.to_thread(self._read_head)
        self._ring_start = self.head.id
        self._db.on_events, self._db.on_access = self.poke, self.beat
        if not self._db.settings.is_sqlite:
            self._listener = PostgresListener(self._db, self.poke, self.beat)
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
