# SPDX-License-Identifier: LGPL-2.1-or-later
"""BOMs with more than one column of masses: nothing written in the file is dropped without a word."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from silo.inertia.bom import BomCode, BomTable

Bom = Callable[..., BomTable]


def codes(table: BomTable) -> list[BomCode]:
    return [warning.code for warning in table.warnings]


def test_a_total_is_divided_where_the_row_has_no_mass_of_one_piece(bom: Bom) -> None:
    """Row 2 has both, row 3 the total only: a quarter of it is the mass of one."""
    table = bom(
        "Name,Quantity,Material,Mass,Total mass (g)\n"
        "plate,1,,0.500 kg,500\nbolt,4,,,31.4\nclip,2,,No value,\n"
    )
    assert table["plate"].mass_kg == pytest.approx(0.5)
    assert table["bolt"].mass_kg == pytest.approx(0.0314 / 4)
    assert table["bolt"].quantum_kg == pytest.approx(0.00005 / 4)
    assert table["clip"].mass_kg is None
    assert codes(table) == []


def test_a_total_without_a_quantity_is_reported(bom: Bom) -> None:
    """Nothing to divide by: the mass is not used, and the line is named."""
    table = bom("Name,Material,Mass,Total mass\nplate,,0.5 kg,0.5 kg\nbolt,,,0.4 kg\n")
    assert table["bolt"].mass_kg is None
    assert [(w.code, w.line) for w in table.warnings] == [(BomCode.UNREADABLE_MASS, 3)]


def test_a_total_that_is_not_quantity_times_mass_is_reported(bom: Bom) -> None:
    """0.500 kg each, four of them, and 0.5 kg in total: one of the two columns is not what it says."""
    table = bom(
        "Name,Quantity,Material,Mass,Total mass\nplate,4,,0.500 kg,0.500 kg\nlid,2,,0.200 kg,0.400 kg\n"
    )
    assert table["plate"].mass_kg == pytest.approx(0.5)
    (warning,) = table.warnings
    assert (warning.code, warning.line) == (BomCode.TOTAL_DIFFERS, 2)
    assert "2 kg" in warning.message


def test_rounding_of_a_total_is_no_contradiction(bom: Bom) -> None:
    """3 × 0.0333 kg, shown as 0.033 kg and 0.100 kg."""
    table = bom("Name,Quantity,Material,Mass,Total mass\npin,3,,0.033 kg,0.100 kg\n")
    assert codes(table) == []


def test_a_second_column_that_means_the_same_is_reported_where_it_says_otherwise(bom: Bom) -> None:
    """ "Mass" is taken, and "Weight" is not dropped without a word where it holds something else."""
    same = bom("Name,Material,Mass,Weight\nplate,,0.5 kg,0.5 kg\n")
    assert codes(same) == []
    other = bom("Name,Material,Mass,Weight\nplate,,0.5 kg,0.5 kg\nlid,steel,,0.25 kg\n")
    (warning,) = other.warnings
    assert warning.code is BomCode.FILE
    assert "“Mass”" in warning.message
    assert "“Weight”" in warning.message
    assert "line 3" in warning.message
    named = bom("Name,Material,Mass,Weight\nlid,steel,,0.25 kg\n", columns={"mass": "Weight"})
    assert named["lid"].mass_kg == 0.25


@pytest.mark.parametrize("header", ["Material,Werkstoff", "Matériau,Material"])
def test_a_second_material_column_is_reported(bom: Bom, header: str) -> None:
    """The same for materials: another text in the other column is no silent loss."""
    table = bom(f"Name,Mass,{header}\nlid,,brass,steel\n")
    assert BomCode.FILE in codes(table)


@pytest.mark.parametrize("header", ["Qty,Quantity", "Menge,Anzahl", "Quantity (pcs),Quantity (m)"])
def test_a_second_quantity_column_is_reported(bom: Bom, header: str) -> None:
    """Totals are divided by it."""
    assert codes(bom(f"Name,Material,Total mass,{header}\nlid,steel,8 kg,4,4\n")) == []
    assert BomCode.FILE in codes(bom(f"Name,Material,Total mass,{header}\nlid,steel,8 kg,4,8\n"))


@pytest.mark.parametrize(("mark", "told"), [("\t", True), ("|", True), (";", True), (",", False)])
def test_a_lone_point_before_three_digits(bom: Bom, mark: str, told: bool) -> None:
    """ "1.234 kg" is reported where the delimiter does not tell the country: 1.2 kg here is 1.2 t there."""
    table = bom(mark.join(["Name", "Material", "Mass"]) + "\n" + mark.join(["lid", "", "1.234 kg"]) + "\n")
    assert (BomCode.AMBIGUOUS_MASS in codes(table)) is told


def test_dotted_levels_are_item_numbers(bom: Bom) -> None:
    """A column "Level" with 1, 1.1, 1.2 says what hangs below what, as item numbers do."""
    table = bom("Level,Name,Material,Mass\n1,arm,,1.0 kg\n1.1,bolt,,0.4 kg\n1.2,lid,,0.6 kg\n")
    assert table["arm"].has_children
    assert [row.parent for row in table.rows] == [None, 0, 0]
    assert [row.level for row in table.rows] == [1, 2, 2]


@pytest.mark.parametrize(
    "header",
    ["Mass (total)", "Total mass (kg)", "Weight [total] kg", "Masse (gesamt)", "Mass (extended)",
     "Gewicht, gesamt", "Total weight, kg", "Summe Masse", "質量（合計）", "总重量",
     "Mass (x qty)", "Mass (all)", "Mass (Qty)", "Mass x Qty", "Qty * Mass", "Mass (kg × Menge)",
     "Mass [all, kg]",
          "Weight (each × qty)", "Mass (Σ)", "Gewicht (ges.)", "Weight for all (kg)", "Poids (tous)",
     "Mass (lot)"],
)  # fmt: skip
def test_a_header_that_says_total_is_no_mass_of_one_piece(bom: Bom, header: str) -> None:
    """Wherever the word stands: half of the total is the mass of one of two."""
    table = bom(f'Name,Quantity,Material,"{header}"\nplate,2,,0.600 kg\n')
    assert table["plate"].mass_kg == pytest.approx(0.3)


@pytest.mark.parametrize(
    "header",
    [
        "Mass (unit)",
        "Mass (each)",
        "Unit mass (g)",
        "Masse in g",
        "Mass [g/pc]",
        "Mass (per piece)",
        "Mass, g each",
        "Weight ea. (lb)",
        "Mass (kg/unit)",
        "Gewicht pro Stück",
    ],
)
def test_a_header_that_says_each_is_that_of_one(bom: Bom, header: str) -> None:
    """Other words beside it do not make it a total."""
    assert bom(f"Name,Quantity,Material,{header}\nplate,2,,0.600 kg\n")["plate"].mass_kg == 0.6


@pytest.mark.parametrize("mass", ["1e300 kg", "1e13 kg", "99999999999999 kg"])
def test_a_mass_beyond_all_parts_is_reported(bom: Bom, mass: str) -> None:
    """Sums of it would not be finite; no part weighs a million million kilograms."""
    table = bom(f"Name,Material,Mass\nplate,,{mass}\n")
    assert table["plate"].mass_kg is None
    assert codes(table) == [BomCode.UNREADABLE_MASS]


@pytest.mark.parametrize(
    ("header", "unit_kg"),
    [
        ("Weight (oz.)", 0.45359237 / 16),
        ("Mass (each, g)", 1e-3),
        ("Mass [g/pc]", 1e-3),
        ("Mass [g / Stk]", 1e-3),
        ("Mass (each) [g]", 1e-3),
        ("Mass (g per piece)", 1e-3),
        ("Mass, g each", 1e-3),
        ("Weight ea. (lb)", 0.45359237),
        ("mass_g", 1e-3),
        ("Weight [lbf]", 0.45359237),
        ("Weight (N)", 1 / 9.80665),
        ("Weight (kgf)", 1.0),
        ("重量（ｇ）", 1e-3),
    ],
)
def test_the_unit_of_a_header(bom: Bom, header: str, unit_kg: float) -> None:
    """Read, and never with the word that there is none; a force is said to be one."""
    table = bom(f'Name,Quantity,Material,"{header}"\nplate,2,,3.0\n')
    assert table["plate"].mass_kg == pytest.approx(3 * unit_kg)
    forces = [w for w in table.warnings if "unit of force" in w.message]
    is_force = any(word in header for word in ("lbf", "(N)", "kgf"))
    assert len(table.warnings) == len(forces) == is_force


@pytest.mark.parametrize("header", ["Mass (kg/m)", "Mass [g/cm3]", "Mass (kg per metre)", "Weight (lb/ft)"])
def test_a_mass_per_length_is_no_mass(bom: Bom, header: str) -> None:
    """There is no mass column then, and that is said, with the columns that there are."""
    table = bom(f"Name,Quantity,Material,{header}\nrail,2,,3.0\n")
    assert table["rail"].mass_kg is None
    assert BomCode.MISSING_COLUMN in codes(table)


def test_a_bracket_that_is_not_understood(bom: Bom) -> None:
    """Read as kg, with the bracket in the warning; a unit in the cell needs no word."""
    table = bom("Name,Quantity,Material,Mass (ctw)\nplate,2,,3.0\n")
    (warning,) = table.warnings
    assert warning.code is BomCode.MASS_WITHOUT_UNIT
    assert "“ctw”" in warning.message
    assert codes(bom("Name,Quantity,Material,Mass (from CAD)\nplate,2,,3.0 g\n")) == []


@pytest.mark.parametrize(
    ("header", "kg"),
    [
        *(
            (h, 0.12)
            for h in ("Mass [kg/100 pcs]", "Mass per 100 (kg)", "Weight/100 (kg)", "Gew. kg pro 100")
        ),
        *((h, 0.012) for h in ("Gewicht/1000 Stk (kg)", "mass_g", "Weight g/pc", "Mass/g", "Mass/unit (g)")),
        *(
            (h, 12)
            for h in ("Net weight (kg)", "Nettogewicht kg", "unitMassKg", "CAD mass [kg]", "单件重量(kg)")
        ),
        *(
            (h, 3)
            for h in ("totalMassKg", "Ges.Gew. [kg]", "Overall mass (kg)", "ΣMass kg", "Mass per assy (kg)")
        ),
    ],
)
def test_what_a_header_says_of_its_masses(bom: Bom, header: str, kg: float) -> None:
    """12 in the cell of four pieces: by unit, by pieces, by one or all."""
    table = bom(f"Name,Qty,Material,{header}\nbolt,4,steel,12\n")
    assert table["bolt"].mass_kg == pytest.approx(kg)
    assert table["bolt"].quantum_kg == pytest.approx(kg / 24)  # of half a unit in twelve
    assert codes(table) == []


@pytest.mark.parametrize(
    "inner",
    ["10^-3 kg", "e-3 kg", "x10 g", "kg x 1000", "kg·10³", "%", "kg/m", "g/cm3", "4x", "kg per metre"],
)
def test_a_header_that_is_no_mass_is_not_taken_for_one(bom: Bom, inner: str) -> None:
    """A power, a percentage, a rate: the column is missing, and by the user's own word it is in doubt."""
    text = f"Name,Qty,Material,Mass ({inner})\nbolt,4,steel,12\n"
    assert bom(text)["bolt"].mass_kg is None
    assert codes(bom(text)) == [BomCode.MISSING_COLUMN]
    forced = bom(text, columns={"mass": f"Mass ({inner})"})
    assert any("is no mass by its header" in w.message for w in forced.warnings)


