# SPDX-License-Identifier: LGPL-2.1-or-later
"""The whole tree below an item: expanded, flat, and the way up (where-used).

One recursive query brings every line below an item, each once however often its assembly is used; what is
multiplied is multiplied here. Only ``component`` lines are followed.

Cost and mass of an assembly part by part, with everything that is missing named; the rules are those of
:mod:`silo_server.services.bom.summary`.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from functools import cache, lru_cache
from itertools import chain, islice
from typing import Any, NamedTuple, TypeVar

from sqlalchemy import ColumnElement, Select, func, literal, select

from silo.bom.errors import ConflictError, CycleError
from silo.bom.numbers import read_number
from silo.bom.quantities import as_decimal, exact_product, exact_sum, plain, says_the_same
from silo_server.db.rows import among, one_of
from silo_server.db.tables import bom_conflicts, bom_lines, items
from silo_server.db.transaction import Tx
from silo_server.errors import TooLargeError
from silo_server.services.bom.lines import child_of, select_lines, to_line
from silo_server.services.items import by_ids
from silo_server.services.search import fits
from silo_server.values import Item, Line, bought

MAX_DEPTH = 20
# Properties that a filter looks in beside number, name and description.
SOUGHT = ("supplier", "supplier_part_number", "manufacturer")
# What quantities multiply and add up to, at most: exact as a JSON number, and more than anybody orders.
MAX_TOTAL = 10**15
# So many rows get what they show of their parts at once.
PORTION = 1000
R = TypeVar("R")
# Totals are exact: counts as they are, lengths and masses as decimals.
Exact = int | Decimal


# Child (internal id) → what CAD says of its line in conflict, and since when.
Told = dict[int, tuple[float, str]]


@dataclass(frozen=True, slots=True)
class Graph:
    """Everything below ``root``: the lines of every assembly in it, by the assembly's internal id."""

    root: Item
    lines: Mapping[int, Sequence[Line]]
    conflicts: Mapping[int, Told] = field(default_factory=dict)

    def told(self, line: Line) -> float | None:
        """Return CAD's quantity for a line in conflict (0: not in CAD); None if there is no conflict."""
        if line.state.rel_type != "component" or line.child_id not in self.conflicts.get(line.parent_id, ()):
            return None
        return self.conflicts[line.parent_id][line.child_id][0]

    def doubts(self, line: Line) -> list[str]:
        """List what a person still has to decide about a line, in words."""
        quantity = self.told(line)
        doubts = ["unreferenced"] if line.state.unreferenced_since else []
        if quantity is not None:
            doubts.append(f"CAD says {plain(quantity)}" if quantity else "CAD no longer has it")
        return doubts

    def names(self) -> dict[int, str]:
        """Return internal id → part number of the root and of all items below it."""
        below = {line.child_id: line.child_part_number for lines in self.lines.values() for line in lines}
        return below | {self.root.id: self.root.part_number}

    def components(self, item_id: int) -> list[Line]:
        """Return the component lines of an item; only these are followed."""
        return [line for line in self.lines.get(item_id, ()) if line.state.rel_type == "component"]


class Occurrence(NamedTuple):
    """A line somewhere in the expanded tree. ``depth`` 1 = direct child; ``total`` per one root."""

    line: Line
    parent_part_number: str
    depth: int
    total: Exact


class FlatRow(NamedTuple):
    """A leaf part: how much of it one root needs in all.

    gone
        how much of it comes from lines, on any level, that CAD no longer has.
    disputed
        true if a quantity on the way to it is in conflict.
    """

    line: Line
    unit: str | None
    total: Exact
    gone: Exact = 0
    disputed: bool = False

    def doubts(self, pieces: int = 1) -> list[str]:
        """List what a person still has to decide about the part, in words."""
        doubt_texts = ["unreferenced"] if self.gone else []
        if 0 < self.gone < self.total:
            doubt_texts = [f"{plain(self.gone * pieces)} of {plain(self.total * pieces)} unreferenced"]
        return [*doubt_texts, "a quantity in conflict"] if self.disputed else doubt_texts


@dataclass(frozen=True, slots=True)
class Usage:
    """One use of an item: in which parent, how much, how many steps up (1 = direct)."""

    parent: Item
    quantity: float
    unit: str | None
    rel_type: str
    source: str
    depth: int


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
                    f"there are more than {most} different lines below {root.part_number}; ask for one of "
                    "its sub-assemblies, or for less with depth="
                )
            if (child := names.get(row[2])) is None:
                names[row[2]] = child = child_of(row)
            lines.setdefault(row[1], []).append(to_line(row, child))
    return Graph(root, lines, conflicts_in(tx, lines))


