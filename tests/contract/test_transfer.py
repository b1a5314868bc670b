# SPDX-License-Identifier: LGPL-2.1-or-later
"""Export to CSV, XLSX and JSON; import from CSV with validation first."""

from __future__ import annotations

import csv
import io
import struct
import zipfile
import zlib
from collections.abc import Callable
from typing import Any

import pytest
from hunting import BOTH
from openpyxl import Workbook, load_workbook
from openpyxl.styles import Font
from server_testing import Api, bom, form_body

EVIL = ['=HYPERLINK("http://x")', "+1+1", "-2", "@SUM(A1)", "\t=1", "＝1"]


def png(width: int, height: int) -> bytes:
    """A grey picture."""
    rows = zlib.compress(bytes(height * (width + 1)))
    chunks = ((b"IHDR", struct.pack(">2I5B", width, height, 8, 0, 0, 0, 0)), (b"IDAT", rows), (b"IEND", b""))
    made = b"\x89PNG\r\n\x1a\n"
    for kind, data in chunks:
        made += struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    return made


def read(data: bytes) -> list[dict[str, str]]:
    """The rows of a CSV export."""
    return list(csv.DictReader(io.StringIO(data.decode("utf-8-sig"), newline="")))


@pytest.fixture
def tree(api: Api) -> tuple[str, str, str, str]:
    """top → 2 × sub, 3 × leaf; sub → 4 × leaf, 1 × other."""
    top, sub, leaf, other = api.items(4)
    api.good("PUT", f"/api/items/{leaf}", {"properties": {"mass_kg": 0.25, "material": "Steel"}})
    api.merge(top, {sub: 2, leaf: 3})
    api.merge(sub, {leaf: 4, other: 1})
    return top, sub, leaf, other


def test_csv_is_rfc_4180(api: Api, tree: tuple[str, ...]) -> None:
    """CRLF, quotes doubled, UTF-8, a header, as an attachment."""
    top, sub, leaf, _ = tree
    api.edit_line(top, leaf, notes='say "hi",\nthen ÿ', reference_designators=["R1", "R2"])
    answer = api.call("GET", bom(top, "export.csv"))
    assert answer.headers["content-type"] == "text/csv; charset=utf-8; header=present"
    assert "attachment" in answer.headers["content-disposition"]
    assert b'"say ""hi"",\nthen \xc3\xbf"' in answer.body
    assert answer.body.endswith(b"\r\n")
    rows = read(answer.body)
    assert [(r["Item"], r["Part number"], r["Quantity"], r["Source"]) for r in rows] == [
        ("1", sub, "2", "assembly"),
        ("2", leaf, "3", "assembly"),
    ]
    assert (rows[1]["Unit mass [kg]"], rows[1]["Material"]) == ("0.25", "Steel")
    assert answer.body.startswith(b"\xef\xbb\xbfItem,")
    assert rows[1]["Reference designators"] == "R1 R2"


def test_indented_and_flat_views(api: Api, tree: tuple[str, ...]) -> None:
    """The whole tree with structured item numbers; the leaves with their totals."""
    top, sub, leaf, other = tree
    rows = read(api.call("GET", bom(top, "export.csv?view=indented")).body)
    assert [(r["Item"], r["Level"], r["Part number"], r["Total quantity"]) for r in rows] == [
        ("1", "1", sub, "2"),
        ("1.1", "2", leaf, "8"),
        ("1.2", "2", other, "2"),
        ("2", "1", leaf, "3"),
    ]
    flat = read(api.call("GET", bom(top, "export.csv?view=flat")).body)
    assert {r["Part number"]: r["Quantity"] for r in flat} == {leaf: "11", other: "2"}
    told = api.get(bom(top, "export.json?view=flat"))
    assert (told["view"], {line["part_number"]: line["quantity"] for line in told["lines"]}) == (
        "flat",
        {leaf: 11, other: 2},
    )
    api.bad(400, "GET", bom(top, "export.csv?view=sideways"))


def test_no_cell_is_run_as_a_formula(api: Api) -> None:
    """CSV: an apostrophe before it; XLSX: a text cell. The import takes the apostrophe off again."""
    parent, *children = api.items(1 + len(EVIL))
    for child, text in zip(children, EVIL, strict=True):
        api.add_line(parent, child, notes=text)
    data = api.call("GET", bom(parent, "export.csv")).body
    assert [row["Notes"] for row in read(data)] == ["'" + text for text in EVIL]
    book = load_workbook(io.BytesIO(api.call("GET", bom(parent, "export.xlsx")).body))
    (column,) = (cell.column for cell in book.active[1] if cell.value == "Notes")
    cells = [row[column - 1] for row in book.active.iter_rows(min_row=2)]
    assert [(cell.value, cell.data_type) for cell in cells] == [(text, "s") for text in EVIL]


