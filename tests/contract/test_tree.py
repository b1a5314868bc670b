# SPDX-License-Identifier: LGPL-2.1-or-later
"""Expanded, flat, where-used, cost and mass."""

from __future__ import annotations

import pytest
from hunting import BOTH
from server_testing import Api, bom


@pytest.fixture
def gearbox(api: Api) -> dict[str, str]:
    """The spec's example (§3): top → plate, 2 × gearbox (housing, 4 gears, shaft), cover, 12 bolts."""
    names = ("top", "plate", "gearbox", "housing", "gear", "shaft", "cover", "bolt")
    items = dict(zip(names, api.items(len(names)), strict=True))
    top = {items["plate"]: 1.0, items["gearbox"]: 2.0, items["cover"]: 1.0, items["bolt"]: 12.0}
    api.merge(items["top"], top)
    inner = {items["housing"]: 1.0, items["gear"]: 4.0, items["shaft"]: 1.0, items["bolt"]: 3.0}
    api.merge(items["gearbox"], inner)
    return items


@BOTH
def test_expanded(api: Api, gearbox: dict[str, str]) -> None:
    """Rows in tree order with depth, quantities per one parent, and totals."""
    rows = api.get(bom(gearbox["top"], "expanded"))
    names = {number: name for name, number in gearbox.items()}
    told = [
        (r["depth"], names[r["parent_part_number"]], names[r["child_part_number"]], r["quantity"])
        for r in rows
    ]
    assert told == [
        (1, "top", "plate", 1),
        (1, "top", "gearbox", 2),
        (2, "gearbox", "housing", 1),
        (2, "gearbox", "gear", 4),
        (2, "gearbox", "shaft", 1),
        (2, "gearbox", "bolt", 3),
        (1, "top", "cover", 1),
        (1, "top", "bolt", 12),
    ]
    assert [r["total_quantity"] for r in rows] == [1, 2, 2, 8, 2, 6, 1, 12]


def test_an_expanded_line_is_the_single_level_s_line(api: Api, gearbox: dict[str, str]) -> None:
    """Both tell a line by the same keys and values."""
    api.good("PUT", bom(gearbox["top"], gearbox["bolt"]), {"notes": "x", "child_revision": 2, "unit": "pcs"})
    single = api.lines(gearbox["top"])
    for row in api.get(bom(gearbox["top"], "expanded") + "?depth=1"):
        depth, total = row.pop("depth"), row.pop("total_quantity")
        assert (depth, total) == (1, row["quantity"])
        line = single[row["child_part_number"]]
        # What a merge told the server is asked of one level only.
        told = {key: line[key] for key in ("assembly_told", "assembly_quantity", "components")}
        assert {**row, **told} == line


def test_depth(api: Api, gearbox: dict[str, str]) -> None:
    """``depth`` ends the tree early; beyond 20 levels is refused."""
    assert {row["depth"] for row in api.get(bom(gearbox["top"], "expanded") + "?depth=1")} == {1}
    for wrong in (0, 21, "x"):
        api.bad(400, "GET", bom(gearbox["top"], "expanded") + f"?depth={wrong}")


def test_flat(api: Api, gearbox: dict[str, str]) -> None:
    """Leaf parts only, multiplied down the tree and summed over all places."""
    answer = api.get(bom(gearbox["top"], "flat"))
    assert answer["part_number"] == gearbox["top"]
    totals = {row["part_number"]: row["total_quantity"] for row in answer["flat_bom"]}
    assert totals == {
        gearbox["plate"]: 1,
        gearbox["housing"]: 2,
        gearbox["gear"]: 8,
        gearbox["shaft"]: 2,
        gearbox["bolt"]: 18,
        gearbox["cover"]: 1,
    }


def test_alternates_are_not_counted(api: Api) -> None:
    """Only components are multiplied, weighed and paid; alternates are shown in the tree."""
    top, a, b = api.items(3)
    api.merge(top, {a: 1})
    api.add_line(top, b, rel_type="alternate")
    assert [row["part_number"] for row in api.get(bom(top, "flat"))["flat_bom"]] == [a]
    assert len(api.get(bom(top, "expanded"))) == 2
    assert api.get(bom(top, "cost"))["missing"] == [a]
    # What an alternate consists of is no part of the product, in no view.
    api.merge(b, {api.item(): 3})
    assert len(api.get(bom(top, "expanded"))) == 2
    assert [row["part_number"] for row in api.get(bom(top, "flat"))["flat_bom"]] == [a]