# Thousands of conflicts are of a few quantities.
_says_the_same = lru_cache(maxsize=4096)(says_the_same)


def conflicts_in(tx: Tx, parent_ids: Collection[int] | None = None) -> dict[int, Told]:
    """Find the conflicts of the last merges that neither a decision nor an edit has settled since.

    parent_ids
        of these BOMs only; None: of all.
    """
    collection, line = bom_conflicts.c, bom_lines.c
    # An outer join begins with the few that are asked about: else SQLite reads all lines, for each page.
    theirs = (line.parent_id == collection.parent_id) & (line.child_id == collection.child_id)
    whose = theirs & (line.rel_type == "component") & (line.source == "manual")
    query = select(
        collection.parent_id,
        collection.child_id,
        collection.cad_quantity,
        collection.since,
        line.quantity,
        line.unit,
    )
    query = query.outerjoin_from(bom_conflicts, bom_lines, whose).where(~collection.accepted)
    if parent_ids is not None:
        query = query.where(one_of(tx, collection.parent_id, parent_ids))
    conflicts: dict[int, Told] = {}
    for parent_id, child_id, cad_quantity, since, quantity, unit in tx.conn.execute(query):
        if quantity is not None and not _says_the_same(cad_quantity, quantity, unit):
            conflicts.setdefault(parent_id, {})[child_id] = (cad_quantity, since)
    return conflicts


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


def portions(rows: Iterable[R]) -> Iterator[list[R]]:
    """Yield the rows in lists of up to :data:`PORTION` rows."""
    rest = iter(rows)
    while portion := list(islice(rest, PORTION)):
        yield portion


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


def leaves_in(graph: Graph, rows: Sequence[FlatRow], closed: Collection[int] = ()) -> Sequence[FlatRow]:
    """Replace the assemblies among rows of a flat list by their leaf parts; ``closed`` as :func:`flatten`."""
    if {item_id for item_id in graph.lines if graph.components(item_id)}.isdisjoint(
        row.line.child_id for row in rows
    ):
        return rows
    lines = [
        row.line
        if row.total == row.line.state.quantity
        else row.line._replace(state=replace(row.line.state, quantity=float(row.total)))
        for row in rows
    ]
    return flatten(Graph(graph.root, {**graph.lines, graph.root.id: lines}), closed)


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


def expand(graph: Graph, depth: int, limit: int) -> Iterator[Occurrence]:
    """Yield the tree as rows, parents before their children. Raises CycleError, TooLargeError."""
    order_of(graph)  # finds a cycle before it is walked
    count = 0
    graph_lines = graph.lines
    exact: Exact = 1
    stack = [(graph.root.part_number, 1, exact, iter(graph_lines.get(graph.root.id, ())))]
    while stack:
        parent, level, factor, lines = stack[-1]
        for line in lines:
            state = line.state
            total = multiplied(factor, line)
            count += 1
            yield Occurrence(line, parent, level, total)
            below = graph_lines.get(line.child_id)
            if below and level < depth and state.rel_type == "component":
                stack.append((line.child_part_number, level + 1, total, iter(below)))
                break
        else:
            stack.pop()
        if count > limit:
            raise TooLargeError(
                f"the expanded BOM of {graph.root.part_number} has more than {limit} lines; "
                "ask for less with depth="
            )


def flatten(graph: Graph, closed: Collection[int] = ()) -> list[FlatRow]:
    """Add up the quantities of the leaf parts; their order is that in which the tree first shows them.

    closed
        assemblies (internal ids) that count as parts.
    """
    nothing: tuple[Exact, Exact, bool] = (0, 0, False)
    # How much of each assembly, how much of it CAD no longer has, whether a quantity above is in conflict.
    needs: dict[int, tuple[Exact, Exact, bool]] = {graph.root.id: (1, 0, False)}
    totals: dict[tuple[int, str | None], tuple[Exact, Exact, bool]] = {}
    shown: dict[tuple[int, str | None], Line] = {}
    components = {item_id: graph.components(item_id) for item_id in order_of(graph)}
    assemblies = {item_id for item_id, lines in components.items() if lines}.difference(closed)
    for item_id, lines in components.items():
        if item_id not in needs:
            continue  # below a closed one only
        factor, lost, disputed = needs[item_id]
        conflict = graph.conflicts.get(item_id, ())
        for line in lines:
            child, state = line.child_id, line.state
            quantity = _exact(state.quantity)
            amount = factor * quantity
            gone = amount if state.unreferenced_since else lost * quantity
            key = child, state.unit
            is_leaf = child not in assemblies
            before = totals.get(key, nothing) if is_leaf else needs.get(child, nothing)
            total = _counted(before[0] + amount, line)  # the other amounts are parts of it
            sums = total, before[1] + gone, before[2] or disputed or child in conflict
            if is_leaf:
                totals[key] = sums
                shown.setdefault(key, line)
            else:
                needs[child] = sums
    return [FlatRow(line, key[1], *totals[key]) for key, line in shown.items()]


