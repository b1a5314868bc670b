# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where a mass comes from when there is no solid, no BOM, no row, or a density in the file."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from bodies import box, shape_only

from silo.inertia.assembly import SolidProps
from silo.inertia.codes import Source
from silo.inertia.geometry.measured import Measured
from silo.inertia.masses import GivenMass, Options, density_doubts, looks_like_totals
from silo.inertia.materials.material import Material
from silo.inertia.notes import GeometryCode, Note

HEAD = "Item,Quantity,Part number,Material,Mass,Name\n"
V = 1e-6  # of a cube of 1 cm
Fixture = Callable[..., Any]


def cube(name: str, size: float = 0.01, **more: Any) -> Any:
    """A cube of ``size``; the key may be given, for different products of one name."""
    return box(name, size, size, size, **more)


def test_several_solids_share_their_rows_mass(assemble: Fixture, compute: Fixture) -> None:
    """One row, one product, two bodies: the mass is spread by volume, the centre is that of both."""
    unit = np.eye(3)
    solids = (SolidProps(1e-6, [0, 0, 0], unit * 1e-10), SolidProps(3e-6, [0.04, 0, 0], unit * 1e-10))
    product = Measured(solids, (), None, True).prototype("p", "p")
    apart = np.diag([0, 1.2e-9, 1.2e-9])  # 1e-6 * 3e-6 / 4e-6 * 0.04², across x
    report = compute(assemble(("l/p", product)), HEAD + "1,1,,,0.400 kg,p\n")
    assert report.links["l"].props.com == pytest.approx([0.03, 0, 0])
    assert report.links["l"].props.inertia == pytest.approx((unit * 2e-10 + apart) * 1e5)


def test_points_stand_where_their_parts_stand(assemble: Fixture, compute: Fixture, at: Fixture) -> None:
    """A bought unit of which the file has no solid at all."""
    asm = assemble(("arm/unit/a", shape_only("a"), at(0, 2, 3)), ("arm/unit/b", shape_only("b"), at(1, 2, 3)))
    report = compute(asm, HEAD + "1,1,,,0.800 kg,unit\n")
    assert report.links["arm"].props.com == pytest.approx([0.5, 2, 3])


def test_step_density_is_compared_and_used_only_when_asked(
    assemble: Fixture, compute: Fixture, part: Fixture, codes: Fixture
) -> None:
    """Never above the BOM; before the default where the user says so."""
    asm = assemble(("l/x", cube("x", step_density=7850.0, step_material="Steel")))
    assert codes(compute(asm, HEAD + "1,1,,PLA,,x\n")) == ["step_density_differs"]
    assert codes(compute(asm, HEAD + "1,1,,steel,,x\n")) == []
    plain = compute(asm, HEAD + "1,1,,steel,,other\n")
    assert part(plain, "x").mass == pytest.approx(1000 * V)
    assert "7850" in plain.warnings[0].message
    asked = compute(asm, HEAD + "1,1,,steel,,other\n", options=Options(1000.0, step_density=True))
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
        ({}, 1000, ["no_bom"]),
        ({"has_solid": False, "step_density": 7850.0}, 0, ["no_volume", "zero_mass_link"]),
        ({"has_solid": False}, 0, ["no_volume", "zero_mass_link"]),
    ],
)
def test_without_a_bom(
    assemble: Fixture, compute: Fixture, codes: Fixture, stated: dict[str, Any], density: float, told: Any
) -> None:
    """The density in the file, that of its material if that is understood without doubt, or the default."""
    x = cube("x", **stated) if stated.pop("has_solid", True) else shape_only("x", **stated)
    report = compute(assemble(("l/x", x)), None, options=Options(1000.0, step_density=True))
    assert report.total.mass == pytest.approx(density * V)
    assert codes(report) == told


def test_reader_problems_reach_the_report(assemble: Fixture, compute: Fixture) -> None:
    """What the geometry reader noticed stands with link, part and code."""
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


def test_each_part_of_a_varying_material_has_its_own_uncertainty(
    assemble: Fixture, compute: Fixture, part: Fixture
) -> None:
    """EPS has ± 50 %, by a row of the part or of what is around it, whose part number is not the part's."""
    asm = assemble(("arm/large", cube("large", 0.1)), ("arm/small", cube("small")), ("arm/own", cube("own")))
    report = compute(asm, HEAD + "1,1,P-7,EPS,,arm\n2,1,P-8,EPS,,own\n")
    for name, number in (("large", ""), ("small", ""), ("own", "P-8")):
        found = part(report, name)
        assert found.quantum == pytest.approx(0.5 * found.mass)
        assert found.part_number == number


@pytest.mark.parametrize(
    ("row", "code"), [("1,4,,rubber,,foot", "density_varies"), ("1,4,,steel,5.000 g,foot", "mass_differs")]
)
def test_pieces_that_are_alike_are_one_part_with_the_same_doubt(
    assemble: Fixture, compute: Fixture, codes: Fixture, row: str, code: str
) -> None:
    """An exporter writes each rubber foot as a product of its own, with the rounding of its place; by how
    much its mass may be wrong differs in the last bit.
    """
    feet = [(f"l/foot{n}", cube("foot", 0.01 * (1 + n * 1e-13), key=f"foot{n}")) for n in range(4)]
    report = compute(assemble(*feet), HEAD + row + "\n")
    assert codes(report) == [code]
    assert [one.quantity for one in report.links["l"].parts] == [4]


def test_a_stated_density_within_what_the_material_varies_by_is_no_contradiction(
    assemble: Fixture, compute: Fixture, codes: Fixture
) -> None:
    """EPS of 28 kg/m³ is EPS; of 60 it is something else."""
    for stated, wanted in ((28.0, ["density_varies"]), (60.0, ["density_varies", "step_density_differs"])):
        asm = assemble(("l/a", cube("a", 0.1, step_density=stated)))
        assert codes(compute(asm, HEAD + "1,1,,EPS,,a\n")) == wanted


def test_running_numbers_are_no_part_numbers(assemble: Fixture, compute: Fixture, codes: Fixture) -> None:
    """The file's product 2 and the BOM's part 2 have been counted by two programs."""
    asm = assemble(("l/a", cube("bracket", part_number="2")))
    report = compute(asm, HEAD + "1,1,1,,2.70 g,bracket A\n2,1,2,,7.80 g,motor\n")
    assert "not_in_bom" in codes(report, "bracket")
    real = assemble(("l/a", cube("bracket", part_number="F01-0002")))
    assert codes(compute(real, HEAD + "1,1,F01-0002,,2.70 g,bracket A\n")) == []


def test_what_a_row_s_mass_is_held_against() -> None:
    """The largest reading of a quantity; totals only if all rows of several pieces that can be checked are.

    A density in the file is in doubt beyond what the material itself varies by.
    """
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
