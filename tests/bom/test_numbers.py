# SPDX-License-Identifier: LGPL-2.1-or-later
"""Numbers that people type: read right, or refused with what they could mean. Never a guess."""

from __future__ import annotations

from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from silo.bom.numbers import (
    Mark,
    common_mark,
    parse_number,
    read_number,
    read_quantity,
    whole_number,
    yes_or_no,
)
from silo.bom.quantities import as_decimal, exact_product, exact_sum, plain

READ = [
    ("4", "4"), ("1.5", "1.5"), ("1,5", "1.5"), ("1,234.5", "1234.5"), ("1.234,5", "1234.5"),
    ("0,500", "0.5"), ("0.125", "0.125"), ("1234,567", "1234.567"), (".5", "0.5"), ("5,", "5"),
    ("1 000", "1000"), ("1'000", "1000"), ("1_000", "1000"), ("12\u202f345,6", "12345.6"),
    ("1,234,567", "1234567"), ("1.234.567", "1234567"), ("1e3", "1000"), ("1.5E-3", "0.0015"),
    ("½", "0.5"), ("1½", "1.5"), ("2¾", "2.75"), ("2 ¾", "2.75"), ("1\u200a½", "1.5"), ("-½", "-0.5"),
    ("⅜", "0.375"), ("⅖", "0.4"), ("１２", "12"), ("١٢", "12"), ("-3", "-3"), ("−3", "-3"), ("+2", "2"),
]  # fmt: skip
NO_NUMBERS = [
    "", " ", "x", "1.2.3", "1,2,3", "5²", "²", "1½½", "1/2", "1⁄2", "⅓", "2⅔", "inf", "nan", "-inf", "0x10",
    "1e9999", "1,00,000", "1__000", "_1", "1_00", "1 00", "--1", "1-", "1e", "e3", "９９．９x", "1" * 41,
    "①", "Ⅷ",
]  # fmt: skip


@pytest.mark.parametrize(("text", "value"), READ, ids=[text for text, _ in READ])
def test_texts_that_read_one_way(text: str, value: str) -> None:
    """The rules of the module's table."""
    assert read_number(text).value == Decimal(value)


@pytest.mark.parametrize("text", NO_NUMBERS)
def test_texts_that_are_no_number(text: str) -> None:
    """Refused in words that name the text; a square, a date or a numeral is not read as digits."""
    reading = read_number(text)
    assert reading.value is None
    assert text.strip()[:40] in reading.problem


@pytest.mark.parametrize(
    ("text", "large", "small"),
    [
        ("1,000", "1000", "1"),
        ("1.000", "1000", "1"),
        ("12,500", "12500", "12.5"),
        ("-1,234", "-1234", "-1.234"),
    ],
)
def test_two_readings_are_both_named(text: str, large: str, small: str) -> None:
    """“1,000” is never 1 and never 1000 without a question; the answer to it is offered."""
    reading = read_number(text)
    assert reading.value is None
    assert f"{large} or {small};" in reading.problem
    offered = reading.problem.rpartition("write ")[2].split(" or ")
    assert [read_number(answer).value for answer in offered] == [Decimal(large), Decimal(small)]


def test_a_known_mark_decides() -> None:
    """Columns and settings say which mark is the decimal one; a text that contradicts it is refused."""
    assert read_number("1,000", Mark.COMMA).value == 1
    assert read_number("1,000", Mark.POINT).value == 1000
    assert read_number("1,5", Mark.POINT).value is None
    assert read_number("1,234.5", Mark.COMMA).value is None


def test_programs_write_points() -> None:
    """Our own export has 1.234 for a length; a comma is no program's decimal mark, and still a question."""
    assert read_number("1.234", points_are_decimal=True).value == Decimal("1.234")
    assert read_number("1,000", points_are_decimal=True).value is None


@pytest.mark.parametrize(
    ("text", "value"),
    [("4 pcs", "4"), ("4x", "4"), ("4 Stk.", "4"), ("2½ pcs", "2.5"), ("3 個", "3"), ("2,5", "2.5")],
)
def test_quantities_with_their_words(text: str, value: str) -> None:
    """A count may name what it counts."""
    assert read_quantity(text).value == Decimal(value)


