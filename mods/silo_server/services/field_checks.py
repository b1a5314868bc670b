# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is wrong with one field of a request: a text, a quantity, a SHA-256.

A check says what was wanted and got, without the field's name: the caller puts the name, and the index of
the entry, before it.
"""

from __future__ import annotations

import math
import re
from decimal import Decimal
from typing import Any

from silo.bom.errors import RejectedError
from silo.bom.message import message
from silo.bom.quantities import LARGEST_QUANTITY, quantity_of
from silo.bom.text import character_problem


def text_problem(value: Any, longest: int) -> str | None:
    """Say what is wrong with a text of at most ``longest`` characters; None if nothing is."""
    if not isinstance(value, str) or len(value) > longest:
        return message(
            "wanted a text of at most {most} characters, got {got}", most=longest, got=shortened(value)
        )
    return character_problem(value)


def sha256_or_none(name: str, value: Any) -> str | None:
    """Read a SHA-256 in lower-case hex digits, or None; RejectedError with the field for anything else."""
    if value is None:
        return None
    if isinstance(value, str) and re.fullmatch("[0-9A-Fa-f]{64}", value):
        return value.lower()
    raise RejectedError(message("{name}: wanted 64 hexadecimal digits", name=name))


def quantity_problem(value: Any) -> str | None:
    """Say what is wrong with a quantity; None if nothing is."""
    if isinstance(value, bool) or not isinstance(value, int | float | Decimal):
        return message("wanted a number, got {got}", got=shortened(value))
    # A huge integer has no float; comparing it is safe, converting it is not.
    if not 0 < value <= LARGEST_QUANTITY or not math.isfinite(value):
        return message("wanted a number above 0 and at most 1e9, got {got}", got=shortened(value))
    # It travels as a JSON number, which most readers take for a double.
    if isinstance(value, Decimal) and quantity_of(float(value)) != value:
        return message("wanted a number of at most 15 digits, got {got}", got=f"{value:f}")
    return None


def shortened(value: Any) -> str:
    """Write a value of a request for a message, in at most 60 characters."""
    text = f"{value:f}" if isinstance(value, Decimal) else repr(value)
    return text if len(text) <= 60 else text[:57] + "…"
