# SPDX-License-Identifier: LGPL-2.1-or-later
"""The graph of BOMs below an item: every line once, however often its assembly is used.

One recursive query brings the lines. Only ``component`` lines are followed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from itertools import chain
from typing import Any

from sqlalchemy import Select, literal, select

from silo.bom.errors import CycleError
from silo.bom.message import message
from silo.bom.quantities import plain
from silo_server.db.rows import among
from silo_server.db.tables import bom_lines, items
from silo_server.db.transaction import Tx
from silo_server.errors import TooLargeError
from silo_server.services.bom.conflicts import CadQuantities, cad_quantity_of, conflicts_in
from silo_server.services.bom.lines import child_of, select_lines, to_line
from silo_server.services.product.amounts import UNIT_OPEN, unit_is_open
from silo_server.values import Item, Line

MAX_DEPTH = 20


@dataclass(frozen=True, slots=True)
class Graph:
    """Everything below ``root``: the lines of every assembly in it, by the assembly's internal id."""

    root: Item
    lines: Mapping[int, Sequence[Line]]
    conflicts: Mapping[int, CadQuantities] = field(default_factory=dict)

    def cad_quantity(self, line: Line) -> Decimal | None:
        """Return CAD's quantity for a line in conflict (0: not in CAD); None if there is no conflict."""
        said = cad_quantity_of(line, self.conflicts.get(line.parent_id, {}))
        return None if said is None else said.quantity

    def doubts(self, line: Line) -> list[str]:
        """List what a user still has to decide about a line, in words."""
        quantity = self.cad_quantity(line)
        doubts: list[str] = [message("unreferenced")] if line.state.unreferenced_since else []
        if quantity is not None:
            doubts.append(
                message("CAD says {quantity}", quantity=plain(quantity))
                if quantity
                else message("CAD no longer has it")
            )
        return [*doubts, UNIT_OPEN] if unit_is_open(line) else doubts

    def names(self) -> dict[int, str]:
        """Return internal id → part number of the root and of all items below it."""
        below = {line.child_id: line.child_part_number for lines in self.lines.values() for line in lines}
        return below | {self.root.id: self.root.part_number}

    def components(self, item_id: int) -> list[Line]:
        """Return the component lines of an item; only these are followed."""
        return [line for line in self.lines.get(item_id, ()) if line.state.rel_type == "component"]


def load_graph(tx: Tx, root: Item, depth: int | None = None, *, bare: bool = False) -> Graph:
    """Read all lines below ``root``, each once; with ``depth`` only those of the first levels.

    bare
        as in :func:`select_lines`, for callers that read the parts as well.
    TooLargeError if there are more than ``max_expanded_rows``: they would fill the memory.
    """
    query = select_lines(bare=bare).order_by(bom_lines.c.parent_id, bom_lines.c.position)
    if depth == 1:
        query = query.where(bom_lines.c.parent_id == root.id)
    else:
        query = query.where(among(tx, bom_lines.c.parent_id, _reach(root, depth, leaves=False)))
    most = tx.settings.max_expanded_rows
    lines: dict[int, list[Line]] = {}
    # What many lines say of one child is kept once.
    names: dict[int, tuple[Any, ...]] = {}
    with tx.conn.execute(query.limit(most + 1), execution_options={"yield_per": 2000}) as rows:
        for number, row in enumerate(chain.from_iterable(rows.partitions())):
            if number == most:
                raise TooLargeError(
                    message(
                        "there are more than {most} different lines below {part_number}; ask for one of its "
                        "sub-assemblies, or for less with depth=",
                        most=most,
                        part_number=root.part_number,
                    )
                )
            if (child := names.get(row[2])) is None:
                names[row[2]] = child = child_of(row)
            lines.setdefault(row[1], []).append(to_line(row, child))
    return Graph(root, lines, conflicts_in(tx, lines))


def ids_below(root: Item) -> Select[tuple[int]]:
    """Select the ids of an item and of all that is in it."""
    return _reach(root, None)


def _reach(root: Item, depth: int | None, *, leaves: bool = True) -> Select[tuple[int]]:
    """Select the ids of the items whose lines belong to the first ``depth`` levels, or to all (None).

    Without ``leaves``: only of items that have lines.
    """
    first = select(literal(root.id, items.c.id.type).label("item_id"), literal(1).label("level"))
    reach = first.cte("reach", recursive=True)
    # Without an end the level stays 1, so that every item is visited once, and a ring ends.
    level = reach.c.level if depth is None else reach.c.level + 1
    below = select(bom_lines.c.child_id, level).join(reach, bom_lines.c.parent_id == reach.c.item_id)
    if depth is not None:
        below = below.where(reach.c.level < depth)
    if not leaves:
        inner = bom_lines.alias()
        below = below.where(select(inner.c.id).where(inner.c.parent_id == bom_lines.c.child_id).exists())
    return select(reach.union(below).c.item_id)


def order_of(graph: Graph) -> list[int]:
    """Sort the assemblies (internal ids), parents before their children; CycleError if there is a ring."""
    below = {item_id: [line.child_id for line in graph.components(item_id)] for item_id in graph.lines}
    return list(children_first(below, [graph.root.id], graph.names))[::-1]


def children_first(
    below: Mapping[int, Sequence[int]], wanted: Iterable[int], names: Callable[[], Mapping[int, str]]
) -> Iterator[int]:
    """Yield the wanted items and the assemblies below them, children first.

    Raises CycleError with the part numbers of the ring, which ``names`` has.
    """
    done: set[int] = set()
    for first in wanted:
        way: dict[int, Iterator[int]] = {} if first in done else {first: iter(below.get(first, ()))}
        while way:
            item_id, rest = next(reversed(way.items()))
            child = next(rest, None)
            if child is None:
                del way[item_id]
                done.add(item_id)
                yield item_id
            elif child in way:
                ring, numbers = list(way), names()
                raise CycleError([numbers[part_id] for part_id in [*ring[ring.index(child) :], child]])
            elif child in below and child not in done:
                way[child] = iter(below[child])