def test_xlsx_has_numbers_as_numbers(api: Api, tree: tuple[str, ...]) -> None:
    """Quantities can be summed in a spreadsheet."""
    book = load_workbook(io.BytesIO(api.call("GET", bom(tree[0], "export.xlsx")).body))
    header = [cell.value for cell in book.active[1]]
    assert [row[header.index("Quantity")].value for row in book.active.iter_rows(min_row=2)] == [2, 3]


def test_a_workbook_shows_its_parts(api: Api, tree: tuple[str, ...]) -> None:
    """Each row its part's picture, if that is a whole PNG; only where pictures are asked for."""
    top, sub, leaf, _ = tree
    broken = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + bytes(20) + b"\xff\xff\0\0\0IEND\xaeB`\x82"
    for number, picture in (leaf, png(64, 32)), (sub, broken):
        out = io.BytesIO()
        with zipfile.ZipFile(out, "w") as archive:
            archive.writestr("Document.xml", "<Document/>")
            archive.writestr("thumbnails/Thumbnail.png", picture)
        api.upload(number, out.getvalue())
    plain = load_workbook(io.BytesIO(api.call("GET", bom(top, "export.xlsx?view=indented")).body)).active
    asked = bom(top, "export.xlsx?view=indented&pictures=1")
    shown = load_workbook(io.BytesIO(api.call("GET", asked).body)).active
    assert [(i.anchor._from.row, i.anchor._from.col) for i in shown._images] == [(2, 2), (4, 2)]
    assert {(image.width, image.height) for image in shown._images} == {(64, 32)}
    assert (shown.cell(1, 3).value, shown.cell(3, 4).value) == ("Picture", leaf)
    shown.delete_cols(3)
    assert list(shown.values) == list(plain.values)


def test_a_purchaser_can_order_from_it(api: Api, tree: tuple[str, ...]) -> None:
    """Unit and total mass and cost as numbers, supplier and its number, for as many as are built."""
    top, _sub, leaf, other = tree
    bought = {"supplier": "=Bolt & Co", "supplier_part_number": "00123", "lead_time_days": 14}
    api.good("PATCH", f"/api/items/{leaf}/properties", {"standard_cost": 0.1, "currency": "CHF", **bought})
    api.good(
        "PATCH", f"/api/items/{other}/properties", {"mass_kg": 0.00001, "standard_cost": 2, "currency": "CHF"}
    )
    flat = {row["part_number"]: row for row in api.get(bom(top, "export.json?view=flat&pieces=10"))["lines"]}
    assert (
        flat[leaf]
        | {
            "quantity": 110,
            "total_quantity": 110,
            "unit_mass_kg": 0.25,
            "overall_mass_kg": 27.5,
            "unit_cost": 0.1,
            "overall_cost": 11,
            "currency": "CHF",
            "item_type": "part",
            "relation_type": None,
            "lead_time_days": 14,
            "supplier": "=Bolt & Co",
            "supplier_part_number": "00123",
            "bought": "yes",
        }
        == flat[leaf]
    )
    assert flat[other]["bought"] is None
    rows = read(api.call("GET", bom(top, "export.csv?view=indented")).body)
    assert (rows[0]["Unit mass [kg]"], rows[0]["Overall mass [kg]"]) == ("1.00001", "2.00002")
    assert (rows[0]["Unit cost"], rows[0]["Relation type"]) == ("2.4", "component")
    assert (rows[2]["Unit mass [kg]"], rows[2]["Overall mass [kg]"]) == ("0.00001", "0.00002")
    assert rows[1]["Supplier"] == "'=Bolt & Co"
    answer = api.call("GET", bom(top, "export.xlsx?view=flat&pieces=10"))
    assert 'filename="' + f'{top}-bom-flat-for-10.xlsx"' in answer.headers["content-disposition"]
    sheet = load_workbook(io.BytesIO(answer.body)).active
    assert sheet["A1"].value.startswith(f"For 10 pieces of {top}")
    header = [cell.value for cell in sheet[2]]
    cells = {row[header.index("Part number")].value: row for row in sheet.iter_rows(min_row=3)}
    cost = cells[leaf][header.index("Overall cost")]
    assert (cost.value, cost.data_type, cost.number_format) == (11, "n", "#,##0.00")
    assert cells[leaf][header.index("Supplier's part number")].data_type == "s"
    assert sheet.auto_filter.ref.startswith("A2:")
    for wrong in (0, -1, "x", 10**9):
        api.bad(400, "GET", bom(top, f"export.csv?pieces={wrong}"))


