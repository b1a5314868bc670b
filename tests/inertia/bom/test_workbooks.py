# SPDX-License-Identifier: LGPL-2.1-or-later
"""BOMs as XLSX and ODS: the same table as from CSV, with the rows' own numbers."""

from __future__ import annotations

import datetime
import io
import re
import struct
import zipfile
from collections.abc import Callable
from typing import Any

import pytest
from sheet_corpus import read_corpus

from silo.bom.errors import InputError
from silo.inertia.bom.parser import BOMParser
from silo.inertia.bom.table import BomCode
from silo.workbook.read import read_workbook

openpyxl = pytest.importorskip("openpyxl")
from openpyxl.styles import Font  # noqa: E402 - needs openpyxl

HEAD = ["Name", "Qty", "Material", "Mass (g)"]
SHEET = "xl/worksheets/sheet1.xml"


def xlsx(**sheets: list[list[Any]]) -> bytes:
    book = openpyxl.Workbook()
    book.remove(book.active)
    for title, rows in sheets.items():
        sheet = book.create_sheet(title)
        for row in rows:
            sheet.append(row)
    book.save(out := io.BytesIO())
    return out.getvalue()


def ods(rows: list[list[Any]]) -> bytes:
    def cell(value: Any) -> str:
        kind = "string" if isinstance(value, str) else f'float" office:value="{value}'
        return f'<table:table-cell office:value-type="{kind}"><text:p>{value}</text:p></table:table-cell>'

    names = " ".join(
        f'xmlns:{n}="urn:oasis:names:tc:opendocument:xmlns:{n}:1.0"' for n in ("office", "table", "text")
    )
    body = "".join(f"<table:table-row>{''.join(map(cell, row))}</table:table-row>" for row in rows)
    manifest = '<manifest:manifest xmlns:manifest="urn:oasis:names:tc:opendocument:xmlns:manifest:1.0"/>'
    with zipfile.ZipFile(out := io.BytesIO(), "w") as archive:
        archive.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        archive.writestr("META-INF/manifest.xml", manifest)
        archive.writestr(
            "content.xml",
            f'<?xml version="1.0"?><office:document-content {names}><office:body><office:spreadsheet>'
            f'<table:table table:name="BOM">{body}</table:table>'
            "</office:spreadsheet></office:body></office:document-content>",
        )
    return out.getvalue()


def test_a_workbook_is_read_like_a_csv_file() -> None:
    """A cover sheet, title lines, a text with a line break, numbers as numbers and as text."""
    rows = [["Parts list"], [], HEAD, ["Base\nplate", 4, "steel", 1.234], ["bolt", "2 pcs", "steel", "12,5"]]
    for data in (xlsx(Cover=[["Robot arm"]], BOM=rows), ods([HEAD, *rows[3:]])):
        table = BOMParser().parse_bytes(data)
        assert [(row.name.split()[0], row.quantity) for row in table.rows] == [("Base", 4), ("bolt", 2)]
        assert [row.mass_kg for row in table.rows] == [pytest.approx(1.234e-3), pytest.approx(0.0125)]
        assert table.warnings == ()
    assert BOMParser().parse_bytes(xlsx(BOM=rows)).rows[0].line == 4


def test_what_is_no_number_in_a_workbook_is_reported() -> None:
    """A date for a quantity, a truth value and an error for a mass; formulas that nothing has computed.

    Such a formula looks like an empty cell to a reader of values, and the part would get its material's mass.
    """
    rows = [
        ["a", datetime.date(2026, 1, 2), "steel", 1],
        ["b", 1, "steel", True],
        ["c", 1, "steel", "=1+1"],
        ["d", "=2+2", "steel", "#REF!"],
    ]
    table = BOMParser().parse_bytes(xlsx(BOM=[HEAD, *rows]))
    assert [row.mass_kg for row in table.rows] == [pytest.approx(1e-3), None, None, None]
    found = [(w.code, w.line) for w in table.warnings]
    assert found == [
        (BomCode.FILE, 0),
        (BomCode.UNREADABLE_QUANTITY, 2),
        (BomCode.UNREADABLE_MASS, 3),
        (BomCode.UNREADABLE_MASS, 4),
        (BomCode.UNREADABLE_QUANTITY, 5),
        (BomCode.UNREADABLE_MASS, 5),
    ]
    assert "2 formulas without a value" in table.warnings[0].message


