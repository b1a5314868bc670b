# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is open in one BOM for a reviewer: lines that CAD no longer has, and quantities in conflict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from silo_server.db.transaction import Tx
from silo_server.services.bom.conflicts import Conflict, open_conflicts
from silo_server.services.bom.history import Change, last_merge
from silo_server.services.bom.line_state import mark_of
from silo_server.services.bom.lines import lines_of
from silo_server.services.items import get_item
from silo_server.services.product.amounts import unit_is_open
from silo_server.values import Item, Line


@dataclass(frozen=True, slots=True)
class Review:
    """What is open on a BOM, and all its lines.

    units
        lines in a unit of another kind than their part's.
    """

    parent: Item
    lines: Sequence[Line]
    unreferenced: Sequence[Line]
    conflicts: Sequence[Conflict]
    last_merge: Change | None
    units: Sequence[Line] = ()


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
        [line for line in lines if unit_is_open(line)],
    )


def marks_of(lines: Sequence[Line], conflicts: Mapping[str, Conflict]) -> dict[str, str]:
    """Make the mark of each line as a page shows it: its state, and CAD's quantity if they differ."""
    quantities = {line_id: conflict.cad_quantity for line_id, conflict in conflicts.items()}
    return {line.id: mark_of(line.state, quantities.get(line.id)) for line in lines}
