# SPDX-License-Identifier: LGPL-2.1-or-later
"""Supplier parts, order lists, what was ordered, and rates: on SQLite and PostgreSQL."""

from __future__ import annotations

import csv
import io
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from hunting import BOTH
from openpyxl import Workbook, load_workbook
from server_testing import Answer, Api, form_body

MISUMI = {
    "supplier": "Misumi",
    "number": "CB8-20",
    "link": "https://example.com/cb8",
    "pack_size": "100",
    "minimum": "1",
    "prices": [{"quantity": "1", "price": "0.12"}, {"quantity": "1000", "price": "0.1"}],
    "currency": "EUR",
    "lead_time_days": 5,
    "preferred": False,
}


def suppliers(number: str) -> str:
    return f"/api/items/{number}/suppliers"


def order(number: str, query: str = "") -> str:
    return f"/api/items/{number}/order{query}"


def row_of(api: Api, number: str, part: str, query: str = "") -> dict[str, Any]:
    """The row of a part in the order list of an item."""
    (row,) = (one for one in api.get(order(number, query))["parts"] if one["part_number"] == part)
    return row


def given(api: Api, number: str, *parts: dict[str, Any]) -> dict[str, Any]:
    told: dict[str, Any] = api.good("PUT", suppliers(number), {"supplier_parts": list(parts)})
    return told


@pytest.fixture(autouse=True)
def _rates(api: Api) -> None:
    """The rates are the site's, and other tests of the shared server set them: here only EUR counts."""
    api.good("PUT", "/api/rates", {"currency": "EUR"})


@pytest.fixture
def product(api: Api) -> tuple[str, str, str, str]:
    """top → 2 × sub, 3 × screw; sub → 4 × screw, 1 × plate. The screw is bought, the plate made."""
    top, sub, screw, plate = api.items(4)
    api.merge(top, {sub: 2, screw: 3})
    api.merge(sub, {screw: 4, plate: 1})
    api.good("PUT", f"/api/items/{plate}", {"sourcing_type": "manufactured"})
    return top, sub, screw, plate


@BOTH
def test_a_list_is_one_value_with_a_version(api: Api) -> None:
    """What is sent comes back, in the item too; a second editor is refused; the search finds it."""
    (screw,) = api.items(1)
    part = {**MISUMI, "number": f"CB8-{screw}"}  # other items have MISUMI, too
    told = given(api, screw, part)
    assert told["supplier_parts"] == [part]
    assert api.get(suppliers(screw)) == told
    assert api.get(f"/api/items/{screw}")["supplier_parts"] == [part]
    version = {"If-Match": f'"v{told["version"]}"'}
    second = {**part, "preferred": True}
    assert api.call("PUT", suppliers(screw), {"supplier_parts": [second]}, headers=version).status == 200
    assert api.call("PUT", suppliers(screw), {"supplier_parts": []}, headers=version).status == 412
    assert [one["part_number"] for one in api.get(f"/api/items/search?q=cb8-{screw}")] == [screw]
    given(api, screw)
    assert "supplier_parts" not in api.get(f"/api/items/{screw}")
    assert api.get(f"/api/items/search?q=cb8-{screw}") == []


def test_what_is_refused(api: Api) -> None:
    """With a sentence, and nothing is stored."""
    (screw,) = api.items(1)
    two_prices = [{"quantity": "1", "price": "1"}, {"quantity": "1.0", "price": "2"}]
    changes: list[tuple[dict[str, Any], str]] = [
        ({"supplier": " "}, "Supplier: wanted a name"),
        ({"pack_size": "0"}, ""),
        ({"pack_size": "1,000"}, "can be read as"),
        ({"prices": [{"quantity": "1", "price": "-1"}]}, "wanted a number from 0"),
        ({"prices": two_prices}, "two prices"),
        ({"prices": [{"price": "NaN"}]}, ""),
        ({"currency": "euro"}, ""),
        ({"link": "javascript:alert(1)"}, "web address"),
        ({"lead_time_days": 99999}, ""),
        ({"supplier": "a\x00"}, ""),
    ]
    for change, said in changes:
        answer = api.bad(400, "PUT", suppliers(screw), {"supplier_parts": [{**MISUMI, **change}]})
        assert said in str(answer), change
    assert api.get(suppliers(screw)) == {"version": 0, "supplier_parts": []}