def edited(*rows: list[Any], change: Callable[[Any], object]) -> bytes:
    """A workbook of one sheet, after ``change`` of that sheet."""
    book = openpyxl.load_workbook(io.BytesIO(xlsx(BOM=list(rows))))
    change(book["BOM"])
    book.save(out := io.BytesIO())
    return out.getvalue()


def test_a_merged_cell_below_the_last_value() -> None:
    """Lines that hold nothing but a formula without a value are as long as the others."""

    def merge(sheet: Any) -> None:
        sheet["A3"], sheet["A4"], sheet["C3"] = "=1", "=1", "PLA"
        sheet.merge_cells("C3:C5")
        sheet["B6"] = "=1"
        sheet.merge_cells("D6:D7")

    table = BOMParser().parse_bytes(edited(HEAD, ["a", 1, "steel", 1], change=merge))
    assert [(row.name, row.material) for row in table.rows[:3]] == [
        ("a", "steel"),
        ("=1", "PLA"),
        ("=1", "PLA"),
    ]


def test_a_header_over_two_columns_at_the_end_is_that_of_both() -> None:
    """A merged cell has its text in the first column; the line above ends there."""
    rows = [[*HEAD[:3], "Mass"], ["", "", "", "each", "total"], ["lid", 2, "steel", "3 g", "9 g"]]
    table = BOMParser().parse_bytes(xlsx(BOM=rows))
    assert table["lid"].mass_kg == pytest.approx(0.003)
    assert [warning.code for warning in table.warnings] == [BomCode.TOTAL_DIFFERS]


def test_texts_with_a_point_or_a_comma_prove_no_decimal_mark() -> None:
    """A number is stored as one; a text in its place was pasted from anywhere."""
    table = BOMParser().parse_bytes(xlsx(BOM=[HEAD, ["a", 1, "", "36.826"], ["b", 1, "", 1.234]]))
    assert [w.code for w in table.warnings] == []  # the number shows its point
    table = BOMParser().parse_bytes(xlsx(BOM=[HEAD, ["a", 1, "", "36.826"], ["b", 1, "", 1]]))
    assert [w.code for w in table.warnings] == [BomCode.AMBIGUOUS_MASS]


def test_item_numbers_that_a_spreadsheet_changed_are_named() -> None:
    """1.10 becomes 1.1 as a number, and 1.2 a day in January; either takes a row from its parent."""
    head = ["Item", "Name", "Qty", "Material", "Mass (g)"]
    rows = [
        [1, "top", 1],
        [1.1, "a", 4],
        [1.10, "b", 2],
        [datetime.date(2026, 1, 2), "c", 1],
        ["1.3", "d", 1],
    ]
    table = BOMParser().parse_bytes(xlsx(BOM=[head, *rows]))
    assert [row.parent for row in table.rows] == [None, 0, 0, None, 0]
    assert [(w.line, w.name) for w in table.warnings] == [(4, "b"), (5, "c")]


@pytest.mark.parametrize("path", ["xl/workbook.xml", SHEET, "xl/styles.xml"])
def test_a_workbook_with_a_doctype_is_refused(path: str) -> None:
    """Its entities could grow without end; no program writes one."""
    book = xlsx(BOM=[HEAD, ["a", 1, "steel", 1]])
    for mark in (b"<!DOCTYPE x>", b"\0"):
        with pytest.raises(InputError, match="document type or is not UTF-8"):
            BOMParser().parse_bytes(patched(book, path, b"<", mark + b"<"))


