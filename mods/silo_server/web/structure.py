# SPDX-License-Identifier: LGPL-2.1-or-later
"""A BOM over all levels as a table: which rows of the tree are open, and its flat list.

Only what is open is walked, so that a tree with a million occurrences costs what is looked at of it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from functools import cache
from typing import Annotated, Any

from fastapi import Query

from silo.bom.numbers import as_decimal
from silo_server.errors import TooLargeError
from silo_server.services.bom import tree
from silo_server.services.bom.rollup import Part, Worth
from silo_server.values import Line
from silo_server.web.tables import PAGE_ROWS, Address, Page, arranged, fits, page_of

# More open rows than this nobody pages through; a filter or fewer levels bring them down.
MOST_OPEN = 50_000
MOST_PIECES = 1_000_000


@dataclass(frozen=True)
class Look:
    """The part of the address that says how a BOM over all levels is shown.

    depth
        levels that are open (0: as many as fit on a page); ``flip`` names the branches that are not so.
    pieces
        for how many of the assembly the quantities are.
    """

    view: Annotated[str, Query(max_length=10)] = "tree"
    q: Annotated[str, Query(max_length=200)] = ""
    type: Annotated[str, Query(max_length=20)] = ""
    sort: Annotated[str, Query(max_length=20)] = ""
    page: Annotated[int, Query(ge=1, le=10**9)] = 1
    depth: Annotated[int, Query(ge=0, le=tree.MAX_DEPTH)] = 0
    flip: Annotated[str, Query(max_length=20_000)] = ""
    pieces: Annotated[int, Query(ge=1, le=MOST_PIECES)] = 1

    @property
    def is_flat(self) -> bool:
        return self.view == "flat"

    @property
    def is_filtered(self) -> bool:
        return bool(self.q or self.type)

    @property
    def flips(self) -> list[str]:
        """The branches that are not as ``depth`` says."""
        return list(dict.fromkeys(filter(None, self.flip.split(","))))

    def address(self, path: str) -> Address:
        """The page with this view."""
        usual = {"view": "tree", "page": 1, "depth": 0, "pieces": 1}
        names = ("view", "q", "type", "sort", "page", "depth", "flip", "pieces")
        values = {name: getattr(self, name) for name in names}
        return Address(path, {n: str(v) for n, v in values.items() if v not in ("", usual.get(n))})

    def flipped(self, key: str) -> str:
        """``flip`` where this branch is the other way round."""
        keys = self.flips
        return ",".join(one for one in keys if one != key) if key in keys else ",".join([*keys, key])


@dataclass(frozen=True, slots=True)
class Branch:
    """A row of the tree. ``total``: of all pieces; ``key`` names the branch, "" where nothing is below."""

    line: Line
    part: Part
    depth: int
    total: tree.Exact
    worth: Worth
    mark: str = ""
    key: str = ""
    is_open: bool = False

    @property
    def mass(self) -> Decimal | None:
        """Of all pieces [kg]."""
        return None if self.worth.mass is None else self.worth.mass * as_decimal(self.total)

    @property
    def costs(self) -> Mapping[str, Decimal]:
        """Of all pieces, per currency."""
        return {currency: cost * as_decimal(self.total) for currency, cost in self.worth.costs.items()}


@dataclass(frozen=True, slots=True)
class Structure:
    """A graph with all that its rows show, by internal id; ``page_rows`` make a page."""

    graph: tree.Graph
    parts: Mapping[int, Part]
    worths: Mapping[int, Worth]
    marks: Mapping[int, str]
    page_rows: int = PAGE_ROWS


def level_counts(graph: tree.Graph) -> list[int]:
    """How many rows each level of the tree has, the first level first; at most ``MAX_DEPTH`` levels."""
    counts: list[int] = []
    level: dict[int, int] = {graph.root.id: 1}
    while level and len(counts) < tree.MAX_DEPTH:
        below: dict[int, int] = {}
        rows = 0
        for item_id, times in level.items():
            for line in graph.lines.get(item_id, ()):
                rows += times
                if line.state.rel_type == "component" and line.child_id in graph.lines:
                    below[line.child_id] = below.get(line.child_id, 0) + times
        if rows:
            counts.append(rows)
        level = below
    return counts


def usual_depth(counts: Sequence[int]) -> int:
    """As many levels as fit on a page, at least one."""
    depth = rows = 0
    for count in counts:
        rows += count
        if rows > PAGE_ROWS:
            break
        depth += 1
    return max(depth, 1)


def tree_page(shown: Structure, look: Look, total: int) -> tuple[Page[Branch], Sequence[Branch]]:
    """A page of the open rows, and the branches above its first one (none on the first page).

    TooLargeError where more is open than anybody can page through.
    """
    rows: list[Branch] = []
    for row in _walk(shown, look):
        rows.append(row)
        if len(rows) > MOST_OPEN:
            raise TooLargeError(
                f"more than {MOST_OPEN} rows of this tree are open; show fewer levels or take an export"
            )
    found = page_of(rows, total if look.is_filtered else len(rows), look.page, shown.page_rows)
    above: list[Branch] = []
    for row in reversed(rows[: found.start]):
        if row.depth < (above[-1] if above else rows[found.start]).depth:
            above.append(row)
    return found, above[::-1]


def _walk(shown: Structure, look: Look) -> Iterator[Branch]:
    graph, hit = shown.graph, _hits(shown, look)
    filtered, flipped = look.is_filtered, set(look.flips)

    @cache
    def lines_of(item_id: int) -> Sequence[Line]:
        lines = graph.lines.get(item_id, ())
        if filtered:
            lines = [line for line in lines if hit(line)]
        return arranged(lines, look.sort, _tree_keys(shown))

    one: tree.Exact = look.pieces
    stack = [(1, one, "", iter(lines_of(graph.root.id)))]
    while stack:
        level, factor, above, lines = stack[-1]
        for line in lines:
            total = tree.multiplied(factor, line)
            branches = line.state.rel_type == "component" and line.child_id in graph.lines
            key = _key(above, line) if branches and level < tree.MAX_DEPTH else ""
            is_open = bool(key) and (filtered or (level < look.depth) != (key in flipped))
            yield Branch(
                line,
                shown.parts[line.child_id],
                level,
                total,
                shown.worths[line.child_id],
                shown.marks.get(line.child_id, ""),
                key,
                is_open,
            )
            if is_open:
                stack.append((level + 1, total, key, iter(lines_of(line.child_id))))
                break
        else:
            stack.pop()


def _hits(shown: Structure, look: Look) -> Callable[[Line], bool]:
    """A test of lines: true where the line fits what is searched, or something below it does."""
    test, graph = fits(look.q), shown.graph
    below: dict[int, bool] = {}
    for item_id in reversed(tree.order_of(graph)):
        below[item_id] = any(
            _fits(line, test, look) or below.get(line.child_id, False)
            for line in graph.lines.get(item_id, ())
        )

    def hit(line: Line) -> bool:
        followed = line.state.rel_type == "component"
        return _fits(line, test, look) or (followed and below.get(line.child_id, False))

    return hit


def _fits(line: Line, test: Callable[..., bool], look: Look) -> bool:
    if look.type and line.child_item_type != look.type:
        return False
    return test(line.child_part_number, line.child_name, line.child_description)


def _tree_keys(shown: Structure) -> Mapping[str, Callable[[Line], Any]]:
    def times(line: Line, value: Decimal | None) -> Decimal | None:
        return None if value is None else value * as_decimal(line.state.quantity)

    return {
        "number": lambda line: line.child_part_number.casefold(),
        "name": lambda line: line.child_name.casefold(),
        "quantity": lambda line: line.state.quantity,
        "total": lambda line: line.state.quantity,
        "unit_mass": lambda line: shown.worths[line.child_id].mass,
        "mass": lambda line: times(line, shown.worths[line.child_id].mass),
        "unit_cost": lambda line: _cost_key(shown.worths[line.child_id].costs),
        "cost": lambda line: times(line, _cost_key(shown.worths[line.child_id].costs)),
    }


def _cost_key(costs: Mapping[str, Decimal]) -> Decimal | None:
    # Currencies cannot be compared; where there are several, the amounts are.
    return max(costs.values(), default=None)


def _key(above: str, line: Line) -> str:
    return hashlib.blake2b(f"{above} {line.id}".encode(), digest_size=4).hexdigest()


def flat_page(shown: Structure, look: Look) -> Page[Branch]:
    """A page of the leaf parts, each with its total over the whole tree."""
    test = fits(look.q)
    rows = [
        Branch(
            row.line,
            shown.parts[row.line.child_id],
            1,
            row.total * look.pieces,
            shown.worths[row.line.child_id],
            shown.marks.get(row.line.child_id, ""),
        )
        for row in tree.flatten(shown.graph)
    ]
    found = [row for row in rows if _fits_flat(row, test, look)]
    return page_of(arranged(found, look.sort, _FLAT_KEYS), len(rows), look.page, shown.page_rows)


def _fits_flat(row: Branch, test: Callable[..., bool], look: Look) -> bool:
    if look.type and row.line.child_item_type != look.type:
        return False
    more = (row.part.properties.get(name) for name in ("supplier", "supplier_part_number", "manufacturer"))
    line = row.line
    return test(
        line.child_part_number, line.child_name, line.child_description, *(str(text) for text in more if text)
    )


_FLAT_KEYS: Mapping[str, Callable[[Branch], Any]] = {
    "number": lambda row: row.line.child_part_number.casefold(),
    "name": lambda row: row.line.child_name.casefold(),
    "type": lambda row: row.line.child_item_type,
    "total": lambda row: row.total,
    "unit_mass": lambda row: row.worth.mass,
    "mass": lambda row: row.mass,
    "unit_cost": lambda row: _cost_key(row.worth.costs),
    "cost": lambda row: _cost_key(row.costs),
    "supplier": lambda row: str(row.part.properties.get("supplier") or "").casefold(),
}
