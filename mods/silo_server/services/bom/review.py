# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is open in one BOM for a reviewer: lines that CAD no longer has, and quantities in conflict."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy import select

from silo_server.db.rows import one_of
from silo_server.db.tables import (
    bom_conflicts,
)
from silo_server.db.transaction import Tx
from silo_server.services.bom.conflicts import conflicts_in
from silo_server.services.bom.history import Change, last_merge
from silo_server.services.bom.line_state import mark_of
from silo_server.services.bom.lines import lines_of
from silo_server.services.items import get_item
from silo_server.services.product.graph import Graph
from silo_server.values import Item, Line


@dataclass(frozen=True, slots=True)
class Conflict:
    """CAD and a person's line differ. ``cad_quantity`` 0: the assembly no longer has it."""

    line: Line
    cad_quantity: float
    since: str


@dataclass(frozen=True, slots=True)
class Review:
    """What is open on a BOM, and all its lines."""

    parent: Item
    lines: Sequence[Line]
    unreferenced: Sequence[Line]
    conflicts: Sequence[Conflict]
    last_merge: Change | None


def review(tx: Tx, part_number: str) -> Review:
    """Find the open questions of an item's BOM."""
    parent = get_item(tx, part_number)
    lines = lines_of(tx, parent)
    return Review(
        parent,
        lines,
        [line for line in lines if line.state.unreferenced_since],
        open_conflicts(tx, parent, lines),
        last_merge(tx, parent),
    )


def open_conflicts(tx: Tx, parent: Item, lines: Sequence[Line]) -> list[Conflict]:
    """Find the open conflicts of one BOM, in the order of its lines."""
    graph = Graph(parent, {parent.id: lines}, conflicts_in(tx, [parent.id]))
    conflict = graph.conflicts.get(parent.id, {})
    return [Conflict(line, *conflict[line.child_id]) for line in lines if graph.told(line) is not None]


def told_quantities(tx: Tx, parent_ids: Collection[int]) -> dict[int, dict[int, float]]:
    """Read the quantities that the last merge gave for people's lines; 0: not in the assembly.

    Parent → child → quantity, by internal ids.
    """
    rows = tx.conn.execute(
        select(bom_conflicts.c.parent_id, bom_conflicts.c.child_id, bom_conflicts.c.cad_quantity).where(
            one_of(tx, bom_conflicts.c.parent_id, parent_ids)
        )
    )
    quantities: dict[int, dict[int, float]] = {}
    for row in rows:
        quantities.setdefault(row.parent_id, {})[row.child_id] = row.cad_quantity
    return quantities


def marks_of(lines: Sequence[Line], conflicts: Mapping[str, Conflict]) -> dict[str, str]:
    """Make the mark of each line as a page shows it: its state, and CAD's quantity if they differ."""
    quantities = {line_id: conflict.cad_quantity for line_id, conflict in conflicts.items()}
    return {line.id: mark_of(line.state, quantities.get(line.id)) for line in lines}
