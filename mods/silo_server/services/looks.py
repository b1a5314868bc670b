# SPDX-License-Identifier: LGPL-2.1-or-later
"""When a user last looked at a product, so that a page can say what changed since.

No page waits until its look is written.
"""

from __future__ import annotations

from collections.abc import Iterable
from datetime import datetime, timedelta
from typing import Any

from sqlalchemy import ColumnElement, delete, or_, select

from silo_server.db.database import Database
from silo_server.db.rows import insert_rows
from silo_server.db.tables import product_looks
from silo_server.db.transaction import Tx
from silo_server.values import Item

SAME_LOOK = timedelta(hours=1)


def last_look(tx: Tx, user_id: int, item: Item) -> str | None:
    """Find when this person last looked at the product before now; looks within one hour count as one."""
    row = tx.conn.execute(select(product_looks).where(_look_of([(user_id, item.id)]))).one_or_none()
    return _look_before(row, tx.stamp)


def keep_looks(db: Database) -> None:
    """Write down who looked at what, and when; no page waits for this."""
    looks = dict(db.looks)
    if not looks:
        return
    with db.write(even_when_read_only=True) as tx:
        ours = _look_of(looks)
        before = {
            (row.user_id, row.item_id): row for row in tx.conn.execute(select(product_looks).where(ours))
        }
        tx.conn.execute(delete(product_looks).where(ours))
        rows = [
            {"user_id": user, "item_id": item, "at": at, "since": _look_before(before.get((user, item)), at)}
            for (user, item), at in looks.items()
        ]
        insert_rows(tx, product_looks, rows)
    for who, at in looks.items():
        if db.looks.get(who) == at:
            del db.looks[who]


def _look_of(whose: Iterable[tuple[int, int]]) -> ColumnElement[bool]:
    row = product_looks.c
    return or_(*((row.user_id == user) & (row.item_id == item) for user, item in whose))


def _look_before(row: Any, now: str) -> str | None:
    if row is None:
        return None
    is_another = datetime.fromisoformat(now) - datetime.fromisoformat(row.at) > SAME_LOOK
    return str(row.at) if is_another else row.since
