# SPDX-License-Identifier: LGPL-2.1-or-later
"""Every other page about items in a browser: items, item, history, import, activity, errors."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from model_file import model_file
from playwright.sync_api import Locator, Page, Route, expect
from server_testing import Api, bom, form_body
from settled import measured, wait_for_cursor

Visit = Callable[..., Page]


def row(page: Page, name: str) -> Locator:
    """The table row that begins with this name."""
    return page.locator("tr", has=page.get_by_role("rowheader", name=name, exact=True))


# --- items ------------------------------------------------------------------------------------------------


def test_search_as_you_type(api: Api, visit: Visit) -> None:
    """The list follows the typing, the address keeps up, and no page is loaded."""
    screw, nut = api.item("SRCH-1", name="Hex screw"), api.item("SRCH-2", name="Hex nut")
    page = visit("viewer")
    page.goto("/items")
    measured(page, "window.still = true")
    page.get_by_label("Search").press_sequentially("hex screw")
    expect(page.get_by_role("rowheader", name=screw)).to_be_visible()
    expect(page.get_by_role("rowheader", name=nut)).to_have_count(0)
    expect(page.locator("#found")).to_have_text("1 item for “hex screw”")
    page.wait_for_url("**/items?q=hex+screw")
    assert measured(page, "window.still")
    page.get_by_label("Search").fill("nothing like this")
    expect(page.locator("#shown")).to_contain_text("No item matches")


def test_a_late_answer_does_not_replace_a_newer_one(api: Api, visit: Visit) -> None:
    """The answer to the first letters comes last, and is not shown."""
    slow, quick = api.item("LATE-A1"), api.item("LATE-B1")
    page = visit("viewer")
    held: list[Route] = []
    page.route("**/items?q=late-a*", lambda route: held.append(route))
    page.goto("/items")
    with page.expect_request("**/items?q=late-a*"):
        page.get_by_label("Search").fill("late-a")
    page.get_by_label("Search").fill("late-b")
    expect(page.get_by_role("rowheader", name=quick)).to_be_visible()
    for route in held:
        route.continue_()
    expect(page.get_by_role("rowheader", name=slow)).to_have_count(0)
    expect(page.get_by_role("rowheader", name=quick)).to_be_visible()


def test_the_list_has_pages(api: Api, visit: Visit) -> None:
    """A hundred at a time, forwards and back, with the words kept; sorted by a column, largest first too."""
    for n in range(103):
        api.item(f"PAGE-{n:03}", name=f"Leaf {999 - n}")
    page = visit("viewer", java_script_enabled=False)
    page.goto("/items?q=PAGE-")
    expect(page.locator("#found")).to_contain_text("103 items for “PAGE-”, 1 to 100 shown")
    page.get_by_role("link", name="Next").click()
    expect(page.locator("tbody tr")).to_have_count(3)
    page.get_by_role("link", name="Previous").click()
    expect(page.locator("tbody tr")).to_have_count(100)
    page.get_by_role("link", name="Name", exact=True).click()
    expect(page.locator("tbody th").first).to_have_text("PAGE-102")
    page.get_by_role("link", name="Name", exact=True).click()
    expect(page.locator("tbody th").first).to_have_text("PAGE-000")
    expect(page.get_by_label("Search")).to_have_value("PAGE-")
    page.get_by_label("Type").select_option("tool")
    page.get_by_role("button", name="Search").click()
    expect(page.locator("#shown")).to_contain_text("No item matches")
    assert "sort=-name" in page.url


# --- one item -----------------------------------------------------------------------------------------------


@pytest.fixture
def machine(api: Api) -> dict[str, str]:
    """A machine with two modules of three screws each; one screw has no mass."""
    names = ("machine", "module", "screw", "plate")
    numbers = dict(zip(names, api.items(4), strict=True))
    api.good("PUT", f"/api/items/{numbers['screw']}", {"properties": {"mass_kg": 0.5, "standard_cost": 2}})
    api.merge(numbers["module"], {numbers["screw"]: 3})
    api.merge(numbers["machine"], {numbers["module"]: 2, numbers["plate"]: 1})
    return numbers


def test_the_tree_opens_and_closes(machine: dict[str, str], visit: Visit) -> None:
    """Several levels, each can be closed, all at once too, also from the keyboard; the address keeps up."""
    page = visit("viewer")
    page.goto(f"/items/{machine['machine']}")
    measured(page, "window.still = true")
    screw = page.locator(".tree").get_by_role("link", name=machine["screw"])
    expect(screw).to_be_visible()
    page.get_by_label("Levels").get_by_role("link", name="1").click()
    expect(screw).to_have_count(0)
    twist = page.get_by_role("link", name=f"What is in {machine['module']}")
    expect(twist).to_have_attribute("aria-expanded", "false")
    twist.focus()
    page.keyboard.press("Enter")
    expect(screw).to_be_visible()
    wait_for_cursor(twist)
    expect(twist).to_have_attribute("aria-expanded", "true")
    assert measured(page, "window.still")
    page.reload()
    expect(screw).to_be_visible()
    page.go_back()
    expect(screw).to_have_count(0)


@pytest.mark.parametrize("script", [True, False])
def test_a_row_is_looked_at_beside_the_table(machine: dict[str, str], visit: Visit, script: bool) -> None:
    """The table stays as it is; the heading has the focus, Escape closes it; the address keeps it."""
    page = visit("viewer", java_script_enabled=script)
    page.goto(f"/items/{machine['machine']}?sort=number")
    row = page.get_by_role("row").filter(has=page.locator(f"a[href='/items/{machine['plate']}']"))
    row.get_by_role("link", name="Show it beside the table").click()
    beside = page.locator(".glance")
    expect(beside.get_by_role("heading")).to_contain_text(machine["plate"])
    expect(beside.get_by_role("link", name="Open")).to_have_attribute("href", f"/items/{machine['plate']}")
    assert "sort=number" in page.url
    if script:
        expect(page.locator("#beside")).to_be_focused()
        page.keyboard.press("Escape")
    else:
        beside.get_by_role("link", name="Close").click()
    expect(beside).to_have_count(0)
    page.goto(f"/items/{machine['machine']}?beside=NO-SUCH")
    expect(beside).to_have_count(0)


def test_the_tree_says_what_each_row_weighs_and_costs(machine: dict[str, str], visit: Visit) -> None:
    """Quantity in its parent and in all, mass and cost of one and of all; several pieces; without script."""
    page = visit("viewer", java_script_enabled=False)
    page.goto(f"/items/{machine['machine']}")
    cells = row(page, machine["screw"]).locator("td.number")
    expect(cells).to_have_text(["10", "3", "6", "500 g", "3 kg", "2.00 EUR", "12.00 EUR"])
    expect(row(page, machine["module"]).locator("td.number")).to_have_text(
        ["10", "2", "2", "1.5 kg", "3 kg", "6.00 EUR", "12.00 EUR"]
    )
    expect(row(page, machine["plate"]).locator("td.number")).to_have_text(
        ["20", "1", "1", "–", "–", "–", "–"]
    )
    page.get_by_label("For how many").fill("10")
    page.get_by_role("button", name="Show").click()
    expect(row(page, machine["screw"]).locator("td.number")).to_have_text(
        ["10", "3", "60", "500 g", "30 kg", "2.00 EUR", "120.00 EUR"]
    )
    totals = page.locator(".totals").first
    expect(totals).to_contain_text("30 kg")
    page.get_by_role("link", name="Flat, with totals").click()
    expect(row(page, machine["screw"])).to_contain_text("60")
    expect(page.get_by_label("For how many")).to_have_value("10")
    for words in ("30 kg", "120.00 EUR", f"1 item that states none is left out: {machine['plate']}"):
        expect(totals).to_contain_text(words)


def test_a_partly_known_mass_is_no_mass(api: Api, visit: Visit) -> None:
    """What is above a part without a mass weighs at least what is known."""
    top, module, known, unknown = api.items(4)
    api.good("PUT", f"/api/items/{known}", {"properties": {"mass_kg": 2, "standard_cost": 3}})
    api.merge(module, {known: 1, unknown: 1})
    api.merge(top, {module: 2})
    page = visit("viewer")
    page.goto(f"/items/{top}")
    expect(row(page, module).locator("td.number")).to_have_text(
        ["10", "2", "2", "≥ 2 kg", "≥ 4 kg", "≥ 3.00 EUR", "≥ 6.00 EUR"]
    )


def test_the_tree_sorts_and_filters(machine: dict[str, str], visit: Visit) -> None:
    """Sorted among its siblings; a filter shows what fits and what it is in; both are in the address."""
    page = visit("viewer")
    page.goto(f"/items/{machine['machine']}")
    heads = page.locator(".tree tbody th a:not(.twist)")
    expect(heads).to_have_text([machine["module"], machine["screw"], machine["plate"]])
    page.get_by_role("link", name="Quantity", exact=True).click()
    expect(page.get_by_role("columnheader", name="Quantity")).to_have_attribute("aria-sort", "descending")
    page.get_by_role("link", name="Quantity", exact=True).click()
    expect(page.get_by_role("columnheader", name="Quantity")).to_have_attribute("aria-sort", "ascending")
    expect(heads).to_have_text([machine["plate"], machine["module"], machine["screw"]])
    page.get_by_label("Find in this BOM").press_sequentially(machine["screw"])
    expect(heads).to_have_text([machine["module"], machine["screw"]])
    page.wait_for_url(f"**?q={machine['screw']}&*sort=quantity*")
    page.reload()
    expect(heads).to_have_text([machine["module"], machine["screw"]])
    expect(page.get_by_label("Find in this BOM")).to_have_value(machine["screw"])
    page.get_by_label("Find in this BOM").fill("nothing like this")
    expect(page.locator("#shown")).to_contain_text("No line of this BOM matches")


def test_where_used(machine: dict[str, str], visit: Visit) -> None:
    """Directly and further up."""
    page = visit("viewer")
    page.goto(f"/items/{machine['screw']}")
    expect(row(page, machine["module"])).to_contain_text("directly")
    expect(row(page, machine["machine"])).to_contain_text("2 levels up")


def test_files_and_exports_are_downloads(
    machine: dict[str, str], api: Api, visit: Visit, tmp_path: Path
) -> None:
    """A revision's file comes back as it was sent; the exports are files with names."""
    number = machine["machine"]
    body, headers = form_body({"file": ("plan.FCStd", model_file(b"as sent")), "comment": "first"})
    assert api.call("POST", f"/api/items/{number}/file", body=body, headers=headers).status == 201
    page = visit("viewer")
    page.goto(f"/items/{number}")
    with page.expect_download() as download:
        page.get_by_label("Table of revisions").get_by_role("link", name="plan.FCStd").click()
    assert Path(download.value.path()).read_bytes() == model_file(b"as sent")
    page.get_by_text("Export", exact=True).click()
    with page.expect_download() as download:
        page.get_by_role("link", name="all levels as CSV", exact=True).click()
    assert download.value.suggested_filename.endswith("-bom-indented.csv")
    assert machine["screw"] in Path(download.value.path()).read_text("utf-8")