def test_two_of_one_number_and_two_preferred(api: Api) -> None:
    """A list is judged as a whole."""
    (screw,) = api.items(1)
    twice = [MISUMI, {**MISUMI, "number": "cb8-20"}]
    assert "stands here twice" in str(api.bad(400, "PUT", suppliers(screw), {"supplier_parts": twice}))
    both = [{**MISUMI, "preferred": True}, {**MISUMI, "number": "x", "preferred": True}]
    assert "one supplier at most" in str(api.bad(400, "PUT", suppliers(screw), {"supplier_parts": both}))


def test_an_order_list_over_all_levels(api: Api, product: tuple[str, ...]) -> None:
    """(3 + 2 × 4) × 90 screws with 5 % spares in packs of 100, at the price of that quantity."""
    top, _sub, screw, plate = product
    given(api, screw, MISUMI)
    api.good("PATCH", f"/api/items/{plate}/properties", {"material": "Steel", "mass_kg": 1.5})
    assert "wanted 0 to 1000 percent, got 1001" in str(api.bad(400, "GET", order(top, "?spares=1001")))
    told = api.get(order(top, "?pieces=90&spares=5"))
    rows = {one["part_number"]: one for one in told["parts"]}
    assert (
        rows[screw]
        | {
            "kind": "bought",
            "total": "990",
            "needed": "1040",
            "quantity": "1100",
            "price": "0.1",
            "cost": "103.95",
            "order_cost": "110",
            "remarks": [],
        }
        == rows[screw]
    )
    assert (rows[plate]["kind"], rows[plate]["needed"], rows[plate]["files"]) == ("made", "189", [])
    assert (told["total_cost"], told["currency"], told["lead_time_days"]) == ("103.95", "EUR", 5)
    assert (told["order_costs"], told["unpriced"]) == ({"EUR": "110"}, 1)
    assert told["warnings"][0] == "This is the draft, not a released revision"
    # A price counts from its very quantity on, and who is preferred sells even if another is cheaper.
    cheap = {**MISUMI, "supplier": "Cheap", "prices": [{"price": "0"}]}
    given(api, screw, {**MISUMI, "preferred": True}, cheap)
    rows = {one["part_number"]: one for one in api.get(order(top, "?pieces=90"))["parts"]}
    sold = rows[screw]["supplier_part"]["supplier"], rows[screw]["quantity"], rows[screw]["price"]
    assert sold == ("Misumi", "1000", "0.1")
    one = {row["part_number"]: row["needed"] for row in api.get(order(top, "?spares=4"))["parts"]}
    assert one == {screw: "12", plate: "3"}  # pieces are rounded up: 11.44 and 2.08


def test_nothing_is_left_out(api: Api, product: tuple[str, ...]) -> None:
    """No price, no supplier, no rate, nobody said made or bought: each is a row that says so."""
    top, sub, screw, plate = product
    other, third, fourth = api.items(3)
    api.merge(top, {sub: 2, screw: 3, other: 1, third: 1, fourth: 1})
    given(api, screw, {**MISUMI, "prices": []})
    api.good("PUT", f"/api/items/{other}", {"sourcing_type": "purchased"})
    given(api, third, {**MISUMI, "currency": "USD"})
    told = api.get(order(top))
    said = {one["part_number"]: (one["kind"], one["remarks"]) for one in told["parts"]}
    assert said == {
        screw: ("bought", ["no price"]),
        plate: ("made", []),
        other: ("bought", ["no supplier"]),
        third: ("bought", ["no rate for USD"]),
        fourth: ("unsaid", []),
    }
    costs = told["unpriced"], told["without_rate"], told["total_cost"], told["costs"]
    assert costs == (4, 1, "0", {"USD": "0.12"})
    assert told["order_costs"] == {"USD": "12"}
    api.good("PUT", "/api/rates", {"currency": "EUR", "rates": {"USD": "0.5"}})
    assert api.get("/api/rates") == {"currency": "EUR", "rates": {"USD": "0.5"}}
    again = api.get(order(top))
    assert (again["unpriced"], again["without_rate"], again["total_cost"]) == (4, 0, "0.06")


