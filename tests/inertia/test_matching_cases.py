# SPDX-License-Identifier: LGPL-2.1-or-later
"""Cases 23 to 35 of the fact sheet: parts and BOM rows, and what is said where they do not fit."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from silo.inertia.bodies import box, shape_only
from silo.inertia.codes import Decided, Rule, Source

HEAD = "Item,Quantity,Part number,Material,Mass,Name\n"
V = 1e-6  # of a cube of 1 cm
Fixture = Callable[..., Any]


def cube(name: str, size: float = 0.01, **more: Any) -> Any:
    """A cube of ``size``; the key may be given, for different products of one name."""
    return box(name, size, size, size, **more)


def masses(report: Any) -> dict[str, float]:
    """Prototype volume in cm³ (rounded) → mass of one piece."""
    return {f"{part.volume * 1e6:.3g}": pytest.approx(part.mass) for _, part in report.parts()}


def test_case_23_duplicates_told_apart_by_quantity(
    assemble: Fixture, compute: Fixture, codes: Fixture
) -> None:
    """Two "Part 1", one placed twice, one three times: the quantities decide, and nothing is doubtful."""
    a, b = cube("Part 1", 0.01, key="a"), cube("Part 1", 0.02, key="b")
    asm = assemble(*((f"l/a{i}", a) for i in range(2)), *((f"l/b{i}", b) for i in range(3)))
    report = compute(asm, HEAD + "1,3,,,5.000 g,Part 1\n2,2,,,2.000 g,Part 1\n")
    assert masses(report) == {"1": 0.002, "8": 0.005}
    assert {part.decided_by for _, part in report.parts()} == {Decided.QUANTITY}
    assert report.total.mass == pytest.approx(2 * 0.002 + 3 * 0.005)
    assert codes(report) == ["bom_duplicate_name"]


def test_case_24_duplicates_told_apart_by_mass(assemble: Fixture, compute: Fixture, codes: Fixture) -> None:
    """Equal quantities: the row whose material times this volume gives its mass is the right one."""
    a, b = cube("Part 1", 0.01, key="a"), cube("Part 1", 0.02, key="b")
    asm = assemble(("l/a", a), ("l/b", b))
    report = compute(asm, HEAD + "1,1,,steel,0.0628 kg,Part 1\n2,1,,aluminum,0.0027 kg,Part 1\n")
    assert masses(report) == {"1": 0.0027, "8": 0.0628}
    assert all(part.decided_by in (Decided.MASS, Decided.REMAINING) for _, part in report.parts())
    assert "ambiguous" not in codes(report)


def test_case_25_undecidable_duplicates_are_ambiguous(
    assemble: Fixture, compute: Fixture, codes: Fixture
) -> None:
    """Nothing tells them apart: in order of appearance, and both parts carry the warning."""
    a, b = cube("Part 1", 0.01, key="a"), cube("Part 1", 0.02, key="b")
    report = compute(
        assemble(("l/a", a), ("l/b", b)), HEAD + "1,1,,,0.1000 kg,Part 1\n2,1,,,0.2000 kg,Part 1\n"
    )
    assert masses(report) == {"1": 0.1, "8": 0.2}
    assert codes(report, "Part 1").count("ambiguous") == 2
    assert {part.decided_by for _, part in report.parts()} == {Decided.ORDER}


def test_the_real_duplicate_case_of_onshape(assemble: Fixture, compute: Fixture) -> None:
    """xy_gantry: five products "Part 1", fourteen instances, five rows; the sum is that of the rows."""
    products = [cube("Part 1", 0.01 * (i + 1), key=str(i)) for i in range(5)]
    counts, each = [1, 2, 3, 4, 4], [0.1, 0.2, 0.3, 0.4, 0.5]
    placed = [(f"l/{i}-{k}", products[i]) for i in range(5) for k in range(counts[i])]
    rows = "".join(f"{i},{counts[i]},,,{each[i]:.4f} kg,Part 1\n" for i in range(5))
    report = compute(assemble(*placed), HEAD + rows)
    assert report.total.mass == pytest.approx(sum(c * m for c, m in zip(counts, each, strict=True)))


def test_duplicates_told_apart_by_parent(assemble: Fixture, compute: Fixture, codes: Fixture) -> None:
    """In a structured BOM the row's parent is the sub-assembly around the part."""
    a, b = cube("Part 1", 0.01, key="a"), cube("Part 1", 0.02, key="b")
    asm = assemble(("arm/p", a), ("leg/p", b))
    report = compute(
        asm,
        HEAD + "1,1,,,,leg\n1.1,1,,,8.00 g,Part 1\n2,1,,,,arm\n2.1,1,,,1.00 g,Part 1\n",
    )
    assert masses(report) == {"1": 0.001, "8": 0.008}
    assert {part.decided_by for _, part in report.parts()} == {Decided.PARENT}
    assert codes(report) == ["bom_duplicate_name"]


