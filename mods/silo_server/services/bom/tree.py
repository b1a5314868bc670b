# SPDX-License-Identifier: LGPL-2.1-or-later
"""The whole tree below an item: expanded, flat, and the way up (where-used).

One recursive query brings every line below an item, each once however often its assembly is used; what is
multiplied is multiplied here. Only ``component`` lines are followed.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import NamedTuple

from sqlalchemy import ColumnElement, Select, func, literal, select

from silo.bom.errors import ConflictError, CycleError
from silo.bom.numbers import as_decimal
from silo_server.db.bulk import one_of
from silo_server.db.engine import Tx
from silo_server.db.tables import bom_lines, items
from silo_server.errors import TooLargeError
from silo_server.services.bom.lines import select_lines, to_line
from silo_server.services.items import by_ids
from silo_server.values import Item, Line

MAX_DEPTH = 20
# What quantities multiply and add up to, at most: exact as a JSON number, and more than anybody orders.
MAX_TOTAL = 10**15
# Totals are exact: counts as they are, lengths and masses as decimals.
Exact = int | Decimal


@dataclass(frozen=True, slots=True)
class Graph:
    """Everything below ``root``: the lines of every assembly in it, by the assembly's internal id."""

    root: Item
    lines: Mapping[int, Sequence[Line]]

    def names(self) -> dict[int, str]:
        """Internal id → part number, of the root and of all below it."""
        below = {line.child_id: line.child_part_number for lines in self.lines.values() for line in lines}
        return below | {self.root.id: self.root.part_number}

    def components(self, item_id: int) -> list[Line]:
        """The lines that are followed."""
        return [line for line in self.lines.get(item_id, ()) if line.state.rel_type == "component"]


class Occurrence(NamedTuple):
    """A line somewhere in the expanded tree. ``depth`` 1 = direct child; ``total`` per one root."""

    line: Line
    parent_part_number: str
    depth: int
    total: Exact


@dataclass(frozen=True, slots=True)
class FlatRow:
    """A leaf part: how much of it one root needs in all. ``unreferenced`` where a line on the way is."""

    line: Line
    unit: str | None
    total: Exact


@dataclass(frozen=True, slots=True)
class Usage:
    """One use of an item: in which parent, how much, how many steps up (1 = direct)."""

    parent: Item
    quantity: float
    unit: str | None
    rel_type: str
    source: str
    depth: int


def load_graph(tx: Tx, root: Item, depth: int | None = None) -> Graph:
    """All lines below ``root``, each once; of the first ``depth`` levels only, where that is given.

    TooLargeError where there are more than ``max_expanded_rows``: they would fill the memory.
    """
    query = select_lines().order_by(bom_lines.c.parent_id, bom_lines.c.position)
    if depth == 1:
        query = query.where(bom_lines.c.parent_id == root.id)
    else:
        query = query.where(bom_lines.c.parent_id.in_(_reach(root, depth)))
    most = tx.settings.max_expanded_rows
    rows = tx.conn.execute(query.limit(most + 1)).all()
    if len(rows) > most:
        raise TooLargeError(
            f"there are more than {most} different lines below {root.part_number}; ask for one of its "
            "sub-assemblies, or for less with depth="
        )
    lines: dict[int, list[Line]] = {}
    for row in rows:
        lines.setdefault(row[1], []).append(to_line(row))
    return Graph(root, lines)


def _reach(root: Item, depth: int | None) -> Select[tuple[int]]:
    """The ids of the items whose lines belong to the first ``depth`` levels, or to all."""
    first = select(literal(root.id, items.c.id.type).label("item_id"), literal(1).label("level"))
    reach = first.cte("reach", recursive=True)
    # Without an end the level stays 1, so that every item is visited once, and a ring ends.
    level = reach.c.level if depth is None else reach.c.level + 1
    below = select(bom_lines.c.child_id, level).join(reach, bom_lines.c.parent_id == reach.c.item_id)
    if depth is not None:
        below = below.where(reach.c.level < depth)
    return select(reach.union(below).c.item_id)


