# SPDX-License-Identifier: LGPL-2.1-or-later
"""Supplier parts: an item as its suppliers sell it, with packs, minimum, price breaks and lead time.

An item has a list of them, which changes as a whole: what a user saves is one change, which can be undone.
An item without a list has the supplier part that its properties state (``supplier``, ``standard_cost``, …).

Money and amounts are decimals, here and in what is stored; the one parser of the project reads them, so
"1,000" is refused with both readings.
"""

from __future__ import annotations

import csv
import io
import json
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import ROUND_CEILING, Decimal
from fractions import Fraction
from math import ceil
from typing import Any, NamedTuple

from sqlalchemy import func, insert, select, update

from silo.bom.errors import ConflictError, InputError, RejectedError, VersionConflictError
from silo.bom.headers import Heading, safe_cell
from silo.bom.message import Message, joined, message
from silo.bom.numbers import Mark, NumberReading, read_number, whole_number, yes_or_no
from silo.bom.quantities import as_decimal, decimal_text, exact_product
from silo.bom.text import character_problem
from silo.tables.price_rows import PRICES, PriceRow, PriceRows, price_rows
from silo.tables.sheet import Layout
from silo.tables.yes_no import read_yes_no
from silo_server.db.rows import one_of
from silo_server.db.state import get_state, put_state
from silo_server.db.tables import items, supplier_changes
from silo_server.db.transaction import Tx
from silo_server.events import announce
from silo_server.fields import from_row
from silo_server.services import audit
from silo_server.services.import_file import read_import
from silo_server.services.import_log import Done, log_import
from silo_server.services.items import get_by_numbers, get_item, to_item
from silo_server.services.product.parts import DEFAULT_CURRENCY, RolledItem, currency_of, positive_number
from silo_server.services.search import index_item
from silo_server.user_json import dumps
from silo_server.values import Item
from silo_server.web_address import address_problem

# The columns of the table in which people edit supplier parts, paste them and import them.
COLUMNS: Mapping[str, str] = {
    "supplier": "Supplier",
    "number": "Supplier's part number",
    "link": "Link",
    "pack_size": "Pack size",
    "minimum": "Minimum",
    "prices": "Price of one, by quantity",
    "currency": "Currency",
    "lead_time_days": "Lead time [days]",
    "preferred": "Preferred",
}
# The columns of an export, in the place of that of the prices.
_BREAK = ("From quantity", "Price")
EXAMPLES = {"prices": "1: 0.50; 100: 0.40", "link": "https://…"}
_RATES = "currency_rates"
_CODE = re.compile("[A-Z]{3}")
MOST_PARTS, MOST_PRICES = 50, 30
_LONGEST = {"supplier": 200, "number": 200}
LARGEST_AMOUNT, LARGEST_PRICE = Decimal(10) ** 9, Decimal(10) ** 12
LONGEST_LEAD_TIME = 3650


class SupplierPart(NamedTuple):
    """An item as a supplier sells it.

    prices
        (quantity, price of one piece) pairs, by quantity: a price counts from its quantity on.
    """

    supplier: str
    number: str = ""
    link: str = ""
    pack_size: Decimal = Decimal(1)
    minimum: Decimal = Decimal(0)
    prices: tuple[tuple[Decimal, Decimal], ...] = ()
    currency: str = "EUR"
    lead_time_days: int | None = None
    preferred: bool = False

    @property
    def key(self) -> tuple[str, str]:
        """Return what no two supplier parts of an item may share."""
        return self.supplier.casefold(), self.number.casefold()

    def amount(self, needed: Decimal, *, whole: bool = True) -> Decimal:
        """Find the amount to order if ``needed`` is needed: at least the minimum, in whole packs; 0 for 0.

        Not ``whole``: a pack of 1 is no pack, for what is measured and not counted: half a metre is sold.
        """
        if not needed:
            return Decimal(0)
        wanted = max(needed, self.minimum)
        if self.pack_size == 1:
            return wanted.to_integral_value(ROUND_CEILING) if whole else wanted
        packs = ceil(Fraction(wanted) / Fraction(self.pack_size))
        return exact_product((packs, self.pack_size))

    def price_at(self, amount: Decimal) -> Decimal | None:
        """Find the price of one if ``amount`` is ordered; None below the first price.

        A price from 1 on is that of less than 1 too: half a metre at 10 EUR/m.
        """
        for least, price in reversed(self.prices):
            if least <= max(amount, Decimal(1)):
                return price
        return None


