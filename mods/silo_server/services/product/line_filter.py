# SPDX-License-Identifier: LGPL-2.1-or-later
"""The filter of lines by words and type, for tree, flat list, totals, print and exports."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache

from silo_server.db.transaction import Tx
from silo_server.services.product.flat import FlatRow, flatten
from silo_server.services.product.graph import Graph, order_of
from silo_server.services.product.parts import RolledItem, portions, some_parts
from silo_server.services.search import fits
from silo_server.values import Line

# Properties that a filter looks in beside number, name and description.
SOUGHT = ("supplier", "supplier_part_number", "manufacturer")


def sought(words: str, item_type: str, parts: Mapping[int, RolledItem]) -> Callable[[Line], bool]:
    """Make a test of lines from a filter, for tree, flat list, totals, print and exports.

    A line passes if its part has the type, and all words in its number, name, description, supplier or
    manufacturer.
    """
    test = fits(words)

    @cache
    def fitting(child_id: int, child_type: str) -> bool:
        if not words or (item_type and child_type != item_type):
            return item_type in ("", child_type)
        part = parts[child_id]
        texts = filter(None, map(part.properties.get, SOUGHT))
        return test(part.part_number, part.name, part.description, *map(str, texts))

    return lambda line: fitting(line.child_id, line.child_item_type)


def found_below(tx: Tx, graph: Graph, words: str, item_type: str) -> Callable[[Line], bool]:
    """Make the test of :func:`sought` for a whole graph; parts are read in portions and not kept."""
    lines = {line.child_id: line for below in graph.lines.values() for line in below}
    found: set[int] = set()
    for portion in portions(lines.values()):
        test = sought(words, item_type, some_parts(tx, [line.child_id for line in portion]))
        found.update(line.child_id for line in portion if test(line))
    return lambda line: line.child_id in found


def leading_to(graph: Graph, fitting: Callable[[Line], bool]) -> Callable[[Line], bool]:
    """Make a test of lines: true if the line fits, or if something below it does."""
    below: dict[int, bool] = {}

    def hit(line: Line) -> bool:
        return fitting(line) or (line.state.rel_type == "component" and below.get(line.child_id, False))

    for item_id in reversed(order_of(graph)):
        below[item_id] = any(hit(line) for line in graph.lines.get(item_id, ()))
    return hit


def found_parts(graph: Graph, fitting: Callable[[Line], bool]) -> list[FlatRow]:
    """Find what fits first on each way down: each part once, with all that one root needs of it."""
    ids = {line.child_id for lines in graph.lines.values() for line in lines if fitting(line)}
    return [row for row in flatten(graph, ids) if row.line.child_id in ids]
