# SPDX-License-Identifier: LGPL-2.1-or-later
"""XLSX, ODS and XLS workbooks: one model of a sheet, with what each cell says and how a program shows it.

And the text of CSV files, by what their bytes say of it.

XLSX and ODS are read here, from their XML; XLS by xlrd. Readers that give values alone lose what decides
a mass: an error, or a formula that nobody has calculated, looks like an empty cell, and "12.5 g" is 12.5.
"""

from __future__ import annotations

import io
import operator
import posixpath
import re
import struct
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from functools import reduce
from typing import NamedTuple
from xml.etree.ElementTree import Element, fromstring

from silo.bom.errors import InputError

STARTS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")
"""How XLSX and ODS files begin, and XLS files."""

MAX_UNPACKED, MOST_CELLS = 128 * 1024 * 1024, 500_000


def unicode_name(data: bytes) -> str | None:
    """Detect the Unicode encoding of a file by its mark or its zeros; None for UTF-8 without a mark, and for
    code pages.
    """
    if data.startswith(b"\xef\xbb\xbf"):
        return "utf-8-sig"
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    start = data[:64]
    if data.startswith(STARTS) or start.count(0) <= len(start) // 4:
        return None
    # UTF-16 without its mark: every second byte of ASCII text is zero.
    return "utf-16-le" if data[1:2] == b"\0" else "utf-16-be"


class Cell(NamedTuple):
    """What a cell says.

    text
        a number in full, with a decimal point and what its format writes around it ("12.5 g"); a date as in
        ISO 8601; an error by its name; a formula without a value as "=…".
    struck
        True if a part of the text is struck out.
    uncalculated
        True for a formula without a value.
    """

    text: str
    struck: bool = False
    uncalculated: bool = False


class SheetRow(NamedTuple):
    """Cells of one record and the line of the file that it begins on (1 = first)."""

    line: int
    cells: tuple[str, ...]


@dataclass(eq=False)
class Grid:
    """One sheet. Rows and columns count from 0.

    merged
        (top, left, bottom, right) of each merged range, ends included.
    """

    name: str
    visible: bool = True
    cells: dict[tuple[int, int], Cell] = field(default_factory=dict)
    hidden_rows: set[int] = field(default_factory=set)
    hidden_columns: set[int] = field(default_factory=set)
    merged: list[tuple[int, int, int, int]] = field(default_factory=list)

    def put(self, row: int, column: int, cell: Cell) -> None:
        """Set a cell that is not empty. InputError if the sheet has more cells than a BOM can have."""
        if cell.text:
            self.cells[row, column] = cell._replace(text=" ".join(cell.text.splitlines()))
            if len(self.cells) > MOST_CELLS:
                raise InputError(f"sheet “{self.name}” has more than {MOST_CELLS} cells, too many for a BOM")

    def covered(self) -> set[tuple[int, int]]:
        """Return the cells with text under a merged cell, where no program shows it."""
        covered_cells: set[tuple[int, int]] = set()
        effort = 0
        for top, left, bottom, right in self.merged:
            size = (bottom - top + 1) * (right - left + 1)
            effort += min(size, len(self.cells))
            if effort > 10 * MOST_CELLS:
                raise InputError(f"sheet “{self.name}” has merged cells that overlap")
            inside = ((row, column) for row in range(top, bottom + 1) for column in range(left, right + 1))
            for row, column in inside if size < len(self.cells) else self.cells:
                if top <= row <= bottom and left <= column <= right and (row, column) != (top, left):
                    covered_cells.add((row, column))
        return covered_cells & self.cells.keys()

    def rows(self) -> list[SheetRow]:
        """Return the rows that are not empty, each up to its last cell with text."""
        by_row: dict[int, dict[int, str]] = {}
        covered = self.covered()
        for (row, column), cell in sorted(self.cells.items()):
            if (row, column) not in covered:
                by_row.setdefault(row, {})[column] = cell.text
        if sum(map(max, by_row.values())) > 10 * MOST_CELLS:
            raise InputError(f"sheet “{self.name}” is too wide; delete the cells outside of the table")
        return [
            SheetRow(row + 1, tuple(cells.get(column, "") for column in range(max(cells) + 1)))
            for row, cells in by_row.items()
        ]