def test_a_mass_of_two_readings_is_marked(bom: Bom) -> None:
    """1234 or 1.234: used by the likelier mark, reported, and never pushed."""
    table = bom('Name,Material,Mass\na,,"1,234 kg"\n')
    assert (table["a"].mass_kg, table["a"].unsure) == (1234, True)
    assert codes(table) == [BomCode.AMBIGUOUS_MASS]


@pytest.mark.parametrize("text", ["-1", "as required", "0.5 m", "1/2", "4+1", "x4", "~4", "2 sets"])
def test_a_quantity_that_is_no_count_is_reported(bom: Bom, text: str) -> None:
    """It is not used: a total mass has nothing to be divided by then."""
    table = bom(f'Name,Qty,Material,Total mass (kg)\na,"{text}",,4\n')
    assert (table["a"].quantity, table["a"].mass_kg) == (None, None)
    assert BomCode.UNREADABLE_QUANTITY in codes(table)


def test_a_column_of_units_is_read(bom: Bom) -> None:
    """As SAP exports it; a unit that is none leaves the mass unread, with the line."""
    table = bom("Name,Qty,Material,Weight,Weight unit\na,1,,12,G\nb,1,,2,KG\nc,1,,2,PCS\n")
    assert [row.mass_kg for row in table.rows] == [pytest.approx(0.012), 2.0, None]
    assert [(w.code, w.line) for w in table.warnings] == [(BomCode.UNREADABLE_MASS, 4)]


