# SPDX-License-Identifier: LGPL-2.1-or-later
"""Bytes of a CSV export or a workbook → a header and rows with their line numbers.

Encoding and delimiter are found out; a workbook's sheets become CSV first. The order of the tries: a byte
order mark decides; then UTF-8; then the Windows code pages. A delimiter is right when a line under it reads
as a header; nothing is concluded from counting commas.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from itertools import islice, zip_longest

from silo.bom.errors import InputError
from silo.bom.headers import Role
from silo.inertia.bom.columns import Columns, find_columns, read_mass_header
from silo.inertia.bom.workbook import STARTS, SheetText, read_workbook

MAX_BYTES = 64 * 1024 * 1024
HEADER_WITHIN = 40
"""The header must be among this many first lines (title blocks are a few lines long)."""

DELIMITERS = ",;\t|"
_NUMBER = re.compile(r"[\s+\-−~(]*[\d.,]")
_CODE_PAGES = ("cp1252", "cp932", "gb18030", "latin-1")


@dataclass(frozen=True, slots=True)
class Row:
    """Cells of one record and the line of the file that it begins on (1 = first)."""

    line: int
    cells: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Sheet:
    """A decoded table; a workbook has no ``delimiter``. ``notes``: what had to be assumed to read it."""

    header: tuple[str, ...]
    header_line: int
    columns: Columns
    rows: tuple[Row, ...]
    delimiter: str
    notes: tuple[str, ...] = ()


def read_sheet(
    data: bytes,
    source: str,
    *,
    columns: Mapping[str, str] | None = None,
    encoding: str | None = None,
    delimiter: str | None = None,
) -> Sheet:
    """Decode a CSV export, or the first sheet of a workbook that holds a BOM.

    ``columns``, ``encoding``, ``delimiter``: the user's word, else found out.

    Raises InputError where there is no header line with a column to tell parts apart by, or where the given
    encoding does not fit; the message lists what was seen.
    """
    if len(data) > MAX_BYTES:
        raise InputError(f"{source}: {len(data) / 1e6:.0f} MB is no BOM (limit {MAX_BYTES / 1e6:.0f} MB)")
    if delimiter is not None and len(delimiter) != 1:
        raise InputError(f"a delimiter is one character, got “{delimiter}”")
    workbook = data.startswith(STARTS)
    marks = "," if workbook else delimiter or DELIMITERS
    texts = _workbook(data, source, columns) if workbook else _decodings(data, encoding, source)
    first_lines = ""
    for found in texts:
        text = found.text
        if text.lstrip()[:1] == "<":
            raise InputError(f"{source}: this is HTML or XML and no table; export it as CSV or XLSX")
        first_lines = first_lines or text
        best = _best_header(text, marks, columns)
        if best is not None:
            return _sheet(found, best, data, columns)
    raise InputError(_no_header(source, first_lines))


def _workbook(data: bytes, source: str, given: Mapping[str, str] | None) -> Iterator[SheetText]:
    """The sheets; the first one that holds a BOM names the others that do."""
    sheets = list(read_workbook(data, source))
    usable = [sheet.name for sheet in sheets if _best_header(sheet.text, ",", given)]
    for sheet in sheets:
        if usable[1:] and sheet.name == usable[0]:
            note = f"{sheet.name} of the workbook was read; not read: {', '.join(usable[1:])}"
            sheet = sheet._replace(notes=(*sheet.notes, note))
        yield sheet


@dataclass(frozen=True, slots=True)
class _Header:
    delimiter: str
    index: int
    columns: Columns


def _sheet(found: SheetText, best: _Header, data: bytes, given: Mapping[str, str] | None) -> Sheet:
    records = list(_records(found.text, best.delimiter))
    header = records[best.index]
    columns = best.columns
    below = records[best.index + 1 : best.index + 2]
    if below and _continues(header, columns, below[0]):
        # "Mass" over "[g]", or over "each" and "total": a merged cell has its text in the first one.
        filled = [next(filter(None, reversed(header.cells[: i + 1])), "") for i in range(len(header.cells))]
        cells = [
            f"{above} ({under})" if under.strip() else own
            for above, own, under in zip_longest(filled, header.cells, below[0].cells, fillvalue="")
        ]
        header = Row(header.line, tuple(cells))
        columns = find_columns(cells, given)
        best = replace(best, index=best.index + 1, columns=columns)
    notes = [*_notes(found.name, data, header, columns, given), *found.notes]
    notes += _unmerged(records, found.merged, records[best.index].line, set(columns.at.values()))
    bad = _bad_quotes(found.text, best.delimiter)
    if bad is not None:
        notes.append(
            f"line {bad}: the quotes do not match; rows from here on may be read wrongly or be missing"
        )
    rows = tuple(
        r for r in records[best.index + 1 :] if any(c.strip() for c in r.cells) and r.cells != header.cells
    )
    delimiter = "" if data.startswith(STARTS) else best.delimiter
    return Sheet(header.cells, header.line, columns, rows, delimiter, tuple(notes))


def _unmerged(
    records: list[Row], merged: Sequence[tuple[int, int, int]], header: int, used: Set[int]
) -> Iterator[str]:
    """Give each line of a merged cell its text. A number may be of all lines together: the first keeps it."""
    at = {row.line: index for index, row in enumerate(records)}
    texts, numbers = [], []
    for first, last, column in merged:
        text = (
            records[at[first]].cells[column].strip()
            if first > header and first in at and column in used
            else ""
        )
        if not text:
            continue
        what = f"“{text}” in lines {first} to {last}"
        if _NUMBER.match(text):
            numbers.append(what)
            continue
        texts.append(what)
        for index in range(at[first] + 1, min(at[first] + 1 + last - first, len(records))):
            row = records[index]
            records[index] = replace(row, cells=(*row.cells[:column], text, *row.cells[column + 1 :]))
    if texts:
        yield f"merged cells: {_some(texts)}; each of these lines was given the text"
    if numbers:
        yield f"merged cells: {_some(numbers)}; only the first of these lines has the number"


def _some(words: Sequence[str]) -> str:
    return ", ".join(words[:4]) + (f" and {len(words) - 4} more" if len(words) > 4 else "")


def _continues(header: Row, columns: Columns, below: Row) -> bool:
    """True where the record below a header is its second line: no name, and a unit or the like for masses."""
    if any(columns.cell(below.cells, role) for role in (Role.NAME, Role.PART_NUMBER, Role.DESCRIPTION)):
        return False
    if any(letter.isdigit() for cell in below.cells for letter in cell):
        return False
    places = [columns.at[role] for role in (Role.MASS, Role.TOTAL_MASS) if role in columns.at]
    cells = [below.cells[i].strip() for i in places if i < len(below.cells)]
    read = [
        read_mass_header(f"mass ({cell.strip('[](){}')})") for cell in cells if any(map(str.isalpha, cell))
    ]
    return bool(read) and not any(one.strange or one.rate for one in read)


def _notes(
    encoding: str, data: bytes, header: Row, columns: Columns, given: Mapping[str, str] | None
) -> Iterator[str]:
    if encoding in _CODE_PAGES and not data.isascii():
        yield (
            f"the file is not UTF-8; it was read as {encoding}. If names look wrong, "
            "export it as UTF-8 or say which encoding it has"
        )
    for role, text in (given or {}).items():
        if Role(role) not in columns.at:
            seen = ", ".join(c.strip() for c in header.cells if c.strip())
            yield f"there is no column “{text}” for {role} in line {header.line} ({seen})"


def _decodings(data: bytes, encoding: str | None, source: str) -> Iterator[SheetText]:
    """The text by each encoding that may be meant; its name is the encoding's."""
    if encoding is not None:
        try:
            yield SheetText(encoding, data.decode(encoding))
        except (UnicodeDecodeError, LookupError) as error:
            raise InputError(f"{source}: cannot be read as {encoding}: {error}") from error
        return
    start = data[:64]
    # UTF-16 without its mark: every second byte of ASCII text is zero.
    wide = "utf-16-le" if data[1:2] == b"\0" else "utf-16-be"
    for found, name in (
        (data.startswith(b"\xef\xbb\xbf"), "utf-8-sig"),
        (data.startswith((b"\xff\xfe", b"\xfe\xff")), "utf-16"),
        (start.count(0) > len(start) // 4, wide),
    ):
        if found:
            yield SheetText(name, data.decode(name, errors="replace"))
            return
    for name in ("utf-8", *_CODE_PAGES):
        try:
            yield SheetText(name, data.decode(name))
        except UnicodeDecodeError:
            continue


def _records(text: str, delimiter: str, *, strict: bool = False) -> Iterator[Row]:
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=strict)
    line = 1
    for cells in reader:
        yield Row(line, tuple(cell.replace("\0", "") for cell in cells))
        line = reader.line_num + 1


