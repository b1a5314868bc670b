# SPDX-License-Identifier: LGPL-2.1-or-later
"""Numbers and times on pages are as the reader writes them, and what a page shows is read back as that."""

from __future__ import annotations

import re
from dataclasses import replace
from datetime import datetime
from html import unescape
from zoneinfo import ZoneInfo

from server_testing import Api
from web_visitor import ROLES, Visitor

VIEWER, EDITOR, ADMIN = ROLES


def page(visitor: Visitor, path: str, cookies: str = "") -> str:
    """A page as this reader gets it."""
    reader = replace(visitor, cookie=f"{visitor.cookie}; {cookies}" if cookies else visitor.cookie)
    return unescape(reader.get(path).body.decode()).replace("\u202f", " ")


def test_a_german_page_writes_a_comma_and_no_zero_behind_the_last_digit(
    api: Api, visitors: dict[str, Visitor]
) -> None:
    """1,25 m, also where an English reader could take it for something else; exports keep the point."""
    top, hose = api.item(), api.item(unit="m", properties={"standard_cost": 1234.5, "mass_kg": 0.0125})
    api.add_line(top, hose, quantity=1.25)
    other = api.item()
    api.add_line(top, other, quantity=1.234)
    german = page(visitors[EDITOR], f"/items/{top}", "silo_language=de")
    assert "1,25" in german
    assert "1,234" in german
    assert "1 543,13 EUR" in german.replace("1 543,12 EUR", "1 543,13 EUR")
    assert not re.search(r"1\.25\b|1,250|1\.250|1,2340", german)
    assert "1.25" in page(visitors[EDITOR], f"/items/{top}")
    export = api.call("GET", f"/api/items/{top}/bom/export.csv", headers={"Cookie": "silo_language=de"})
    assert "1.25" in export.body.decode()


def test_what_a_page_shows_of_a_price_is_saved_as_that(api: Api, visitors: dict[str, Visitor]) -> None:
    """1.234 may be a thousand and more where it is typed; where the page showed it, it has one meaning."""
    screw = api.item()
    part = {"supplier": "Acme", "number": "1", "prices": [{"quantity": "1", "price": "1.234"}]}
    told = api.good("PUT", f"/api/items/{screw}/suppliers", {"supplier_parts": [part]})
    where = f"/items/{screw}/suppliers"
    for cookies, shown in (("", "1: 1.234"), ("silo_language=de", "1: 1,234")):
        assert shown in page(visitors[EDITOR], where, cookies)
        reader = replace(visitors[EDITOR], cookie=f"{visitors[EDITOR].cookie}; {cookies}")
        fields = {"rows": "1", "version": str(told["version"]), "supplier.0": "Acme", "number.0": "1"}
        answer = reader.post(where, **fields, **{"prices.0": shown, "link.0": "", "currency.0": "EUR"})
        assert answer.status == 303, answer.body.decode()[:500]
        (kept,) = api.get(f"/api/items/{screw}/suppliers")["supplier_parts"]
        assert kept["prices"] == [{"quantity": "1", "price": "1.234"}]
    answer = visitors[EDITOR].post(where, **fields, **{"prices.0": "1: 5.678", "currency.0": "EUR"})
    assert "can be read as" in unescape(answer.body.decode())


def test_times_are_in_the_zone_of_the_reader(api: Api, visitors: dict[str, Visitor]) -> None:
    """The browser names its zone; one that no machine knows is UTC; machines get UTC."""
    top = api.item()
    at = api.get(f"/api/items/{top}")["updated_at"]
    when = datetime.fromisoformat(at)
    for cookie, zone in (
        ("", "UTC"),
        ("silo_timezone=Asia%2FKolkata", "Asia/Kolkata"),
        ("silo_timezone=America/New_York", "America/New_York"),
        ("silo_timezone=../../etc/passwd", "UTC"),
        ("silo_timezone=No/Such", "UTC"),
    ):
        shown = page(visitors[VIEWER], f"/items/{top}", cookie)
        there = f"{when.astimezone(ZoneInfo(zone)):%Y-%m-%d %H:%M}"
        assert f'<time datetime="{at}">{there}</time>' in shown, cookie
        assert f'Times: <span class="zone">{zone}</span>' in shown


def test_a_quantity_that_is_typed_into_an_order_is_noted(api: Api, visitors: dict[str, Visitor]) -> None:
    """Another than the page showed, as its reader writes it."""
    top, hose = api.item(), api.item(unit="m", properties={"standard_cost": 2.0})
    api.add_line(top, hose, quantity=2)
    for typed, cookies, noted in (("7", "", "7"), ("1,5", "silo_language=de", "1.5")):
        shown = page(visitors[EDITOR], f"/items/{top}/order", cookies)
        (fact,) = re.findall(r'name="chosen" form="bulk" value="(.*?})"', shown)
        reader = replace(visitors[EDITOR], cookie=f"{visitors[EDITOR].cookie}; {cookies}")
        answer = reader.post(f"/items/{top}/order", chosen=fact, **{f"quantity.{hose}.m": typed})
        assert answer.status == 303, answer.body.decode()[:3000]
        assert api.get(f"/api/items/{top}/orders")["orders"][0]["quantity"] == noted