def test_one_row_for_several_shapes_is_doubtful(assemble: Fixture, compute: Fixture, codes: Fixture) -> None:
    """One mass for parts that differ in size is said to be so; one material is no doubt."""
    a, b = cube("Part 1", 0.01, key="a"), cube("Part 1", 0.02, key="b")
    asm = assemble(("l/a", a), ("l/b", b))
    assert "ambiguous" in codes(compute(asm, HEAD + "1,2,,,0.1000 kg,Part 1\n"))
    assert codes(compute(asm, HEAD + "1,2,,steel,,Part 1\n")) == []


def test_one_row_whose_quantity_is_that_of_one_shape(
    assemble: Fixture, compute: Fixture, codes: Fixture
) -> None:
    """The row is that part's; the other is not in the BOM, and said to be."""
    a, b = cube("Part 1", 0.01, key="a"), cube("Part 1", 0.02, key="b")
    asm = assemble(("l/a", a), ("l/b0", b), ("l/b1", b))
    report = compute(asm, HEAD + "1,1,,,0.1000 kg,Part 1\n")
    assert masses(report) == {"1": 0.1, "8": 0.008}
    assert "not_in_bom" in codes(report)


def test_case_26_structured_bom_never_adds_a_mass_twice(
    assemble: Fixture, compute: Fixture, codes: Fixture
) -> None:
    """1.1.2 with masses at every level: the parts count, the sub-assembly rows are compared."""
    bolt, pin = cube("bolt"), cube("pin", 0.02)
    asm = assemble(
        *((f"arm/joint/bolt{i}", bolt, None, "arm/joint/bolt") for i in range(2)),
        ("arm/joint/pin", pin, None, "arm/joint/pin"),
    )
    rows = "1,1,,,0.5 kg,arm\n1.1,1,,,0.5 kg,joint\n1.1.1,2,,,0.1 kg,bolt\n1.1.2,1,,,0.3 kg,pin\n"
    report = compute(asm, HEAD + rows)
    assert report.total.mass == pytest.approx(0.5)
    assert "sub_assembly_mass_differs" not in codes(report)
    wrong = compute(asm, HEAD + rows.replace("0.5 kg,joint", "0.9 kg,joint"))
    assert wrong.total.mass == pytest.approx(0.5)
    assert codes(wrong).count("sub_assembly_mass_differs") == 1


def test_sub_assembly_mass_is_spread_where_its_parts_have_none(
    assemble: Fixture, compute: Fixture, part: Fixture, codes: Fixture
) -> None:
    """A bought motor: one row with a mass, two parts in the geometry. By volume, and told."""
    rotor, stator = cube("rotor", 0.01), cube("stator", 0.02)
    asm = assemble(("arm/motor/rotor", rotor), ("arm/motor/stator", stator))
    report = compute(asm, HEAD + "1,1,,,9.00 g,motor\n")
    assert part(report, "rotor").mass == pytest.approx(0.001)
    assert part(report, "stator").mass == pytest.approx(0.008)
    assert part(report, "rotor").source is Source.SUB_ASSEMBLY_MASS
    assert part(report, "rotor").rule is Rule.SUB_ASSEMBLY
    assert codes(report) == ["sub_assembly_mass_shared"] * 2


