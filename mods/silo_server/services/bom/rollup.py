# SPDX-License-Identifier: LGPL-2.1-or-later
"""Cost and mass of an assembly from its items' properties, with everything that is missing named.

Cost: each leaf's ``standard_cost`` times its total quantity, per ``currency``.
Mass: each leaf's ``mass_kg`` [kg] times its total quantity. Where something below a sub-assembly has no mass
but the sub-assembly itself states ``mass_kg``, that is taken for the whole of it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Any, NamedTuple

from sqlalchemy import select

from silo.bom.numbers import as_decimal, exact_product, exact_sum, plain, read_number
from silo_server.db.bulk import one_of
from silo_server.db.engine import Tx
from silo_server.db.tables import items
from silo_server.services.bom.tree import Exact, Graph, added, flatten, order_of
from silo_server.values import Line

DEFAULT_CURRENCY = "EUR"


@dataclass(frozen=True, slots=True)
class CostRow:
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


@dataclass(frozen=True, slots=True)
class MassRow:
    """A part whose stated mass was taken [kg], as the API sends it.

    ``is_assembly`` where it stands for all below it.
    """

    part_number: str
    name: str
    total_quantity: float
    mass_kg: float | None
    total_mass_kg: float | None
    is_assembly: bool = False


@dataclass(frozen=True, slots=True)
class MassRollup:
    """The mass of one assembly [kg]; ``stated`` is what its own ``mass_kg`` says."""

    rows: Sequence[MassRow]
    total: float
    missing: Sequence[str]
    stated: float | None


class Part(NamedTuple):
    """What a roll-up reads of an item."""

    part_number: str
    name: str
    properties: Mapping[str, Any]
    thumbnail_key: str | None = None


class Worth(NamedTuple):
    """What one piece of an item weighs [kg] and costs, per currency; of an assembly, all that is in it.

    ``whole``: nothing that belongs to it is without a value.
    """

    mass: Decimal | None
    mass_whole: bool
    costs: Mapping[str, Decimal]
    cost_whole: bool


def parts_of(tx: Tx, graph: Graph) -> dict[int, Part]:
    """Everything in the graph, by internal id, read once for both roll-ups."""
    children = {line.child_id for below in graph.lines.values() for line in below}
    rows = tx.conn.execute(
        select(
            items.c.id, items.c.part_number, items.c.name, items.c.properties, items.c.thumbnail_key
        ).where(one_of(tx, items.c.id, children))
    )
    parts = {row[0]: Part(row[1], row[2], json.loads(row[3]), row[4]) for row in rows}
    root = graph.root
    own = Part(root.part_number, root.name, root.properties, root.thumbnail_key)
    return {**parts, root.id: own}


def worths(graph: Graph, parts: Mapping[int, Part]) -> dict[int, Worth]:
    """What each item of the graph is worth, by internal id, by the rules of the roll-ups below."""
    order = order_of(graph)
    found = {item_id: _own_worth(part.properties) for item_id, part in parts.items()}
    for item_id in reversed(order):  # children before parents
        below = [(line, found[line.child_id]) for line in graph.components(item_id)]
        if below:
            found[item_id] = _sum_of(below, found[item_id], is_root=item_id == graph.root.id)
    return found


def _own_worth(properties: Mapping[str, Any]) -> Worth:
    mass, cost = (positive_number(properties, name) for name in ("mass_kg", "standard_cost"))
    costs = {currency_of(properties): as_decimal(cost)} if cost is not None else {}
    return Worth(None if mass is None else as_decimal(mass), mass is not None, costs, bool(costs))


def _sum_of(below: Sequence[tuple[Line, Worth]], own: Worth, *, is_root: bool) -> Worth:
    mass: Decimal | None = None
    costs: dict[str, Decimal] = {}
    for line, worth in below:
        quantity = as_decimal(line.state.quantity)
        if worth.mass is not None:
            mass = exact_sum((mass or Decimal(0), exact_product((quantity, worth.mass))))
        for currency, cost in worth.costs.items():
            costs[currency] = exact_sum((costs.get(currency, Decimal(0)), exact_product((quantity, cost))))
    mass_whole = all(worth.mass_whole for _, worth in below)
    if not mass_whole and own.mass is not None and not is_root:
        mass, mass_whole = own.mass, True
    return Worth(mass, mass_whole, costs, all(worth.cost_whole for _, worth in below))


def currency_of(properties: Mapping[str, Any]) -> str:
    """The currency of an item's cost."""
    return str(properties.get("currency") or DEFAULT_CURRENCY)


def roll_up_cost(graph: Graph, parts: Mapping[int, Part]) -> CostRollup:
    """Flat BOM times standard cost."""
    flat = flatten(graph)
    rows, totals, missing = [], dict[str, Decimal](), []
    for row in flat:
        item = parts[row.line.child_id]
        cost = positive_number(item.properties, "standard_cost")
        currency = currency_of(item.properties) if cost is not None else None
        total = exact_product((cost, row.total)) if cost is not None else None
        if total is None or currency is None:
            missing.append(item.part_number)
        else:
            totals[currency] = exact_sum((totals.get(currency, Decimal(0)), total))
        shown = None if total is None else float(total)
        rows.append(CostRow(item.part_number, item.name, plain(row.total), row.unit, cost, currency, shown))
    return CostRollup(rows, {name: float(total) for name, total in totals.items()}, missing)


def roll_up_mass(graph: Graph, parts: Mapping[int, Part]) -> MassRollup:
    """Masses from the leaves up; a sub-assembly's own mass where its parts do not have all of theirs."""
    known = worths(graph, parts)

    def stands_for_itself(item_id: int) -> bool:
        below = graph.components(item_id)
        whole = all(known[line.child_id].mass_whole for line in below)
        stated = positive_number(parts[item_id].properties, "mass_kg") is not None
        return bool(below) and not whole and stated and item_id != graph.root.id

    assemblies = {item_id for item_id in order_of(graph) if stands_for_itself(item_id)}
    amounts: dict[int, Exact] = {}
    for row in flatten(graph, assemblies):
        item_id = row.line.child_id
        amounts[item_id] = added(amounts.get(item_id, 0), row.total, row.line)
    rows = [_mass_row(parts[one], amount, one in assemblies) for one, amount in amounts.items()]
    return MassRollup(
        rows,
        float(exact_sum(row.total_mass_kg for row in rows if row.total_mass_kg is not None)),
        [row.part_number for row in rows if row.total_mass_kg is None],
        positive_number(graph.root.properties, "mass_kg"),
    )


def positive_number(properties: Mapping[str, Any], name: str) -> float | None:
    """A property as a number of at least 0, None where it is absent or no such number."""
    value = properties.get(name)
    if isinstance(value, str):
        value = read_number(value, points_are_decimal=True).value
    if isinstance(value, bool) or not isinstance(value, int | float | Decimal):
        return None
    return float(value) if 0 <= value < 1e15 else None


def _mass_row(item: Part, amount: Exact, is_assembly: bool) -> MassRow:
    mass = positive_number(item.properties, "mass_kg")
    total = float(exact_product((mass, amount))) if mass is not None else None
    return MassRow(item.part_number, item.name, plain(amount), mass, total, is_assembly)
