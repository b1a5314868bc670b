# SPDX-License-Identifier: LGPL-2.1-or-later
"""The expanded tree below an item, row by row."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from silo.bom.message import message
from silo_server.errors import TooLargeError
from silo_server.services.product.amounts import Exact, totals_of
from silo_server.services.product.graph import Graph, order_of
from silo_server.values import Line


class Occurrence(NamedTuple):
    """A line somewhere in the expanded tree. ``depth`` 1 = direct child.

    total
        per one root, in the unit of the line; None below a line whose unit is open.
    """

    line: Line
    parent_part_number: str
    depth: int
    total: Exact | None


def expand(graph: Graph, depth: int, limit: int) -> Iterator[Occurrence]:
    """Yield the tree as rows, parents before their children. Raises CycleError, TooLargeError."""
    order_of(graph)  # finds a cycle before it is walked
    count = 0
    graph_lines = graph.lines
    exact: Exact | None = 1
    stack = [(graph.root.part_number, 1, exact, iter(graph_lines.get(graph.root.id, ())))]
    while stack:
        parent, level, factor, lines = stack[-1]
        for line in lines:
            state = line.state
            total, amount = totals_of(factor, line)
            count += 1
            yield Occurrence(line, parent, level, total)
            below = graph_lines.get(line.child_id)
            if below and level < depth and state.rel_type == "component":
                stack.append((line.child_part_number, level + 1, amount, iter(below)))
                break
        else:
            stack.pop()
        if count > limit:
            raise TooLargeError(
                message(
                    "the expanded BOM of {part_number} has more than {most} lines; ask for less with depth=",
                    part_number=graph.root.part_number,
                    most=limit,
                )
            )


def levels_of(graph: Graph) -> list[int]:
    """Count the rows of each level of the expanded tree. Raises CycleError."""
    below: dict[int, list[int]] = {}
    for item_id in reversed(order_of(graph)):
        counts = [len(graph.lines.get(item_id, ()))]
        for line in graph.components(item_id):
            for depth, count in enumerate(below.get(line.child_id, ()), start=1):
                counts += [0] * (depth + 1 - len(counts))
                counts[depth] += count
        below[item_id] = counts if counts[0] else []
    return below[graph.root.id]