def test_a_bought_assembly_is_a_part(api: Api, product: tuple[str, ...]) -> None:
    """Nobody orders what is in it."""
    top, sub, screw, plate = product
    api.good("PUT", f"/api/items/{sub}", {"sourcing_type": "purchased"})
    told = {one["part_number"]: one["total"] for one in api.get(order(top))["parts"]}
    assert told == {sub: "2", screw: "3"}
    # Who makes an order list of the bought assembly itself asks for what is in it.
    told = {one["part_number"]: one["total"] for one in api.get(order(sub))["parts"]}
    assert told == {screw: "4", plate: "1"}


def test_properties_stand_for_a_list(api: Api, product: tuple[str, ...]) -> None:
    """What items said before there were lists is a supplier part, until there is a list."""
    top, _sub, screw, _plate = product
    said = {
        "supplier": "Bolt & Co",
        "supplier_part_number": "123",
        "standard_cost": 0.1,
        "lead_time_days": 14,
    }
    api.good("PATCH", f"/api/items/{screw}/properties", said)
    row = row_of(api, top, screw)
    assert (row["kind"], row["supplier_part"]["number"], row["cost"]) == ("bought", "123", "1.1")
    given(api, screw, MISUMI)
    told = api.get(order(top))
    (row,) = (one for one in told["parts"] if one["part_number"] == screw)
    assert (row["supplier_part"]["supplier"], row["quantity"]) == ("Misumi", "100")
    assert (told["lead_time_days"], told["without_lead_time"]) == (5, 0)  # none of what is made
    given(api, screw, {**MISUMI, "minimum": "150"})
    assert row_of(api, top, screw)["quantity"] == "200"


def test_what_is_open_stands_on_top(api: Api, product: tuple[str, ...]) -> None:
    """The words are those of the product's summary; the row says it too."""
    top, sub, screw, plate = product
    api.merge(sub, {plate: 1})
    told = api.get(order(top))
    assert "1 question open" in told["warnings"][1]
    assert f"{sub}: 1 unreferenced line" in told["warnings"][1]
    (row,) = (one for one in told["parts"] if one["part_number"] == screw)
    assert row["remarks"] == ["8 of 11 unreferenced"]


@BOTH
def test_a_release_keeps_its_suppliers(api: Api, product: tuple[str, ...]) -> None:
    """Prices, sourcing and quantities as they were frozen, whatever comes later."""
    top, sub, screw, plate = product
    given(api, screw, MISUMI)

    for name in ("old.pdf", "plate.step", "new.pdf"):
        api.upload(plate, name.encode(), name)
    newest = [one["name"] for one in row_of(api, top, plate)["files"]]  # of each name
    assert newest == ["new.pdf", "old.pdf", "plate.step"]
    api.good("POST", f"/api/items/{top}/releases", {})
    before = api.get(order(top, "?release=A&pieces=7"))
    assert before["warnings"][0] == "Revision A is review, not released"
    given(api, screw, {**MISUMI, "supplier": "Other"})
    api.merge(sub, {screw: 1})
    api.upload(plate, b"newer", "newer.pdf")
    after = api.get(order(top, "?release=A&pieces=7"))
    assert after == before
    assert api.get(order(top, "?pieces=7")) != before


