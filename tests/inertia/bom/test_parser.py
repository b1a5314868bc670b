# SPDX-License-Identifier: LGPL-2.1-or-later
"""Case 22 and the rest of BOM files: shapes, languages, structure, duplicates."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from silo.bom.errors import InputError
from silo.inertia.bom.columns import MASSES
from silo.inertia.bom.mass_cell import unit_factor
from silo.inertia.bom.parser import BOMParser
from silo.inertia.bom.table import BomCode, BomTable
from silo.tables.columns import find_columns

PLAIN = (
    "Item,Quantity,Part number,Description,Material,Mass,Name\n"
    "1,1,P-1,,Stahl,0.3 kg,Träger\n"
    "2,4,P-2,,ppa-cf,No value,bolt\n"
)


def semicolons(text: str) -> str:
    return text.replace(",", ";").replace("0.3", "0,3")


# The 15 shapes of the survey; every one holds the same two rows.
SHAPES: dict[str, bytes] = {
    "utf-8": PLAIN.encode(),
    "utf-8-sig": PLAIN.encode("utf-8-sig"),
    "utf-8-sig, Name first": (
        "Name,Item,Quantity,Part number,Material,Mass\n"
        "Träger,1,1,P-1,Stahl,0.3 kg\nbolt,2,4,P-2,ppa-cf,No value\n"
    ).encode("utf-8-sig"),
    "semicolon": semicolons(PLAIN).encode(),
    "tab": PLAIN.replace(",", "\t").encode(),
    "pipe": PLAIN.replace(",", "|").encode(),
    "title lines": ("Robot arm,,,\n,,,\nExported 2026-01-29,,,\n" + PLAIN).encode(),
    "sep line": ("sep=;\n" + semicolons(PLAIN)).encode(),
    "lower-case header": PLAIN.replace(PLAIN.split("\n")[0], PLAIN.split("\n")[0].lower()).encode(),
    "German header": (
        "Pos.;Menge;Teilenummer;Beschreibung;Werkstoff;Masse;Bezeichnung\n"
        "1;1;P-1;;Stahl;0,3 kg;Träger\n2;4;P-2;;ppa-cf;Kein Wert;bolt\n"
    ).encode(),
    "utf-16": PLAIN.encode("utf-16"),
    "latin-1": PLAIN.encode("latin-1"),
    "short rows": (
        "Name,Quantity,Material,Mass,Note,Vendor\nTräger,1,Stahl,0.3 kg,painted\nbolt,4,ppa-cf,No value\n"
    ).encode(),
    "CRLF and empty lines": PLAIN.replace("\n", "\r\n\r\n").encode(),
    "sub-assembly rows": (
        "Item,Quantity,Part number,Material,Mass,Name\n"
        "1,1,P-1,Stahl,0.3 kg,Träger\n2,2,S-1,,5 kg,gearbox\n2.1,4,P-2,ppa-cf,No value,bolt\n"
    ).encode(),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_the_15_shapes(shape: str) -> None:
    """Every shape gives the same parts; nothing raises."""
    table = BOMParser().parse_bytes(SHAPES[shape])
    assert table["Träger"].mass_kg == pytest.approx(0.3)
    assert table["Träger"].material == "Stahl"
    assert table["bolt"].mass_kg is None
    assert table["bolt"].material == "ppa-cf"
    assert [table["Träger"].quantity, table["bolt"].quantity] == [1, 4]
    if shape == "latin-1":
        assert "cp1252" in table.warnings[0].message
    else:
        assert table.warnings == ()


@pytest.mark.parametrize(
    ("header", "rows"),
    [
        ("Item,Quantity,Name", "1,1,bracket"),
        ("Item,Quantity,Material,Name", "1,1,steel,bracket"),
        ("Item,Quantity,Mass,Name", "1,1,0.2 kg,bracket"),
    ],
)
def test_missing_columns_are_reported(bom: Callable[..., BomTable], header: str, rows: str) -> None:
    """Without a mass or a material column the file is read, and a warning names what it has instead."""
    table = bom(f"{header}\n{rows}\n")
    assert "bracket" in table
    missing = [w for w in table.warnings if w.code is BomCode.MISSING_COLUMN]
    assert len(missing) == ("Mass" not in header) + ("Material" not in header)
    assert all(header.replace(",", ", ") in w.message for w in missing)


@pytest.mark.parametrize(
    ("language", "header", "encoding"),
    [
        ("en", "Item,Qty,Part Name,Material,Mass", "utf-8"),
        ("de", "Pos.,Anzahl,Benennung,Werkstoff,Gewicht", "utf-8"),
        ("fr", "Repère,Quantité,Nom,Matériau,Masse", "cp1252"),
        ("es", "Elemento,Cantidad,Nombre,Material,Masa", "utf-8"),
        ("it", "Posizione,Quantità,Nome,Materiale,Massa", "cp1252"),
        ("ja", "項目,数量,名前,材料,質量", "cp932"),
        ("zh", "序号,数量,名称,材料,质量", "gb18030"),
    ],
)
def test_headers_of_seven_languages(language: str, header: str, encoding: str) -> None:
    """Columns are found by alias, whatever the order and the code page."""
    names = ["1", "2", "bracket", "steel", "0.25 kg"]
    pairs = list(zip(header.split(","), names, strict=True))
    for order in (pairs, pairs[::-1]):
        text = ",".join(h for h, _ in order) + "\n" + ",".join(v for _, v in order) + "\n"
        (row,) = BOMParser().parse_bytes(text.encode(encoding)).rows
        assert (row.name, row.material, row.mass_kg, row.quantity, row.item) == (
            "bracket",
            "steel",
            0.25,
            2,
            "1",
        )


def test_renamed_columns_by_the_users_word(bom: Callable[..., BomTable]) -> None:
    """A company's own column names are given by role; they win over aliases."""
    text = "Kurztext,Name,Gew.,Stoff\nbracket,irrelevant,300,steel\n"
    table = bom(text, columns={"name": "Kurztext", "mass": "Gew.", "material": "Stoff"}, mass_unit="g")
    assert table["bracket"].mass_kg == pytest.approx(0.3)
    assert table["bracket"].material == "steel"


