# SPDX-License-Identifier: LGPL-2.1-or-later
"""XLS (BIFF): a file → its sheets, by xlrd."""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator

from silo.bom.errors import InputError
from silo.bom.message import message
from silo.workbook.number_format import START, START_1904, formatted
from silo.workbook.sheet import Cell, Grid


def read_xls(data: bytes) -> Iterator[Grid]:
    """Read every sheet."""
    import xlrd
    from xlrd.compdoc import CompDoc

    log = io.StringIO()
    container = CompDoc(data, logfile=log)
    for entry in container.dirlist:  # xlrd follows a circle of short sectors forever
        sector, steps = entry.first_SID, 0
        while entry.tot_size < container.min_size_std_stream and 0 <= sector < len(container.SSAT):
            sector, steps = container.SSAT[sector], steps + 1
            if steps > len(container.SSAT):
                raise InputError(message("the workbook is damaged: its sectors form a circle"))
    book = xlrd.open_workbook(
        file_contents=data, formatting_info=True, on_demand=True, ragged_rows=True, logfile=log
    )
    start = START_1904 if book.datemode else START
    starts = [start - book.base for start in book._sh_abs_posn]
    empty = _xls_uncalculated(bytes(book.mem[book.base : book.base + book.stream_len]), starts)
    for number, sheet in enumerate(book.sheets()):
        grid = Grid(sheet.name, sheet.visibility == 0)
        grid.hidden_rows = {row for row, info in sheet.rowinfo_map.items() if info.hidden}
        grid.hidden_columns = {column for column, info in sheet.colinfo_map.items() if info.hidden}
        grid.merged = [(top, left, end - 1, right - 1) for top, end, left, right in sheet.merged_cells]
        for row in range(sheet.nrows):
            for column in range(sheet.row_len(row)):
                kind, value = sheet.cell_type(row, column), sheet.cell_value(row, column)
                style = book.xf_list[sheet.cell_xf_index(row, column)]
                fonts = [
                    style.font_index,
                    *(font for _, font in sheet.rich_text_runlist_map.get((row, column), ())),
                ]
                if (number, row, column) in empty and not value:
                    text = "=…"
                elif kind in (xlrd.XL_CELL_NUMBER, xlrd.XL_CELL_DATE):
                    text = formatted(value, book.format_map[style.format_key].format_str, start)
                elif kind == xlrd.XL_CELL_ERROR:
                    text = xlrd.error_text_from_code.get(value, "#ERROR")
                else:
                    text = ("FALSE", "TRUE")[value] if kind == xlrd.XL_CELL_BOOLEAN else str(value)
                struck = any(book.font_list[font].struck_out for font in fonts)
                grid.put(row, column, Cell(text, struck, text == "=…", kind == xlrd.XL_CELL_NUMBER))
        yield grid


def _xls_uncalculated(stream: bytes, starts: list[int]) -> set[tuple[int, int, int]]:
    """Find the formulas (sheet, row, column) if no program has calculated a single one: each is 0 or an empty
    text. ``starts``: where the sheets' records begin.

    In this format a formula always has a value; libraries that cannot calculate write one of these two.
    """
    places: set[tuple[int, int, int]] = set()
    at = sheet = 0
    while at + 18 <= len(stream):
        sheet = starts.index(at) if at in starts else sheet
        kind, size, row, column, _, value, last = struct.unpack_from("<HHHHH6sH", stream, at)
        if kind == 6:
            if (value, last) != (bytes(6), 0) and (value[0], last) != (3, 0xFFFF):
                return set()
            places.add((sheet, row, column))
        at += 4 + size
    return places