@BOTH
def test_what_was_ordered(api: Api, product: tuple[str, ...]) -> None:
    """Facts with who and when; the rest is without them; taken back they count no more and stay."""
    top, _sub, screw, _plate = product
    given(api, screw, {**MISUMI, "pack_size": "1"})
    line = {
        "part_number": screw,
        "quantity": "5",
        "supplier": "Misumi",
        "number": "CB8-20",
        "price": "0.12",
        "currency": "EUR",
    }
    (made,) = api.good("POST", f"/api/items/{top}/orders", {"parts": [line], "note": "PO 17"})["orders"]
    assert made | {**line, "note": "PO 17", "ended_at": None} == made

    def row(query: str) -> tuple[str, str, str]:
        found = row_of(api, top, screw, query)
        return found["ordered"], found["needed"], found["quantity"]

    assert row("") == ("5", "11", "11")
    assert row("?rest=true") == ("5", "6", "6")
    more = {"parts": [{"part_number": screw, "quantity": "20", "currency": "EUR"}]}
    (unpriced,) = api.good("POST", f"/api/items/{top}/orders", more)["orders"]
    assert (unpriced["price"], unpriced["currency"]) == (None, None)  # a currency of no price says nothing
    assert row("?rest=true") == ("25", "0", "0")  # more was ordered than is needed
    api.good("POST", f"/api/items/{top}/orders/{unpriced['id']}/take-back")
    back = f"/api/items/{top}/orders/{made['id']}/take-back"
    assert api.good("POST", back)["ended_by"] == made["username"]
    assert row("?rest=true") == ("0", "11", "11")
    api.bad(409, "POST", back)
    assert len(api.get(f"/api/items/{top}/orders")["orders"]) == 2
    for wrong in (
        {"quantity": 0},
        {"quantity": "1e-99"},
        {"price": "1e99"},
        {"currency": "euro"},
        {"unit": "m" * 33},
    ):
        api.bad(400, "POST", f"/api/items/{top}/orders", {"parts": [{**line, **wrong}]})


def test_a_table_for_each_supplier(api: Api, product: tuple[str, ...]) -> None:
    """CSV and XLSX, with the warnings on top, numbers as numbers, and no formula."""
    top, sub, screw, plate = product
    given(api, screw, {**MISUMI, "supplier": "=Bolt"})
    api.good("PUT", f"/api/items/{sub}", {"sourcing_type": "purchased"})
    data = api.call("GET", order(top, ".csv?pieces=10&supplier=%3DBolt")).body.decode("utf-8-sig")
    lines = list(csv.reader(io.StringIO(data)))
    head = next(i for i, line in enumerate(lines) if line[0] == "Supplier")
    assert lines[0][0].startswith(f"For 10 of {top}")
    (row,) = (dict(zip(lines[head], line, strict=True)) for line in lines[head + 1 :])
    assert (row["Supplier"], row["Part number"], row["Quantity"], row["Cost"], row["Order cost"]) == (
        "'=Bolt",
        screw,
        "100",
        "3.6",
        "12",
    )
    book = load_workbook(io.BytesIO(api.call("GET", order(top, ".xlsx")).body)).active
    cells = [[cell.value for cell in line] for line in book.iter_rows()]
    head = next(i for i, line in enumerate(cells) if line[0] == "Supplier")
    found = {line[2]: line for line in cells[head + 1 :]}
    assert found[screw][cells[head].index("Quantity")] == 100
    assert found[sub][cells[head].index("Remarks")] == "no supplier"
    made = api.call("GET", order(top, ".csv?kind=made")).body.decode("utf-8-sig")
    assert "Files" in made
    assert plate not in made


def imported(api: Api, table: str, query: str = "") -> Answer:
    headers = {"Content-Type": "text/csv"}
    return api.call("POST", f"/api/suppliers/import{query}", body=table.encode(), headers=headers)