def test_sub_assembly_mass_is_used_per_occurrence(assemble: Fixture, compute: Fixture) -> None:
    """Two motors weigh twice as much as one."""
    rotor = cube("rotor")
    asm = assemble(
        *((f"arm/motor{i}/rotor{k}", rotor, None, "arm/motor/rotor") for i in range(2) for k in range(3))
    )
    report = compute(asm, HEAD + "1,2,,,0.900 kg,motor\n")
    assert report.total.mass == pytest.approx(1.8)


def test_rows_without_data_below_a_row_with_a_mass(
    assemble: Fixture, compute: Fixture, codes: Fixture
) -> None:
    """The parts have rows, but with nothing in them: the sub-assembly's mass is used, not zero."""
    asm = assemble(("arm/motor/rotor", cube("rotor")), ("arm/motor/case", cube("case", 0.02)))
    report = compute(asm, HEAD + "1,1,,,0.9 kg,motor\n1.1,1,,,,rotor\n1.2,1,,,No value,case\n")
    assert report.total.mass == pytest.approx(0.9)
    assert "no_mass_no_material" not in codes(report)


def test_sub_assembly_material_stands_for_parts_that_the_bom_lacks(
    assemble: Fixture, compute: Fixture, part: Fixture, codes: Fixture
) -> None:
    """A printed sub-assembly of several bodies that is one row with a material."""
    asm = assemble(("arm/print/a", cube("body a")), ("arm/print/b", cube("body b")), ("arm/nut", cube("nut")))
    report = compute(asm, HEAD + "1,1,,PLA,,print\n2,1,,steel,,nut\n")
    assert part(report, "body a").mass == pytest.approx(1250 * V)
    assert part(report, "nut").mass == pytest.approx(7850 * V)
    assert codes(report) == []


def test_case_27_quantity_differs_from_count(assemble: Fixture, compute: Fixture, codes: Fixture) -> None:
    """The geometry's pieces are counted, and the difference is told with both numbers."""
    asm = assemble(*((f"l/b{i}", cube("bolt")) for i in range(3)))
    report = compute(asm, HEAD + "1,4,,steel,,bolt\n")
    assert report.total.mass == pytest.approx(3 * 7850 * V)
    (warning,) = report.warnings
    assert warning.code == "count_differs"
    assert "4" in warning.message
    assert "3" in warning.message


def test_a_row_too_many_of_a_name_is_told_as_such(
    assemble: Fixture, compute: Fixture, codes: Fixture
) -> None:
    """Two rows "Part 1", one part: the other row's warning does not say that there is no such part."""
    report = compute(assemble(("l/a", cube("Part 1"))), HEAD + "1,1,,steel,,Part 1\n2,3,,brass,,Part 1\n")
    (left,) = [w for w in report.warnings if w.code == "row_unused"]
    assert "all parts of this name belong to other rows" in left.message


def test_case_28_row_without_geometry(assemble: Fixture, compute: Fixture, codes: Fixture) -> None:
    """Glue has a row and no shape: named, and not counted."""
    report = compute(assemble(("l/a", cube("a"))), HEAD + "1,1,,steel,,a\n2,1,,,0.02 kg,glue\n")
    assert report.total.mass == pytest.approx(7850 * V)
    assert codes(report, "glue") == ["row_unused"]


def test_case_29_part_absent_from_the_bom(
    assemble: Fixture, compute: Fixture, part: Fixture, codes: Fixture
) -> None:
    """Default density and a warning that proposes, but does not take, a near name."""
    report = compute(
        assemble(("l/a", cube("Hexbolt M4"))), HEAD + "1,1,,steel,,Hex bolt M4\n", options=_options(1234.0)
    )
    found = part(report, "Hexbolt M4")
    assert (found.source, found.rule) == (Source.DEFAULT_DENSITY, Rule.NONE)
    assert found.mass == pytest.approx(1234 * V)
    assert "which has “Hex bolt M4”" in report.warnings[0].message
    assert codes(report) == ["not_in_bom", "row_unused"]


