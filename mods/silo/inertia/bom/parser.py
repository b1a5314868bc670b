# SPDX-License-Identifier: LGPL-2.1-or-later
"""A BOM file → :class:`BomTable`. Tolerant of shapes, strict about meaning: what is unclear is a warning."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from silo.bom.errors import InputError, counted
from silo.bom.headers import Heading
from silo.bom.message import message
from silo.bom.numbers import Mark, read_count
from silo.bom.quantities import LARGEST_QUANTITY
from silo.bom.system_refusals import why_refused
from silo.inertia.bom.columns import MASSES, NAMING, MassColumns, continues, mass_columns
from silo.inertia.bom.mass_cell import is_empty, parse_mass, unit_factor
from silo.inertia.bom.mass_header import read_mass_header
from silo.inertia.bom.masses import MassReader
from silo.inertia.bom.structure import (
    doubtful_items,
    item_role_of,
    level_of,
    with_levels_of_indents,
    with_structure,
)
from silo.inertia.bom.table import BomCode, BOMEntry, BomTable, BomWarning
from silo.tables.clashes import find_clashes
from silo.tables.sheet import Sheet, read_sheet
from silo.tables.structure import position
from silo.tables.totals import is_total
from silo.tables.yes_no import empty_means_fitted, is_fitted
from silo.workbook.sheet import SheetRow


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
            raise InputError(message("the decimal mark is “.” or “,”, got “{decimal}”", decimal=decimal))
        if mass_unit is not None and unit_factor(mass_unit) is None:
            raise InputError(
                message(
                    "“{mass_unit}” is not a unit of mass; known are kg, g, mg, t, lb, oz", mass_unit=mass_unit
                )
            )
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
            raise InputError(
                message("{path}: the BOM cannot be read ({error})", path=path, error=why_refused(error))
            ) from error
        return self.parse_bytes(data, str(path))

    def parse_bytes(self, data: bytes, source: str = "BOM") -> BomTable:
        """Do what :meth:`parse` does, from bytes."""
        sheet = read_sheet(
            data,
            source,
            MASSES,
            columns=self._columns,
            encoding=self._encoding,
            delimiter=self._delimiter,
            continues=continues,
        )
        warnings = [BomWarning(BomCode.FILE, note) for note in sheet.notes]
        warnings += _doubtful_columns(sheet, mass_columns(sheet))
        warnings += _second_columns(sheet)
        masses = MassReader(sheet, self._decimal, self._mass_unit, warnings)
        item_role = item_role_of(sheet)
        counted_rows = [row for row in sheet.rows if _is_counted(sheet, row, warnings)]
        entries = [_entry(sheet, row, masses, item_role, warnings) for row in counted_rows]
        rows = with_levels_of_indents([entry for entry in entries if entry is not None], sheet, warnings)
        table_rows = masses.check_totals(BomTable(with_structure(masses.to_display_precision(rows))))
        warnings += doubtful_items(table_rows)
        warnings += _duplicates(table_rows)
        return BomTable(table_rows, tuple(warnings), source)


def _is_counted(sheet: Sheet, row: SheetRow, warnings: list[BomWarning]) -> bool:
    """Return False for a sum below the table, and for a part that is not fitted; the warnings name both."""
    cell = sheet.columns.cell
    names = [cell(row.cells, role) for role in NAMING]
    name = next(filter(None, names), "")
    if is_total(names, row.cells):
        warnings.append(
            BomWarning(BomCode.LEFT_OUT, message("is a sum and no part; it was left out"), row.line, name)
        )
        return False
    for role in (Heading.NOT_FITTED, Heading.FITTED):
        text = cell(row.cells, role)
        if role not in sheet.columns.at or (role is Heading.FITTED and not text):
            continue
        title = sheet.header[sheet.columns.at[role]].strip()
        fitted = is_fitted(text, by_absence=role is Heading.NOT_FITTED)
        if fitted is None:
            words = message(
                "“{text}” under “{title}” is neither yes nor no; the row was read as fitted",
                text=text,
                title=title,
            )
            warnings.append(BomWarning(BomCode.FILE, words, row.line, name))
        elif not fitted:
            words = message("is not fitted (“{title}” is “{text}”); it was left out", title=title, text=text)
            warnings.append(BomWarning(BomCode.LEFT_OUT, words, row.line, name))
            return False
    if Heading.FITTED in sheet.columns.at and not cell(row.cells, Heading.FITTED):
        texts = [cell(other.cells, Heading.FITTED) for other in sheet.rows]
        if not empty_means_fitted(texts):
            title = sheet.header[sheet.columns.at[Heading.FITTED]].strip()
            words = message(
                "“{title}” is empty here and not elsewhere; the row was read as fitted", title=title
            )
            warnings.append(BomWarning(BomCode.FILE, words, row.line, name))
    return True


def _entry(
    sheet: Sheet, row: SheetRow, masses: MassReader, item_role: Heading, warnings: list[BomWarning]
) -> BOMEntry | None:
    cell = sheet.columns.cell
    number, text = cell(row.cells, Heading.PART_NUMBER), cell(row.cells, Heading.DESCRIPTION)
    name = cell(row.cells, Heading.NAME) or ("" if Heading.NAME in sheet.columns.at else text) or number
    if not name:
        words = message("has no name and no part number; it was left out")
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
        item=_item(cell(row.cells, item_role) or cell(row.cells, Heading.FIND_NUMBER)),
        level=level_of(cell(row.cells, Heading.LEVEL), item_role, row.line, name, warnings),
        line=row.line,
    )


def _item(text: str) -> str:
    """Write a position with commas as others do: 1,1 is 1.1."""
    return position(text) or text if "," in text else text


def _quantity(text: str, line: int, name: str, warnings: list[BomWarning]) -> float | None:
    if is_empty(text):
        return None
    reading = read_count(text)
    if reading.value is not None and 0 <= reading.value <= LARGEST_QUANTITY:
        return float(reading.value)
    problem = reading.problem or message("wanted a number of pieces")
    words = message(
        "the quantity “{text}” cannot be read and is not used: {problem}", text=text, problem=problem
    )
    warnings.append(BomWarning(BomCode.UNREADABLE_QUANTITY, words, line, name))
    return None


def _check_length(sheet: Sheet, row: SheetRow, name: str, warnings: list[BomWarning]) -> None:
    if sheet.delimiter and len(row.cells) <= max(sheet.columns.at.values()):
        words = message(
            "has {cells}, and the header has {count}; ",
            cells=counted(len(row.cells), "cell"),
            count=len(sheet.header),
        )
        words += message("the missing ones count as empty")
        warnings.append(BomWarning(BomCode.ROW_LENGTH, words, row.line, name))


def _doubtful_columns(sheet: Sheet, headers: MassColumns) -> Iterator[BomWarning]:
    at = sheet.columns.at
    for role, header in headers.masses.items():
        if header.rate:
            words = message(
                "“{role}” is no mass by its header, and was used as one", role=sheet.header[at[role]].strip()
            )
            yield BomWarning(BomCode.FILE, words, sheet.header_line)
    seen = ", ".join(cell.strip() for cell in sheet.header if cell.strip())
    unused = [
        index
        for index in headers.unused
        if any(parse_mass(cell).kg is not None for row in sheet.rows for cell in row.cells[index : index + 1])
    ]
    titles = [sheet.header[index].strip() for index in unused]
    for what, is_role_known in (("mass", headers.masses), ("material", Heading.MATERIAL in at)):
        if not is_role_known:
            title = titles[0] if what == "mass" and titles else "…"
            words = message("there is no {what} column (the columns are {seen}); ", what=what, seen=seen)
            words += message('if one of them is it, say --column "{what}={title}"', what=what, title=title)
            yield BomWarning(BomCode.MISSING_COLUMN, words, sheet.header_line)
    for title in titles if headers.masses else ():
        words = message(
            'the column “{title}” may hold masses, and was not used; --column "mass={title}" takes it',
            title=title,
        )
        if read_mass_header(title).rate:
            words = message(
                "the column “{title}” holds no masses of one piece, and was not used", title=title
            )
        yield BomWarning(BomCode.UNUSED_COLUMN, words, sheet.header_line)


def _second_columns(sheet: Sheet) -> Iterator[BomWarning]:
    """Warn of columns with the same meaning as a used column, but a different value somewhere."""
    cells = [row.cells for row in sheet.rows]
    for clash in find_clashes(sheet.header, cells, sheet.columns.at, sheet.columns.others, is_empty):
        yield BomWarning(
            BomCode.FILE,
            message(
                "the columns “{ours}” and “{other}” both mean the {role}; “{ours}” was used, "
                "though line {line} has “{used}” there and “{unused}” in the other. --column "
                '"{column}={other}" takes the other one',
                ours=clash.ours,
                other=clash.other,
                role=clash.role.replace("_", " "),
                line=sheet.rows[clash.row].line,
                used=clash.used,
                unused=clash.unused,
                column=clash.role,
            ),
            sheet.header_line,
        )


def _duplicates(rows: Sequence[BOMEntry]) -> list[BomWarning]:
    by_name: dict[str, list[BOMEntry]] = defaultdict(list)
    for row in rows:
        by_name[row.name].append(row)
    return [
        BomWarning(
            BomCode.DUPLICATE_NAME,
            message(
                "{count} rows are named “{name}” (lines {same}) with different data; parts are "
                "matched by quantity and mass",
                count=len(same),
                name=name,
                same=", ".join(str(r.line) for r in same),
            ),
            same[1].line,
            name,
        )
        for name, same in by_name.items()
        if len({row.data for row in same}) > 1
    ]