@BOTH
def test_where_used(api: Api, gearbox: dict[str, str]) -> None:
    """Direct parents; with ``indirect`` theirs as well."""
    gear = api.get(bom(gearbox["gear"], "where-used"))
    assert [(use["parent_part_number"], use["quantity"]) for use in gear] == [(gearbox["gearbox"], 4)]
    all_uses = api.get(bom(gearbox["gear"], "where-used") + "?indirect=true")
    assert [(use["depth"], use["parent_part_number"]) for use in all_uses] == [
        (1, gearbox["gearbox"]),
        (2, gearbox["top"]),
    ]
    bolt = api.get(bom(gearbox["bolt"], "where-used"))
    assert {use["parent_part_number"] for use in bolt} == {gearbox["top"], gearbox["gearbox"]}


def test_cost(api: Api, gearbox: dict[str, str]) -> None:
    """Flat × standard cost per currency; what has no cost is named, not counted as nothing."""
    prices = {"plate": 10, "housing": 20.5, "gear": 2, "shaft": 3, "bolt": 0.1}
    for name, price in prices.items():
        api.good("PUT", f"/api/items/{gearbox[name]}", {"properties": {"standard_cost": price}})
    answer = api.get(bom(gearbox["top"], "cost"))
    assert answer["total_cost"] == pytest.approx(10 + 41 + 16 + 6 + 1.8)
    assert answer["missing"] == [gearbox["cover"]]
    assert answer["complete"] is False
    api.good(
        "PUT",
        f"/api/items/{gearbox['cover']}",
        {"properties": {"standard_cost": "7.50", "currency": "USD"}},
    )
    answer = api.get(bom(gearbox["top"], "cost"))
    assert answer["complete"] is True
    assert answer["total_cost"] is None
    assert {t["currency"]: t["total_cost"] for t in answer["totals"]} == {
        "EUR": pytest.approx(74.8),
        "USD": 7.5,
    }


def test_mass(api: Api, gearbox: dict[str, str]) -> None:
    """Masses from the leaves up; a sub-assembly's own mass only where its parts do not have all of theirs."""
    for name, mass in {"plate": 1.0, "cover": 0.5, "bolt": 0.01, "gear": 0.2}.items():
        api.good("PUT", f"/api/items/{gearbox[name]}", {"properties": {"mass_kg": mass}})
    answer = api.get(bom(gearbox["top"], "mass"))
    assert answer["total_mass_kg"] == pytest.approx(1 + 0.5 + 0.18 + 1.6)
    assert set(answer["missing"]) == {gearbox["housing"], gearbox["shaft"]}
    api.good("PUT", f"/api/items/{gearbox['gearbox']}", {"properties": {"mass_kg": 4.0}})
    answer = api.get(bom(gearbox["top"], "mass"))
    assert answer["total_mass_kg"] == pytest.approx(1 + 0.5 + 0.12 + 8.0)
    assert answer["missing"] == []
    taken = {row["part_number"]: row for row in answer["lines"]}
    assert taken[gearbox["gearbox"]]["is_assembly"] is True
    for name in ("housing", "shaft"):
        api.good("PUT", f"/api/items/{gearbox[name]}", {"properties": {"mass_kg": 1.0}})
    answer = api.get(bom(gearbox["top"], "mass"))
    assert answer["total_mass_kg"] == pytest.approx(1 + 0.5 + 0.18 + 1.6 + 4.0)
    assert answer["stated_mass_kg"] is None


@BOTH
def test_a_newer_revision_is_reported(api: Api) -> None:
    """A line pinned to a revision says so when there is a newer one."""
    top, a = api.items(2)
    for n in range(3):
        api.good("POST", f"/api/items/{a}/revisions", {"comment": f"r{n}"})
    api.merge(top, {a: 1})
    line = api.lines(top)[a]
    assert (line["effective_revision"], line["newer_revision_exists"]) == (3, False)
    line = api.edit_line(top, a, child_revision=2)
    assert (line["effective_revision"], line["newer_revision_exists"]) == (2, True)


def test_an_item_without_bom(api: Api) -> None:
    """Everything is empty, nothing fails."""
    number = api.item()
    assert api.get(bom(number)) == []
    assert api.get(bom(number, "expanded")) == []
    assert api.get(bom(number, "flat"))["flat_bom"] == []
    assert api.get(bom(number, "where-used")) == []
    assert api.get(bom(number, "cost"))["total_cost"] == 0
    assert api.get(bom(number, "mass"))["total_mass_kg"] == 0
    for rest in ("", "expanded", "flat", "cost", "mass", "where-used", "review", "history", "compare"):
        api.bad(404, "GET", bom("NO-SUCH", rest))
