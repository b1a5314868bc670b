# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where a mass comes from when there is no solid, no BOM, no row, or a density in the file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from bodies import box, shape_only

from silo.inertia.report import Source

HEAD = "Item,Quantity,Part number,Material,Mass,Name\n"
V = 1e-6  # of a cube of 1 cm
Fixture = Callable[..., Any]


def cube(name: str, size: float = 0.01, **more: Any) -> Any:
    """A cube of ``size``; the key may be given, for different products of one name."""
    return box(name, size, size, size, **more)


def _options(density: float, **more: Any) -> Any:
    from silo.inertia.masses import Options

    return Options(density, **more)


def test_several_solids_share_their_rows_mass(assemble: Fixture, compute: Fixture, part: Fixture) -> None:
    """One row, one product, two bodies: the mass is spread by volume, the centre is that of both."""
    from silo.inertia.geometry.measured import Measured
    from silo.inertia.model import SolidProps

    unit = np.eye(3)
    solids = (SolidProps(1e-6, [0, 0, 0], unit * 1e-10), SolidProps(3e-6, [0.04, 0, 0], unit * 1e-10))
    product = Measured(solids, (), None, True).prototype("p", "p")
    apart = np.diag([0, 1.2e-9, 1.2e-9])  # 1e-6 * 3e-6 / 4e-6 * 0.04², across x
    report = compute(assemble(("l/p", product)), HEAD + "1,1,,,0.400 kg,p\n")
    assert report.links["l"].props.com == pytest.approx([0.03, 0, 0])
    assert report.links["l"].props.inertia == pytest.approx((unit * 2e-10 + apart) * 1e5)


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


@pytest.mark.parametrize(
    ("stated", "density", "told"),
    [
        ({"step_material": "Brass"}, 8500, []),
        ({"step_material": "Brass", "step_density": 8400.0}, 8400, []),
        ({"step_material": "tin can"}, 1000, ["no_bom"]),  # it may be a can
        ({"step_material": "unobtainium"}, 1000, ["no_bom"]),
    ],
)
def test_a_named_material_of_the_file_gets_the_tables_density(
    assemble: Fixture,
    compute: Fixture,
    part: Fixture,
    codes: Fixture,
    stated: dict[str, Any],
    density: float,
    told: list[str],
) -> None:
    """Without a BOM the file's material is what there is, if it is understood without doubt."""
    asm = assemble(("l/x", cube("x", **stated)))
    report = compute(asm, None, options=_options(1000.0, step_density=True))
    assert part(report, "x").mass == pytest.approx(density * V)
    assert codes(report) == told


def test_without_a_bom(assemble: Fixture, compute: Fixture, codes: Fixture) -> None:
    """Default density throughout, and each part says so."""
    report = compute(assemble(("l/x", cube("x")), ("l/y", cube("y"))), None)
    assert report.total.mass == pytest.approx(2000 * V)
    assert codes(report) == ["no_bom", "no_bom"]


def test_reader_problems_reach_the_report(assemble: Fixture, compute: Fixture) -> None:
    """What the geometry reader noticed stands with link, part and code."""
    from silo.inertia.model import GeometryCode, Note

    product = cube("x", problems=(Note(GeometryCode.NEGATIVE_VOLUME, "was inside out"),))
    asm = assemble(("l/x", product), problems=(Note(GeometryCode.UNITS, "no unit stated"),))
    report = compute(asm, HEAD + "1,1,,steel,,x\n")
    assert [(w.link_name, w.part_name, str(w.code)) for w in report.warnings] == [
        ("", "", "units"),
        ("l", "x", "negative_volume"),
    ]


def test_scaled_placement_is_exact_and_reported(assemble: Fixture, compute: Fixture, codes: Fixture) -> None:
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