class SupplierOffer(NamedTuple):
    """A supplier part for an order: how much, its price and cost, and that in the site's currency.

    cheaper
        (amount, cost) of a larger order that costs less, if there is one.
    """

    of: SupplierPart
    amount: Decimal
    price: Decimal | None
    cost: Decimal | None
    in_base: Decimal | None
    cheaper: tuple[Decimal, Decimal] | None = None


def choose(
    parts: Sequence[SupplierPart], needed: Decimal, rates: Mapping[str, Decimal], *, whole: bool = True
) -> SupplierOffer | None:
    """Choose the preferred supplier part, else the cheapest for what is needed; None if there is none.

    rates
        what one of a currency is in the site's own. What cannot be compared comes behind what can.
    whole
        as in :meth:`SupplierPart.amount`.
    """
    offers = [_offer(part, needed, rates, whole) for part in parts]
    if len(offers) < 2:
        return offers[0] if offers else None
    offers = [offer for offer in offers if offer.of.preferred] or offers
    compared = [(offer.in_base, place) for place, offer in enumerate(offers) if offer.in_base is not None]
    if compared:
        return offers[min(compared)[1]]
    return next((offer for offer in offers if offer.cost is not None), offers[0])


def _offer(part: SupplierPart, needed: Decimal, rates: Mapping[str, Decimal], whole: bool) -> SupplierOffer:
    def cost_of(amount: Decimal) -> Decimal | None:
        price = part.price_at(amount)
        return None if price is None else exact_product((amount, price))

    amount = part.amount(needed, whole=whole)
    price, rate = part.price_at(amount), rates.get(part.currency)
    cost = cost_of(amount)
    in_base = None if cost is None or rate is None else exact_product((cost, rate))
    larger = {part.amount(least, whole=whole) for least, _ in part.prices if least > amount}
    cheaper = [
        (more, other) for other in larger if (more := cost_of(other)) is not None and more < (cost or 0)
    ]
    best = min(cheaper, default=None)
    return SupplierOffer(part, amount, price, cost, in_base, best and (best[1], best[0]))


def supplier_parts_of(item: Item | RolledItem) -> list[SupplierPart]:
    """Read the supplier parts of an item; if there is no list, the one that its properties state."""
    if item.supplier_parts:
        return [from_json(part) for part in item.supplier_parts]
    facts = item.properties
    supplier = facts.get("supplier")
    if not isinstance(supplier, str) or not supplier.strip():
        return []
    number = str(facts.get("supplier_part_number") or "")[:200].strip()
    cost, currency = positive_number(facts, "standard_cost"), currency_of(facts)
    known = cost is not None and cost <= LARGEST_PRICE and _CODE.fullmatch(currency) is not None
    lead_time = facts.get("lead_time_days")
    days = None if lead_time is None else whole_number(str(lead_time).strip(), 4)
    part = SupplierPart(
        supplier.strip()[:200],
        "" if number and character_problem(number) else number,
        prices=((Decimal(1), as_decimal(cost)),) if known and cost is not None else (),
        currency=currency if known else DEFAULT_CURRENCY,
        lead_time_days=None if days is None or days > LONGEST_LEAD_TIME else days,
    )
    return [part]


def to_json(part: SupplierPart) -> dict[str, Any]:
    """Write a supplier part as it is stored and sent (:class:`silo.api.wire.SupplierPart`)."""
    return {
        "supplier": part.supplier,
        "number": part.number,
        "link": part.link,
        "pack_size": decimal_text(part.pack_size),
        "minimum": decimal_text(part.minimum),
        "prices": [{"quantity": decimal_text(q), "price": decimal_text(p)} for q, p in part.prices],
        "currency": part.currency,
        "lead_time_days": part.lead_time_days,
        "preferred": part.preferred,
    }


def from_json(made: Mapping[str, Any]) -> SupplierPart:
    """Read a supplier part that :func:`to_json` wrote."""
    prices = tuple((Decimal(price["quantity"]), Decimal(price["price"])) for price in made["prices"])
    sizes = {name: Decimal(made[name]) for name in ("pack_size", "minimum")}
    return SupplierPart(**{**made, **sizes, "prices": prices})


