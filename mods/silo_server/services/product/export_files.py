# SPDX-License-Identifier: LGPL-2.1-or-later
"""The files of an export: CSV (RFC 4180), XLSX and JSON.

Numbers are numbers, with the unit in the column's head, which mass and inertia tools read as well. A cell
that a spreadsheet would run as a formula gets an apostrophe before it in CSV, and is marked as text in XLSX.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import IO, Any

from silo.bom.headers import safe_cell
from silo.bom.quantities import as_decimal
from silo.bom.text import with_allowed_characters
from silo.platform.whole_files import scratch_folder
from silo_server.services.product.export import COLUMNS, PICTURE, Export
from silo_server.services.thumbnails import png_size
from silo_server.user_json import dumps

_FORMATS = {"Unit cost": "#,##0.00##", "Overall cost": "#,##0.00", "Unit mass [kg]": "0.0#####"}

_FORMATS["Overall mass [kg]"] = "0.0##"

_WIDTHS = {
    "Part number": 16,
    "Name": 32,
    "Description": 32,
    "Notes": 30,
    "Incomplete": 30,
    "Open": 24,
    "Supplier": 20,
}

# So many rows have a picture, each in so many pixels.
MOST_PICTURED, PICTURED = 2000, 48

_SIGNS = re.compile(r"[^a-z0-9]+")


def to_csv(made: Export, out: IO[bytes], *, semicolons: bool = False) -> None:
    """Write CSV (RFC 4180): CRLF, quotes doubled; UTF-8 with the mark by which Excel recognises it.

    With ``semicolons``, and commas in numbers, it opens right in an Excel of a country that writes 1,5.
    """
    text = io.TextIOWrapper(out, "utf-8-sig", newline="")
    writer = csv.writer(text, lineterminator="\r\n", delimiter=";" if semicolons else ",")
    for note in made.notes:
        writer.writerow([safe_cell(note)])
    writer.writerow(made.columns)
    for row in made.rows:
        writer.writerow([_csv_cell(row.get(column), semicolons) for column in made.columns])
    text.detach()


def _csv_cell(value: Any, semicolons: bool) -> Any:
    if isinstance(value, float):
        written = f"{as_decimal(value):f}"
        return written.replace(".", ",") if semicolons else written
    return safe_cell(value)


def to_xlsx(made: Export, out: IO[bytes], picture: Callable[[str], Path] | None = None) -> Callable[[], None]:
    """Write a workbook with one sheet; texts are texts, whatever they begin with.

    Returns a function that packs it once all rows are read: that takes seconds, in which no transaction
    should wait.

    picture
        finds the file of a picture; if given, the first rows show their part.
    """
    from xlsxwriter import Workbook

    columns = [*made.columns[:2], PICTURE, *made.columns[2:]] if picture else made.columns

    with ExitStack() as kept:
        # Each row goes to the disk when the next one begins.
        folder = kept.enter_context(scratch_folder("silo-export-"))
        book = Workbook(out, {"constant_memory": True, "tmpdir": folder})
        title = "".join(c for c in made.root.part_number if c not in "[]:*?/\\'")[:31]
        sheet = book.add_worksheet(title or "BOM")
        kept.callback(sheet.row_data_fh.close)
        head = len(made.notes)
        sheet.freeze_panes(head + 1, 0)
        sheet.repeat_rows(head)
        sheet.set_landscape()
        sheet.fit_to_pages(1, 0)
        for index, column in enumerate(columns):
            sheet.set_column(index, index, _WIDTHS.get(column, max(8, len(column) + 2)))
        bold, warning = (
            book.add_format({"bold": True}),
            book.add_format({"bold": True, "font_color": "#A32020"}),
        )
        formats = {column: book.add_format({"num_format": form}) for column, form in _FORMATS.items()}

        def write(row: int, index: int, text: str, form: Any = None) -> None:
            # Excel takes no longer text. Older databases have characters that are refused now.
            text = text if text.isprintable() else with_allowed_characters(text)
            sheet.write_string(row, index, text[:32767], form)

        for place, note in enumerate(made.notes):
            write(place, 0, note, warning)
        for index, column in enumerate(columns):
            write(head, index, column, bold)
        last, places = head, [(n, column, formats.get(column)) for n, column in enumerate(columns)]

        def show(row: int, path: Path) -> None:
            with suppress(OSError):
                if size := png_size(path.read_bytes()):
                    scale = (PICTURED - 4) / max(size)
                    sheet.set_row_pixels(row, PICTURED)
                    place = {"x_scale": scale, "y_scale": scale, "x_offset": 2, "y_offset": 2}
                    sheet.insert_image(row, 2, str(path), place | {"object_position": 1})

        for last, row in enumerate(made.rows, start=head + 1):
            if picture and (key := row.pop(PICTURE, None)) and last - head <= MOST_PICTURED:
                show(last, picture(key))
            for index, column, form in places:
                if isinstance(value := row.get(column), str):
                    write(last, index, value)
                elif value is not None:
                    sheet.write_number(last, index, value, form)
        sheet.autofilter(head, 0, last, len(columns) - 1)
        packing = kept.pop_all()

    def pack() -> None:
        with packing:
            book.close()

    return pack


def to_json(made: Export, out: IO[bytes]) -> None:
    """Write the rows under machine names: ``unit_mass_kg``, ``supplier_part_number``."""
    names = {column: _SIGNS.sub("_", column.lower().replace("'s", "")).strip("_") for column in COLUMNS}
    head = {
        "part_number": made.root.part_number,
        "name": made.root.name,
        "view": made.view.value,
        "version": made.root.bom_version,
        "pieces": made.pieces,
        "notes": list(made.notes),
    }
    out.write(dumps(head)[:-1].encode() + b',"lines":[')
    for number, row in enumerate(made.rows):
        line = dumps({names[column]: row.get(column) for column in COLUMNS})
        out.write((f",{line}" if number else line).encode())
    out.write(b"]}")