TABLE = (
    "Part number;Vendor;Order number;MOQ;Pack size;From quantity;Price;Currency;Lead time\n"
    "{0};Misumi;CB8;10;1;1;0,50;EUR;7\n"
    "{0};Misumi;CB8;10;1;100;0,40;EUR;7\n"
    "{1};Würth;W1;;;;1,25;CHF;\n"
)


def test_import_of_a_table(api: Api) -> None:
    """Headers of each company, prices in several rows, commas; a second import changes nothing."""
    one, two = api.items(2)
    given(api, one, {**MISUMI, "number": "CB8", "minimum": "2"})
    data = TABLE.format(one, two)
    dry = imported(api, data, "?dry_run=true").json()
    assert [(row["part_number"], row["status"]) for row in dry["items"]] == [
        (one, "change"),
        (two, "change"),
    ]
    assert api.get(suppliers(two))["supplier_parts"] == []
    for status in ("change", "same"):
        assert [row["status"] for row in imported(api, data).json()["items"]] == [status, status]
    (first,) = api.get(suppliers(one))["supplier_parts"]
    assert (first["minimum"], first["pack_size"], first["prices"]) == (
        "10",
        "1",
        [{"quantity": "1", "price": "0.5"}, {"quantity": "100", "price": "0.4"}],
    )
    assert first["link"] == MISUMI["link"]  # what the file does not say stays
    (second,) = api.get(suppliers(two))["supplier_parts"]
    assert (second["supplier"], second["prices"], second["currency"]) == (
        "Würth",
        [{"quantity": "1", "price": "1.25"}],
        "CHF",
    )


def test_tables_that_are_refused(api: Api) -> None:
    """With a sentence that has the row, and nothing is stored."""
    (screw,) = api.items(1)
    for table, said in (
        ("Part number,Supplier,Price\n{0},Acme,-1\n", "wanted a number from 0"),
        ("Part number,Supplier,Link\n{0},Acme,javascript:alert(1)\n", "web address"),
        ("Part number;Supplier;Price\n{0};Acme;1.000\n", "can be read as"),
        ("Part number,Supplier,Price\n{0},Acme,1\n{0},ACME,2\n", "says 'ACME', row 2 says 'Acme'"),
        # An item has few suppliers, so the work for a table does not grow with the square of its rows.
        ("Part number,Supplier,Preferred\n" + "".join(f"{{0}},S{n},yes\n" for n in range(999)), "got 999"),
    ):
        answer = imported(api, table.format(screw))
        assert (answer.status, "row 2" in str(answer.json())) == (400, True)
        assert said in str(answer.json())
    assert api.get(suppliers(screw))["supplier_parts"] == []


def test_points_of_a_file_with_commas_are_decimal(api: Api) -> None:
    """As are those of a program; in a file with semicolons a company writes 1.000,5."""
    one, two = api.items(2)
    assert imported(api, f"Part number,Supplier,Price\n{one},Acme,1.125\n").status == 200
    assert imported(api, f"Part number;Supplier;Price\n{two};Acme;1.000,5\n").status == 200
    prices = [api.get(suppliers(number))["supplier_parts"][0]["prices"][0]["price"] for number in (one, two)]
    assert prices == ["1.125", "1000.5"]


def test_one_preferred_supplier_takes_the_place_of_the_other(api: Api) -> None:
    """A table that prefers a supplier ends the preference of another."""
    (screw,) = api.items(1)
    given(api, screw, {**MISUMI, "preferred": True})
    assert imported(api, f"Part number,Supplier,Preferred\n{screw},Acme,yes\n").status == 200
    parts = api.get(suppliers(screw))["supplier_parts"]
    assert [(one["supplier"], one["preferred"]) for one in parts] == [("Misumi", False), ("Acme", True)]


