# SPDX-License-Identifier: LGPL-2.1-or-later
"""Numbers as people and spreadsheets write them, in both decimal conventions. Pure text, no units.

A number whose only separator stands before exactly three digits ("1,234") can be read two ways; it is
``ambiguous`` until the caller says which mark is the decimal one. Everything else reads one way only.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum


class Mark(StrEnum):
    """The decimal mark of a number or a whole column."""

    POINT = "."
    COMMA = ","


@dataclass(frozen=True, slots=True)
class Number:
    """A number as written.

    value
        its value.
    step
        the weight of its last written digit (0.009 → 0.001, 1.5e-3 → 1e-4); it is rounded to ± step / 2.
    mark
        the decimal mark it proves, None where it proves none.
    ambiguous
        True for "1,234" and "1.234": one thousand odd, or one and a bit.
    """

    value: float
    step: float
    mark: Mark | None = None
    ambiguous: bool = False


# Apostrophes and every kind of space are thousands separators wherever they are used at all.
_SPACES = re.compile(r"(?<=\d)[\s'’\u00a0\u2009\u202f](?=\d{3}(?!\d))")
_SHAPE = re.compile(r"(?P<sign>[+\-−]?)(?P<body>\d[\d.,]*|[.,]\d+)(?:[eE](?P<exp>[+\-−]?\d{1,3}))?")


def parse_number(text: str, mark: Mark | None = None) -> Number | None:
    """``text`` as a number; None where it is none. ``mark`` decides what is ambiguous.

    A mark that contradicts the text ("1,234.5" under COMMA) gives None: it is not the number it seems.
    """
    bare = _SPACES.sub("", text.strip())
    found = _SHAPE.fullmatch(bare)
    if found is None:
        return None
    body = found["body"]
    split = _split(body, mark)
    if split is None:
        return None
    whole, fraction, proof, ambiguous = split
    exponent = int((found["exp"] or "0").replace("−", "-"))
    sign = "-" if found["sign"] in ("-", "−") else ""
    value = float(f"{sign}{whole or '0'}.{fraction or '0'}e{exponent}")
    step = float(f"1e{exponent - len(fraction)}")
    return Number(value, step, proof, ambiguous)


def _split(body: str, mark: Mark | None) -> tuple[str, str, Mark | None, bool] | None:
    """(whole digits, fraction digits, the mark this proves, ambiguous), None where it is no number."""
    points, commas = body.count("."), body.count(",")
    if not points and not commas:
        return body, "", None, False
    if points and commas:
        decimal = Mark.POINT if body.rfind(".") > body.rfind(",") else Mark.COMMA
        if body.count(decimal) > 1:
            return None
        return _with_groups(body, decimal, mark)
    only = Mark.POINT if points else Mark.COMMA
    other = Mark.COMMA if points else Mark.POINT
    if max(points, commas) > 1:
        # The same mark twice groups thousands; the decimal mark is the other one.
        return _with_groups(body + other, other, mark)
    whole, _, fraction = body.partition(only)
    if len(fraction) == 3 and 1 <= len(whole) <= 3 and not whole.startswith("0"):
        if mark is None:
            return whole, fraction, None, True
        return (whole, fraction, None, False) if mark is only else (whole + fraction, "", None, False)
    if mark is other:
        return None
    return whole, fraction, only, False


def _with_groups(body: str, decimal: Mark, mark: Mark | None) -> tuple[str, str, Mark | None, bool] | None:
    if mark not in (None, decimal):
        return None
    whole, _, fraction = body.partition(decimal)
    head, *groups = re.split(r"[.,]", whole)
    if not 1 <= len(head) <= 3 or any(len(group) != 3 for group in groups):
        return None
    return head + "".join(groups), fraction, decimal, False