def test_cells_without_a_reference_stand_behind_the_one_before() -> None:
    """Some writers leave out where a cell or a row stands."""
    book = xlsx(BOM=[HEAD, ["a", 1, "steel", 1]])
    for old in (b' r="2"', b' r="B2"', b' r="D2"'):
        assert BOMParser().parse_bytes(patched(book, SHEET, old, b""))["a"].mass_kg == pytest.approx(1e-3)
    sheet = zipfile.ZipFile(io.BytesIO(book)).read(SHEET)
    bare = patched(book, SHEET, sheet, re.sub(rb' r="\w+"', b"", sheet))
    assert [row.line for row in read_workbook(bare, "book")[0].rows()] == [1, 2]
    assert rows_of(bare) == rows_of(book)


def patched(book: bytes, path: str, old: bytes, new: bytes) -> bytes:
    """A workbook with other bytes in one of its files."""
    with zipfile.ZipFile(io.BytesIO(book)) as source, zipfile.ZipFile(out := io.BytesIO(), "w") as target:
        for name in source.namelist():
            data = source.read(name)
            assert name != path or old in data
            target.writestr(name, data.replace(old, new, 1) if name == path else data)
    return out.getvalue()


def test_a_stray_cell_in_a_far_corner_costs_nothing() -> None:
    """Read as a full table it would be 17 thousand million cells."""
    far = edited(HEAD, ["a", 1, "steel", 1], change=lambda sheet: sheet.cell(1_048_576, 16_384, "x"))
    table = BOMParser().parse_bytes(far)
    assert table["a"].mass_kg
    assert [(w.code, w.line) for w in table.warnings] == [(BomCode.NO_NAME, 1_048_576)]


def test_a_sheet_with_more_cells_than_a_bom_can_have_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever makes it so: cells that are repeated, wide lines, merged cells that overlap."""
    monkeypatch.setattr("silo.workbook.limits.MOST_CELLS", 5_000)
    cell = '<table:table-cell table:number-columns-repeated="1024"><text:p>x</text:p></table:table-cell>'
    row = f'<table:table-row table:number-rows-repeated="9">{cell}</table:table-row></table:table>'
    with pytest.raises(InputError, match="more than 5000 cells"):
        BOMParser().parse_bytes(patched(ods([HEAD]), "content.xml", b"</table:table>", row.encode()))
    rows = '<row r="{0}"><c r="{1}{0}"><v>1</v></c></row>'
    wide = "".join(rows.format(line, "XFD") for line in range(3, 9)) + "</sheetData>"
    many = "".join(rows.format(line, "A") for line in range(3, 99)) + "</sheetData><mergeCells>"
    merged = many + '<mergeCell ref="A1:XFD1048576"/>' * 900 + "</mergeCells>"
    for sheet, words in ((wide, "too wide"), (merged, "overlap")):
        with pytest.raises(InputError, match=words):
            BOMParser().parse_bytes(patched(xlsx(BOM=[HEAD]), SHEET, b"</sheetData>", sheet.encode()))


@pytest.mark.parametrize("cell", ['"A900000000"', '"ZZZZZZ2"', '"2"', '"A0"'])
def test_a_reference_that_no_sheet_can_have_is_refused(cell: str) -> None:
    book = xlsx(BOM=[HEAD, ["a", 1, "steel", 1]])
    error = f'<row r="2"><c r={cell} t="e"><v>#N/A</v></c>'.encode()
    with pytest.raises(InputError, match=f"stands at “{cell[1:-1]}”"):
        BOMParser().parse_bytes(patched(book, SHEET, b'<row r="2">', error))


def test_a_line_number_that_is_none_is_a_workbook_that_cannot_be_read() -> None:
    """Cells say where they are; a line's own number counts for its cells without a place."""
    book = xlsx(BOM=[HEAD, ["a", 1, "steel", "=1+1"]])
    with pytest.raises(InputError, match="cannot be read"):
        BOMParser().parse_bytes(patched(book, SHEET, b'<row r="2"', b'<row r="two" hidden="1"'))
    far = BOMParser().parse_bytes(patched(book, SHEET, b'<row r="2"', b'<row r="900000000"'))
    assert "1 formula without a value" in far.warnings[0].message
    assert far.rows[0].line == 2