def _options(density: float, **more: Any) -> Any:
    from silo.inertia.massrule import Options

    return Options(density, **more)


@pytest.mark.parametrize("mass", ["", "No value", "- None -", "Kein Wert", "値なし"])
def test_case_30_no_value_is_zero_with_a_warning(
    assemble: Fixture, compute: Fixture, part: Fixture, codes: Fixture, mass: str
) -> None:
    """In the BOM with neither mass nor material: zero, said so; not the default density."""
    report = compute(
        assemble(("l/a", cube("a")), ("l/b", cube("b"))), HEAD + f"1,1,,- None -,{mass},a\n2,1,,steel,,b\n"
    )
    assert part(report, "a").mass == 0
    assert part(report, "a").source is Source.ZERO
    assert codes(report) == ["no_mass_no_material"]


def test_case_30_zero_kg_is_told(assemble: Fixture, compute: Fixture, part: Fixture, codes: Fixture) -> None:
    """ "0 kg" is a mass by the rule, and stands for tiny parts as well as for zeroed ones."""
    report = compute(
        assemble(("l/a", cube("a")), ("l/b", cube("b"))), HEAD + "1,1,,steel,0 kg,a\n2,1,,,0.125 kg,b\n"
    )
    assert part(report, "a").mass == 0
    assert codes(report, "a") == ["bom_zero_mass"]
    assert "0.0005" in report.warnings[0].message


def test_case_31_mass_and_material_that_disagree(assemble: Fixture, compute: Fixture, part: Fixture) -> None:
    """The BOM's mass wins; the warning has both figures."""
    report = compute(assemble(("l/a", cube("a", 0.1))), HEAD + "1,1,,steel,2.700 kg,a\n")
    assert part(report, "a").mass == pytest.approx(2.7)
    (warning,) = report.warnings
    assert warning.code == "mass_differs"
    assert "7.85 kg" in warning.message


def test_mass_and_material_that_agree_within_the_quantum(
    assemble: Fixture, compute: Fixture, codes: Fixture
) -> None:
    """0.008 kg ± 0.0005 fits 0.00785 kg of steel; only the rounding is told."""
    report = compute(assemble(("l/a", cube("a"))), HEAD + "1,1,,steel,0.008 kg,a\n")
    assert codes(report) == ["mass_rounded"]


def test_case_32_row_total_instead_of_unit_mass(assemble: Fixture, compute: Fixture, codes: Fixture) -> None:
    """Four times what the material gives, and the quantity is four: it looks like the row's total."""
    asm = assemble(*((f"l/b{i}", cube("b", 0.1)) for i in range(4)))
    report = compute(asm, HEAD + "1,4,,steel,31.4 kg,b\n")
    assert codes(report) == ["row_total"]
    assert "4 times" in report.warnings[0].message


@pytest.mark.parametrize(
    ("product", "row", "rule"),
    [
        ("Bolt, long", '"Bolt, long"', Rule.EXACT),
        ('1/4" nut', '"1/4"" nut"', Rule.EXACT),
        ("two\nlines", '"two\nlines"', Rule.EXACT),
        ("BALL_JHA17.step_10", "BALL_JHA17.step_10", Rule.EXACT),
        ("arm ", "arm", Rule.NORMALISED),
        ("Hex_bolt-M4", "hex bolt M4", Rule.NORMALISED),
        ("Pe\u00e7a", "Pec\u0327a", Rule.NORMALISED),
        ("Bolt <2>", "Bolt", Rule.NORMALISED),
        ("Bolt (1)", "Bolt", Rule.NORMALISED),
        ("Bolt:3", "Bolt", Rule.NORMALISED),
        ("Servo? 3", "Servo™ 3", Rule.WILDCARD),
        ("Pe\ufffda", "Peça", Rule.WILDCARD),
        ("Peça", "Pe\ufffda", Rule.WILDCARD),
    ],
)
def test_case_33_names(
    assemble: Fixture, compute: Fixture, part: Fixture, codes: Fixture, product: str, row: str, rule: Rule
) -> None:
    """Each odd name finds its row, and the report says by which rule."""
    report = compute(assemble(("l/x", cube(product))), HEAD + f"1,1,,steel,,{row}\n")
    assert part(report, product).rule is rule
    assert codes(report) == []