def test_a_given_column_that_is_not_there_is_reported(bom: Callable[..., BomTable]) -> None:
    """A wrong --column is no silent fall-back."""
    table = bom("Name,Mass\nbracket,1 kg\n", columns={"material": "Stoff"})
    assert any("no column “Stoff”" in w.message for w in table.warnings)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"columns": {"colour": "x"}}, "unknown column role colour"),
        ({"decimal": ";"}, "decimal mark"),
        ({"mass_unit": "stone"}, "not a unit of mass"),
        ({"delimiter": ";;"}, "one character"),
        ({"encoding": "klingon"}, "cannot be read as klingon"),
    ],
)
def test_bad_options_are_plain_errors(
    bom: Callable[..., BomTable], options: dict[str, Any], words: str
) -> None:
    """What the user asked for and cannot be is said in one sentence."""
    with pytest.raises(InputError, match=words):
        bom("Name,Mass\nx,1 kg\n", **options)


@pytest.mark.parametrize(
    ("delimiter", "other", "kg", "warned"),
    [
        (",", '"0,5 kg"', 1.234, False),
        (",", "0.5 kg", 1234.0, False),
        (",", "7 kg", 1234.0, True),
        (";", "7 kg", 1.234, True),
    ],
)
def test_ambiguous_masses(
    bom: Callable[..., BomTable], delimiter: str, other: str, kg: float, warned: bool
) -> None:
    """The column decides; without proof the file's delimiter is followed, with both readings in a warning."""
    table = bom(
        delimiter.join(("Name", "Mass", "Material\n"))
        + delimiter.join(("a", '"1,234 kg"', "\n"))
        + delimiter.join(("b", other, "\n"))
    )
    assert table["a"].mass_kg == pytest.approx(kg)
    told = [w for w in table.warnings if w.code is BomCode.AMBIGUOUS_MASS]
    assert bool(told) is warned
    if warned:
        assert "1.234 kg" in told[0].message
        assert "1234 kg" in told[0].message
        assert told[0].line == 2


