# SPDX-License-Identifier: LGPL-2.1-or-later
"""The rule of find numbers, against what a reader would say of it."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from silo.bom.find_numbers import NewLine, give_numbers

NUMBERS = st.one_of(st.integers(1, 60).map(str), st.sampled_from(["10a", "A", "007", "9" * 30]))
PARTS = st.integers(0, 6)
NEW = st.builds(NewLine, PARTS, st.none() | NUMBERS, st.booleans())


def lines(*wanted: str | None) -> list[NewLine[int]]:
    """New lines of different parts that ask for these numbers."""
    return [NewLine(part, number) for part, number in enumerate(wanted)]


@pytest.mark.parametrize(
    ("new", "taken", "step", "numbers"),
    [
        (lines(None, None), [], 10, ["10", "20"]),
        (lines(None, None), [], 1, ["1", "2"]),
        (lines(None), ["10", "35"], 10, ["40"]),
        (lines(None), ["7", "10a", "spare"], 10, ["10"]),
        (lines("15", None), ["10"], 10, ["15", "20"]),
        (lines("10", None), ["10"], 10, ["20", "30"]),
        (lines("20", "20"), [], 10, ["20", "30"]),
        (lines(None, "30"), [], 10, ["40", "30"]),
        ([NewLine(1, "10", by_hand=True)], ["10"], 10, ["10"]),
    ],
)
def test_what_a_new_line_gets(
    new: list[NewLine[int]], taken: list[str], step: int, numbers: list[str]
) -> None:
    """The next of the step, or what it asks for if that is free; by hand whatever it asks for."""
    assert give_numbers(new, taken, {}, step) == (numbers, {})


def test_a_number_that_is_gone_waits_for_its_part() -> None:
    """The last number of a BOM as well as one in the middle; its own part gets it again, by the way."""
    gone = {"30": 7, "20": 8}
    assert give_numbers([NewLine(1)], ["10"], gone) == (["40"], gone)
    assert give_numbers([NewLine(1, "20")], ["10"], gone) == (["40"], gone)
    assert give_numbers([NewLine(7)], ["10"], gone) == (["30"], {"20": 8})
    assert give_numbers([NewLine(7, "50")], ["10"], gone) == (["50"], gone)
    assert give_numbers([NewLine(1, "20", by_hand=True)], ["10"], gone) == (["20"], {"30": 7})


@given(
    st.lists(NEW, max_size=8),
    st.sets(NUMBERS, max_size=8),
    st.dictionaries(NUMBERS, PARTS),
    st.integers(1, 25),
)
def test_no_line_gets_the_number_of_another(
    new: list[NewLine[int]], taken: set[str], gone: dict[str, int], step: int
) -> None:
    """Nor that of a removed line of another part, unless a user says so; and each line has a number."""
    numbers, left = give_numbers(new, taken, gone, step)
    assert len(numbers) == len(new)
    by_hand = {line.wanted for line in new if line.by_hand and line.wanted}
    automatic = [
        number for line, number in zip(new, numbers, strict=True) if not (line.by_hand and line.wanted)
    ]
    assert len(set(automatic)) == len(automatic)
    assert not set(automatic) & (taken | by_hand)
    for line, number in zip(new, numbers, strict=True):
        assert number
        if line.by_hand and line.wanted:
            assert number == line.wanted
        else:
            assert gone.get(number, line.part) == line.part
    assert left == {number: part for number, part in gone.items() if number not in numbers}
