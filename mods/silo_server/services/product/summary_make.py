# SPDX-License-Identifier: LGPL-2.1-or-later
"""Making summaries: from an assembly's own lines and the kept summaries of what is in it.

So after a change only the way up is made again. Only ``component`` lines are followed.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass
from decimal import Decimal
from itertools import chain, zip_longest
from typing import Any, NamedTuple

from sqlalchemy import select

from silo.bom.errors import BusyError
from silo.bom.message import message
from silo.bom.quantities import exact_product, exact_sum
from silo_server.db.rows import one_of
from silo_server.db.tables import bom_changes, bom_lines, items, product_summaries
from silo_server.db.transaction import Tx
from silo_server.events import log
from silo_server.fields import names_of
from silo_server.services.bom.conflicts import conflicts_in
from silo_server.services.bom.last_sync import NEVER, last_syncs
from silo_server.services.bom.lines import select_lines, to_line
from silo_server.services.product.amounts import amount_of, unit_is_open
from silo_server.services.product.cost import own_worth
from silo_server.services.product.graph import MAX_DEPTH, children_first
from silo_server.services.product.parts import ROLLED, rolled_item
from silo_server.services.product.summary import LastChange, OpenBom, Summary
from silo_server.services.product.worth import MassAndCost
from silo_server.user_json import dumps
from silo_server.values import Line

# So many items without a value are named; the others are counted.
MOST_NAMED = 12


class Node(NamedTuple):
    """A summary with what those above it need: the internal ids that count for them, each once.

    parts
        of the leaf parts, or its own if it is a leaf; ``no_mass`` and ``no_cost`` are those without a value.
    assemblies
        of what has a BOM, itself included → [its lines, those of them that name an older revision].
    weighed
        of what its mass is made of: the leaf parts, and assemblies that state their mass for all in them.
    costed
        of what its cost is made of where it is a part: the leaf parts, and bought assemblies.
    no_cost_above
        those of ``costed`` that have no cost.
    first_parts, first_weighed, first_costed, first_no_cost_above
        the first part numbers of these.
    """

    summary: Summary
    parts: Set[int]
    no_mass: Set[int]
    no_cost: Set[int]
    assemblies: Mapping[int, Sequence[int]]
    weighed: Set[int]
    costed: Set[int]
    no_cost_above: Set[int]
    first_parts: Sequence[str]
    first_weighed: Sequence[str]
    first_costed: Sequence[str]
    first_no_cost_above: Sequence[str]


class Built(NamedTuple):
    """What a read made, to be kept: the newest event of its snapshot, its time, and the rows."""

    head: int
    at: str
    rows: Sequence[Mapping[str, Any]]


class Unmade(NamedTuple):
    """Products (internal ids) that are too large for one read to make."""

    item_ids: Collection[int]


def make_summaries(tx: Tx, wanted: Collection[int], most: int | None = None) -> dict[int, Node]:
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
) -> tuple[dict[int, list[Line]], dict[int, Node]]:
    """Read the lines of these items and of all below them, down to kept nodes; return both."""
    lines: dict[int, list[Line]] = {}
    nodes: dict[int, Node] = {}
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
                        message(
                            "there are more than {most} different lines in this product that are not summed "
                            "up yet. The server sums them up now: ask again in a minute, or look at a "
                            "sub-assembly",
                            most=most,
                        )
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
    is_bought: bool
    worth: MassAndCost
    changed: LastChange


def _own(tx: Tx, item_ids: Collection[int]) -> dict[int, _Own]:
    row = items.c
    query = select(*ROLLED, row.updated_at, row.updated_by).where(one_of(tx, row.id, item_ids))
    found: dict[int, _Own] = {}
    for item_row in tx.conn.execute(query):
        item_id, part = rolled_item(item_row)
        changed = LastChange(item_row.updated_at, item_row.updated_by, part.part_number)
        worth = own_worth(item_id, part)
        is_assembly = item_row.item_type == "assembly"
        found[item_id] = _Own(part.part_number, is_assembly, part.is_bought, worth, changed)
    return found


def _open(tx: Tx, lines: Mapping[int, Sequence[Line]], own: Mapping[int, _Own]) -> dict[int, OpenBom]:
    """Find what is open in each of these BOMs themselves; a BOM without open questions is absent."""
    ids = {item_id for item_id in own if item_id in lines or own[item_id].is_assembly}
    syncs, conflicts = last_syncs(tx, ids), conflicts_in(tx, lines)
    boms: dict[int, OpenBom] = {}
    for item_id in ids:
        last, below = syncs.get(item_id, NEVER), lines.get(item_id, ())
        incomplete = last.incomplete
        if not incomplete and last.at is None and not below:
            incomplete = "never synced"
        gone = sum(line.state.unreferenced_since is not None for line in below)
        units = sum(map(unit_is_open, below))
        made = OpenBom(own[item_id].part_number, gone, len(conflicts.get(item_id, ())), incomplete, units)
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
    nodes: dict[int, Node]
    own: Mapping[int, _Own]
    open: Mapping[int, OpenBom]
    bom_changes: Mapping[int, tuple[str, str]]

    def node(self, item_id: int) -> Node:
        """Return the node of an item; make it, from the nodes of its sub-assemblies, if there is none."""
        if item_id not in self.nodes:
            self.nodes[item_id] = self._made(item_id)
        return self.nodes[item_id]

    def _made(self, item_id: int) -> Node:
        own, lines = self.own[item_id], self.lines.get(item_id, ())
        below = [(line, self.node(line.child_id)) for line in lines if _followed(line)]
        nodes = list({line.child_id: node for line, node in below}.values())
        worth = _sum_of(below) if below else own.worth
        states_all = not worth.mass_whole and own.worth.mass is not None
        as_part = worth._replace(mass=own.worth.mass, mass_whole=True) if states_all else worth
        bought_whole = bool(below) and own.is_bought
        if bought_whole:  # its own price counts, and not that of what is in it
            of_own = own.worth
            as_part = as_part._replace(costs=of_own.costs, cost_whole=of_own.cost_whole, graded=of_own.graded)
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
        no_cost = (set() if worth.cost_whole else me).union(*(node.no_cost_above for node in nodes))
        uncounted = [node for line, node in below if unit_is_open(line)]
        no_mass = no_mass.union(*(node.weighed for node in uncounted))
        no_cost = no_cost.union(*(node.costed for node in uncounted))
        alone = {item_id} if bought_whole or me else set[int]()
        costed = alone or set[int]().union(*(node.costed for node in nodes))
        no_cost_above = no_cost
        if bought_whole:
            no_cost_above = set() if own.worth.cost_whole else {item_id}
        itself = {item_id} if states_all or me else set[int]()
        weighed = itself or set[int]().union(*(node.weighed for node in nodes))
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
            mass_missing=_first(
                me & no_mass,
                own,
                *(node.summary.mass_missing for node in unweighed),
                *(node.first_weighed for node in uncounted),
            ),
            cost_missing=_first(
                me & no_cost,
                own,
                *(node.first_no_cost_above for node in nodes),
                *(node.first_costed for node in uncounted),
            ),
            open_graded=sorted(no_cost & worth.graded.keys()),
        )
        if lines or own.is_assembly:
            assemblies[item_id] = (len(lines), older)
        first_parts = _first(me, own, *(node.first_parts for node in nodes))
        first_weighed = _first(itself, own, *(() if itself else (node.first_weighed for node in nodes)))
        first_costed = _first(alone, own, *(() if alone else (node.first_costed for node in nodes)))
        first_above = _first(no_cost_above, own) if bought_whole else summary.cost_missing
        return Node(
            summary,
            parts,
            no_mass,
            no_cost,
            assemblies,
            weighed,
            costed,
            no_cost_above,
            first_parts,
            first_weighed,
            first_costed,
            first_above,
        )


def _first(me: Collection[int], own: _Own, *below: Sequence[str]) -> list[str]:
    return sorted({*chain.from_iterable(below), *(own.part_number for _ in me)})[:MOST_NAMED]


def _sum_of(below: Sequence[tuple[Line, Node]]) -> MassAndCost:
    mass: Decimal | None = None
    costs: dict[str, Decimal] = {}
    graded: dict[int, Decimal] = {}
    parts = [node.summary.as_part for _, node in below]
    counted = True
    for (line, _), worth in zip(below, parts, strict=True):
        if (quantity := amount_of(line)) is None:
            counted = False
            continue
        if worth.mass is not None:
            mass = exact_sum((mass or Decimal(0), exact_product((quantity, worth.mass))))
        for currency, cost in worth.costs.items():
            costs[currency] = exact_sum((costs.get(currency, Decimal(0)), exact_product((quantity, cost))))
        for part_id, held in worth.graded.items():
            graded[part_id] = exact_sum((graded.get(part_id, Decimal(0)), exact_product((quantity, held))))
    whole = (
        counted and all(worth.mass_whole for worth in parts),
        counted and all(worth.cost_whole for worth in parts),
    )
    return MassAndCost(mass, whole[0], costs, whole[1], graded)


def _levels(rows: int, below: Iterable[Sequence[int]]) -> list[int]:
    deeper = [sum(level) for level in zip_longest(*below, fillvalue=0)]
    return [rows, *deeper][:MAX_DEPTH] if rows else []


def _row(item_id: int, node: Node) -> dict[str, Any]:
    summary = {name: getattr(node.summary, name) for name in names_of(Summary)}
    sets = {name: sorted(getattr(node, name)) for name in ("parts", "no_mass", "no_cost")}
    if node.weighed != node.parts:
        sets["weighed"] = sorted(node.weighed)
    if node.costed != node.parts:
        sets["costed"] = sorted(node.costed)
    if node.no_cost_above != node.no_cost:
        sets["no_cost_above"] = sorted(node.no_cost_above)
    return {
        "item_id": item_id,
        "summary": json.dumps(summary, separators=(",", ":"), default=str),
        "sets": dumps(
            sets
            | {
                "assemblies": node.assemblies,
                "first_parts": node.first_parts,
                "first_weighed": node.first_weighed,
                "first_costed": node.first_costed,
                "first_no_cost_above": node.first_no_cost_above,
            }
        ),
    }


def stored_summary(text: str) -> Summary:
    """Read a summary as it is kept."""
    loads = json.loads(text)
    for name in ("worth", "as_part"):
        mass, mass_whole, costs, cost_whole, graded = loads[name]
        exact = {currency: Decimal(cost) for currency, cost in costs.items()}
        held = {int(part_id): Decimal(amount) for part_id, amount in graded.items()}
        loads[name] = MassAndCost(
            None if mass is None else Decimal(mass), mass_whole, exact, cost_whole, held
        )
    loads["open"] = {int(parent_id): OpenBom(*values) for parent_id, values in loads["open"].items()}
    return Summary(**loads | {"changed": LastChange(*loads["changed"])})


def _node(row: Any) -> Node:
    sets = json.loads(row.sets)
    parts, no_mass, no_cost = (frozenset(sets[name]) for name in ("parts", "no_mass", "no_cost"))
    assemblies = {int(item_id): counts for item_id, counts in sets["assemblies"].items()}
    weighed = frozenset(sets.get("weighed", parts))
    costed, above = frozenset(sets.get("costed", parts)), frozenset(sets.get("no_cost_above", no_cost))
    firsts = (sets["first_parts"], sets["first_weighed"], sets["first_costed"], sets["first_no_cost_above"])
    summary = stored_summary(row.summary)
    return Node(summary, parts, no_mass, no_cost, assemblies, weighed, costed, above, *firsts)
