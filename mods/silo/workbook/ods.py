# SPDX-License-Identifier: LGPL-2.1-or-later
"""ODS (OpenDocument 1.3 part 3): content and styles → sheets."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from xml.etree.ElementTree import Element

from silo.workbook.number_format import BOOLEANS, formatted, iso_text
from silo.workbook.parts import CellStyle, ReadPart
from silo.workbook.sheet import Cell, Grid

_TABLE, _STYLE, _OFFICE, _TEXT, _NUMBER = (
    f"{{urn:oasis:names:tc:opendocument:xmlns:{name}:1.0}}"
    for name in ("table", "style", "office", "text", "datastyle")
)
_ERRORS = {"Err:502": "#VALUE!", "Err:503": "#NUM!"}
"""LibreOffice's own errors as it writes them into XLSX files."""


def read_ods(read: ReadPart) -> Iterator[Grid]:
    """Read every sheet."""
    content = read("content.xml")
    styles = {
        (style.get(f"{_STYLE}family", ""), style.get(f"{_STYLE}name", "")): style
        for root in (read("styles.xml"), content)
        for part in root
        if part.tag in (f"{_OFFICE}styles", f"{_OFFICE}automatic-styles")
        for style in part
    }
    style_table: dict[tuple[str, str], CellStyle] = {}

    def look(family: str, name: str | None) -> CellStyle:
        key = family, name or ""
        if key not in style_table:
            style_table[key] = "", False  # also if a style is its own parent
            style = styles.get(key)
            if style is not None:
                above = look(family, style.get(f"{_STYLE}parent-style-name"))
                style_table[key] = _ods_style(style, styles, above)
        return style_table[key]

    for table in content.iterfind(f"{_OFFICE}body/{_OFFICE}spreadsheet/{_TABLE}table"):
        style = styles.get(("table", table.get(f"{_TABLE}style-name", "")))
        shown = style is None or style.find(f"{_STYLE}table-properties[@{_TABLE}display='false']") is None
        grid = Grid(table.get(f"{_TABLE}name", ""), shown)
        _fill_ods(grid, table, look)
        yield grid


def _ods_style(style: Element, styles: dict[tuple[str, str], Element], above: CellStyle) -> CellStyle:
    code, struck = above
    data = style.get(f"{_STYLE}data-style-name")
    if data is not None:
        code = _code(styles.get(("", data)), styles)
    for properties in style.iterfind(f"{_STYLE}text-properties"):
        for name in ("type", "style"):
            line = properties.get(f"{_STYLE}text-line-through-{name}")
            struck = struck if line is None else line != "none"
    return code, struck