def _bad_quotes(text: str, delimiter: str) -> int | None:
    """The line from which quotes do not match, None where all is well.

    Without this look, a quote that is never closed would swallow all rows below it in silence.
    """
    line = 1
    try:
        for row in _records(text, delimiter, strict=True):
            line = row.line + 1
    except csv.Error:
        return line
    return None


def _best_header(text: str, delimiters: str, given: Mapping[str, str] | None) -> _Header | None:
    """The (delimiter, line) that names most roles; None where no line names a usable set."""
    best: _Header | None = None
    score = (0, 0)
    for delimiter in delimiters:
        for index, row in enumerate(_first_records(text, delimiter)):
            columns = find_columns(row.cells, given)
            # A column of its own beside the name keeps a title ("Name") from passing as a header, unless
            # the file has that one column only.
            here = (len(columns.at), -index)
            if columns.usable and here > score and (len(columns.at) > 1 or _single(row)):
                best, score = _Header(delimiter, index, columns), here
    return best


def _first_records(text: str, delimiter: str) -> list[Row]:
    try:
        return list(islice(_records(text, delimiter), HEADER_WITHIN))
    except csv.Error:  # a cell beyond the csv module's limit: with this delimiter it is no table
        return []


def _single(row: Row) -> bool:
    return len([cell for cell in row.cells if cell.strip()]) == 1


def _no_header(source: str, text: str) -> str:
    lines = [line.strip() for line in text.splitlines() if line.strip()][:3]
    if not lines:
        return f"{source}: the file is empty; a BOM needs a header line and rows"
    seen = "; ".join(f"“{line[:80]}”" for line in lines)
    return (
        f"{source}: found no header line with a column of names or part numbers. "
        f"The file begins with {seen}. "
        "Name the columns yourself, for example: --column name=Bauteil --column mass=Gewicht"
    )
