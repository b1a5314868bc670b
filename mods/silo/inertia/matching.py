# SPDX-License-Identifier: LGPL-2.1-or-later
"""Products ↔ BOM rows, tier by tier. By product and whole name, never by substring, never by likeness. Pure.

Tiers: the same text; the same but for case, separators and an occurrence mark; the same but for lost
characters; the same part number. A row that an earlier tier used up is not offered to a later one.

Parts and rows that share a name are told apart by parent, quantity and mass; else in order, with a warning.
Rows with equal data are one :class:`Bundle`: nobody needs to distinguish them.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from itertools import count
from typing import TypeVar

from silo.inertia.bom.rows import BOMEntry, BomTable
from silo.inertia.codes import Decided, Rule
from silo.inertia.model import Product
from silo.inertia.names import bare, could_be, is_lossy, plain
from silo.inertia.wording import counted, listed

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
    return [Pair(product, bundle, decided) for product in products]


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


@dataclass(frozen=True, eq=False)
class Match:
    """How a product found its row. ``doubt``: what keeps this from being certain, "" where nothing does."""

    bundle: Bundle
    rule: Rule
    decided: Decided
    doubt: str = ""

    @property
    def row(self) -> BOMEntry:
        """The row (the first of several that say the same)."""
        return self.bundle.row


@dataclass(frozen=True, eq=False)
class Matching:
    """All matches: ``parts`` by prototype key, ``groups`` by sub-assembly product name; rows left over."""

    parts: Mapping[str, Match]
    groups: Mapping[str, Match]
    unused: tuple[BOMEntry, ...] = ()


def match(
    parts: Sequence[Product], groups: Sequence[Product], table: BomTable, density: DensityOf
) -> Matching:
    """Match leaf products first, then sub-assemblies with the rows that no leaf used."""
    read = readings(parts, table)
    claims = _Claims(table, read)
    by_part = _tiers(parts, _rows_for_parts(table), table, density, claims)
    by_group = _tiers(groups, table.rows, table, lambda row, product: None, claims)
    told_below = {id(above) for row in table.rows if _has_data(row) for above in table.ancestors(row)}
    unused = tuple(
        row
        for row in table.rows
        if not claims.used(row) and (not row.has_children or (_has_data(row) and id(row) not in told_below))
    )
    return Matching(by_part, by_group, unused)


def _has_data(row: BOMEntry) -> bool:
    return row.has_mass or row.has_material


class _Claims:
    """Which row was given to how many instances."""

    def __init__(self, table: BomTable, read: frozenset[Reading]) -> None:
        self._table = table
        self.read = read
        self._count: dict[int, int] = defaultdict(int)
        self._used: set[int] = set()

    def used(self, row: BOMEntry) -> bool:
        return id(row) in self._used

    def take(self, pair: Pair) -> None:
        for row in pair.bundle.rows:
            self._used.add(id(row))
            self._count[id(row)] += pair.product.count

    def open_for(self, row: BOMEntry, product: Product) -> bool:
        """A used row still takes a product where its quantity leaves room for all of its instances."""
        if not self.used(row):
            return True
        total = self._table.total_quantity(row) if Reading.PER_PARENT in self.read else row.quantity
        return total is not None and self._count[id(row)] + product.count <= total


def _rows_for_parts(table: BomTable) -> tuple[BOMEntry, ...]:
    """Rows without children; one with children only where no other row has its name."""
    leaves = {plain(row.name) for row in table.rows if not row.has_children}
    return tuple(row for row in table.rows if not row.has_children or plain(row.name) not in leaves)


def _tiers(
    products: Sequence[Product],
    rows: Sequence[BOMEntry],
    table: BomTable,
    density: DensityOf,
    claims: _Claims,
) -> dict[str, Match]:
    found: dict[str, Match] = {}
    for rule, candidates in _finders(rows):
        wanted = [product for product in products if product.key not in found]
        options = {p.key: [r for r in candidates(p) if claims.open_for(r, p)] for p in wanted}
        for same, theirs in _components(wanted, options):
            for pair in assign(same, theirs, table, density, claims.read):
                claims.take(pair)
                found[pair.product.key] = Match(pair.bundle, rule, pair.decided, pair.doubt)
    return _with_doubtful_shapes(products, found)


def _with_doubtful_shapes(products: Sequence[Product], found: dict[str, Match]) -> dict[str, Match]:
    """A row has one mass; of the different shapes that got it, one at most can weigh that."""
    by_row: dict[int, list[Product]] = defaultdict(list)
    for product in products:
        if product.key in found and found[product.key].row.has_mass and product.volume_m3 > 0:
            by_row[id(found[product.key].row)].append(product)
    for same in by_row.values():
        if _shapes_differ(same):
            names = listed(list(dict.fromkeys(product.name for product in same)))
            words = (
                f"{len(same)} different shapes are named {names} and the BOM has one mass for all of them; "
                "each got it"
            )
            for key, match in ((p.key, found[p.key]) for p in same):
                found[key] = replace(match, doubt=match.doubt or words)
    return found


Finder = Callable[[Product], Sequence[BOMEntry]]


def _finders(rows: Sequence[BOMEntry]) -> Iterable[tuple[Rule, Finder]]:
    by_name = _index(rows, lambda row: (row.name,))
    by_plain = _index(rows, lambda row: (plain(row.name),))
    by_bare = _index(rows, lambda row: (bare(row.name),))
    by_number = _index(rows, lambda row: (plain(row.part_number), plain(row.name)))
    lossy_rows = [row for row in rows if is_lossy(row.name)]

    def wildcard(product: Product) -> list[BOMEntry]:
        if is_lossy(product.name):
            return [row for row in rows if could_be(product.name, row.name)]
        return [row for row in lossy_rows if could_be(row.name, product.name)]

    def one_mark(product: Product) -> list[BOMEntry]:
        # Of two different marks ("1:5", "1:10") neither is an occurrence.
        name = product.name
        rows = by_bare.get(bare(name), ())
        return [row for row in rows if plain(row.name) == bare(name) or plain(name) == bare(row.name)]

    def number(product: Product) -> list[BOMEntry]:
        # A product may be named by its number, or carry a number that the BOM shows as the name.
        keys = [plain(text) for text in (product.part_number, product.name) if _tells_apart(text)]
        return list({id(row): row for key in keys for row in by_number.get(key, ())}.values())

    yield Rule.EXACT, lambda product: by_name.get(product.name, ())
    yield Rule.NORMALISED, lambda product: by_plain.get(plain(product.name), ())
    yield Rule.NORMALISED, one_mark
    yield Rule.WILDCARD, wildcard
    yield Rule.PART_NUMBER, number


def _tells_apart(number: str) -> bool:
    """Exporters number products 1, 2, 3, and so do BOMs; that both count says nothing about a part."""
    return bool(number.strip()) and not re.fullmatch(r"\s*\d{1,3}\s*", number)


def _index(
    rows: Sequence[BOMEntry], keys: Callable[[BOMEntry], Sequence[str]]
) -> Mapping[str, Sequence[BOMEntry]]:
    index: dict[str, list[BOMEntry]] = defaultdict(list)
    for row in rows:
        for key in dict.fromkeys(keys(row)):
            if key:
                index[key].append(row)
    return index


def _components(
    products: Sequence[Product], options: Mapping[str, Sequence[BOMEntry]]
) -> list[tuple[list[Product], list[BOMEntry]]]:
    """Products that compete for the same rows, together with those rows, in order of appearance."""
    group_of: dict[int, int] = {}
    groups: dict[int, tuple[list[Product], list[BOMEntry]]] = {}
    fresh = count()
    for product in products:
        rows = options[product.key]
        if not rows:
            continue
        touching = sorted({group_of[id(row)] for row in rows if id(row) in group_of})
        home = touching[0] if touching else next(fresh)
        members, theirs = groups.setdefault(home, ([], []))
        for other in touching[1:]:
            more, more_rows = groups.pop(other)
            members += more
            theirs += more_rows
        members.append(product)
        theirs += [row for row in rows if id(row) not in group_of]
        for row in theirs:
            group_of[id(row)] = home
    return [(members, sorted(theirs, key=lambda row: row.line)) for members, theirs in groups.values()]
