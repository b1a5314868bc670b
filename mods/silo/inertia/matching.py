# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which row of a BOM a product has: by product and whole name, tier by tier. Pure.

Tiers: the same text; the same but for case, separators and an occurrence mark; the same but for lost
characters; the same part number. A row that an earlier tier used up is not offered to a later one.

Parts and rows that share a name are distinguished by parent, quantity and mass; else by their order, with a
warning. Rows with equal data are one :class:`Bundle` and need not be distinguished.
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from itertools import count

from silo.bom.errors import counted, listed
from silo.bom.message import message
from silo.inertia.bom.table import BOMEntry, BomTable
from silo.inertia.codes import Decided, Rule
from silo.inertia.names import bare, could_be, is_lossy, plain
from silo.inertia.products import Product

MASS_TOLERANCE = 0.02
"""Relative: how well density times volume must fit a mass to decide between rows (quantum apart)."""

DensityOf = Callable[[BOMEntry, Product], float | None]
"""[kg/m^3] of a row's material (or the part's own density); None if unknown."""


@dataclass(frozen=True, eq=False)
class Bundle:
    """Rows of one name that say the same.

    quantities
        pieces in the product by each way of reading structured quantities; empty if unknown.
    parents
        normalised names of the rows' parent rows ("" = top).
    """

    rows: tuple[BOMEntry, ...]
    quantities: frozenset[float]
    parents: frozenset[str]

    @property
    def row(self) -> BOMEntry:
        """Return the first row; the others have the same data."""
        return self.rows[0]


@dataclass(frozen=True, eq=False)
class Match:
    """How a product found its row. ``doubt``: what keeps this from being certain, "" if nothing does."""

    bundle: Bundle
    rule: Rule
    decided: Decided
    doubt: str = ""

    @property
    def row(self) -> BOMEntry:
        """Return the row (the first of several with the same data)."""
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
    matcher = _Matcher(table, _readings(parts, table))
    leaves = {plain(row.name) for row in table.rows if not row.has_children}
    # A row with children is a part's only if no other row has its name.
    rows = [row for row in table.rows if not row.has_children or plain(row.name) not in leaves]
    by_part = matcher.run(parts, rows, density)
    by_group = matcher.run(groups, table.rows, lambda row, product: None)
    told_below = {id(above) for row in table.rows if _has_data(row) for above in table.ancestors(row)}
    unused = tuple(
        row
        for row in table.rows
        if not matcher.taken[id(row)]
        and (not row.has_children or (_has_data(row) and id(row) not in told_below))
    )
    return Matching(by_part, by_group, unused)


def _has_data(row: BOMEntry) -> bool:
    return row.has_mass or row.has_material


class _Reading(StrEnum):
    """What a quantity in a structured BOM counts."""

    PER_PARENT = "per_parent"  # pieces in one parent
    TOTAL = "total"  # pieces in the whole product


def _readings(products: Sequence[Product], table: BomTable) -> frozenset[_Reading]:
    """Find the reading of the quantities that the parts with an unambiguous name show; both if they show
    none.

    Only rows count for which the readings differ, and whose name only one row and one product have.
    """
    rows = {plain(row.name): row for row in table.rows if not row.has_children}
    row_names = Counter(plain(row.name) for row in table.rows if not row.has_children)
    names = Counter(plain(product.name) for product in products)
    fits = dict.fromkeys(_Reading, 0)
    for product in products:
        name = plain(product.name)
        if names[name] != 1 or row_names[name] != 1:
            continue
        one, total = rows[name].quantity, table.total_quantity(rows[name])
        if one is not None and total is not None and one != total:
            fits[_Reading.PER_PARENT] += product.count == total
            fits[_Reading.TOTAL] += product.count == one
    low, high = sorted(fits, key=lambda reading: fits[reading])
    clear = fits[high] > 0 and fits[high] >= 2 * fits[low]
    return frozenset((high,) if clear else _Reading)


