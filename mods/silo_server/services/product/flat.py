# SPDX-License-Identifier: LGPL-2.1-or-later
"""The flat list of an item: each leaf part once, with all that one piece of the item needs of it."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import NamedTuple

from silo.bom.quantities import plain
from silo_server.services.product.amounts import Exact, checked_total, exact_amount
from silo_server.services.product.graph import Graph, order_of
from silo_server.values import Line


class FlatRow(NamedTuple):
    """A leaf part: how much of it one root needs in all.

    gone
        how much of it comes from lines, on any level, that CAD no longer has.
    disputed
        true if a quantity on the way to it is in conflict.
    """

    line: Line
    unit: str | None
    total: Exact
    gone: Exact = 0
    disputed: bool = False

    def doubts(self, pieces: int = 1) -> list[str]:
        """List what a person still has to decide about the part, in words."""
        doubt_texts = ["unreferenced"] if self.gone else []
        if 0 < self.gone < self.total:
            doubt_texts = [f"{plain(self.gone * pieces)} of {plain(self.total * pieces)} unreferenced"]
        return [*doubt_texts, "a quantity in conflict"] if self.disputed else doubt_texts


def leaves_in(graph: Graph, rows: Sequence[FlatRow], closed: Collection[int] = ()) -> Sequence[FlatRow]:
    """Replace the assemblies among rows of a flat list by their leaf parts; ``closed`` as :func:`flatten`."""
    if {item_id for item_id in graph.lines if graph.components(item_id)}.isdisjoint(
        row.line.child_id for row in rows
    ):
        return rows
    lines = [
        row.line
        if row.total == row.line.state.quantity
        else row.line._replace(state=replace(row.line.state, quantity=float(row.total)))
        for row in rows
    ]
    return flatten(Graph(graph.root, {**graph.lines, graph.root.id: lines}), closed)


def flatten(graph: Graph, closed: Collection[int] = ()) -> list[FlatRow]:
    """Add up the quantities of the leaf parts; their order is that in which the tree first shows them.

    closed
        assemblies (internal ids) that count as parts.
    """
    nothing: tuple[Exact, Exact, bool] = (0, 0, False)
    # How much of each assembly, how much of it CAD no longer has, whether a quantity above is in conflict.
    needs: dict[int, tuple[Exact, Exact, bool]] = {graph.root.id: (1, 0, False)}
    totals: dict[tuple[int, str | None], tuple[Exact, Exact, bool]] = {}
    shown: dict[tuple[int, str | None], Line] = {}
    components = {item_id: graph.components(item_id) for item_id in order_of(graph)}
    assemblies = {item_id for item_id, lines in components.items() if lines}.difference(closed)
    for item_id, lines in components.items():
        if item_id not in needs:
            continue  # below a closed one only
        factor, lost, disputed = needs[item_id]
        conflict = graph.conflicts.get(item_id, ())
        for line in lines:
            child, state = line.child_id, line.state
            quantity = exact_amount(state.quantity)
            amount = factor * quantity
            gone = amount if state.unreferenced_since else lost * quantity
            key = child, state.unit
            is_leaf = child not in assemblies
            before = totals.get(key, nothing) if is_leaf else needs.get(child, nothing)
            total = checked_total(before[0] + amount, line)  # the other amounts are parts of it
            sums = total, before[1] + gone, before[2] or disputed or child in conflict
            if is_leaf:
                totals[key] = sums
                shown.setdefault(key, line)
            else:
                needs[child] = sums
    return [FlatRow(line, key[1], *totals[key]) for key, line in shown.items()]