@pytest.mark.parametrize(
    ("product", "row"),
    [
        ("forearm", "arm"),
        ("arm", "forearm"),
        ("alarm", "arm"),
        ("M3x100", "M3x10"),
        ("M3x10", "M3x12"),
        ("bracket_2", "bracket"),
        ("bracket", "bracket_2"),
        ("base_link", "base"),
    ],
)
def test_case_34_never_by_substring(
    assemble: Fixture, compute: Fixture, part: Fixture, product: str, row: str
) -> None:
    """A name inside another is another part."""
    report = compute(assemble(("l/x", cube(product))), HEAD + f"1,1,,,5.000 kg,{row}\n")
    assert part(report, product).rule is Rule.NONE
    assert part(report, product).mass == pytest.approx(1000 * V)


def test_case_34_bracket_and_bracket_2_side_by_side(
    assemble: Fixture, compute: Fixture, part: Fixture
) -> None:
    """Both get their own mass."""
    asm = assemble(("l/a", cube("bracket")), ("l/b", cube("bracket_2")))
    report = compute(asm, HEAD + "1,1,,,0.200 kg,bracket_2\n2,1,,,0.100 kg,bracket\n")
    assert part(report, "bracket").mass == pytest.approx(0.1)
    assert part(report, "bracket_2").mass == pytest.approx(0.2)


def test_an_occurrence_mark_does_not_take_a_used_row(
    assemble: Fixture, compute: Fixture, part: Fixture
) -> None:
    """ "Plate (2)" is not "Plate" where the row "Plate" is already that of another product."""
    asm = assemble(("l/a", cube("Plate")), ("l/b", cube("Plate (2)", 0.02)))
    report = compute(asm, HEAD + "1,1,,,0.100 kg,Plate\n")
    assert part(report, "Plate").mass == pytest.approx(0.1)
    assert part(report, "Plate (2)").rule is Rule.NONE


def test_part_number_tier(assemble: Fixture, compute: Fixture, part: Fixture) -> None:
    """By the number in the file, or where the product is named by its number."""
    asm = assemble(("l/a", cube("F01-0001")), ("l/b", cube("anything", part_number="F01-0002")))
    report = compute(asm, HEAD + "1,1,F01-0001,steel,,Hex bolt\n2,1,F01-0002,PLA,,Cover\n")
    assert part(report, "F01-0001").mass == pytest.approx(7850 * V)
    assert part(report, "anything").mass == pytest.approx(1250 * V)
    assert {p.rule for _, p in report.parts()} == {Rule.PART_NUMBER}


@pytest.mark.parametrize(
    ("material", "density", "code"),
    [
        ("Aluminum - 6061", 2700, None),
        ("PCB FR4", 1850, None),
        ("Unobtainium", 1000, "unknown_material"),
        ("Default", 1000, "unknown_material"),
    ],
)
def test_case_35_materials_in_a_report(
    assemble: Fixture,
    compute: Fixture,
    part: Fixture,
    codes: Fixture,
    material: str,
    density: float,
    code: str | None,
) -> None:
    """An understood material needs no word; another gets the default density and a warning."""
    report = compute(assemble(("l/x", cube("x"))), HEAD + f"1,1,,{material},,x\n")
    assert part(report, "x").mass == pytest.approx(density * V)
    assert codes(report) == ([code] if code else [])


