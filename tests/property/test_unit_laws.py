# SPDX-License-Identifier: LGPL-2.1-or-later
"""Units over random products, against every way down the tree, one by one, in fractions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from fractions import Fraction

from hypothesis import given
from hypothesis import strategies as st

from silo_server.services.product.flat import FlatRow, flatten
from silo_server.services.product.graph import Graph
from silo_server.services.product.tree import expand
from silo_server.values import Item, Line, LineState

# From the definitions of the units, not from our table: (kind, how much of the kind's base).
DEFINED = {
    "pcs": ("pieces", Fraction(1)), "Stk.": ("pieces", Fraction(1)),
    "m": ("length", Fraction(1)), "mm": ("length", Fraction(1, 1000)), "MM": ("length", Fraction(1, 1000)),
    "kg": ("mass", Fraction(1)), "g": ("mass", Fraction(1, 1000)), "t": ("mass", Fraction(1000)),
    "box": ("box", Fraction(1)),
}  # fmt: skip
ITEM_UNITS = [None, "pcs", "m", "mm", "kg", "g", "box"]
LAST = 7


@dataclass
class Product:
    """Items 0 (the root) to 7; a line leads from a smaller to a larger number."""

    units: list[str | None]
    lines: dict[int, list[Line]] = field(default_factory=dict)


@st.composite
def products(draw: st.DrawFn) -> Product:
    """A product of a few levels, with lines of CAD and of users, in units that convert and that do not."""
    product = Product(draw(st.lists(st.sampled_from(ITEM_UNITS), min_size=LAST + 1, max_size=LAST + 1)))
    for parent in range(draw(st.integers(1, 4))):
        children = draw(st.lists(st.integers(parent + 1, LAST), min_size=1, max_size=4, unique=True))
        for child in children:
            own = product.units[child]
            state = LineState(
                draw(st.sampled_from([1.0, 2.0, 0.5, 500.0, 0.1, 3.0])),
                draw(st.sampled_from(["manual", "manual", "assembly"])),
                unit=draw(st.sampled_from([None, own, *DEFINED])),
            )
            product.lines.setdefault(parent, []).append(line(parent, child, own, state))
    return product


def line(parent: int, child: int, own: str | None, state: LineState) -> Line:
    """A line of our products."""
    return Line(
        f"{parent}-{child}", parent, child, child, f"P{child}", "", "", "", "part", 0, False, own, state
    )


def graph_of(product: Product) -> Graph:
    """The product as the server reads it."""
    root = Item(0, "", "P0", "", "", "assembly", None, None, {}, None, {}, 0, 1, 1, "", "", "", "", None)
    return Graph(root, product.lines)


def ways(product: Product) -> Iterator[tuple[int, Fraction | None]]:
    """Each way from the root to a leaf: how much of the leaf it needs; None if a unit on it is open."""

    def below(item: int, amount: Fraction | None) -> Iterator[tuple[int, Fraction | None]]:
        if not product.lines.get(item):
            yield item, amount
        for at in product.lines.get(item, ()):
            yield from below(at.child_id, times(amount, at))

    for at in product.lines.get(0, ()):
        yield from below(at.child_id, times(Fraction(1), at))


def times(amount: Fraction | None, at: Line) -> Fraction | None:
    """An amount of the parent, times a line, in the unit of the child."""
    state = at.state
    own = DEFINED[at.child_unit or "pcs"]
    bare = "pcs" if state.source == "assembly" else at.child_unit or "pcs"
    kind, factor = DEFINED[state.unit or bare]
    if amount is None or kind != own[0]:
        return None
    return amount * Fraction(str(state.quantity)) * factor / own[1]


def flat_of(product: Product) -> dict[int, FlatRow]:
    """The rows of the flat list by their part; each part has one."""
    rows = flatten(graph_of(product))
    assert len({row.line.child_id for row in rows}) == len(rows)
    return {row.line.child_id: row for row in rows}


@given(products())
def test_the_flat_list_is_all_ways_added_up(product: Product) -> None:
    """Each leaf is one row in its own unit; what a unit leaves open is in no sum, and marks the row."""
    totals: Counter[int] = Counter()
    leaves, open_ones = set(), set()
    for leaf, amount in ways(product):
        leaves.add(leaf)
        if amount is None:
            open_ones.add(leaf)
        else:
            totals[leaf] += amount  # type: ignore[assignment]
    rows = flat_of(product)
    assert rows.keys() == leaves
    assert {leaf for leaf, row in rows.items() if row.unit_open} == open_ones
    assert {leaf for leaf, row in rows.items() if "unit?" in row.doubts()} == open_ones
    assert {leaf: Fraction(row.total) for leaf, row in rows.items()} == {
        leaf: totals[leaf] for leaf in leaves
    }


@given(products())
def test_the_tree_marks_the_lines_that_are_open_and_leaves_what_is_below_without_a_total(
    product: Product,
) -> None:
    """A total is in the unit of its line, and that of a part is the sum of those that convert."""
    graph = graph_of(product)
    sums: Counter[int] = Counter()
    for at in expand(graph, 20, 10_000):
        is_open = times(Fraction(1), at.line) is None
        assert ("unit?" in graph.doubts(at.line)) is is_open
        if at.total is None or is_open or product.lines.get(at.line.child_id):
            continue
        of_line = DEFINED[at.line.unit or "pcs"]
        own = DEFINED[at.line.child_unit or "pcs"]
        sums[at.line.child_id] += Fraction(at.total) * of_line[1] / own[1]  # type: ignore[assignment]
    flat = flat_of(product)
    assert {leaf: Fraction(row.total) for leaf, row in flat.items()} == {leaf: sums[leaf] for leaf in flat}


def test_half_a_metre_and_500_mm_are_one_row_of_a_metre() -> None:
    units: list[str | None] = [None, None, "m"]
    lines = [line(0, 2, "m", LineState(0.5, "manual")), line(0, 1, None, LineState(1.0, "assembly"))]
    product = Product(units, {0: lines, 1: [line(1, 2, "m", LineState(500.0, "manual", unit="mm"))]})
    assert [(row.total, row.unit, row.unit_open) for row in flatten(graph_of(product))] == [(1, "m", False)]


def test_pieces_that_cad_counts_are_no_metres() -> None:
    """A hose in the model three times: three metres is a guess, so the line is a question."""
    product = Product([None, "m"], {0: [line(0, 1, "m", LineState(3.0, "assembly"))]})
    (row,) = flatten(graph_of(product))
    assert (row.total, row.unit_open, row.line.unit) == (0, True, "pcs")