def test_a_sum_with_something_unknown_in_it_is_empty(api: Api, tree: tuple[str, ...]) -> None:
    """Nobody orders by, or weighs with, half a sum; nor are two currencies added."""
    top, sub, leaf, other = tree
    api.good("PATCH", f"/api/items/{leaf}/properties", {"standard_cost": 1, "currency": "CHF"})
    first = api.get(bom(top, "export.json?view=single"))["lines"][0]
    assert (first["part_number"], first["unit_mass_kg"], first["unit_cost"]) == (sub, None, None)
    api.good("PATCH", f"/api/items/{other}/properties", {"mass_kg": 1, "standard_cost": 1, "currency": "EUR"})
    first = api.get(bom(top, "export.json?view=single"))["lines"][0]
    assert (first["unit_mass_kg"], first["unit_cost"], first["currency"]) == (2, None, None)


def test_csv_for_an_excel_that_writes_commas(api: Api, tree: tuple[str, ...]) -> None:
    """Semicolons and decimal commas; the import reads it as what it is."""
    top, leaf = tree[0], tree[2]
    api.edit_line(top, leaf, quantity=2.5, notes="a;b")
    data = api.call("GET", bom(top, "export.csv?semicolons=true")).body
    rows = list(csv.DictReader(io.StringIO(data.decode("utf-8-sig"), newline=""), delimiter=";"))
    assert (rows[1]["Quantity"], rows[1]["Unit mass [kg]"], rows[1]["Notes"]) == ("2,5", "0,25", "a;b")
    answer = api.good("POST", bom(top, "import"), body=data)
    assert answer["counts"] == {"add": 0, "change": 0, "same": 2, "skip": 0, "error": 0}


def test_our_own_export_imported_again_changes_nothing(api: Api, tree: tuple[str, ...]) -> None:
    """Round trip: every row is the same; three decimals in a file of ours are no thousands."""
    top, sub, leaf, other = tree
    api.edit_line(top, leaf, notes="=1", find_number="10", unit="m", quantity=1234.567)
    # As a program may have stored them; a file drops what stands at the ends.
    odd = {"notes": " two\r\nlines ", "unit": "m ", "reference_designators": ["R 1", "R2,"]}
    api.edit_line(top, sub, **odd, quantity=1.125)
    api.add_line(top, other, quantity=1e-7)
    before = api.get(bom(top))
    data = api.call("GET", bom(top, "export.csv")).body
    answer = api.good("POST", bom(top, "import"), body=data)
    assert answer["counts"] == {"add": 0, "change": 0, "same": 3, "skip": 0, "error": 0}
    assert api.get(bom(top)) == before


def test_import_is_validated_row_by_row_before_anything_is_written(api: Api) -> None:
    """The preview says what each row would do; with a problem anywhere nothing is imported."""
    parent, a, b, c = api.items(4)
    api.merge(parent, {a: 1})
    api.add_line(parent, b, quantity=2)
    cells = ["Part number,Qty,Notes", f"{a},5,", f"{b.lower()},2,", f"{c},1,new", "NO-SUCH,1,", f"{c},2,"]
    rows = "\r\n".join([*cells, f"{c},x,", ""])
    preview = api.good("POST", bom(parent, "import?dry_run=true"), body=rows.encode())
    statuses = [row["status"] for row in preview["rows"]]
    assert statuses == ["change", "same", "add", "error", "error", "error"]
    assert len(preview["problems"]) == 3
    error = api.bad(400, "POST", bom(parent, "import"), body=rows.encode())
    assert error["problems"] == preview["problems"]
    assert [problem.split(":")[0] for problem in error["problems"]] == ["row 5", "row 6", "row 7"]
    assert api.quantities(parent) == {a: 1, b: 2}
    good = "\r\n".join(rows.split("\r\n")[:4])
    body, headers = form_body({"file": ("bom.csv", good.encode())})
    answer = api.call("POST", bom(parent, "import"), body=body, headers=headers)
    assert answer.json()["counts"]["add"] == 1
    lines = api.lines(parent)
    assert (lines[a]["source"], lines[a]["override"], lines[a]["cad_quantity"]) == ("manual", True, 1)
    assert (lines[c]["source"], lines[c]["notes"]) == ("manual", "new")
    change = api.get(bom(parent, "history"))[0]
    assert (change["kind"], change["document"]["file"]) == ("import", "bom.csv")


