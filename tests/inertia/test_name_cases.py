# SPDX-License-Identifier: LGPL-2.1-or-later
"""Cases 33 to 35 of the fact sheet: names that mean the same part, or do not, and material texts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from bodies import box

from silo.inertia.report import Rule

HEAD = "Item,Quantity,Part number,Material,Mass,Name\n"
V = 1e-6  # of a cube of 1 cm
Fixture = Callable[..., Any]


def cube(name: str, size: float = 0.01, **more: Any) -> Any:
    """A cube of ``size``; the key may be given, for different products of one name."""
    return box(name, size, size, size, **more)


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
