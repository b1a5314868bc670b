# SPDX-License-Identifier: LGPL-2.1-or-later
"""BOMs with more than one column of masses: nothing written in the file is dropped without a word."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from silo.inertia.bom.table import BomCode, BomTable

Bom = Callable[..., BomTable]


def codes(table: BomTable) -> list[BomCode]:
    return [warning.code for warning in table.warnings]


# What stands in the file → name: [kg], and the codes and lines of all warnings.
CASES = {
    "a total is divided if the row has no mass of one piece": (
        "Name,Quantity,Material,Mass,Total mass (g)\nplate,1,,0.500 kg,500\nbolt,4,,,31.4\nclip,2,,?,\n",
        {"plate": 0.5, "bolt": 0.0314 / 4, "clip": None}, [],
    ),
    "a total without a quantity": (
        "Name,Material,Mass,Total mass\nplate,,0.5 kg,0.5 kg\nbolt,,,0.4 kg\n",
        {"plate": 0.5, "bolt": None}, [(BomCode.UNREADABLE_MASS, 3)],
    ),
    "a total that is not quantity times mass": (
        "Name,Quantity,Material,Mass,Total mass\nplate,4,,0.500 kg,0.500 kg\nlid,2,,0.200 kg,0.400 kg\n",
        {"plate": 0.5, "lid": 0.2}, [(BomCode.TOTAL_DIFFERS, 2)],
    ),
    "rounding is no contradiction: three times 0.0333 kg": (
        "Name,Quantity,Material,Mass,Total mass\npin,3,,0.033 kg,0.100 kg\n", {"pin": 0.033}, [],
    ),
    **{
        f"a second column of materials: {heads}": (
            f"Name,Mass,{heads}\nlid,,brass,steel\n", {"lid": None}, [(BomCode.FILE, 1)]
        )
        for heads in ("Material,Werkstoff", "Matériau,Material")
    },
    **{
        f"a second column of quantities: {heads}, {second}": (
            f"Name,Material,Total mass,{heads}\nlid,steel,8 kg,4,{second}\n",
            {"lid": 8 / (second if heads == "Qty,Quantity" else 4)},
            [(BomCode.FILE, 1)] * (second == 8),
        )
        for heads in ("Qty,Quantity", "Menge,Anzahl", "Quantity (pcs),Quantity (m)")
        for second in (4, 8)
    },
    **{
        f"1.234 kg between {mark!r}: 1.2 kg here is 1.2 t there": (
            f"Name{mark}Material{mark}Mass\nlid{mark}{mark}1.234 kg\n",
            {"lid": 1234 if mark == ";" else 1.234},
            [(BomCode.AMBIGUOUS_MASS, 2)] * (mark != ","),
        )
        for mark in "\t|;,"
    },
    **{
        f"no part weighs {mass}": (
            f"Name,Material,Mass\nplate,,{mass}\n", {"plate": None}, [(BomCode.UNREADABLE_MASS, 2)]
        )
        for mass in ("1e300 kg", "1e13 kg", "99999999999999 kg")
    },
    "a bracket that nobody understands": (
        "Name,Material,Mass (ctw)\nplate,,3.0\n", {"plate": 3}, [(BomCode.MASS_WITHOUT_UNIT, 2)]
    ),
    "such a bracket beside a unit": ("Name,Material,Mass (from CAD)\nlid,,3 g\n", {"lid": 0.003}, []),
    **{
        f"a quantity that is no count: {text}": (
            f'Name,Qty,Material,Total mass (kg)\na,"{text}",,4\n', {"a": None},
            [(BomCode.UNREADABLE_QUANTITY, 2), (BomCode.UNREADABLE_MASS, 2)],
        )
        for text in ("-1", "as required", "0.5 m", "1/2", "4+1", "x4", "~4", "2 sets")
    },
    "a column of units": (
        "Name,Qty,Material,Weight,Weight unit\na,1,,12,G\nb,1,,2,KG\nc,1,,2,PCS\n",
        {"a": 0.012, "b": 2, "c": None}, [(BomCode.UNREADABLE_MASS, 4)],
    ),
    **{
        f"units, each and total below the header: {text[:34]}": (text, {"bolt": 0.003}, [])
        for text in (
            "Name,Qty,Mass,Material\n,[pcs],[g],[-]\nbolt,4,3,\n",
            "Name,Qty,Mass,,Material\n,,each (g),total (g),\nbolt,4,3,12,\n",
            "Name,Qty,Mass,,Material\n,,total (g),each (g),\nbolt,4,12,3,\n",
        )
    },
    **{
        f"no second line of the header: {row}": (
            f"Name,Qty,Mass (g),Material\n{row}\nbolt,4,3,\n", kg | {"bolt": 0.003}, [(code, 2)]
        )
        for row, kg, code in (
            (",,see drawing,", {}, BomCode.NO_NAME), (",4,g,", {}, BomCode.NO_NAME),
            ("nut,,g,", {"nut": None}, BomCode.UNREADABLE_MASS),
        )
    },
    "a level that nobody can read stands at the top": (
        "Level,Name,Qty,Material,Mass (g)\n0,top,1,,\nsub,a,1,,1\n", {"top": None, "a": 0.001},
        [(BomCode.FILE, 3)],
    ),
    "a mass without any unit is kg, reported once": (
        "Name,Material,Mass\na,steel,0.3\nb,steel,0.4\n", {"a": 0.3, "b": 0.4},
        [(BomCode.MASS_WITHOUT_UNIT, 2)],
    ),
    "a mass that is no number": (
        "Name,Material,Mass\na,steel,0.3 kg\nb,steel,heavy\n", {"a": 0.3, "b": None},
        [(BomCode.UNREADABLE_MASS, 3)],
    ),
    "points in all masses are no doubt": (
        "Name,Mass,Material\na,1.234 kg,\nb,2.345 kg,\n", {"a": 1.234, "b": 2.345}, []
    ),
    "a row that ends early": ("Name,Material,Mass\nnut,steel\n", {"nut": None}, [(BomCode.ROW_LENGTH, 2)]),
    "a sum and what is not fitted": (
        "Name,Material,Qty,DNP,Mass\nnut,steel,1,no,1 kg\npin,steel,1,ja,1 kg\nSumme,,2,,2 kg\n", {"nut": 1},
        [(BomCode.LEFT_OUT, 3), (BomCode.LEFT_OUT, 4)],
    ),
    "a total at the bottom is no part": (
        "Name,Material,Mass\nnut,steel,1 kg\n,,7 kg\n", {"nut": 1}, [(BomCode.NO_NAME, 3)]
    ),
    "a total mass alone": (
        "Name,Material,Quantity,Total mass\nnut,,4,2 kg\nbolt,,,1 kg\n", {"nut": 0.5, "bolt": None},
        [(BomCode.UNREADABLE_MASS, 3)],
    ),
    "two rows with the same data": ("Item,Name,Mass,Material\n1,bolt,1 kg,\n2,bolt,1 kg,\n", {"bolt": 1}, []),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_masses_and_warnings_of_a_sheet(bom: Bom, case: str) -> None:
    """Nothing is dropped in silence, and nothing is reported that is plain."""
    text, kg, warnings = CASES[case]
    table = bom(text)
    assert {row.name: row.mass_kg for row in table.rows} == pytest.approx(kg)
    assert [(warning.code, warning.line) for warning in table.warnings] == warnings


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


def test_dotted_levels_are_item_numbers(bom: Bom) -> None:
    """A column "Level" with 1, 1.1, 1.2 says what hangs below what, as item numbers do."""
    table = bom("Level,Name,Material,Mass\n1,arm,,1.0 kg\n1.1,bolt,,0.4 kg\n1.2,lid,,0.6 kg\n")
    assert table["arm"].has_children
    assert [row.parent for row in table.rows] == [None, 0, 0]
    assert [row.level for row in table.rows] == [1, 2, 2]


TOTALS = """Mass (total)|Total mass (kg)|Weight [total] kg|Masse (gesamt)|Mass (extended)|Gewicht, gesamt|
    Total weight, kg|Summe Masse|質量（合計）|总重量|Mass (x qty)|Mass (all)|Mass (Qty)|Mass x Qty|Qty * Mass|
    Mass (kg × Menge)|Mass [all, kg]|Weight (each × qty)|Mass (Σ)|Gewicht (ges.)|Weight for all (kg)|
    Poids (tous)|Mass (lot)"""
EACH = """Mass (unit)|Mass (each)|Unit mass (g)|Masse in g|Mass [g/pc]|Mass (per piece)|Mass, g each|
    Weight ea. (lb)|Mass (kg/unit)|Gewicht pro Stück"""


@pytest.mark.parametrize(
    ("header", "kg"),
    [(header.strip(), kg) for headers, kg in ((TOTALS, 0.3), (EACH, 0.6)) for header in headers.split("|")],
)
def test_a_header_says_whether_a_mass_is_of_the_row_or_of_one_piece(bom: Bom, header: str, kg: float) -> None:
    """Wherever the word stands: half of the total is the mass of one of two."""
    table = bom(f'Name,Quantity,Material,"{header}"\nplate,2,,0.600 kg\n')
    assert table["plate"].mass_kg == pytest.approx(kg)


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


@pytest.mark.parametrize(
    ("header", "kg"),
    [
        *((h, 0.012) for h in ("mass_g", "Weight g/pc", "Mass/g", "Mass/unit (g)", "[g]", "(g/pc)")),
        *(
            (h, 12)
            for h in ("Net weight (kg)", "Nettogewicht kg", "unitMassKg", "CAD mass [kg]", "单件重量(kg)",
                      "SW-Mass (kg)", "PRO_MP_MASS [kg]", "kg", "kg/pc", "Kg per piece")
        ),
        *(
            (h, 3)
            for h in ("totalMassKg", "Ges.Gew. [kg]", "Overall mass (kg)", "ΣMass kg", "Mass per assy (kg)",
                      "Posgewicht (kg)", "Pos.-Gewicht [kg]", "Sum of mass (kg)", "Summe von Masse [kg]",
                      "Total kg", "Total [kg]", "kg total")
        ),
        ("Weight [lbmass]", 12 * 0.45359237),
    ],
)  # fmt: skip
def test_what_a_header_says_of_its_masses(bom: Bom, header: str, kg: float) -> None:
    """12 in the cell of four pieces: by unit, by pieces, by one or all."""
    table = bom(f"Name,Qty,Material,{header}\nbolt,4,steel,12\n")
    assert table["bolt"].mass_kg == pytest.approx(kg)
    assert table["bolt"].quantum_kg == pytest.approx(kg / 24)  # of half a unit in twelve
    assert codes(table) == []


@pytest.mark.parametrize(
    "inner",
    [
        "10^-3 kg",
        "e-3 kg",
        "x10 g",
        "kg x 1000",
        "kg·10³",
        "%",
        "kg/m",
        "g/cm3",
        "4x",
        "kg per metre",
        "lb/ft",
    ],
)
def test_a_header_that_is_no_mass_is_not_taken_for_one(bom: Bom, inner: str) -> None:
    """A power, a percentage, a rate: the column is missing, and by the user's own word it is in doubt."""
    text = f"Name,Qty,Material,Mass ({inner})\nbolt,4,steel,12\n"
    assert bom(text)["bolt"].mass_kg is None
    assert codes(bom(text)) == [BomCode.MISSING_COLUMN]
    forced = bom(text, columns={"mass": f"Mass ({inner})"})
    assert any("is no mass by its header" in w.message for w in forced.warnings)


