# SPDX-License-Identifier: LGPL-2.1-or-later
"""Cases 33 to 35: which names mean the same part, by which rule, and material texts in a report."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from bodies import box

from silo.inertia.codes import Rule
from silo.inertia.names import Suggester, bare, could_be, plain

HEAD = "Item,Quantity,Part number,Material,Mass,Name\n"
Fixture = Callable[..., Any]


def cube(name: str, **more: Any) -> Any:
    """A cube of 1 cm."""
    return box(name, 0.01, 0.01, 0.01, **more)


@pytest.mark.parametrize(
    ("product", "row", "rule"),
    [
        ("Bolt, long", "Bolt, long", Rule.EXACT),
        ('1/4" nut', '1/4" nut', Rule.EXACT),
        ("BALL_JHA17.step_10", "BALL_JHA17.step_10", Rule.EXACT),
        ("two\nlines", "two lines", Rule.NORMALISED),
        ("arm ", "arm", Rule.NORMALISED),
        ("Hex_bolt-M4", "hex bolt M4", Rule.NORMALISED),
        ("Pe\u00e7a", "Pec\u0327a", Rule.NORMALISED),
        ("ＡＢＣ", "abc", Rule.NORMALISED),
        ("Base\u00a0plate", "Base plate", Rule.NORMALISED),
        ("\ufeffarm\u200b", "arm", Rule.NORMALISED),
        ("Bolt <2>", "Bolt", Rule.NORMALISED),
        ("Bolt (1)", "Bolt", Rule.NORMALISED),
        ("Bolt:3", "Bolt", Rule.NORMALISED),
        ("Servo? 3", "Servo™ 3", Rule.WILDCARD),
        ("Pe\ufffda", "Peça", Rule.WILDCARD),
        ("Peça", "Pe\ufffda", Rule.WILDCARD),
        # A name inside another, or another number: another part.
        *((one, other, Rule.NONE) for one, other in (
            ("forearm", "arm"), ("arm", "forearm"), ("alarm", "arm"), ("M3x100", "M3x10"), ("M3x10", "M3x12"),
            ("bracket_2", "bracket"), ("bracket", "bracket_2"), ("base_link", "base"), ("bolt2", "bolt"),
            ("bolt(1)", "bolt"),
        )),
    ],
)  # fmt: skip
def test_cases_33_and_34_names(
    assemble: Fixture, compute: Fixture, part: Fixture, codes: Fixture, product: str, row: str, rule: Rule
) -> None:
    """Each odd name finds its row, and the report says by which rule; never by a part of a name."""
    quoted = row.replace('"', '""')
    report = compute(assemble(("l/x", cube(product))), HEAD + f'1,1,,steel,,"{quoted}"\n')
    assert part(report, product).rule is rule
    assert codes(report) == (["not_in_bom", "row_unused"] if rule is Rule.NONE else [])


@pytest.mark.parametrize("name", ["BALL_JHA17.step_10", "bolt_2", "bolt2", "bolt(1)", "M3x10"])
def test_numbers_that_belong_to_the_name_stay(name: str) -> None:
    """A real BOM has "…step_10" as a name; stripping it would make ten parts one."""
    assert bare(name) == plain(name)


@pytest.mark.parametrize(
    ("lossy", "intact", "same"),
    [
        ("Pe\ufffd\ufffda", "Peça", True),
        ("Pe?a", "pe\u0063\u0327a", True),
        ("???", "伺服器", True),
        ("M?", "M3", False),
        ("Pe?a", "Peta", False),
        ("Pe?a", "Pea", False),
        ("?", "", False),
    ],
)
def test_lost_characters(lossy: str, intact: str, same: bool) -> None:
    """A mark stands for characters outside ASCII, which are the ones that get lost; "M?" is never "M3"."""
    assert could_be(lossy, intact) is same


def test_suggestions_need_equal_digits() -> None:
    """A near name is proposed only where every number in it agrees."""
    assert Suggester(["Hex bolt M4", "Hex bolt M5", "nut"]).near("Hexbolt M4") == ("Hex bolt M4",)
    assert Suggester(["M3x12", "M3x100"]).near("M3x10") == ()
    assert Suggester(["bracket_3"]).near("bracket_2") == ()


@pytest.mark.parametrize(
    ("part", "row"),
    [
        ("shaft_1", "shaft"), ("shaft", "shaft_1"), ("Arm-1", "Arm"), ("Arm (2)", "Arm"), ("base v3", "base"),
        ("base v3", "Base v4"),
    ],
)  # fmt: skip
def test_a_mark_of_a_copy_or_of_a_version_is_proposed(part: str, row: str) -> None:
    assert Suggester([row, "M3x8", "plate"]).near(part) == (row,)


def test_suggestions_end_with_their_budget() -> None:
    """Thousands of parts that fit nothing must not take minutes."""
    suggester = Suggester(["Hex bolt M4", "Hex nut M4"], budget=5)
    found = [suggester.near("Hexbolt M4") for _ in range(3)]
    assert found == [("Hex bolt M4",), ("Hex bolt M4",), ()]


def test_part_number_tier(assemble: Fixture, compute: Fixture) -> None:
    """By the number in the file, or where the product is named by its number."""
    asm = assemble(("l/a", cube("F01-0001")), ("l/b", cube("anything", part_number="F01-0002")))
    report = compute(asm, HEAD + "1,1,F01-0001,steel,,Hex bolt\n2,1,F01-0002,PLA,,Cover\n")
    found = {part.name: (part.rule, part.mass) for _, part in report.parts()}
    number = Rule.PART_NUMBER
    assert found == {
        "F01-0001": (number, pytest.approx(7.85e-3)), "anything": (number, pytest.approx(1.25e-3)),
    }  # fmt: skip


@pytest.mark.parametrize(
    ("material", "density", "told"),
    [
        ("Aluminum - 6061", 2700, []),
        ("PCB FR4", 1850, []),
        ("Unobtainium", 1000, ["unknown_material"]),
        ("Default", 1000, ["unknown_material"]),
    ],
)
def test_case_35_materials_in_a_report(
    assemble: Fixture, compute: Fixture, codes: Fixture, material: str, density: float, told: list[str]
) -> None:
    """An understood material needs no word; another gets the default density and a warning."""
    report = compute(assemble(("l/x", cube("x"))), HEAD + f"1,1,,{material},,x\n")
    assert report.total.mass == pytest.approx(density * 1e-6)
    assert codes(report) == told