def test_several_solids_share_their_rows_mass(assemble: Fixture, compute: Fixture, part: Fixture) -> None:
    """One row, one product, two bodies: the mass is spread by volume, the centre is that of both."""
    from silo.inertia.model import Prototype, SolidProps

    unit = np.eye(3)
    product = Prototype(
        "p",
        "p",
        (SolidProps(1e-6, [0, 0, 0], unit * 1e-11), SolidProps(3e-6, [0.04, 0, 0], unit * 1e-10)),
        4e-6,
        np.array([0.03, 0, 0]),
        unit * 2e-9,
    )
    report = compute(assemble(("l/p", product)), HEAD + "1,1,,,0.400 kg,p\n")
    assert report.links["l"].props.com == pytest.approx([0.03, 0, 0])
    assert report.links["l"].props.inertia == pytest.approx(unit * 2e-9 * 1e5)


def test_no_solid_with_a_mass_is_a_point(
    assemble: Fixture, compute: Fixture, codes: Fixture, at: Fixture
) -> None:
    """Case 13: the geometry is missing, the BOM has the mass: a point, flagged twice over."""
    asm = assemble(("l/x", shape_only("x"), at(1, 2, 3)))
    report = compute(asm, HEAD + "1,1,,,0.400 kg,x\n")
    assert report.links["l"].props.mass == pytest.approx(0.4)
    assert report.links["l"].props.com == pytest.approx([1, 2, 3])
    assert codes(report) == ["point_mass", "bad_tensor"]


def test_no_solid_with_a_material_is_zero(assemble: Fixture, compute: Fixture, codes: Fixture) -> None:
    """No volume to multiply with: zero, told, and the link without mass as well."""
    report = compute(assemble(("l/x", shape_only("x"))), HEAD + "1,1,,steel,,x\n")
    assert codes(report) == ["no_volume", "zero_mass_link"]


def test_a_wire_beside_its_solid_is_one_part(assemble: Fixture, compute: Fixture, codes: Fixture) -> None:
    """Case 4: a product written as a SOLID and a wire COMPOUND is one part of the BOM, not two."""
    solid, wire = cube("plate", key="s"), shape_only("plate", key="w")
    report = compute(
        assemble(("l/1", solid, None, "l/plate"), ("l/2", wire, None, "l/plate")),
        HEAD + "1,1,,,1.00 g,plate\n",
    )
    assert report.total.mass == pytest.approx(0.001)
    assert codes(report) == []


def test_step_density_is_compared_and_used_only_when_asked(
    assemble: Fixture, compute: Fixture, part: Fixture, codes: Fixture
) -> None:
    """Never above the BOM; before the default where the user says so."""
    product = cube("x", step_density=7850.0, step_material="Steel")
    asm = assemble(("l/x", product))
    assert codes(compute(asm, HEAD + "1,1,,PLA,,x\n")) == ["step_density_differs"]
    assert codes(compute(asm, HEAD + "1,1,,steel,,x\n")) == []
    plain = compute(asm, HEAD + "1,1,,steel,,other\n")
    assert part(plain, "x").mass == pytest.approx(1000 * V)
    assert "7850" in plain.warnings[0].message
    asked = compute(asm, HEAD + "1,1,,steel,,other\n", options=_options(1000.0, step_density=True))
    assert part(asked, "x").source is Source.STEP_DENSITY
    assert part(asked, "x").mass == pytest.approx(7850 * V)
    assert codes(asked, "x") == ["not_in_bom"]


def test_a_named_material_of_the_file_gets_the_tables_density(
    assemble: Fixture, compute: Fixture, part: Fixture, codes: Fixture
) -> None:
    """Without a BOM the file's material is what there is."""
    asm = assemble(("l/x", cube("x", step_material="Brass")))
    report = compute(asm, None, options=_options(1000.0, step_density=True))
    assert part(report, "x").mass == pytest.approx(8500 * V)
    assert codes(report) == []


