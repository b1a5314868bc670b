# SPDX-License-Identifier: LGPL-2.1-or-later
"""The sum of a BOM beside the sum that was counted: what is missing, what counts twice, and why. Pure.

    BOM total = its top rows, each with the mass of its own row or of the rows below it
    not counted = rows with a mass that no part uses, and pieces that the geometry lacks
    double = pieces that the geometry has more of, and parts that stand twice at one place

A row below a sub-assembly whose own mass was counted is not missing: its mass is in that of the sub-assembly.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from silo.bom.message import Message, joined, message
from silo.inertia.assembly import Assembly
from silo.inertia.bom.table import BOMEntry, BomTable
from silo.inertia.codes import Source
from silo.inertia.masses import Placed
from silo.inertia.matching import Matching

NOTHING = 1e-9
"""[kg] what rounding leaves."""


@dataclass(frozen=True, slots=True)
class Difference:
    """Mass [kg] of one row or part that is in one sum and not in the other, and the reason."""

    name: str
    kg: float
    reason: Message


@dataclass(frozen=True, slots=True)
class Reconciliation:
    """The two sums [kg] and their differences.

    bom
        None if no row has a mass.
    estimated
        of what was counted, the mass that no BOM mass and no scale says: volumes times densities.
    """

    bom: float | None
    counted: float
    estimated: float = 0.0
    not_counted: tuple[Difference, ...] = ()
    double: tuple[Difference, ...] = ()

    @property
    def missing_kg(self) -> float:
        """Return the mass of what was not counted."""
        return sum(one.kg for one in self.not_counted)

    @property
    def double_kg(self) -> float:
        """Return the mass of what was counted once too often."""
        return sum(one.kg for one in self.double)

    @property
    def sentence(self) -> Message:
        """Say both sums in one line."""
        counted = f"{self.counted:.6g}"
        if self.bom is None:
            head = message("BOM total: no masses · counted {counted} kg", counted=counted)
        else:
            head = message(
                "BOM total {bom} kg · counted {counted} kg", bom=f"{self.bom:.6g}", counted=counted
            )
        parts: list[Message] = [head]
        if self.bom is not None and self.estimated > NOTHING:
            parts.append(message("{kg} kg of it by densities", kg=f"{self.estimated:.6g}"))
        if self.not_counted:
            parts.append(
                message(
                    "not counted {kg} kg: {rows}", kg=f"{self.missing_kg:.6g}", rows=_listed(self.not_counted)
                )
            )
        if self.double:
            parts.append(
                message("double {kg} kg: {rows}", kg=f"{self.double_kg:.6g}", rows=_listed(self.double))
            )
        return joined(" · ", parts)


MOST_NAMED = 4


def _listed(differences: Sequence[Difference]) -> Message:
    heaviest = sorted(differences, key=lambda one: -one.kg)
    named = [
        message("{name} ({kg} kg, {reason})", name=one.name, kg=f"{one.kg:.4g}", reason=one.reason)
        for one in heaviest[:MOST_NAMED]
    ]
    if len(heaviest) > MOST_NAMED:
        named.append(message("{count} more", count=str(len(heaviest) - MOST_NAMED)))
    return joined(", ", named)


def reconciled(
    assembly: Assembly, table: BomTable, matching: Matching, placed: Placed, pieces: Mapping[int, int]
) -> Reconciliation:
    """Compare the sums. ``pieces``: of each matched row, by its identity, how many the geometry has."""
    counts = list(_counts(matching, pieces))
    more = [_other_count(*count) for count in counts if count[2] > count[1]]
    fewer = [_other_count(*count) for count in counts if count[2] < count[1]]
    named = {one.name for one in more}
    again = [one for one in _at_one_place(assembly, placed, matching) if one.name not in named]
    return Reconciliation(
        bom_total(table),
        float(placed.mass.sum()),
        _estimated(placed),
        (*_unused(table, matching, placed), *fewer),
        (*more, *again),
    )


_SAID = (Source.BOM_MASS, Source.SUB_ASSEMBLY_MASS, Source.TARGET_MASS)


def _estimated(placed: Placed) -> float:
    said = np.array([decision.source in _SAID for decision in placed.decisions], bool)
    return float(placed.mass[~said].sum())


def bom_total(table: BomTable) -> float | None:
    """Return the mass [kg] of a whole product by its BOM alone; None if no row has a mass."""
    below: dict[int | None, list[int]] = {}
    for number, row in enumerate(table.rows):
        below.setdefault(row.parent, []).append(number)
    weights: dict[int, float | None] = {}
    for number in range(len(table.rows) - 1, -1, -1):  # rows stand below their parents
        row = table.rows[number]
        own = row.mass_kg
        inside = [
            weight * (table.rows[child].quantity or 1.0)
            for child in below.get(number, ())
            if (weight := weights[child]) is not None
        ]
        complete = len(inside) == len(below.get(number, ()))
        if inside and not row.overridden and (own is None or complete):
            own = sum(inside)
        weights[number] = own
    top = [
        weight * (table.rows[number].quantity or 1.0)
        for number in below.get(None, ())
        if (weight := weights[number]) is not None
    ]
    return sum(top) if top else None


def _unused(table: BomTable, matching: Matching, placed: Placed) -> Iterator[Difference]:
    counted_groups = {id(group.match.row) for group in placed.groups}
    for row in matching.unused:
        above = table.ancestors(row)
        if row.mass_kg and not any(id(one) in counted_groups for one in above):
            yield Difference(
                row.name, unused_kg(table, row), message("no part, BOM line {line}", line=str(row.line))
            )


def unused_kg(table: BomTable, row: BOMEntry) -> float:
    """Return the mass [kg] of all pieces of a row that no part uses; 0 without a mass."""
    quantity = table.total_quantity(row)
    return (row.mass_kg or 0.0) * (1.0 if quantity is None else quantity)


def _other_count(row: BOMEntry, wanted: float, there: int) -> Difference:
    reason = message("{wanted} in the BOM, {there} in the geometry", wanted=f"{wanted:g}", there=str(there))
    return Difference(row.name, abs(there - wanted) * (row.mass_kg or 0.0), reason)


def _counts(matching: Matching, pieces: Mapping[int, int]) -> Iterator[tuple[BOMEntry, float, int]]:
    """Yield each row with a mass whose pieces differ: the row, the nearest number wanted, and those there."""
    seen: set[int] = set()
    for found in matching.parts.values():
        row = found.row
        if id(row) in seen or not row.mass_kg or not found.bundle.quantities:
            continue
        seen.add(id(row))
        there = pieces.get(id(row), 0)
        wanted = min(found.bundle.quantities, key=lambda quantity: abs(quantity - there))
        if wanted != there:
            yield row, wanted, there


def _at_one_place(assembly: Assembly, placed: Placed, matching: Matching) -> Iterator[Difference]:
    seen: set[tuple[str, bytes]] = set()
    for index, instance in enumerate(assembly.instances):
        # 0.1 µm and 1e-7 of a turn; adding 0 turns -0 into 0.
        here = instance.prototype, (np.round(instance.transform, 7) + 0.0).tobytes()
        if here in seen and placed.mass[index] > NOTHING:
            reason = message("stands where the same part stands already")
            found = matching.parts.get(instance.prototype)
            name = found.row.name if found is not None else instance.path[-1]
            yield Difference(name, float(placed.mass[index]), reason)
        seen.add(here)
