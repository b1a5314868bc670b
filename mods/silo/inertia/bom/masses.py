# SPDX-License-Identifier: LGPL-2.1-or-later
"""Mass cells of a BOM: number, unit, rounding quantum. "0.3 kg*", "1.234,5 g", "10.5 oz", "- None -".

A cell is either empty (in any of the spellings below), a mass, or a problem, reported with its line. It is
never None in silence.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass, replace

from silo.bom.numbers import Mark, Number, common_mark, parse_number, plain_text

HEAVIEST = 1e12
"""[kg] no part weighs that much; sums of such numbers would lose everything else."""

_POUND = 0.45359237  # exactly, by definition (NIST Handbook 44, appendix C)

MASS_UNITS: dict[str, float] = {
    **dict.fromkeys(("kg", "kgs", "kilo", "kilogram", "kilograms", "kilogramm", "kilogramme"), 1.0),
    **dict.fromkeys(("kilogrammes", "kilogramo", "kilogramos", "chilogrammo", "chilogrammi"), 1.0),
    **dict.fromkeys(("キログラム", "千克", "公斤"), 1.0),
    **dict.fromkeys(("g", "gr", "gram", "grams", "gramm", "gramme", "grammes", "gramo", "gramos"), 1e-3),
    **dict.fromkeys(("grammo", "grammi", "gm", "gms", "grs", "グラム", "克"), 1e-3),
    **dict.fromkeys(("dag", "dkg", "deka"), 1e-2),
    **dict.fromkeys(("mg", "milligram", "milligrams", "milligramm", "milligramme", "毫克"), 1e-6),
    **dict.fromkeys(("µg", "μg", "ug", "microgram", "micrograms"), 1e-9),
    **dict.fromkeys(("t", "to", "tonne", "tonnes", "tonnen", "toneladas", "tonnellate"), 1e3),
    **dict.fromkeys(("metric ton", "metric tons", "トン", "吨"), 1e3),
    **dict.fromkeys(("lb", "lbs", "lbm", "pound", "pounds", "pfund", "livres", "libras", "libbre"), _POUND),
    **dict.fromkeys(("ポンド", "磅"), _POUND),
    **dict.fromkeys(
        ("oz", "ozm", "ounce", "ounces", "unze", "unzen", "onces", "onzas", "オンス"), _POUND / 16
    ),
    **dict.fromkeys(("slug", "slugs"), _POUND * 9.80665 / 0.3048),
}
"""Unit → kg. "Mg" is missing on purpose: it may mean megagram or a careless mg."""

STANDARD_GRAVITY = 9.80665
"""[m/s^2] by definition (CGPM 1901): weights that are forces are divided by it."""

FORCE_UNITS: dict[str, float] = {
    **dict.fromkeys(("N", "newton", "newtons"), 1 / STANDARD_GRAVITY),
    **dict.fromkeys(("kN",), 1e3 / STANDARD_GRAVITY),
    **dict.fromkeys(("mN",), 1e-3 / STANDARD_GRAVITY),
    **dict.fromkeys(("daN",), 10 / STANDARD_GRAVITY),
    **dict.fromkeys(("lbf", "lb f"), _POUND),
    **dict.fromkeys(("ozf",), _POUND / 16),
    **dict.fromkeys(("kgf", "kp"), 1.0),
    **dict.fromkeys(("gf",), 1e-3),
}
"""Unit of force → kg that weigh as much. Case counts: mN is no MN."""

# What Onshape and others write for "nothing" in the languages whose headers we know.
_EMPTY = {
    "", "-", "--", "---", "–", "—", "?", "n/a", "na", "n.a.", "none", "no value", "null", "nan", "unknown",
    "not set", "unset", "unspecified", "not specified", "material <not specified>", "nicht spezifiziert",
    "material <nicht festgelegt>", "nicht festgelegt", "keine", "keiner", "keines", "kein wert", "ohne",
    "nicht zugewiesen", "aucun", "aucune", "aucune valeur", "sans valeur", "ninguno", "ninguna", "sin valor",
    "nessuno", "nessuna", "nessun valore", "なし", "値なし", "無し", "无", "无值", "無", "没有值",
}  # fmt: skip


def is_empty(cell: str) -> bool:
    """True where a cell says "nothing": empty, "No value", "- None -", and their translations."""
    text = unicodedata.normalize("NFKC", cell).strip().casefold()
    inner = re.fullmatch(r"[-–—<]\s*(.*?)\s*[-–—>]", text)
    return text in _EMPTY or (inner is not None and inner[1] in _EMPTY)


@dataclass(frozen=True, slots=True)
class MassCell:
    """What one cell says.

    kg
        the mass, None where the cell is empty or unreadable.
    quantum_kg
        half the weight of the last written digit: the mass is ``kg`` ± this.
    unit
        the unit it was read in, "" where none was written.
    overridden
        marked by hand ("0.3 kg*").
    mark, ambiguous
        see :class:`~silo.inertia.bom.numbers.Number`.
    doubt
        why the mass may not be meant as such, in words that end a sentence.
    problem
        why it could not be read; None where all is well.
    """

    kg: float | None = None
    quantum_kg: float = 0.0
    unit: str = ""
    overridden: bool = False
    mark: Mark | None = None
    ambiguous: bool = False
    doubt: str = ""
    problem: str | None = None


_CELL = re.compile(
    r"(?P<number>[+\-−]?\s*[\d.,¼-¾⅐-⅞](?:[\d.,\s'’_]*[\d.,¼-¾⅐-⅞])?(?:[eE][+\-−]?\d+)?)"
    r"\s*(?P<unit>[^\d*]*?)(?P<star>\*?)"
)


_EACH = re.compile(r"\s*(?:\b(?:per|pro|par)\b\s*|/\s*)?\b(?:each|ea|pcs?|pieces?|stk|stück|unit)\.?$", re.I)
_POUNDS_OUNCES = re.compile(r"(?P<lb>[\d.]+)\s*lbs?\.?\s*,?\s*(?P<oz>[\d.]+)\s*oz\.?", re.IGNORECASE)
_TOLERANCE = re.compile(r"(?P<mass>.+?)\s*(?:±|\+/-|\+-)\s*(?P<by>[\d.,]+)\s*(?P<unit>[^\d\s]*)")


def parse_mass(text: str, *, mark: Mark | None = None, unit: str | None = None) -> MassCell:
    """One cell as a mass. ``mark``: the column's decimal mark, ``unit``: its header's; None: unknown.

    "2 ± 0.1 kg", "1 lb 3 oz" and "2 kg each" are masses; "~2 kg" and "(2 kg)" are, with a doubt.
    """
    if is_empty(text):
        return MassCell()
    cell = plain_text(text)
    if (split := _TOLERANCE.fullmatch(cell)) is not None:
        own = split["mass"] + (f" {split['unit']}" if split["mass"][-1].isdecimal() else "")
        found, by = (
            parse_mass(part, mark=mark, unit=unit) for part in (own, f"{split['by']} {split['unit']}")
        )
        return found if by.kg is None else replace(found, quantum_kg=max(found.quantum_kg, by.kg))
    if (both := _POUNDS_OUNCES.fullmatch(cell)) is not None:
        lb, oz = (parse_mass(both[u], mark=Mark.POINT, unit=u) for u in ("lb", "oz"))
        if lb.kg is None or oz.kg is None:
            return MassCell(problem="is no mass")
        return replace(oz, kg=lb.kg + oz.kg)
    doubt = ""
    if cell[:1] in ("~", "≈"):
        cell, doubt = cell.lstrip("~≈ "), "is marked as approximate"
    if cell.startswith("(") and cell.endswith(")"):
        cell, doubt = cell[1:-1].strip(), "is in brackets: a reference, or a negative number"
    split = _CELL.fullmatch(_EACH.sub("", cell))
    if split is None:
        return MassCell(problem="is no mass")
    number = parse_number(re.sub(r"^([+\-−])\s+", r"\1", split["number"]), mark)
    if number is None:
        return MassCell(problem="has no number that can be read")
    written = split["unit"].strip().rstrip(".")
    factor = unit_factor(written or unit or "kg")
    if factor is None:
        return MassCell(problem=f"has the unknown unit “{written or unit}”")
    return replace(_cell(number, factor, written or unit or "", bool(split["star"])), doubt=doubt)


def _cell(number: Number, factor: float, unit: str, overridden: bool) -> MassCell:
    value = number.value * factor
    if not math.isfinite(value) or value >= HEAVIEST:
        return MassCell(problem=f"is above {HEAVIEST:g} kg" if math.isfinite(value) else "is not finite")
    if value < 0:
        return MassCell(problem="is negative")
    return MassCell(
        kg=value,
        quantum_kg=number.step * factor / 2,
        unit=unit,
        overridden=overridden,
        mark=number.mark,
        ambiguous=number.ambiguous,
    )


def unit_factor(unit: str) -> float | None:
    """kg per ``unit``; None where it is no unit of mass or weight. Case counts for Mg and forces only."""
    text = plain_text(unit).rstrip(".")
    if text == "Mg":
        return None
    return FORCE_UNITS.get(text) or MASS_UNITS.get(text) or MASS_UNITS.get(text.casefold())


def is_force(unit: str) -> bool:
    """True for N, lbf and the like."""
    return plain_text(unit).rstrip(".") in FORCE_UNITS


def column_mark(cells: Iterable[str]) -> Mark | None:
    """The decimal mark that a column's unambiguous cells agree on; None where they show none, or both."""
    return common_mark(cell.mark for cell in map(parse_mass, cells))
