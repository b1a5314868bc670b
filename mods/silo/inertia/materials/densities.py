# SPDX-License-Identifier: LGPL-2.1-or-later
"""Densities in texts: "7900 kg/m^3", "1,19 g/cm³", "0.2852 lb/in3". What no solid has is refused."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from silo.bom.errors import InputError
from silo.bom.message import message
from silo.bom.numbers import LONGEST, parse_number, plain_text, read_number
from silo.bom.quantities import plain
from silo.inertia.bom.mass_cell import MASS_UNITS

LIGHTEST = 5.0
"""[kg/m^3] no solid that parts are made of is lighter. FreeCAD's "Default" card has 1, "None" 0, air 1.2."""

DENSEST = 23_000.0
"""[kg/m^3] nothing that parts are made of is denser (osmium has 22 590)."""

UNIT_NEEDED_BELOW = 25.0
"""[kg/m^3] a number below this needs its unit: who writes 7.85 alone means g/cm³."""

_VOLUMES = {"m": 1.0, "dm": 1e-3, "cm": 1e-6, "mm": 1e-9, "in": 0.0254**3, "ft": 0.3048**3, "l": 1e-3}

_SHAPE = re.compile(
    r"(?P<number>[^a-zµ]++(?:e[+-]?\d++)?)\s*+(?P<mass>[a-zµ]++)\s*+/\s*+(?P<volume>[a-z]++)\s*+\^?\s*+3?"
)


class DensityCell(NamedTuple):
    """What a text says: ``value`` [kg/m^3], or why it was refused in words that end a sentence.

    has_unit
        False if the unit came from elsewhere, or kg/m^3 was assumed.
    """

    value: float | None
    problem: str = ""
    has_unit: bool = False


def checked_density(value: float) -> float:
    """Check a density [kg/m^3] that a caller gives as a number. InputError if no solid has it."""
    if UNIT_NEEDED_BELOW <= value <= DENSEST:
        return value
    hint = (
        message("; {value} g/cm³ are {kg_per_m3} kg/m³", value=f"{value:g}", kg_per_m3=f"{value * 1000:g}")
        if 0.01 < value < UNIT_NEEDED_BELOW
        else ""
    )
    raise InputError(
        message(
            "wanted a default density from {unit_needed_below} to {densest} kg/m³, got {value}{hint}",
            unit_needed_below=f"{UNIT_NEEDED_BELOW:g}",
            densest=f"{DENSEST:g}",
            value=f"{value:g}",
            hint=hint,
        )
    )


def density_factor(unit: str) -> float | None:
    """Return how many kg/m^3 a ``unit`` such as "g/cm^3" is; None if it is no unit of density."""
    match = _SHAPE.fullmatch(f"1 {_plain_density(unit)}")
    return _factor_of(match) if match else None


def read_density(text: str, factor: float = 1.0, *, points_are_decimal: bool = False) -> DensityCell:
    """Read a density that a user wrote: "7.85 g/cm³", "7850". ``factor``: for a number without a unit.

    "7,850 g/cm3" is 7.85, since nothing is denser than a metal; "7,850 kg/m3" is refused, and both readings
    are named. A density that no solid has is refused.
    """
    cell = _plain_density(text)
    match = _SHAPE.fullmatch(cell)
    if match is not None:
        own = _factor_of(match)
        if own is None:
            return DensityCell(
                None,
                message(
                    "wanted a unit such as kg/m3 or g/cm3, got “{longest}”", longest=text.strip()[:LONGEST]
                ),
            )
        factor, cell = own, match["number"].strip()
    has_unit = match is not None
    number = parse_number(cell)
    if number is not None and number.other is not None and float(number.other) * factor > DENSEST:
        value = float(number.exact)  # the other reading is denser than any metal
    else:
        reading = read_number(cell, points_are_decimal=points_are_decimal)
        if reading.value is None:
            return DensityCell(None, reading.problem, has_unit)
        value = float(reading.value)
    value *= factor
    if not LIGHTEST <= value <= DENSEST:
        than = message("lighter than any solid") if value < LIGHTEST else message("denser than any metal")
        shown = message("{value} kg/m³", value=f"{plain(value):.6g}") if math.isfinite(value) else "that"
        return DensityCell(
            None,
            message("{shown} is {than}; is the unit or the decimal mark wrong?", shown=shown, than=than),
            has_unit,
        )
    return DensityCell(value, "", has_unit)


def parse_density(text: str) -> float | None:
    """Read the density [kg/m^3] that a program wrote, as in a material card; points are decimal marks.

    Returns None if it cannot be read, or if no solid has it.
    """
    return read_density(text, points_are_decimal=True).value


def _plain_density(text: str) -> str:
    return re.sub(r"³$", "3", plain_text(text).strip("\"'")).casefold().replace("μ", "µ")


def _factor_of(match: re.Match[str]) -> float | None:
    mass, volume = MASS_UNITS.get(match["mass"]), _VOLUMES.get(match["volume"])
    return None if mass is None or volume is None else mass / volume
