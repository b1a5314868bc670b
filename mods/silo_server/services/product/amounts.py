# SPDX-License-Identifier: LGPL-2.1-or-later
"""Amounts over several levels: exact, in the unit of each item, and never absurdly large.

A line in a unit of another kind than its child's is open (*unit?*): it has no amount, and counts in no sum.
"""

from __future__ import annotations

from decimal import Decimal
from functools import lru_cache

from silo.bom.errors import ConflictError
from silo.bom.message import message
from silo.bom.quantities import as_decimal, exact_product
from silo.bom.units import converted, line_unit, unit_of
from silo_server.values import Line

# What quantities multiply and add up to, at most: exact as a JSON number, and more than anybody orders.
MAX_TOTAL = 10**15

# The mark of a line, and of all that it holds, whose unit does not convert.
UNIT_OPEN = "unit?"

# Totals are exact: counts as they are, lengths and masses as decimals.
Exact = int | Decimal


@lru_cache(maxsize=4096)
def exact_amount(quantity: float | Decimal) -> Exact:
    """Return a quantity as an exact number."""
    exact = as_decimal(quantity)
    return int(exact) if exact == exact.to_integral_value() else exact


@lru_cache(maxsize=16384)
def _amount(quantity: float, unit: str | None, child_unit: str | None, from_cad: bool) -> Exact | None:
    of_line, of_item = line_unit(unit, child_unit, from_cad=from_cad), unit_of(child_unit)
    exact = converted(as_decimal(quantity), of_line, of_item)
    return None if exact is None else exact_amount(exact)


def amount_of(line: Line) -> Exact | None:
    """Return how much of its child a line holds, in the unit of the child; None if its unit is open."""
    state = line.state
    if state.unit is None and line.child_unit is None:
        return exact_amount(state.quantity)
    return _amount(state.quantity, state.unit, line.child_unit, state.source == "assembly")


def unit_is_open(line: Line) -> bool:
    """Return True if the unit of a line does not convert into its child's."""
    return amount_of(line) is None


def of_one(line: Line) -> Decimal | None:
    """Return how much of its child, in the child's unit, one unit of a line is; None if its unit is open."""
    of_line = line_unit(line.state.unit, line.child_unit, from_cad=line.state.source == "assembly")
    return converted(Decimal(1), of_line, unit_of(line.child_unit))


def totals_of(factor: Exact | None, line: Line) -> tuple[Exact | None, Exact | None]:
    """Multiply a line by how much there is of its parent: in the line's own unit, and in its child's.

    None for what a unit leaves open. ConflictError above :data:`MAX_TOTAL`.
    """
    if factor is None:
        return None, None
    shown, amount = checked_total(product(factor, exact_amount(line.state.quantity)), line), amount_of(line)
    return shown, None if amount is None else checked_total(product(factor, amount), line)


def product(factor: Exact, amount: Exact) -> Exact:
    """Multiply two amounts, exactly."""
    if isinstance(factor, int) and isinstance(amount, int):
        return factor * amount
    return exact_amount(exact_product((factor, amount)))


def checked_total(amount: Exact, line: Line) -> Exact:
    """Return an amount of the child of a line; ConflictError above :data:`MAX_TOTAL`."""
    if amount > MAX_TOTAL:
        raise ConflictError(
            message(
                "the quantities above {part_number} multiply to more than {most}, which cannot be right; "
                "look for a wrong quantity on the way to it",
                part_number=line.child_part_number,
                most=f"{MAX_TOTAL:.0e}",
            )
        )
    return amount