def texts_of(part: SupplierPart, write: Callable[[Decimal], str] = decimal_text) -> dict[str, str]:
    """Write a supplier part as the cells of its row, which :func:`read_parts` reads.

    write
        writes a number as the reader does; :func:`numbers_of` reads it back, also 1.234.
    """
    days = part.lead_time_days
    return {
        "supplier": part.supplier,
        "number": part.number,
        "link": part.link,
        "pack_size": write(part.pack_size),
        "minimum": write(part.minimum) if part.minimum else "",
        "prices": "; ".join(f"{write(least)}: {write(price)}" for least, price in part.prices),
        "currency": part.currency,
        "lead_time_days": "" if days is None else str(days),
        "preferred": "yes" if part.preferred else "",
    }


def numbers_of(
    parts: Iterable[SupplierPart], write: Callable[[Decimal], str] = decimal_text
) -> dict[str, Decimal]:
    """Return each number in the cells of these parts as :func:`texts_of` writes it: its text → itself."""
    numbers: set[Decimal] = set()
    for part in parts:
        numbers |= {part.pack_size, part.minimum, *(number for pair in part.prices for number in pair)}
    return {write(number): number for number in numbers}


@dataclass(frozen=True, slots=True)
class _Reader:
    """Reads the cells of a row. ``dot``, ``mark``: as :func:`silo.bom.numbers.read_number`.

    known
        what the page showed: a text of these has one meaning, also where it could have two.
    """

    mark: Mark | None = None
    dot: bool = False
    currency: str = "EUR"
    known: Mapping[str, Decimal] = field(default_factory=dict)

    def read(self, cells: Mapping[str, str]) -> tuple[SupplierPart, list[str]]:
        """Read a row: the part, and what is wrong with it. If something is wrong, ignore the part."""
        problems: list[str] = []

        def amount(name: str, text: str, least: Decimal, most: Decimal) -> Decimal:
            reading = read_number(text, self.mark, points_are_decimal=self.dot)
            if (shown := self.known.get(text.strip())) is not None:
                reading = NumberReading(shown, "")
            if reading.value is not None and least <= reading.value <= most and _places(reading.value) >= -12:
                return reading.value
            wanted = message(
                "wanted a number from {least} to {most} with at most 12 decimals, got {got}",
                least=f"{least:f}",
                most=f"{most:f}",
                got=repr(text[:40]),
            )
            problems.append(_about(name, reading.problem or wanted))
            return Decimal(1)

        row = {name: cells.get(name, "").strip() for name in COLUMNS}
        tiny = Decimal("0.000001")
        if not row["supplier"]:
            problems.append(message("Supplier: wanted a name, got nothing"))
        for name, longest in _LONGEST.items():
            problem = character_problem(row[name])
            if not problem and len(row[name]) > longest:
                problem = message(
                    "wanted at most {most} characters, got {length}", most=longest, length=len(row[name])
                )
            if problem:
                problems.append(_about(name, problem))
        if row["link"] and (problem := address_problem(row["link"])):
            problems.append(_about("link", problem))
        prices: dict[Decimal, Decimal] = {}
        for written in filter(None, map(str.strip, re.split("[;\n]", row["prices"]))):
            least, colon, price = written.rpartition(":")
            at = amount("prices", least, tiny, LARGEST_AMOUNT) if colon else Decimal(1)
            if at in prices:
                problems.append(
                    _about("prices", message("there are two prices from {quantity} on", quantity=f"{at:f}"))
                )
            prices[at] = amount("prices", price, Decimal(0), LARGEST_PRICE)
        if len(prices) > MOST_PRICES:
            many = message("wanted at most {most} of them, got {n}", most=MOST_PRICES, n=len(prices))
            problems.append(_about("prices", many))
        currency = row["currency"].upper() or self.currency
        if not _CODE.fullmatch(currency):
            problems.append(
                message(
                    "Currency: wanted three letters such as EUR, got {currency}", currency=repr(currency[:40])
                )
            )
        days = whole_number(row["lead_time_days"], 4)
        if row["lead_time_days"] and (days is None or days > LONGEST_LEAD_TIME):
            wrong = row["lead_time_days"][:40]
            problems.append(
                message(
                    "Lead time [days]: wanted a whole number up to {most}, got {got}",
                    most=LONGEST_LEAD_TIME,
                    got=repr(wrong),
                )
            )
        word = row["preferred"].casefold()
        preferred = word in ("x", "✓", "✔", "y") or (yes_or_no(word) if word else False)
        if preferred is None:
            problems.append(
                message("Preferred: wanted yes or nothing, got {got}", got=repr(row["preferred"][:40]))
            )
        part = SupplierPart(
            row["supplier"],
            row["number"],
            row["link"],
            amount("pack_size", row["pack_size"], tiny, LARGEST_AMOUNT) if row["pack_size"] else Decimal(1),
            amount("minimum", row["minimum"], Decimal(0), LARGEST_AMOUNT) if row["minimum"] else Decimal(0),
            tuple(sorted(prices.items())),
            currency,
            days,
            bool(preferred),
        )
        return part, problems


