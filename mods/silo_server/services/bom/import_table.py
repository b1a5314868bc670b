# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reading the table of an import: which column is which, and the rows.

The columns are known by their names (:mod:`silo.bom.headers`); if they are not, a user says which column is
which (:class:`Layout`). Reading a file is pure: it needs no database.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import islice
from typing import NamedTuple

from silo.api.wire import LineTexts
from silo.bom.errors import InputError, RejectedError, listed
from silo.bom.headers import (
    Heading,
    designators,
    find_roles,
    missing_columns,
    plain_cell,
    second_columns,
)
from silo.bom.numbers import Mark, common_mark, parse_number, read_quantity
from silo.tables.clashes import find_clashes
from silo.workbook.encoding import STARTS, unicode_name
from silo.workbook.read import read_workbook
from silo.workbook.sheet import Grid
from silo_server.errors import TooLargeError

# What a line says; then what identifies a part without a number, or describes a new one.
LINE_ROLES = (
    Heading.PART_NUMBER,
    Heading.QUANTITY,
    Heading.REFERENCE_DESIGNATORS,
    *map(Heading, LineTexts.model_fields),
    Heading.TYPE,
    Heading.REVISION,
    Heading.LEVEL,
)

BOUGHT = (
    Heading.MANUFACTURER,
    Heading.MANUFACTURER_NUMBER,
    Heading.SUPPLIER,
    Heading.SUPPLIER_NUMBER,
)

ROLES = (
    *LINE_ROLES,
    Heading.NAME,
    Heading.DESCRIPTION,
    Heading.VALUE,
    Heading.FOOTPRINT,
    *BOUGHT,
    Heading.NOT_FITTED,
)

NEEDED = (Heading.PART_NUMBER, Heading.QUANTITY)

# In place of a needed column, if the file has none.
_INSTEAD = {
    Heading.PART_NUMBER: (Heading.MANUFACTURER_NUMBER, Heading.VALUE),
    Heading.QUANTITY: (Heading.REFERENCE_DESIGNATORS,),
}

_RANGE = re.compile(r"([A-Za-z]+)([0-9]+)-([A-Za-z]*)([0-9]+)")


class Table(NamedTuple):
    """What a table to be imported may say in its columns.

    instead
        what may stand in the place of a needed column, if the file has none.
    single
        columns that a file has once: two that differ are refused.
    """

    roles: Sequence[Heading]
    needed: Sequence[Heading]
    instead: Mapping[Heading, Sequence[Heading]]
    single: Sequence[Heading]

    def lacking(self, there: Collection[Heading]) -> list[Heading]:
        """Return the needed columns that the file has neither itself nor through a substitute."""
        return [
            role for role in self.needed if role not in there and not {*self.instead.get(role, ())} & {*there}
        ]


BOM = Table(ROLES, NEEDED, _INSTEAD, LINE_ROLES)

DELIMITERS = {",": "commas", ";": "semicolons", "\t": "tabs"}

HEADER_WITHIN = 40

MAX_COLUMNS = 200

# Columns of our own exports.
_INCOMPLETE, _SOURCE, _TOTAL = "Incomplete", "Source", "Total quantity"

# (row number, field → text)
Record = tuple[int, dict[str, str]]


@dataclass(frozen=True, slots=True)
class Layout:
    """How a file is read.

    header
        index of the header's line.
    columns
        index of each role's column.
    mark
        the decimal mark of its numbers, None = as the numbers themselves show.
    """

    delimiter: str
    header: int
    columns: Mapping[Heading, int] = field(default_factory=dict)
    mark: Mark | None = None


