# SPDX-License-Identifier: LGPL-2.1-or-later
"""The table in a CSV export or a workbook: its header, and its rows with their line numbers.

Encoding and delimiter of a CSV file are detected. The order of the tries: a byte order mark decides; then
UTF-8; then the Windows code pages. A delimiter is right if a line under it reads as a header; nothing is
concluded from counting commas.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice, zip_longest

from silo.bom.errors import InputError, counted, listed
from silo.inertia.bom.columns import MASS_COLUMNS, NAMING, Columns, find_columns
from silo.inertia.bom.mass_header import read_mass_header
from silo.workbook.encoding import STARTS, unicode_name
from silo.workbook.read import read_workbook
from silo.workbook.sheet import Grid, SheetRow

MAX_BYTES = 64 * 1024 * 1024
HEADER_WITHIN = 40
"""The header must be among this many first lines (title blocks are a few lines long)."""

DELIMITERS = ",;\t|"
_NUMBER = re.compile(r"[\s+\-−~(]*[\d.,]")
_CODE_PAGES = ("cp1252", "cp932", "gb18030", "latin-1")


@dataclass(frozen=True, slots=True)
class Sheet:
    """A decoded table; a workbook has no ``delimiter``. ``notes``: what had to be assumed to read it."""

    header: tuple[str, ...]
    header_line: int
    columns: Columns
    rows: tuple[SheetRow, ...]
    delimiter: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class _Header:
    delimiter: str
    index: int
    columns: Columns


def read_sheet(
    data: bytes,
    source: str,
    *,
    columns: Mapping[str, str] | None = None,
    encoding: str | None = None,
    delimiter: str | None = None,
) -> Sheet:
    """Decode a CSV export, or the first sheet of a workbook that holds a BOM.

    ``columns``, ``encoding``, ``delimiter``: given by the user, else detected.

    Raises InputError if there is no header line with a column that distinguishes parts, or if the given
    encoding does not fit; the message lists what was found.
    """
    if len(data) > MAX_BYTES:
        raise InputError(
            f"{source}: {len(data) / 1e6:.0f} MB is too large for a BOM (limit {MAX_BYTES / 1e6:.0f} MB)"
        )
    if delimiter is not None and len(delimiter) != 1:
        raise InputError(f"a delimiter is one character, got “{delimiter}”")
    first_lines: list[str] = []
    if data.startswith(STARTS):
        sheets = [(grid, grid.rows()) for grid in read_workbook(data, source)]
        usable = [
            (grid, rows, best)
            for grid, rows in sheets
            if (best := _best_header([("", rows[:HEADER_WITHIN])], columns)) is not None
        ]
        if usable:
            notes = []
            if usable[1:]:
                others = ", ".join(f"sheet “{grid.name}”" for grid, _, _ in usable[1:])
                notes = [f"sheet “{usable[0][0].name}” of the workbook was read; not read: {others}"]
            grid, rows, best = usable[0]
            return _sheet(rows, best, columns, notes, grid)
        first_lines = [", ".join(row.cells) for _, rows in sheets for row in rows]
    for name, text in () if data.startswith(STARTS) else _decodings(data, encoding, source):
        if text.lstrip()[:1] == "<":
            raise InputError(f"{source}: this is HTML or XML and no table; export it as CSV or XLSX")
        first_lines = first_lines or text.splitlines()
        tables = ((mark, _first_records(text, mark)) for mark in delimiter or DELIMITERS)
        best = _best_header(tables, columns)
        if best is not None:
            notes = []
            if name in _CODE_PAGES and not data.isascii():
                notes.append(
                    f"the file is not UTF-8; it was read as {name}. If names look wrong, "
                    "export it as UTF-8 or say which encoding it has"
                )
            bad = _bad_quotes(text, best.delimiter)
            if bad is not None:
                words = "the quotes do not match; rows from here on may be read wrongly or be missing"
                notes.append(f"line {bad}: {words}")
            return _sheet(list(_records(text, best.delimiter)), best, columns, notes)
    raise InputError(f"{source}: {_no_header(first_lines)}")


def _sheet(
    records: list[SheetRow],
    best: _Header,
    given: Mapping[str, str] | None,
    notes: list[str],
    grid: Grid | None = None,
) -> Sheet:
    header, columns, first = records[best.index], best.columns, best.index + 1
    if _continues(header, columns, records[first:][:1]):
        # "Mass" over "[g]", or over "each" and "total": a merged cell has its text in the first one.
        filled = [next(filter(None, reversed(header.cells[: i + 1])), "") for i in range(len(header.cells))]
        below = records[first].cells
        filled += [filled[-1]] * (len(below) - len(filled))
        cells = [
            f"{above} ({under})" if under.strip() else own
            for above, own, under in zip_longest(filled, header.cells, below, fillvalue="")
        ]
        header, columns = SheetRow(header.line, tuple(cells)), find_columns(cells, given)
        first += 1
    seen = ", ".join(cell.strip() for cell in header.cells if cell.strip())
    notes += [
        f"there is no column “{text}” for {role} in line {header.line} ({seen})"
        for role, text in (given or {}).items()
        if role not in columns.at
    ]
    if grid is not None:
        records, more = _as_shown(records, grid, header, columns)
        notes += more
    rows = tuple(
        row for row in records[first:] if any(map(str.strip, row.cells)) and row.cells != header.cells
    )
    return Sheet(header.cells, header.line, columns, rows, best.delimiter, tuple(notes))


def _as_shown(
    records: list[SheetRow], grid: Grid, header: SheetRow, columns: Columns
) -> tuple[list[SheetRow], list[str]]:
    """Copy the text of each merged cell to all of its lines, and list what a reader must know.

    A number in a merged cell may belong to all lines together, so only the first line keeps it.
    """
    used = sorted(columns.at.values())
    facts = {
        place: cell for place, cell in grid.cells.items() if place[0] + 1 > header.line and place[1] in used
    }
    covered = sorted(grid.covered() & facts.keys())
    at = {row.line: index for index, row in enumerate(records)}
    texts, numbers = [], []
    for top, column, bottom, _ in sorted(grid.merged):
        cell = facts.get((top, column))
        if cell is None or bottom == top:
            continue
        what = f"“{cell.text.strip()}” in lines {top + 1} to {bottom + 1}"
        if _NUMBER.match(cell.text):
            numbers.append(what)
            continue
        texts.append(what)
        for index in range(at[top + 1] + 1, len(records)):
            row = records[index]
            if row.line > bottom + 1:
                break
            cells = [*row.cells, *[""] * (column + 1 - len(row.cells))]
            cells[column] = cell.text
            records[index] = SheetRow(row.line, tuple(cells))
    hidden = sorted({row for row, _ in grid.cells if row in grid.hidden_rows})
    struck = sorted({row for (row, _), cell in facts.items() if cell.struck})
    uncalculated = sum(cell.uncalculated for cell in grid.cells.values())
    hidden_columns = [header.cells[column].strip() for column in used if column in grid.hidden_columns]
    under = [f"“{facts[place].text.strip()}” in line {place[0] + 1}" for place in covered]
    like_others = "in the workbook; {} read like all others"
    notes = {
        f"{counted(uncalculated, 'formula')} without a value; "
        "open and save the workbook in a program that calculates them": uncalculated,
        f"{_lines(hidden)} hidden {like_others.format('hidden lines are')}": hidden,
        f"{_columns(hidden_columns)} hidden {like_others.format('hidden columns are')}": hidden_columns,
        f"{_lines(struck, 'has', 'have')} struck-out text {like_others.format('it is')}": struck,
        f"merged cells: {listed(texts)}; each of these lines was given the text": texts,
        f"merged cells: {listed(numbers)}; only the first of these lines has the number": numbers,
        f"under merged cells, where no program shows it: {listed(under)}; it is not used": under,
    }
    return records, [note for note, there in notes.items() if there]


def _lines(rows: Sequence[int], text: str = "is", many: str = "are") -> str:
    numbers = listed([str(row + 1) for row in rows], 8)
    return f"lines {numbers} {many}" if len(rows) > 1 else f"line {numbers} {text}"


def _columns(names: Sequence[str]) -> str:
    shown = listed([f"“{name}”" for name in names], 8)
    return f"the columns {shown} are" if len(names) > 1 else f"the column {shown} is"


def _continues(header: SheetRow, columns: Columns, below: Sequence[SheetRow]) -> bool:
    """Return True if the record below a header is its second line: no name, and units for masses."""
    if not below or any(columns.cell(below[0].cells, role) for role in NAMING):
        return False
    if any(letter.isdigit() for cell in below[0].cells for letter in cell):
        return False
    places = [columns.at[role] for role in MASS_COLUMNS if role in columns.at]
    read = [
        read_mass_header(f"mass ({cell.strip('[](){} ')})")
        for place in places
        for cell in below[0].cells[place : place + 1]
        if any(map(str.isalpha, cell))
    ]
    return bool(read) and not any(mass_header.strange or mass_header.rate for mass_header in read)


def _decodings(data: bytes, encoding: str | None, source: str) -> Iterator[tuple[str, str]]:
    """Yield the name of each encoding that is possible, and the text in it."""
    if encoding is not None:
        try:
            yield encoding, data.decode(encoding)
        except (UnicodeDecodeError, LookupError) as error:
            raise InputError(f"{source}: cannot be read as {encoding}: {error}") from error
        return
    if name := unicode_name(data):
        yield name, data.decode(name, errors="replace")
        return
    for name in ("utf-8", *_CODE_PAGES):
        try:
            yield name, data.decode(name)
        except UnicodeDecodeError:
            continue


def _records(text: str, delimiter: str, *, strict: bool = False) -> Iterator[SheetRow]:
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=strict)
    line = 1
    for cells in reader:
        yield SheetRow(line, tuple(cell.replace("\0", "") for cell in cells))
        line = reader.line_num + 1


def _bad_quotes(text: str, delimiter: str) -> int | None:
    """Return the line at which quotes stop matching; None if all match.

    Without this check, a quote that is never closed would hide all rows below it without a message.
    """
    line = 1
    try:
        for row in _records(text, delimiter, strict=True):
            line = row.line + 1
    except csv.Error:
        return line
    return None


def _best_header(
    tables: Iterable[tuple[str, Sequence[SheetRow]]], given: Mapping[str, str] | None
) -> _Header | None:
    """Find the (delimiter, line) that names most roles; None if no line names a usable set."""
    best: _Header | None = None
    score = (0, 0)
    for delimiter, rows in tables:
        for index, row in enumerate(rows):
            columns = find_columns(row.cells, given)
            # A column of its own beside the name keeps a title ("Name") from passing as a header, unless
            # the file has that one column only.
            here = (len(columns.at), -index)
            single = len([cell for cell in row.cells if cell.strip()]) == 1
            if columns.usable and here > score and (len(columns.at) > 1 or single):
                best, score = _Header(delimiter, index, columns), here
    return best


def _first_records(text: str, delimiter: str) -> list[SheetRow]:
    try:
        return list(islice(_records(text, delimiter), HEADER_WITHIN))
    except csv.Error:  # a cell beyond the csv module's limit: with this delimiter it is no table
        return []


def _no_header(text: Sequence[str]) -> str:
    lines = [line.strip() for line in text if line.strip()][:3]
    if not lines:
        return "the file is empty; a BOM needs a header line and rows"
    seen = "; ".join(f"“{line[:80]}”" for line in lines)
    return (
        f"found no header line with a column of names or part numbers. The file begins with {seen}. "
        "Name the columns yourself, for example: --column name=Bauteil --column mass=Gewicht"
    )