# --- history ------------------------------------------------------------------------------------------------


def test_history_compare_and_restore(machine: dict[str, str], api: Api, visit: Visit) -> None:
    """Two points side by side with words and colour; the old state comes back."""
    number, plate, module = machine["machine"], machine["plate"], machine["module"]
    api.good("PUT", bom(number, plate), {"quantity": 5})
    api.good("DELETE", bom(number, module))
    page = visit("editor")
    page.goto(f"/items/{number}/bom")
    page.get_by_role("link", name="Whole history").click()
    expect(page.locator("tbody tr")).to_have_count(3)
    page.locator('input[name="old"]').last.check()
    page.get_by_role("button", name="Compare the two chosen").click()
    expect(row(page, module)).to_contain_text("removed")
    expect(row(page, module)).to_have_class("removed")
    expect(row(page, plate)).to_contain_text("changed")
    expect(row(page, plate)).to_contain_text("quantity 1 → 5")
    page.get_by_label("Reason").fill("too early")
    page.get_by_role("button", name="Make the BOM again as in the old state").click()
    expect(page.locator(".notice")).to_contain_text("Restored: 2 lines")
    assert api.quantities(number) == {module: 2, plate: 1}


# --- import -------------------------------------------------------------------------------------------------


def test_import_shows_before_it_writes(machine: dict[str, str], api: Api, visit: Visit) -> None:
    """A mistake writes nothing and the row is named; a good file shows what it will do, then does it."""
    number, plate, screw = machine["machine"], machine["plate"], machine["screw"]
    page = visit("editor")
    page.goto(f"/items/{number}/import")
    before = api.lines(number)
    check(page, f"Part number,Quantity\n{plate},4\nNO-SUCH,1\n")
    expect(page.locator("#checked")).to_contain_text("1 row has a problem")
    expect(row(page, "NO-SUCH")).to_contain_text("does not exist on this server")
    expect(page.get_by_role("button", name="Import", exact=False)).to_have_count(0)
    check(page, f"Part number;Quantity;Notes\n{plate};4;\n{screw};2,5;spare\n")
    expect(page.locator("#checked")).to_contain_text("1 to add, 1 to change")
    expect(row(page, plate)).to_contain_text("quantity 1 → 4")
    assert api.lines(number) == before
    page.get_by_role("button", name="Import 2 rows").click()
    expect(page.locator(".notice")).to_contain_text("1 added, 1 changed")
    assert api.quantities(number) == {machine["module"]: 2, plate: 4, screw: 2.5}


