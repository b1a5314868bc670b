# SPDX-License-Identifier: LGPL-2.1-or-later
"""Products ↔ BOM rows, tier by tier. By product and whole name, never by substring, never by likeness. Pure.

Tiers: the same text; the same but for case, separators and an occurrence mark; the same but for lost
characters; the same part number. A row that an earlier tier used up is not offered to a later one.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import count

from silo.inertia.assign import Bundle, DensityOf, Pair, Reading, assign, readings
from silo.inertia.bom.rows import BOMEntry, BomTable
from silo.inertia.codes import Decided, Rule
from silo.inertia.names import bare, could_be, is_lossy, plain
from silo.inertia.products import Product


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

    def number(product: Product) -> list[BOMEntry]:
        # A product may be named by its number, or carry a number that the BOM shows as the name.
        keys = [plain(text) for text in (product.part_number, product.name) if _tells_apart(text)]
        return list({id(row): row for key in keys for row in by_number.get(key, ())}.values())

    yield Rule.EXACT, lambda product: by_name.get(product.name, ())
    yield Rule.NORMALISED, lambda product: by_plain.get(plain(product.name), ())
    yield Rule.NORMALISED, lambda product: by_bare.get(bare(product.name), ())
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