def test_a_workbook_that_unpacks_without_end_is_refused() -> None:
    with zipfile.ZipFile(out := io.BytesIO(), "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("xl/worksheets/sheet1.xml", b" ")
        archive.filelist[0].file_size = 10**10
    with pytest.raises(InputError, match="unpacked"):
        BOMParser().parse_bytes(out.getvalue())


def rows_of(book: bytes, sheet: int = 0) -> list[list[str]]:
    """What the sheet says, line by line."""
    return [list(row.cells) for row in read_workbook(book, "book")[sheet].rows()]


def ods_of(body: str, styles: str = "") -> bytes:
    """An ODS file with the given rows and automatic styles; o: is office:, x: is text:."""
    space = 'xmlns:{}="urn:oasis:names:tc:opendocument:xmlns:{}:1.0"'
    names = {"o": "office", "x": "text", "style": "style", "number": "datastyle"}
    root = " ".join(["<office:document-content", *(space.format(*pair) for pair in names.items())])
    book = patched(ods([]), "content.xml", b"</table:table>", f"{body}</table:table>".encode())
    book = patched(book, "content.xml", b"<office:document-content", root.encode())
    head = f"<o:automatic-styles>{styles}</o:automatic-styles><office:body>"
    return patched(book, "content.xml", b"<office:body>", head.encode())


CELL = "<table:table-row><table:table-cell {}</table:table-cell></table:table-row>"


@pytest.mark.parametrize(
    ("cell", "text"),
    [
        ("><x:p>no type</x:p>", "no type"),
        ('o:value-type="string" o:string-value="value">', "value"),
        ('o:value-type="string"><x:p>a</x:p><x:p>b</x:p>', "a\nb"),
        ('o:value-type="string"><x:p>\n  a<x:s x:c="3"/>b<x:tab/>c</x:p>', " a   b c"),
        ('o:value-type="string"><x:p>a<x:span>b</x:span>c<x:line-break/>d</x:p>', "abc d"),
        ("><o:annotation><x:p>no</x:p></o:annotation><x:p>a</x:p>", "a"),
        ('o:value-type="float" o:value="12.5"><x:p>12,50 kg</x:p>', "12.5"),
        ('o:value-type="boolean" o:boolean-value="true"><x:p>WAHR</x:p>', "TRUE"),
        ('o:value-type="date" o:date-value="2026-01-02T00:00:00"><x:p>2.1.</x:p>', "2026-01-02"),
        ('o:value-type="date" o:date-value="2026-01-02T03:04:05"><x:p/>', "2026-01-02 03:04:05"),
        ('o:value-type="time" o:time-value="PT01H30M00.5S"><x:p/>', "01:30:00"),
        ('table:formula="of:=[.B2]*[$T.A1]+SUM([.B2:.C3])">', "=B2*$T.A1+SUM(B2:C3)"),
        ('table:formula="of:=1/0" o:value-type="float" o:value="0"><x:p>#DIV/0!</x:p>', "#DIV/0!"),
        ('table:formula="of:=x" o:value-type="string"><x:p>#WERT!</x:p>', "#WERT!"),
        ('table:formula="of:=x" o:value-type="string"><x:p>Err:503</x:p>', "#NUM!"),
        ('table:formula="of:=x" o:value-type="string"><x:p>Err:522</x:p>', "#N/A"),
        ('table:formula="of:=x" o:value-type="string"><x:p># 4</x:p>', "# 4"),
    ],
)  # fmt: skip
def test_what_a_cell_of_an_ods_file_says(cell: str, text: str) -> None:
    """As LibreOffice, Gnumeric, spreadsheets of the web and libraries write it."""
    assert rows_of(ods_of(CELL.format(cell))) == [[text]]


def test_rows_and_columns_of_an_ods_file_are_counted_in_all_groups() -> None:
    """Heads and groups inside each other; what is hidden in one of them is hidden."""
    row = "<table:table-row{}><table:table-cell{}><x:p>{}</x:p></table:table-cell></table:table-row>"
    book = ods_of(
        '<table:table-column-group table:display="false"><table:table-columns>'
        '<table:table-column table:number-columns-repeated="2"/>'
        "</table:table-columns></table:table-column-group>"
        '<table:table-column/><table:table-column table:visibility="collapse"/>'
        f"<table:table-header-rows>{row.format('', '', 'a')}</table:table-header-rows>"
        '<table:table-row table:number-rows-repeated="3"/>'
        '<table:table-row-group table:display="false"><table:table-row-group>'
        f"{row.format('', '', 'b')}</table:table-row-group></table:table-row-group>"
        + row.format(' table:number-rows-repeated="2"', ' table:number-columns-repeated="2"', "c")
        + row.format(' table:visibility="filter" table:number-rows-repeated="2"', "", "d")
    )
    (grid,) = read_workbook(book, "book")
    assert {place: cell.text for place, cell in grid.cells.items()} == {
        (0, 0): "a", (4, 0): "b", (5, 0): "c", (5, 1): "c", (6, 0): "c", (6, 1): "c", (7, 0): "d",
        (8, 0): "d",
    }  # fmt: skip
    assert (grid.hidden_rows, grid.hidden_columns) == ({4, 7, 8}, {0, 1, 3})


def test_styles_of_an_ods_file_are_inherited() -> None:
    """From a parent and from the column; a line that is "none" is none, and a style may be its own parent."""
    line = '<style:text-properties style:text-line-through-type="{}"/>'
    style = '<style:style style:family="table-cell" style:name="{}"{}>{}</style:style>'
    number = '<number:text>M</number:text><number:number number:min-integer-digits="2"/>'
    styles = (
        f'<number:number-style style:name="N">{number}</number:number-style>'
        + style.format("base", ' style:data-style-name="N"', line.format("single"))
        + style.format("heir", ' style:parent-style-name="base"', "")
        + style.format("plain", ' style:parent-style-name="heir"', line.format("none"))
        + style.format("self", ' style:parent-style-name="self"', "")
    )
    for kind in ("percentage", "number"):
        code = '<number:number number:min-integer-digits="1"/><number:text>%</number:text>'
        styles += f'<number:{kind}-style style:name="{kind}">{code}</number:{kind}-style>'
        styles += style.format(kind, f' style:data-style-name="{kind}"', "")
    cell = '<table:table-cell{} o:value-type="float" o:value="5"><x:p>5</x:p></table:table-cell>'
    named = "".join(
        cell.format(f' table:style-name="{name}"')
        for name in ("plain", "self", "none", "percentage", "number")
    )
    column = '<table:table-column table:default-cell-style-name="heir"/>'
    row = f'<table:table-row table:default-cell-style-name="plain">{cell.format("")}</table:table-row>'
    book = ods_of(f"{column}<table:table-row>{cell.format('')}{named}</table:table-row>{row}", styles)
    (grid,) = read_workbook(book, "book")
    cells = [(cell.text, cell.struck) for cell in grid.cells.values()]
    assert cells == [("M05", True), *((text, False) for text in ("M05", "5", "5", "500%", "5%", "M05"))]


@pytest.mark.parametrize(
    ("cell", "text"),
    [
        ('t="inlineStr"><is><t>a</t></is>', "a"),
        ('t="inlineStr"><is><r><t>a</t></r><r><rPr><b/></rPr><t> b</t></r><rPh><t>no</t></rPh></is>', "a b"),
        ('t="inlineStr"><is><t>a_x000D_\n_x263A_</t></is>', "a\n☺"),
        ('t="str"><f>A1</f><v>text</v>', "text"),
        ('t="str"><f>A1</f>', None),
        ('><f t="shared" si="0"/>', "=…"),
        ('><f>A2+1</f>', "=A2+1"),
        ('><f>A2+1</f><v>3</v>', "3"),
        ('t="e"><f>A2</f><v>#N/A</v>', "#N/A"),
        ('t="e">', "#ERROR"),
        ('t="b"><v>0</v>', "FALSE"),
        ('t="d"><v>2026-01-02T00:00:00Z</v>', "2026-01-02"),
        ('><v>1.234</v>', "1.2340"),
        ('><v>0.1</v>', "0.1"),
        ('><v>1e300</v>', "1e+300"),
        ('s="9"><v>1</v>', None),
    ],
)  # fmt: skip
def test_what_a_cell_of_an_xlsx_file_says(cell: str, text: str | None) -> None:
    """As programs and libraries write it; a style that is not there makes the workbook unreadable."""
    row = f'<row><c r="A1" {cell}</c></row></sheetData>'
    book = patched(xlsx(BOM=[]), SHEET, b"</sheetData>", row.encode())
    if 's="9"' in cell:
        with pytest.raises(InputError, match="cannot be read"):
            rows_of(book)
    else:
        assert rows_of(book) == ([[text]] if text else [])


@pytest.mark.parametrize(
    ("code", "value", "text"),
    [
        ("General", 12.5, "12.5"), ('General" g"', 12.5, "12.5 g"), ("@", 12.5, "12.5"),
        ('0.0" g"', 12.25, "12.25 g"), ("0.0\\ \\k\\g", 12.5, "12.5 kg"), ('"~"0.0', 12.5, "~12.5"),
        ('#,##0.000_-" kg"', 1234.5, "1234.5 kg"), ('0.00,"t"', 1500, "1.5t"), ('0,,"Mg"', 2e6, "2Mg"),
        ('[<1]0.0" g";[>=1]0.0" kg"', 0.5, "0.5 g"), ('[<1]0.0" g";[>=1]0.0" kg"', 1, "1 kg"),
        ('[=0]"none";0" g"', 3, "3 g"), ('[<>3]0" a";0" b"', 3, "3 b"), ('[<=3]0" a";0" b"', 3, "3 a"),
        ('[>3]0" a";0" b"', 3, "3 b"),
        ('0" p";0" n";0" z"', 1, "1 p"), ('0" p";0" n";0" z"', -1, "-1 n"), ('0" p";0" n";0" z"', 0, "0 z"),
        ('0" p";0" n"', 0, "0 p"), ('0" p"', -1, "-1 p"), ("0.0_);(0.0)", -1.5, "-1.5"), ('0;-0;"-"', 0, "0"),
        ("0%", 0.25, "25%"), ("0.0 %", 0.25, "25 %"), ('0"%"', 25, "25%"),
        ("[$€-407] 0.00", 3, "€ 3"), ("[$-409]0.00", 3, "3"), ('"a;b"0', 1, "a;b1"),
        ("00000", 42, "00042"), ("00000", 42.5, "42.5"), ("000-000", 12345, "12345"),
        ("# ?/?", 0.5, "0.5"), ("[Red]0.0", 1.5, "1.5"), ("* 0.0", 1.5, "1.5"),
        ("yyyy-mm-dd", 46024, "2026-01-02"), ("d/m/yy h:mm", 46024.5, "2026-01-02 12:00:00"),
        ("h:mm", 0.25, "06:00:00"), ('0.0" days"', 2.5, "2.5 days"), ("", 7, "7"),
    ],
)  # fmt: skip
def test_what_a_number_format_shows_around_a_number(code: str, value: float, text: str) -> None:
    """The number in full, its unit, its sign; never a digit that the format hides."""

    def change(sheet: Any) -> None:
        sheet["A1"] = value
        sheet["A1"].number_format = code

    assert rows_of(edited([None], change=change)) == [[text]]


@pytest.mark.parametrize(
    ("mark", "struck"), [("<strike />", True), ('<strike val="1"/>', True), ('<strike val="0"/>', False)]
)
def test_a_line_through_text_that_is_switched_off_is_none(mark: str, struck: bool) -> None:
    """In the font of a cell, and in a run of its text."""
    book = edited(["a"], change=lambda sheet: setattr(sheet["A1"], "font", Font(strike=True)))
    run = f"<is><r><rPr>{mark}</rPr><t>a</t></r></is>"
    for one in (
        patched(book, "xl/styles.xml", b'<strike val="1" />', mark.encode()),
        patched(xlsx(BOM=[["a"]]), SHEET, b"<is><t>a</t></is>", run.encode()),
    ):
        (grid,) = read_workbook(one, "book")
        assert [cell.struck for cell in grid.cells.values()] == [struck]


def test_dates_of_a_workbook_that_counts_from_1904() -> None:
    book = edited([datetime.date(2026, 1, 2)], change=lambda sheet: None)
    later = patched(book, "xl/workbook.xml", b"<workbookPr", b'<workbookPr date1904="1"')
    assert (rows_of(book), rows_of(later)) == ([["2026-01-02"]], [["2030-01-03"]])


def test_parts_of_an_xlsx_file_by_other_names() -> None:
    """Backslashes and capitals in the zip, as some libraries write them; a chart is no sheet."""
    book = xlsx(BOM=[HEAD], Chart=[["x"]])
    target = b"worksheets/sheet2.xml"
    chart = patched(book, "xl/_rels/workbook.xml.rels", target, b"chartsheets/sheet2.xml")
    assert [grid.name for grid in read_workbook(chart, "book")] == ["BOM"]
    with zipfile.ZipFile(io.BytesIO(book)) as old, zipfile.ZipFile(out := io.BytesIO(), "w") as new:
        for name in old.namelist():
            new.writestr(name.replace("/", "\\").replace("sheet1", "Sheet1"), old.read(name))
    assert rows_of(out.getvalue()) == [HEAD]
    with zipfile.ZipFile(out := io.BytesIO(), "w") as binary:
        link = '<r><Relationship Id="1" Type="x/officeDocument" Target="/xl/workbook.bin"/></r>'
        binary.writestr("_rels/.rels", link)
    with pytest.raises(InputError, match="XLSB"):
        rows_of(out.getvalue())


def test_formulas_of_an_xls_file_without_a_value() -> None:
    """Libraries that do not calculate write an empty text or 0 for each; one result proves a program."""
    book = read_corpus()["formula.xls"]  # =10+2.5 and =2*2
    results = [struct.pack("<d", 12.5), struct.pack("<d", 4.0)]
    assert [book.count(result) for result in results] == [1, 1]
    nothing = {bytes(8), b"\3\0\0\0\0\0\xff\xff"}
    for one in nothing:
        assert not BOMParser().parse_bytes(book.replace(results[0], one))["lid"].mass_kg
        for two in nothing:
            table = BOMParser().parse_bytes(book.replace(results[0], one).replace(results[1], two))
            assert [str(warning) for warning in table.warnings] == [
                "2 formulas without a value; open and save the workbook in a program that calculates them",
                "line 2: the mass “=…” is no mass; it is not used",
                "line 3: the quantity “=…” cannot be read and is not used: "
                "wanted a number such as 4 or 2.5, got “=…”",
            ]


def test_a_circle_of_sectors_in_an_xls_file_is_refused() -> None:
    """xlrd alone would follow it forever."""
    book = read_corpus()["plain.xls"]
    chain, circle = (struct.pack("<4i", 1, 2, 3, last) for last in (4, 0))
    assert book.count(chain) == 1
    with pytest.raises(InputError, match="circle"):
        BOMParser().parse_bytes(book.replace(chain, circle))


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (xlsx(BOM=[HEAD])[:600], "cannot be read"),
        (xlsx(BOM=[]), "empty"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + b"\0" * 600, "cannot be read"),
        (b"<html><table><tr><th>Name</th></tr></table></html>", "HTML"),
    ],
)
def test_what_is_no_table_says_so(data: bytes, words: str) -> None:
    with pytest.raises(InputError, match=words):
        BOMParser().parse_bytes(data, "bom.xlsx")
