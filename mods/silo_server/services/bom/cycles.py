# SPDX-License-Identifier: LGPL-2.1-or-later
"""Cycles: an assembly must not contain itself, however far down."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from sqlalchemy import select

from silo.bom.errors import CycleError
from silo_server.db.rows import one_of
from silo_server.db.tables import bom_lines, items
from silo_server.db.transaction import STRUCTURE_LOCK, Tx
from silo_server.values import Item


def check_no_cycle(tx: Tx, parent: Item, child_ids: Collection[int]) -> None:
    """Raise CycleError if one of the children to be added contains the parent, or is it.

    The caller's edges are added under the structure lock, so that two requests cannot close a ring together.
    """
    if not child_ids:
        return
    tx.lock(STRUCTURE_LOCK)
    for ring in find_rings(tx, parent, child_ids).values():
        raise CycleError(ring)


def find_rings(tx: Tx, parent: Item, child_ids: Collection[int]) -> dict[int, list[str]]:
    """Find the children that contain the parent, or are it, each with the part numbers of the ring.

    The search goes up from the parent: it has few ancestors, but may have thousands of children.
    """
    wanted = set(child_ids)
    if not wanted:
        return {}
    edges = _edges_above(tx, parent.id)
    above: dict[int, int] = {parent.id: parent.id}
    queue = [parent.id]
    ring: list[int] = []
    while queue and len(ring) < len(wanted):
        node = queue.pop(0)
        if node in wanted:
            ring.append(node)
        for ancestor in edges.get(node, ()):
            if ancestor not in above:
                above[ancestor] = node
                queue.append(ancestor)
    return {child_id: _ring(tx, parent.id, child_id, above) for child_id in ring}


def _edges_above(tx: Tx, item_id: int) -> dict[int, list[int]]:
    reach = select(bom_lines.c.parent_id, bom_lines.c.child_id).where(bom_lines.c.child_id == item_id)
    cte = reach.cte("above", recursive=True)
    cte = cte.union(
        select(bom_lines.c.parent_id, bom_lines.c.child_id).join(cte, bom_lines.c.child_id == cte.c.parent_id)
    )
    edges: dict[int, list[int]] = {}
    for parent_id, child_id in tx.conn.execute(select(cte.c.parent_id, cte.c.child_id)):
        edges.setdefault(child_id, []).append(parent_id)
    return edges


def _ring(tx: Tx, parent_id: int, child_id: int, above: Mapping[int, int]) -> list[str]:
    # `above` leads from an ancestor down to the parent: parent -> child (the new edge) -> ... -> parent.
    ids = [parent_id, child_id]
    while ids[-1] != parent_id:
        ids.append(above[ids[-1]])
    names = dict(
        tx.conn.execute(select(items.c.id, items.c.part_number).where(one_of(tx, items.c.id, ids))).all()
    )
    return [names[i] for i in ids]
