# SPDX-License-Identifier: LGPL-2.1-or-later
"""Units of items and lines: what converts is added up, and what does not is an open question everywhere."""

from __future__ import annotations

from hunting import BOTH
from server_testing import Api, bom


def hose_of(api: Api, unit: str | None = "m") -> tuple[str, str]:
    """A product, and a hose that is sold by the metre: 10 EUR and 0.2 kg each."""
    product = api.item()
    facts = {"standard_cost": 10, "currency": "EUR", "mass_kg": 0.2}
    return product, api.item(unit=unit, properties=facts)


@BOTH
def test_500_mm_of_hose_cost_5_euros(api: Api) -> None:
    """And weigh 100 g; half a metre more in a sub-assembly is one row of a metre."""
    product, hose = hose_of(api)
    api.add_line(product, hose, quantity=500, unit="mm")
    assert (api.get(bom(product, "cost"))["total_cost"], api.get(bom(product, "mass"))["total_mass_kg"]) == (
        5,
        0.1,
    )
    sub = api.item()
    api.add_line(sub, hose, quantity=0.5)
    api.add_line(product, sub, quantity=1)
    (row,) = api.get(bom(product, "flat"))["flat_bom"]
    assert (row["total_quantity"], row["unit"]) == (1, "m")
    summary = api.get(bom(product, "summary"))
    assert summary["totals"] == [{"currency": "EUR", "total_cost": 10}]
    assert (summary["total_mass_kg"], summary["questions"]) == (0.2, 0)
    rows = {
        line["Level"]: line for line in export_of(api, product, "indented") if line["Part number"] == hose
    }
    assert (rows["1"]["Quantity"], rows["1"]["Unit"], rows["1"]["Overall cost"]) == ("500", "mm", "5")
    assert (rows["2"]["Quantity"], rows["2"]["Unit"], rows["2"]["Overall cost"]) == ("0.5", "m", "5")


def export_of(api: Api, product: str, view: str) -> list[dict[str, str]]:
    """The rows of a CSV export, without its notes."""
    lines = (
        api.call("GET", f"/api/items/{product}/bom/export.csv?view={view}")
        .body.decode("utf-8-sig")
        .splitlines()
    )
    start = next(number for number, line in enumerate(lines) if line.startswith("Item,"))
    head, *rows = [line.split(",") for line in lines[start:]]
    return [dict(zip(head, row, strict=False)) for row in rows]


@BOTH
def test_another_kind_of_unit_is_open_everywhere_and_counts_nowhere(api: Api) -> None:
    """Review, summary, tree, flat list, cost, mass, order list, exports, and what blocks a release."""
    product, hose = hose_of(api)
    api.add_line(product, hose, quantity=2, unit="box")
    (line,) = api.get(bom(product, "review"))["units"]
    assert (line["child_part_number"], line["unit_open"], line["child_unit"]) == (hose, True, "m")
    summary = api.get(bom(product, "summary"))
    assert (summary["questions"], summary["open"]) == (1, {product: "unit? on 1 line"})
    assert (summary["totals"], summary["cost_missing"]) == ([], {"count": 1, "first": [hose]})
    assert (summary["total_mass_kg"], summary["mass_missing"]) == (None, {"count": 1, "first": [hose]})
    (row,) = api.get(bom(product, "flat"))["flat_bom"]
    assert (row["total_quantity"], row["unit_open"]) == (0, True)
    assert api.get(bom(product, "cost"))["missing"] == [hose]
    assert api.get(bom(product, "mass"))["missing"] == [hose]
    (row,) = api.get(bom(product, "expanded"))
    assert (row["unit_open"], row["total_quantity"]) == (True, 2)
    (part,) = api.get(f"/api/items/{product}/order")["parts"]
    assert ("unit?" in part["remarks"], part["needed"]) == (True, "0")
    for view in ("single", "indented", "flat"):
        (row,) = (line for line in export_of(api, product, view) if line["Part number"] == hose)
        assert ("unit?" in row["Open"], row["Overall cost"]) == (True, "")
    api.edit_line(product, hose, quantity=2, unit="cm")
    assert api.get(bom(product, "review"))["units"] == []
    assert api.get(bom(product, "cost"))["total_cost"] == 0.2