def test_quantum_is_the_columns_display_precision(bom: Callable[..., BomTable]) -> None:
    """ "0.3 kg" beside "0.009 kg" was shown with three decimals too: trailing zeros are trimmed."""
    table = bom("Name,Mass,Material\na,0.3 kg,\nb,0.009 kg,\nc,12 g,\n")
    assert table["a"].quantum_kg == pytest.approx(0.0005)
    assert table["c"].quantum_kg == pytest.approx(0.0005)
    assert bom("Name,Mass,Material\na,0.3 kg,\n")["a"].quantum_kg == pytest.approx(0.05)


def test_structured_items_have_parents_and_totals(bom: Callable[..., BomTable]) -> None:
    """Case 26: 1.1.2 is below 1.1, quantities multiply, sub-assembly rows are marked."""
    table = bom(
        "Item,Quantity,Mass,Material,Name\n1,2,9 kg,,arm\n1.1,3,,,joint\n1.1.1,4,0.1 kg,,bolt\n"
        "1.1.2,1,,steel,pin\n2,1,,steel,base\n"
    )
    arm, joint, bolt, pin, base = table.rows
    assert [row.parent for row in table.rows] == [None, 0, 1, 1, None]
    assert [row.level for row in table.rows] == [1, 2, 3, 3, 1]
    assert [row.has_children for row in table.rows] == [True, True, False, False, False]
    assert table.total_quantity(bolt) == 24
    assert table.ancestors(pin) == (joint, arm)
    assert base.parent is None


def test_flattened_items_have_no_parents(bom: Callable[..., BomTable]) -> None:
    """Items 1, 2, 10 are no structure; an item whose parent is not in the file stands at the top."""
    table = bom("Item,Name,Mass,Material\n1,a,,\n2,b,,\n10,c,,\n4.1,d,,\n")
    assert all(row.parent is None for row in table.rows)


def test_silos_own_export(bom: Callable[..., BomTable]) -> None:
    """Level, part number and description in the place of names; properties as columns with units."""
    table = bom(
        "Level,Part number,Description,Quantity,Unit,Source,mass_kg,material\n"
        "0,A01-0001,Robot arm,1,ea,,,\n1,F01-0001,Hex bolt M4,12,ea,assembly,0.004,\n"
        "1,A01-0002,Gearbox,2,ea,assembly,,\n2,F01-0002,Gear,4,ea,assembly,,steel\n"
    )
    assert [row.name for row in table.rows] == ["Robot arm", "Hex bolt M4", "Gearbox", "Gear"]
    assert [row.parent for row in table.rows] == [None, 0, 0, 2]
    assert table["Hex bolt M4"].mass_kg == pytest.approx(0.004)
    assert table["Gear"].part_number == "F01-0002"
    assert table.total_quantity(table["Gear"]) == 8
    assert table.warnings == ()


def test_duplicate_names_keep_all_rows(bom: Callable[..., BomTable]) -> None:
    """The mapping never silently keeps the last row: all are beside it, with a warning and their lines."""
    table = bom("Item,Name,Mass,Material\n1,Part 1,1 kg,\n2,Part 1,2 kg,\n3,other,,steel\n")
    assert len(table) == 2
    assert [row.mass_kg for row in table.rows if row.name == "Part 1"] == [1, 2]
    assert table["Part 1"].mass_kg == 1
    (warning,) = table.warnings
    assert warning.code is BomCode.DUPLICATE_NAME
    assert "lines 2, 3" in warning.message


def test_names_with_commas_quotes_and_newlines(bom: Callable[..., BomTable]) -> None:
    """Case 33: what CSV quotes stays in the name; line numbers still fit."""
    table = bom('Name,Mass,Material\n"Bolt, 1/4"" x 2""",1 kg,\n"two\nlines",2 kg,\nx,oops,\n')
    assert list(table) == ['Bolt, 1/4" x 2"', "two\nlines", "x"]
    assert table.warnings[0].line == 5


