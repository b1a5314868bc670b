# SPDX-License-Identifier: LGPL-2.1-or-later
"""Parts and rows that share a name: which is which. By parent, quantity, mass; else in order, warned. Pure.

Rows with equal data are one :class:`Bundle`: nobody needs to distinguish them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TypeVar

from silo.inertia.bom.rows import BOMEntry, BomTable
from silo.inertia.codes import Decided
from silo.inertia.names import plain
from silo.inertia.products import Product
from silo.inertia.wording import counted

MASS_TOLERANCE = 0.02
"""Relative: how well density times volume must fit a mass to decide between rows (quantum apart)."""

DensityOf = Callable[[BOMEntry, Product], float | None]
"""[kg/m^3] of a row's material (or the part's own density); None where unknown."""


@dataclass(frozen=True, eq=False)
class Bundle:
    """Rows of one name that say the same.

    quantities
        pieces in the product by each way of reading structured quantities; empty where unknown.
    parents
        normalised names of the rows' parent rows ("" = top).
    """

    rows: tuple[BOMEntry, ...]
    quantities: frozenset[float]
    parents: frozenset[str]

    @property
    def row(self) -> BOMEntry:
        """The first row; the others say the same."""
        return self.rows[0]


@dataclass(frozen=True, eq=False)
class Pair:
    """One product and the rows it got."""

    product: Product
    bundle: Bundle
    decided: Decided
    doubt: str = ""


@dataclass(eq=False)
class _Open:
    """What is still to be matched."""

    products: list[Product]
    bundles: list[Bundle]
    pairs: list[Pair] = field(default_factory=list)

    def close(self, product: Product, bundle: Bundle, decided: Decided, doubt: str = "") -> None:
        self.products.remove(product)
        self.bundles.remove(bundle)
        self.pairs.append(Pair(product, bundle, decided, doubt))


class Reading(StrEnum):
    """What a quantity in a structured BOM counts."""

    PER_PARENT = "per_parent"  # pieces in one parent
    TOTAL = "total"  # pieces in the whole product


BOTH = frozenset(Reading)


def readings(products: Sequence[Product], table: BomTable) -> frozenset[Reading]:
    """Which reading of the quantities the parts that nothing can be mistaken for agree on; else both.

    Only rows count on which the readings differ, of a name that one row and one product have.
    """
    by_name = _once((plain(product.name), product) for product in products)
    rows = _once((plain(row.name), row) for row in table.rows if not row.has_children)
    fits = dict.fromkeys(Reading, 0)
    for name in by_name.keys() & rows.keys():
        row, count = rows[name], by_name[name].count
        total = table.total_quantity(row)
        if row.quantity is None or total is None or row.quantity == total:
            continue
        fits[Reading.PER_PARENT] += count == total
        fits[Reading.TOTAL] += count == row.quantity
    best = [reading for reading in Reading if fits[reading]]
    if len(best) == 2 and max(fits.values()) >= 2 * min(fits.values()):
        best = [max(fits, key=lambda reading: fits[reading])]
    return frozenset(best) if len(best) == 1 else BOTH


_T = TypeVar("_T")


def _once(pairs: Iterable[tuple[str, _T]]) -> dict[str, _T]:
    """What stands under a name of its own."""
    found: dict[str, list[_T]] = {}
    for name, value in pairs:
        found.setdefault(name, []).append(value)
    return {name: values[0] for name, values in found.items() if len(values) == 1}


def assign(
    products: Sequence[Product],
    rows: Sequence[BOMEntry],
    table: BomTable,
    density: DensityOf,
    read: frozenset[Reading] = BOTH,
) -> list[Pair]:
    """Pairs of products and rows of one name. A product without a pair has no row."""
    bundles = bundled(rows, table, read)
    if len(bundles) == 1:
        return _one_bundle(list(products), bundles[0], density)
    state = _Open(list(products), bundles)
    _settle(state, Decided.PARENT, _same_parent)
    _settle(state, Decided.QUANTITY, lambda p, b: p.count in b.quantities)
    _settle(state, Decided.MASS, lambda p, b: _may_count(p, b) and _mass_fits(p, b, density))
    _settle(state, Decided.MASS, lambda p, b: _mass_fits(p, b, density))
    if len(state.products) == len(state.bundles) == 1 and state.pairs:
        state.close(state.products[0], state.bundles[0], Decided.REMAINING)
    _in_order(state)
    return state.pairs


def bundled(rows: Sequence[BOMEntry], table: BomTable, read: frozenset[Reading] = BOTH) -> list[Bundle]:
    """Rows of one name, those with equal data together, in the order of their first row."""
    groups: dict[tuple[str | None, float | None], list[BOMEntry]] = {}
    for row in rows:
        groups.setdefault(row.data, []).append(row)
    return [_bundle(tuple(group), table, read) for group in groups.values()]


def _bundle(rows: tuple[BOMEntry, ...], table: BomTable, read: frozenset[Reading]) -> Bundle:
    # Quantities of a structured BOM are per parent here and per product there; either may be meant.
    kinds = {
        Reading.TOTAL: [row.quantity for row in rows],
        Reading.PER_PARENT: [table.total_quantity(row) for row in rows],
    }
    sums = {sum(q for q in kinds[r] if q is not None) for r in read if None not in kinds[r]}
    above = {table.rows[row.parent].name if row.parent is not None else "" for row in rows}
    return Bundle(rows, frozenset(sums), frozenset(plain(name) for name in above))


def _one_bundle(products: list[Product], bundle: Bundle, density: DensityOf) -> list[Pair]:
    several = len(bundle.rows) > 1
    decided = Decided.SAME_DATA if several else Decided.ONLY
    if len(products) == 1:
        return [Pair(products[0], bundle, decided)]
    total = sum(product.count for product in products)
    if bundle.quantities and total not in bundle.quantities:
        by_count = [p for p in products if p.count in bundle.quantities]
        if len(by_count) == 1:
            return [Pair(by_count[0], bundle, Decided.QUANTITY)]
        fitting = [p for p in products if _mass_fits(p, bundle, density)]
        if len(fitting) == 1:
            return [Pair(fitting[0], bundle, Decided.MASS)]
    doubt = ""
    if bundle.row.has_mass and _shapes_differ(products):
        doubt = (
            f"{len(products)} different shapes are named “{products[0].name}” and the BOM has one mass "
            "for all of them; each got it"
        )
    return [Pair(product, bundle, decided, doubt) for product in products]


def _settle(state: _Open, decided: Decided, fits: Callable[[Product, Bundle], bool]) -> None:
    """Pair what fits one way only, from both sides, until nothing changes."""
    changed = True
    while changed and state.products and state.bundles:
        changed = False
        for product in list(state.products):
            options = [b for b in state.bundles if fits(product, b)]
            if len(options) != 1:
                continue
            rivals = [p for p in state.products if fits(p, options[0])]
            if len(rivals) == 1:
                state.close(product, options[0], decided)
                changed = True


def _in_order(state: _Open) -> None:
    left = len(state.products), len(state.bundles)
    for product, bundle in list(zip(state.products, state.bundles, strict=False)):
        lines = ", ".join(str(row.line) for b in [bundle] for row in b.rows)
        state.close(
            product,
            bundle,
            Decided.ORDER,
            f"{counted(left[0], 'part')} and {counted(left[1], 'row')} named “{product.name}” cannot be told "
            f"apart by parent, quantity or mass; in order of appearance this one got line {lines}",
        )


def _same_parent(product: Product, bundle: Bundle) -> bool:
    # Only where the BOM is structured: else every row stands at the top and proves nothing.
    structured = any(parent for parent in bundle.parents)
    return structured and {plain(name) for name in product.parents} <= bundle.parents


def _may_count(product: Product, bundle: Bundle) -> bool:
    return not bundle.quantities or product.count in bundle.quantities


def _mass_fits(product: Product, bundle: Bundle, density: DensityOf) -> bool:
    row = bundle.row
    rho = density(row, product)
    if row.mass_kg is None or rho is None or product.volume_m3 <= 0:
        return False
    allowed = max(row.quantum_kg, MASS_TOLERANCE * row.mass_kg)
    return abs(rho * product.volume_m3 - row.mass_kg) <= allowed


def _shapes_differ(products: Sequence[Product]) -> bool:
    volumes = [product.volume_m3 for product in products]
    return max(volumes) - min(volumes) > 0.01 * max(volumes)