def _places(value: Decimal) -> int:
    exponent = value.normalize().as_tuple().exponent
    return exponent if isinstance(exponent, int) else -99


def read_parts(
    tx: Tx,
    rows: Sequence[Mapping[str, str]],
    *,
    dot: bool = False,
    known: Mapping[str, Decimal] | None = None,
) -> list[SupplierPart]:
    """Read a table that a user filled in, without its empty rows. RejectedError lists all problems.

    known
        the numbers that the page showed (:func:`numbers_of`).
    """
    reader = _Reader(None, dot, next(iter(rates_of(tx))), known or {})
    read = [
        (number, *reader.read(cells))
        for number, cells in enumerate(rows, start=1)
        if any(text.strip() for text in cells.values())
    ]
    problems: list[str] = [
        message("row {row}: {problem}", row=number, problem=problem)
        for number, _, wrong in read
        for problem in wrong
    ]
    parts = [part for _, part, _ in read]
    problems += list_problems(parts)
    if problems:
        raise RejectedError(joined("; ", problems[:5]), problems)
    return parts


def list_problems(parts: Sequence[SupplierPart]) -> list[str]:
    """List what is wrong with the supplier parts of an item as a whole."""
    if len(parts) > MOST_PARTS:
        return [
            message("wanted at most {most} supplier parts of an item, got {n}", most=MOST_PARTS, n=len(parts))
        ]
    counts = Counter(supplier_part.key for supplier_part in parts)
    problems: list[str] = [
        message(
            "{supplier_part} stands here twice; put all its prices into one row",
            supplier_part=f"{part.supplier} {part.number}".strip(),
        )
        for part in {supplier_part.key: supplier_part for supplier_part in parts}.values()
        if counts[part.key] > 1
    ]
    if sum(part.preferred for part in parts) > 1:
        problems.append(message("Preferred: wanted one supplier at most, got several"))
    return problems


def _about(name: str, problem: str) -> Message:
    """Say in which column the problem is."""
    return message("{column}: {problem}", column=Message(COLUMNS[name]), problem=problem)


def _changed(name: str, before: str, after: str) -> Message:
    """Say what a column had before and has now; the script for translations knows the columns."""
    column = COLUMNS[name].lower().replace(",", "")
    return Message(f"{column} {{before}} → {{after}}", {"before": before or "–", "after": after or "–"})


@dataclass(frozen=True, slots=True)
class SupplierChange:
    """A change of an item's list: the whole of it before and after, as JSON."""

    id: int
    at: str
    username: str
    before: str
    after: str

    @property
    def words(self) -> list[str]:
        """Describe the change in words."""
        old, new = (
            {part.key: part for part in map(from_json, json.loads(t))} for t in (self.before, self.after)
        )
        lines: list[str] = []
        for key in dict.fromkeys([*old, *new]):
            part = new.get(key) or old[key]
            who = f"{part.supplier} {part.number}".strip()
            if key not in old or key not in new:
                lines.append(
                    message("{supplier_part} added", supplier_part=who)
                    if key in new
                    else message("{supplier_part} removed", supplier_part=who)
                )
                continue
            before, after = texts_of(old[key]), texts_of(new[key])
            changes = [
                _changed(name, before[name], after[name]) for name in COLUMNS if before[name] != after[name]
            ]
            words = joined(", ", changes) if changes else ""
            lines += (
                [message("{supplier_part} changed: {words}", supplier_part=who, words=words)] if words else []
            )
        return lines or [message("the order of the list")]


