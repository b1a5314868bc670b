# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a product costs: one number in roll-up, summary, page, order list and export, on both databases."""

from __future__ import annotations

import csv
import io
import random
from decimal import ROUND_CEILING, Decimal
from typing import Any

import pytest
from hunting import BOTH
from server_testing import Api, bom

FACTOR = {"m": Decimal(1), "mm": Decimal("0.001"), "cm": Decimal("0.01"), None: Decimal(1), "pcs": Decimal(1)}


@pytest.fixture(autouse=True)
def _rates(api: Api) -> None:
    """Other tests of the shared server set rates: here only EUR counts."""
    api.good("PUT", "/api/rates", {"currency": "EUR"})


def sold(*prices: tuple[str, str], **more: Any) -> dict[str, Any]:
    """A supplier part with these prices, each from its quantity on."""
    breaks = [{"quantity": least, "price": price} for least, price in prices]
    return {"supplier": "Acme", "number": "1", "prices": breaks, "currency": "EUR"} | more


class Part:
    """A part as the test knows it; its price is looked up by hand."""

    def __init__(self, api: Api, dice: random.Random) -> None:
        self.unit = dice.choice([None, "m"])
        self.standard = dice.choice([None, "0.5", "7"])
        self.breaks: list[tuple[str, str]] = dice.choice(
            [[], [], [("1", "3")], [("1", "4.25"), ("10", "4"), ("200", "1.5")], [("25", "0.1")]]
        )
        self.pack = dice.choice(["1", "10"])
        properties = {} if self.standard is None else {"standard_cost": float(self.standard)}
        more = {} if self.unit is None else {"unit": self.unit}
        self.number = api.item(properties=properties, **more)
        if self.breaks:
            part = sold(*self.breaks, pack_size=self.pack)
            api.good("PUT", f"/api/items/{self.number}/suppliers", {"supplier_parts": [part]})

    def price(self, amount: Decimal) -> Decimal | None:
        """The price of one in an order of so much, in whole packs."""
        bought = amount
        if self.unit is None or self.pack != "1":
            packs = (amount / Decimal(self.pack)).to_integral_value(ROUND_CEILING)
            bought = packs * Decimal(self.pack)
        reached = [price for least, price in self.breaks if Decimal(least) <= max(bought, Decimal(1))]
        found = reached[-1] if reached else self.standard
        return None if found is None else Decimal(found)


def random_product(
    api: Api, dice: random.Random
) -> tuple[str, dict[str, Decimal], set[str], dict[str, Part]]:
    """A product of three levels; what it holds of each part in all, and the parts with an open unit."""
    parts = {part.number: part for part in (Part(api, dice) for _ in range(5))}
    needs: dict[str, Decimal] = {}
    opens: set[str] = set()
    assemblies = [api.item(item_type="assembly") for _ in range(3)]
    lines: dict[str, list[tuple[str, Decimal, str | None]]] = {one: [] for one in assemblies}
    for place, parent in enumerate(assemblies):
        for below in assemblies[place + 1 :]:
            lines[parent].append((below, Decimal(dice.choice(["1", "2", "3"])), None))
        for number in dice.sample(sorted(parts), 3):
            units: list[str | None] = (
                [None, "m", "mm", "box"] if parts[number].unit else [None, None, "pcs", "m"]
            )
            lines[parent].append(
                (number, Decimal(dice.choice(["0.1", "0.25", "4", "60"])), dice.choice(units))
            )
        for child, quantity, unit in lines[parent]:
            unit_of = {} if unit is None else {"unit": unit}
            api.add_line(parent, child, quantity=float(quantity), **unit_of)

    def walk(parent: str, times: Decimal) -> None:
        for child, quantity, unit in lines[parent]:
            if child in lines:
                walk(child, times * quantity)
                continue
            of_item = parts[child].unit
            fits = unit is None or (unit in FACTOR and (unit == "pcs") == (of_item is None))
            needs.setdefault(child, Decimal(0))
            if fits:
                needs[child] += times * quantity * FACTOR[unit]
            else:
                opens.add(child)

    walk(assemblies[0], Decimal(1))
    return assemblies[0], needs, opens, parts


def totals_of(rows: list[dict[str, Any]]) -> dict[str, Decimal]:
    return {row["currency"]: Decimal(str(row["total_cost"])) for row in rows}


