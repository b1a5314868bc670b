# SPDX-License-Identifier: LGPL-2.1-or-later
"""A BOM file → :class:`BomTable`. Tolerant of shapes, strict about meaning: what is unclear is a warning."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

from silo.bom.errors import InputError, counted
from silo.bom.headers import Heading, find_clashes
from silo.bom.numbers import Mark, read_count
from silo.bom.quantities import LARGEST_QUANTITY
from silo.inertia.bom import (
    FORCE_UNITS,
    BomCode,
    BOMEntry,
    BomTable,
    BomWarning,
    MassCell,
    column_mark,
    is_empty,
    parse_mass,
    read_mass_header,
    unit_factor,
)
from silo.inertia.bom.sheet import MASS_COLUMNS, Sheet, read_sheet
from silo.workbook import SheetRow

_TOTAL_TOLERANCE = 1e-3
"""Relative, beside the rounding of both columns: how far a total may be from quantity times mass."""


class MassReader:
    """Reads the mass of one piece of each row: its own column first, else the total over the quantity.

    ``mark`` and ``unit`` are the user's word; a unit in a header wins over ``unit``, one in a cell over both.
    Every doubt becomes one of the ``warnings``.
    """

    def __init__(self, sheet: Sheet, mark: Mark | None, unit: str | None, warnings: list[BomWarning]) -> None:
        self._columns = sheet.columns
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
            or any(h.unit for h in sheet.columns.masses.values())
        ):
            return Heading.MASS_UNIT
        bare = [row for row in sheet.rows if any(cell(row.cells, role) for role in MASS_COLUMNS)]
        units = {unit for row in bare if (unit := cell(row.cells, Heading.UNIT))}
        masses = {unit for unit in units if unit_factor(unit) is not None}
        if not masses:
            return Heading.MASS_UNIT
        title = sheet.header[at[Heading.UNIT]].strip()
        words = f"the column “{title}” was read as the unit of the masses"
        if masses != units:
            words = (
                f"the column “{title}” has units of mass ({', '.join(sorted(masses))}) beside others; "
                "it was read as the unit of the quantities, and not of the masses"
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
        words = "there is a total mass only, and no quantity to divide it by; it is not used"
        self._report(BomCode.UNREADABLE_MASS, words, row.line, name)
        return MassCell()

    def to_display_precision(self, rows: Sequence[BOMEntry]) -> list[BOMEntry]:
        """Give each cell the quantum of the finest cell with the same unit, since exports trim trailing
        zeros.

        If a column has "0.009 kg", its "0.3 kg" had three decimals as well, so that it is ± 0.0005 kg.
        """
        if self._columns.exact:
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
        header = self._columns.masses.get(role)
        if header is None:
            return MassCell()
        text = self._columns.cell(row.cells, role)
        unit = header.unit or self._columns.cell(row.cells, self._unit_role) or self._unit
        cell = parse_mass(text, mark=self._marks[role], unit=unit)
        if cell.ambiguous:
            cell = self._decide(text, unit, row, name)
        if cell.doubt:
            self._report(BomCode.AMBIGUOUS_MASS, f"the mass “{text}” {cell.doubt}", row.line, name)
        if cell.problem is not None:
            words = f"the mass “{text}” {cell.problem}; it is not used"
            self._report(BomCode.UNREADABLE_MASS, words, row.line, name)
        if cell.kg is None:
            return cell
        if not cell.unit:
            sentence = f"and “{header.strange}” in its header is no known unit"
            words = f"the mass “{text}” has no unit, {sentence if header.strange else 'nor has its header'}"
            self._report(BomCode.MASS_WITHOUT_UNIT, f"{words}; read as kg", row.line, name, once=True)
        if cell.unit in FORCE_UNITS:
            words = f"“{cell.unit}” is a unit of force; masses are what weighs as much at 9.80665 m/s²"
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
            f"the mass “{text}” was read as {likely.kg:.9g} kg but could be {unlikely.kg:.9g} kg, "
            "and no other mass shows which mark is the decimal one; say so with --decimal",
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
            words = (
                f"the total mass was divided by the {row.quantity:g} pieces in one “{above[0].name}”; "
                "if it is the total of the whole product, one piece weighs less"
            )
            self._report(BomCode.AMBIGUOUS_MASS, words, row.line, row.name)
            return replace(row, unsure=True)
        # Of the row, or of the whole product (as in Silo's own export): the one that fits counts.
        counts = {row.quantity, table.total_quantity(row) or row.quantity}
        if not any(_agree(row, count, total) for count in counts):
            words = (
                f"the total mass says {total.kg:.6g} kg, but {row.quantity:g} times {row.mass_kg:.6g} kg is "
                f"{row.mass_kg * row.quantity:.6g} kg; the mass of one piece was used"
            )
            self._report(BomCode.TOTAL_DIFFERS, words, row.line, row.name)
        return row


def _agree(row: BOMEntry, count: float, total: MassCell) -> bool:
    expected = (row.mass_kg or 0.0) * count
    allowed = row.quantum_kg * count + total.quantum_kg + _TOTAL_TOLERANCE * expected
    return abs(expected - (total.kg or 0.0)) <= allowed


class BOMParser:
    """Reads BOM exports of Onshape and others, and Silo's own.

    All options are the user's word against what the file shows:

    columns
        role → header text, for renamed columns: ``{"name": "Bauteil", "mass": "Gew."}``.
    encoding, delimiter
        of the file.
    decimal
        "." or ",".
    mass_unit
        of mass cells without a unit, if the header states none either (else kg, with a warning).
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
            raise InputError(f"“{mass_unit}” is not a unit of mass; known are kg, g, mg, t, lb, oz")
        self._columns = columns
        self._encoding = encoding
        self._delimiter = delimiter
        self._decimal = None if decimal is None else Mark(decimal)
        self._mass_unit = mass_unit

    def parse(self, path: Path | str) -> BomTable:
        """Read a file. InputError if it is absent, or has no header with names; everything else is a
        warning.
        """
        try:
            data = Path(path).read_bytes()
        except OSError as error:
            raise InputError(f"{path}: the BOM cannot be read ({error.strerror or error})") from error
        return self.parse_bytes(data, str(path))

    def parse_bytes(self, data: bytes, source: str = "BOM") -> BomTable:
        """Do what :meth:`parse` does, from bytes."""
        sheet = read_sheet(
            data,
            source,
            columns=self._columns,
            encoding=self._encoding,
            delimiter=self._delimiter,
        )
        warnings = [BomWarning(BomCode.FILE, note) for note in sheet.notes]
        warnings += _doubtful_columns(sheet)
        warnings += _second_columns(sheet)
        masses = MassReader(sheet, self._decimal, self._mass_unit, warnings)
        item_role = _item_role(sheet)
        entries = [_entry(sheet, row, masses, item_role, warnings) for row in sheet.rows]
        rows = _indented([entry for entry in entries if entry is not None], sheet, warnings)
        table_rows = masses.check_totals(BomTable(with_structure(masses.to_display_precision(rows))))
        warnings += _doubtful_items(table_rows)
        warnings += _duplicates(table_rows)
        return BomTable(table_rows, tuple(warnings), source)