class _Matcher:
    """Matches products tier by tier. ``taken``: by id of a row, how many instances it was given to."""

    def __init__(self, table: BomTable, read: frozenset[_Reading]) -> None:
        self._table = table
        self._read = read
        self.taken: Counter[int] = Counter()

    def run(
        self, products: Sequence[Product], rows: Sequence[BOMEntry], density: DensityOf
    ) -> dict[str, Match]:
        """Match the products, and return the matches by the products' keys."""
        matches: dict[str, Match] = {}
        for rule, candidates in _finders(rows):
            wanted = [product for product in products if product.key not in matches]
            options = {p.key: [r for r in candidates(p) if self._is_open(r, p)] for p in wanted}
            for same, theirs in _components(wanted, options):
                contest = _Contest(rule, density, list(same), self._bundled(theirs))
                contest.decide()
                for product in same:
                    if product.key in contest.found:
                        self.taken.update(
                            {id(r): product.count for r in contest.found[product.key].bundle.rows}
                        )
                matches |= contest.found
        return _with_doubtful_shapes(products, matches)

    def _is_open(self, row: BOMEntry, product: Product) -> bool:
        """Let a used row take a product if its quantity leaves room for all of its instances."""
        if not self.taken[id(row)]:
            return True
        total = self._table.total_quantity(row) if _Reading.PER_PARENT in self._read else row.quantity
        return total is not None and self.taken[id(row)] + product.count <= total

    def _bundled(self, rows: Sequence[BOMEntry]) -> list[Bundle]:
        """Group the rows with equal data, in the order of their first row."""
        groups: dict[tuple[str | None, float | None], list[BOMEntry]] = {}
        for row in rows:
            groups.setdefault(row.data, []).append(row)
        return [self._bundle(tuple(group)) for group in groups.values()]

    def _bundle(self, rows: tuple[BOMEntry, ...]) -> Bundle:
        # Quantities of a structured BOM are per parent here and per product there; either may be meant.
        kinds = {
            _Reading.TOTAL: [row.quantity for row in rows],
            _Reading.PER_PARENT: [self._table.total_quantity(row) for row in rows],
        }
        sums = {sum(q for q in kinds[r] if q is not None) for r in self._read if None not in kinds[r]}
        above = {self._table.rows[row.parent].name if row.parent is not None else "" for row in rows}
        return Bundle(rows, frozenset(sums), frozenset(plain(name) for name in above))


@dataclass(eq=False)
class _Contest:
    """Products and bundles of rows of one name; who gets what ends in ``found``, by the products' keys."""

    rule: Rule
    density: DensityOf
    products: list[Product]
    bundles: list[Bundle]
    found: dict[str, Match] = field(default_factory=dict)

    def decide(self) -> None:
        """Match the products; one that is not in ``found`` afterwards has no row."""
        if len(self.bundles) == 1:
            self._share_one(self.bundles[0])
            return
        self._settle(Decided.PARENT, _same_parent)
        self._settle(Decided.QUANTITY, lambda p, b: p.count in b.quantities)
        self._settle(Decided.MASS, lambda p, b: _may_count(p, b) and self._mass_fits(p, b))
        self._settle(Decided.MASS, self._mass_fits)
        if len(self.products) == len(self.bundles) == 1 and self.found:
            self._pair(self.products[0], self.bundles[0], Decided.REMAINING)
        self._in_order()

    def _pair(self, product: Product, bundle: Bundle, decided: Decided, doubt: str = "") -> None:
        self.products.remove(product)
        self.bundles.remove(bundle)
        self.found[product.key] = Match(bundle, self.rule, decided, doubt)

    def _share_one(self, bundle: Bundle) -> None:
        """Give all products the one bundle, unless its quantity or mass fits only one of them."""
        decided = Decided.SAME_DATA if len(bundle.rows) > 1 else Decided.ONLY
        takers = self.products
        if len(takers) > 1 and bundle.quantities and sum(p.count for p in takers) not in bundle.quantities:
            by_count = [p for p in takers if p.count in bundle.quantities]
            by_mass = [p for p in takers if self._mass_fits(p, bundle)]
            if len(by_count) == 1:
                takers, decided = by_count, Decided.QUANTITY
            elif len(by_mass) == 1:
                takers, decided = by_mass, Decided.MASS
        for product in takers:
            self.found[product.key] = Match(bundle, self.rule, decided)

    def _settle(self, decided: Decided, fits: Callable[[Product, Bundle], bool]) -> None:
        """Pair, from both sides, what fits in only one way, until nothing changes."""
        changed = True
        while changed and self.products and self.bundles:
            changed = False
            for product in list(self.products):
                options = [b for b in self.bundles if fits(product, b)]
                if len(options) == 1 and sum(fits(p, options[0]) for p in self.products) == 1:
                    self._pair(product, options[0], decided)
                    changed = True

    def _in_order(self) -> None:
        left = message(
            "{products} and {bundles}",
            products=counted(len(self.products), "part"),
            bundles=counted(len(self.bundles), "row"),
        )
        for product, bundle in list(zip(self.products, self.bundles, strict=False)):
            lines = ", ".join(str(row.line) for row in bundle.rows)
            doubt = message(
                "{left} named “{name}” cannot be distinguished by parent, quantity or mass; by "
                "the order of appearance, this one got line {lines}",
                left=left,
                name=product.name,
                lines=lines,
            )
            self._pair(product, bundle, Decided.ORDER, doubt)

    def _mass_fits(self, product: Product, bundle: Bundle) -> bool:
        row = bundle.row
        rho = self.density(row, product)
        if row.mass_kg is None or rho is None or product.volume_m3 <= 0:
            return False
        allowed = max(row.quantum_kg, MASS_TOLERANCE * row.mass_kg)
        return abs(rho * product.volume_m3 - row.mass_kg) <= allowed


