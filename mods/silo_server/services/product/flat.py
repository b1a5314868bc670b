# SPDX-License-Identifier: LGPL-2.1-or-later
"""The flat list of an item: each leaf part once, with all that one piece of the item needs of it.

Totals are in the unit of the part: 0.5 m and 500 mm are one row of 1 m. A line whose unit does not convert
adds nothing; its part, or each part below it, is marked.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import NamedTuple

from silo.bom.message import message
from silo.bom.quantities import plain
from silo_server.services.product.amounts import UNIT_OPEN, Exact, amount_of, checked_total, product
from silo_server.services.product.graph import Graph, order_of
from silo_server.values import Line


class FlatRow(NamedTuple):
    """A leaf part: how much of it one root needs in all, in the part's own unit.

    gone
        how much of it comes from lines, on any level, that CAD no longer has.
    disputed
        true if a quantity on the way to it is in conflict.
    unit_open
        true if the unit of a line on the way to it does not convert: the total lacks what that line holds.
    """

    line: Line
    total: Exact
    gone: Exact = 0
    disputed: bool = False
    unit_open: bool = False

    @property
    def unit(self) -> str | None:
        """Return the unit of the part; None for pieces that need no word."""
        return self.line.child_unit

    def doubts(self, pieces: int = 1) -> list[str]:
        """List what a reviewer still has to decide about the part, in words."""
        doubt_texts: list[str] = [message("unreferenced")] if self.gone else []
        if 0 < self.gone < self.total:
            doubt_texts = [
                message(
                    "{gone} of {total} unreferenced",
                    gone=plain(self.gone * pieces),
                    total=plain(self.total * pieces),
                )
            ]
        if self.disputed:
            doubt_texts.append(message("a quantity in conflict"))
        return [*doubt_texts, UNIT_OPEN] if self.unit_open else doubt_texts


class _Need(NamedTuple):
    """How much of an item one root needs, how much of that CAD no longer has, and what is in doubt."""

    amount: Exact = 0
    gone: Exact = 0
    disputed: bool = False
    unit_open: bool = False


def leaves_in(graph: Graph, rows: Sequence[FlatRow], closed: Collection[int] = ()) -> Sequence[FlatRow]:
    """Replace the assemblies among rows of a flat list by their leaf parts; ``closed`` as :func:`flatten`."""
    if {item_id for item_id in graph.lines if graph.components(item_id)}.isdisjoint(
        row.line.child_id for row in rows
    ):
        return rows
    return _added_up(graph, closed, rows)


def flatten(graph: Graph, closed: Collection[int] = ()) -> list[FlatRow]:
    """Add up the quantities of the leaf parts; their order is that in which the tree first shows them.

    closed
        assemblies (internal ids) that count as parts.
    """
    return _added_up(graph, closed)


def _added_up(graph: Graph, closed: Collection[int], rows: Sequence[FlatRow] | None = None) -> list[FlatRow]:
    """Add up the leaf parts of the root, or of these ``rows`` in the place of its lines."""
    components = {item_id: graph.components(item_id) for item_id in order_of(graph)}
    assemblies = {item_id for item_id, lines in components.items() if lines}.difference(closed)
    needs: dict[int, _Need] = {}  # of assemblies
    totals: dict[int, _Need] = {}  # of leaf parts
    shown: dict[int, Line] = {}

    def add(line: Line, more: _Need) -> None:
        into = needs if line.child_id in assemblies else totals
        before = into.get(line.child_id, _Need())
        into[line.child_id] = _Need(
            checked_total(before.amount + more.amount, line),  # the other amounts are parts of it
            before.gone + more.gone,
            before.disputed or more.disputed,
            before.unit_open or more.unit_open,
        )
        if into is totals:
            shown.setdefault(line.child_id, line)

    if rows is None:
        needs[graph.root.id] = _Need(1)
    for row in rows or ():
        add(row.line, _Need(row.total, row.gone, row.disputed, row.unit_open))
    for item_id, lines in components.items():
        if item_id not in needs:
            continue  # below a closed one only
        need, conflict = needs[item_id], graph.conflicts.get(item_id, ())
        for line in lines:
            disputed, amount = need.disputed or line.child_id in conflict, amount_of(line)
            if amount is None:
                add(line, _Need(0, 0, disputed, unit_open=True))
                continue
            whole = product(need.amount, amount)
            gone = whole if line.state.unreferenced_since else product(need.gone, amount)
            add(line, _Need(whole, gone, disputed, need.unit_open))
    return [FlatRow(line, *totals[child]) for child, line in shown.items()]
