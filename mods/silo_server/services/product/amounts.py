# SPDX-License-Identifier: LGPL-2.1-or-later
"""Amounts over several levels: exact, and never absurdly large."""

from __future__ import annotations

from decimal import Decimal
from functools import lru_cache

from silo.bom.errors import ConflictError
from silo.bom.quantities import as_decimal
from silo_server.values import Line

# What quantities multiply and add up to, at most: exact as a JSON number, and more than anybody orders.
MAX_TOTAL = 10**15

# Totals are exact: counts as they are, lengths and masses as decimals.
Exact = int | Decimal


@lru_cache(maxsize=4096)
def exact_amount(quantity: float) -> Exact:
    """Return a quantity as an exact number."""
    return int(quantity) if quantity.is_integer() else as_decimal(quantity)


def multiplied(factor: Exact, line: Line) -> Exact:
    """Multiply ``factor`` by the quantity of a line; ConflictError above :data:`MAX_TOTAL`."""
    return checked_total(factor * exact_amount(line.state.quantity), line)


def checked_total(amount: Exact, line: Line) -> Exact:
    """Return an amount of the child of a line; ConflictError above :data:`MAX_TOTAL`."""
    if amount > MAX_TOTAL:
        raise ConflictError(
            f"the quantities above {line.child_part_number} multiply to more than {MAX_TOTAL:.0e}, which "
            "cannot be right; look for a wrong quantity on the way to it"
        )
    return amount
