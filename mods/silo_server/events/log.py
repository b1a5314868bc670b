# SPDX-License-Identifier: LGPL-2.1-or-later
"""The durable event log: how it is read back, where a listener stands in it, how it is trimmed."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Select, delete, func, select

from silo_server.db.rows import newest_first
from silo_server.db.sizes import beyond, bytes_of
from silo_server.db.state import get_state, put_state
from silo_server.db.tables import events, items
from silo_server.db.transaction import Tx
from silo_server.fields import from_row

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
