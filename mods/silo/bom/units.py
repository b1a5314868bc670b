# SPDX-License-Identifier: LGPL-2.1-or-later
"""The units of quantities: what a spelling means, which units convert, and by which factor.

========  =========================================  ==================
kind      units                                      base
========  =========================================  ==================
pieces    pcs                                        pcs
length    mm, cm, dm, m, km, in, ft                  m
area      mm², cm², m²                               m²
volume    ml, cl, l, cm³, m³                         l
mass      mg, g, kg, t                               kg
time      s, min, h                                  h
========  =========================================  ==================

The rules:

* no unit means the unit of the item; an item without a unit counts pieces;
* CAD counts pieces: a line of an assembly without a unit is in pieces, whatever the unit of the item is;
* units of one kind convert exactly, in decimals; units of two kinds do not convert: that is an open question;
* spellings are read in upper and lower case, and in the languages of the tables that companies bring. ``M``
  and ``MM`` are lengths; a spelling that two units share is not read;
* a word that is no unit of this table ("box", "roll") is a unit of its own: it equals itself only.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from enum import StrEnum

from silo.bom.quantities import exact_product, same_quantity


class UnitKind(StrEnum):
    """What a unit measures."""

    PIECES = "pieces"
    LENGTH = "length"
    AREA = "area"
    VOLUME = "volume"
    MASS = "mass"
    TIME = "time"
    OTHER = "other"  # a word that we do not know, such as "box"


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit.

    symbol
        as it is written and stored.
    kind
        what it measures.
    factor
        [base units of its kind in 1 of this unit], exact.
    """

    symbol: str
    kind: UnitKind
    factor: Decimal = Decimal(1)

    def converts_to(self, other: Unit) -> bool:
        """Return True if a quantity in this unit has an equal one in the other."""
        if self.kind is UnitKind.OTHER:
            return other.kind is UnitKind.OTHER and self.symbol.casefold() == other.symbol.casefold()
        return self.kind is other.kind

    @property
    def counts_pieces(self) -> bool:
        """Return True for the unit in which CAD counts."""
        return self.kind is UnitKind.PIECES


PIECES = Unit("pcs", UnitKind.PIECES)

# Symbol, kind, factor, and the spellings beside the symbol; in lower case, without a full stop at the end.
_TABLE: tuple[tuple[str, UnitKind, str, str], ...] = (
    (
        "pcs",
        UnitKind.PIECES,
        "1",
        "pc piece pieces ea each unit units x × stk stck st stück stueck stücke pz pezzi szt ks db шт "
        "個 个 件 pièce pièces pce pces pieza piezas ud uds",
    ),
    ("mm", UnitKind.LENGTH, "0.001", "millimeter millimeters millimetre millimetres"),
    ("cm", UnitKind.LENGTH, "0.01", "centimeter centimeters centimetre centimetres zentimeter"),
    ("dm", UnitKind.LENGTH, "0.1", "decimeter decimetre dezimeter"),
    (
        "m",
        UnitKind.LENGTH,
        "1",
        "meter meters metre metres mtr mtrs lfm lfdm lm laufmeter meter(s) mètre mètres metro metros",
    ),
    ("km", UnitKind.LENGTH, "1000", "kilometer kilometers kilometre kilometres"),
    ("in", UnitKind.LENGTH, "0.0254", 'inch inches zoll ″ "'),
    ("ft", UnitKind.LENGTH, "0.3048", "foot feet fuß fuss"),
    ("mm²", UnitKind.AREA, "0.000001", "mm2 mm^2 sqmm qmm"),
    ("cm²", UnitKind.AREA, "0.0001", "cm2 cm^2 sqcm qcm"),
    ("m²", UnitKind.AREA, "1", "m2 m^2 sqm qm quadratmeter"),
    ("ml", UnitKind.VOLUME, "0.001", "milliliter milliliters millilitre millilitres"),
    ("cl", UnitKind.VOLUME, "0.01", "centiliter centilitre zentiliter"),
    ("l", UnitKind.VOLUME, "1", "ltr lt liter liters litre litres"),
    ("cm³", UnitKind.VOLUME, "0.001", "cm3 cm^3 ccm cc"),
    ("m³", UnitKind.VOLUME, "1000", "m3 m^3 cbm kubikmeter"),
    ("mg", UnitKind.MASS, "0.000001", "milligram milligrams milligramm"),
    ("g", UnitKind.MASS, "0.001", "gr gram grams gramm gramme grammes"),
    ("kg", UnitKind.MASS, "1", "kgs kilo kilos kilogram kilograms kilogramm kilogramme"),
    ("t", UnitKind.MASS, "1000", "to ton tonne tonnes tonnen"),
    ("s", UnitKind.TIME, "0.0002777777777777777777777777778", "sec secs second seconds sek sekunde sekunden"),
    ("min", UnitKind.TIME, "0.01666666666666666666666666667", "mins minute minutes minuten"),
    ("h", UnitKind.TIME, "1", "hr hrs hour hours std stunde stunden"),
)
UNITS: dict[str, Unit] = {symbol: Unit(symbol, kind, Decimal(factor)) for symbol, kind, factor, _ in _TABLE}
_SPELLINGS: dict[str, Unit] = {
    spelling: UNITS[symbol] for symbol, _, _, also in _TABLE for spelling in (symbol, *also.split())
}


def known_unit(text: str) -> Unit | None:
    """Return the unit that a spelling means; None for a word that is not in the table, and for no word."""
    return _SPELLINGS.get(text.strip().rstrip(".").casefold())


def unit_of(text: str | None, item_unit: str | None = None) -> Unit:
    """Return the unit of a line or item: that of its text, else of its item, else pieces."""
    for given in (text, item_unit):
        if given and given.strip():
            return known_unit(given) or Unit(" ".join(given.split()), UnitKind.OTHER)
    return PIECES


def line_unit(text: str | None, item_unit: str | None, *, from_cad: bool) -> Unit:
    """Return the unit of a BOM line. ``from_cad``: its quantity is that of the assembly."""
    return unit_of(text, None if from_cad else item_unit)


def counts_pieces(text: str | None, item_unit: str | None = None) -> bool:
    """Return True if a line that a user owns is in pieces, in which CAD counts."""
    return unit_of(text, item_unit).counts_pieces


def says_the_same(
    cad_quantity: object, quantity: object, unit: str | None, item_unit: str | None = None
) -> bool:
    """Return True if a line that a user owns has as many pieces as CAD."""
    return counts_pieces(unit, item_unit) and same_quantity(cad_quantity, quantity)


def stored_unit(text: str | None) -> str | None:
    """Write a unit in its one form: ``pcs`` for "Stk."; a word that is no unit as it is; None for no word."""
    if text is None or not text.strip():
        return None
    return unit_of(text).symbol


def converted(quantity: Decimal, unit: Unit, into: Unit) -> Decimal | None:
    """Return the quantity in the other unit, exactly: 500 mm is 0.5 m. None if the units do not convert."""
    if not unit.converts_to(into):
        return None
    if unit.factor == into.factor:
        return quantity
    if into.factor <= 1 and (whole := 1 / into.factor) == whole.to_integral_value():
        return _plain(exact_product((quantity, unit.factor, whole)))
    return _plain(exact_product((quantity, unit.factor)) / into.factor)


def _plain(value: Decimal) -> Decimal:
    """Drop zeros behind the last digit, and write no exponent: 500, not 5E+2."""
    return Decimal(f"{value.normalize():f}")
