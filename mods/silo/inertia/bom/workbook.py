# SPDX-License-Identifier: LGPL-2.1-or-later
"""Sheets of an XLSX, XLS or ODS workbook as CSV text, and notes on what a table of values does not show."""

from __future__ import annotations

import csv
import io
import posixpath
import re
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import reduce
from typing import Any, NamedTuple
from xml.etree import ElementTree

from silo.bom.errors import InputError
from silo.inertia.wording import counted

STARTS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")
"""How XLSX and ODS files begin, and XLS files."""

MAX_UNPACKED, MOST_CELLS = 512 * 1024 * 1024, 20_000_000
_REFERENCE = re.compile(rb"""\sr\s*=\s*["']([A-Za-z]+)([0-9]+)["']""")


class SheetText(NamedTuple):
    """One sheet as CSV: numbers in full, with decimal points; dates as in ISO 8601.

    notes
        what the values do not show.
    merged
        (first line, last line, column index) of cells that are merged downward; lines count from 1.
    """

    name: str
    text: str
    notes: tuple[str, ...] = ()
    merged: tuple[tuple[int, int, int], ...] = ()


@dataclass
class _Hidden:
    """What the file says of a sheet beside its values: hidden rows, and cells that have no value."""

    rows: list[int] = field(default_factory=list)
    cells: dict[tuple[int, int], str] = field(default_factory=dict)
    formulas: int = 0


def read_workbook(data: bytes, source: str) -> Iterator[SheetText]:
    """Every sheet, those that are hidden last. InputError where the workbook cannot be read."""
    try:
        from python_calamine import CalamineError, SheetVisibleEnum, load_workbook
    except ImportError as error:
        raise InputError(
            f"{source}: this is a workbook; export it as CSV, or install silo-mod[inertia]"
        ) from error
    hidden = _look_inside(data, source)
    try:
        book = load_workbook(io.BytesIO(data))
        for meta in sorted(book.sheets_metadata, key=lambda one: one.visible != SheetVisibleEnum.Visible):
            sheet = book.get_sheet_by_name(meta.name)
            rows = [list(row) for row in sheet.to_python(skip_empty_area=False)]
            notes = tuple(_put_in(rows, hidden.get(meta.name, _Hidden())))
            ranges = sheet.merged_cell_ranges or ()
            merged = tuple((top + 1, end + 1, left) for (top, left), (end, _) in ranges if end > top)
            out = io.StringIO()
            csv.writer(out).writerows([_shown(value) for value in row] for row in rows)
            yield SheetText(f"sheet “{meta.name}”", out.getvalue(), notes, merged)
    except CalamineError as error:
        raise InputError(f"{source}: the workbook cannot be read ({error})") from error


def _put_in(rows: list[list[Any]], hidden: _Hidden) -> Iterator[str]:
    """Put formulas without a value and errors where they stand, so that nobody takes them for empty cells."""
    for (row, column), text in hidden.cells.items():
        rows += [[] for _ in range(row + 1 - len(rows))]
        rows[row] += [""] * (column + 1 - len(rows[row]))
        rows[row][column] = text
    width = max(map(len, rows), default=0)
    rows[:] = [row + [""] * (width - len(row)) for row in rows]
    if hidden.formulas:
        words = "open and save the workbook in a program that calculates them"
        yield f"{counted(hidden.formulas, 'formula')} without a value; {words}"
    filled = [row for row in hidden.rows if row < len(rows) and any(str(cell).strip() for cell in rows[row])]
    if filled:
        yield f"{_lines(filled)} hidden in the workbook; hidden lines are read like all others"


def _lines(rows: Sequence[int]) -> str:
    numbers = ", ".join(str(row + 1) for row in rows[:8]) + (", …" if len(rows) > 8 else "")
    return f"lines {numbers} are" if len(rows) > 1 else f"line {numbers} is"


def _shown(value: object) -> str:
    if isinstance(value, float):
        text = f"{value:.15g}"
        return text + "0" * (text[-4:-3] == ".")  # "1.2340" cannot be 1234
    return " ".join(str(value).splitlines())


