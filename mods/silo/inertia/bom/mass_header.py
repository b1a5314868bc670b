# SPDX-License-Identifier: LGPL-2.1-or-later
"""The header of a mass column: what it calls a mass, in which unit, of one piece or of the whole row."""

from __future__ import annotations

import re
from dataclasses import dataclass

from silo.bom.numbers import plain_text
from silo.inertia.bom.mass_cell import FORCE_UNITS, unit_factor

_TOTAL, _EACH = (
    set(words.split())
    for words in (
        """total totale totales totals tot gesamt ges insgesamt summe sum somme suma somma extended ext extd
        row line zeile all alle tous todos tutti qty quantity count menge anzahl stückzahl quantité cantidad
        quantità lot batch set group subtotal cumulative cumulated accumulated aggregate overall combined
        complete rolled roll up rollup rolledup σ ∑ 合計 小計 总 合计 總""",
        # From “net” on: how the mass of a piece was determined.
        """each ea unit units piece pieces pc pcs part item one single 1 1x einzel einzeln stück stk st teil
        pièce unité unitaire pieza unidad ud unitaria unitario pezzo unità 個 单件 単体 件 individual
        component body net netto neto nominal calculated calc estimated measured actual cad""",
    )
)

_FILLERS = {"x", "×", "in", "en", "for", "für", "of", "von", "de", "the", "a"}

_OVER = {"/", "per", "pro", "par", "por", "je"}

_ASSEMBLY = {"assembly", "assy", "baugruppe", "robot", "machine"}

_CLEAR_UNITS = {"kg", "kgs", "mg", "lb", "lbs", "lbm", "oz"}
"""Units that are no other word, wherever they stand in a header."""

_WORD = re.compile(r"[/%]|[^\W_]+|[×∑]")

_BRACKETS = re.compile(r"[\(\[（【<{]([^(\[（【<{)\]）】>}]*+)[\)\]）】>}]")

_CAMEL = re.compile(r"(?<=[a-z])(?=[A-Z][a-z])|(?<=[Σ∑])(?=\w)")

_MASS_WORD = re.compile(r"(?:mass[ae]?|weight|gewicht|poids|masa|peso)\b|重量|質量|质量|질량|무게")


@dataclass(slots=True)
class MassHeader:
    """A mass column's header.

    title
        the words that remain: "mass" of "Mass (each) [g]".
    unit
        of its cells, "" if it states none.
    total
        True if a cell is the mass of the whole row.
    strange
        what stands in brackets and is not understood.
    rate
        True if a cell is no mass of one piece or row: "kg/m", "g/cm3", "%", "10^3 kg", "kg/100 pcs".
    names_masses
        True if a cell may be a mass by a word or a unit, whatever else the header says.
    """

    title: str = ""
    unit: str = ""
    total: bool = False
    strange: str = ""
    rate: bool = False
    names_masses: bool = False


def read_mass_header(cell: str) -> MassHeader:
    """Take a header apart; works for any text, even the header of something other than masses."""
    text = plain_text(cell)
    header = MassHeader()
    for bracket in _BRACKETS.findall(text):
        plain = bracket.strip().rstrip(".")
        if not header.unit and unit_factor(plain) is not None:
            header.unit = plain  # "lb f"
        elif _read_words(bracket, header):
            header.strange = ", ".join(filter(None, (header.strange, bracket.strip())))
    header.names_masses = header.unit not in ("", "t", *FORCE_UNITS)
    # "Mass (unit) × qty" is the row's: each says what is multiplied.
    header.title = " ".join(_read_words(_CAMEL.sub(" ", _BRACKETS.sub(" ", text)), header, title=True))
    header.names_masses |= header.unit.casefold() in _CLEAR_UNITS
    header.names_masses |= _MASS_WORD.search(header.title) is not None
    return header


def _read_words(text: str, header: MassHeader, *, title: bool = False) -> list[str]:
    """Put what the words mean into ``header``; returns the words that mean nothing to us."""
    kept: list[str] = []
    over = False
    for index, word in enumerate(_WORD.findall(text)):
        low = word.casefold()
        first = title and not index
        if low in _OVER:
            over = not first
        elif low in _TOTAL or (over and low in _ASSEMBLY):
            header.total = True
        elif low in _EACH:
            continue
        elif not header.unit and unit_factor(word) is not None and (not first or low in _CLEAR_UNITS):
            header.unit = word  # "mass_kg", "Gewicht in kg", "Masse/g"; the first word only if it is clear
        elif over or low == "%" or (not first and any(letter.isdigit() for letter in low)):
            header.rate = True  # kg/m, g/cm3, 1000 kg
        elif low not in _FILLERS:
            kept.append(low)
    return kept
