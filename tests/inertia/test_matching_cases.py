# SPDX-License-Identifier: LGPL-2.1-or-later
"""Cases 23 to 32 of the fact sheet: parts and BOM rows, and what is said where they do not fit."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from bodies import box, shape_only

from silo.inertia.report import Decided, Rule, Source

HEAD = "Item,Quantity,Part number,Material,Mass,Name\n"
V = 1e-6  # of a cube of 1 cm
Fixture = Callable[..., Any]


def cube(name: str, size: float = 0.01, **more: Any) -> Any:
    """A cube of ``size``; the key may be given, for different products of one name."""
    return box(name, size, size, size, **more)


def masses(report: Any) -> dict[str, float]:
    """Prototype volume in cm³ (rounded) → mass of one piece."""
    return {f"{part.volume * 1e6:.3g}": pytest.approx(part.mass) for _, part in report.parts()}


def test_case_23_duplicates_kept_apart_by_quantity(
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


def test_case_24_duplicates_kept_apart_by_mass(assemble: Fixture, compute: Fixture, codes: Fixture) -> None:
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
    """Nothing distinguishes them: in order of appearance, and both parts carry the warning."""
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


def test_duplicates_kept_apart_by_parent(assemble: Fixture, compute: Fixture, codes: Fixture) -> None:
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
    """A bought motor: one row with a mass, two parts in the geometry. By volume, and reported."""
    rotor, stator = cube("rotor", 0.01), cube("stator", 0.02)
    asm = assemble(("arm/motor/rotor", rotor), ("arm/motor/stator", stator))
    report = compute(asm, HEAD + "1,1,,,9.00 g,motor\n")
    assert part(report, "rotor").mass == pytest.approx(0.001)
    assert part(report, "stator").mass == pytest.approx(0.008)
    assert part(report, "rotor").source is Source.SUB_ASSEMBLY_MASS
    assert part(report, "rotor").rule is Rule.SUB_ASSEMBLY
    assert codes(report) == ["sub_assembly_mass_shared"] * 2


def test_a_sub_assembly_mass_that_its_known_parts_use_up_leaves_the_others_alone(
    assemble: Fixture, compute: Fixture, part: Fixture
) -> None:
    """A rotor with a row of its own weighs as much as the motor: that says nothing of the case."""
    asm = assemble(("arm/motor/rotor", cube("rotor")), ("arm/motor/case", cube("case", 0.02)))
    report = compute(asm, HEAD + "1,1,,,0.900 kg,motor\n2,1,,,0.900 kg,rotor\n")
    assert part(report, "case").source is Source.DEFAULT_DENSITY


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
    """The geometry's pieces are counted, and the difference is reported with both numbers."""
    asm = assemble(*((f"l/b{i}", cube("bolt")) for i in range(3)))
    report = compute(asm, HEAD + "1,4,,steel,,bolt\n")
    assert report.total.mass == pytest.approx(3 * 7850 * V)
    (warning,) = report.warnings
    assert warning.code == "count_differs"
    assert "4" in warning.message
    assert "3" in warning.message


