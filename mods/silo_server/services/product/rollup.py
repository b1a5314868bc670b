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
from silo_server.services.product.flat import FlatRow
from silo_server.services.product.parts import RolledItem, currency_of, positive_number


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


def roll_up_cost(flat: Iterable[FlatRow], parts: Mapping[int, RolledItem]) -> CostRollup:
    """Add up the cost of the flat BOM from the parts' ``standard_cost``, per currency."""
    rows, costs, missing = [], dict[str, list[Decimal]](), dict[str, None]()
    for row in flat:
        item = parts[row.line.child_id]
        cost, currency, total = positive_number(item.properties, "standard_cost"), None, None
        if cost is None or row.unit_open:
            missing[item.part_number] = None
        if cost is not None and row.total:
            currency = currency_of(item.properties)
            exact = exact_product((cost, row.total))
            costs.setdefault(currency, []).append(exact)
            total = float(exact)
        rows.append(CostRow(item.part_number, item.name, plain(row.total), row.unit, cost, currency, total))
    totals = {currency: float(exact_sum(of_it)) for currency, of_it in costs.items()}
    return CostRollup(rows, totals, list(missing))


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