def _same_parent(product: Product, bundle: Bundle) -> bool:
    # Only if the BOM is structured: otherwise every row is at the top and proves nothing.
    return any(bundle.parents) and {plain(name) for name in product.parents} <= bundle.parents


def _may_count(product: Product, bundle: Bundle) -> bool:
    return not bundle.quantities or product.count in bundle.quantities


def _with_doubtful_shapes(products: Sequence[Product], matches: dict[str, Match]) -> dict[str, Match]:
    """Warn of different shapes that got the same row: at most one of them can have its mass."""
    by_row: dict[int, list[Product]] = defaultdict(list)
    for product in products:
        if product.key in matches and matches[product.key].row.has_mass and product.volume_m3 > 0:
            by_row[id(matches[product.key].row)].append(product)
    for same in by_row.values():
        volumes = [product.volume_m3 for product in same]
        if max(volumes) - min(volumes) > 0.01 * max(volumes):
            names = listed(list(dict.fromkeys(f"“{product.name}”" for product in same)), 4)
            words = message(
                "{count} different shapes are named {names} and the BOM has one mass for all of "
                "them; each got it",
                count=len(same),
                names=names,
            )
            for key, match in ((p.key, matches[p.key]) for p in same):
                matches[key] = replace(match, doubt=match.doubt or words)
    return matches


Finder = Callable[[Product], Sequence[BOMEntry]]


def _finders(rows: Sequence[BOMEntry]) -> Iterator[tuple[Rule, Finder]]:
    by_name = _index((row.name, row) for row in rows)
    by_plain = _index((plain(row.name), row) for row in rows)
    by_bare = _index((bare(row.name), row) for row in rows)
    by_number = _index((plain(text), row) for row in rows for text in {row.part_number, row.name})
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
    """Return True if a number identifies a part: exporters and BOMs both count 1, 2, 3."""
    return bool(number.strip()) and not re.fullmatch(r"\s*\d{1,3}\s*", number)


def _index(pairs: Iterable[tuple[str, BOMEntry]]) -> Mapping[str, Sequence[BOMEntry]]:
    """Map each key to its rows, each once."""
    index: dict[str, dict[int, BOMEntry]] = defaultdict(dict)
    for key, row in pairs:
        if key:
            index[key][id(row)] = row
    return {key: list(rows.values()) for key, rows in index.items()}


def _components(
    products: Sequence[Product], options: Mapping[str, Sequence[BOMEntry]]
) -> list[tuple[list[Product], list[BOMEntry]]]:
    """Group the products that compete for the same rows with these rows, in order of appearance."""
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