def test_import_of_an_old_check_is_checked_again(machine: dict[str, str], api: Api, visit: Visit) -> None:
    """The BOM changed between check and click: nothing is written, and the check is repeated."""
    number, plate = machine["machine"], machine["plate"]
    page = visit("editor")
    page.goto(f"/items/{number}/import")
    check(page, f"Part number,Quantity\n{plate},4\n")
    api.good("PUT", bom(number, plate), {"quantity": 4})
    page.get_by_role("button", name="Import 1 row").click()
    expect(page.get_by_role("alert")).to_contain_text("changed by somebody else")
    expect(page.locator("#checked")).to_contain_text("nothing to do")


def check(page: Page, text: str) -> None:
    """Choose a file with this text and have it checked."""
    file = {"name": "bom.csv", "mimeType": "text/csv", "buffer": text.encode()}
    page.get_by_label("CSV file or workbook").set_input_files([file])  # type: ignore[list-item]
    page.get_by_role("button", name="Check the file").click()
    page.locator("#checked").wait_for()


# --- activity -----------------------------------------------------------------------------------------------


def test_activity_is_live(api: Api, visit: Visit) -> None:
    """What happens appears by itself, newest first, in words, and leads to the page it is about."""
    parent, child = api.items(2)
    page = visit("viewer")
    page.goto("/activity")
    expect(page.locator("#state")).to_contain_text("Live")
    api.merge(parent, {child: 4})
    first = page.locator("#entries > li").first
    expect(first).to_contain_text(parent)
    expect(first).to_contain_text("BOM merged from CAD")
    expect(first).to_contain_text("+1 added")
    api.merge(parent, {})
    expect(first).to_contain_text("⚠1 unreferenced")
    expect(first.locator("time")).to_have_count(1)
    first.get_by_role("link", name=parent).click()
    expect(page.locator(".banner.warn h2")).to_contain_text("1 item in the Silo BOM is not referenced")