@BOTH
@pytest.mark.parametrize("seed", range(4))
def test_one_number_everywhere(api: Api, seed: int) -> None:
    """Roll-up = summary = order list = flat list × price; the same parts are not known."""
    dice = random.Random(seed)
    top, needs, opens, parts = random_product(api, dice)
    for pieces in (1, 7):
        known, unknown = Decimal(0), set(opens)
        for number, amount in needs.items():
            price = parts[number].price(amount * pieces)
            if price is None:
                unknown.add(number)
            else:
                known += amount * pieces * price
        order = api.get(f"/api/items/{top}/order?pieces={pieces}")
        expected = {"EUR": known} if known else {}
        assert {code: Decimal(cost) for code, cost in order["costs"].items()} == expected
        assert (Decimal(order["total_cost"]), order["unpriced"]) == (known, len(unknown))
        rows = {row["part_number"]: row["cost"] for row in order["parts"]}
        assert sum(Decimal(cost or 0) for cost in rows.values()) == known
        if pieces > 1:
            continue
        cost, summary = api.get(bom(top, "cost")), api.get(bom(top, "summary"))
        assert totals_of(cost["totals"]) == totals_of(summary["totals"]) == expected
        assert set(cost["missing"]) == unknown
        assert (summary["cost_missing"]["count"], set(summary["cost_missing"]["first"])) == (
            len(unknown),
            unknown,
        )
        exported = [Decimal(row["Overall cost"]) for row in table_of(api, top, "flat") if row["Overall cost"]]
        lines = {row["part_number"]: row["total_cost"] for row in cost["lines"]}
        assert sum(exported) == known - sum(Decimal(str(lines[number] or 0)) for number in opens)


def table_of(api: Api, product: str, view: str, query: str = "") -> list[dict[str, str]]:
    """The rows of a CSV export, without its notes."""
    answer = api.call("GET", f"/api/items/{product}/bom/export.csv?view={view}{query}")
    rows = list(csv.reader(io.StringIO(answer.body.decode("utf-8-sig"))))
    start = next(number for number, row in enumerate(rows) if row[0] == "Item")
    return [dict(zip(rows[start], row, strict=True)) for row in rows[start + 1 :]]


@BOTH
def test_a_break_counts_over_all_levels(api: Api) -> None:
    """Ten screws in two sub-assemblies have the price of ten, in each row of the tree; a release keeps it."""
    top, first, second, screw = api.items(4)
    api.good("PUT", f"/api/items/{screw}/suppliers", {"supplier_parts": [sold(("1", "1"), ("10", "0.5"))]})
    for sub, count in ((first, 4), (second, 6)):
        api.merge(sub, {screw: count})
    api.merge(top, {first: 1, second: 1})
    assert api.get(bom(top, "summary"))["totals"] == [{"currency": "EUR", "total_cost": 5}]
    assert api.get(bom(first, "summary"))["totals"] == [{"currency": "EUR", "total_cost": 4}]
    rows = {(row["Level"], row["Part number"]): row for row in table_of(api, top, "indented")}
    costs = [
        rows[level, number]["Overall cost"] for level, number in (("1", first), ("1", second), ("2", screw))
    ]
    assert costs == ["2", "3", rows["2", screw]["Overall cost"]]
    (line,) = api.get(bom(top, "cost"))["lines"]
    assert (line["unit_cost"], line["source"]) == (0.5, "price break: Acme 1")
    api.good("POST", f"/api/items/{top}/releases", {})
    api.good("PUT", f"/api/items/{screw}/suppliers", {"supplier_parts": []})
    frozen = {row["Part number"]: row["Overall cost"] for row in table_of(api, top, "indented", "&release=A")}
    assert (frozen[first], frozen[second]) == ("2", "3")
    assert api.get(f"/api/items/{top}/order?release=A")["total_cost"] == "5"


@BOTH
def test_a_bought_assembly_costs_its_own_price(api: Api) -> None:
    """Not that of what is in it; without a price it is the part that is not known."""
    top, gearbox, wheel = api.items(3)
    api.good("PATCH", f"/api/items/{wheel}/properties", {"standard_cost": 3})
    api.merge(gearbox, {wheel: 2})
    api.merge(top, {gearbox: 2, wheel: 1})
    assert api.get(bom(top, "summary"))["totals"] == [{"currency": "EUR", "total_cost": 15}]
    api.good("PUT", f"/api/items/{gearbox}", {"sourcing_type": "purchased"})
    for price, total, missing in ((None, 3, [gearbox]), (100, 203, [])):
        if price:
            api.good("PATCH", f"/api/items/{gearbox}/properties", {"standard_cost": price})
        summary, cost = api.get(bom(top, "summary")), api.get(bom(top, "cost"))
        assert summary["totals"] == [{"currency": "EUR", "total_cost": total}]
        assert (summary["cost_missing"]["first"], cost["missing"]) == (missing, missing)
        order = api.get(f"/api/items/{top}/order")
        assert (order["total_cost"], order["unpriced"], cost["total_cost"]) == (
            str(total),
            len(missing),
            total,
        )
    assert api.get(bom(gearbox, "summary"))["totals"] == [{"currency": "EUR", "total_cost": 6}]


def test_a_page_and_its_order_list_show_one_cost(api: Api) -> None:
    """A product of which only standard costs are known costs the same on its page and on its order list."""
    top, plate, other = api.items(3)
    api.good("PATCH", f"/api/items/{plate}/properties", {"standard_cost": 51961.0})
    api.merge(top, {plate: 2, other: 1})
    for path in (f"/items/{top}", f"/items/{top}/order"):
        text = api.call("GET", path).body.decode()
        assert ("103 922.00" in text.replace("\u202f", " "), "not known for" in text) == (True, True), path
