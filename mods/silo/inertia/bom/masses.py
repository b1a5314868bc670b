# SPDX-License-Identifier: LGPL-2.1-or-later
"""The mass of one piece in each row of a BOM: from its own column, or from the total of the row.

Every doubt becomes a warning.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from silo.bom.headers import Heading
from silo.bom.message import message
from silo.bom.numbers import Mark
from silo.inertia.bom.columns import MASS_COLUMNS, mass_columns
from silo.inertia.bom.mass_cell import FORCE_UNITS, MassCell, column_mark, parse_mass, unit_factor
from silo.inertia.bom.table import BomCode, BOMEntry, BomTable, BomWarning
from silo.tables.sheet import Sheet
from silo.workbook.sheet import SheetRow

_TOTAL_TOLERANCE = 1e-3
"""Relative, beside the rounding of both columns: how far a total may be from quantity times mass."""


class MassReader:
    """Reads the mass of one piece of each row: its own column first, else the total over the quantity.

    ``mark`` and ``unit`` are the user's word; a unit in a header wins over ``unit``, one in a cell over both.
    Every doubt becomes one of the ``warnings``.
    """

    def __init__(self, sheet: Sheet, mark: Mark | None, unit: str | None, warnings: list[BomWarning]) -> None:
        self._columns = sheet.columns
        self._headers = mass_columns(sheet)
        self._warnings = warnings
        self._unit = unit
        self._marks = {
            role: mark or column_mark(sheet.columns.cell(row.cells, role) for row in sheet.rows)
            for role in MASS_COLUMNS
        }
        # Without any proof: a file that separates cells by semicolons does so because its commas are decimal.
        self._likely = Mark.COMMA if sheet.delimiter == ";" else Mark.POINT
        # Programs that separate by commas write points; nothing else says where a file comes from.
        self._points_are_decimal = sheet.delimiter == ","
        self._cells: dict[int, tuple[MassCell, MassCell]] = {}
        self._reported: set[BomCode] = set()
        self._unit_role = self._find_units(sheet)

    def _find_units(self, sheet: Sheet) -> Heading:
        """Find the column with the units of the masses. A column "Unit" belongs to the quantities if it has
        pieces.
        """
        cell, at = sheet.columns.cell, sheet.columns.at
        if (
            Heading.MASS_UNIT in at
            or Heading.UNIT not in at
            or any(h.unit for h in self._headers.masses.values())
        ):
            return Heading.MASS_UNIT
        bare = [row for row in sheet.rows if any(cell(row.cells, role) for role in MASS_COLUMNS)]
        units = {unit for row in bare if (unit := cell(row.cells, Heading.UNIT))}
        masses = {unit for unit in units if unit_factor(unit) is not None}
        if not masses:
            return Heading.MASS_UNIT
        title = sheet.header[at[Heading.UNIT]].strip()
        words = message("the column “{title}” was read as the unit of the masses", title=title)
        if masses != units:
            words = message(
                "the column “{title}” has units of mass ({masses}) beside others; it was read as "
                "the unit of the quantities, and not of the masses",
                title=title,
                masses=", ".join(sorted(masses)),
            )
        self._report(BomCode.FILE, words, sheet.header_line, "")
        return Heading.UNIT if masses == units else Heading.MASS_UNIT

    def _report(self, code: BomCode, message: str, line: int, name: str, *, once: bool = False) -> None:
        if not (once and code in self._reported):
            self._warnings.append(BomWarning(code, message, line, name))
            self._reported.add(code)

    def read(self, row: SheetRow, name: str, quantity: float | None) -> MassCell:
        """Read the mass of one piece."""
        cell, total = (self._cell(role, row, name) for role in MASS_COLUMNS)
        self._cells[row.line] = cell, total
        if cell.kg is not None or total.kg is None:
            return cell
        if quantity:
            return replace(total, kg=total.kg / quantity, quantum_kg=total.quantum_kg / quantity)
        words = message("there is a total mass only, and no quantity to divide it by; it is not used")
        self._report(BomCode.UNREADABLE_MASS, words, row.line, name)
        return MassCell()

    def to_display_precision(self, rows: Sequence[BOMEntry]) -> list[BOMEntry]:
        """Give each cell the quantum of the finest cell with the same unit, since exports trim trailing
        zeros.

        If a column has "0.009 kg", its "0.3 kg" had three decimals as well, so that it is ± 0.0005 kg.
        """
        if self._headers.exact:
            return [replace(row, quantum_kg=0.0) for row in rows]
        finest: dict[str, float] = {}
        for row in rows:
            unit = self._cells[row.line][0].unit
            if self._is_own(row) and row.quantum_kg > 0:
                finest[unit] = min(finest.get(unit, row.quantum_kg), row.quantum_kg)
        return [
            replace(row, quantum_kg=finest.get(self._cells[row.line][0].unit, 0.0))
            if self._is_own(row)
            else row
            for row in rows
        ]

    def _is_own(self, row: BOMEntry) -> bool:
        """Return True if the file states the mass of one piece, and it is not a share of a total."""
        return self._cells[row.line][0].kg is not None

    def _cell(self, role: Heading, row: SheetRow, name: str) -> MassCell:
        header = self._headers.masses.get(role)
        if header is None:
            return MassCell()
        text = self._columns.cell(row.cells, role)
        unit = header.unit or self._columns.cell(row.cells, self._unit_role) or self._unit
        cell = parse_mass(text, mark=self._marks[role], unit=unit)
        if cell.ambiguous:
            cell = self._decide(text, unit, row, name)
        if cell.doubt:
            self._report(
                BomCode.AMBIGUOUS_MASS,
                message("the mass “{text}” {doubt}", text=text, doubt=cell.doubt),
                row.line,
                name,
            )
        if cell.problem is not None:
            words = message("the mass “{text}” {problem}; it is not used", text=text, problem=cell.problem)
            self._report(BomCode.UNREADABLE_MASS, words, row.line, name)
        if cell.kg is None:
            return cell
        if not cell.unit:
            sentence = message("and “{strange}” in its header is no known unit", strange=header.strange)
            words = message(
                "the mass “{text}” has no unit, {sentence}",
                text=text,
                sentence=sentence if header.strange else message("nor has its header"),
            )
            self._report(
                BomCode.MASS_WITHOUT_UNIT,
                message("{words}; read as kg", words=words),
                row.line,
                name,
                once=True,
            )
        if cell.unit in FORCE_UNITS:
            words = message(
                "“{unit}” is a unit of force; masses are what weighs as much at 9.80665 m/s²", unit=cell.unit
            )
            self._report(BomCode.FILE, words, row.line, name, once=True)
        return cell

    def _decide(self, text: str, unit: str | None, row: SheetRow, name: str) -> MassCell:
        likely, unlikely = (
            parse_mass(text, mark=mark, unit=unit) for mark in (self._likely, self._likely.other)
        )
        if "," not in text and self._points_are_decimal:
            return likely
        self._report(
            BomCode.AMBIGUOUS_MASS,
            message(
                "the mass “{text}” was read as {kg} kg but could be {other_kg} kg, and no other mass "
                "shows which mark is the decimal one; say so with --decimal",
                text=text,
                kg=f"{likely.kg:.9g}",
                other_kg=f"{unlikely.kg:.9g}",
            ),
            row.line,
            name,
        )
        return replace(likely, ambiguous=True)

    def check_totals(self, table: BomTable) -> tuple[BOMEntry, ...]:
        """Mark the rows whose total may be that of one parent or that of the whole product as unsure."""
        return tuple(self._checked(row, table) for row in table.rows)

    def _checked(self, row: BOMEntry, table: BomTable) -> BOMEntry:
        total = self._cells[row.line][1]
        above = table.ancestors(row)
        if total.kg is None or row.mass_kg is None or not row.quantity:
            return row
        if not self._is_own(row):
            if all(parent.quantity == 1 for parent in above):
                return row
            words = message(
                "the total mass was divided by the {quantity} pieces in one “{name}”; if it is "
                "the total of the whole product, one piece weighs less",
                quantity=f"{row.quantity:g}",
                name=above[0].name,
            )
            self._report(BomCode.AMBIGUOUS_MASS, words, row.line, row.name)
            return replace(row, unsure=True)
        # Of the row, or of the whole product (as in Silo's own export): the one that fits counts.
        counts = {row.quantity, table.total_quantity(row) or row.quantity}
        if not any(_agree(row, count, total) for count in counts):
            words = message(
                "the total mass says {kg} kg, but {quantity} times {mass_kg} kg is {product_kg} "
                "kg; the mass of one piece was used",
                kg=f"{total.kg:.6g}",
                quantity=f"{row.quantity:g}",
                mass_kg=f"{row.mass_kg:.6g}",
                product_kg=f"{row.mass_kg * row.quantity:.6g}",
            )
            self._report(BomCode.TOTAL_DIFFERS, words, row.line, row.name)
        return row


def _agree(row: BOMEntry, count: float, total: MassCell) -> bool:
    expected = (row.mass_kg or 0.0) * count
    allowed = row.quantum_kg * count + total.quantum_kg + _TOTAL_TOLERANCE * expected
    return abs(expected - (total.kg or 0.0)) <= allowed