def _entry(
    sheet: Sheet, row: SheetRow, masses: MassReader, item_role: Heading, warnings: list[BomWarning]
) -> BOMEntry | None:
    cell = sheet.columns.cell
    number, text = cell(row.cells, Heading.PART_NUMBER), cell(row.cells, Heading.DESCRIPTION)
    name = cell(row.cells, Heading.NAME) or ("" if Heading.NAME in sheet.columns.at else text) or number
    if not name:
        words = "has no name and no part number; it was left out"
        warnings.append(BomWarning(BomCode.NO_NAME, words, row.line))
        return None
    _check_length(sheet, row, name, warnings)
    quantity = _quantity(cell(row.cells, Heading.QUANTITY), row.line, name, warnings)
    mass = masses.read(row, name, quantity)
    material = cell(row.cells, Heading.MATERIAL)
    return BOMEntry(
        name=name,
        material=None if is_empty(material) else material,
        mass_kg=mass.kg,
        part_number=number,
        quantity=quantity,
        quantum_kg=mass.quantum_kg,
        overridden=mass.overridden,
        unsure=mass.ambiguous or bool(mass.doubt),
        item=cell(row.cells, item_role) or cell(row.cells, Heading.FIND_NUMBER),
        level=_level(cell(row.cells, Heading.LEVEL), item_role, row.line, name, warnings),
        line=row.line,
    )