def _look_inside(data: bytes, source: str) -> dict[str, _Hidden]:
    """Sheet → what an XLSX file says beside the values; nothing for the other kinds.

    InputError where a stray cell in a far corner would cost the reader more memory than there is: it ends the
    whole program then.
    """
    found: dict[str, _Hidden] = {}
    try:
        archive = zipfile.ZipFile(io.BytesIO(data))
        if sum(info.file_size for info in archive.infolist()) > MAX_UNPACKED:
            raise InputError(f"{source}: unpacked, the workbook is larger than {MAX_UNPACKED / 1e6:.0f} MB")
        for name in archive.namelist():
            _check_extent(archive.read(name), f"{source}: {name}")
        for name, path in _sheet_files(archive):
            found[name] = _hidden(_read(archive, path))
    except (zipfile.BadZipFile, zlib.error, OSError, EOFError, RuntimeError, LookupError, SyntaxError):
        pass  # the reader says what is wrong with it
    return found


def _sheet_files(archive: zipfile.ZipFile) -> Iterator[tuple[str, str]]:
    """(name of a sheet, its file in the archive)."""
    if "xl/workbook.xml" not in archive.namelist():
        return
    links = _xml(archive, "xl/_rels/workbook.xml.rels")
    targets = {link.get("Id"): link.get("Target", "") for link in links}
    for sheet in _xml(archive, "xl/workbook.xml").findall("{*}sheets/{*}sheet"):
        target = next((targets.get(value) for key, value in sheet.items() if key.endswith("}id")), None)
        path = posixpath.normpath(posixpath.join("/xl", target or "")).lstrip("/")
        if path.startswith("xl/worksheets/"):
            yield sheet.get("name", ""), path


def _xml(archive: zipfile.ZipFile, path: str) -> ElementTree.Element:
    return ElementTree.fromstring(_read(archive, path))  # noqa: S314 - see _read


def _read(archive: zipfile.ZipFile, path: str) -> bytes:
    """ParseError (a SyntaxError) for a DOCTYPE: no workbook has one, and without it there are no entities."""
    data = archive.read(path)
    if b"<!DOCTYPE" in data:
        raise ElementTree.ParseError("has a DOCTYPE")
    return data


def _check_extent(xml: bytes, what: str) -> None:
    row = width = 0
    for letters, digits in (cell.groups() for cell in _REFERENCE.finditer(xml)):
        # No sheet has longer references; the reader would follow them all the same.
        if len(letters) <= 3 and len(digits) <= 7:
            row, width = max(row, int(digits)), max(width, _column(letters.decode()))
        if len(letters) > 3 or len(digits) > 7 or row * width > MOST_CELLS:
            last = (letters + digits)[:20].decode()
            raise InputError(f"{what} reaches to {last}; delete what stands outside of the table")


def _column(letters: str) -> int:
    return reduce(lambda number, letter: number * 26 + ord(letter) - 64, letters.upper(), 0)


def _hidden(sheet: bytes) -> _Hidden:
    found = _Hidden()
    for _, row in ElementTree.iterparse(io.BytesIO(sheet)):  # noqa: S314 - see _read
        if not row.tag.endswith("row"):
            continue
        space = row.tag.removesuffix("row")  # ten times as quick as {*} for each cell
        if row.get("hidden") in ("1", "true") and (number := row.get("r", "")).isdecimal():
            found.rows.append(int(number) - 1)
        for cell in row.iterfind(f"{space}c"):
            formula, is_error = cell.find(f"{space}f"), cell.get("t") == "e"
            if formula is None and not is_error:
                continue
            place = re.fullmatch("([A-Za-z]{1,3})([1-9][0-9]{0,6})", cell.get("r", ""))
            if place is None:
                continue
            here, value = (int(place[2]) - 1, _column(place[1]) - 1), cell.findtext(f"{space}v")
            if is_error:
                found.cells[here] = value or "#ERROR"
            elif formula is not None and not value and cell.get("t") != "str":
                found.cells[here] = f"={formula.text or '…'}"
                found.formulas += 1
        row.clear()
    return found
