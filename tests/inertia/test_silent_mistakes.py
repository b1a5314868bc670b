# SPDX-License-Identifier: LGPL-2.1-or-later
"""Mistakes in a BOM that look like data: each one must leave a warning on the part that it hits."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from bodies import box, shape_only

Fixture = Callable[..., Any]
HEAD = "Quantity,Material,Mass,Name\n"


def cube(name: str, size: float = 0.01, **more: Any) -> Any:
    """A cube of ``size`` [m]; 1 cm³ unless said."""
    return box(name, size, size, size, **more)


@pytest.mark.parametrize(
    ("mass", "words"),
    [
        ("2.70 kg", "denser than any metal"),  # grams called kilograms
        ("50.0 g", "denser than any metal"),
        ("0.00300 g", "lighter than any solid"),  # grams divided once too often
    ],
)
def test_a_mass_that_nothing_can_weigh(
    assemble: Fixture, compute: Fixture, codes: Fixture, part: Fixture, mass: str, words: str
) -> None:
    """1 cm³ of aluminium weighs 2.7 g. Without a material in the BOM only the density gives it away."""
    report = compute(assemble(("l/a", cube("a"))), HEAD + f"1,,{mass},a\n")
    assert codes(report, "a") == ["mass_implausible"]
    assert words in part(report, "a").warnings[0].message


@pytest.mark.parametrize("mass", ["0.0225 kg", "0.00001 kg", "0.001 kg"])
def test_a_mass_that_something_weighs_is_quiet(
    assemble: Fixture, compute: Fixture, codes: Fixture, mass: str
) -> None:
    """Osmium and a light foam are there, and rounding is given its due (0.001 kg may be 0.0005 kg)."""
    small = box("a", 0.01, 0.01, 0.01 if mass != "0.001 kg" else 0.0003)
    report = compute(assemble(("l/a", small)), HEAD + f"1,,{mass},a\n")
    assert "mass_implausible" not in codes(report)


def test_a_sub_assembly_that_nothing_can_weigh(assemble: Fixture, compute: Fixture, codes: Fixture) -> None:
    """165 "kg" of a servo of 165 g: spread over its parts, the density gives it away as well."""
    asm = assemble(("arm/servo/case", cube("case", 0.05)), ("arm/servo/horn", cube("horn")))
    report = compute(asm, HEAD + "1,,165 kg,servo\n")
    assert set(codes(report)) == {"sub_assembly_mass_shared", "mass_implausible"}


def test_a_mass_without_a_solid_has_no_density_to_doubt(
    assemble: Fixture, compute: Fixture, codes: Fixture
) -> None:
    """A point mass is reported as such, and as nothing else."""
    report = compute(
        assemble(("l/a", cube("a")), ("l/b", shape_only("b"))), HEAD + "1,steel,,a\n1,,5.0 kg,b\n"
    )
    assert codes(report, "b") == ["point_mass"]


def test_running_numbers_are_no_part_numbers(assemble: Fixture, compute: Fixture, codes: Fixture) -> None:
    """The file's product 2 and the BOM's part 2 have been counted by two programs."""
    asm = assemble(("l/a", cube("bracket", part_number="2")))
    head = "Part number,Quantity,Material,Mass,Name\n"
    report = compute(asm, head + "1,1,,2.70 g,bracket A\n2,1,,7.80 g,motor\n")
    assert "not_in_bom" in codes(report, "bracket")
    real = assemble(("l/a", cube("bracket", part_number="F01-0002")))
    assert codes(compute(real, head + "F01-0002,1,,2.70 g,bracket A\n")) == []


def test_a_column_of_row_totals_makes_all_doubtful(
    assemble: Fixture, compute: Fixture, codes: Fixture
) -> None:
    """One row proves that "Mass" means the row's total; a row without a material is then doubtful too."""
    asm = assemble(
        *((f"l/bolt{i}", cube("bolt")) for i in range(4)), *((f"l/nut{i}", cube("nut")) for i in range(3)),
        ("l/lid", cube("lid")),
    )  # fmt: skip
    rows = "4,steel,0.0314 kg,bolt\n3,,0.0090 kg,nut\n1,,0.0030 kg,lid\n"
    report = compute(asm, HEAD + rows)
    assert codes(report, "bolt") == ["row_total"]
    assert codes(report, "nut") == ["row_total"]
    assert codes(report, "lid") == []  # one piece: a total is its mass