def test_a_quote_that_is_never_closed_is_reported(bom: Callable[..., BomTable]) -> None:
    """It swallows the rows below it; that must not look like a short BOM."""
    with pytest.raises(InputError, match=r"line 3 cannot be read as CSV: its quotes do not match"):
        bom('Name,Material,Mass\nnut,steel,1 kg\n"bolt,steel,1 kg\npin,steel,1 kg\n')


def test_a_row_with_more_cells_than_the_header_is_refused(bom: Callable[..., BomTable]) -> None:
    """A comma without quotes shifts the columns: no cell of such a row can be trusted."""
    with pytest.raises(InputError) as error:
        bom("Name,Material,Mass\nBolt, long,steel,0.1 kg\nnut,steel,1 kg\nPin, x,steel,0.1 kg\n")
    assert [problem.partition(":")[0] for problem in error.value.problems] == ["line 2", "line 4"]


@pytest.mark.parametrize("data", [b"", b"\n\n", b"a,b\n1,2\n", bytes(range(256)), b"\x00\x01\x02" * 50])
def test_files_that_are_no_bom_are_one_plain_error(data: bytes) -> None:
    """Empty, without a header, or no text at all."""
    with pytest.raises(InputError, match=r"header line|quotes|no CSV"):
        BOMParser().parse_bytes(data, "x.csv")


def test_a_missing_file_is_a_plain_error(tmp_path: Path) -> None:
    """With the path and the reason."""
    with pytest.raises(InputError, match=r"none\.csv.*there is no such file"):
        BOMParser().parse(tmp_path / "none.csv")


@given(st.binary(max_size=400))
def test_no_bytes_raise_anything_else(data: bytes) -> None:
    """Whatever the file holds: a table, or an InputError."""
    try:
        BOMParser().parse_bytes(data)
    except InputError:
        pass


@given(st.lists(st.tuples(st.text(max_size=12), st.text(max_size=12), st.text(max_size=12)), max_size=8))
def test_no_cells_are_lost(rows: list[tuple[str, str, str]]) -> None:
    """Every row with a name is a row of the table, or a warning names its line."""
    import csv
    import io

    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow(["Name", "Material", "Mass"])
    writer.writerows(rows)
    data = out.getvalue().encode("utf-8", errors="replace")
    table = BOMParser(encoding="utf-8", delimiter=",").parse_bytes(data)
    named = [r for r in rows if r[0].strip("\0").strip() or any(c.strip("\0").strip() for c in r)]
    accounted = len(table.rows) + sum(w.code is BomCode.NO_NAME for w in table.warnings)
    repeated = sum(tuple(r) == ("Name", "Material", "Mass") for r in rows)
    # "g" below "Mass" is the second line of the header.
    second = [r for r in rows[:1] if not r[0].strip() and unit_factor(r[2].strip()) is not None]
    unmatched = any("quotes" in w.message for w in table.warnings)
    assert unmatched or accounted >= len(
        [r for r in named if any(c.isprintable() and c.strip() for c in r)]
    ) - repeated - len(second)


def test_the_servers_real_export_is_read() -> None:
    """What silo_server writes as CSV comes back, in both forms: odd names, structure, masses."""
    exports = pytest.importorskip("silo_server.services.product.export")
    export_files = pytest.importorskip("silo_server.services.product.export_files")
    common = {"Item type": "part", "Relation type": "component", "Source": "assembly"}
    rows = [
        {"Item": "1", "Level": 1, "Part number": "A01-0002", "Name": "Gearbox", "Quantity": 2.0, "Unit": "ea"}
        | {"Total quantity": 2, "Unit mass [kg]": 1.2, "Overall mass [kg]": 2.4, **common},
        {"Item": "1.1", "Level": 2, "Part number": "F01-0001", "Name": "=Bolt", "Quantity": 4.0}
        | {
            "Total quantity": 8,
            "Unit mass [kg]": 0.3,
            "Overall mass [kg]": 2.4,
            "Supplier": "Bolt & Co",
            **common,
        },
        {
            "Item": "2",
            "Level": 1,
            "Part number": "F01-0002",
            "Name": "Lid, red",
            "Quantity": 1.0,
            "Material": "PLA",
        }
        | {"Total quantity": 1, **common},
    ]
    for semicolons in (False, True):
        made = exports.Export(None, exports.View.INDENTED, iter(rows), ["Incomplete: A01-0001 1 missing"])
        export_files.to_csv(made, out := io.BytesIO(), semicolons=semicolons)
        table = BOMParser().parse_bytes(out.getvalue())
        assert [(r.name, r.part_number, r.quantity, r.level) for r in table.rows] == [
            ("Gearbox", "A01-0002", 2, 1),
            ("=Bolt", "F01-0001", 4, 2),
            ("Lid, red", "F01-0002", 1, 1),
        ]
        assert table["=Bolt"].mass_kg == pytest.approx(0.3)
        assert table["Gearbox"].mass_kg == pytest.approx(1.2)
        assert table["Lid, red"].material == "PLA"
        assert table.warnings == ()