def test_an_archived_part_is_not_imported_but_its_line_can_be_changed(api: Api) -> None:
    """As for a merge: what is archived is added to no BOM, and stays where it is."""
    parent, old, new = api.items(3)
    api.add_line(parent, old, quantity=2)
    for one in (old, new):
        api.good("DELETE", f"/api/items/{one}")
    error = api.bad(400, "POST", bom(parent, "import"), body=f"PN,Qty\n{old},3\n{new},1\n".encode())
    assert [problem.partition(": ")[0] for problem in error["problems"]] == ["row 3"]
    assert "is archived" in error["problems"][0]
    api.good("POST", bom(parent, "import"), body=f"PN,Qty\n{old},3\n".encode())
    assert api.quantities(parent) == {old: 3}


def test_files_of_other_spreadsheets(api: Api) -> None:
    """Semicolons with decimal commas, byte-order marks, title lines, cp1252."""
    for encoding in ("utf-8-sig", "utf-16", "utf-16-le", "cp1252"):
        parent, a = api.items(2)
        text = f"Stückliste\n\nQty;Part Number;Notes;Other\n1,5;{a};für später;x\n;;;\n"
        api.good("POST", bom(parent, "import"), body=text.encode(encoding))
        line = api.lines(parent)[a]
        assert (line["quantity"], line["notes"]) == (1.5, "für später"), encoding


def test_what_is_no_bom_is_refused(api: Api) -> None:
    """400, whatever it is, with what is wanted."""
    parent = api.item()
    for data, words in {
        b"": "Part number",
        b"\x00\xff\x00": "Part number",
        b"a,b\r\n1,2": "Part number",
        b'Part number,Quantity\r\n"broken': "cannot be read as CSV",
        b"\xff\xfe\x00": "Part number",
        b"PK\x03\x04" + bytes(60): "the workbook cannot be read",
        b"\xd0\xcf\x11\xe0" + bytes(60): "the workbook cannot be read",
    }.items():
        assert words in api.bad(400, "POST", bom(parent, "import"), body=data)["message"], data


def workbook(*sheets: tuple[str, list[list[Any]]]) -> tuple[Workbook, Callable[[], bytes]]:
    """A workbook with these sheets, and what packs it."""
    book = Workbook()
    book.remove(book.active)
    for name, rows in sheets:
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)

    def pack() -> bytes:
        out = io.BytesIO()
        book.save(out)
        return out.getvalue()

    return book, pack


def test_a_workbook_is_imported_as_its_sheet_says(api: Api) -> None:
    """A title, an empty line, numbers as numbers, a sheet before it; problems name the sheet's lines."""
    parent, a, b = api.items(3)
    rows = [
        ["Stückliste"],
        [],
        ["Teilenummer", "Menge", "Bemerkung"],
        [a, 1.5, "für später"],
        [b, 1000, None],
    ]
    _, pack = workbook(("Cover", [["Project", "X"]]), ("BOM", rows))
    api.good("POST", bom(parent, "import"), body=pack())
    assert api.quantities(parent) == {a: 1.5, b: 1000}
    assert api.lines(parent)[a]["notes"] == "für später"
    _, pack = workbook(("BOM", [*rows, ["NONE-1", 1], [b, "=A1*2"]]))
    error = api.bad(400, "POST", bom(parent, "import"), body=pack())
    assert [problem.partition(":")[0] for problem in error["problems"]] == ["row 6", "row 7"]


def test_our_own_workbook_changes_nothing(api: Api) -> None:
    """What was exported as XLSX is as it is in Silo, whatever its notes begin with."""
    parent, a, b = api.items(3)
    api.merge(parent, {a: 2})
    api.add_line(parent, b, quantity=0.125, notes="=1+1", unit="m")
    before = api.lines(parent)
    sent = api.call("GET", bom(parent, "export.xlsx")).body
    plan = api.good("POST", f"{bom(parent, 'import')}?dry_run=true", body=sent)
    assert {row["status"] for row in plan["rows"]} == {"same"}
    assert api.lines(parent) == before