@BOTH
def test_imports_at_once_lose_nothing(api: Api) -> None:
    """Each table names another supplier of the same two items, in either order; all of them stay."""
    one, two = api.items(2)
    head = "Part number,Supplier,Price\n"
    tables = [
        head + "".join(f"{number},S{n},{n + 1}\n" for number in ((one, two) if n % 2 else (two, one)))
        for n in range(12)
    ]
    with ThreadPoolExecutor(6) as pool:
        assert {answer.status for answer in pool.map(lambda table: imported(api, table), tables)} == {200}
    for number in (one, two):
        names = {part["supplier"] for part in api.get(suppliers(number))["supplier_parts"]}
        assert names == {f"S{n}" for n in range(12)}


def test_an_import_is_all_or_nothing(api: Api) -> None:
    """Every problem at once with its row; from a workbook too."""
    (one,) = api.items(1)
    book = Workbook()
    sheet = book.active
    assert sheet is not None
    sheet.append(["Part number", "Supplier", "Price"])
    sheet.append([one, "Misumi", 0.5])
    sheet.append(["NOPE-1", "Misumi", 1])
    sheet.append([one, "Other", "cheap"])
    out = io.BytesIO()
    book.save(out)
    body, headers = form_body({"file": ("prices.xlsx", out.getvalue())})
    problems = api.bad(400, "POST", "/api/suppliers/import", body=body, headers=headers)["problems"]
    assert any("row 3" in said and "NOPE-1" in said for said in problems)
    assert any("row 4" in said and "cheap" in said for said in problems)
    assert api.get(suppliers(one))["supplier_parts"] == []


def as_odoo_reads(table: str) -> dict[tuple[str, str], list[tuple[str, str, str]]]:
    """A row without a vendor is one more line of the order above it."""
    read: dict[tuple[str, str], list[tuple[str, str, str]]] = {}
    key = ("", "")
    for row in csv.DictReader(io.StringIO(table)):
        if row["Vendor"]:
            key = row["Vendor"], row["Currency"]
        line = (row["Order Lines/Product"], row["Order Lines/Quantity"], row["Order Lines/Unit Price"])
        read.setdefault(key, []).append(line)
    return read


def test_an_order_for_odoo_and_for_inventree(api: Api, product: tuple[str, ...]) -> None:
    """Their columns, no notes on top; InvenTree counts packs; a part without a supplier is no silent gap."""
    top, _sub, screw, plate = product
    more = api.item(name="Nut")
    api.merge(top, {screw: 3, more: 2, plate: 1})
    given(api, screw, MISUMI)
    api.good("PUT", f"/api/items/{more}", {"sourcing_type": "purchased"})
    answer = api.bad(400, "GET", order(top, ".csv?layout=odoo"))
    assert f"no supplier is known of {more}" in str(answer)
    given(api, more, {**MISUMI, "supplier": "Acme", "number": "N1", "pack_size": "1"})
    table = api.call("GET", order(top, ".csv?layout=odoo")).body.decode("utf-8-sig")
    orders = as_odoo_reads(table)
    name = api.get(f"/api/items/{screw}")["name"]
    assert orders[("Acme", "EUR")] == [(f"[{more}] Nut", "2", "0.12")]
    assert orders[("Misumi", "EUR")] == [(f"[{screw}] {name}", "100", "0.12")]
    answer = api.bad(400, "GET", order(top, ".csv?layout=inventree"))
    assert "one supplier at a time" in str(answer)
    table = api.call("GET", order(top, ".csv?layout=inventree&supplier=Misumi")).body.decode("utf-8-sig")
    (row,) = csv.DictReader(io.StringIO(table))
    assert (row["part"], row["quantity"], row["purchase_price"]) == ("CB8-20", "1", "12")
    assert (row["purchase_price_currency"], row["reference"]) == ("EUR", screw)
    assert api.call("GET", order(top, ".csv?layout=sap")).status == 400