@pytest.mark.parametrize(
    "text",
    [
        "Name,Qty,Mass,Material\n,[pcs],[g],[-]\nbolt,4,3,\n",
        "Name,Qty,Mass,,Material\n,,each (g),total (g),\nbolt,4,3,12,\n",
        "Name,Qty,Mass,,Material\n,,total (g),each (g),\nbolt,4,12,3,\n",
    ],
)
def test_the_second_line_of_a_header_counts(bom: Bom, text: str) -> None:
    """Units or "each" and "total" below a merged cell."""
    table = bom(text)
    assert [(row.name, row.mass_kg) for row in table.rows] == [("bolt", pytest.approx(0.003))]
    assert codes(table) == []


@pytest.mark.parametrize(
    ("row", "code"),
    [(",,see drawing,", BomCode.NO_NAME), (",4,g,", BomCode.NO_NAME), ("nut,,g,", BomCode.UNREADABLE_MASS)],
)
def test_a_row_is_no_second_line_of_the_header(bom: Bom, row: str, code: BomCode) -> None:
    """With a name, with a number, or without a unit: a row that cannot be used, and is reported as such."""
    table = bom(f"Name,Qty,Mass (g),Material\n{row}\nbolt,4,3,\n")
    assert codes(table) == [code]


STRUCTURED = "Level,Name,Qty,Material,{}\n0,arm,2,,,\n.1,motor,3,,{}\n"


