# SPDX-License-Identifier: LGPL-2.1-or-later
"""The cell of a mass: number, unit, rounding quantum ("0.3 kg*", "1.234,5 g", "10.5 oz", "- None -").

A cell is empty (in any of the spellings below), a mass, or a problem, which is reported with its line.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass, replace

from silo.bom.message import message
from silo.bom.numbers import Mark, common_mark, parse_number, plain_text

HEAVIEST = 1e12
"""[kg] no part weighs that much; sums of such numbers would lose everything else."""

_POUND = 0.45359237  # exactly, by definition (NIST Handbook 44, appendix C)

_MASSES = {
    1.0: """kg; kgs; kilo; kilogram; kilograms; kilogramm; kilogramme; kilogrammes; kilogramo; kilogramos;
        chilogrammo; chilogrammi; キログラム; 千克; 公斤""",
    1e-3: """g; gr; gram; grams; gramm; gramme; grammes; gramo; gramos; grammo; grammi; gm; gms;
        grs; グラム; 克""",
    1e-2: "dag; dkg; deka",
    1e-6: "mg; milligram; milligrams; milligramm; milligramme; 毫克",
    1e-9: "µg; μg; ug; microgram; micrograms",
    1e3: "t; to; tonne; tonnes; tonnen; toneladas; tonnellate; metric ton; metric tons; トン; 吨",
    _POUND: "lb; lbs; lbm; lbmass; pound; pounds; pfund; livres; libras; libbre; ポンド; 磅",
    _POUND / 16: "oz; ozm; ounce; ounces; unze; unzen; onces; onzas; オンス",
}

MASS_UNITS = {name.strip(): factor for factor, names in _MASSES.items() for name in names.split(";")}
"""Unit → kg. "Mg" is missing on purpose: it may mean megagram or a careless mg."""

_G = 9.80665  # m/s^2, by definition (CGPM 1901)

FORCE_UNITS = {
    "N": 1 / _G, "newton": 1 / _G, "newtons": 1 / _G, "mN": 1e-3 / _G, "daN": 10 / _G, "kN": 1e3 / _G,
    "lbf": _POUND, "lb f": _POUND, "kgf": 1.0, "kp": 1.0, "gf": 1e-3,
}  # fmt: skip
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
    """Return True if a cell says "nothing": empty, "No value", "- None -", and their translations."""
    text = unicodedata.normalize("NFKC", cell).strip().casefold()
    framed = len(text) > 1 and text[0] in "-–—<" and text[-1] in "-–—>"
    return text in _EMPTY or (framed and text[1:-1].strip() in _EMPTY)


@dataclass(frozen=True, slots=True)
class MassCell:
    """What one cell says.

    kg
        the mass, None if the cell is empty or unreadable.
    quantum_kg
        half the weight of the last written digit: the mass is ``kg`` ± this.
    unit
        the unit it was read in, "" if none was written.
    overridden
        marked by hand ("0.3 kg*").
    mark, ambiguous
        see :class:`~silo.bom.numbers.Number`.
    doubt
        why the mass may not be meant as such, in words that end a sentence.
    problem
        why it could not be read; None if all is well.
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

_PER_PIECE = re.compile(
    r"(?<!\s)\s*+(?:\b(?:per|pro|par)\b\s*|/\s*)?\b(?:each|ea|pcs?|pieces?|stk|stück|unit)\.?$", re.IGNORECASE
)

_TWO_UNITS = re.compile(r"([\d.,]++)\s*+([^\W\d_]++)\.?+[\s,]*+([\d.][\d.,]*+)\s*+([^\W\d_]++)\.?")

_UNIT_FIRST = re.compile(r"(?P<unit>[^\W\d_]{2,}+|[^\W\d_](?=[\s.]))\.?\s*(?P<number>[\d.,].*)")