def read_workbook(data: bytes, source: str) -> list[Grid]:
    """Read every sheet; those that are hidden come last. InputError if the workbook cannot be read."""
    try:
        grids = list(_xls(data) if data.startswith(STARTS[1]) else _zipped(data))
    except InputError as error:
        raise InputError(f"{source}: {error}") from error
    except ImportError as error:
        raise InputError(f"{source}: this is a workbook; export it as CSV, or install xlrd") from error
    except Exception as error:  # any error that a broken file causes in a reader
        raise InputError(
            f"{source}: the workbook cannot be read ({error or type(error).__name__})"
        ) from error
    return sorted(grids, key=lambda grid: not grid.visible)


_Read = Callable[[str], Element]
_Style = tuple[str, bool]
"""The number format of a cell, and True if its text is struck out."""


def _zipped(data: bytes) -> Iterator[Grid]:
    archive = zipfile.ZipFile(io.BytesIO(data))
    if sum(info.file_size for info in archive.infolist()) > MAX_UNPACKED:
        raise InputError(f"unpacked, the workbook is larger than {MAX_UNPACKED / 1e6:.0f} MB")
    parts = {info.filename.replace("\\", "/").casefold(): info for info in archive.infolist()}

    def read(path: str) -> Element:
        part = parts.get(path.casefold())
        content = archive.read(part) if part is not None else b"<none/>"
        # No workbook has a document type. Without one there are no entities, which could grow without end.
        if b"<!DOCTYPE" in content or b"\0" in content[:64]:
            raise InputError(f"its {path} has a document type or is not UTF-8; save the workbook again")
        return fromstring(content)  # noqa: S314 - see above

    return _ods(read) if "content.xml" in parts else _xlsx(read)


# Number formats. The codes are Excel's (ECMA-376 part 1, 18.8.31).

_TOKEN = re.compile(
    r'"(?P<quoted>[^"]*)"|\\(?P<escaped>.)|\[\$(?P<money>[^\]-]*)[^\]]*\]|_.|\*.|\[[^\]]*\]'
    r"|(?P<digits>[#0?.,]+(?:E[+-]?[#0?]+)?)|(?P<other>.)",
    re.DOTALL,
)
_SECTION = re.compile(r'(?:"[^"]*"|\\.|[^;"\\])+')
_CONDITION = re.compile(r"\[(<=|>=|<>|<|>|=)(-?[\d.]+)\]")
_COMPARE = {
    "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "=": operator.eq,
    "<>": operator.ne,
}  # fmt: skip
_START, _START_1904 = datetime(1899, 12, 30), datetime(1904, 1, 1)


def _formatted(value: float, code: str, start: datetime = _START) -> str:
    """Write a number in full, with the text that its format puts before and behind it.

    A format with a second group of digits, such as a fraction or a telephone number, is ignored: "12".
    """
    before, digits, behind, percent = "", "", "", False
    for token in _TOKEN.finditer(_section(value, code.replace("General", "#"))):
        literal = next((text for text in token.group("quoted", "escaped", "money", "other") if text), "")
        if token["other"] and token["other"] in "dmyhsDMYHS":
            return _moment(start + timedelta(seconds=round(value * 86400)))
        if token["digits"] and digits:
            return _plain(value)
        digits = digits or token["digits"] or ""
        percent |= token["other"] == "%"
        if digits:
            behind += literal
        else:
            before += literal
    number = value / 1000 ** (len(digits) - len(digits.rstrip(","))) * (100 if percent else 1)
    text = _plain(number)
    if re.fullmatch("0+", digits) and text.isdecimal():
        text = text.zfill(len(digits))
    # A sign or a bracket alone is the number's own.
    before, behind = (side if side.strip(" ()+-") else "" for side in (before, behind))
    return before + text + behind if digits else text


def _section(value: float, code: str) -> str:
    """Choose the part of a format for this value: by its conditions, or else by the sign."""
    free: list[str] = []
    for section in (sections := _SECTION.findall(code)):
        condition = _CONDITION.search(section)
        if condition is None:
            free.append(section)
        elif _COMPARE[condition[1]](value, float(condition[2])):
            return str(section)
    by_sign = 1 if value < 0 else 2 if value == 0 else 0
    return next(iter([*free[by_sign if free == sections else 0 :], *free]), "")


def _plain(value: float) -> str:
    text = f"{value:.15g}"
    return text + "0" * (text[-4:-3] == ".")  # "1.2340" cannot be 1234


def _moment(moment: datetime) -> str:
    if moment.date() == _START.date():
        return moment.time().isoformat()
    return moment.isoformat(" ").removesuffix(" 00:00:00")


# XLSX (ECMA-376 part 1, 18.3 to 18.8)


