# SPDX-License-Identifier: LGPL-2.1-or-later
"""Bytes of a CSV export → a header and rows with their line numbers. Encoding and delimiter are found out.

The order of the tries: a byte order mark decides; then UTF-8; then the Windows code pages. A delimiter is
right when a line under it reads as a header; nothing is concluded from counting commas.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice

from silo.bom.errors import InputError
from silo.bom.headers import Role
from silo.inertia.bom.columns import Columns, find_columns

MAX_BYTES = 64 * 1024 * 1024
HEADER_WITHIN = 40
"""The header must be among this many first lines (title blocks are a few lines long)."""

DELIMITERS = (",", ";", "\t", "|")
_CODE_PAGES = ("cp1252", "cp932", "gb18030", "latin-1")


@dataclass(frozen=True, slots=True)
class Row:
    """Cells of one record and the line of the file that it begins on (1 = first)."""

    line: int
    cells: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Sheet:
    """A decoded table. ``notes``: what had to be assumed to read it."""

    header: tuple[str, ...]
    header_line: int
    columns: Columns
    rows: tuple[Row, ...]
    encoding: str
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
    """Decode a CSV export. ``columns``, ``encoding``, ``delimiter``: the user's word, else found out.

    Raises InputError where there is no header line with a column to tell parts apart by, or where the given
    encoding does not fit; the message lists what was seen.
    """
    if len(data) > MAX_BYTES:
        raise InputError(f"{source}: {len(data) / 1e6:.0f} MB is no BOM (limit {MAX_BYTES / 1e6:.0f} MB)")
    if delimiter is not None and len(delimiter) != 1:
        raise InputError(f"a delimiter is one character, got “{delimiter}”")
    marks = (delimiter,) if delimiter else DELIMITERS
    first_lines = ""
    for name, text in _decodings(data, encoding, source):
        first_lines = first_lines or text
        best = _best_header(text, marks, columns)
        if best is not None:
            return _sheet(text, name, best, data, columns)
    raise InputError(_no_header(source, first_lines))


@dataclass(frozen=True, slots=True)
class _Header:
    delimiter: str
    index: int
    columns: Columns


def _sheet(text: str, encoding: str, best: _Header, data: bytes, given: Mapping[str, str] | None) -> Sheet:
    records = list(_records(text, best.delimiter))
    header = records[best.index]
    notes = list(_notes(encoding, data, header, best.columns, given))
    bad = _bad_quotes(text, best.delimiter)
    if bad is not None:
        notes.append(
            f"line {bad}: the quotes do not match; rows from here on may be read wrongly or be missing"
        )
    rows = tuple(
        r for r in records[best.index + 1 :] if any(c.strip() for c in r.cells) and r.cells != header.cells
    )
    return Sheet(header.cells, header.line, best.columns, rows, encoding, best.delimiter, tuple(notes))


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


def _decodings(data: bytes, encoding: str | None, source: str) -> Iterator[tuple[str, str]]:
    if encoding is not None:
        try:
            yield encoding, data.decode(encoding)
        except (UnicodeDecodeError, LookupError) as error:
            raise InputError(f"{source}: cannot be read as {encoding}: {error}") from error
        return
    for mark, name in (
        (b"\xef\xbb\xbf", "utf-8-sig"),
        (b"\xff\xfe", "utf-16"),
        (b"\xfe\xff", "utf-16"),
    ):
        if data.startswith(mark):
            yield name, data.decode(name, errors="replace")
            return
    # UTF-16 without its mark: every second byte of ASCII text is zero.
    if data[:64].count(0) > len(data[:64]) // 4:
        name = "utf-16-le" if data[1:2] == b"\0" else "utf-16-be"
        yield name, data.decode(name, errors="replace")
        return
    for name in ("utf-8", *_CODE_PAGES):
        try:
            yield name, data.decode(name)
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


def _best_header(text: str, delimiters: tuple[str, ...], given: Mapping[str, str] | None) -> _Header | None:
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