def read_csv(data: bytes, max_rows: int, layout: Layout | None = None, of: Table = BOM) -> list[Record]:
    """Read the rows that are not empty. RejectedError if this is no such table.

    TooLargeError above ``max_rows``. Needs no database: call it before a transaction begins, which others
    would wait for.
    """
    text = _decode(data)
    chosen, layout = layout is not None, layout or guess(text, of)
    # A person may also choose the column of the names.
    roles = {
        *layout.columns,
        *(_INSTEAD[Heading.PART_NUMBER] if Heading.NAME in layout.columns else ()),
    }
    if missing := of.lacking(roles):
        words = ", ".join(role.replace("_", " ").capitalize() for role in missing)
        raise RejectedError(f"file: choose the column of {words}")
    rows = _rows(text, layout.delimiter)
    try:
        table = list(islice(rows, layout.header + 1 + max_rows + 1))
    except csv.Error as error:
        raise RejectedError(f"file: wanted CSV, got a file that cannot be read as CSV ({error})") from None
    if len(table) - layout.header - 1 > max_rows:
        raise TooLargeError(f"file: this server takes at most {max_rows} rows, got more")
    header, body = table[layout.header] if table else [], table[layout.header + 1 :]
    if of is BOM and Heading.PART_NUMBER in layout.columns:
        _refuse_flat(header, body, layout.columns[Heading.PART_NUMBER])
    if not chosen:
        _refuse_clashes(header, body, layout, of.single)
    gap_column = _column(header, _INCOMPLETE)
    records = []
    for number, cells in enumerate(body, start=layout.header + 2):
        record = {role.value: _cell(cells, i) for role, i in layout.columns.items() if i < len(cells)}
        # Our own exports end with what a sync left out: rows that say so, and have no part number.
        if any(record.values()) and (record.get("part_number") or not _cell(cells, gap_column)):
            if of is BOM and Heading.QUANTITY not in layout.columns:
                record["quantity"] = str(_designated(record.get("reference_designators", "")))
            records.append((number, record))
    return _with_exact_quantities(records, layout) if of is BOM else records


def _designated(cell: str) -> int:
    """Count the places that reference designators name: three in ``R1, R3-R4``."""
    spans = [(designator, _RANGE.fullmatch(designator)) for designator in designators(cell)]
    return sum(
        max(1, int(span[4]) - int(span[2]) + 1) if span and span[3] in ("", span[1]) else 1
        for _, span in spans
    )


def as_csv(data: bytes, of: Table = BOM) -> bytes:
    """Convert a table to CSV: of a workbook (XLSX, ODS, XLS) the one sheet that holds it, else its first.

    RejectedError if several sheets hold such a table, or if lines are hidden or struck out: a person would
    not expect them to be read.
    """
    if not data.startswith(STARTS):
        return data
    try:
        sheets = [(grid, _sheet_text(grid)) for grid in read_workbook(data, "file")]
    except InputError as error:
        raise RejectedError(str(error)) from None
    likely = [sheet for sheet in sheets if guess_of(sheet[1], of)]
    if likely[1:]:
        names = listed([f"“{grid.name}”" for grid, _ in likely])
        raise RejectedError(f"file: the sheets {names} each hold such a table; save the right sheet alone")
    if not sheets:
        raise RejectedError("file: wanted a workbook with a table, got one without a sheet")
    grid, text = (likely or sheets)[0]
    hidden = {row for row, _ in grid.cells} & grid.hidden_rows
    struck = {row for (row, _), cell in grid.cells.items() if cell.struck}
    for rows, words in ((hidden, "hidden"), (struck, "struck out")):
        if rows:
            lines = listed([str(row + 1) for row in sorted(rows)], 8)
            raise RejectedError(
                f"file: of sheet “{grid.name}” these lines are {words}: {lines}; show or delete them, for an "
                "import would take them like all others"
            )
    return text


def _sheet_text(grid: Grid) -> bytes:
    out = io.StringIO()
    writer, line = csv.writer(out), 1
    for row in grid.rows():
        out.write("\n" * (row.line - line))  # lines keep their numbers
        writer.writerow(row.cells)
        line = row.line + 1
    return out.getvalue().encode()


def first_lines(data: bytes, delimiter: str, count: int = 8) -> list[list[str]]:
    """Read the first lines of a file as cells, as far as possible, for a person to name the columns."""
    lines: list[list[str]] = []
    with suppress(csv.Error):
        lines.extend(row[:MAX_COLUMNS] for row in islice(_rows(_decode(data), delimiter), count))
    return lines


def likely_delimiter(data: bytes) -> str:
    """Find the separator that makes the most columns of the first lines."""
    widths = {mark: max(map(len, first_lines(data, mark)), default=0) for mark in DELIMITERS}
    return max(widths, key=lambda mark: widths[mark])