def supplier_changes_of(tx: Tx, item: Item, limit: int = 20) -> list[SupplierChange]:
    """Read the newest changes of an item's list, newest first."""
    row = supplier_changes.c
    query = select(supplier_changes).where(row.item_id == item.id).order_by(row.id.desc()).limit(limit)
    return [from_row(SupplierChange, record) for record in tx.conn.execute(query)]


def list_version(tx: Tx, item: Item) -> int:
    """Find the number of the newest change of an item's list; 0 before the first."""
    row = supplier_changes.c
    return tx.conn.scalar(select(func.max(row.id)).where(row.item_id == item.id)) or 0


def set_supplier_parts(
    tx: Tx, part_number: str, parts: Sequence[SupplierPart], expected: int | None = None
) -> tuple[Item, int]:
    """Replace an item's list; return the item and the number of the change (0: none).

    Raises VersionConflictError unless the list still has the ``expected`` version.
    """
    item = get_item(tx, part_number, lock=True)
    now = list_version(tx, item)
    if expected is not None and expected != now:
        raise VersionConflictError(
            message(
                "the suppliers of {part_number} have version {version}, the request was made from version "
                "{expected}; look at them again and repeat",
                part_number=item.part_number,
                version=now,
                expected=expected,
            )
        )
    if list(parts) == supplier_parts_of(item):
        return item, 0
    return _write(tx, item, [to_json(part) for part in parts])


def undo_supplier_change(tx: Tx, part_number: str, change: int) -> Item:
    """Undo the newest change of an item's list. ConflictError if another one came since."""
    item = get_item(tx, part_number, lock=True)
    newest = next(iter(supplier_changes_of(tx, item, 1)), None)
    if newest is None or newest.id != change:
        raise ConflictError(
            message(
                "the suppliers of {part_number} were changed since; only the newest change can be undone",
                part_number=item.part_number,
            )
        )
    return _write(tx, item, json.loads(newest.before))[0]


def _write(tx: Tx, item: Item, made: Sequence[Mapping[str, Any]]) -> tuple[Item, int]:
    before, after = dumps(list(item.supplier_parts)), dumps(list(made))
    changed = {"supplier_parts": after if made else None, "version": items.c.version + 1}
    stamped = {"updated_at": tx.stamp, "updated_by": tx.actor.username}
    tx.conn.execute(update(items).where(items.c.id == item.id).values(**changed, **stamped))
    row = {
        "item_id": item.id,
        "at": tx.stamp,
        "username": tx.actor.username,
        "before": before,
        "after": after,
    }
    written = insert(supplier_changes).values(row).returning(supplier_changes.c.id)
    number = tx.conn.execute(written).scalar_one()
    index_item(tx, item.id)
    announce.item_updated(tx, item, message("suppliers changed"))
    return get_item(tx, item.part_number), number


@dataclass(frozen=True, slots=True)
class ImportedItem:
    """What an import makes of an item's list. ``status``: change, same, skip (see ``why``) or error."""

    part_number: str
    rows: Sequence[int]
    status: str
    problems: Sequence[str] = ()
    parts: Sequence[SupplierPart] = ()
    words: Sequence[str] = field(default=())
    why: str = ""


def read_prices(data: bytes, max_rows: int, layout: Layout | None = None) -> PriceRows:
    """Read the rows of a price list. RejectedError if it is none, TooLargeError above ``max_rows``."""
    sheet = read_import(data, PRICES, max_rows, layout)
    try:
        return price_rows(sheet, layout.mark if layout else None)
    except InputError as error:
        raise RejectedError(str(error), list(error.problems)) from None


