# SPDX-License-Identifier: LGPL-2.1-or-later
"""Whole jobs of people at one product, in browsers of their own at the same time."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import Locator, Page, expect
from server_testing import Api, bom
from settled import measured

Visit = Callable[..., Page]


def badge(page: Page) -> str:
    """The number beside *For me*; "" for none."""
    dot = page.locator('nav a[href="/mine"] + .dot')
    return dot.inner_text() if dot.count() else ""


def notice(page: Page, words: str) -> None:
    """Wait for what the page says that it did."""
    expect(page.locator(".notice")).to_contain_text(words)


def test_from_a_parts_list_to_an_order_of_a_release(api: Api, visit: Visit, tmp_path: Path) -> None:
    """A designer imports a parts list, a manager follows the product, an administrator gives a right, an
    approver compares and releases, and a purchaser orders what was released while the designer goes on."""
    top, sub, screw = *api.items(2, item_type="assembly"), api.item()
    api.merge(sub, {screw: 4})
    api.merge(top, {sub: 2})
    designer, manager, administrator = visit("editor"), visit("viewer"), visit("admin")

    manager.goto(f"/items/{top}")
    manager.get_by_role("button", name="Follow").click()
    notice(manager, "You follow it now")
    assert badge(manager) == ""

    designer.goto(f"/items/{sub}/import")
    text = f"Reference;Value;Footprint;Qty\nR1;10k {top};R_0603;1\nR2;10k {top};R_0603;1\n".encode()
    file = {"name": "board.csv", "mimeType": "text/csv", "buffer": text}
    designer.get_by_label("CSV file or workbook").set_input_files([file])  # type: ignore[list-item]
    designer.get_by_role("button", name="Check the file").click()
    expect(designer.locator("#checked")).to_contain_text("2 rows have problems")
    designer.get_by_label("2 unknown parts: make them in").select_option("M01")
    designer.locator("#allow").get_by_role("button", name="Check again").click()
    expect(designer.locator("#checked")).to_contain_text("1 row has a problem")
    designer.get_by_label("Add up the rows of one part").check()
    designer.locator("#allow").get_by_role("button", name="Check again").click()
    expect(designer.locator("#checked")).to_contain_text("1 to add")
    designer.get_by_role("button", name="Import 1 row").click()
    notice(designer, "1 part made")

    manager.goto("/mine")
    assert badge(manager) == "1"
    expect(manager.get_by_role("row").filter(has_text=top)).to_contain_text("New")
    manager.get_by_role("link", name="What changed").click()
    expect(manager.locator("main")).to_contain_text(f"10k {top} R_0603")

    designer.goto(f"/items/{top}/releases")
    designer.get_by_label("and its parts with it").check()
    designer.get_by_role("button", name="Submit for review").click()
    # Before the right is given there is nothing to press.
    manager.goto(f"/items/{top}/releases")
    expect(manager.get_by_role("button", name="Approve")).to_have_count(0)
    administrator.goto("/users")
    administrator.get_by_label("Right of viewer to approve").select_option("yes")
    administrator.get_by_role("button", name="Save viewer").click()
    notice(administrator, "viewer")
    manager.reload()
    expect(manager.locator("main")).to_contain_text("no file")
    manager.get_by_label("Release it anyway, because").fill("a pilot series")
    manager.get_by_role("button", name="Approve").click()
    expect(manager.locator("main")).to_contain_text("released")

    # The designer goes on; what was released stays as it is, and the pages compare both.
    api.good("PUT", bom(sub, screw), {"quantity": 9})
    purchaser = designer
    purchaser.goto(f"/items/{top}/releases/A?view=flat")
    purchaser.locator("summary", has_text="Export").click()
    with purchaser.expect_download() as made:
        purchaser.get_by_role("link", name="flat, with totals as CSV").click()
    made.value.save_as(tmp_path / "order.csv")
    written = (tmp_path / "order.csv").read_text("utf-8-sig")
    rows = csv.DictReader(io.StringIO(written[written.index("Item,Level") :], newline=""))
    assert {row["Part number"]: row["Total quantity"] for row in rows}[screw] == "8"
    purchaser.goto(f"/items/{top}/releases/A")
    purchaser.get_by_role("link", name="What changed since").click()
    expect(purchaser.get_by_role("row").filter(has_text=screw)).to_contain_text("9")
    administrator.goto("/audit")
    expect(administrator.locator("main")).to_contain_text("release.released")


def test_a_purchaser_fills_the_table_of_suppliers_and_orders(api: Api, visit: Visit) -> None:
    """Cells from a spreadsheet, arrow keys, Ctrl+Z, *Undo*; then an order list, noted as ordered."""
    top, screw = *api.items(1, item_type="assembly"), api.item()
    api.merge(top, {screw: 3})
    page = visit("editor", permissions=["clipboard-read", "clipboard-write"])
    page.goto(f"/items/{screw}/suppliers")

    def cell(column: str, row: int) -> Locator:
        return page.get_by_label(f"{column}, row {row}", exact=True)

    def paste(text: str) -> None:
        measured(page, "text => navigator.clipboard.writeText(text)", text)
        page.keyboard.press("Control+v")

    cell("Supplier", 1).fill("Typed")
    paste("plain text is pasted as it is")
    expect(cell("Supplier", 1)).to_have_value("Typedplain text is pasted as it is")
    cell("Supplier", 1).fill("Typed")
    paste('Nord\tN-7\t\t50\t100\t"1: 0.50\n100: 0.40"\tEUR\t14\r\nSüd\tS "7"\t\t1\t1\t0.7\tEUR\t3\r\n')
    expect(cell("Price of one, by quantity", 1)).to_have_value("1: 0.50; 100: 0.40")
    expect(cell("Supplier's part number", 2)).to_have_value('S "7"')
    page.keyboard.press("Control+z")
    expect(cell("Supplier", 1)).to_have_value("Typed")
    expect(cell("Supplier", 2)).to_have_value("")
    cell("Supplier", 1).fill("")
    paste("Nord\tN-7\t\t50\t100\t1: 0.50; 100: 0.40\tEUR\t14\nSüd\tS-7\t\t1\t1\t0.7\tEUR\t3\n")
    # From the end of a text to the right, down, and from its start to the left again.
    page.keyboard.press("End")
    for key, column, row in [
        ("ArrowRight", "Supplier's part number", 1), ("ArrowDown", "Supplier's part number", 2),
        ("ArrowLeft", "Supplier", 2), ("ArrowRight", "Supplier's part number", 2),
        ("ArrowLeft", "Supplier", 2), ("ArrowUp", "Supplier", 1), ("Enter", "Supplier", 2),
    ]:  # fmt: skip
        page.keyboard.press(key)
        expect(cell(column, row)).to_be_focused()
    page.keyboard.type("Mitte")
    page.get_by_role("button", name="Save").click()
    notice(page, "saved")
    assert [one["supplier"] for one in api.get(f"/api/items/{screw}")["supplier_parts"]] == ["Nord", "Mitte"]
    page.get_by_role("button", name="Undo").click()
    notice(page, "")
    assert "supplier_parts" not in api.get(f"/api/items/{screw}")
    page.get_by_role("button", name="Undo").click()
    expect(cell("Supplier", 2)).to_have_value("Mitte")

    page.goto(f"/items/{top}/order")
    page.get_by_label("For how many").fill("100")
    page.get_by_role("button", name="Show").click()
    bought = page.get_by_role("region", name="Bought parts").get_by_role("row").filter(has_text=screw)
    expect(bought.get_by_role("textbox")).to_have_value("300")
    expect(bought).to_contain_text("6 × 50")
    page.get_by_label(f"Choose {screw}").check()
    page.get_by_label("Note", exact=True).fill("PO-17")
    page.get_by_role("button", name="Note chosen as ordered").click()
    expect(page.get_by_role("region", name="What was ordered")).to_contain_text("PO-17")
    page.get_by_label("without what was ordered already").check()
    page.get_by_role("button", name="Show").click()
    expect(bought).to_contain_text("0 of 300")


def test_boxes_and_quantities_stay_on_the_next_page_of_an_order(api: Api, visit: Visit) -> None:
    """What is chosen on two pages is ordered at once; without a script the page says that it cannot be."""
    top = api.item(item_type="assembly")
    numbers = [f"{top}-{number:03}" for number in range(501)]
    rows = "".join(f"{number},2\n" for number in numbers)
    api.good("POST", bom(top, "import?make=M01"), body=f"PN,Qty\n{rows}".encode())
    path, only_here = f"/items/{top}/order", "count for this page only"
    scriptless = visit("editor", java_script_enabled=False)
    scriptless.goto(path)
    expect(scriptless.get_by_text(only_here)).to_be_visible()
    page = visit("editor")
    page.goto(path)
    expect(page.get_by_text(only_here)).to_have_count(0)
    page.get_by_label(f"Choose {numbers[0]}").check()
    page.get_by_label(f"How much of {numbers[0]}").fill("7")
    page.get_by_role("link", name="Next").click()
    expect(page.locator("#count")).to_have_text("1 chosen, 1 of them not shown")
    page.get_by_label(f"Choose {numbers[-1]}").check()
    page.get_by_role("link", name="Previous").click()
    expect(page.locator("#count")).to_have_text("2 chosen, 1 of them not shown")
    expect(page.get_by_label(f"Choose {numbers[0]}")).to_be_checked()
    expect(page.get_by_label(f"How much of {numbers[0]}")).to_have_value("7")
    page.get_by_role("button", name="Note chosen as ordered").click()
    notice(page, "2 noted as ordered")
    ordered = api.get(f"/api/items/{top}/orders")["orders"]
    assert {one["part_number"]: one["quantity"] for one in ordered} == {numbers[0]: "7", numbers[-1]: "2"}
