# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where an item is used: the way up."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from decimal import Decimal

from sqlalchemy import ColumnElement, func, select

from silo_server.db.rows import one_of
from silo_server.db.tables import bom_lines, items
from silo_server.db.transaction import Tx
from silo_server.services.items import by_ids
from silo_server.services.product.graph import MAX_DEPTH
from silo_server.values import Item


@dataclass(frozen=True, slots=True)
class Usage:
    """One use of an item: in which parent, how much, how many steps up (1 = direct)."""

    parent: Item
    quantity: Decimal
    unit: str | None
    rel_type: str
    source: str
    depth: int


def where_used(
    tx: Tx, item: Item, *, indirect: bool = False, limit: int = 1000, offset: int = 0
) -> tuple[list[Usage], int]:
    """Find a page of an item's parents, and how many there are in all.

    With ``indirect`` also their parents, the nearest first, each line once; by part number in each level.
    """
    usages: list[Usage] = []
    total = 0
    for depth, level in enumerate(_levels_above(tx, item, MAX_DEPTH if indirect else 1), start=1):
        of_level = one_of(tx, bom_lines.c.child_id, level)
        skip, room = max(0, offset - total), limit - len(usages)
        total += tx.conn.scalar(select(func.count()).select_from(bom_lines).where(of_level)) or 0
        if room > 0 and offset < total:
            usages.extend(_uses(tx, of_level, depth, room, skip))
    return usages, total


def use_counts(tx: Tx, item_ids: Collection[int]) -> dict[int, int]:
    """Count the BOM lines that each item is on; items on no line are absent."""
    query = select(bom_lines.c.child_id, func.count()).where(one_of(tx, bom_lines.c.child_id, item_ids))
    return {row[0]: row[1] for row in tx.conn.execute(query.group_by(bom_lines.c.child_id))}


def _levels_above(tx: Tx, item: Item, levels: int) -> Iterator[list[int]]:
    """Yield the item, then what uses it, then what uses that; each item in its nearest level only."""
    seen = {item.id}
    level = [item.id]
    for depth in range(1, levels + 1):
        yield level
        if depth == levels:
            return
        query = select(bom_lines.c.parent_id).where(one_of(tx, bom_lines.c.child_id, level)).distinct()
        level = [parent_id for parent_id in tx.conn.scalars(query) if parent_id not in seen]
        seen.update(level)
        if not level:
            return


def _uses(tx: Tx, of_level: ColumnElement[bool], depth: int, limit: int, offset: int) -> list[Usage]:
    # Found first, then sorted: else PostgreSQL walks all items in their order and looks for uses of each.
    lines = select(bom_lines).where(of_level).cte("lines").prefix_with("MATERIALIZED", dialect="postgresql")
    rows = tx.conn.execute(
        select(lines)
        .join(items, items.c.id == lines.c.parent_id)
        .order_by(items.c.part_number_key, lines.c.id)
        .limit(limit)
        .offset(offset)
    ).all()
    parents = by_ids(tx, {row.parent_id for row in rows})
    return [Usage(parents[r.parent_id], r.quantity, r.unit, r.rel_type, r.source, depth) for r in rows]