def plan_suppliers(tx: Tx, read: PriceRows, *, leave_out: bool = False) -> list[ImportedItem]:
    """Plan an import of rows, item by item; change nothing. ``leave_out``: items with problems are left out.

    A supplier part of the file replaces the same one of the item (by supplier and number), or is a new one;
    those that the file does not name stay. Several rows of one, each with a "from quantity", are its prices.
    """
    # Numbers come plain from the table: with a point.
    reader = _Reader(Mark.POINT, True, next(iter(rates_of(tx))))
    rows = [row for row in read.rows if not row.left_out]
    numbers = [row.texts[Heading.PART_NUMBER] for row in rows if row.texts.get(Heading.PART_NUMBER)]
    items_by_number = get_by_numbers(tx, numbers)
    grouped: dict[str, list[PriceRow]] = {}
    for row in rows:
        grouped.setdefault(row.texts.get(Heading.PART_NUMBER, "").casefold(), []).append(row)
    plan = [_planned(group, items_by_number, reader) for group in grouped.values()]
    if not leave_out:
        return plan
    return [
        replace(item, status="skip", problems=(), why="; ".join(item.problems)) if item.problems else item
        for item in plan
    ]


def _cells_of(row: PriceRow) -> dict[str, str]:
    """Return the cells of a row by the names of our columns."""
    cells = {"number": row.texts.get(Heading.SUPPLIER_NUMBER, "")}
    cells |= {name: row.texts[name] for name in COLUMNS if name in row.texts}
    cells["prices"] = "; ".join(f"{least:f}: {price:f}" for least, price in row.prices)
    if said := cells.get("preferred"):
        answer = read_yes_no(said)
        cells["preferred"] = said if answer is None else "yes" if answer else ""
    return cells


def _planned(rows: Sequence[PriceRow], items_by_number: Mapping[str, Item], reader: _Reader) -> ImportedItem:
    number = rows[0].texts.get(Heading.PART_NUMBER, "")
    item = items_by_number.get(number)
    problems: list[str] = []
    if item is None:
        what = (
            message("{part_number} does not exist on this server, or is archived", part_number=repr(number))
            if number
            else message("is empty")
        )
        problems.append(message("row {row}: Part number: {problem}", row=rows[0].line, problem=what))
    problems += [
        message("row {row}: {problem}", row=row.line, problem=problem)
        for row in rows
        for problem in row.problems
    ]
    named: dict[tuple[str, str], dict[str, str]] = {}
    for row in rows:
        cells = _cells_of(row)
        key = cells.get("supplier", "").casefold(), cells["number"].casefold()
        before = named.setdefault(key, {"row": str(row.line), "prices": ""})
        for name, text in cells.items():
            first = before.setdefault(name, text) if name != "prices" and text else text
            if first != text:
                problems.append(
                    message(
                        "row {row}: {column} says {text}, row {before_row} says {before}",
                        row=row.line,
                        column=Message(COLUMNS[name]),
                        text=repr(text[:40]),
                        before_row=before["row"],
                        before=repr(first[:40]),
                    )
                )
        before["prices"] = "; ".join(filter(None, (before["prices"], cells["prices"])))
    there = {} if item is None else {part.key: part for part in supplier_parts_of(item)}
    was = list(there.values())
    if len(named) > MOST_PARTS:  # whatever the item has already
        sentence = message(
            "row {row}: wanted at most {most} supplier parts of an item, got {n}",
            row=rows[0].line,
            most=MOST_PARTS,
            n=len(named),
        )
        return ImportedItem(number, [row.line for row in rows], "error", [*problems, sentence])
    for key, cells in named.items():
        kept = texts_of(there[key]) if key in there else {}
        given = {name: text for name, text in cells.items() if name in COLUMNS and text}
        # The values of the item were written by us, with points.
        part, wrong = reader.read(given)
        problems += [message("row {row}: {problem}", row=cells["row"], problem=problem) for problem in wrong]
        if kept and not wrong:
            old = there[key]
            names = [name for name in COLUMNS if name in given]
            part = old._replace(**{name: getattr(part, name) for name in names})
        if part.preferred:
            there = {k: supplier_part._replace(preferred=False) for k, supplier_part in there.items()}
        there[key] = part
    parts = list(there.values())
    problems += (
        [
            message("row {row}: {problem}", row=rows[0].line, problem=problem)
            for problem in list_problems(parts)
        ]
        if not problems
        else []
    )
    status = "error" if problems else "same" if parts == was else "change"
    change = SupplierChange(
        0, "", "", *(dumps([to_json(supplier_part) for supplier_part in side]) for side in (was, parts))
    )
    words = change.words if status == "change" else ()
    return ImportedItem(
        item.part_number if item else number, [row.line for row in rows], status, problems, parts, words
    )