def test_a_row_that_is_no_total_clears_the_others(
    assemble: Fixture, compute: Fixture, codes: Fixture
) -> None:
    """Another row of several pieces gives the mass of one: then the odd row is odd, not the column."""
    asm = assemble(
        *((f"l/bolt{i}", cube("bolt")) for i in range(4)), *((f"l/nut{i}", cube("nut")) for i in range(3)),
        *((f"l/pin{i}", cube("pin")) for i in range(2)),
    )  # fmt: skip
    rows = "4,steel,0.0314 kg,bolt\n3,,0.0090 kg,nut\n2,steel,0.0079 kg,pin\n"
    report = compute(asm, HEAD + rows)
    assert codes(report, "bolt") == ["row_total"]
    assert codes(report, "nut") == []


def test_a_sub_assembly_that_the_geometry_does_not_have(
    assemble: Fixture, compute: Fixture, codes: Fixture
) -> None:
    """The STEP file was written flat: the motor's mass has nowhere to go, and its parts have none."""
    asm = assemble(("l/rotor", cube("rotor")), ("l/case", cube("case", 0.02)))
    flat = "Item,Quantity,Material,Mass,Name\n1,1,,0.090 kg,motor\n1.1,1,,,rotor\n1.2,1,,,case\n"
    report = compute(asm, flat)
    assert codes(report, "motor") == ["row_unused"]
    assert codes(report, "rotor") == ["no_mass_no_material"]
    # Where the parts have their own data, the row above them is not missed.
    own = flat.replace("1,,,rotor", "1,steel,,rotor").replace("1,,,case", "1,steel,,case")
    assert codes(compute(asm, own)) == []


def in_modules(*parts: Any) -> list[Any]:
    """Two of each part in each of three modules."""
    return [
        (f"top/module<{m}>/{part.name}{i}", part, None, f"top/module/{part.name}")
        for part in parts
        for m in range(3)
        for i in range(2)
    ]


STRUCTURED = "Item,Quantity,Material,Mass,Name\n"


def test_quantities_of_a_structured_bom_are_read_one_way(
    assemble: Fixture, compute: Fixture, part: Fixture, codes: Fixture
) -> None:
    """Six bolts in three modules of two: the bolts prove that quantities are per parent.

    So the clip of which there are six is the row of 2 × 3, and the one of which there are two is that of the
    base; read either way, both rows would fit both clips.
    """
    few = cube("clip", 0.03, key="few")
    placed = in_modules(cube("bolt"), cube("clip", 0.02, key="many"))
    placed += [(f"top/base/clip{i}", few, None, "top/base/clip") for i in range(2)]
    rows = (
        "1,1,,,base frame\n1.1,2,,50.00 g,clip\n2,3,,,module kit\n2.1,2,,10.00 g,bolt\n2.2,2,,20.00 g,clip\n"
    )
    report = compute(assemble(*placed), STRUCTURED + rows)
    clips = {p.quantity: p.mass for _, p in report.parts() if p.name == "clip"}
    assert clips == {6: 0.02, 2: 0.05}
    assert "ambiguous" not in codes(report)
    assert "count_differs" not in codes(report)


def test_quantities_that_are_sums_already(assemble: Fixture, compute: Fixture, codes: Fixture) -> None:
    """The same assembly from a tool that lists six bolts below the module: no false alarm, no other clip."""
    few = cube("clip", 0.03, key="few")
    placed = in_modules(cube("bolt"), cube("clip", 0.02, key="many"))
    placed += [(f"top/base/clip{i}", few, None, "top/base/clip") for i in range(2)]
    rows = (
        "1,1,,,base frame\n1.1,2,,50.00 g,clip\n2,3,,,module kit\n2.1,6,,10.00 g,bolt\n2.2,6,,20.00 g,clip\n"
    )
    report = compute(assemble(*placed), STRUCTURED + rows)
    clips = {p.quantity: p.mass for _, p in report.parts() if p.name == "clip"}
    assert clips == {6: 0.02, 2: 0.05}
    assert not {"ambiguous", "count_differs"} & set(codes(report))


def test_a_wrong_quantity_is_reported_although_another_reading_would_fit(
    assemble: Fixture, compute: Fixture, codes: Fixture
) -> None:
    """The bolts prove "per parent", so that a row of 6 in a module of three means 18 and not 6."""
    placed = in_modules(cube("bolt"), cube("nut"), cube("pin"))
    rows = "1,3,,,module\n1.1,2,,10.00 g,bolt\n1.2,2,,10.00 g,nut\n1.3,6,,10.00 g,pin\n"
    report = compute(assemble(*placed), STRUCTURED + rows)
    assert codes(report) == ["count_differs"]
    assert report.warnings[0].part_name == "pin"
