# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the header of a mass column says beside "Mass": its unit, one piece or the whole row. Pure.

"Mass (oz.)", "Weight (each, g)", "Mass [g/pc]", "Mass (x qty)", "Summe Masse", "mass_kg", "Gewicht in kg".
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from silo.bom.numbers import plain_text
from silo.inertia.bom.masses import unit_factor

_TOTAL = {
    "total", "totale", "totales", "totals", "gesamt", "ges", "insgesamt", "summe", "sum", "somme", "suma",
    "somma", "extended", "ext", "row", "line", "zeile", "all", "alle", "tous", "todos", "tutti", "qty",
    "quantity", "count", "menge", "anzahl", "stückzahl", "quantité", "cantidad", "quantità", "lot", "batch",
    "set", "group", "subtotal", "cumulative", "rolled", "rollup", "rolledup", "σ", "∑", "合計", "小計", "总",
    "合计", "總",
}  # fmt: skip
_EACH = {
    "each", "ea", "unit", "units", "piece", "pieces", "pc", "pcs", "part", "item", "one", "single", "1",
    "einzel", "einzeln", "stück", "stk", "st", "teil", "pièce", "unité", "unitaire", "pieza", "unidad",
    "unitaria", "unitario", "pezzo", "unità", "個", "单件", "単体", "件",
}  # fmt: skip
_FILLERS = {"x", "×", "per", "pro", "par", "por", "je", "in", "en", "for", "für", "of", "the", "a"}

_WORD = re.compile(r"/|[^\W_]+|[×∑]")
_BRACKETS = re.compile(r"[\(\[（【<]([^)\]）】>]*)[\)\]）】>]")


@dataclass(frozen=True, slots=True)
class MassHeader:
    """A mass column's header.

    title
        the words that remain: "mass" of "Mass (each) [g]".
    unit
        of its cells, "" where it states none.
    total
        True where a cell is the mass of the whole row.
    strange
        what stands in brackets and is not understood.
    rate
        True where a cell is no mass: "kg/m", "g/cm3".
    """

    title: str
    unit: str = ""
    total: bool = False
    strange: str = ""
    rate: bool = False


def read_mass_header(cell: str) -> MassHeader:
    """Take a header apart; for any text, also one that is no mass column's."""
    text = plain_text(cell)
    unit, strange, total, each, rate = "", [], False, False, False
    for bracket in _BRACKETS.findall(text):
        found = _inside(bracket)
        unit = unit or found.unit
        total, each, rate = total or found.total, each or found.each, rate or found.rate
        if found.strange:
            strange.append(bracket.strip())
    kept: list[str] = []
    for word in _WORD.findall(_BRACKETS.sub(" ", text)):
        low = word.casefold()
        if low in _TOTAL:
            total = True
        elif low in _EACH:
            each = True
        elif kept and not unit and unit_factor(word) is not None:
            unit = word  # "mass_kg", "Gewicht in kg"; never the first word
        elif low not in _FILLERS or not kept:
            kept.append(low)
    # "Mass (unit) × qty" is the row's: each says what is multiplied.
    return MassHeader(" ".join(kept), unit, total, ", ".join(strange), rate)


@dataclass(frozen=True, slots=True)
class _Bracket:
    unit: str = ""
    total: bool = False
    each: bool = False
    strange: bool = False
    rate: bool = False


def _inside(text: str) -> _Bracket:
    if unit_factor(text.strip().rstrip(".")) is not None:
        return _Bracket(unit=text.strip().rstrip("."))
    unit, total, each, strange, rate, over = "", False, False, False, False, False
    for word in _WORD.findall(text):
        low = word.casefold()
        if low in ("/", "per", "pro", "par", "por", "je"):
            over = True
        elif low in _EACH:
            each = True
        elif over:
            # "g/pc" was left above; what else stands below the line makes a rate: kg/m, g/cm3.
            rate = rate or bool(unit)
            strange = strange or not unit
        elif low in _TOTAL:
            total = True
        elif not unit and unit_factor(word) is not None:
            unit = word
        elif low not in _FILLERS:
            strange = True
    return _Bracket(unit, total, each, strange, rate)
