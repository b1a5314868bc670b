# SPDX-License-Identifier: LGPL-2.1-or-later
"""The page of all BOMs that wait for a person, and its badge in the header."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import Locator, Page, expect
from server_testing import Api, bom, merge_body

Visit = Callable[..., Page]


def row(page: Page, name: str) -> Locator:
    """The table row that begins with this name."""
    return page.locator("tr", has=page.get_by_role("rowheader", name=name, exact=True))


def waits(api: Api, folder: str, *, conflict: bool = False, left_out: bool = False) -> str:
    """A BOM with two unreferenced lines, from this project folder."""
    parent, used, *gone = api.items(4)
    document = {"file": "Top.FCStd", "folder": folder}
    api.merge(parent, {used: 1, **dict.fromkeys(gone, 2)}, document=document)
    if conflict:
        api.good("PUT", bom(parent, used), {"quantity": 3})
    more = (
        {
            "left_out": [
                {"reason": "missing", "name": "Lid", "file": "Lid.FCStd", "object": "Body", "quantity": 1},
                {
                    "reason": "unregistered",
                    "name": "Pin",
                    "file": "Pin.FCStd",
                    "object": "Pin",
                    "quantity": 2,
                },
            ]
        }
        if left_out
        else {}
    )
    now = {used: 4 if conflict else 1}
    # Lines of which nobody knows the component stay as they are while one is missing: they are gone before.
    api.merge(parent, now, document=document)
    api.good("POST", bom(parent, "merge"), {**merge_body(now, document=document), **more})
    return parent


@pytest.mark.parametrize("script", [True, False])
def test_what_waits_is_found_and_decided_for_many(api: Api, visit: Visit, script: bool) -> None:
    """Counted per BOM, by folder; chosen ones are settled with a reason, the others and the quiet stay.

    With a script, a BOM that a filter hides stays chosen, and is decided about with those that are shown.
    """
    first, second = waits(api, "robot/arm"), waits(api, "robot", conflict=True, left_out=True)
    other = waits(api, "crane")
    quiet = api.items(2)
    api.merge(quiet[0], {quiet[1]: 1})
    page = visit("editor", java_script_enabled=script)
    page.goto("/items")
    count = int(page.locator(".dot").inner_text())
    page.get_by_role("link", name="Waiting").click()
    # Only a script can keep what is chosen, and the page says so.
    expect(page.get_by_text("nothing is chosen any more")).to_be_visible(visible=not script)
    expect(page.locator("tbody tr")).to_have_count(count)
    expect(row(page, quiet[0])).to_have_count(0)
    expect(row(page, second).locator("td.number")).to_have_text(
        ["2", "1", "1", "1", "–", page_time(api, second)]
    )
    page.wait_for_load_state()  # the script that filters comes after the table
    page.get_by_label("Project folder").select_option("robot")
    if not script:
        page.get_by_role("button", name="Show").click()
    expect(row(page, other)).to_have_count(0)
    expect(row(page, first)).to_have_count(1)
    page.get_by_role("link", name="Conflicts").click()
    expect(page.get_by_role("columnheader", name="Conflicts")).to_have_attribute("aria-sort", "descending")
    expect(page.locator("tbody th").first).to_have_text(second)
    for one in (first, second):
        page.get_by_label(f"Choose {one}").check()
    if script:
        for kind, chosen in (
            ("conflicts", "2 chosen, 1 of them not shown"),
            ("anything", "2 of 2 chosen"),
            ("conflicts", "2 chosen, 1 of them not shown"),
        ):
            page.get_by_label("What waits").select_option(kind)
            expect(page.locator("#count")).to_have_text(chosen)
    page.get_by_label("Reason").fill("spare parts")
    page.get_by_role("button", name="Keep as intentional").click()
    expect(page.locator(".notice")).to_contain_text("4 lines in 2 BOMs kept as intentional")
    page.wait_for_load_state()  # the script that filters runs after the notice is there
    page.get_by_label("What waits").select_option("anything")
    expect(page).not_to_have_url(re.compile("kind=conflicts"))
    assert sum(line["reason"] == "spare parts" for line in api.lines(first).values()) == 2
    expect(row(page, first)).to_have_count(0)
    assert "folder=robot" in page.url
    page.get_by_label(f"Choose {second}").check()
    page.get_by_role("button", name="Take CAD's quantities").click()
    expect(page.locator(".notice")).to_contain_text("1 line in 1 BOM set to what CAD says")
    expect(row(page, second).locator("td.number")).to_contain_text(["–", "–", "1", "1"])
    assert api.get(bom(other, "review"))["unreferenced"]
    expect(page.locator(".dot")).to_have_text(str(count - 1))


def test_a_bom_that_changed_meanwhile_is_left_and_named(api: Api, visit: Visit) -> None:
    """A sync between looking and pressing: nothing is done there, the page says so; the other one is done."""
    first, second = waits(api, "late"), waits(api, "late")
    page = visit("editor", java_script_enabled=False)
    page.goto("/waiting?folder=late")
    for one in (first, second):
        page.get_by_label(f"Choose {one}").check()
    used = next(name for name, line in api.lines(first).items() if line["unreferenced_since"] is None)
    api.merge(first, {used: 9})
    page.get_by_role("button", name="Remove", exact=True).click()
    page.get_by_role("button", name="Remove all 2").click()
    said = page.get_by_role("alert")
    expect(said).to_contain_text(f"{first}: it was changed meanwhile, so nothing was done there")
    expect(said).to_contain_text("2 lines in 1 BOM removed")
    assert (len(api.lines(first)), len(api.lines(second))) == (3, 1)


def page_time(api: Api, parent: str) -> str:
    """When the last sync was, as a page shows it."""
    return str(api.get(f"/api/items/{parent}")["last_sync"]["at"])[:16].replace("T", " ")


@pytest.mark.parametrize("script", [True, False])
def test_lines_of_many_boms_go_after_a_list_and_come_back(api: Api, visit: Visit, script: bool) -> None:
    """Remove names each line first and does nothing before a yes; one Undo brings all of them back."""
    boms = sorted([waits(api, "sure"), waits(api, "sure")], key=str.casefold)
    before = [api.get(bom(one)) for one in boms]
    page = visit("editor", java_script_enabled=script)

    def ask() -> None:
        page.goto("/waiting?folder=sure")
        for one in boms:
            page.get_by_label(f"Choose {one}").check()
        page.get_by_role("button", name="Remove", exact=True).click()
        expect(page.locator("h1")).to_have_text("Remove these 4 lines of 2 BOMs?")

    ask()
    gone = [line["child_part_number"] for lines in before for line in lines if line["unreferenced_since"]]
    expect(page.locator("tbody th")).to_have_text(gone)
    assert [api.get(bom(one)) for one in boms] == before
    page.get_by_role("link", name="Keep them").click()
    expect(row(page, boms[0])).to_have_count(1)
    assert [api.get(bom(one)) for one in boms] == before
    ask()
    page.get_by_role("button", name="Remove all 4").click()
    expect(page.locator(".notice")).to_contain_text("4 lines in 2 BOMs removed")
    assert [len(api.lines(one)) for one in boms] == [1, 1]
    assert "folder=sure" in page.url
    page.locator(".notice").get_by_role("button", name="Undo").click()
    expect(page.locator(".notice")).to_contain_text("Undone in 2 BOMs")
    assert [api.get(bom(one)) for one in boms] == before
