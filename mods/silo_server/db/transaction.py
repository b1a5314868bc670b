# SPDX-License-Identifier: LGPL-2.1-or-later
"""A transaction, as every service function gets it, and the locks that it may take.

Writers of one BOM queue on the parent's row. On PostgreSQL two advisory locks keep the rest in order:
:data:`STRUCTURE_LOCK` while edges are added (so that two merges cannot close a cycle together),
:data:`EVENT_LOCK` from the first event to the commit (so that event ids become visible in their order, which
replay by id relies on). They are always taken in that order. SQLite has one writer at a time and needs none.
"""

from __future__ import annotations

import hashlib
from collections import deque
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from typing import Any

from sqlalchemy import Connection, func, select

from silo_server.actors import Actor
from silo_server.settings import Settings
from silo_server.times import Clock, stamp, utc_now
from silo_server.values import NewEvent

STRUCTURE_LOCK = 0x51_10_0001
EVENT_LOCK = 0x51_10_0002
MIGRATION_LOCK = 0x51_10_0003
LOGIN_LOCK = 0x51_10_0004
ADMIN_LOCK = 0x51_10_0005
EVENT_CHANNEL = "silo_events"


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
    # Where a read leaves the summaries that it made (services.product.summary_make); a change leaves none.
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