def test_a_total_below_a_parent_that_stands_twice_is_in_doubt(bom: Bom) -> None:
    """Six motors of 0.1 kg: 0.6 kg in the product, 0.3 kg in one arm. The number alone does not say which."""
    table = bom(STRUCTURED.format("Total mass (kg)", "0.6"))
    motor = table["motor"]
    assert (motor.parent, motor.unsure) == (0, True)
    assert codes(table) == [BomCode.AMBIGUOUS_MASS]
    once = bom(STRUCTURED.format("Total mass (kg)", "0.3").replace("arm,2", "arm,1"))
    assert (once["motor"].unsure, codes(once)) == (False, [])


@pytest.mark.parametrize("total", ["0.3", "0.6"])
def test_a_total_of_the_parent_or_of_the_product_agrees(bom: Bom, total: str) -> None:
    """Silo's own export gives the mass in the whole product."""
    table = bom(STRUCTURED.format("Mass (kg),Total mass (kg)", f"0.100,{total}"))
    assert codes(table) == []
    assert codes(bom(STRUCTURED.format("Mass (kg),Total mass (kg)", "0.100,0.9"))) == [BomCode.TOTAL_DIFFERS]


@pytest.mark.parametrize("marks", [(".1", "..2"), ("+1", "++2"), (" 1", " 2"), ("1.", "2."), (">1", ">>2")])
def test_levels_are_read_as_they_are_drawn(bom: Bom, marks: tuple[str, str]) -> None:
    """With dots, plus signs or arrows in front."""
    table = bom(f"Level,Name,Qty,Material,Mass (g)\n0,top,1,,\n{marks[0]},a,1,,1\n{marks[1]},b,1,,1\n")
    assert [row.parent for row in table.rows] == [None, 0, 1]
    assert codes(table) == []


def test_a_level_that_cannot_be_read_is_reported(bom: Bom) -> None:
    """The row stands at the top then, and the quantities above it are not multiplied."""
    table = bom("Level,Name,Qty,Material,Mass (g)\n0,top,1,,\nsub,a,1,,1\n")
    assert [(w.code, w.line) for w in table.warnings] == [(BomCode.FILE, 3)]