def test_without_a_bom(assemble: Fixture, compute: Fixture, codes: Fixture) -> None:
    """Default density throughout, and each part says so."""
    report = compute(assemble(("l/x", cube("x")), ("l/y", cube("y"))), None)
    assert report.total.mass == pytest.approx(2000 * V)
    assert codes(report) == ["no_bom", "no_bom"]


def test_reader_problems_reach_the_report(assemble: Fixture, compute: Fixture) -> None:
    """What the geometry reader noticed stands with link, part and code."""
    from silo.inertia.model import GeometryCode, GeometryProblem

    product = cube("x", problems=(GeometryProblem(GeometryCode.NEGATIVE_VOLUME, "was inside out"),))
    asm = assemble(("l/x", product), problems=(GeometryProblem(GeometryCode.UNITS, "no unit stated"),))
    report = compute(asm, HEAD + "1,1,,steel,,x\n")
    assert [(w.link_name, w.part_name, str(w.code)) for w in report.warnings] == [
        ("", "", "units"),
        ("l", "x", "negative_volume"),
    ]


def test_scaled_placement_is_exact_and_told(assemble: Fixture, compute: Fixture, codes: Fixture) -> None:
    """Case 14: by material the scaled volume counts; a mirror needs no word."""
    asm = assemble(("l/x", cube("x"), np.diag([2.0, 2, 2, 1])), ("l/y", cube("y"), np.diag([-1.0, 1, 1, 1])))
    report = compute(asm, HEAD + "1,1,,steel,,x\n2,1,,steel,,y\n")
    assert report.total.mass == pytest.approx(9 * 7850 * V)
    assert codes(report) == ["scaled"]


def test_a_row_without_children_stands_for_what_is_listed_nowhere(
    assemble: Fixture, compute: Fixture, part: Fixture, codes: Fixture
) -> None:
    """A bolt in the motor has a row of its own; the rest of the motor's mass is the rotor's."""
    asm = assemble(("arm/motor/rotor", cube("rotor", 0.02)), ("arm/motor/bolt", cube("bolt")))
    report = compute(asm, HEAD + "1,1,,,90.0 g,motor\n2,1,,,10.0 g,bolt\n")
    assert part(report, "rotor").mass == pytest.approx(0.08)
    assert part(report, "bolt").mass == pytest.approx(0.01)
    assert codes(report, "rotor") == ["sub_assembly_mass_shared"]


def test_a_mass_without_any_solid_is_spread_evenly_and_told(
    assemble: Fixture, compute: Fixture, part: Fixture, at: Fixture
) -> None:
    """A bought unit of which the file has no solid at all."""
    asm = assemble(("arm/unit/a", shape_only("a"), at(0, 0, 0)), ("arm/unit/b", shape_only("b"), at(1, 0, 0)))
    report = compute(asm, HEAD + "1,1,,,0.800 kg,unit\n")
    assert part(report, "a").mass == pytest.approx(0.4)
    assert report.links["arm"].props.com == pytest.approx([0.5, 0, 0])
    assert "as points" in report.warnings[0].message


def test_the_order_of_sub_assemblies_does_not_matter(assemble: Fixture, compute: Fixture) -> None:
    """The innermost row with a mass wins; the outer one is then compared."""
    asm = assemble(("arm/unit/motor/rotor", cube("rotor")), ("arm/unit/case", cube("case")))
    rows = "1,1,,,2.000 kg,unit\n1.1,1,,,0.900 kg,motor\n1.2,1,,,1.100 kg,case\n"
    report = compute(asm, HEAD + rows)
    assert report.total.mass == pytest.approx(2.0)


def test_a_sub_assemblys_material_on_a_part_without_a_solid(
    assemble: Fixture, compute: Fixture, part: Fixture, codes: Fixture
) -> None:
    """The row around it has a material, the part no volume: zero, and told."""
    asm = assemble(("arm/print/a", cube("a")), ("arm/print/wires", shape_only("wires")))
    report = compute(asm, HEAD + "1,1,,PLA,,print\n")
    assert part(report, "wires").mass == 0
    assert codes(report) == ["no_volume"]