@pytest.mark.parametrize(
    ("hide", "words"),
    [
        (lambda book: setattr(book["BOM"].row_dimensions[3], "hidden", True), "these lines are hidden: 3"),
        (lambda book: setattr(book["BOM"]["B3"], "font", Font(strike=True)), "lines are struck out: 3"),
        (lambda book: book.copy_worksheet(book["BOM"]), "sheets “BOM”, “BOM Copy” each hold such a table"),
    ],
    ids=["hidden", "struck out", "two"],
)
def test_what_a_person_does_not_see_in_a_workbook_is_not_imported(
    api: Api, hide: Callable[[Workbook], object], words: str
) -> None:
    """Refused by its line, before anything is written."""
    parent, a, b = api.items(3)
    book, pack = workbook(("BOM", [["PN", "Qty"], [a, 1], [b, 2]]))
    hide(book)
    assert words in api.bad(400, "POST", bom(parent, "import"), body=pack())["message"]
    assert api.lines(parent) == {}


def test_columns_are_known_by_the_aliases_that_the_bom_parser_knows(api: Api) -> None:
    """One table of aliases for both."""
    parent, a = api.items(2)
    headers = "PN,Qty", "Part No.,Quantity (pcs)", "Teilenummer,Menge", "part_number,QTY", "零件号,数量"
    for quantity, header in enumerate(headers, start=3):
        api.good("POST", bom(parent, "import"), body=f"{header}\n{a},{quantity}\n".encode())
        assert api.quantities(parent) == {a: quantity}


def test_the_missing_column_is_named(api: Api) -> None:
    """Which one lacks, what else it may be called, and which columns were seen."""
    parent, a = api.items(2)
    for header, missing, there in (
        ("PN, Name", "Quantity", "Part number"),
        ("Title, Menge", "Part number", "Quantity"),
    ):
        body = f"{header}\n{a},3\n".encode()
        message = api.bad(400, "POST", bom(parent, "import"), body=body)["message"]
        assert f"there is no column '{missing}'" in message
        assert f"'{there}'" not in message
        assert header in message
        assert "may also be called" in message


def test_an_import_cannot_make_a_ring(api: Api) -> None:
    """The check says it of the row, with the path; the assembly itself is named too; nothing is imported."""
    top, sub = api.items(2)
    api.merge(top, {sub: 1})
    body = f"PN;Qty\r\n{top};1\r\n{sub};2\r\n".encode()
    checked = api.good("POST", bom(sub, "import?dry_run=true"), body=body)
    assert [row["status"] for row in checked["rows"]] == ["error", "error"]
    problems = api.bad(400, "POST", bom(sub, "import"), body=body)["problems"]
    assert f"{sub} → {top} → {sub}" in problems[0]
    assert "the assembly itself" in problems[1]
    assert api.lines(sub) == {}


def test_a_flat_export_is_no_import(api: Api, tree: tuple[str, ...]) -> None:
    """Its quantities are totals over all levels: as the lines of one level they would be wrong."""
    flat = api.call("GET", bom(tree[0], "export.csv?view=flat")).body
    assert "flat export" in api.bad(400, "POST", bom(tree[0], "import"), body=flat)["message"]
    indented = api.call("GET", bom(tree[0], "export.csv?view=indented")).body
    before = api.lines(tree[0])
    api.good("POST", bom(tree[0], "import"), body=indented)
    assert api.lines(tree[0]) == before


KICAD = (
    '"Reference","Value","Footprint","Datasheet","Qty","DNP","MPN","Manufacturer"\n'
    '"C1,C2","100n","Capacitor_SMD:C_0603_1608Metric","~","2","","{mpn}","Murata"\n'
    '"R1-R3","10k","Resistor_SMD:R_0603_1608Metric","~","3","","",""\n'
    '"R9","10k","Resistor_SMD:R_0603_1608Metric","~","1","DNP","",""\n'
    '"R4","10k","Resistor_SMD:R_0603_1608Metric","~","1","","",""\n'
)