def guess(text: str, of: Table = BOM) -> Layout:
    """Find the delimiter with which there is a header, the header and its columns; else RejectedError."""
    broken: csv.Error | None = None
    near = ""
    for delimiter in DELIMITERS:
        try:
            for index, row in enumerate(islice(_rows(text, delimiter), HEADER_WITHIN)):
                at = find_roles(row[:MAX_COLUMNS], of.roles)
                lacking = of.lacking(at)
                if not lacking:
                    return Layout(delimiter, index, at)
                missing = missing_columns(row[:MAX_COLUMNS], at, lacking)
                # A line with one of the two, and another cell beside it, is a header that lacks the other.
                if len(row) > 1 and set(of.needed) & at.keys():
                    near = near or f"file: in line {index + 1}, {missing}"
        except csv.Error as error:
            broken = error
    if near:
        raise RejectedError(near)
    if broken is not None:
        raise RejectedError(f"file: wanted CSV, got a file that cannot be read as CSV ({broken})")
    words = ", ".join(role.replace("_", " ").capitalize() for role in of.needed)
    raise RejectedError(
        f"file: wanted a header row with {words} among the first {HEADER_WITHIN} rows, found none"
    )


def guess_of(data: bytes, of: Table = BOM) -> Layout | None:
    """Guess as :func:`guess`; None if there is no header that we know."""
    try:
        return guess(_decode(data), of)
    except RejectedError:
        return None


def _refuse_flat(header: Sequence[str], body: Sequence[Sequence[str]], part_number: int) -> None:
    """Refuse our flat export: its totals over all levels would be wrong as the lines of one level."""
    source, total = _column(header, _SOURCE), _column(header, _TOTAL)
    lines = [cells for cells in body if _cell(cells, part_number)]
    if source is None or total is None or not lines:
        return
    if not any(_cell(cells, source) for cells in lines):
        raise RejectedError(
            "file: this is a flat export, whose quantities are totals over all levels, not the lines of this "
            "BOM. Export “these lines” instead, change them, and import that"
        )


def _refuse_clashes(
    header: Sequence[str], body: Sequence[Sequence[str]], layout: Layout, single: Sequence[Heading]
) -> None:
    """Refuse two columns of one role: a person says which one counts, not the order of the file."""
    header = header[:MAX_COLUMNS]
    seconds = second_columns(header, single, layout.columns)
    problems = [
        f"the columns '{clash.ours}' and '{clash.other}' both mean the {words}, and "
        f"in row {layout.header + 2 + clash.row} they say {clash.used[:40]!r} and {clash.unused[:40]!r}"
        for clash in find_clashes(header, body, {str(r): i for r, i in layout.columns.items()}, seconds)
        for words in [clash.role.replace("_", " ")]
    ]
    if problems:
        raise RejectedError(f"file: {'; '.join(problems)}; choose one, or rename the other", problems)


def _column(header: Sequence[str], name: str) -> int | None:
    return next((index for index, cell in enumerate(header) if cell.strip() == name), None)


def _cell(cells: Sequence[str], index: int | None) -> str:
    return plain_cell(cells[index].strip()) if index is not None and index < len(cells) else ""


def _with_exact_quantities(records: list[Record], layout: Layout) -> list[Record]:
    """Replace quantities by plain numerals; put the problem beside a quantity that cannot be read.

    The whole column decides what "1,234" means; in a file separated by commas, a point is a decimal point.
    """
    texts = [record.get("quantity", "") for _, record in records]
    mark = layout.mark or common_mark(number.mark for text in texts if (number := parse_number(text)))
    decimal = layout.mark is None and layout.delimiter == ","
    for (_, record), text in zip(records, texts, strict=True):
        reading = read_quantity(text, mark, points_are_decimal=decimal)
        record["quantity"] = "" if reading.value is None else str(reading.value)
        if reading.problem:
            record["quantity_problem"] = reading.problem
    return records


def _rows(text: str, delimiter: str) -> Iterator[list[str]]:
    return csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)


def _decode(data: bytes) -> str:
    if encoding := unicode_name(data):
        return data.decode(encoding, errors="replace")
    with suppress(UnicodeDecodeError):
        return data.decode()
    # What spreadsheets in western Europe and America write when they are not asked for Unicode.
    return data.decode("cp1252", errors="replace")