_TOLERANCE = re.compile(r"(?P<mass>.+?)(?<!\s)\s*+(?:±|\+/-|\+-)\s*+(?P<by>[\d.,]++)\s*+(?P<unit>[^\d\s]*+)")

_ERROR = re.compile(r"#[^\W\d]|Err:\d")


def parse_mass(text: str, *, mark: Mark | None = None, unit: str | None = None) -> MassCell:
    """Read one cell as a mass. ``mark``: the column's decimal mark, ``unit``: its header's; None: unknown.

    "2 ± 0.1 kg", "1 kg 200 g", "kg 1.2" and "2 kg each" are masses; "~2 kg" and "(2 kg)" are, with a doubt.
    """
    if is_empty(text):
        return MassCell()
    cell = plain_text(text)
    if _ERROR.match(cell):
        return MassCell(problem=message("is an error of the spreadsheet"))
    if (split := _TOLERANCE.fullmatch(cell)) is not None:
        own = split["mass"] + (f" {split['unit']}" if split["mass"][-1].isdecimal() else "")
        whole, by = (
            parse_mass(part, mark=mark, unit=unit) for part in (own, f"{split['by']} {split['unit']}")
        )
        return whole if by.kg is None else replace(whole, quantum_kg=max(whole.quantum_kg, by.kg))
    if (both := _TWO_UNITS.fullmatch(cell)) is not None and (one_large := unit_factor(both[2])):
        large, small = (parse_mass(both[i], mark=mark, unit=both[i + 1]) for i in (1, 3))
        if large.kg is None or small.kg is None or small.kg >= one_large:
            return MassCell(problem=message("is no mass"))
        return replace(small, kg=large.kg + small.kg, ambiguous=large.ambiguous or small.ambiguous)
    if (split := _UNIT_FIRST.fullmatch(cell)) is not None and unit_factor(split["unit"]) is not None:
        cell = f"{split['number']} {split['unit']}"
    doubt = ""
    if cell[:1] in ("~", "≈"):
        cell, doubt = cell.lstrip("~≈ "), message("is marked as approximate")
    if cell.startswith("(") and cell.endswith(")"):
        cell, doubt = cell[1:-1].strip(), message("is in brackets: a reference, or a negative number")
    split = _CELL.fullmatch(_PER_PIECE.sub("", cell))
    if split is None:
        return MassCell(problem=message("is no mass"))
    number = parse_number(re.sub(r"^([+\-−])\s+", r"\1", split["number"]), mark)
    if number is None:
        return MassCell(problem=message("has no number that can be read"))
    written = split["unit"].strip().rstrip(".")
    factor = unit_factor(written or unit or "kg")
    if factor is None:
        return MassCell(problem=message("has the unknown unit “{unit}”", unit=written or unit))
    value = number.value * factor
    if not math.isfinite(value) or value >= HEAVIEST:
        return MassCell(
            problem=message("is above {heaviest} kg", heaviest=f"{HEAVIEST:g}")
            if math.isfinite(value)
            else message("is not finite")
        )
    if value < 0:
        return MassCell(problem=message("is negative"))
    return MassCell(
        kg=value,
        quantum_kg=number.step * factor / 2,
        unit=written or unit or "",
        overridden=bool(split["star"]),
        mark=number.mark,
        ambiguous=number.ambiguous,
        doubt=doubt,
    )


def unit_factor(unit: str) -> float | None:
    """Return how many kg a ``unit`` is; None if it is no unit of mass or weight.

    Upper and lower case matter only for Mg and for forces.
    """
    text = plain_text(unit).rstrip(".")
    if text == "Mg":
        return None
    return FORCE_UNITS.get(text) or MASS_UNITS.get(text) or MASS_UNITS.get(text.casefold())


def column_mark(cells: Iterable[str]) -> Mark | None:
    """Return the decimal mark that a column's unambiguous cells show; None if they show none, or both."""
    return common_mark(cell.mark for cell in map(parse_mass, cells))
