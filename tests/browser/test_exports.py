# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a purchaser takes along: exports for so many pieces, and a page for paper."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from uuid import uuid4

from openpyxl import load_workbook
from playwright.sync_api import Page, expect
from server_testing import Api, bom, merge_body
from settled import box_of, measured

Visit = Callable[..., Page]


def test_an_order_for_ten(api: Api, visit: Visit, tmp_path: Path) -> None:
    """The number on the page is that of the exports and of the paper; without script."""
    top, part = api.items(2)
    api.good("PATCH", f"/api/items/{part}/properties", {"standard_cost": 2, "supplier": "Nordic"})
    api.merge(top, {part: 3})
    page = visit("viewer", java_script_enabled=False)
    page.goto(f"/items/{top}?view=flat")
    page.get_by_label("For how many").fill("10")
    page.get_by_role("button", name="Show").click()
    page.get_by_text("Export for 10").click()
    with page.expect_download() as waiting:
        page.get_by_role("link", name="flat, with totals as XLSX", exact=True).click()
    file = tmp_path / waiting.value.suggested_filename
    assert file.name == f"{top}-bom-flat-for-10.xlsx"
    waiting.value.save_as(file)
    rows = [[cell.value for cell in row] for row in load_workbook(file).active.iter_rows()]
    order = dict(zip(rows[1], rows[2], strict=True))
    assert (order["Part number"], order["Quantity"], order["Overall cost"], order["Supplier"]) == (
        part,
        30,
        60,
        "Nordic",
    )
    page.get_by_role("link", name="Print").click()
    expect(page.locator("main")).to_contain_text("For 10 pieces")
    expect(page.locator("tr", has_text=part)).to_contain_text("Nordic")
    expect(page.locator("main")).to_contain_text("60.00 EUR")


def test_paper_has_all_of_it_and_nothing_else(api: Api, visit: Visit) -> None:
    """All levels, what is missing on top, the head on every sheet; no menus, no buttons, dark ink."""
    top, sub, part = api.items(3)
    api.merge(sub, {part: 2})
    gap = {"reason": "missing", "name": "Lid", "file": "Lid.FCStd", "object": "Body", "quantity": 1}
    api.good("POST", bom(top, "merge"), {**merge_body({sub: 2}), "left_out": [gap]})
    page = visit("viewer", color_scheme="dark")
    page.goto(f"/items/{top}/print")
    expect(page.get_by_role("button", name="Print")).to_be_visible()
    page.emulate_media(media="print")
    for gone in (".top", "#print", "footer"):
        expect(page.locator(gone)).to_be_hidden()
    expect(page.locator(".banner.warn")).to_contain_text("Incomplete: 1 missing")
    expect(page.locator("tbody th")).to_have_text([sub, part])
    style = "e => [getComputedStyle(e).color, getComputedStyle(document.body).backgroundColor]"
    assert measured(page.locator("h1"), style) == ["rgb(0, 0, 0)", "rgb(255, 255, 255)"]
    assert measured(page.locator("thead"), "e => getComputedStyle(e).display") == "table-header-group"
    # The item's own page prints as well.
    page.goto(f"/items/{top}")
    for gone in (".top", "#view", ".twist"):
        expect(page.locator(gone).first).to_be_hidden()


def test_an_order_list_fits_its_sheet(visit: Visit, api: Api) -> None:
    """A4 upright, 12 mm of edge: the last column, the lead time, is on the paper, whatever the names are."""
    top = api.item(item_type="assembly")
    part = api.item("B" * 40 + uuid4().hex[:8], name="Deep groove ball bearing with " * 3)
    offer = {"supplier": "Kugellager & Söhne", "number": "6204-2RSH/C3-" + "X" * 30, "lead_time_days": 21}
    offer |= {"prices": [{"quantity": 1, "price": 1234.56}], "pack_size": 10}
    api.good("PUT", f"/api/items/{part}/suppliers", {"supplier_parts": [offer]})
    api.merge(top, {part: 1234})
    ordered = {"parts": [{"part_number": part, "quantity": 10, "supplier": "Kugellager & Söhne"}]}
    api.good("POST", f"/api/items/{top}/orders", ordered)
    page = visit("admin", viewport={"width": 703, "height": 1000})  # 186 mm
    page.goto(f"/items/{top}/order?pieces=5")
    page.emulate_media(media="print")
    assert measured(page, "document.documentElement.scrollWidth") <= 703
    last = box_of(page.get_by_role("cell", name="21 days"))
    assert last["x"] + last["width"] <= 703