@pytest.mark.parametrize("text", ["0", "-1", "1e10", "2 kg", "pcs", "1,000 pcs", "4 x 3"])
def test_quantities_that_are_refused(text: str) -> None:
    """Nothing, less than nothing, too much, a mass, or two readings."""
    reading = read_quantity(text)
    assert reading.value is None
    assert reading.problem


def test_the_weight_of_the_last_digit() -> None:
    """It says how far a number was rounded."""
    texts = ["0.009", "1.5e-3", "12", "1,234.50", "2¾"]
    assert [parse_number(text).step for text in texts] == [1e-3, 1e-4, 1, 0.01, 0.01]  # type: ignore[union-attr]


def test_a_column_has_one_mark() -> None:
    """Where its numbers agree."""
    columns = (["1,5", "1,000"], ["1.5", "2"], ["1,5", "1.5"], ["3", "1,000"])
    numbers = [[parse_number(text) for text in texts] for texts in columns]
    marks = [common_mark(number.mark for number in column if number) for column in numbers]
    assert marks == [Mark.COMMA, Mark.POINT, None, None]


def test_sums_and_products_are_exact() -> None:
    """What a person would write down, not what floats make of it."""
    assert plain(exact_sum([0.1, 0.2])) == 0.3
    assert plain(exact_sum([0.1] * 10)) == 1
    assert plain(exact_product([3, 0.1])) == 0.3
    assert plain(exact_sum([1e9, 1e-9])) == 1000000000.000000001
    assert (plain(12.0), plain(2.5), plain(Decimal("7.000"))) == (12, 2.5, 7)
    assert isinstance(plain(12.0), int)
    with pytest.raises(ValueError, match="finite"):
        as_decimal(float("inf"))


@given(st.floats(min_value=-1e15, max_value=1e15, allow_nan=False))
def test_whatever_python_prints_is_read_back(value: float) -> None:
    """Exports write repr; with points as decimals an import reads the very same number."""
    reading = read_number(repr(value), points_are_decimal=True)
    assert reading.value is not None
    assert float(reading.value) == value


@given(st.integers(1000, 999_999_999))
def test_grouped_thousands_never_shrink(value: int) -> None:
    """Grouped by any separator: the number itself, or a question."""
    for separator in ",. '_":
        reading = read_number(f"{value:,}".replace(",", separator))
        assert reading.value in (None, value)
        assert reading.value is not None or str(value) in reading.problem


@given(st.text(max_size=12))
def test_any_text_is_a_number_or_a_sentence(text: str) -> None:
    """No exception for anything that can be typed."""
    for read in (read_number, read_quantity):
        reading = read(text)
        assert (reading.value is None) == bool(reading.problem)


@pytest.mark.parametrize(
    ("text", "expected"),
    [("12", 12), ("007", 7), ("9" * 15, 10**15 - 1), ("9" * 16, None)]
    + [(text, None) for text in ("", "²", "１２", "-1", "+1", "1.0", " 1", "1e3", "0x1")],
)
def test_a_whole_number_of_a_program_has_ascii_digits_only(text: str, expected: int | None) -> None:
    """Headers and form fields may hold anything; none of it raises."""
    assert whole_number(text) == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [(" Yes ", True), ("on", True), ("0", False), ("FALSE", False), ("maybe", None), ("", None)],
)
def test_a_setting_says_yes_or_no(text: str, expected: bool | None) -> None:
    """In the words that people use; anything else is not taken for a no."""
    assert yes_or_no(text) is expected


def test_what_is_no_count_stays_as_it_is() -> None:
    """Also what is absent, and what no whole number can show."""
    assert plain(None) is None
    assert (plain(0.5), plain(7), plain(1e300), plain(Decimal("1e300"))) == (0.5, 7, 1e300, 1e300)
    assert str(plain(float("nan"))) == "nan"