def _code(style: Element | None, styles: dict[tuple[str, str], Element]) -> str:
    """Translate a data style into the format code of Excel."""
    if style is None:
        return ""
    sections = [
        element.get(f"{_STYLE}condition", "").replace("value()", "[").replace("!=", "<>") + "]"
        + _code(styles.get(("", element.get(f"{_STYLE}apply-style-name", ""))), {})
        for element in style.iterfind(f"{_STYLE}map")
        if styles
    ]  # fmt: skip
    own = ""
    for part in style:
        kind, text = part.tag.rpartition("}")[2], part.text or ""
        if kind in ("text", "currency-symbol"):
            percent = style.tag == f"{_NUMBER}percentage-style"
            own += text if percent else '"' + text.replace('"', "") + '"'
        elif kind == "number":
            own += "0" * min(int(part.get(f"{_NUMBER}min-integer-digits", 1)), 40) or "#"
            own += ".0" * (part.get(f"{_NUMBER}decimal-places", "0") != "0")
            own += "," * ((len(part.get(f"{_NUMBER}display-factor", "1")) - 1) // 3)
    return ";".join([*sections, own])


def _fill_ods(grid: Grid, table: Element, look: Callable[[str, str | None], CellStyle]) -> None:
    defaults: list[str | None] = []
    for column, hidden in _ods_lines(table, "column"):
        count = min(_count(column, "number-columns-repeated"), 16_384)
        if hidden:
            grid.hidden_columns.update(range(len(defaults), len(defaults) + count))
        defaults += [column.get(f"{_TABLE}default-cell-style-name")] * count
        if len(defaults) > 16_384:
            break
    line = 0
    for row, hidden in _ods_lines(table, "row"):
        lines = range(line, line + _count(row, "number-rows-repeated"))
        line, column_index = lines.stop, 0
        for cell in row:
            columns = range(column_index, column_index + _count(cell, "number-columns-repeated"))
            column_index = columns.stop
            default = row.get(f"{_TABLE}default-cell-style-name") or next(
                iter(defaults[columns.start :][:1]), None
            )
            content = _ods_cell(cell, cell.get(f"{_TABLE}style-name") or default, look)
            down, across = (_count(cell, f"number-{axis}-spanned") for axis in ("rows", "columns"))
            if down * across > 1:
                grid.merged.append(
                    (lines.start, columns.start, lines.start + down - 1, columns.start + across - 1)
                )
            if content.text:
                grid.hidden_rows.update(lines if hidden else ())
                for here in lines:
                    for place in columns:
                        grid.put(here, place, content)


def _ods_lines(parent: Element, kind: str, hidden: bool = False) -> Iterator[tuple[Element, bool]]:
    """Yield the rows or columns in all groups, each with True if it is hidden, filtered or collapsed."""
    for child in parent:
        name = child.tag.removeprefix(_TABLE)
        if name == f"table-{kind}":
            yield child, hidden or child.get(f"{_TABLE}visibility", "visible") != "visible"
        elif name in (f"table-{kind}-group", f"table-header-{kind}s", f"table-{kind}s"):
            yield from _ods_lines(child, kind, hidden or child.get(f"{_TABLE}display") == "false")


def _count(element: Element, name: str) -> int:
    return max(int(element.get(f"{_TABLE}{name}", 1)), 1)


def _ods_cell(cell: Element, style: str | None, look: Callable[[str, str | None], CellStyle]) -> Cell:
    lines = cell.findall(f"{_TEXT}p")  # not those of a comment, which lie deeper
    text = "\n".join(map(_ods_text, lines))
    formula, value = cell.get(f"{_TABLE}formula"), cell.get(f"{_OFFICE}value")
    code, struck = look("table-cell", style)
    struck |= any(
        look("text", element.get(f"{_TEXT}style-name"))[1]
        for p in lines
        for element in p.iter(f"{_TEXT}span")
    )
    kind = cell.get(f"{_OFFICE}value-type", "")
    if formula is not None:
        if re.match(r"#[^\W\d]|Err:\d", text):  # some writers call it the number 0
            return Cell(_ERRORS.get(text, "#N/A" if text.startswith("Err:") else text), struck)
        if not kind and not lines:
            bare = re.sub(r"^\w+:(?==)|[\[\]]|(?<!\w)\.(?=\$?[A-Z])", "", formula)
            return Cell(bare, struck, uncalculated=True)
    if value is not None:
        text = text if text.isalpha() else formatted(float(value), code)  # TRUE is the number 1
    elif kind == "date":
        text = iso_text(cell.get(f"{_OFFICE}date-value", text))
    elif kind == "time":
        text = ":".join(re.findall(r"\d+", cell.get(f"{_OFFICE}time-value", text))[:3])
    elif kind == "boolean":
        text = BOOLEANS.get(cell.get(f"{_OFFICE}boolean-value", ""), text)
    return Cell(text or cell.get(f"{_OFFICE}string-value", ""), struck, number=value is not None)


def _ods_text(element: Element) -> str:
    text = re.sub(r"\s+", " ", element.text or "")
    for child in element:
        kind = child.tag.removeprefix(_TEXT)
        if kind == "s":
            text += " " * min(int(child.get(f"{_TEXT}c", 1)), 1000)
        elif kind in ("tab", "line-break"):
            text += " "
        elif kind != "ruby-text":
            text += _ods_text(child)
        text += re.sub(r"\s+", " ", child.tail or "")
    return text
