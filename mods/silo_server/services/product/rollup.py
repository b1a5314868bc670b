# SPDX-License-Identifier: LGPL-2.1-or-later
"""Cost and mass of an assembly part by part, with everything that is missing named.

The rules are those of :mod:`silo_server.services.product.summary`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import NamedTuple

from silo.bom.quantities import exact_product, exact_sum, plain
from silo_server.services.product.cost import PartCost, added_up
from silo_server.services.product.flat import FlatRow
from silo_server.services.product.parts import RolledItem, positive_number


class CostRow(NamedTuple):
    """A part's share, as the API sends it. ``unit_cost`` None = not known; ``source``: where it is from."""

    part_number: str
    name: str
    total_quantity: float
    unit: str | None
    unit_cost: float | None
    currency: str | None
    total_cost: float | None
    source: str


@dataclass(frozen=True, slots=True)
class CostRollup:
    """What an assembly costs; ``totals`` per currency, ``missing`` the part numbers without a cost."""

    rows: Sequence[CostRow]
    totals: Mapping[str, Decimal]
    missing: Sequence[str]


class MassLine(NamedTuple):
    """A part whose stated mass was taken [kg], as the API sends it.

    ``is_assembly`` if it stands for all below it.
    """

    part_number: str
    name: str
    total_quantity: float
    unit: str | None
    mass_kg: float | None
    total_mass_kg: float | None
    is_assembly: bool = False


@dataclass(frozen=True, slots=True)
class MassRollup:
    """The mass of one assembly [kg]; ``missing`` the part numbers without a mass."""

    rows: Sequence[MassLine]
    total: float
    missing: Sequence[str]


def roll_up_cost(
    flat: Iterable[FlatRow],
    parts: Mapping[int, RolledItem],
    prices: Mapping[int, PartCost],
    pieces: int = 1,
) -> CostRollup:
    """Add up the cost of rows of the flat list, in which a bought assembly is a part, per currency.

    prices
        what each part costs for its whole quantity (:func:`silo_server.services.product.cost.prices_in`).
    """
    rows, costs, missing = [], list[PartCost](), list[str]()
    for row in flat:
        item, amount = parts[row.line.child_id], exact_product((row.total, pieces))
        of_row = prices[row.line.child_id]._replace(quantity=amount)
        if of_row.price is None or row.unit_open:
            missing.append(item.part_number)
        total = of_row.cost if amount else None
        if total is not None:
            costs.append(of_row)
        rows.append(
            CostRow(
                item.part_number,
                item.name,
                plain(amount),
                row.unit,
                plain(of_row.price),
                of_row.currency,
                plain(total),
                of_row.words,
            )
        )
    return CostRollup(rows, added_up(costs), missing)


def roll_up_mass(
    flat: Iterable[FlatRow], parts: Mapping[int, RolledItem], assemblies: Collection[int]
) -> MassRollup:
    """Add up masses [kg] from the leaves; each of ``assemblies`` counts with the mass that it states.

    These assemblies are leaves of the flat BOM as well.
    """
    rows, masses, missing = [], list[Decimal](), []
    for row in flat:
        item, total = parts[row.line.child_id], None
        mass = positive_number(item.properties, "mass_kg")
        if mass is None or row.unit_open:
            missing.append(item.part_number)
        if mass is not None and row.total:
            masses.append(exact_product((mass, row.total)))
            total = float(masses[-1])
        is_assembly = row.line.child_id in assemblies
        rows.append(
            MassLine(item.part_number, item.name, plain(row.total), row.unit, mass, total, is_assembly)
        )
    return MassRollup(rows, float(exact_sum(masses)), missing)