def apply_suppliers(
    tx: Tx, read: PriceRows, *, leave_out: bool = False, file_name: str = ""
) -> tuple[list[ImportedItem], int | None]:
    """Import rows, all or nothing. Returns what was done, and the number by which it can be undone.

    RejectedError lists every problem; then nothing was changed.
    """
    # Two imports of one item come one after the other, each on what the other wrote.
    keys = {row.texts.get(Heading.PART_NUMBER, "").casefold() for row in read.rows}
    query = select(items.c.id).where(one_of(tx, items.c.part_number_key, keys)).order_by(items.c.id)
    tx.conn.execute(query.with_for_update(key_share=True))
    plan, done = plan_suppliers(tx, read, leave_out=leave_out), Done()
    problems = [problem for item in plan for problem in item.problems]
    if problems:
        raise RejectedError(
            message(
                "{n} problems in the file, so nothing was imported: {problem}",
                n=len(problems),
                problem=problems[0],
            ),
            problems,
        )
    for item in plan:
        if item.status == "change":
            of, change = set_supplier_parts(tx, item.part_number, item.parts)
            done.suppliers.append((of.id, change))
    return plan, log_import(tx, "prices", file_name, done)


def export_suppliers(tx: Tx) -> Iterator[str]:
    """Write the supplier parts of all items that are not archived as CSV, a row for each price.

    The import takes the table back, and changes nothing.
    """
    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow(["Part number", *(title for name, title in COLUMNS.items() if name != "prices"), *_BREAK])
    query = select(items).where(items.c.archived_at.is_(None)).order_by(items.c.part_number_key)
    for row in tx.conn.execute(query):
        item = to_item(row)
        for part in supplier_parts_of(item):
            cells = [text for name, text in texts_of(part).items() if name != "prices"]
            for least, price in part.prices or ((None, None),):
                ends = ("" if number is None else decimal_text(number) for number in (least, price))
                writer.writerow(map(safe_cell, (item.part_number, *cells, *ends)))
        yield out.getvalue()
        out.seek(0)
        out.truncate()
    yield out.getvalue()


def rates_of(tx: Tx) -> dict[str, Decimal]:
    """Read what one of each currency is worth in the site's own, which is first; EUR if none is set."""
    typed: dict[str, str] = json.loads(get_state(tx, _RATES) or '{"EUR":"1"}')
    return {currency: Decimal(rate) for currency, rate in typed.items()}


def set_rates(
    tx: Tx, own: str, texts: Iterable[tuple[str, str]], known: Mapping[str, Decimal] | None = None
) -> dict[str, Decimal]:
    """Set the site's currency, and what one of each other is worth in it. RejectedError.

    known
        the rates as the page showed them: text → rate.
    """
    rates, problems = {own.strip().upper(): Decimal(1)}, []
    for currency, text in ((code.strip().upper(), text.strip()) for code, text in texts):
        if not currency and not text:
            continue
        reading = read_number(text)
        if (shown := (known or {}).get(text)) is not None:
            reading = NumberReading(shown, "")
        if currency in rates:
            problems.append(message("{currency}: stands here twice", currency=currency))
        elif reading.value is None or not Decimal("1e-9") <= reading.value <= Decimal("1e9"):
            problems.append(
                message(
                    "{currency}: {problem}",
                    currency=currency,
                    problem=reading.problem or message("wanted a rate above 0, got {got}", got=repr(text)),
                )
            )
        else:
            rates[currency] = reading.value
    wrong = [other for other in rates if not _CODE.fullmatch(other)]
    problems += [
        message("Currency: wanted three letters such as EUR, got {currency}", currency=repr(other[:20]))
        for other in wrong
    ]
    if problems:
        raise RejectedError(joined("; ", problems), problems)
    rate_texts = {currency: decimal_text(rate) for currency, rate in rates.items()}
    audit.note(
        tx,
        "rates.set",
        next(iter(rate_texts)),
        f"{get_state(tx, _RATES) or 'none'} → {dumps(rate_texts)}"[:1000],
    )
    put_state(tx, _RATES, dumps(rate_texts))
    return rates