@pytest.mark.parametrize(
    ("header", "found"),
    [
        ("POS-NR.;BENENNUNG;BESCHREIBUNG;MENGE;GEWICHT", "item name description quantity mass"),  # SolidWorks
        ("No. ARTICLE;NUMERO DE PIECE;QTE;MATERIAU;POIDS", "item part_number quantity material mass"),
        ("アイテム番号;部品番号;説明;数量;質量", "item part_number description quantity mass"),
        ("N. ARTICOLO;NUMERO PARTE;DESCRIZIONE;QTÀ", "item part_number description quantity"),
        ("Objekt;Bauteilnummer;ANZAHL;Material;Masse", "item part_number quantity material mass"),  # Inventor
        ("Article;N° de pièce;QTE unitaire;QTE;Masse", "item part_number - quantity mass"),
        ("Élément;Quantité;Numéro de pièce;Nom;Masse", "item quantity part_number name mass"),  # Onshape
        ("항목;수량;부품 번호;이름;질량", "item quantity part_number name mass"),
        ("BOM Line;Item ID;Item Name;Quantity;Mass", "- part_number name quantity mass"),  # Teamcenter
        ("Stufe;Komponentennummer;Objektkurztext;Nettogewicht", "level part_number name mass"),  # SAP
        ("Callout;Part Name;Qty;NX_Mass [kg];NX_Material", "- name quantity mass material"),
        (
            "PART NO.;PART;NO. REQ'D;MAT'L;WT. EA.;EXT. WT.",
            "part_number name quantity material mass total_mass",
        ),
        ("Reference;Value;Footprint;Qty;Designation", "- - - quantity name"),  # KiCad: R1, R2 is no number
    ],
)
def test_headers_of_cad_systems_are_known(header: str, found: str) -> None:
    cells = header.split(";")
    columns = find_columns(cells, MASSES)
    roles = {index: role for role, index in columns.at.items()}
    assert [str(roles.get(index, "-")) for index in range(len(cells))] == found.split()


def test_indented_names_are_a_structure() -> None:
    """Two levels by spaces; a stray space, or a jump over a level, is none."""
    head = "Name,Qty,Material,Mass (g)\n"
    table = BOMParser().parse_bytes(
        (head + "Arm,2,,\n  Plate,4,steel,2\n    Pin,3,steel,1\n  Bolt,1,steel,1\n").encode()
    )
    assert [row.parent for row in table.rows] == [None, 0, 1, 0]
    assert table.total_quantity(table.rows[2]) == 24
    assert ["indented" in warning.message for warning in table.warnings] == [True]
    for rows in ("Arm,2,,\n Plate,4,steel,2\n", "Arm,2,,\n  Plate,4,,\n      Pin,3,steel,1\n", "  Arm,1,,\n"):
        table = BOMParser().parse_bytes((head + rows).encode())
        assert {row.parent for row in table.rows} == {None}
        assert not table.warnings
    table = BOMParser().parse_bytes(b"Item,Name,Material,Mass (g)\n1,A,,\n1.1,  B,,\n2,  C,,\n")
    assert [row.parent for row in table.rows] == [None, 0, None]
    assert not table.warnings