def test_a_row_too_many_of_a_name_is_reported_as_such(
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
    from silo.inertia.masses import Options

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


def test_case_30_zero_kg_is_reported(
    assemble: Fixture, compute: Fixture, part: Fixture, codes: Fixture
) -> None:
    """ "0 kg" is a mass by the rule where no material says more."""
    report = compute(
        assemble(("l/a", cube("a")), ("l/b", cube("b"))), HEAD + "1,1,,,0 kg,a\n2,1,,,0.125 kg,b\n"
    )
    assert part(report, "a").mass == 0
    assert codes(report, "a") == ["bom_zero_mass"]
    assert "0.0005" in report.warnings[0].message


@pytest.mark.parametrize(
    ("size", "mass", "kg", "code", "words"),
    [
        (0.003, "0 kg", 0.21195e-3, "bom_zero_mass", "shows ± 0.0005 kg only"),
        (0.01, "0 kg", 7.85e-3, "bom_zero_mass", "Was the mass set to zero?"),
        (0.1, "0 kg", 7.85, "mass_implausible", "Was the mass set to zero?"),
        (0.1, "0 kg*", 0.0, "bom_zero_mass", "was set to 0"),
    ],
)
def test_zero_kg_of_a_known_material(
    assemble: Fixture,
    compute: Fixture,
    part: Fixture,
    codes: Fixture,
    size: float,
    mass: str,
    kg: float,
    code: str,
    words: str,
) -> None:
    """Less than the BOM shows is not nothing: the material's mass, warned; a zero set by hand is kept."""
    asm = assemble(("l/a", cube("a", size)), ("l/b", cube("b")))
    report = compute(asm, HEAD + f"1,1,,steel,{mass},a\n2,1,,,0.125 kg,b\n")
    assert part(report, "a").mass == pytest.approx(kg)
    assert codes(report, "a") == [code]
    assert words in report.warnings[0].message


def test_zero_kg_of_a_material_that_is_not_known(
    assemble: Fixture, compute: Fixture, part: Fixture, codes: Fixture
) -> None:
    """A default density is no better than the BOM's zero."""
    report = compute(assemble(("l/a", cube("a"))), HEAD + "1,1,,unobtainium,0 kg,a\n")
    assert part(report, "a").mass == 0
    assert codes(report, "a") == ["bom_zero_mass"]


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
    """0.008 kg ± 0.0005 fits 0.00785 kg of steel; only the rounding is reported."""
    report = compute(assemble(("l/a", cube("a"))), HEAD + "1,1,,steel,0.008 kg,a\n")
    assert codes(report) == ["mass_rounded"]


def test_case_32_row_total_instead_of_unit_mass(assemble: Fixture, compute: Fixture, codes: Fixture) -> None:
    """Four times what the material gives, and the quantity is four: it looks like the row's total."""
    asm = assemble(*((f"l/b{i}", cube("b", 0.1)) for i in range(4)))
    report = compute(asm, HEAD + "1,4,,steel,31.4 kg,b\n")
    assert codes(report) == ["row_total"]
    assert "4 times" in report.warnings[0].message


def test_different_shapes_with_one_mass_under_two_spellings(
    assemble: Fixture, compute: Fixture, codes: Fixture
) -> None:
    """The row is matched exactly by one, by its other spelling by the other: neither is sure."""
    asm = assemble(("l/a", cube("bolt")), ("l/b", cube("Bolt", 0.02)), ("l/c", cube("bolt (2)")))
    report = compute(asm, HEAD + "1,3,,,2.70 g,bolt\n")
    assert all("ambiguous" in codes(report, name) for name in ("bolt", "Bolt", "bolt (2)"))
    same = assemble(("l/a", cube("bolt")), ("l/b", cube("Bolt")))
    assert codes(compute(same, HEAD + "1,2,,,2.70 g,bolt\n")) == []


@pytest.mark.parametrize(
    ("product", "row"), [("gear 1:5", "gear 1:10"), ("cover (2)", "cover (3)"), ("leg <1>", "leg <2>")]
)
def test_of_two_different_marks_neither_is_an_occurrence(
    assemble: Fixture, compute: Fixture, codes: Fixture, product: str, row: str
) -> None:
    """A ratio or a running number tells parts apart."""
    report = compute(assemble(("l/a", cube(product))), HEAD + f"1,1,,,2.70 g,{row}\n")
    assert set(codes(report)) == {"not_in_bom", "row_unused"}


def test_a_mass_that_fits_two_rows_is_settled_by_the_quantity(
    assemble: Fixture, compute: Fixture, codes: Fixture
) -> None:
    """Both rows fit the small cube's mass; only one has as many pieces as the file."""
    small, large = cube("b", key="small"), cube("b", 0.02, key="large")
    asm = assemble(*((f"l/{s.key}{i}", s) for s in (small, large) for i in range(2)))
    report = compute(asm, HEAD + "1,5,,steel,7.86 g,b\n2,2,,steel,7.85 g,b\n")
    (found,) = [p for _, p in report.parts() if p.products == ("small",)]
    assert (found.mass, found.decided_by) == (pytest.approx(7.85e-3), Decided.MASS)


def test_a_surface_beside_a_solid_of_another_spelling_has_no_shape_to_compare(
    assemble: Fixture, compute: Fixture, codes: Fixture
) -> None:
    report = compute(
        assemble(("l/a", cube("bolt")), ("k/b", shape_only("Bolt"))), HEAD + "1,2,,,2.70 g,bolt\n"
    )
    assert "ambiguous" not in codes(report)


def test_two_parts_of_one_count_are_not_told_apart_by_it(assemble: Fixture, compute: Fixture) -> None:
    """Each has two pieces, one row says two: the mass decides, not the order of appearance."""
    large, small = cube("b", 0.02, key="large"), cube("b", key="small")
    asm = assemble(*((f"l/{s.key}{i}", s) for s in (large, small) for i in range(2)))
    report = compute(asm, HEAD + "1,2,,steel,7.85 g,b\n2,3,,steel,62.80 g,b\n")
    masses = {p.products: p.mass for _, p in report.parts()}
    assert masses == {("large",): pytest.approx(62.8e-3), ("small",): pytest.approx(7.85e-3)}


@pytest.mark.parametrize(
    "evidence", [{}, {"c": 6, "d": 3}, {"c": 6}], ids=["no evidence", "contradicting evidence", "per parent"]
)
def test_quantities_of_a_structured_bom_are_read_both_ways_unless_other_parts_agree(
    assemble: Fixture, compute: Fixture, codes: Fixture, evidence: dict[str, int]
) -> None:
    """Two arms with 3 large and 1 small "b" each: the file has 6 and 2, which the row's quantity is not."""
    counts = {cube("b", 0.02, key="large"): 6, cube("b", key="small"): 2}
    counts |= {cube(name, 0.03): pieces for name, pieces in evidence.items()}
    asm = assemble(*((f"arm/{p.key}{i}", p) for p, pieces in counts.items() for i in range(pieces)))
    rows = "".join(f"1.{number},3,,steel,,{name}\n" for number, name in enumerate(evidence, start=3))
    report = compute(asm, HEAD + f"1,2,,,,arm\n1.1,1,,,2.00 g,b\n1.2,3,,,9.00 g,b\n{rows}")
    masses = {p.products: p.mass for _, p in report.parts() if p.name == "b"}
    assert masses == {("large",): pytest.approx(9e-3), ("small",): pytest.approx(2e-3)}
    assert "ambiguous" not in codes(report)


@pytest.mark.parametrize(
    ("witness", "more", "room"), [(3, 2, False), (3, 0, True), (6, 2, True), (6, 4, True), (6, 5, False)]
)
def test_a_used_row_takes_another_spelling_as_far_as_its_quantity_goes(
    assemble: Fixture, compute: Fixture, codes: Fixture, witness: int, more: int, room: bool
) -> None:
    """Two arms, 4 bolts by the row: 4 in all if the witness's 3 pieces are those of the row, else 8."""
    counts = {cube("bolt"): 4, cube("Bolt", key="other"): more, cube("witness"): witness}
    asm = assemble(*((f"arm/{p.key}{i}", p) for p, pieces in counts.items() for i in range(pieces)))
    report = compute(asm, HEAD + "1,2,,,,arm\n1.1,4,,steel,,bolt\n1.2,3,,steel,,witness\n")
    assert ("not_in_bom" not in codes(report, "Bolt")) == room