def expand(graph: Graph, depth: int, limit: int) -> list[Occurrence]:
    """The tree as rows, parents before their children. CycleError where it never ends, TooLargeError."""
    order_of(graph)  # finds a cycle before it is walked
    rows: list[Occurrence] = []
    graph_lines = graph.lines
    one: Exact = 1
    stack = [(graph.root.part_number, 1, one, iter(graph_lines.get(graph.root.id, ())))]
    while stack:
        parent, level, factor, lines = stack[-1]
        for line in lines:
            state = line.state
            total = multiplied(factor, line)
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


def flatten(graph: Graph, closed: Collection[int] = ()) -> list[FlatRow]:
    """The leaf parts with their total quantities, in the order the tree shows them first.

    closed
        assemblies (internal ids) that count as parts.
    """
    factors: dict[int, Exact] = {graph.root.id: 1}
    totals: dict[tuple[int, str | None], Exact] = {}
    shown: dict[tuple[int, str | None], Line] = {}
    for item_id in order_of(graph):
        if item_id not in factors:
            continue  # below a closed one only
        for line in graph.components(item_id):
            amount = multiplied(factors[item_id], line)
            if line.child_id not in closed and graph.components(line.child_id):
                factors[line.child_id] = added(factors.get(line.child_id, 0), amount, line)
            else:
                key = (line.child_id, line.state.unit)
                totals[key] = added(totals.get(key, 0), amount, line)
                shown.setdefault(key, line)
    return [FlatRow(line, key[1], totals[key]) for key, line in shown.items()]


def multiplied(factor: Exact, line: Line) -> Exact:
    """So much of the line's child for ``factor`` of its parent; ConflictError above :data:`MAX_TOTAL`."""
    quantity = line.state.quantity
    return _counted(factor * (int(quantity) if quantity.is_integer() else as_decimal(quantity)), line)


def added(one: Exact, other: Exact, line: Line) -> Exact:
    """The sum; ConflictError above :data:`MAX_TOTAL`."""
    return _counted(one + other, line)


def _counted(amount: Exact, line: Line) -> Exact:
    if amount > MAX_TOTAL:
        raise ConflictError(
            f"the quantities above {line.child_part_number} multiply to more than {MAX_TOTAL:.0e}, which "
            "nobody can mean; look for a wrong quantity on the way to it"
        )
    return amount


def where_used(
    tx: Tx, item: Item, *, indirect: bool = False, limit: int = 1000, offset: int = 0
) -> tuple[list[Usage], int]:
    """A page of an item's parents, and how many there are in all.

    With ``indirect`` also their parents, the nearest first, each line once; by part number in each level.
    """
    found: list[Usage] = []
    total = 0
    for depth, level in enumerate(_levels_above(tx, item, MAX_DEPTH if indirect else 1), start=1):
        of_level = one_of(tx, bom_lines.c.child_id, level)
        skip, room = max(0, offset - total), limit - len(found)
        total += tx.conn.scalar(select(func.count()).select_from(bom_lines).where(of_level)) or 0
        if room > 0 and offset < total:
            found.extend(_uses(tx, of_level, depth, room, skip))
    return found, total


def use_counts(tx: Tx, item_ids: Collection[int]) -> dict[int, int]:
    """On how many BOM lines each item is; those on none are absent."""
    query = select(bom_lines.c.child_id, func.count()).where(one_of(tx, bom_lines.c.child_id, item_ids))
    return {row[0]: row[1] for row in tx.conn.execute(query.group_by(bom_lines.c.child_id))}


def _levels_above(tx: Tx, item: Item, levels: int) -> Iterator[list[int]]:
    """The item, then what uses it, then what uses that; each item in its nearest level only."""
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


def order_of(graph: Graph) -> list[int]:
    """The assemblies (internal ids), parents before their children; CycleError where there is a ring."""
    names = graph.names()
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
