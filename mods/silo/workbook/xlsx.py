# SPDX-License-Identifier: LGPL-2.1-or-later
"""XLSX (ECMA-376 part 1, 18.3 to 18.8): the parts of a package → its sheets."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator
from datetime import datetime
from functools import reduce
from xml.etree.ElementTree import Element

from silo.bom.errors import InputError
from silo.bom.message import message
from silo.workbook.number_format import BOOLEANS, START, START_1904, formatted, iso_text
from silo.workbook.parts import CellStyle, ReadPart
from silo.workbook.sheet import Cell, Grid


def read_xlsx(read: ReadPart) -> Iterator[Grid]:
    """Read every sheet that has cells; charts have none."""
    path = _links(read, "").get("officeDocument", "xl/workbook.xml")
    if path.endswith(".bin"):
        raise InputError(message("this is a binary workbook (XLSB); save it as XLSX"))
    links, book = _links(read, path), read(path)
    strings = [_string(item) for item in read(links.get("sharedStrings", "")).iterfind("{*}si")]
    styles = list(_xlsx_styles(read(links.get("styles", "")))) or [("", False)]
    start = START_1904 if _is_on(book.find("{*}workbookPr"), "date1904") else START
    for sheet in book.iterfind("{*}sheets/{*}sheet"):
        link = links.get(next((value for key, value in sheet.items() if key.endswith("}id")), ""), "")
        if "chartsheet" in link or "dialogsheet" in link:
            continue
        grid = Grid(sheet.get("name", ""), sheet.get("state", "visible") == "visible")
        part = read(link)
        for column in part.iterfind("{*}cols/{*}col"):
            if _is_on(column, "hidden"):
                first = int(column.get("min", ""))
                grid.hidden_columns.update(range(first - 1, min(int(column.get("max", "")), first + 16_384)))
        for merged in part.iterfind("{*}mergeCells/{*}mergeCell"):
            first_cell, _, last_cell = merged.get("ref", "").partition(":")
            grid.merged.append((*_place(first_cell), *_place(last_cell or first_cell)))
        line = -1
        for row in part.iterfind("{*}sheetData/{*}row"):
            line = int(row.get("r", line + 2)) - 1
            if _is_on(row, "hidden"):
                grid.hidden_rows.add(line)
            column_index = -1
            for cell in row:
                reference = cell.get("r")
                here, column_index = _place(reference) if reference else (line, column_index + 1)
                grid.put(here, column_index, _xlsx_cell(cell, strings, styles, start))
        yield grid


def _links(read: ReadPart, path: str) -> dict[str, str]:
    """Read the paths to which a part of the package refers, by their ids and by their kinds."""
    folder, name = posixpath.split(path)
    links: dict[str, str] = {}
    for link in read(posixpath.join(folder, "_rels", f"{name}.rels")):
        target = posixpath.normpath(posixpath.join("/", folder, link.get("Target", ""))).lstrip("/")
        links[link.get("Id", "")] = links[posixpath.basename(link.get("Type", ""))] = target
    return links


def _is_on(element: Element | None, name: str, default: str = "0") -> bool:
    return element is not None and element.get(name, default) in ("1", "true", "on")


def _string(item: Element) -> Cell:
    """Join all runs of a text, without phonetic hints."""
    text, struck = "", False
    for part in item:
        kind = part.tag.rpartition("}")[2]
        if kind == "t":
            text += re.sub("_x([0-9A-Fa-f]{4})_", lambda code: chr(int(code[1], 16)), part.text or "")
        elif kind == "r":
            run = _string(part)
            text, struck = text + run.text, struck or run.struck
        elif kind == "rPr":
            struck = any(_is_on(line, "val", "1") for line in part.iterfind("{*}strike"))
    return Cell(text, struck)


def _xlsx_styles(sheet: Element) -> Iterator[CellStyle]:
    from xlrd.formatting import std_format_strings

    formats = {
        **{str(number): code for number, code in std_format_strings.items()},
        **{
            element.get("numFmtId", ""): element.get("formatCode", "")
            for element in sheet.iterfind("{*}numFmts/{*}numFmt")
        },
    }
    fonts = [_is_on(font.find("{*}strike"), "val", "1") for font in sheet.iterfind("{*}fonts/{*}font")]
    for style in sheet.iterfind("{*}cellXfs/{*}xf"):
        yield formats.get(style.get("numFmtId", ""), ""), any(fonts[int(style.get("fontId", 0)) :][:1])


def _place(reference: str) -> tuple[int, int]:
    """Return row and column of a cell such as "D3"."""
    match = re.fullmatch("([A-Z]{1,3})([1-9][0-9]{0,6})", reference.upper())
    if match is None:
        raise InputError(
            message("a cell stands at “{reference}”, which no sheet has", reference=reference[:20])
        )
    return int(match[2]) - 1, reduce(lambda number, letter: number * 26 + ord(letter) - 64, match[1], 0) - 1


def _xlsx_cell(cell: Element, strings: list[Cell], styles: list[CellStyle], start: datetime) -> Cell:
    parts = {child.tag.rpartition("}")[2]: child for child in cell}  # ten times as quick as {*} for each
    kind, value = cell.get("t", "n"), parts["v"].text or "" if "v" in parts else ""
    code, struck = styles[int(cell.get("s", 0))]
    if "f" in parts and not value and kind != "str":
        return Cell(f"={parts['f'].text or '…'}", struck, uncalculated=True)
    if kind == "inlineStr":
        text = _string(parts["is"]) if "is" in parts else Cell("")
    elif not value:
        text = Cell("#ERROR" if kind == "e" else "")
    elif kind == "s":
        text = strings[int(value)]
    elif kind == "n":
        text = Cell(formatted(float(value), code, start), number=True)
    else:
        text = Cell(BOOLEANS[value] if kind == "b" else iso_text(value) if kind == "d" else value)
    return text._replace(struck=struck or text.struck)
