# SPDX-License-Identifier: LGPL-2.1-or-later
"""Numbers as people and spreadsheets write them, in both decimal conventions.

The one parser of the project: for quantities in forms, CSV files and API texts, for masses and densities. It
is pure text; units belong to the callers. The rules:

====================  ==================================================================================
``1.5``  ``1,5``      1.5: both decimal marks are read
``1,234.5``           1234.5: where both marks stand, the last one is the decimal mark
``1,000``  ``1.000``  ambiguous: 1000 or 1. Refused with both readings, unless the caller knows the mark
``0,500``             0.5: thousands are not written as 0,500
``1 000``  ``1'000``  1000: spaces and apostrophes between groups of three digits separate thousands
``1_000``             1000: so does an underscore
``1e3``  ``1.5E-3``   1000, 0.0015: scientific notation
``½``  ``2¾``         0.5, 2.75: fractions in one character, where their decimals end (⅓ is refused)
``１２``               12: decimal digits of any script
``5²``  ``1/2``       refused: a square is no digit, and 1/2 may be a date
``inf``  ``nan``      refused, and so is anything longer than 40 characters
====================  ==================================================================================
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass
from decimal import Decimal
from enum import StrEnum
from fractions import Fraction
from typing import NamedTuple

from silo.bom.message import message
from silo.bom.quantities import LARGEST_QUANTITY, plain
from silo.bom.units import known_unit

LONGEST = 40
"""[characters] no number that a user types is longer."""


class Mark(StrEnum):
    """The decimal mark of a number or a whole column."""

    POINT = "."
    COMMA = ","

    @property
    def other(self) -> Mark:
        """Return the other mark: it groups thousands if this one is the decimal mark."""
        return Mark.COMMA if self is Mark.POINT else Mark.POINT


@dataclass(frozen=True, slots=True)
class Number:
    """A number as written.

    exact
        its value, to the last digit written.
    places
        the power of ten of its last written digit (0.009 → -3, 1.5e-3 → -4).
    mark
        the decimal mark it proves, None where it proves none.
    other
        the second reading of "1,234" and "1.234", None where there is only one.
    """

    exact: Decimal
    places: int
    mark: Mark | None = None
    other: Decimal | None = None

    @property
    def value(self) -> float:
        """Return the value as a float; infinity if it is too large for one."""
        return float(self.exact)

    @property
    def step(self) -> float:
        """Return the weight of the last written digit; the rounding error is at most step / 2."""
        return float(f"1e{self.places}")

    @property
    def ambiguous(self) -> bool:
        """Return True if the text can be read in two ways: as a thousand or more, or as a number with a
        fraction.
        """
        return self.other is not None


class NumberReading(NamedTuple):
    """What a text says: ``value``, or in words why it was refused (``problem`` ends a sentence)."""

    value: Decimal | None
    problem: str = ""


# Apostrophes, underscores and every kind of space are thousands separators wherever they are used at all.
_SPACES = re.compile(r"(?<=\d)[\s'’_\u00a0\u2009\u202f](?=\d{3}(?!\d))")
_SHAPE = re.compile(r"(?P<sign>[+\-−]?)(?P<body>[0-9][0-9.,]*|[.,][0-9]+)(?:[eE](?P<exp>[+\-−]?[0-9]{1,3}))?")
_FRACTION = re.compile(r"(?P<sign>[+\-−]?)(?P<whole>[0-9]*)\s?(?P<part>[¼-¾⅐-⅞])")
_COUNT_WORD = re.compile(r"(?P<number>.*?[0-9¼-¾⅐-⅞.,])\s*(?P<word>[^\W\d_]+\.?|×)")


def parse_number(text: str, mark: Mark | None = None) -> Number | None:
    """Read ``text`` as a number; None if it is none. ``mark`` decides if it is ambiguous.

    A mark that contradicts the text ("1,234.5" under COMMA) gives None, since it is not the number that it
    seems to be.
    """
    bare = plain_text(text)
    if len(bare) > LONGEST:
        return None
    fraction = _FRACTION.fullmatch(bare)
    if fraction is not None:
        return _fraction(fraction)
    match = _SHAPE.fullmatch(_SPACES.sub("", bare))
    if match is None:
        return None
    split = _split(match["body"], mark)
    if split is None:
        return None
    exponent = int((match["exp"] or "0").replace("−", "-"))
    sign = "-" if match["sign"] in ("-", "−") else ""
    exact = Decimal(f"{sign}{split.whole or '0'}.{split.fraction or '0'}e{exponent}")
    other = Decimal(f"{sign}{split.whole}{split.fraction}e{exponent}") if split.ambiguous else None
    return Number(exact, exponent - len(split.fraction), split.proof, other)


def read_number(text: str, mark: Mark | None = None, *, points_are_decimal: bool = False) -> NumberReading:
    """Read ``text`` as a number; refuses, in words, a text that is none or that is ambiguous, so that a
    person corrects it.

    points_are_decimal
        for files and requests that programs write: "1.234" is 1.234. "1,234" stays ambiguous.
    """
    shown = f"“{text.strip()[:LONGEST]}”"
    if points_are_decimal and "," not in text:
        mark = Mark.POINT
    number = parse_number(text, mark)
    if number is None:
        return NumberReading(None, message("wanted a number such as 4 or 2.5, got {shown}", shown=shown))
    if number.other is not None:
        ways = message("{other} or {exact}", other=plain(number.other), exact=plain(number.exact))
        write = message("{other} or {exact}0", other=plain(number.other), exact=f"{number.exact:f}")
        return NumberReading(
            None, message("{shown} can be read as {ways}; write {write}", shown=shown, ways=ways, write=write)
        )
    return NumberReading(number.exact)


def read_count(text: str, mark: Mark | None = None, *, points_are_decimal: bool = False) -> NumberReading:
    """Read a number as :func:`read_number` does; the text may name the unit: "4 pcs", "4x", "4 Stk."."""
    short = text.strip()
    counted = _COUNT_WORD.fullmatch(short) if len(short) <= 2 * LONGEST else None
    unit = known_unit(counted["word"]) if counted else None
    in_pieces = unit is not None and unit.counts_pieces
    return read_number(
        counted["number"] if counted and in_pieces else text, mark, points_are_decimal=points_are_decimal
    )


def read_quantity(text: str, mark: Mark | None = None, *, points_are_decimal: bool = False) -> NumberReading:
    """Read the quantity of a BOM line: a number above 0 and at most 1e9."""
    reading = read_count(text, mark, points_are_decimal=points_are_decimal)
    if reading.value is not None and not 0 < reading.value <= Decimal(LARGEST_QUANTITY):
        return NumberReading(
            None,
            message("wanted a number above 0 and at most 1e9, got “{text}”", text=text.strip()[:LONGEST]),
        )
    return reading


def common_mark(marks: Iterable[Mark | None]) -> Mark | None:
    """Return the decimal mark that the numbers of a column show; None if they show none, or both."""
    shown = {mark for mark in marks if mark is not None}
    return shown.pop() if len(shown) == 1 else None


def plain_text(text: str) -> str:
    """Strip ``text``, and write full-width letters as narrow ones and the digits of any script as 0 to 9.

    Superscripts, fractions and circled numbers stay what they are: "5²" is not 52, nor "1½" 11/2.
    """
    return text.strip() if text.isascii() else "".join(map(_plain_character, text.strip())).strip()


def _plain_character(character: str) -> str:
    if character.isascii():
        return character
    if unicodedata.numeric(character, None) is None:
        return unicodedata.normalize("NFKC", character)
    return str(unicodedata.decimal(character, character))


def whole_number(text: str, digits: int = 15) -> int | None:
    """Read a whole number that a program wrote, of at most ``digits`` ASCII digits; None for anything else.

    For headers, form fields and addresses. ``str.isdigit`` alone is also true for "²", which ``int`` refuses.
    """
    return int(text) if text.isascii() and text.isdigit() and len(text) <= digits else None


_YES, _NO = ("1", "true", "yes", "on"), ("0", "false", "no", "off")


def yes_or_no(text: str) -> bool | None:
    """Read a setting: ``1``, ``true``, ``yes``, ``on`` or their opposites; None for anything else."""
    word = text.strip().lower()
    return True if word in _YES else False if word in _NO else None


class _Split(NamedTuple):
    whole: str
    fraction: str
    proof: Mark | None
    ambiguous: bool = False


def _split(body: str, mark: Mark | None) -> _Split | None:
    """Split a number into whole digits, fraction digits, and the mark that this proves; None if it is no
    number.
    """
    points, commas = body.count("."), body.count(",")
    if not points and not commas:
        return _Split(body, "", None)
    if points and commas:
        decimal = Mark.POINT if body.rfind(".") > body.rfind(",") else Mark.COMMA
        if body.count(decimal) > 1:
            return None
        return _with_groups(body, decimal, mark)
    only = Mark.POINT if points else Mark.COMMA
    if max(points, commas) > 1:
        # The same mark twice groups thousands; the decimal mark is the other one.
        return _with_groups(body + only.other, only.other, mark)
    whole, _, fraction = body.partition(only)
    if len(fraction) == 3 and 1 <= len(whole) <= 3 and not whole.startswith("0"):
        if mark is None:
            return _Split(whole, fraction, None, ambiguous=True)
        return _Split(whole, fraction, None) if mark is only else _Split(whole + fraction, "", None)
    if mark is only.other:
        return None
    return _Split(whole, fraction, only)


def _with_groups(body: str, decimal: Mark, mark: Mark | None) -> _Split | None:
    if mark not in (None, decimal):
        return None
    whole, _, fraction = body.partition(decimal)
    head, *groups = re.split(r"[.,]", whole)
    if not 1 <= len(head) <= 3 or any(len(group) != 3 for group in groups):
        return None
    return _Split(head + "".join(groups), fraction, decimal)


def _fraction(match: re.Match[str]) -> Number | None:
    part = Fraction(unicodedata.numeric(match["part"])).limit_denominator(10)
    if 1000 % part.denominator:
        return None  # a third has no last decimal
    exact = Decimal(match["whole"] or 0) + Decimal(part.numerator) / part.denominator
    places = exact.as_tuple().exponent
    return Number(-exact if match["sign"] in ("-", "−") else exact, int(places))
