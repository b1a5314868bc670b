# SPDX-License-Identifier: LGPL-2.1-or-later
"""A BOM CSV → :class:`BomTable`. Tolerant of shapes, strict about meaning: what is unclear is a warning."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from silo.bom.errors import InputError
from silo.inertia.bom.columns import Role
from silo.inertia.bom.masses import MassCell, column_mark, is_empty, parse_mass, unit_factor
from silo.inertia.bom.numbers import Mark, parse_number
from silo.inertia.bom.rows import BomCode, BOMEntry, BomTable, BomWarning
from silo.inertia.bom.sheet import Row, Sheet, read_sheet
from silo.inertia.bom.structure import with_structure


class BOMParser:
    """Reads BOM exports of Onshape and others, and Silo's own.

    All options are the user's word against what would be found out from the file:

    columns
        role → header text, for renamed columns: ``{"name": "Bauteil", "mass": "Gew."}``.
    encoding, delimiter
        of the file.
    decimal
        "." or ",".
    mass_unit
        of mass cells without a unit, where the header states none either (else kg, with a warning).
    """

    def __init__(
        self,
        *,
        columns: Mapping[str, str] | None = None,
        encoding: str | None = None,
        delimiter: str | None = None,
        decimal: str | None = None,
        mass_unit: str | None = None,
    ) -> None:
        if decimal not in (None, ".", ","):
            raise InputError(f"the decimal mark is “.” or “,”, got “{decimal}”")
        if mass_unit is not None and unit_factor(mass_unit) is None:
            raise InputError(f"“{mass_unit}” is no unit of mass; known are kg, g, mg, t, lb, oz, slug")
        self._columns = columns
        self._encoding = encoding
        self._delimiter = delimiter
        self._decimal = None if decimal is None else Mark(decimal)
        self._mass_unit = mass_unit

    def parse(self, path: Path | str) -> BomTable:
        """Read a file. InputError where it is absent, or has no header with names; all else is a warning."""
        try:
            data = Path(path).read_bytes()
        except OSError as error:
            raise InputError(f"{path}: the BOM cannot be read ({error.strerror or error})") from error
        return self.parse_bytes(data, str(path))

    def parse_bytes(self, data: bytes, source: str = "BOM") -> BomTable:
        """As :meth:`parse`, from bytes."""
        sheet = read_sheet(
            data,
            source,
            columns=self._columns,
            encoding=self._encoding,
            delimiter=self._delimiter,
        )
        warnings = [BomWarning(BomCode.FILE, note) for note in sheet.notes]
        warnings += _missing_columns(sheet)
        masses = _Masses(sheet, self._decimal, self._mass_unit, warnings)
        rows: list[BOMEntry] = []
        for row in sheet.rows:
            entry = _entry(sheet, row, masses, warnings)
            if entry is not None:
                rows.append(entry)
        table_rows = with_structure(masses.to_display_precision(rows))
        warnings += _duplicates(table_rows)
        return BomTable(table_rows, tuple(warnings), source)


def _entry(sheet: Sheet, row: Row, masses: _Masses, warnings: list[BomWarning]) -> BOMEntry | None:
    cell = sheet.columns.cell
    number, text = cell(row.cells, Role.PART_NUMBER), cell(row.cells, Role.DESCRIPTION)
    name = cell(row.cells, Role.NAME) or ("" if Role.NAME in sheet.columns.at else text) or number
    if not name:
        warnings.append(
            BomWarning(BomCode.NO_NAME, "has no name and no part number; it was left out", row.line)
        )
        return None
    _check_length(sheet, row, name, warnings)
    quantity = _quantity(cell(row.cells, Role.QUANTITY), row.line, name, warnings)
    mass = masses.read(row, name, quantity)
    material = cell(row.cells, Role.MATERIAL)
    return BOMEntry(
        name=name,
        material=None if is_empty(material) else material,
        mass_kg=mass.kg,
        part_number=number,
        description=text,
        quantity=quantity,
        quantum_kg=mass.quantum_kg,
        overridden=mass.overridden,
        item=cell(row.cells, Role.ITEM),
        level=_level(cell(row.cells, Role.LEVEL)),
        line=row.line,
    )


class _Masses:
    """Reads the mass column; knows its unit, its decimal mark and, afterwards, its display precision."""

    def __init__(self, sheet: Sheet, mark: Mark | None, unit: str | None, warnings: list[BomWarning]) -> None:
        self._sheet = sheet
        self._warnings = warnings
        self._role = Role.MASS if Role.MASS in sheet.columns.at else Role.TOTAL_MASS
        self._unit = sheet.columns.mass_unit or unit
        cells = [sheet.columns.cell(row.cells, self._role) for row in sheet.rows]
        self._mark = mark or column_mark(cells)
        # Without any proof: a file that separates cells by semicolons does so because its commas are decimal.
        self._likely = Mark.COMMA if sheet.delimiter == ";" else Mark.POINT
        self._units: dict[int, str] = {}
        self._told_unit = False

    def read(self, row: Row, name: str, quantity: float | None) -> MassCell:
        """The mass of one piece; every doubt goes to the warnings, with the line."""
        text = self._sheet.columns.cell(row.cells, self._role)
        cell = parse_mass(text, mark=self._mark, unit=self._unit)
        if cell.ambiguous:
            cell = self._decide(text, row.line, name)
        if cell.problem is not None:
            self._warn(
                BomCode.UNREADABLE_MASS, f"the mass “{text}” {cell.problem}; it is not used", row, name
            )
        if cell.kg is not None and not cell.unit and not self._told_unit:
            self._told_unit = True
            self._warn(
                BomCode.MASS_WITHOUT_UNIT,
                f"the mass “{text}” has no unit, nor has its header; read as kg",
                row,
                name,
            )
        self._units[row.line] = cell.unit
        return self._per_piece(cell, row, name, quantity)

    def _decide(self, text: str, line: int, name: str) -> MassCell:
        other = Mark.POINT if self._likely is Mark.COMMA else Mark.COMMA
        likely = parse_mass(text, mark=self._likely, unit=self._unit)
        unlikely = parse_mass(text, mark=other, unit=self._unit)
        # A point before three digits in a comma-separated file is how most exports look; no warning for that.
        if "," in text or self._likely is Mark.COMMA:
            self._warnings.append(
                BomWarning(
                    BomCode.AMBIGUOUS_MASS,
                    f"the mass “{text}” was read as {likely.kg:.9g} kg but could be {unlikely.kg:.9g} kg, "
                    "and no other mass shows which mark is the decimal one; say so with --decimal",
                    line,
                    name,
                )
            )
        return likely

    def _per_piece(self, cell: MassCell, row: Row, name: str, quantity: float | None) -> MassCell:
        if self._role is Role.MASS or cell.kg is None:
            return cell
        if not quantity:
            self._warn(
                BomCode.UNREADABLE_MASS,
                "there is a total mass only, and no quantity to divide it by; it is not used",
                row,
                name,
            )
            return MassCell()
        return replace(cell, kg=cell.kg / quantity, quantum_kg=cell.quantum_kg / quantity)

    def _warn(self, code: BomCode, message: str, row: Row, name: str) -> None:
        self._warnings.append(BomWarning(code, message, row.line, name))

    def to_display_precision(self, rows: Sequence[BOMEntry]) -> list[BOMEntry]:
        """The quantum of the column's finest cell of the same unit, for all: exports trim trailing zeros.

        "0.3 kg" beside "0.009 kg" was shown with three decimals as well, so that it is ± 0.0005 kg.
        """
        if self._sheet.columns.exact:
            return [replace(row, quantum_kg=0.0) for row in rows]
        if self._role is Role.TOTAL_MASS:
            return list(rows)
        finest: dict[str, float] = {}
        for row in rows:
            if row.mass_kg is not None and row.quantum_kg > 0:
                unit = self._units[row.line]
                finest[unit] = min(finest.get(unit, row.quantum_kg), row.quantum_kg)
        return [
            replace(row, quantum_kg=finest.get(self._units[row.line], 0.0))
            if row.mass_kg is not None
            else row
            for row in rows
        ]


def _quantity(text: str, line: int, name: str, warnings: list[BomWarning]) -> float | None:
    if is_empty(text):
        return None
    found = re.fullmatch(
        r"(?P<number>[\d.,\s'’]+)\s*(?:x|×|pcs?|pieces?|ea|each|stk|st|stück|個|个|件)?\.?", text.casefold()
    )
    number = parse_number(found["number"].strip(), None) if found else None
    if number is None or number.ambiguous or number.value < 0:
        warnings.append(
            BomWarning(
                BomCode.UNREADABLE_QUANTITY, f"the quantity “{text}” cannot be read; not used", line, name
            )
        )
        return None
    return number.value


def _level(text: str) -> int:
    return int(text) if text.isdecimal() and len(text) < 4 else 1


def _check_length(sheet: Sheet, row: Row, name: str, warnings: list[BomWarning]) -> None:
    extra = [cell for cell in row.cells[len(sheet.header) :] if cell.strip()]
    if extra:
        warnings.append(
            BomWarning(
                BomCode.ROW_LENGTH,
                f"has {len(row.cells)} cells where the header has {len(sheet.header)}; "
                "a comma without quotes shifts the columns",
                row.line,
                name,
            )
        )
    elif len(row.cells) <= max(sheet.columns.at.values()):
        warnings.append(
            BomWarning(
                BomCode.ROW_LENGTH,
                f"has {len(row.cells)} cells where the header has {len(sheet.header)}; "
                "the missing ones count as empty",
                row.line,
                name,
            )
        )


def _missing_columns(sheet: Sheet) -> list[BomWarning]:
    at = sheet.columns.at
    seen = ", ".join(cell.strip() for cell in sheet.header if cell.strip())
    missing = []
    if Role.MASS not in at and Role.TOTAL_MASS not in at:
        missing.append("mass")
    if Role.MATERIAL not in at:
        missing.append("material")
    return [
        BomWarning(
            BomCode.MISSING_COLUMN,
            f"there is no {what} column (the columns are {seen}); "
            f"if one of them is it, say --column {what}=…",
            sheet.header_line,
        )
        for what in missing
    ]


def _duplicates(rows: Sequence[BOMEntry]) -> list[BomWarning]:
    by_name: dict[str, list[BOMEntry]] = defaultdict(list)
    for row in rows:
        by_name[row.name].append(row)
    return [
        BomWarning(
            BomCode.DUPLICATE_NAME,
            f"{len(same)} rows are named “{name}” (lines {', '.join(str(r.line) for r in same)}) "
            "with different data; parts are told apart by quantity and mass",
            same[1].line,
            name,
        )
        for name, same in by_name.items()
        if len({row.data for row in same}) > 1
    ]