def _xlsx(read: _Read) -> Iterator[Grid]:
    path = _links(read, "").get("officeDocument", "xl/workbook.xml")
    if path.endswith(".bin"):
        raise InputError("this is a binary workbook (XLSB); save it as XLSX")
    links, book = _links(read, path), read(path)
    strings = [_string(item) for item in read(links.get("sharedStrings", "")).iterfind("{*}si")]
    styles = list(_xlsx_styles(read(links.get("styles", "")))) or [("", False)]
    start = _START_1904 if _is_on(book.find("{*}workbookPr"), "date1904") else _START
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


def _links(read: _Read, path: str) -> dict[str, str]:
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


def _xlsx_styles(sheet: Element) -> Iterator[_Style]:
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
        raise InputError(f"a cell stands at “{reference[:20]}”, which no sheet has")
    return int(match[2]) - 1, reduce(lambda number, letter: number * 26 + ord(letter) - 64, match[1], 0) - 1


def _xlsx_cell(cell: Element, strings: list[Cell], styles: list[_Style], start: datetime) -> Cell:
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
        text = Cell(_formatted(float(value), code, start))
    else:
        text = Cell(_BOOLEANS[value] if kind == "b" else _iso(value) if kind == "d" else value)
    return text._replace(struck=struck or text.struck)


_BOOLEANS = {"0": "FALSE", "1": "TRUE", "false": "FALSE", "true": "TRUE"}


def _iso(text: str) -> str:
    return text.removesuffix("Z").replace("T", " ").removesuffix(" 00:00:00")


# ODS (OpenDocument 1.3 part 3)

_TABLE, _STYLE, _OFFICE, _TEXT, _NUMBER = (
    f"{{urn:oasis:names:tc:opendocument:xmlns:{name}:1.0}}"
    for name in ("table", "style", "office", "text", "datastyle")
)
_ERRORS = {"Err:502": "#VALUE!", "Err:503": "#NUM!"}
"""LibreOffice's own errors as it writes them into XLSX files."""


def _ods(read: _Read) -> Iterator[Grid]:
    content = read("content.xml")
    styles = {
        (style.get(f"{_STYLE}family", ""), style.get(f"{_STYLE}name", "")): style
        for root in (read("styles.xml"), content)
        for part in root
        if part.tag in (f"{_OFFICE}styles", f"{_OFFICE}automatic-styles")
        for style in part
    }
    style_table: dict[tuple[str, str], _Style] = {}

    def look(family: str, name: str | None) -> _Style:
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


def _ods_style(style: Element, styles: dict[tuple[str, str], Element], above: _Style) -> _Style:
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


def _fill_ods(grid: Grid, table: Element, look: Callable[[str, str | None], _Style]) -> None:
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


def _ods_cell(cell: Element, style: str | None, look: Callable[[str, str | None], _Style]) -> Cell:
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
        text = text if text.isalpha() else _formatted(float(value), code)  # TRUE is the number 1
    elif kind == "date":
        text = _iso(cell.get(f"{_OFFICE}date-value", text))
    elif kind == "time":
        text = ":".join(re.findall(r"\d+", cell.get(f"{_OFFICE}time-value", text))[:3])
    elif kind == "boolean":
        text = _BOOLEANS.get(cell.get(f"{_OFFICE}boolean-value", ""), text)
    return Cell(text or cell.get(f"{_OFFICE}string-value", ""), struck)


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


# XLS (BIFF)


def _xls(data: bytes) -> Iterator[Grid]:
    import xlrd
    from xlrd.compdoc import CompDoc

    log = io.StringIO()
    container = CompDoc(data, logfile=log)
    for entry in container.dirlist:  # xlrd follows a circle of short sectors forever
        sector, steps = entry.first_SID, 0
        while entry.tot_size < container.min_size_std_stream and 0 <= sector < len(container.SSAT):
            sector, steps = container.SSAT[sector], steps + 1
            if steps > len(container.SSAT):
                raise InputError("the workbook is damaged: its sectors form a circle")
    book = xlrd.open_workbook(
        file_contents=data, formatting_info=True, on_demand=True, ragged_rows=True, logfile=log
    )
    start = _START_1904 if book.datemode else _START
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
                    text = _formatted(value, book.format_map[style.format_key].format_str, start)
                elif kind == xlrd.XL_CELL_ERROR:
                    text = xlrd.error_text_from_code.get(value, "#ERROR")
                else:
                    text = ("FALSE", "TRUE")[value] if kind == xlrd.XL_CELL_BOOLEAN else str(value)
                struck = any(book.font_list[font].struck_out for font in fonts)
                grid.put(row, column, Cell(text, struck, text == "=…"))
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