def test_activity_comes_back_after_it_was_turned_away(api: Api, visit: Visit) -> None:
    """The stream is refused (a restart behind a proxy): the page says so, tries again, and misses nothing."""
    page = visit("viewer")
    turned_away: list[str] = []

    def turn_away_once(route: Route) -> None:
        if turned_away:
            route.continue_()
            return
        turned_away.append(route.request.url)
        route.fulfill(status=503, body="")

    page.route("**/api/events*", turn_away_once)
    page.goto("/activity")
    expect(page.locator("#state")).to_contain_text("trying again")
    item = api.item(name="made while nobody listened")
    expect(page.locator("#state")).to_contain_text("Live")
    expect(page.locator("#entries > li").first).to_contain_text(item)


HOSTILE = "<img src=x onerror=alert(1)>\"'&lt;{{7*7}}</td></script>"


def test_names_are_shown_as_text(api: Api, visit: Visit) -> None:
    """A hostile name, note, comment or reason is text on every page, also on those that scripts fill."""
    parent, child = api.item(name=HOSTILE), api.item(name=HOSTILE, long_description=HOSTILE)
    page = visit("admin")
    page.on("dialog", lambda dialog: pytest.fail("a script of the name's ran"))
    page.goto("/activity")
    expect(page.locator("#state")).to_contain_text("Live")
    api.merge(parent, {child: 1}, document={"file": HOSTILE})
    api.good("PUT", bom(parent, child), {"notes": HOSTILE, "unit": "<b>m</b>"})
    api.good("PUT", f"/api/items/{child}", {"properties": {"<b>": HOSTILE}, "comment": HOSTILE})
    expect(page.locator("#entries")).to_contain_text(HOSTILE)
    page.goto("/items")
    page.get_by_label("Search").fill("onerror")
    expect(page.locator("#found")).to_contain_text("2 items")
    expect(page.locator("#shown")).to_contain_text(HOSTILE)
    assert page.locator("img[src=x]").count() == 0


def test_a_slash_goes_to_the_search(visit: Visit) -> None:
    """From anywhere on the page; while somebody types, it is a slash."""
    page = visit("viewer")
    page.goto("/items")
    page.keyboard.press("/")
    field = page.get_by_role("searchbox")
    expect(field).to_be_focused()
    page.keyboard.type("a/b")
    expect(field).to_have_value("a/b")
