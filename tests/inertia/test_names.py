# SPDX-License-Identifier: LGPL-2.1-or-later
"""Cases 33 and 34: which names mean the same part."""

from __future__ import annotations

import pytest

from silo.inertia.matching import Suggester, bare, could_be, plain


@pytest.mark.parametrize(
    ("left", "right"),
    [
        ("Hex bolt M4", "hex_bolt-m4"),
        ("arm ", "arm"),
        ("two\nlines", "two lines"),
        ("Pe\u0327a", "Pe\u0327a"),
        ("é", "e\u0301"),
        ("ＡＢＣ", "abc"),
        ("Base\u00a0plate", "Base plate"),
        ("\ufeffarm\u200b", "arm"),
    ],
)
def test_same_but_for_writing(left: str, right: str) -> None:
    """Case, separators, spaces, composition of accents."""
    assert plain(left) == plain(right)


@pytest.mark.parametrize("name", ["Bolt <2>", "Bolt (1)", "Bolt:3", "bolt"])
def test_occurrence_marks_go(name: str) -> None:
    """The mark a CAD system adds to an instance is no part of the name."""
    assert bare(name) == "bolt"


@pytest.mark.parametrize("name", ["BALL_JHA17.step_10", "bolt_2", "bolt2", "bolt(1)", "M3x10"])
def test_numbers_that_belong_to_the_name_stay(name: str) -> None:
    """A real BOM has "…step_10" as a name; stripping it would make ten parts one."""
    assert bare(name) == plain(name)


@pytest.mark.parametrize(
    ("lossy", "intact"),
    [
        ("Servo? 3", "Servo™ 3"),
        ("Pe\ufffda", "Peça"),
        ("Pe\ufffd\ufffda", "Peça"),
        ("Pe?a", "pe\u0063\u0327a"),
        ("???", "伺服器"),
    ],
)
def test_lost_characters(lossy: str, intact: str) -> None:
    """A mark stands for characters outside ASCII, which are the ones that get lost."""
    assert could_be(lossy, intact)


@pytest.mark.parametrize(("lossy", "intact"), [("M?", "M3"), ("Pe?a", "Peta"), ("Pe?a", "Pea"), ("?", "")])
def test_marks_stand_for_nothing_else(lossy: str, intact: str) -> None:
    """ "M?" is never "M3"."""
    assert not could_be(lossy, intact)


@pytest.mark.parametrize(
    ("left", "right"),
    [
        ("arm", "forearm"),
        ("M3x10", "M3x100"),
        ("M3x10", "M3x12"),
        ("bracket", "bracket_2"),
        ("bolt", "bolt_2"),
    ],
)
def test_never_the_same(left: str, right: str) -> None:
    """A part of a name, another number: other parts."""
    assert plain(left) != plain(right)
    assert bare(left) != bare(right)


def test_suggestions_need_equal_digits() -> None:
    """A near name is proposed only where every number in it agrees."""
    assert Suggester(["Hex bolt M4", "Hex bolt M5", "nut"]).near("Hexbolt M4") == ("Hex bolt M4",)
    assert Suggester(["M3x12", "M3x100"]).near("M3x10") == ()
    assert Suggester(["bracket_3", "bracket"]).near("bracket_2") == ()


def test_suggestions_end_with_their_budget() -> None:
    """Thousands of parts that fit nothing must not take minutes."""
    suggester = Suggester(["Hex bolt M4", "Hex nut M4"], budget=5)
    assert suggester.near("Hexbolt M4") == ("Hex bolt M4",)
    assert suggester.near("Hexbolt M4") == ("Hex bolt M4",)
    assert suggester.near("Hexbolt M4") == ()
