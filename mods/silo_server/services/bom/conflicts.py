# SPDX-License-Identifier: LGPL-2.1-or-later
"""The open conflicts of BOMs: CAD's quantity is another than that of a line that a user owns."""

from __future__ import annotations

from collections.abc import Collection
from functools import lru_cache

from sqlalchemy import select

from silo.bom.quantities import says_the_same
from silo_server.db.rows import one_of
from silo_server.db.tables import bom_conflicts, bom_lines
from silo_server.db.transaction import Tx

# Child (internal id) → what CAD says of its line in conflict, and since when.
Told = dict[int, tuple[float, str]]

# Thousands of conflicts are of a few quantities.
_says_the_same = lru_cache(maxsize=4096)(says_the_same)


def conflicts_in(tx: Tx, parent_ids: Collection[int] | None = None) -> dict[int, Told]:
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
    )
    query = query.outerjoin_from(bom_conflicts, bom_lines, whose).where(~collection.accepted)
    if parent_ids is not None:
        query = query.where(one_of(tx, collection.parent_id, parent_ids))
    conflicts: dict[int, Told] = {}
    for parent_id, child_id, cad_quantity, since, quantity, unit in tx.conn.execute(query):
        if quantity is not None and not _says_the_same(cad_quantity, quantity, unit):
            conflicts.setdefault(parent_id, {})[child_id] = (cad_quantity, since)
    return conflicts
