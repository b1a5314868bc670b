# SPDX-License-Identifier: LGPL-2.1-or-later
"""The open conflicts of BOMs: CAD's quantity is another than that of a line that a user owns."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from functools import lru_cache
from typing import NamedTuple

from sqlalchemy import select

from silo.bom.units import says_the_same
from silo_server.db.rows import one_of
from silo_server.db.tables import bom_conflicts, bom_lines, items
from silo_server.db.transaction import Tx
from silo_server.values import Item, Line


class CadQuantity(NamedTuple):
    """What CAD says of a line in conflict (0: not in CAD), and since when."""

    quantity: Decimal
    since: str


# Child (internal id) → CAD's quantity of its line in conflict.
CadQuantities = dict[int, CadQuantity]

# Thousands of conflicts are of a few quantities.
_says_the_same = lru_cache(maxsize=4096)(says_the_same)


def conflicts_in(tx: Tx, parent_ids: Collection[int] | None = None) -> dict[int, CadQuantities]:
    """Find the conflicts of the last merges that neither a decision nor an edit has settled since.

    parent_ids
        of these BOMs only; None: of all.
    """
    collection, line = bom_conflicts.c, bom_lines.c
    # An outer join begins with the few that are asked about: else SQLite reads all lines, for each page.
    theirs = (line.parent_id == collection.parent_id) & (line.child_id == collection.child_id)
    whose = theirs & (line.rel_type == "component") & (line.source == "manual")
    query = select(
        collection.parent_id,
        collection.child_id,
        collection.cad_quantity,
        collection.since,
        line.quantity,
        line.unit,
        items.c.unit,
    )
    query = query.outerjoin_from(bom_conflicts, bom_lines, whose)
    query = query.outerjoin(items, items.c.id == collection.child_id).where(~collection.accepted)
    if parent_ids is not None:
        query = query.where(one_of(tx, collection.parent_id, parent_ids))
    conflicts: dict[int, CadQuantities] = {}
    for parent_id, child_id, cad_quantity, since, quantity, unit, of_item in tx.conn.execute(query):
        if quantity is not None and not _says_the_same(cad_quantity, quantity, unit, of_item):
            conflicts.setdefault(parent_id, {})[child_id] = CadQuantity(cad_quantity, since)
    return conflicts


def cad_quantity_of(line: Line, conflicts: Mapping[int, CadQuantity]) -> CadQuantity | None:
    """Return what CAD says of a line, from the conflicts of its BOM; None if the line is not in conflict."""
    return conflicts.get(line.child_id) if line.state.rel_type == "component" else None


@dataclass(frozen=True, slots=True)
class Conflict:
    """CAD and a line that a user owns differ. ``cad_quantity`` 0: the assembly no longer has it."""

    line: Line
    cad_quantity: Decimal
    since: str


def open_conflicts(tx: Tx, parent: Item, lines: Sequence[Line]) -> list[Conflict]:
    """Find the open conflicts of one BOM, in the order of its lines."""
    conflicts = conflicts_in(tx, [parent.id]).get(parent.id, {})
    said = ((line, cad_quantity_of(line, conflicts)) for line in lines)
    return [Conflict(line, *cad_quantity) for line, cad_quantity in said if cad_quantity is not None]


def last_cad_quantities(tx: Tx, parent_ids: Collection[int]) -> dict[int, dict[int, Decimal]]:
    """Read the quantities that the last merge gave for lines that users own; 0: not in the assembly.

    Parent → child → quantity, by internal ids.
    """
    rows = tx.conn.execute(
        select(bom_conflicts.c.parent_id, bom_conflicts.c.child_id, bom_conflicts.c.cad_quantity).where(
            one_of(tx, bom_conflicts.c.parent_id, parent_ids)
        )
    )
    quantities: dict[int, dict[int, Decimal]] = {}
    for row in rows:
        quantities.setdefault(row.parent_id, {})[row.child_id] = row.cad_quantity
    return quantities
