# SPDX-License-Identifier: LGPL-2.1-or-later
"""The rows of a price list: an item as a supplier sells it, with the price of one piece from each quantity
on.

A price of 100 pieces ("Price per 100", "Preiseinheit"), of a pack ("Price per pack") or of a unit is
divided exactly. Prices stand in one column ("1: 0.12; 100: 0.10"), in several ("Price 1", "Price 100"), or
in several rows with a "from quantity"; a plain "quantity" is that where a supplier part has several rows.
What can be meant in two ways is a problem of the row: a single "Price 100", a currency in the cell and
another in its column, a basis that is no number of pieces.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal

from silo.bom.headers import Heading
from silo.bom.message import message
from silo.bom.numbers import Mark, parse_number
from silo.bom.units import UnitKind, known_unit
from silo.tables.bom_rows import refuse_clashes
from silo.tables.columns import cell_at
from silo.tables.heading_detail import PriceHeading, currency_of_word, days_of_heading
from silo.tables.kind import TableKind, heading_role
from silo.tables.numerals import Numerals
from silo.tables.read_rows import ReadRows, rows_of
from silo.tables.sheet import Sheet
from silo.tables.totals import is_total
from silo.workbook.sheet import SheetRow

ROLES = (
    Heading.PART_NUMBER,
    Heading.SUPPLIER,
    Heading.SUPPLIER_NUMBER,
    Heading.LINK,
    Heading.PACK_SIZE,
    Heading.MINIMUM,
    Heading.PRICE,
    Heading.PRICE_BASIS,
    Heading.FROM_QUANTITY,
    Heading.CURRENCY,
    Heading.LEAD_TIME,
    Heading.PREFERRED,
)


def _role_of(cell: str) -> tuple[str, int] | None:
    """Find the role of a heading; a plain quantity may be the one from which a price counts."""
    found = heading_role(cell)
    return (Heading.FROM_QUANTITY, 50 + found[1]) if found and found[0] == Heading.QUANTITY else found


PRICES = TableKind(
    roles=ROLES,
    naming=(Heading.PART_NUMBER,),
    needed=(Heading.PART_NUMBER, Heading.SUPPLIER),
    single=tuple(role for role in ROLES if role is not Heading.PRICE),
    role_of=_role_of,
)
_NAMING = (Heading.PART_NUMBER, Heading.SUPPLIER, Heading.SUPPLIER_NUMBER)
_NUMBERS = (Heading.PACK_SIZE, Heading.MINIMUM, Heading.FROM_QUANTITY)
_PER_WORD = re.compile(r"(?:per|pro|par|je|für|/)\s{0,3}", re.IGNORECASE)


_SMALLEST = Decimal("1e-12")


@dataclass(frozen=True, slots=True)
class PriceRow:
    """A row of a price list.

    texts
        role → text of the cell; numbers in their plain form.
    prices
        (from quantity, price of one) pairs, as the row states them.
    """

    line: int
    texts: Mapping[str, str]
    prices: tuple[tuple[Decimal, Decimal], ...] = ()
    problems: tuple[str, ...] = ()
    left_out: str = ""


PriceRows = ReadRows[PriceRow]


def price_rows(sheet: Sheet, mark: Mark | None = None) -> PriceRows:
    """Read the rows. InputError if two columns of one meaning differ."""
    refuse_clashes(sheet, PRICES)
    at = sheet.columns.at
    numerals = {role: Numerals.of(sheet, at.get(role), mark) for role in (*_NUMBERS, Heading.PRICE_BASIS)}
    prices = [(head, Numerals.of(sheet, index, mark), index) for index, head in sheet.columns.prices]
    bare = [head for head, _, _ in prices if head.bare]
    lone = bool(bare) and not sheet.columns.chosen and (len(prices) == 1 or all(h.least != 1 for h in bare))
    scales = _scales(sheet)
    rows = []
    for row in sheet.rows:
        if is_total([cell_at(row.cells, at.get(role)) for role in _NAMING], row.cells):
            rows.append(PriceRow(row.line, {}, left_out=message("a sum, no part")))
            continue
        problems: list[str] = []
        texts = {role: cell_at(row.cells, index) for role, index in at.items() if role != Heading.PRICE}
        for role in _NUMBERS:
            if texts.get(role):
                _plain(role, numerals[role], row, texts, problems)
        if scales is not None and scales[_supplier_part(sheet, row)] < 2 and texts.get(Heading.FROM_QUANTITY):
            _one_quantity(sheet, texts, problems)
        _days(sheet, texts, problems)
        given: list[tuple[Decimal, Decimal]] = []
        for head, numeral, index in prices:
            if not cell_at(row.cells, index):
                continue
            title = sheet.header[index].strip()
            if lone and head.bare:
                least = f"{head.least:f}"
                problems.append(
                    message(
                        "Price: “{title}” can be the price of {least} or the price of one from {least} on; "
                        "write “Price per {least}” or “Price from {least}”",
                        title=title,
                        least=least,
                    )
                )
                continue
            if head.strange and not sheet.columns.chosen:
                problems.append(
                    message(
                        "Price: “{title}” has the unknown word “{strange}”", title=title, strange=head.strange
                    )
                )
            given += _prices(row, head, numeral, texts, numerals[Heading.PRICE_BASIS], problems)
        rows.append(PriceRow(row.line, texts, tuple(given), tuple(problems)))
    return rows_of(sheet, rows)


def _scales(sheet: Sheet) -> Counter[tuple[str, ...]] | None:
    """Count the rows of each supplier part, if a plain quantity stands beside the prices; else None."""
    index = sheet.columns.at.get(Heading.FROM_QUANTITY)
    if index is None or sheet.columns.chosen:
        return None
    found = heading_role(sheet.header[index])
    if found is None or found[0] != Heading.QUANTITY:
        return None
    return Counter(_supplier_part(sheet, row) for row in sheet.rows)


def _supplier_part(sheet: Sheet, row: SheetRow) -> tuple[str, ...]:
    return tuple(cell_at(row.cells, sheet.columns.at.get(role)).casefold() for role in _NAMING)


def _one_quantity(sheet: Sheet, texts: Mapping[str, str], problems: list[str]) -> None:
    """Ask what a single quantity beside a price means, unless it is 1."""
    quantity = parse_number(texts[Heading.FROM_QUANTITY])
    if quantity is not None and quantity.exact != 1:
        title = sheet.header[sheet.columns.at[Heading.FROM_QUANTITY]].strip()
        problems.append(
            message(
                "Price: “{title}” {quantity} can be the quantity from which the price counts, or the number "
                "of pieces that cost it; call the column “From quantity” or “Price per”",
                title=title,
                quantity=texts[Heading.FROM_QUANTITY],
            )
        )


def _plain(role: str, numerals: Numerals, row: SheetRow, texts: dict[str, str], problems: list[str]) -> None:
    amount = numerals.read(row)
    if amount.value is None or amount.currency:
        words = amount.problem or message("wanted a number, got {role}", role=repr(texts[role][:40]))
        problems.append(message("{role}: {words}", role=role.replace("_", " ").capitalize(), words=words))
    else:
        texts[role] = f"{amount.value:f}"


def _days(sheet: Sheet, texts: dict[str, str], problems: list[str]) -> None:
    text = texts.get(Heading.LEAD_TIME)
    if not text:
        return
    title = sheet.header[sheet.columns.at[Heading.LEAD_TIME]]
    days = days_of_heading(title)
    if days is None:
        problems.append(message("Lead time: “{title}” is neither in days nor in weeks", title=title.strip()))
    elif days != 1 and text.isascii() and text.isdigit() and len(text) < 6:
        texts[Heading.LEAD_TIME] = str(int(text) * days)


def _prices(
    row: SheetRow,
    head: PriceHeading,
    numeral: Numerals,
    texts: dict[str, str],
    basis: Numerals,
    problems: list[str],
) -> list[tuple[Decimal, Decimal]]:
    """Read the prices of one cell, each as (from quantity, price of one)."""
    per = _basis(row, head, texts, basis, problems)
    from_row = parse_number(texts.get(Heading.FROM_QUANTITY, ""))
    found = []
    text = row.cells[numeral.index] if numeral.index is not None else ""
    is_number = numeral.index in row.numbers
    for written in filter(None, map(str.strip, re.split("[;\n]", text))):
        least_text, colon, price_text = written.rpartition(":")
        price = numeral.read_text(price_text, is_number=is_number)
        least = head.least or (from_row.exact.normalize() if from_row else Decimal(1))
        if colon:
            quantity = numeral.read_text(least_text)
            if quantity.value is None:
                problems.append(message("Price: {problem}", problem=quantity.problem))
                continue
            least = quantity.value
        if price.value is None:
            problems.append(message("Price: {problem}", problem=price.problem))
            continue
        _currency(head, price.currency, texts, problems)
        if price.unit:
            problems.append(message("Price: wanted a price, got {written}", written=repr(written[:40])))
        found.append((least, _divided(price.value, per)))
    return found


def _basis(
    row: SheetRow, head: PriceHeading, texts: Mapping[str, str], basis: Numerals, problems: list[str]
) -> Decimal:
    """Return for how many pieces a price is."""
    if head.per_unit is not None:
        problems.append(
            message(
                "Price: is the price of 1 {symbol}; wanted the price of pieces", symbol=head.per_unit.symbol
            )
        )
    per = head.per
    if head.per_pack:
        pack = parse_number(texts.get(Heading.PACK_SIZE, ""))
        if pack is None or pack.exact <= 0:
            problems.append(message("Price: is the price of a pack, and the row has no pack size"))
        else:
            per = pack.exact
    text = texts.get(Heading.PRICE_BASIS, "")
    if not text:
        return per
    bare = _PER_WORD.sub("", text, count=1) if _PER_WORD.match(text) else text
    unit = known_unit(bare)
    amount = basis.read_text(bare, is_number=basis.index in row.numbers)
    if unit is not None and unit.kind is UnitKind.PIECES:
        return per
    if amount.value is None or amount.value <= 0 or amount.unit or amount.currency or per != 1:
        problems.append(
            message("Price basis: wanted a number of pieces such as 100, got {text}", text=repr(text[:40]))
        )
        return per
    return amount.value


def _currency(head: PriceHeading, in_cell: str, texts: dict[str, str], problems: list[str]) -> None:
    """Take the currency of the column, the heading or the cell; two that differ are a problem."""
    own = texts.get(Heading.CURRENCY, "")
    said = {code for code in (currency_of_word(own) or own.upper(), head.currency, in_cell) if code}
    if len(said) > 1:
        problems.append(message("Currency: the row says {said}", said=" and ".join(sorted(said))[:60]))
    elif said:
        texts[Heading.CURRENCY] = said.pop()


def _divided(price: Decimal, per: Decimal) -> Decimal:
    """Divide a price; exact as long as the result has at most 12 decimals."""
    if per == 1:
        return price
    value = (price / per).normalize()
    places = value.as_tuple().exponent
    return value.quantize(_SMALLEST) if isinstance(places, int) and places < -12 else value
