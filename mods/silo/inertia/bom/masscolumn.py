# SPDX-License-Identifier: LGPL-2.1-or-later
"""The mass columns of a sheet: unit, decimal mark and display precision are a column's, not a cell's."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from silo.bom.headers import Role
from silo.bom.numbers import Mark
from silo.inertia.bom.masses import MassCell, column_mark, is_force, parse_mass
from silo.inertia.bom.rows import BomCode, BOMEntry, BomTable
from silo.inertia.bom.sheet import Row, Sheet

Tell = Callable[[BomCode, str, Row, str], None]
"""Takes a warning: code, message, row, name."""

MASS_COLUMNS = (Role.MASS, Role.TOTAL_MASS)

_TOTAL_TOLERANCE = 1e-3
"""Relative, beside the rounding of both columns: how far a total may be from quantity times mass."""


class MassReader:
    """Reads the mass of one piece of each row: its own column first, else the total over the quantity.

    ``mark`` and ``unit`` are the user's word; a unit in a header wins over ``unit``, one in a cell over both.
    """

    def __init__(self, sheet: Sheet, mark: Mark | None, unit: str | None, tell: Tell) -> None:
        self._columns = sheet.columns
        self._tell = tell
        self._unit = unit
        self._marks = {
            role: mark or column_mark(sheet.columns.cell(row.cells, role) for row in sheet.rows)
            for role in MASS_COLUMNS
            if role in sheet.columns.at
        }
        # Without any proof: a file that separates cells by semicolons does so because its commas are decimal.
        self._likely = Mark.COMMA if sheet.delimiter == ";" else Mark.POINT
        # Programs that separate by commas write points; no other delimiter says where a file comes from.
        self._points_are_decimal = sheet.delimiter == ","
        self._units: dict[int, str] = {}
        self._totals: dict[int, MassCell] = {}
        self._from_total: set[int] = set()
        self._told_unit = self._told_force = False

    def read(self, row: Row, name: str, quantity: float | None) -> MassCell:
        """The mass of one piece; every doubt is reported, with the line."""
        one = self._cell(Role.MASS, row, name)
        total = self._cell(Role.TOTAL_MASS, row, name)
        if one.kg is None and total.kg is not None:
            self._from_total.add(row.line)
            return self._per_piece(total, row, name, quantity)
        if one.kg is not None:
            self._units[row.line] = one.unit
        if total.kg is not None:
            self._totals[row.line] = total
        return one

    def to_display_precision(self, rows: Sequence[BOMEntry]) -> list[BOMEntry]:
        """The quantum of the column's finest cell of the same unit, for all: exports trim trailing zeros.

        "0.3 kg" beside "0.009 kg" was shown with three decimals as well, so that it is ± 0.0005 kg.
        """
        if self._columns.exact:
            return [replace(row, quantum_kg=0.0) for row in rows]
        own = [row for row in rows if row.line in self._units and row.quantum_kg > 0]
        finest: dict[str, float] = {}
        for row in own:
            unit = self._units[row.line]
            finest[unit] = min(finest.get(unit, row.quantum_kg), row.quantum_kg)
        return [
            replace(row, quantum_kg=finest.get(self._units[row.line], 0.0))
            if row.line in self._units
            else row
            for row in rows
        ]

    def _cell(self, role: Role, row: Row, name: str) -> MassCell:
        if role not in self._columns.at:
            return MassCell()
        text = self._columns.cell(row.cells, role)
        unit = self._columns.units.get(role) or self._columns.cell(row.cells, Role.MASS_UNIT) or self._unit
        cell = parse_mass(text, mark=self._marks[role], unit=unit)
        if cell.ambiguous:
            cell = self._decide(text, unit, row, name)
        if cell.doubt:
            self._tell(BomCode.AMBIGUOUS_MASS, f"the mass “{text}” {cell.doubt}", row, name)
        if cell.problem is not None:
            self._tell(
                BomCode.UNREADABLE_MASS, f"the mass “{text}” {cell.problem}; it is not used", row, name
            )
        if cell.kg is not None and not cell.unit and not self._told_unit:
            self._told_unit = True
            strange = self._columns.strange.get(role)
            header = (
                f"and its header’s “{strange}” is none that is known" if strange else "nor has its header"
            )
            words = f"the mass “{text}” has no unit, {header}; read as kg"
            self._tell(BomCode.MASS_WITHOUT_UNIT, words, row, name)
        if cell.kg is not None and is_force(cell.unit) and not self._told_force:
            self._told_force = True
            words = f"“{cell.unit}” is a unit of force; masses are what weighs as much at 9.80665 m/s²"
            self._tell(BomCode.FILE, words, row, name)
        pieces = self._columns.pieces.get(role, 1)
        if cell.kg is not None and pieces != 1:
            cell = replace(cell, kg=cell.kg / pieces, quantum_kg=cell.quantum_kg / pieces)
        return cell

    def _decide(self, text: str, unit: str | None, row: Row, name: str) -> MassCell:
        other = Mark.POINT if self._likely is Mark.COMMA else Mark.COMMA
        likely = parse_mass(text, mark=self._likely, unit=unit)
        unlikely = parse_mass(text, mark=other, unit=unit)
        if "," in text or not self._points_are_decimal:
            self._tell(
                BomCode.AMBIGUOUS_MASS,
                f"the mass “{text}” was read as {likely.kg:.9g} kg but could be {unlikely.kg:.9g} kg, "
                "and no other mass shows which mark is the decimal one; say so with --decimal",
                row,
                name,
            )
            return replace(likely, ambiguous=True)
        return likely

    def _per_piece(self, total: MassCell, row: Row, name: str, quantity: float | None) -> MassCell:
        if quantity and total.kg is not None:
            return replace(total, kg=total.kg / quantity, quantum_kg=total.quantum_kg / quantity)
        words = "there is a total mass only, and no quantity to divide it by; it is not used"
        self._tell(BomCode.UNREADABLE_MASS, words, row, name)
        return MassCell()

    def check_totals(self, table: BomTable) -> tuple[BOMEntry, ...]:
        """The rows, those with a total that may be of one parent or of the whole product marked as unsure."""
        return tuple(self._checked(row, table) for row in table.rows)

    def _checked(self, row: BOMEntry, table: BomTable) -> BOMEntry:
        where = Row(row.line, ())
        above = table.ancestors(row)
        if row.line in self._from_total and any(parent.quantity != 1 for parent in above):
            words = (
                f"the total mass was divided by the {row.quantity:g} pieces in one “{above[0].name}”; "
                "if it is the total of the whole product, one piece weighs less"
            )
            self._tell(BomCode.AMBIGUOUS_MASS, words, where, row.name)
            return replace(row, unsure=True)
        total = self._totals.get(row.line)
        if total is None or total.kg is None or row.mass_kg is None or not row.quantity:
            return row
        # Of the row, or of the whole product (Silo's own export): what fits is meant.
        counts = {row.quantity, table.total_quantity(row) or row.quantity}
        if not any(_agree(row, count, total.kg, total.quantum_kg) for count in counts):
            words = (
                f"the total mass says {total.kg:.6g} kg, but {row.quantity:g} times {row.mass_kg:.6g} kg is "
                f"{row.mass_kg * row.quantity:.6g} kg; the mass of one piece was used"
            )
            self._tell(BomCode.TOTAL_DIFFERS, words, where, row.name)
        return row


def _agree(row: BOMEntry, count: float, total: float, quantum: float) -> bool:
    expected = (row.mass_kg or 0.0) * count
    return abs(expected - total) <= row.quantum_kg * count + quantum + _TOTAL_TOLERANCE * expected
