# SPDX-License-Identifier: LGPL-2.1-or-later
"""Quantities as people type them, on the page, in a CSV and in the API: one rule, and exact sums."""

from __future__ import annotations

from typing import Any

import pytest
from server_testing import Answer, Api, bom, merge_body

# text → the number it is, None where it is refused. "1,000" has two readings.
TYPED: dict[str, float | None] = {
    "4": 4,
    "2.5": 2.5,
    "1,5": 1.5,
    "1,000": None,
    "1.000,5": 1000.5,
    "1_000": 1000,
    "1 000": 1000,
    "1e3": 1000,
    "½": 0.5,
    "4 pcs": 4,
    "0": None,
    "-1": None,
    "1e10": None,
    "²": None,
    "1/2": None,
    "nan": None,
    "inf": None,
    "0x10": None,
    "9" * 5000: None,
    "": None,
    "four": None,
}


def add_by_api(api: Api, parent: str, child: str, text: str) -> Answer:
    """As text in JSON."""
    return api.call("POST", bom(parent), {"child_part_number": child, "quantity": text})


def add_by_csv(api: Api, parent: str, child: str, text: str) -> Answer:
    """In a file."""
    body = f'Part number,Quantity\r\n{child},"{text}"\r\n'.encode()
    return api.call("POST", bom(parent, "import"), body=body)


@pytest.mark.parametrize("add", [add_by_api, add_by_csv])
def test_a_quantity_as_text(api: Api, add: Any) -> None:
    """Read as what it says, or refused with a sentence; never guessed."""
    parent, refused = api.items(2)
    read = {}
    for text, wanted in TYPED.items():
        child = refused if wanted is None else api.item()
        answer = add(api, parent, child, text)
        assert (answer.status < 300) == (wanted is not None), (text, answer.body[:300])
        if wanted is not None:
            read[child] = wanted
        if text == "1,000":
            assert all(reading in answer.json()["problems"][0] for reading in ("1000", " 1;", "1.0000"))
    assert api.quantities(parent) == read


def test_a_comma_file_of_a_german_spreadsheet(api: Api) -> None:
    """The column says which mark is the decimal one: what is ambiguous alone is not in its company."""
    parent, *children = api.items(4)
    rows = zip(children, ("1,5", "1.000", "2.000,25"), strict=True)
    body = "Part number;Quantity\r\n" + "".join(f"{c};{q}\r\n" for c, q in rows)
    api.good("POST", bom(parent, "import"), body=body.encode())
    assert list(api.quantities(parent).values()) == [1.5, 1000, 2000.25]
    lone = f"Part number;Quantity\r\n{children[0]};1.000\r\n".encode()
    api.bad(400, "POST", bom(parent, "import"), body=lone)


def test_sums_and_products_are_exact(api: Api) -> None:
    """0.1 and 0.2 are 0.3, wherever they meet: merge, flat, expanded, cost and mass."""
    top, left, right, leaf = api.items(4)
    api.good("PUT", f"/api/items/{leaf}", {"properties": {"standard_cost": "0,1", "mass_kg": 0.1}})
    for sub, quantity in ((left, 0.1), (right, 0.2)):
        api.merge(top, {left: 1, right: 1})
        api.add_line(sub, leaf, quantity=quantity)
    assert api.get(bom(top, "flat"))["flat_bom"][0]["total_quantity"] == 0.3
    assert api.get(bom(top, "cost"))["total_cost"] == 0.03
    assert api.get(bom(top, "mass"))["total_mass_kg"] == 0.03
    api.edit_line(top, left, quantity=3)
    expanded = api.get(bom(top, "expanded"))
    assert [row["total_quantity"] for row in expanded] == [3, 0.3, 1, 0.2]
    body = merge_body({leaf: 0.1})
    body["entries"] *= 3
    merged = api.good("POST", bom(right, "merge"), {**body, "dry_run": True})
    assert merged["warnings"][0]["assembly_quantity"] == 0.3


def test_the_limit_is_the_same_however_a_quantity_comes(api: Api) -> None:
    """1e9 is taken, more is not: by hand, by merge, as the sum of several entries, by import."""
    parent, child = api.items(2)
    for quantity in (1e9 + 1, 1e300, 0, -1, None, True, []):
        api.bad(400, "POST", bom(parent), {"child_part_number": child, "quantity": quantity})
        problems = api.bad(400, "POST", bom(parent, "merge"), merge_body({child: quantity}))["problems"]
        assert "quantity" in problems[0], quantity
    assert "quantity" in api.bad(400, "POST", bom(parent, "merge"), merge_body({child: "2"}))["problems"][0]
    halves = merge_body({child: 6e8})
    halves["entries"] *= 2
    problem = api.bad(400, "POST", bom(parent, "merge"), halves)["problems"]
    assert problem == [f"entries[1].quantity: all entries of {child!r} add up to over 1e9"]
    assert api.merge(parent, {child: 1e9})["diff"]["added"] == [{"part_number": child, "quantity": 10**9}]
