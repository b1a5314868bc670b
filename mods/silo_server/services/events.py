# SPDX-License-Identifier: LGPL-2.1-or-later
"""The durable event log: what is announced, how it is read back, how it is trimmed.

Names: the spec's ``bom_merge``; the real Silo's ``item.created``, ``item.updated``, ``item.deleted``,
``revision.created``, ``server.state``; ours ``bom.updated`` for changes of a BOM that are no merge.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, LargeBinary, Select, cast, delete, func, select

from silo_server.clock import spec_time
from silo_server.db.bulk import newest_first
from silo_server.db.engine import Tx, get_state, mode_of, put_state
from silo_server.db.tables import events, items
from silo_server.json_values import dumps
from silo_server.services.access import audit
from silo_server.values import Item, NewEvent, Revision, from_row

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
    def mark(self) -> Mark:
        """What a listener that was given this event comes back with."""
        return Mark(self.id, f"{zlib.crc32(f'{self.name} {self.at} {self.data}'.encode()):08x}")


@dataclass(frozen=True, slots=True)
class Mark:
    """A place in the log: an event's number, and a tag of what it said; "" where there is no event.

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


def item_updated(tx: Tx, item: Item) -> None:
    _about(tx, "item.updated", item, {**_named(item), "revision": item.current_revision})


def item_deleted(tx: Tx, item: Item) -> None:
    _about(tx, "item.deleted", item, {"part_number": item.part_number, "id": item.uuid})


def revision_created(tx: Tx, item: Item, revision: Revision) -> None:
    data = {
        "part_number": item.part_number,
        "id": item.uuid,
        "revision_number": revision.revision_number,
        "comment": revision.comment,
        "file_name": revision.file_name,
        "user": revision.created_by,
    }
    _about(tx, "revision.created", item, data)


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


def set_mode(tx: Tx, mode: str) -> str:
    """Take changes (``normal``), or none (``read-only``); returns the mode that the server is in now."""
    audit.note(tx, "mode.set", mode, f"{mode_of(tx)} → {mode}")
    put_state(tx, "mode", mode)
    tx.emit(NewEvent("server.state", dumps({"mode": mode_of(tx)})))
    return mode_of(tx)


def read_after(tx: Tx, after: int, limit: int = 500) -> list[LoggedEvent]:
    """The next events after id ``after``, oldest first."""
    rows = tx.conn.execute(select(events).where(events.c.id > after).order_by(events.c.id).limit(limit)).all()
    return [from_row(LoggedEvent, row) for row in rows]


@dataclass(frozen=True, slots=True)
class EventQuery:
    """Which events; "" and none: all. ``part_number``: of this item, under whatever number it had."""

    names: Sequence[str] = ()
    username: str = ""
    part_number: str = ""


def newest(
    tx: Tx,
    asked: EventQuery,
    limit: int,
    before: int | None = None,
    after: int | None = None,
) -> list[LoggedEvent]:
    """The newest events that were asked for, newest first; ``before`` and ``after`` are ids to page from."""
    query = select(events)
    if asked.names:
        query = query.where(events.c.name.in_(asked.names))
    if asked.username:
        query = query.where(events.c.username == asked.username)
    if asked.part_number:
        key = asked.part_number.casefold()
        item = select(items.c.uuid).where(items.c.part_number_key == key).scalar_subquery()
        query = query.where((events.c.part_number_key == key) | (events.c.item_uuid == item))
    rows = newest_first(tx, query, events.c.id, limit, before, after)
    return [from_row(LoggedEvent, row) for row in rows]


def usernames(tx: Tx) -> list[str]:
    """Everybody of whom there are events."""
    found = tx.conn.scalars(select(events.c.username).distinct().where(events.c.username.is_not(None)))
    return sorted(found, key=str.casefold)


def horizon_of(tx: Tx) -> int:
    """The newest id that was trimmed away."""
    return int(get_state(tx, HORIZON) or 0)


def bounds(tx: Tx) -> tuple[int, int]:
    """(horizon, head): the newest id that was trimmed away, and the newest id there is."""
    horizon = horizon_of(tx)
    head = tx.conn.scalar(select(func.max(events.c.id))) or 0
    return horizon, max(head, horizon)


def head(tx: Tx) -> Mark:
    """The newest place of the log."""
    return mark_at(tx, bounds(tx)[1])


def reaches(tx: Tx, mark: Mark) -> bool:
    """True where the log goes back to ``mark`` without a gap: what came after it can be given, all of it.

    False for one that was trimmed away, that is of the future, or whose event is another one by now.
    """
    horizon, newest_id = bounds(tx)
    if not horizon <= mark.id <= newest_id:
        return False
    return not mark.tag or mark.id == horizon or mark_at(tx, mark.id) == mark


def mark_at(tx: Tx, event_id: int) -> Mark:
    """The mark of the event with this id; without a tag where there is none, or no more."""
    row = tx.conn.execute(select(events).where(events.c.id == event_id)).one_or_none()
    return from_row(LoggedEvent, row).mark if row is not None else Mark(event_id)


def trim(tx: Tx, keep: int, keep_bytes: int | None = None, limit: int | None = None) -> int:
    """Forget all but the newest ``keep`` events, and of those all beyond ``keep_bytes`` of data.

    At most ``limit`` at once, the oldest first. Returns how many went. The horizon says up to where.
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
    """How many bytes a text takes, uncompressed."""
    return func.octet_length(written) if tx.postgres else func.length(cast(written, LargeBinary))


def beyond(tx: Tx, newest: Select[Any], budget: int) -> Any:
    """The key of the newest row with which the sizes pass ``budget``; None where they never do.

    newest
        selects (key, size in bytes), newest first. One row is always kept.
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
