# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a heading says beside its role: "Price (EUR) per 100", "Preis ab 50", "Menge [m]", "Lead time
(weeks)".
"""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass
from decimal import Decimal

from silo.bom.headers import BRACKET, Heading, alias
from silo.bom.units import Unit, UnitKind, known_unit
from silo.tables.limits import LONGEST_HEADING

SIGNS = {"€": "EUR", "$": "USD", "£": "GBP", "¥": "JPY", "chf": "CHF", "fr": "CHF", "zł": "PLN", "kč": "CZK"}
"""Signs and words of currencies. A sign that several currencies have stands for the one that is met most."""

_CODE_LIST = """EUR USD CHF GBP JPY CNY SEK NOK DKK PLN CZK HUF RON BGN TRY AUD CAD NZD INR KRW TWD HKD SGD
    BRL
    MXN ZAR ILS UAH ISK THB MYR IDR VND PHP AED SAR"""
CODES = frozenset(_CODE_LIST.split())
_PACK_WORDS = "pack packs package vpe ve packung packungen box packaging lot"
_PER_WORDS = "per pro par por je / für for"
_FROM_WORDS = "ab from qty quantity menge @ ≥ break staffel at à stück bei"
_NEUTRAL_WORDS = (
    "net netto nett ex excl excluding exkl zzgl vat mwst ht tax in list each one purchase ek einkauf"
)
PACKS, _PER, _FROM, _NEUTRAL = (
    frozenset(words.split()) for words in (_PACK_WORDS, _PER_WORDS, _FROM_WORDS, _NEUTRAL_WORDS)
)
_PACK_PRICES = {"pack price", "packungspreis", "package price", "vpe preis", "price of a pack", "lot price"}
_TOKEN = re.compile(r"[^\W\d_]+|\d+(?:[.,’' ]\d{3})*(?!\d)|[€$£¥/+@≥]")
_MARKS = re.compile(r"[_()\[\]{}（）【】<>:;\-]")


def currency_of_word(word: str) -> str | None:
    """Return the code of a currency's sign, word or code; None for another word."""
    upper = word.strip().upper()
    return upper if upper in CODES else SIGNS.get(word.strip().casefold())


@dataclass(frozen=True, slots=True)
class PriceHeading:
    """What the heading of a price column says.

    per
        the price is that of so many pieces.
    per_pack
        the price is that of a pack.
    per_unit
        the price is that of one of this unit, such as a metre.
    least
        the price counts from this quantity on.
    bare
        True if the number is written without a word: "Price 100" may be per 100 or from 100 on.
    strange
        a word that is not understood.
    """

    per: Decimal = Decimal(1)
    per_pack: bool = False
    per_unit: Unit | None = None
    least: Decimal | None = None
    bare: bool = False
    currency: str = ""
    strange: str = ""


def price_heading(cell: str) -> PriceHeading | None:
    """Read the heading of a price column; None if it does not begin with a word for a price."""
    if len(cell) > LONGEST_HEADING:
        return None
    text = " ".join(
        re.sub(r"[_()\[\]{}（）【】<>:;\-]", " ", unicodedata.normalize("NFKC", cell).casefold()).split()
    )
    currency = ""
    tokens = _TOKEN.findall(text)
    while tokens and (code := currency_of_word(tokens[0])):
        currency, tokens = code, tokens[1:]
    for length in range(min(len(tokens), 6), 0, -1):
        words = " ".join(tokens[:length])
        if words in _PACK_PRICES:
            return _rest(tokens[length:], currency, per_pack=True)
        role = alias(words)
        if role is not None and role[0] is Heading.PRICE:
            return _rest(tokens[length:], currency)
    return None


def _rest(tokens: list[str], currency: str, *, per_pack: bool = False) -> PriceHeading:
    per, least, unit, bare, strange = Decimal(1), None, None, False, ""
    place = 0
    while place < len(tokens):
        token, after = tokens[place], tokens[place + 1] if place + 1 < len(tokens) else ""
        place += 1
        if code := currency_of_word(token):
            currency = code
        elif token in _PER and (number := _whole(after)):
            per, place = number, place + 1
        elif token in _PER and after in PACKS:
            per_pack, place = True, place + 1
        elif token in _PER and (known := known_unit(after)):
            unit, place = (None if known.kind is UnitKind.PIECES else known), place + 1
        elif token in _FROM and (number := _whole(after)):
            least, place = number, place + 1
        elif number := _whole(token):
            least, bare = number, after != "+"
        elif token == "+" or token in _NEUTRAL or _is_pieces(token):
            continue
        else:
            strange = strange or token
    return PriceHeading(per, per_pack, unit, least, bare, currency, strange)


def _whole(token: str) -> Decimal | None:
    digits = re.sub(r"\D", "", token)
    return (
        Decimal(digits) if token[:1].isdecimal() and digits.isascii() and 0 < int(digits) <= 10**9 else None
    )


def _is_pieces(token: str) -> bool:
    unit = known_unit(token)
    return unit is not None and unit.kind is UnitKind.PIECES


def quantity_unit(cell: str) -> str:
    """Return the unit in brackets of a heading of quantities ("Menge [m]"); "" for none, pieces, or other
    words.
    """
    for inside in BRACKET.findall(cell[:LONGEST_HEADING]):
        unit = known_unit(inside.strip())
        if unit is not None and unit.kind is not UnitKind.PIECES:
            return unit.symbol
    return ""


_DAYS = {
    "": 1, "d": 1, "day": 1, "days": 1, "tage": 1, "tag": 1, "jours": 1, "días": 1, "working days": 1,
    "at": 1, "w": 7, "wk": 7, "week": 7, "weeks": 7, "wochen": 7, "woche": 7, "kw": 7, "semaines": 7,
    "semanas": 7,
}  # fmt: skip


def days_of_heading(cell: str) -> int | None:
    """Return how many days 1 is in a column of lead times: 7 for "Lead time (weeks)"; None for unknown
    words.
    """
    inside = [text.strip().casefold() for text in BRACKET.findall(cell[:LONGEST_HEADING])]
    return _DAYS.get(inside[0] if inside else "")