def _indented(rows: list[BOMEntry], sheet: Sheet, warnings: list[BomWarning]) -> list[BOMEntry]:
    """Derive levels from the spaces before the names, if nothing else shows the structure.

    A step is two spaces or more, and there are never two steps down at once: a single wrong space makes no
    sub-assembly.
    """
    at = sheet.columns.at
    if Heading.LEVEL in at or any("." in row.item for row in rows):
        return rows
    column = next(at[role] for role in (Heading.NAME, Heading.DESCRIPTION, Heading.PART_NUMBER) if role in at)
    cells = {row.line: row.cells[column] for row in sheet.rows if column < len(row.cells)}
    depths = [_depth(cells.get(row.line, "")) for row in rows]
    step = min(filter(None, depths), default=0)
    levels = [depth // step if step else 0 for depth in depths]
    deeper = any(level > above + 1 for above, level in pairwise([-1, *levels]))
    if step < 2 or deeper or any(depth % step for depth in depths):
        return rows
    words = "the names are indented; a row belongs to the one above it that is indented less"
    warnings.append(BomWarning(BomCode.FILE, words, sheet.header_line))
    return [replace(row, level=level + 1) for row, level in zip(rows, levels, strict=True)]


def _depth(cell: str) -> int:
    text = cell.expandtabs(4)
    return len(text) - len(text.lstrip())


def _quantity(text: str, line: int, name: str, warnings: list[BomWarning]) -> float | None:
    if is_empty(text):
        return None
    reading = read_count(text)
    if reading.value is not None and 0 <= reading.value <= LARGEST_QUANTITY:
        return float(reading.value)
    problem = reading.problem or "wanted a number of pieces"
    words = f"the quantity “{text}” cannot be read and is not used: {problem}"
    warnings.append(BomWarning(BomCode.UNREADABLE_QUANTITY, words, line, name))
    return None


def _item_role(sheet: Sheet) -> Heading:
    """Return the role of the column with item numbers; some tools call it the level: 1, 1.1, 1.1.2."""

    def dotted(role: Heading) -> bool:
        return any(re.fullmatch(r"\d+(?:\.\d+)+", sheet.columns.cell(r.cells, role)) for r in sheet.rows)

    return Heading.LEVEL if dotted(Heading.LEVEL) and not dotted(Heading.ITEM) else Heading.ITEM


def _level(text: str, item_role: Heading, line: int, name: str, warnings: list[BomWarning]) -> int:
    """Read a level: "2", "..2" and "+2" are one below "1". Item numbers (1.1) are no levels."""
    match = re.fullmatch(r"[\s.+>·-]*(\d{1,3})[\s.]*", text)
    if match is None and text and item_role is not Heading.LEVEL:
        words = f"the level “{text}” cannot be read; the row is taken to stand at the top"
        warnings.append(BomWarning(BomCode.FILE, words, line, name))
    return int(match[1]) if match else 1


def _check_length(sheet: Sheet, row: SheetRow, name: str, warnings: list[BomWarning]) -> None:
    if not sheet.delimiter:
        return  # a workbook's cells have fixed places
    if any(cell.strip() for cell in row.cells[len(sheet.header) :]):
        what = "a comma without quotes shifts the columns"
    elif len(row.cells) <= max(sheet.columns.at.values()):
        what = "the missing ones count as empty"
    else:
        return
    words = f"has {counted(len(row.cells), 'cell')}, and the header has {len(sheet.header)}; {what}"
    warnings.append(BomWarning(BomCode.ROW_LENGTH, words, row.line, name))


def _doubtful_columns(sheet: Sheet) -> Iterator[BomWarning]:
    at = sheet.columns.at
    for role, header in sheet.columns.masses.items():
        if header.rate:
            words = f"“{sheet.header[at[role]].strip()}” is no mass by its header, and was used as one"
            yield BomWarning(BomCode.FILE, words, sheet.header_line)
    seen = ", ".join(cell.strip() for cell in sheet.header if cell.strip())
    unused = [
        index
        for index in sheet.columns.unused
        if any(parse_mass(cell).kg is not None for row in sheet.rows for cell in row.cells[index : index + 1])
    ]
    titles = [sheet.header[index].strip() for index in unused]
    for what, is_role_known in (("mass", sheet.columns.masses), ("material", Heading.MATERIAL in at)):
        if not is_role_known:
            title = titles[0] if what == "mass" and titles else "…"
            words = f"there is no {what} column (the columns are {seen}); "
            words += f'if one of them is it, say --column "{what}={title}"'
            yield BomWarning(BomCode.MISSING_COLUMN, words, sheet.header_line)
    for title in titles if sheet.columns.masses else ():
        words = f'the column “{title}” may hold masses, and was not used; --column "mass={title}" takes it'
        if read_mass_header(title).rate:
            words = f"the column “{title}” holds no masses of one piece, and was not used"
        yield BomWarning(BomCode.UNUSED_COLUMN, words, sheet.header_line)


def _second_columns(sheet: Sheet) -> Iterator[BomWarning]:
    """Warn of columns with the same meaning as a used column, but a different value somewhere."""
    cells = [row.cells for row in sheet.rows]
    for clash in find_clashes(sheet.header, cells, sheet.columns.at, sheet.columns.others, is_empty):
        yield BomWarning(
            BomCode.FILE,
            f"the columns “{clash.ours}” and “{clash.other}” both mean the {clash.role.replace('_', ' ')}; "
            f"“{clash.ours}” was used, though line {sheet.rows[clash.row].line} has “{clash.used}” there and "
            f'“{clash.unused}” in the other. --column "{clash.role}={clash.other}" takes the other one',
            sheet.header_line,
        )


def _doubtful_items(rows: Sequence[BOMEntry]) -> Iterator[BomWarning]:
    """Warn of item numbers that a spreadsheet may have changed.

    A spreadsheet changes 1.10 to 1.1, and 1.2 to the second of January.
    """
    if not any("." in row.item for row in rows):
        return
    first: dict[str, int] = {}
    for row in rows:
        if first.setdefault(row.item, row.line) != row.line and "." in row.item:
            words = (
                f"the item number {row.item} stands in line {first[row.item]} as well (was it 1.10 for 1.1?)"
            )
            yield BomWarning(BomCode.FILE, f"{words}; rows below may belong to either", row.line, row.name)
        elif row.item and not _ITEM.fullmatch(row.item.strip().rstrip(".")):
            words = f"the item number “{row.item}” cannot be read; the row is taken to stand at the top"
            yield BomWarning(BomCode.FILE, words, row.line, row.name)


def _duplicates(rows: Sequence[BOMEntry]) -> list[BomWarning]:
    by_name: dict[str, list[BOMEntry]] = defaultdict(list)
    for row in rows:
        by_name[row.name].append(row)
    return [
        BomWarning(
            BomCode.DUPLICATE_NAME,
            f"{len(same)} rows are named “{name}” (lines {', '.join(str(r.line) for r in same)}) "
            "with different data; parts are matched by quantity and mass",
            same[1].line,
            name,
        )
        for name, same in by_name.items()
        if len({row.data for row in same}) > 1
    ]


_ITEM = re.compile(r"\d+(?:\.\d+)*")


def with_structure(rows: Sequence[BOMEntry]) -> tuple[BOMEntry, ...]:
    """Fill in ``parent``, ``level`` and ``has_children`` of the rows.

    Item numbers win over levels. A row whose parent is not in the file (a flattened list, a cut-out) is at
    the top level; no parent is invented for it.
    """
    parents = _by_item(rows) if any("." in row.item for row in rows) else _by_level(rows)
    having = {parent for parent in parents if parent is not None}
    levels: list[int] = []
    for parent in parents:
        levels.append(1 if parent is None else levels[parent] + 1)
    return tuple(
        replace(row, parent=parent, level=level, has_children=index in having)
        for index, (row, parent, level) in enumerate(zip(rows, parents, levels, strict=True))
    )


def _by_item(rows: Sequence[BOMEntry]) -> list[int | None]:
    seen: dict[str, int] = {}
    parents: list[int | None] = []
    for index, row in enumerate(rows):
        item = row.item.strip().rstrip(".")
        parent: int | None = None
        if _ITEM.fullmatch(item):
            head = item.rpartition(".")[0]
            parent = seen.get(head) if head else None
            seen[item] = index
        parents.append(parent)
    return parents


def _by_level(rows: Sequence[BOMEntry]) -> list[int | None]:
    """Find the parent of each row: the last row above it that is one level up (levels may start at 0 or
    1).
    """
    stack: list[tuple[int, int]] = []
    parents: list[int | None] = []
    for index, row in enumerate(rows):
        while stack and stack[-1][0] >= row.level:
            stack.pop()
        parents.append(stack[-1][1] if stack else None)
        stack.append((row.level, index))
    return parents
