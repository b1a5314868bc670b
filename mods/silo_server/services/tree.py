# SPDX-License-Identifier: LGPL-2.1-or-later
"""The whole tree below an item: expanded, flat, and the way up (where-used).

One recursive query brings every line below an item, each once however often its assembly is used; what is
multiplied is multiplied here. Only ``component`` lines are followed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from sqlalchemy import literal, select

from silo.bom.errors import CycleError
from silo_server.db.engine import Tx
from silo_server.db.tables import bom_lines, items
from silo_server.errors import TooLargeError
from silo_server.services.items import by_ids
from silo_server.services.lines import select_lines, to_line
from silo_server.values import Item, Line

MAX_DEPTH = 20


@dataclass(frozen=True, slots=True)
class Graph:
    """Everything below ``root``: the lines of every assembly in it, by the assembly's internal id."""

    root: Item
    lines: Mapping[int, Sequence[Line]]

    def components(self, item_id: int) -> list[Line]:
        """The lines that are followed."""
        return [line for line in self.lines.get(item_id, ()) if line.state.rel_type == "component"]


class Occurrence(NamedTuple):
    """A line somewhere in the expanded tree. ``depth`` 1 = direct child; ``total`` per one root."""

    line: Line
    parent_part_number: str
    depth: int
    total: float


@dataclass(frozen=True, slots=True)
class FlatRow:
    """A leaf part: how much of it one root needs in all. ``unreferenced`` where a line on the way is."""

    line: Line
    unit: str | None
    total: float


@dataclass(frozen=True, slots=True)
class Usage:
    """One use of an item: in which parent, how much, how many steps up (1 = direct)."""

    parent: Item
    quantity: float
    unit: str | None
    rel_type: str
    source: str
    depth: int


def load_graph(tx: Tx, root: Item) -> Graph:
    """All lines below ``root``, each once."""
    reach = select(literal(root.id, items.c.id.type).label("item_id")).cte("reach", recursive=True)
    reach = reach.union(select(bom_lines.c.child_id).join(reach, bom_lines.c.parent_id == reach.c.item_id))
    query = (
        select_lines()
        .where(bom_lines.c.parent_id.in_(select(reach.c.item_id)))
        .order_by(bom_lines.c.parent_id, bom_lines.c.position)
    )
    lines: dict[int, list[Line]] = {}
    for row in tx.conn.execute(query).all():
        lines.setdefault(row[1], []).append(to_line(row))
    return Graph(root, lines)


def expand(graph: Graph, depth: int, limit: int) -> list[Occurrence]:
    """The tree as rows, parents before their children. CycleError where it never ends, TooLargeError."""
    order_of(graph)  # finds a cycle before it is walked
    rows: list[Occurrence] = []
    graph_lines = graph.lines
    stack = [(graph.root.part_number, 1, 1.0, iter(graph_lines.get(graph.root.id, ())))]
    while stack:
        parent, level, factor, lines = stack[-1]
        for line in lines:
            state = line.state
            total = factor * state.quantity
            rows.append(Occurrence(line, parent, level, total))
            below = graph_lines.get(line.child_id)
            if below and level < depth and state.rel_type == "component":
                stack.append((line.child_part_number, level + 1, total, iter(below)))
                break
        else:
            stack.pop()
        if len(rows) > limit:
            raise TooLargeError(
                f"the expanded BOM of {graph.root.part_number} has more than {limit} lines; "
                "ask for less with depth="
            )
    return rows


def flatten(graph: Graph) -> list[FlatRow]:
    """The leaf parts with their total quantities, in the order the tree shows them first."""
    factors = {graph.root.id: 1.0}
    totals: dict[tuple[int, str | None], float] = {}
    shown: dict[tuple[int, str | None], Line] = {}
    for item_id in order_of(graph):
        for line in graph.components(item_id):
            amount = factors[item_id] * line.state.quantity
            if graph.components(line.child_id):
                factors[line.child_id] = factors.get(line.child_id, 0.0) + amount
            else:
                key = (line.child_id, line.state.unit)
                totals[key] = totals.get(key, 0.0) + amount
                shown.setdefault(key, line)
    return [FlatRow(line, key[1], totals[key]) for key, line in shown.items()]


def where_used(tx: Tx, item: Item, *, indirect: bool = False) -> list[Usage]:
    """The parents of an item; with ``indirect`` also theirs, the nearest first, each line once."""
    found: list[Usage] = []
    seen = {item.id}
    level, depth = [item.id], 1
    while level and depth <= MAX_DEPTH:
        rows = tx.conn.execute(
            select(bom_lines).where(bom_lines.c.child_id.in_(level)).order_by(bom_lines.c.parent_id)
        ).all()
        parents = by_ids(tx, {row.parent_id for row in rows})
        found.extend(
            Usage(parents[r.parent_id], r.quantity, r.unit, r.rel_type, r.source, depth) for r in rows
        )
        level = [parent_id for parent_id in parents if parent_id not in seen]
        seen.update(level)
        depth += 1
        if not indirect:
            break
    return sorted(found, key=lambda usage: (usage.depth, usage.parent.part_number))


def order_of(graph: Graph) -> list[int]:
    """The assemblies (internal ids), parents before their children; CycleError where there is a ring."""
    names = {line.child_id: line.child_part_number for below in graph.lines.values() for line in below}
    names[graph.root.id] = graph.root.part_number
    done: list[int] = []
    state: dict[int, bool] = {graph.root.id: False}  # False = being walked, True = done
    stack = [(graph.root.id, iter(graph.components(graph.root.id)))]
    while stack:
        item_id, lines = stack[-1]
        line = next(lines, None)
        if line is None:
            stack.pop()
            state[item_id] = True
            done.append(item_id)
            continue
        child = line.child_id
        if child not in graph.lines or state.get(child) is True:
            continue
        if state.get(child) is False:
            ring = [entry[0] for entry in stack]
            raise CycleError([names[i] for i in [*ring[ring.index(child) :], child]])
        state[child] = False
        stack.append((child, iter(graph.components(child))))
    return done[::-1]