@lru_cache(maxsize=4096)
def _exact(quantity: float) -> Exact:
    return int(quantity) if quantity.is_integer() else as_decimal(quantity)


def multiplied(factor: Exact, line: Line) -> Exact:
    """Multiply ``factor`` by the quantity of a line; ConflictError above :data:`MAX_TOTAL`."""
    return _counted(factor * _exact(line.state.quantity), line)


def _counted(amount: Exact, line: Line) -> Exact:
    if amount > MAX_TOTAL:
        raise ConflictError(
            f"the quantities above {line.child_part_number} multiply to more than {MAX_TOTAL:.0e}, which "
            "cannot be right; look for a wrong quantity on the way to it"
        )
    return amount


def where_used(
    tx: Tx, item: Item, *, indirect: bool = False, limit: int = 1000, offset: int = 0
) -> tuple[list[Usage], int]:
    """Find a page of an item's parents, and how many there are in all.

    With ``indirect`` also their parents, the nearest first, each line once; by part number in each level.
    """
    usages: list[Usage] = []
    total = 0
    for depth, level in enumerate(_levels_above(tx, item, MAX_DEPTH if indirect else 1), start=1):
        of_level = one_of(tx, bom_lines.c.child_id, level)
        skip, room = max(0, offset - total), limit - len(usages)
        total += tx.conn.scalar(select(func.count()).select_from(bom_lines).where(of_level)) or 0
        if room > 0 and offset < total:
            usages.extend(_uses(tx, of_level, depth, room, skip))
    return usages, total


def use_counts(tx: Tx, item_ids: Collection[int]) -> dict[int, int]:
    """Count the BOM lines that each item is on; items on no line are absent."""
    query = select(bom_lines.c.child_id, func.count()).where(one_of(tx, bom_lines.c.child_id, item_ids))
    return {row[0]: row[1] for row in tx.conn.execute(query.group_by(bom_lines.c.child_id))}


def _levels_above(tx: Tx, item: Item, levels: int) -> Iterator[list[int]]:
    """Yield the item, then what uses it, then what uses that; each item in its nearest level only."""
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


DEFAULT_CURRENCY = "EUR"


class CostRow(NamedTuple):
    """A leaf part's share, as the API sends it. ``standard_cost`` None = not stated."""

    part_number: str
    name: str
    total_quantity: float
    unit: str | None
    standard_cost: float | None
    currency: str | None
    total_cost: float | None


@dataclass(frozen=True, slots=True)
class CostRollup:
    """What an assembly costs; ``totals`` per currency, ``missing`` the part numbers without a cost."""

    rows: Sequence[CostRow]
    totals: Mapping[str, float]
    missing: Sequence[str]


class MassLine(NamedTuple):
    """A part whose stated mass was taken [kg], as the API sends it.

    ``is_assembly`` if it stands for all below it.
    """

    part_number: str
    name: str
    total_quantity: float
    mass_kg: float | None
    total_mass_kg: float | None
    is_assembly: bool = False


@dataclass(frozen=True, slots=True)
class MassRollup:
    """The mass of one assembly [kg]; ``missing`` the part numbers without a mass."""

    rows: Sequence[MassLine]
    total: float
    missing: Sequence[str]


class RolledItem(NamedTuple):
    """What totals, filters and order lists read of an item; ``properties`` with its supplier."""

    part_number: str
    name: str
    description: str
    properties: Mapping[str, Any]
    thumbnail_key: str | None = None
    is_bought: bool = False
    has_bom: bool = False
    sourcing_type: str | None = None
    supplier_parts: Sequence[Mapping[str, Any]] = ()
    archived_at: str | None = None


