# SPDX-License-Identifier: LGPL-2.1-or-later
"""The one summary of a product over its whole graph: what is open, mass and cost, counts, the last change.

Every view, export and answer shows it and counts nothing itself. It is kept per assembly
(``product_summaries``) and made from the assembly's own lines and the kept summaries of what is in it, so
that after a change only the way up is made again. Only ``component`` lines are followed.

**When it is valid.** What changes an item, its BOM or its file announces an event, but for a refused sync,
which only says so. What is kept of the item and of all that it is in goes in the same transaction
(``db.engine``). A read makes what is missing from its own snapshot. A thread keeps it later, under the lock
of the event log, and only what no event since that snapshot concerns: so nothing that is kept is old, and
looking changes nothing. What is too large for a read, the thread makes bottom up.

**Always closed.** If an assembly is kept, so are all assemblies in it; so what is not kept has nothing kept
above it, and outdating an item stops there.

Mass: each leaf's ``mass_kg`` [kg] times its total quantity. If something below a sub-assembly has no mass but
the sub-assembly states ``mass_kg``, that stands for the whole of it. Cost: each leaf's ``standard_cost``, per
``currency``.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence, Set
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime, timedelta
from decimal import Decimal
from itertools import chain, zip_longest
from typing import Any, NamedTuple

from sqlalchemy import delete, select

from silo.bom.errors import BusyError, CycleError, counted
from silo.bom.quantities import as_decimal, exact_product, exact_sum
from silo_server.db.database import Database
from silo_server.db.rows import insert_rows, one_of
from silo_server.db.tables import (
    bom_changes,
    bom_last_syncs,
    bom_lines,
    items,
    product_summaries,
)
from silo_server.db.tables import events as event_log
from silo_server.db.transaction import EVENT_LOCK, Tx
from silo_server.db.usage import uses_of
from silo_server.events import log
from silo_server.fields import names_of
from silo_server.services.bom.conflicts import conflicts_in
from silo_server.services.bom.last_sync import NEVER, last_syncs
from silo_server.services.bom.lines import select_lines, to_line
from silo_server.services.product.graph import MAX_DEPTH, Graph, children_first
from silo_server.services.product.parts import currency_of, positive_number
from silo_server.times import stamp
from silo_server.user_json import dumps
from silo_server.values import Item, Line

# So many items without a value are named; the others are counted.
MOST_NAMED = 12
# Assemblies with so many lines are made at once if a part of a product is kept after the other.
BATCH_LINES = 20_000
# A list of items sums up what has so many lines in all.
MOST_FOR_A_LIST = 2000
# [s] Its waits and its statements.
LONGEST_CHANGE = 300


class OpenBom(NamedTuple):
    """What is open in one BOM: lines that CAD no longer has, conflicts, and what its last sync left out."""

    part_number: str
    unreferenced: int = 0
    conflicts: int = 0
    incomplete: str = ""

    @property
    def questions(self) -> str:
        """Count what a person has to decide there, in words."""
        counts = ((self.unreferenced, "unreferenced line"), (self.conflicts, "conflict"))
        return ", ".join(counted(count, word) for count, word in counts if count)

    @property
    def words(self) -> str:
        """Describe all that is open, with what the last sync left out."""
        return ", ".join(filter(None, (self.questions, self.incomplete)))


class MassAndCost(NamedTuple):
    """What one piece of an item weighs [kg] and costs, per currency; of an assembly, all that is in it.

    ``whole``: nothing that belongs to it is without a value.
    """

    mass: Decimal | None
    mass_whole: bool
    costs: Mapping[str, Decimal]
    cost_whole: bool


class LastChange(NamedTuple):
    """When something of the product changed last, who did it, and to which item."""

    at: str
    username: str
    part_number: str


@dataclass(frozen=True, slots=True)
class Summary:
    """One product, or a part.

    open
        a BOM's internal id → what is open there; of the product's own BOM and of all below it.
    worth, as_part
        mass and cost of what is in it; and those that it counts with in another product.
    levels
        how many rows each level of its tree has, at most ``MAX_DEPTH`` levels.
    parts, assemblies, lines
        how many different leaf parts and sub-assemblies are in it, and lines in all their BOMs.
    no_mass, no_cost
        how many of the parts lack a value that nothing above them states.
    mass_missing, cost_missing
        the first of their part numbers.
    outdated
        lines, over all levels, that name an older revision than the newest.
    """

    open: Mapping[int, OpenBom]
    worth: MassAndCost
    as_part: MassAndCost
    changed: LastChange
    levels: Sequence[int] = ()
    parts: int = 0
    assemblies: int = 0
    lines: int = 0
    no_mass: int = 0
    no_cost: int = 0
    outdated: int = 0
    mass_missing: Sequence[str] = ()
    cost_missing: Sequence[str] = ()

    def told(self, but: int | None = None) -> list[tuple[str, str]]:
        """List (part number, what is open there) of each BOM except ``but``, by part number."""
        return sorted((bom.part_number, bom.words) for item_id, bom in self.open.items() if item_id != but)

    def inside(self, own: int, *, is_open: bool) -> list[str]:
        """Describe what is open in an item, for its row in a tree.

        ``own`` is the item's internal id. An open row shows its lines, so that only what is incomplete is
        named.
        """
        here = self.open.get(own, OpenBom(""))
        below = len(self.open) - (own in self.open)
        words = [here.incomplete]
        if not is_open:
            words += [here.questions, f"open in {counted(below, 'BOM')} below" if below else ""]
        return [*filter(None, words)]

    @property
    def stands_alone(self) -> bool:
        """Return True if the assembly states its mass in place of parts that state none."""
        return self.as_part.mass_whole and not self.worth.mass_whole

    @property
    def questions(self) -> int:
        """Count the lines that wait for a person."""
        return sum(bom.unreferenced + bom.conflicts for bom in self.open.values())

    @property
    def incomplete(self) -> int:
        """Count the BOMs that lack something."""
        return sum(bool(bom.incomplete) for bom in self.open.values())


class _Node(NamedTuple):
    """A summary with what those above it need: the internal ids that count for them, each once.

    parts
        of the leaf parts, or its own if it is a leaf; ``no_mass`` and ``no_cost`` are those without a value.
    assemblies
        of what has a BOM, itself included → [its lines, those of them that name an older revision].
    """

    summary: Summary
    parts: Set[int]
    no_mass: Set[int]
    no_cost: Set[int]
    assemblies: Mapping[int, Sequence[int]]


class Built(NamedTuple):
    """What a read made, to be kept: the newest event of its snapshot, its time, and the rows."""

    head: int
    at: str
    rows: Sequence[Mapping[str, Any]]


class Unmade(NamedTuple):
    """Products (internal ids) that are too large for one read to make."""

    item_ids: Collection[int]


def summary_of(tx: Tx, item: Item) -> Summary:
    """Return the summary of one product. Raises CycleError; BusyError while a large one is summed up."""
    return summaries(tx, [item.id])[item.id]


def summaries(tx: Tx, item_ids: Collection[int]) -> dict[int, Summary]:
    """Return the summaries of these items by internal id; those that are not kept are made."""
    wanted = set(item_ids)
    by_item = dict(_stored(tx, wanted))
    made = _make(tx, wanted - by_item.keys(), tx.settings.max_expanded_rows)
    return by_item | {item_id: node.summary for item_id, node in made.items()}


def marks_of(tx: Tx, listed: Iterable[Item]) -> dict[int, list[str]]:
    """Describe what is open in each of these products, for a list of them."""
    wanted = {item.id for item in listed if item.item_type == "assembly" or item.bom_version}
    by_item = at_once(tx, wanted)
    return {item_id: summary.inside(item_id, is_open=False) for item_id, summary in by_item.items()}


def at_once(tx: Tx, wanted: Set[int]) -> dict[int, Summary]:
    """Return the summaries of these items; a large product is absent until the server has summed it up."""
    by_item = dict(_stored(tx, wanted))
    with suppress(BusyError, CycleError):
        made = _make(tx, wanted - by_item.keys(), MOST_FOR_A_LIST)
        by_item |= {item_id: node.summary for item_id, node in made.items()}
    return by_item


def standing_alone(tx: Tx, graph: Graph) -> set[int]:
    """Find the assemblies of a graph that state a mass in place of parts without one, by internal id."""
    by_item = summaries(tx, graph.lines.keys() - {graph.root.id})
    return {item_id for item_id, summary in by_item.items() if summary.stands_alone}


def _stored(tx: Tx, item_ids: Collection[int]) -> Iterator[tuple[int, Summary]]:
    row = product_summaries.c
    query = select(row.item_id, row.summary).where(one_of(tx, row.item_id, item_ids))
    for item_id, written in tx.conn.execute(query):
        yield item_id, _summary(written)


def _make(tx: Tx, wanted: Collection[int], most: int | None = None) -> dict[int, _Node]:
    """Make the nodes of these items from the lines below them that are not kept, at most so many."""
    if not wanted:
        return {}
    lines, nodes = _lines_below(tx, wanted, most)
    children = {line.child_id for below in lines.values() for line in below}
    own = _own(tx, {*wanted, *lines, *children} - nodes.keys())
    maker = _Maker(lines, nodes, own, _open(tx, lines, own), _bom_changes(tx, lines))
    edges = {part_id: [line.child_id for line in rows if _followed(line)] for part_id, rows in lines.items()}
    for item_id in children_first(
        edges, wanted, lambda: {part_id: facts.part_number for part_id, facts in own.items()}
    ):
        maker.node(item_id)
    products = {part_id for part_id in own if part_id in lines or own[part_id].is_assembly}
    if products and tx.built is not None:
        head = log.bounds(tx)[1]
        tx.built.append(
            Built(
                head,
                tx.stamp,
                [_row(product, nodes[product]) for product in sorted(products) if product in nodes],
            )
        )
    return {part_id: nodes[part_id] for part_id in wanted}


def _followed(line: Line) -> bool:
    return line.state.rel_type == "component"


def _lines_below(
    tx: Tx, wanted: Collection[int], most: int | None
) -> tuple[dict[int, list[Line]], dict[int, _Node]]:
    """Read the lines of these items and of all below them, down to kept nodes; return both."""
    lines: dict[int, list[Line]] = {}
    nodes: dict[int, _Node] = {}
    level, seen, count = set(wanted), set(wanted), 0
    while level:
        query = select_lines().where(one_of(tx, bom_lines.c.parent_id, level))
        ordered = query.order_by(bom_lines.c.parent_id, bom_lines.c.position)
        if most is not None:
            ordered = ordered.limit(most - count + 1)
        below: set[int] = set()
        with tx.conn.execute(ordered, execution_options={"yield_per": 2000}) as rows:
            for row in rows:
                count += 1
                if most is not None and count > most:
                    if tx.built is not None:
                        tx.built.append(Unmade(wanted))
                    raise BusyError(
                        f"there are more than {most} different lines in this product that are not summed up "
                        "yet. The server sums them up now: ask again in a minute, or look at a sub-assembly"
                    )
                line = to_line(row)
                lines.setdefault(line.parent_id, []).append(line)
                if _followed(line):
                    below.add(line.child_id)
        level = below - seen
        seen |= level
        row_of = product_summaries.c
        kept = select(product_summaries).where(one_of(tx, row_of.item_id, level))
        for row_below in tx.conn.execute(kept):
            nodes[row_below.item_id] = _node(row_below)
        level -= nodes.keys()
    return lines, nodes


class _Own(NamedTuple):
    """What an item says of itself."""

    part_number: str
    is_assembly: bool
    worth: MassAndCost
    changed: LastChange


def _own(tx: Tx, item_ids: Collection[int]) -> dict[int, _Own]:
    row = items.c
    query = select(
        row.id,
        row.part_number,
        row.item_type,
        row.properties,
        row.updated_at,
        row.updated_by,
    )
    return {
        item_id: _Own(number, kind == "assembly", own_worth(json.loads(text)), LastChange(at, by, number))
        for item_id, number, kind, text, at, by in tx.conn.execute(query.where(one_of(tx, row.id, item_ids)))
    }


def own_worth(properties: Mapping[str, Any]) -> MassAndCost:
    """Read the mass [kg] and the cost that an item states itself."""
    mass, cost = positive_number(properties, "mass_kg"), positive_number(properties, "standard_cost")
    costs = {currency_of(properties): as_decimal(cost)} if cost is not None else {}
    return MassAndCost(None if mass is None else as_decimal(mass), mass is not None, costs, bool(costs))


def _open(tx: Tx, lines: Mapping[int, Sequence[Line]], own: Mapping[int, _Own]) -> dict[int, OpenBom]:
    """Find what is open in each of these BOMs themselves; a BOM without open questions is absent."""
    ids = {item_id for item_id in own if item_id in lines or own[item_id].is_assembly}
    syncs, conflicts = last_syncs(tx, ids), conflicts_in(tx, lines)
    boms: dict[int, OpenBom] = {}
    for item_id in ids:
        last, below = syncs.get(item_id, NEVER), lines.get(item_id, ())
        incomplete = f"incomplete: {last.words}" if last.gaps else ""
        if not incomplete and last.at is None and not below:
            incomplete = "never synced"
        gone = sum(line.state.unreferenced_since is not None for line in below)
        made = OpenBom(own[item_id].part_number, gone, len(conflicts.get(item_id, ())), incomplete)
        if made.words:
            boms[item_id] = made
    return boms


def _bom_changes(tx: Tx, parent_ids: Collection[int]) -> dict[int, tuple[str, str]]:
    """Find when each of these BOMs last changed, and who changed it."""
    row = bom_changes.c
    query = select(row.parent_id, row.at, row.username).join(
        items, (items.c.id == row.parent_id) & (items.c.bom_version == row.version)
    )
    ordered = query.where(one_of(tx, row.parent_id, parent_ids)).order_by(row.id.desc())
    return {parent_id: (at, who) for parent_id, at, who in tx.conn.execute(ordered)}


@dataclass(frozen=True, slots=True)
class _Maker:
    """Makes nodes from what was read; ``nodes`` has those of all that is kept, and each that is made."""

    lines: Mapping[int, Sequence[Line]]
    nodes: dict[int, _Node]
    own: Mapping[int, _Own]
    open: Mapping[int, OpenBom]
    bom_changes: Mapping[int, tuple[str, str]]

    def node(self, item_id: int) -> _Node:
        """Return the node of an item; make it, from the nodes of its sub-assemblies, if there is none."""
        if item_id not in self.nodes:
            self.nodes[item_id] = self._made(item_id)
        return self.nodes[item_id]

    def _made(self, item_id: int) -> _Node:
        own, lines = self.own[item_id], self.lines.get(item_id, ())
        below = [(line, self.node(line.child_id)) for line in lines if _followed(line)]
        nodes = list({line.child_id: node for line, node in below}.values())
        worth = _sum_of(below) if below else own.worth
        states_all = not worth.mass_whole and own.worth.mass is not None
        as_part = worth._replace(mass=own.worth.mass, mass_whole=True) if states_all else worth
        open_ones = {part_id: bom for node in nodes for part_id, bom in node.summary.open.items()}
        changes = [own.changed, *(node.summary.changed for node in nodes)]
        if item_id in self.open:
            open_ones[item_id] = self.open[item_id]
        if item_id in self.bom_changes:
            changes.append(LastChange(*self.bom_changes[item_id], own.part_number))
        me = set() if below else {item_id}
        parts = me.union(*(node.parts for node in nodes))
        unweighed = [node for node in nodes if not node.summary.as_part.mass_whole]
        no_mass = (set() if worth.mass_whole else me).union(*(node.no_mass for node in unweighed))
        no_cost = (set() if worth.cost_whole else me).union(*(node.no_cost for node in nodes))
        assemblies = {part_id: counts for node in nodes for part_id, counts in node.assemblies.items()}
        older = sum(line.newer_revision_exists for line in lines)
        summary = Summary(
            open=open_ones,
            worth=worth,
            as_part=as_part,
            changed=max(changes),
            levels=_levels(len(lines), [node.summary.levels for _, node in below]),
            parts=len(parts - me),
            assemblies=len(assemblies),
            lines=len(lines) + sum(counts[0] for counts in assemblies.values()),
            no_mass=len(no_mass),
            no_cost=len(no_cost),
            outdated=older + sum(counts[1] for counts in assemblies.values()),
            mass_missing=_first(me & no_mass, own, (node.summary.mass_missing for node in unweighed)),
            cost_missing=_first(me & no_cost, own, (node.summary.cost_missing for node in nodes)),
        )
        if lines or own.is_assembly:
            assemblies[item_id] = (len(lines), older)
        return _Node(summary, parts, no_mass, no_cost, assemblies)


def _first(me: Collection[int], own: _Own, below: Iterable[Sequence[str]]) -> list[str]:
    return sorted({*chain.from_iterable(below), *(own.part_number for _ in me)})[:MOST_NAMED]


def _sum_of(below: Sequence[tuple[Line, _Node]]) -> MassAndCost:
    mass: Decimal | None = None
    costs: dict[str, Decimal] = {}
    parts = [node.summary.as_part for _, node in below]
    for (line, _), worth in zip(below, parts, strict=True):
        quantity = as_decimal(line.state.quantity)
        if worth.mass is not None:
            mass = exact_sum((mass or Decimal(0), exact_product((quantity, worth.mass))))
        for currency, cost in worth.costs.items():
            costs[currency] = exact_sum((costs.get(currency, Decimal(0)), exact_product((quantity, cost))))
    whole = (all(worth.mass_whole for worth in parts), all(worth.cost_whole for worth in parts))
    return MassAndCost(mass, whole[0], costs, whole[1])


def _levels(rows: int, below: Iterable[Sequence[int]]) -> list[int]:
    deeper = [sum(level) for level in zip_longest(*below, fillvalue=0)]
    return [rows, *deeper][:MAX_DEPTH] if rows else []


def _row(item_id: int, node: _Node) -> dict[str, Any]:
    summary = {name: getattr(node.summary, name) for name in names_of(Summary)}
    sets = {name: sorted(getattr(node, name)) for name in ("parts", "no_mass", "no_cost")}
    return {
        "item_id": item_id,
        "summary": json.dumps(summary, separators=(",", ":"), default=str),
        "sets": dumps(sets | {"assemblies": node.assemblies}),
    }


def _summary(text: str) -> Summary:
    loads = json.loads(text)
    for name in ("worth", "as_part"):
        mass, mass_whole, costs, cost_whole = loads[name]
        exact = {currency: Decimal(cost) for currency, cost in costs.items()}
        loads[name] = MassAndCost(None if mass is None else Decimal(mass), mass_whole, exact, cost_whole)
    loads["open"] = {int(parent_id): OpenBom(*values) for parent_id, values in loads["open"].items()}
    return Summary(**loads | {"changed": LastChange(*loads["changed"])})


def _node(row: Any) -> _Node:
    sets = json.loads(row.sets)
    parts, no_mass, no_cost = (frozenset(sets[name]) for name in ("parts", "no_mass", "no_cost"))
    assemblies = {int(item_id): counts for item_id, counts in sets["assemblies"].items()}
    return _Node(_summary(row.summary), parts, no_mass, no_cost, assemblies)


def keep_summaries(db: Database, ended: Callable[[], bool] = lambda: False) -> None:
    """Store the summaries that reads have made, unless an event since then concerns them.

    ended
        says whether to stop before a product that no read could make is made whole.
    """
    while db.built:
        built = db.built.popleft()
        if isinstance(built, Unmade):
            with suppress(CycleError):  # the read that asked says so
                _keep_below(db, built.item_ids, ended=ended)
            continue
        with db.write(even_when_read_only=True) as tx:
            tx.lock(EVENT_LOCK)
            _keep(tx, built)


def _keep(tx: Tx, built: Built) -> None:
    if built.head < log.horizon_of(tx):
        return
    since = select(event_log.c.item_uuid).where(event_log.c.id > built.head)
    # A refused sync has no event, and a time that may be before the look by as long as a change may take.
    begun = stamp(datetime.fromisoformat(built.at) - timedelta(seconds=LONGEST_CHANGE))
    refused = select(bom_last_syncs.c.parent_id).where(bom_last_syncs.c.refused_at > begun)
    touched = set(tx.conn.scalars(uses_of(items.c.uuid.in_(since) | items.c.id.in_(refused))))
    rows = [row for row in built.rows if row["item_id"] not in touched]
    if rows:
        ids = [row["item_id"] for row in rows]
        tx.conn.execute(delete(product_summaries).where(one_of(tx, product_summaries.c.item_id, ids)))
        insert_rows(tx, product_summaries, rows)


def keep_all(db: Database, report: Callable[[str], None] = lambda _: None) -> int:
    """Make the summaries of all assemblies again; return how many. The server may run meanwhile."""
    with db.write(even_when_read_only=True) as tx:
        tx.lock(EVENT_LOCK)
        tx.conn.execute(delete(product_summaries))
    with db.read() as tx:
        products = set(tx.conn.scalars(select(items.c.id).where(items.c.item_type == "assembly")))
        products |= set(tx.conn.scalars(select(bom_lines.c.parent_id).distinct()))
    return _keep_below(db, products, report)


def _keep_below(
    db: Database,
    wanted: Collection[int],
    report: Callable[[str], None] = lambda _: None,
    ended: Callable[[], bool] = lambda: False,
) -> int:
    """Make and keep the summaries that these products lack, part by part; return how many.

    So a read of a product of any size finds all that it needs kept.
    """
    below: dict[int, list[int]] = {}
    counts: Counter[int] = Counter()
    with db.read() as tx:
        line = bom_lines.c
        kept = select(product_summaries.c.item_id)
        scalars = tx.conn.scalars(kept.where(one_of(tx, product_summaries.c.item_id, wanted)))
        level = set(wanted).difference(scalars)
        unmade = set(level)
        while level:
            query = select(line.parent_id, line.child_id, line.rel_type)
            query = query.where(one_of(tx, line.parent_id, level), line.child_id.not_in(kept))
            level = set()
            with tx.conn.execute(query, execution_options={"yield_per": 5000}) as rows:
                for parent_id, child_id, rel_type in rows:
                    counts[parent_id] += 1
                    if rel_type == "component":
                        below.setdefault(parent_id, []).append(child_id)
                        level.add(child_id)
            level -= unmade
            unmade |= level
        number_of = select(items.c.id, items.c.part_number).where(one_of(tx, items.c.id, below))
        names = dict(tx.conn.execute(number_of).all())
    order, done = list(children_first(below, sorted(unmade & {*wanted, *below}), lambda: names)), 0
    for part in _parts(order, counts):
        if ended():
            break
        with db.read() as tx:
            _make(tx, part)
        keep_summaries(db, ended)
        done += len(part)
        report(f"{done} of {len(order)} assemblies")
    return done


def _parts(order: Iterable[int], counts: Mapping[int, int]) -> Iterator[list[int]]:
    """Yield the assemblies in groups of up to :data:`BATCH_LINES` lines; one alone may have more."""
    part: list[int] = []
    lines = 0
    for item_id in order:
        if part and lines + counts[item_id] > BATCH_LINES:
            yield part
            part, lines = [], 0
        part.append(item_id)
        lines += counts[item_id]
    if part:
        yield part