@BOTH
def test_a_bom_of_kicad_makes_its_parts_and_finds_them_again(api: Api) -> None:
    """By the maker's number, else by value and footprint; what is not fitted is left out."""
    parent = api.item(item_type="assembly")
    mpn = f"GRM-{parent}"
    text = KICAD.format(mpn=mpn).replace("10k", f"10k-{parent}").encode()
    checked = api.good("POST", bom(parent, "import?dry_run=true"), body=text)
    assert [row["status"] for row in checked["rows"]] == ["error", "error", "skip", "error"]
    assert "does not exist" in checked["problems"][0]
    # A row that is there again is a problem of its own, until somebody says that it is to be added up.
    checked = api.good("POST", bom(parent, "import?dry_run=true&make=R01"), body=text)
    assert [row["status"] for row in checked["rows"]] == ["add", "add", "skip", "error"]
    assert "stands here twice" in checked["problems"][0]
    assert api.lines(parent) == {}
    query = "import?make=R01&add_up=true"
    api.bad(400, "POST", bom(parent, "import?make=NOPE"), body=text)
    done = api.good("POST", bom(parent, query), body=text)
    assert done["counts"] == {"add": 2, "change": 0, "same": 0, "skip": 2, "error": 0}
    lines = {line["child_name"]: line for line in api.lines(parent).values()}
    resistor = lines[f"10k-{parent} R_0603_1608Metric"]
    assert (resistor["quantity"], resistor["reference_designators"]) == (4, ["R1-R3", "R4"])
    capacitor = next(line for name, line in lines.items() if name.startswith("100n"))
    item = api.get(f"/api/items/{capacitor['child_part_number']}")
    assert item["properties"] == {"manufacturer": "Murata", "manufacturer_part_number": mpn}
    assert (item["sourcing_type"], item["category"]) == ("purchased", "R01")
    # The same file again makes nothing.
    again = api.good("POST", bom(parent, query), body=text)
    assert again["counts"] == {"add": 0, "change": 0, "same": 2, "skip": 2, "error": 0}
    # A second part of that name: nobody knows which one is meant.
    api.item(name=f"10k-{parent} R_0603_1608Metric")
    problems = api.good("POST", bom(parent, f"{query}&dry_run=true"), body=text)["problems"]
    assert ["give the part number" in one for one in problems] == [True, True]


def test_designators_count_where_a_file_has_no_quantities(api: Api) -> None:
    """One row per value, with ranges."""
    parent = api.item(item_type="assembly")
    text = f'Ref;Value\n"R1-R3, R7";one {parent}\n"J1";two {parent}\n'.encode()
    api.good("POST", bom(parent, "import?make=R01"), body=text)
    assert sorted(api.quantities(parent).values()) == [1, 4]


def test_rows_of_one_part_are_added_up_exactly(api: Api) -> None:
    """As decimals; rows that count in another unit are no such rows; numbers that are unknown are made."""
    parent, a = api.items(2)
    text = f"PN,Name,Qty,Unit\n{a},,0.1,m\n{a},,0.2,m\nX-{a},A cover,1,\nx-{a.lower()},,2,\n"
    done = api.good("POST", bom(parent, "import?make=M01&add_up=1"), body=text.encode())
    assert done["counts"] == {"add": 2, "change": 0, "same": 0, "skip": 2, "error": 0}
    assert api.quantities(parent) == {a: 0.3, f"X-{a}": 3}
    assert api.get(f"/api/items/X-{a}")["name"] == "A cover"
    text = f"PN,Qty,Unit\n{a},1,m\n{a},2,kg\n"
    problems = api.good("POST", bom(parent, "import?dry_run=1&add_up=1"), body=text.encode())["problems"]
    assert len(problems) == 1
    # A row without a readable quantity is a problem of its own, and no row is added to it.
    text = f"PN,Qty\n{a},many\n{a},2\n"
    (problem,) = api.good("POST", bom(parent, "import?dry_run=1&add_up=1"), body=text.encode())["problems"]
    assert problem.startswith("row 2: ")
    assert "many" in problem
    # In a file with semicolons, a company may write a thousand and more with a point: a person is asked.
    (problem,) = api.good("POST", bom(parent, "import?dry_run=1"), body=f"PN;Qty\n{a};1.125".encode())[
        "problems"
    ]
    assert "can be read as 1125 or 1.125" in problem
    # A number that nobody may have is a problem of its row, and nothing is made.
    text = f"PN,Qty\n{a}-new,1\n{'x' * 99},2\n"
    api.bad(400, "POST", bom(parent, "import?make=M01"), body=text.encode())
    api.bad(404, "GET", f"/api/items/{a}-new")
