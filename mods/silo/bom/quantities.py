# SPDX-License-Identifier: LGPL-2.1-or-later
"""The quantity of a BOM line: exact sums and products, and equality."""

from __future__ import annotations

from collections.abc import Iterable
from decimal import Context, Decimal, InvalidOperation
from functools import reduce
from math import isclose, isfinite
from typing import overload

from silo.bom.message import message

LARGEST_QUANTITY = 1e9
"""The most pieces (or metres, or litres) of a BOM line."""

_WIDE = Context(prec=80)


def as_decimal(value: float | int | Decimal) -> Decimal:
    """Return the number that ``value`` shows: 0.1 is one tenth. ValueError if it is not finite."""
    if isinstance(value, Decimal):
        return value
    if isinstance(value, float):
        if not isfinite(value):
            raise ValueError(message("wanted a finite number, got {value}", value=value))
        return Decimal(repr(value))
    return Decimal(value)


# A double holds fifteen digits of any number. Digits behind them are of arithmetic, unless they were typed.
_DOUBLE, _TYPED = Context(prec=15), 12


def quantity_of(value: float | int | Decimal | str) -> Decimal:
    """Return a quantity exactly as it was typed, without the dust of binary arithmetic.

    0.1 is one tenth, and 0.1 + 0.2 of a program is 0.3. A double with more digits than arithmetic leaves
    behind keeps all of them. ValueError for what is no finite number.
    """
    if isinstance(value, str):
        try:
            exact = Decimal(value)
        except InvalidOperation:
            raise ValueError(f"wanted a number, got {value[:40]!r}") from None
        if not exact.is_finite():
            raise ValueError(f"wanted a finite number, got {value[:40]}")
        return exact
    exact = as_decimal(value)
    if not isinstance(value, float):
        return exact
    short = _DOUBLE.plus(exact).normalize()
    return short if len(short.as_tuple().digits) <= _TYPED else exact


def decimal_text(value: Decimal) -> str:
    """Write a decimal in its one form: no exponent, no zeros at the end."""
    text = f"{value:f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def exact_sum(values: Iterable[float | int | Decimal]) -> Decimal:
    """Sum the values as they are written: 0.1 + 0.2 is 0.3. Exact to 80 digits."""
    return reduce(_WIDE.add, map(as_decimal, values), Decimal(0))


def exact_product(values: Iterable[float | int | Decimal]) -> Decimal:
    """Multiply the values as they are written: 3 × 0.1 is 0.3. Exact to 80 digits."""
    return reduce(_WIDE.multiply, map(as_decimal, values), Decimal(1))


@overload
def plain(value: None) -> None: ...


@overload
def plain(value: float | Decimal) -> int | float: ...


def plain(value: float | Decimal | None) -> int | float | None:
    """Return ``value`` as JSON and people have it: a count as a count (12, not 12.0); None stays None."""
    if isinstance(value, float):
        return int(value) if value.is_integer() and abs(value) < 1e16 else value
    if isinstance(value, Decimal):
        return int(value) if value == value.to_integral_value() and abs(value) < 10**16 else float(value)
    return value


# Two quantities closer than this, relatively, are one: lengths pass through databases as floats.
RELATIVE_TOLERANCE = 1e-9


def as_number(value: object) -> float | None:
    """Read a quantity as a number: int, float, Decimal or a numeral; None if it is none."""
    if value is None or isinstance(value, bool):
        return None
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return None
    return number if isfinite(number) else None


def same_quantity(a: object, b: object) -> bool:
    """Return True if both are the same number, or if neither is one."""
    x, y = as_number(a), as_number(b)
    if x is None or y is None:
        return x is y
    return isclose(x, y, rel_tol=RELATIVE_TOLERANCE, abs_tol=1e-12)