def parts_of(tx: Tx, graph: Graph) -> dict[int, RolledItem]:
    """Read what roll-ups need of all items in the graph, by internal id."""
    return some_parts(tx, graph.names())


# What is stored is whole: without a look for spaces around it, in half the time.
_read_json = json.JSONDecoder().raw_decode


def some_parts(tx: Tx, item_ids: Collection[int]) -> dict[int, RolledItem]:
    """Read what roll-ups need of these items, by internal id."""
    row = items.c
    query = select(
        row.id,
        row.part_number,
        row.name,
        row.description,
        row.properties,
        row.thumbnail_key,
        row.supplier_parts,
        row.sourcing_type,
        row.item_type,
        row.bom_version,
        row.archived_at,
    ).where(one_of(tx, row.id, item_ids))
    parts = {}
    for part_id, number, name, about, text, key, offers, sourcing, kind, version, archived in tx.conn.execute(
        query
    ):
        properties, listed = _read_json(text)[0], json.loads(offers) if offers else ()
        if listed:
            properties = with_supplier(properties, listed)
        is_bought, has_bom = bought(sourcing, properties.get("supplier")), kind == "assembly" or version > 0
        parts[part_id] = RolledItem(
            number, name, about, properties, key, is_bought, has_bom, sourcing, listed, archived
        )
    return parts


def with_supplier(
    properties: Mapping[str, Any], listed: Sequence[Mapping[str, Any]] | None
) -> Mapping[str, Any]:
    """Add to properties the supplier that a list shows: the preferred one, else the first."""
    if not listed:
        return properties
    shown = next((line for line in listed if line["preferred"]), listed[0])
    names = {"supplier": "supplier", "supplier_part_number": "number", "lead_time_days": "lead_time_days"}
    return {**properties, **{name: shown[key] for name, key in names.items()}}


def currency_of(properties: Mapping[str, Any]) -> str:
    """Return the currency of an item's cost; :data:`DEFAULT_CURRENCY` if it states none."""
    return str(properties.get("currency") or DEFAULT_CURRENCY)


def roll_up_cost(flat: Iterable[FlatRow], parts: Mapping[int, RolledItem]) -> CostRollup:
    """Add up the cost of the flat BOM from the parts' ``standard_cost``, per currency."""
    rows, costs, missing = [], dict[str, list[Decimal]](), []
    for row in flat:
        item = parts[row.line.child_id]
        cost, currency, total = positive_number(item.properties, "standard_cost"), None, None
        if cost is None:
            missing.append(item.part_number)
        else:
            currency = currency_of(item.properties)
            exact = exact_product((cost, row.total))
            costs.setdefault(currency, []).append(exact)
            total = float(exact)
        rows.append(CostRow(item.part_number, item.name, plain(row.total), row.unit, cost, currency, total))
    totals = {currency: float(exact_sum(of_it)) for currency, of_it in costs.items()}
    return CostRollup(rows, totals, missing)


def roll_up_mass(
    flat: Iterable[FlatRow], parts: Mapping[int, RolledItem], assemblies: Collection[int]
) -> MassRollup:
    """Add up masses [kg] from the leaves; each of ``assemblies`` counts with the mass that it states.

    These assemblies are leaves of the flat BOM as well.
    """
    amounts: dict[int, Exact] = {}
    for row in flat:
        item_id = row.line.child_id
        amounts[item_id] = _counted(amounts.get(item_id, 0) + row.total, row.line)
    rows = [_mass_row(parts[part_id], amount, part_id in assemblies) for part_id, amount in amounts.items()]
    return MassRollup(
        rows,
        float(exact_sum(row.total_mass_kg for row in rows if row.total_mass_kg is not None)),
        [row.part_number for row in rows if row.total_mass_kg is None],
    )


_NUMBER = int | float | Decimal


def positive_number(properties: Mapping[str, Any], name: str) -> float | None:
    """Read a property as a number of at least 0; None if it is absent or no such number."""
    value = properties.get(name)
    if isinstance(value, str):
        value = read_number(value, points_are_decimal=True).value
    if isinstance(value, bool) or not isinstance(value, _NUMBER):
        return None
    return float(value) if 0 <= value < 1e15 else None


def _mass_row(item: RolledItem, amount: Exact, is_assembly: bool) -> MassLine:
    mass = positive_number(item.properties, "mass_kg")
    total = float(exact_product((mass, amount))) if mass is not None else None
    return MassLine(item.part_number, item.name, plain(amount), mass, total, is_assembly)
