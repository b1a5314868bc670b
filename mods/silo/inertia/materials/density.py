# SPDX-License-Identifier: LGPL-2.1-or-later
"""Density texts → kg/m^3: "7900 kg/m^3", "1,19 g/cm³", "0.2852 lb/in3". Pure."""

from __future__ import annotations

import math
import re
import unicodedata

from silo.bom.numbers import Mark, parse_number
from silo.inertia.bom.masses import MASS_UNITS

LOWEST_SOLID = 5.0
"""[kg/m^3] below this a card is no engineering material: FreeCAD's "Default" has 1, "None" 0, air 1.2."""

_VOLUMES = {"m": 1.0, "dm": 1e-3, "cm": 1e-6, "mm": 1e-9, "in": 0.0254**3, "ft": 0.3048**3, "l": 1e-3}
_SHAPE = re.compile(
    r"(?P<number>[\d.,\s']+(?:e[+-]?\d+)?)\s*(?P<mass>[a-zµ]+)\s*/\s*(?P<volume>[a-z]+)\s*\^?\s*3?"
)


def unit_factor(unit: str) -> float | None:
    """kg/m^3 per ``unit`` ("g/cm^3"); None where it is no unit of density."""
    return parse_density(f"1 {unit}")


def parse_density(text: str) -> float | None:
    """[kg/m^3]; a bare number is kg/m^3 already. None where it cannot be read or is not above zero."""
    cell = unicodedata.normalize("NFKC", text).strip().strip("\"'").casefold()
    found = _SHAPE.fullmatch(cell)
    number = parse_number(found["number"] if found else cell, _mark(found["number"] if found else cell))
    if number is None:
        return None
    factor = 1.0
    if found is not None:
        mass, volume = MASS_UNITS.get(found["mass"]), _VOLUMES.get(found["volume"])
        if mass is None or volume is None:
            return None
        factor = mass / volume
    value = number.value * factor
    return value if math.isfinite(value) and value > 0 else None


def _mark(text: str) -> Mark:
    # Densities are not written with thousands separators in material cards ("1.204 kg/m^3" is air).
    return Mark.COMMA if "," in text and "." not in text else Mark.POINT
