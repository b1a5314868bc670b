# SPDX-License-Identifier: LGPL-2.1-or-later
"""Changing an item whose lines have no unit of their own: they are in the item's, and keep what they say.

If a hose is counted in pieces and becomes one that is sold by the metre, a line of 3 stays 3 pieces, which is
a question (*unit?*) until a user answers it. Without this the line would be 3 m, and cost so.
"""

from __future__ import annotations

from dataclasses import replace

from sqlalchemy import select, update

from silo.bom.message import message
from silo.bom.units import Unit, unit_of
from silo_server.db.tables import bom_lines, items, orders
from silo_server.db.transaction import Tx
from silo_server.services.bom.change import ChangeNote, apply_changes, locked_parent
from silo_server.services.bom.line_record import ChangeKind, LineRecord
from silo_server.services.bom.lines import lines_of
from silo_server.services.items import ItemChange, change_item, get_item
from silo_server.values import Item


def change_item_and_lines(tx: Tx, part_number: str, change: ItemChange, expected: int | None = None) -> Item:
    """Change an item as :func:`silo_server.services.items.change_item` does; its lines keep their meaning."""
    before = get_item(tx, part_number)
    after = change_item(tx, part_number, change, expected)
    old, new = unit_of(before.texts.get("unit")), unit_of(after.texts.get("unit"))
    if old != new:
        _name_unit(tx, after, old)
    return after


def _name_unit(tx: Tx, item: Item, unit: Unit) -> None:
    """Write the unit on each line and order of an item that has none; CAD's lines are in pieces anyway."""
    row = bom_lines.c
    theirs = (row.child_id == item.id) & row.unit.is_(None) & (row.source == "manual")
    query = select(items.c.part_number).where(items.c.id.in_(select(row.parent_id).where(theirs)))
    for number in tx.conn.scalars(query.order_by(items.c.id)).all():
        parent = locked_parent(tx, number)
        records = [
            LineRecord(
                line.id, line.child_id, line.state, replace(line.state, unit=unit.symbol), line.position
            )
            for line in lines_of(tx, parent)
            if line.child_id == item.id and line.state.unit is None and line.state.source == "manual"
        ]
        text = message(
            "the unit of {part_number} changed: its line stays in {unit}",
            part_number=item.part_number,
            unit=unit.symbol,
        )
        apply_changes(tx, parent, records, ChangeNote(kind=ChangeKind.EDIT, summary=text))
    unsaid = (orders.c.item_id == item.id) & orders.c.unit.is_(None)
    tx.conn.execute(update(orders).where(unsaid).values(unit=unit.symbol))
