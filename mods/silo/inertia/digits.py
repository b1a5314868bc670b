# SPDX-License-Identifier: LGPL-2.1-or-later
"""The digits of a number: as Silo keeps it, and as a file has it."""

from __future__ import annotations


def rounded(value: float) -> float:
    """Round a number to the digits that Silo keeps."""
    # Twelve digits: a second run on another machine must not make a revision of the last bit.
    return float(f"{value + 0.0:.12g}") if abs(value) > 1e-15 else 0.0


def number(value: float) -> str:
    """Write fifteen significant digits, which hide the noise of the last bit; never "-0"."""
    return f"{value + 0.0:.15g}"
