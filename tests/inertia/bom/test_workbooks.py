# SPDX-License-Identifier: LGPL-2.1-or-later
"""BOMs as XLSX and ODS: the same table as from CSV, with the rows' own numbers."""

from __future__ import annotations

import datetime
import io
import zipfile
from collections.abc import Callable
from typing import Any

import pytest

from silo.bom.errors import InputError
from silo.inertia.bom import BomCode, BOMParser

openpyxl = pytest.importorskip("openpyxl")
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


def test_a_merged_cell_gives_each_of_its_lines_the_text() -> None:
    """One material for three lines is meant for each of them; a number may be of all lines together."""

    def merge(sheet: Any) -> None:
        for cells in ("A1:A2", "C3:C5", "D3:D4", "E3:E5"):
            sheet.merge_cells(cells)

    units = [None, "", "", "g", ""]
    rows = [["a", 4, "steel", 12, "x"], ["b", 2, None, None, None], ["c", 1, None, 7, None]]
    table = BOMParser().parse_bytes(edited([*HEAD[:3], "Mass", "Note"], units, *rows, change=merge))
    assert [(row.name, row.material) for row in table.rows] == [
        ("a", "steel"),
        ("b", "steel"),
        ("c", "steel"),
    ]
    assert [row.mass_kg for row in table.rows] == [pytest.approx(0.012), None, pytest.approx(0.007)]
    texts, numbers = (warning.message for warning in table.warnings)
    assert texts == "merged cells: “steel” in lines 3 to 5; each of these lines was given the text"
    assert numbers == "merged cells: “12” in lines 3 to 4; only the first of these lines has the number"


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


def test_hidden_lines_are_read_and_named_and_a_hidden_sheet_comes_last() -> None:
    """A filter hides what was ordered elsewhere; the robot has it all the same."""

    def hide(sheet: Any) -> None:
        sheet.row_dimensions[3].hidden = True
        sheet.row_dimensions[9].hidden = True
        old = sheet.parent.create_sheet("old", 0)
        old.append(HEAD)
        old.append(["z", 1, "steel", 1])
        old.sheet_state = "hidden"

    table = BOMParser().parse_bytes(edited(HEAD, ["a", 1, "", 1], ["b", 1, "", 2], change=hide))
    assert [row.name for row in table.rows] == ["a", "b"]
    sheets, lines = sorted(warning.message for warning in table.warnings)
    assert "line 3 is hidden" in sheets
    assert "not read: sheet “old”" in lines


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


def test_a_workbook_with_a_doctype_or_broken_parts_is_read_without_a_look_inside() -> None:
    """What hostile or strange files say beside their values is not worth a failure."""
    good = xlsx(BOM=[HEAD, ["a", 1, "steel", 1]])
    for path, old, new in (
        ("xl/workbook.xml", b"<workbook", b"<!DOCTYPE workbook><workbook"),
        (SHEET, b' r="2"', b""),
    ):
        table = BOMParser().parse_bytes(patched(good, path, old, new))
        assert [row.name for row in table.rows] == ["a"]


def test_a_formula_whose_value_is_an_empty_text_is_an_empty_cell() -> None:
    """IF(A1="", "", …): that a program found nothing to show is an answer."""
    book = xlsx(BOM=[HEAD, ["a", 1, "=1", 1]])
    old, new = b'<c r="C2"><f>', b'<c r="C2" t="str"><f>'
    table = BOMParser().parse_bytes(patched(book, SHEET, old, new))
    assert table["a"].material is None
    assert not table.warnings


def patched(book: bytes, path: str, old: bytes, new: bytes) -> bytes:
    """A workbook with other bytes in one of its files."""
    with zipfile.ZipFile(io.BytesIO(book)) as source, zipfile.ZipFile(out := io.BytesIO(), "w") as target:
        for name in source.namelist():
            data = source.read(name)
            assert name != path or old in data
            target.writestr(name, data.replace(old, new, 1) if name == path else data)
    return out.getvalue()


def test_a_second_sheet_with_a_bom_is_named() -> None:
    """Which of two revisions was meant, the file does not say."""
    table = BOMParser().parse_bytes(xlsx(A=[HEAD, ["a", 1, "steel", 1]], B=[HEAD, ["a", 1, "steel", 2]]))
    assert table["a"].mass_kg == pytest.approx(1e-3)
    (warning,) = table.warnings
    assert "sheet “A”" in warning.message
    assert "sheet “B”" in warning.message


def test_a_stray_cell_in_a_far_corner_is_named() -> None:
    """Read as a full table it would be 17 thousand million cells; a long or a wide sheet is none."""

    def note(sheet: Any) -> None:
        sheet.cell(40, 500, "note")

    far = edited(HEAD, ["a", 1, "steel", 1], change=lambda sheet: sheet.cell(1_048_576, 16_384, "x"))
    assert BOMParser().parse_bytes(edited(HEAD, ["a", 1, "steel", 1], change=note))["a"].mass_kg
    doctype = patched(far, SHEET, b"<worksheet", b"<!DOCTYPE worksheet><worksheet")
    for data in (far, doctype, patched(far, "xl/workbook.xml", b"<workbook", b"<!DOCTYPE w><workbook")):
        with pytest.raises(InputError, match="reaches to XFD1048576"):
            BOMParser().parse_bytes(data)


@pytest.mark.parametrize("cell", ['"A900000000"', '"ZZZZZZ2"', "'XFD1048576'", '"xfd1048576"'])
def test_a_reference_that_no_sheet_can_have_is_refused(cell: str) -> None:
    """The reader asks for the memory of all cells up to there, and its failure ends the program."""
    book = xlsx(BOM=[HEAD, ["a", 1, "steel", 1]])
    error = f'<row r="2"><c r={cell} t="e"><v>#N/A</v></c>'.encode()
    with pytest.raises(InputError, match=f"reaches to {cell[1:-1]}"):
        BOMParser().parse_bytes(patched(book, SHEET, b'<row r="2">', error))


def test_a_line_number_that_is_none_is_a_workbook_that_cannot_be_read() -> None:
    """Its cells say where they are; what is wrong is the reader's to say."""
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
