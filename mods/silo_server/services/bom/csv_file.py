# SPDX-License-Identifier: LGPL-2.1-or-later
"""A CSV file as the rows of a BOM: which line is the header, and which column is what; pure.

The columns are known by their names (:mod:`silo.bom.headers`); where they are not, a person says which column
is which (:class:`Layout`).
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice

from silo.bom.errors import RejectedError
from silo.bom.headers import Role, find_roles, missing_columns
from silo.bom.numbers import Mark, common_mark, parse_number, read_quantity
from silo_server.errors import TooLargeError
from silo_server.services.bom.exports import plain_cell

ROLES = (
    *(Role.PART_NUMBER, Role.QUANTITY, Role.UNIT, Role.REFERENCE_DESIGNATORS, Role.FIND_NUMBER, Role.NOTES),
    *(Role.TYPE, Role.REVISION, Role.LEVEL),
)
NEEDED = (Role.PART_NUMBER, Role.QUANTITY)
DELIMITERS = {",": "commas", ";": "semicolons", "\t": "tabs"}
HEADER_WITHIN = 40
"""The header must be among this many first lines (title blocks are a few lines long)."""
MAX_COLUMNS = 200

# Columns of silo_server.services.bom.exports.
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
    columns: Mapping[Role, int] = field(default_factory=dict)
    mark: Mark | None = None


def read_csv(data: bytes, max_rows: int, layout: Layout | None = None) -> list[Record]:
    """The rows that say anything; RejectedError where this is no BOM, TooLargeError beyond ``max_rows``.

    Needs no database: to be called before a transaction begins, which others would wait for.
    """
    refuse_workbook(data)
    text = _decode(data)
    layout = layout or guess(text)
    missing = [role for role in NEEDED if role not in layout.columns]
    if missing:
        names = " and ".join(f"'{role.replace('_', ' ').capitalize()}'" for role in missing)
        raise RejectedError(f"file: say which column is {names}")
    rows = _rows(text, layout.delimiter)
    try:
        table = list(islice(rows, layout.header + 1 + max_rows + 1))
    except csv.Error as error:
        raise RejectedError(f"file: wanted CSV, got something that does not read as such ({error})") from None
    if len(table) - layout.header - 1 > max_rows:
        raise TooLargeError(f"file: this server takes at most {max_rows} rows, got more")
    header, body = table[layout.header] if table else [], table[layout.header + 1 :]
    _refuse_flat(header, body, layout.columns[Role.PART_NUMBER])
    gap_column = _column(header, _INCOMPLETE)
    records = []
    for number, cells in enumerate(body, start=layout.header + 2):
        record = {role.value: _cell(cells, i) for role, i in layout.columns.items() if i < len(cells)}
        # Our own exports end with what a sync left out: rows that say so, and have no part number.
        if any(record.values()) and (record.get("part_number") or not _cell(cells, gap_column)):
            records.append((number, record))
    return _with_exact_quantities(records, layout)


def refuse_workbook(data: bytes) -> None:
    """RejectedError for XLSX and other ZIP archives, which people take for a CSV as well."""
    if data.startswith(b"PK\x03\x04"):
        raise RejectedError(
            "file: wanted CSV, got a workbook such as XLSX, or another ZIP archive; save the sheet as CSV"
        )


def first_lines(data: bytes, delimiter: str, count: int = 8) -> list[list[str]]:
    """The first lines of a file as cells, for a person who says which column is which."""
    try:
        return [row[:MAX_COLUMNS] for row in islice(_rows(_decode(data), delimiter), count)]
    except csv.Error:
        return []


def likely_delimiter(data: bytes) -> str:
    """The separator that makes the most columns of the first lines."""
    widths = {mark: max(map(len, first_lines(data, mark)), default=0) for mark in DELIMITERS}
    return max(widths, key=lambda mark: widths[mark])


def guess(text: str) -> Layout:
    """Header and columns by the delimiter with which there is a header; RejectedError where there is none."""
    broken: csv.Error | None = None
    near = ""
    for delimiter in DELIMITERS:
        try:
            for index, row in enumerate(islice(_rows(text, delimiter), HEADER_WITHIN)):
                at = find_roles(row[:MAX_COLUMNS], ROLES)
                missing = missing_columns(row[:MAX_COLUMNS], at, NEEDED)
                if not missing:
                    return Layout(delimiter, index, at)
                # A line with one of the two, and another cell beside it, is a header that lacks the other.
                if len(row) > 1 and set(NEEDED) & at.keys():
                    near = near or f"file: in line {index + 1}, {missing}"
        except csv.Error as error:
            broken = error
    if near:
        raise RejectedError(near)
    if broken is not None:
        raise RejectedError(f"file: wanted CSV, got something that does not read as such ({broken})")
    raise RejectedError(
        f"file: wanted a header row with 'Part number' and 'Quantity' among the first {HEADER_WITHIN} rows, "
        "found none"
    )


def guess_of(data: bytes) -> Layout | None:
    """As :func:`guess`, None where there is no header that we know."""
    try:
        return guess(_decode(data))
    except RejectedError:
        return None


def _refuse_flat(header: Sequence[str], body: Sequence[Sequence[str]], part_number: int) -> None:
    """Our flat export has totals over all levels; as the lines of one level they would be wrong."""
    source, total = _column(header, _SOURCE), _column(header, _TOTAL)
    lines = [cells for cells in body if _cell(cells, part_number)]
    if source is None or total is None or not lines:
        return
    if not any(_cell(cells, source) for cells in lines):
        raise RejectedError(
            "file: this is a flat export, whose quantities are totals over all levels, not the lines of this "
            "BOM. Export “these lines” instead, change them, and import that"
        )


def _column(header: Sequence[str], name: str) -> int | None:
    return next((index for index, cell in enumerate(header) if cell.strip() == name), None)


def _cell(cells: Sequence[str], index: int | None) -> str:
    return plain_cell(cells[index].strip()) if index is not None and index < len(cells) else ""


def _with_exact_quantities(records: list[Record], layout: Layout) -> list[Record]:
    """Quantities as plain numerals where they can be read; what is wrong with one stands beside it.

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
    for mark, encoding in ((b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"), (b"", "utf-8-sig")):
        if data.startswith(mark):
            try:
                return data.decode(encoding)
            except UnicodeDecodeError:
                break
    # What spreadsheets in western Europe and America write when they are not asked for Unicode.
    return data.decode("cp1252", errors="replace")