@BOTH
def test_pieces_of_cad_are_no_metres(api: Api) -> None:
    """A model counts the hose three times: its length is asked, and nothing is kept as 3 m."""
    product, hose = hose_of(api)
    api.merge(product, {hose: 3})
    assert [line["child_part_number"] for line in api.get(bom(product, "review"))["units"]] == [hose]
    assert api.get(bom(product, "cost"))["missing"] == [hose]
    api.merge(product, {})
    decision = {"child_part_number": hose, "action": "keep", "reason": "a spare"}
    api.good("POST", bom(product, "resolve"), {"decisions": [decision]})
    line = api.lines(product)[hose]
    assert (line["source"], line["unit"], line["unit_open"]) == ("manual", "pcs", True)


def test_a_spelling_is_stored_in_its_one_form(api: Api) -> None:
    """Of an item and of a line; a word that is no unit stays; another spelling is no change."""
    product, hose = hose_of(api, "Meter")
    assert api.get(f"/api/items/{hose}")["unit"] == "m"
    api.add_line(product, hose, quantity=2, unit="MM")
    assert api.lines(product)[hose]["unit"] == "mm"
    version = api.get(bom(product, "review"))["version"]
    api.edit_line(product, hose, unit="Millimeter")
    assert api.get(bom(product, "review"))["version"] == version
    api.good("PUT", f"/api/items/{hose}", {"unit": "Rolle"})
    assert api.get(f"/api/items/{hose}")["unit"] == "Rolle"


def test_a_manual_line_without_a_unit_conflicts_in_metres_not_in_pieces(api: Api) -> None:
    """Three metres are not what CAD says with three pieces."""
    product, hose = hose_of(api)
    api.add_line(product, hose, quantity=3)
    answer = api.merge(product, {hose: 3})
    assert [warning["type"] for warning in answer["warnings"]] == ["conflict"]
    assert [conflict["child_part_number"] for conflict in api.get(bom(product, "review"))["conflicts"]] == [
        hose
    ]


def test_half_a_metre_is_ordered_at_the_price_of_a_metre(api: Api) -> None:
    """Without a pack; what was ordered in millimetres counts, and what was ordered in boxes is named."""
    product, hose = hose_of(api)
    offer = {"supplier": "Acme", "prices": [{"quantity": "1", "price": "10"}], "currency": "EUR"}
    api.good("PUT", f"/api/items/{hose}/suppliers", {"supplier_parts": [offer]})
    api.add_line(product, hose, quantity=500, unit="mm")
    (part,) = api.get(f"/api/items/{product}/order")["parts"]
    assert (part["quantity"], part["unit"], part["cost"]) == ("0.5", "m", "5")
    ordered = [
        {"part_number": hose, "quantity": "200", "unit": "mm"},
        {"part_number": hose, "quantity": "1", "unit": "box"},
    ]
    api.good("POST", f"/api/items/{product}/orders", {"parts": ordered})
    (part,) = api.get(f"/api/items/{product}/order?rest=true")["parts"]
    assert (part["ordered"], part["needed"], part["cost"]) == ("0.2", "0.3", "3")
    assert "ordered in another unit: 1 box" in part["remarks"]


@BOTH
def test_a_new_unit_of_an_item_does_not_change_what_its_lines_say(api: Api) -> None:
    """Three pieces of a hose do not become three metres: the line names pieces, and is a question."""
    product, hose = hose_of(api, None)
    other = api.item()
    api.add_line(product, hose, quantity=3)
    api.add_line(other, hose, quantity=250, unit="mm")
    line = {"parts": [{"part_number": hose, "quantity": "2"}]}
    api.good("POST", f"/api/items/{product}/orders", line)
    api.good("PUT", f"/api/items/{hose}", {"unit": "m"})
    kept = api.lines(product)[hose]
    assert (kept["quantity"], kept["unit"], kept["unit_open"]) == (3, "pcs", True)
    assert (api.lines(other)[hose]["unit"], api.lines(other)[hose]["unit_open"]) == ("mm", False)
    (row,) = api.get(f"/api/items/{product}/order")["parts"]
    assert "ordered in another unit: 2 pcs" in row["remarks"]
    api.good("PUT", f"/api/items/{hose}", {"unit": "pcs"})
    assert api.lines(product)[hose]["unit_open"] is False
    (change, *_) = api.get(bom(product, "history"))
    assert "its line stays in pcs" in change["summary"]
    version = api.get(bom(product, "review"))["version"]
    api.good("PUT", f"/api/items/{hose}", {"unit": "Stk."})
    assert api.get(bom(product, "review"))["version"] == version