def test_a_mass_without_any_solid_is_spread_evenly_and_reported(
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


def test_the_inner_of_two_sub_assemblies_gives_its_mass_first(assemble: Fixture, compute: Fixture) -> None:
    """The outer one shares what is left among the parts of its own."""
    asm = assemble(("outer/inner/a", cube("a")), ("outer/b", cube("b")))
    report = compute(asm, HEAD + "1,1,,,3 kg,outer\n2,1,,,1 kg,inner\n")
    masses = {part.name: part.mass for link in report.links.values() for part in link.parts}
    assert masses == pytest.approx({"a": 1.0, "b": 2.0})


def test_a_sub_assemblys_material_on_a_part_without_a_solid(
    assemble: Fixture, compute: Fixture, part: Fixture, codes: Fixture
) -> None:
    """The row around it has a material, the part no volume: zero, and reported."""
    asm = assemble(("arm/print/a", cube("a")), ("arm/print/wires", shape_only("wires")))
    report = compute(asm, HEAD + "1,1,,PLA,,print\n")
    assert part(report, "wires").mass == 0
    assert codes(report) == ["no_volume"]


def test_a_material_that_varies_says_so_and_by_how_much(
    assemble: Fixture, compute: Fixture, codes: Fixture, part: Fixture
) -> None:
    """Boards of EPS have 10 to 30 kg/m³: the mass is ± 50 %, and a mass within that contradicts nothing."""
    asm = assemble(("l/a", cube("a", 0.1)), ("l/b", cube("b", 0.1)), ("l/c", cube("c", 0.1)))
    report = compute(asm, HEAD + "1,1,,EPS,,a\n2,1,,EPS,0.0280 kg,b\n3,1,,steel,7.85 kg,c\n")
    assert part(report, "a").quantum == pytest.approx(0.5 * 0.02)
    assert codes(report) == ["density_varies"]
    assert "± 50%" in report.warnings[0].message
    assert part(report, "c").quantum < 0.01
    report = compute(asm, HEAD + "1,1,,EPS,0.045 kg,a\n2,1,,steel,7.85 kg,b\n3,1,,steel,7.85 kg,c\n")
    assert codes(report) == ["mass_differs"]


@pytest.mark.parametrize(("mass", "doubted"), [("7.85 g", True), ("2.7 g", True), ("15 g", False)])
def test_grams_for_kilograms_are_doubted_without_a_material(
    assemble: Fixture, compute: Fixture, codes: Fixture, mass: str, doubted: bool
) -> None:
    """A litre of steel or aluminium by 1000 too light; a litre of foam is not."""
    report = compute(assemble(("l/a", cube("a", 0.1))), HEAD + f"1,1,,,{mass},a\n")
    assert ("mass_implausible" in codes(report)) is doubted


def test_a_guessed_or_varying_material_of_a_sub_assembly_is_reported(
    assemble: Fixture, compute: Fixture, codes: Fixture
) -> None:
    """What holds for the material of a part holds for that of the sub-assembly around it."""
    from silo.inertia.links import link_map

    asm = assemble(("arm/a", cube("a")))
    one = link_map({"links": {"l": ["arm"]}})
    for material, code in (("tin can", "material_guessed"), ("EPS", "density_varies")):
        report = compute(asm, HEAD + f"1,1,P-7,{material},,arm\n", links=one)
        assert codes(report, "a") == [code]
        assert report.links["l"].parts[0].part_number == ""


def test_each_part_under_a_row_with_a_varying_material_has_its_own_uncertainty(
    assemble: Fixture, compute: Fixture, part: Fixture
) -> None:
    """Two parts that the BOM does not have: ± 50 % of each, and not of the first for both."""
    asm = assemble(("arm/large", cube("large", 0.1)), ("arm/small", cube("small")))
    report = compute(asm, HEAD + "1,1,P-7,EPS,,arm\n")
    for name in ("large", "small"):
        assert part(report, name).quantum == pytest.approx(0.5 * part(report, name).mass)


def test_pieces_of_a_varying_material_that_are_alike_are_one_part(
    assemble: Fixture, compute: Fixture
) -> None:
    """An exporter writes each rubber foot as a product of its own, with the rounding of its place."""
    feet = [(f"l/foot{n}", cube("foot", 0.01 * (1 + n * 1e-13), key=f"foot{n}")) for n in range(4)]
    report = compute(assemble(*feet), HEAD + "1,4,,rubber,,foot\n")
    assert [one.quantity for one in report.links["l"].parts] == [4]


def test_a_stated_density_within_what_the_material_varies_by_is_no_contradiction(
    assemble: Fixture, compute: Fixture, codes: Fixture
) -> None:
    """EPS of 28 kg/m³ is EPS; of 60 it is something else."""
    for stated, wanted in ((28.0, ["density_varies"]), (60.0, ["density_varies", "step_density_differs"])):
        asm = assemble(("l/a", cube("a", 0.1, step_density=stated)))
        assert codes(compute(asm, HEAD + "1,1,,EPS,,a\n")) == wanted


def test_a_part_whose_own_row_says_nothing_gets_no_material_from_around_it(
    assemble: Fixture, compute: Fixture, part: Fixture, codes: Fixture
) -> None:
    """A row around it stands for the parts that have no row themselves."""
    asm = assemble(("arm/print/a", cube("a")), ("arm/print/b", cube("b")))
    report = compute(asm, HEAD + "1,1,,PLA,,print\n2,1,,,,b\n")
    assert part(report, "a").mass == pytest.approx(1250 * V)
    assert (part(report, "b").mass, codes(report, "b")) == (0.0, ["no_mass_no_material"])


def test_where_parts_disagree_about_quantities_either_reading_holds(
    assemble: Fixture, compute: Fixture, codes: Fixture
) -> None:
    """Two arms with three bolts each, and four pins in all: one row counts per parent, the other in all."""
    bolts = [(f"arm{i % 2}/bolt{i}", cube("bolt"), None, "arm/bolt") for i in range(6)]
    pins = [(f"arm{i % 2}/pin{i}", cube("pin", 0.02), None, "arm/pin") for i in range(4)]
    report = compute(assemble(*bolts, *pins), HEAD + "1,2,,,,arm\n1.1,3,,,1.0 g,bolt\n1.2,4,,,2.0 g,pin\n")
    assert "count_differs" not in codes(report)


def test_of_two_shapes_of_one_name_the_row_is_that_of_the_one_that_weighs_it(
    assemble: Fixture, compute: Fixture, part: Fixture
) -> None:
    """One piece, and both shapes are there once; the mass of steel fits the small one only."""
    asm = assemble(("l/x", cube("x", key="small")), ("l/y", cube("x", 0.03, key="large")))
    report = compute(asm, HEAD + "1,1,,steel,7.85 g,x\n")
    masses = {p.paths[0]: (p.mass, str(p.decided_by)) for _, p in report.parts()}
    assert masses["l/x"] == (pytest.approx(7850 * V), "mass")
    assert masses["l/y"] == (pytest.approx(27 * 1000 * V), "only")  # not in the BOM


def test_a_mass_in_another_unit_is_in_doubt_also_where_the_material_is_known(
    assemble: Fixture, compute: Fixture, codes: Fixture
) -> None:
    """Only what is in doubt is not pushed: 7.85 g for a litre of steel differs, and nothing weighs that."""
    from silo.inertia.push import plan_push

    asm = assemble(("l/a", cube("a", 0.1)))
    report = compute(asm, HEAD + "1,1,P-1,steel,7.85 g,a\n")
    assert codes(report) == ["mass_differs", "mass_implausible"]
    assert plan_push(report).items == ()
    assert codes(compute(asm, HEAD + "1,4,P-1,steel,31.4 kg,a\n"), "a") == ["row_total", "count_differs"]


def test_without_a_bom_a_part_without_a_solid_is_one_warning(
    assemble: Fixture, compute: Fixture, codes: Fixture
) -> None:
    """That there is no BOM changes nothing for it, nor does a density in the file: there is no volume."""
    for stated in (None, 7850.0):
        asm = assemble(("l/x", replace(shape_only("x"), step_density=stated)))
        report = compute(asm, options=_options(1000.0, step_density=True))
        assert codes(report) == ["no_volume", "zero_mass_link"]


def test_what_a_row_s_mass_is_held_against() -> None:
    """The largest reading of a quantity; totals only if all rows of several pieces that can be checked are.

    A density in the file is in doubt beyond what the material itself varies by.
    """
    from silo.inertia.masses import GivenMass, density_doubts, looks_like_totals
    from silo.inertia.materials import Material

    assert [GivenMass(1, 0.1, frozenset(q)).pieces for q in ((), (1.0, 4.0))] == [1, 4]
    rows = (True, 2, True), (True, 1, False), (False, 5, False), (True, 3, False)
    assert [looks_like_totals(rows[:n]) for n in (0, 1, 3, 4)] == [False, True, True, False]
    part = cube("p", step_density=840)
    for spread, wanted in ((0.0, ["step_density_differs"]), (0.3, ["density_varies"])):
        used = Material("wood", 700, spread=spread)
        assert [note.code for note in density_doubts(part, used)] == wanted


def test_a_wire_beside_its_solid_cannot_be_weighed_alone(
    assemble: Fixture, compute: Fixture, codes: Fixture
) -> None:
    """It is no part of its own: its weight is refused with a warning, and is in no sum."""
    solid, wire = cube("plate", key="s"), shape_only("plate", key="w")
    asm = assemble(("l/1", solid, None, "l/plate"), ("l/2", wire, None, "l/plate"))
    report = compute(asm, HEAD + "1,1,,,1.00 g,plate\n", weights={"l/2": "5 g"})
    assert report.total.mass == pytest.approx(0.001)
    assert codes(report) == ["target_mass_differs"]