@pytest.mark.parametrize(
    "header", ["Mass [kg/100 pcs]", "Mass per 100 (kg)", "Weight/100 (kg)", "Gewicht/1000 Stk (kg)"]
)
def test_the_mass_of_a_hundred_pieces_is_refused_by_its_name(bom: Bom, header: str) -> None:
    """With no other mass column, and beside one."""
    table = bom(f"Name,Qty,Material,{header}\nbolt,4,steel,12\n")
    assert table["bolt"].mass_kg is None
    assert [(w.code, header in w.message) for w in table.warnings] == [(BomCode.MISSING_COLUMN, True)]
    table = bom(f"Name,Qty,Material,Mass (kg),{header}\nbolt,4,steel,0.12,12\n")
    assert table["bolt"].mass_kg == 0.12
    (warning,) = table.warnings
    assert warning.code is BomCode.UNUSED_COLUMN
    assert warning.message == f"the column “{header}” holds no masses of one piece, and was not used"


@pytest.mark.parametrize(
    ("header", "cell", "named"),
    [
        *(
            (h, "3", True)
            for h in ("Finished weight", "Rohgewicht [kg]", "Blank (kg)", "Payload kg", "仕上重量")
        ),
        *((h, "3", False) for h in ("Thickness (t)", "Belongs to", "T", "Force [N]", "Price")),
        *(("Finished weight", cell, False) for cell in ("", "see drawing", "No value")),
    ],
)
def test_a_column_that_may_hold_masses_and_is_not_used_is_named(
    bom: Bom, header: str, cell: str, named: bool
) -> None:
    """By a word or a unit of its header, if one of its cells is a mass."""
    table = bom(f"Name,Material,Estimated mass (kg),{header}\nlid,steel,2,{cell}\n")
    assert table["lid"].mass_kg == 2
    assert [w.code for w in table.warnings] == [BomCode.UNUSED_COLUMN] * named
    assert all(
        f"“{header}”" in w.message and f'--column "mass={header}"' in w.message for w in table.warnings
    )
    without = bom(f"Name,Material,{header}\nlid,steel,{cell}\n").warnings[0]
    assert without.message.endswith(f'--column "mass={header if named else "…"}"')


@pytest.mark.parametrize(
    ("header", "units", "kg", "words"),
    [
        ("Mass", "gg", 0.003, "was read as the unit of the masses"),
        ("Mass", "g", 0.003, "was read as the unit of the masses"),
        ("Mass", ["g", "pcs"], 3, "read as the unit of the quantities"),
        ("Mass", ["pcs", "pcs"], 3, None),
        ("Mass (kg)", "gg", 3, None),
        ("Mass,Mass unit", ["g,kg", "g,kg"], 3, None),
    ],
)
def test_a_column_unit_is_that_of_the_masses_if_it_has_no_other_units(
    bom: Bom, header: str, units: list[str], kg: float, words: str | None
) -> None:
    head, unit, *more = [*header.partition(",")[:1], "Unit", *header.split(",")[1:]]
    rows = "".join(f"part {index},1,steel,3,{one}\n" for index, one in enumerate(units))
    table = bom(f"Name,Qty,Material,{','.join([head, unit, *more])}\n{rows}")
    assert table["part 0"].mass_kg == pytest.approx(kg)
    notes = [w.message for w in table.warnings if w.code is BomCode.FILE]
    assert [words in note for note in notes] == ([True] if words else [])


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
