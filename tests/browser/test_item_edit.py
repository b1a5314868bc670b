# SPDX-License-Identifier: LGPL-2.1-or-later
"""Items made, renamed, described, re-categorised, given properties and files, archived and found again."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from large_boms import fcstd_with_picture
from model_file import model_file
from playwright.sync_api import Page, expect
from server_testing import Api, bom, form_body

Visit = Callable[..., Page]


@pytest.mark.parametrize("script", [True, False])
def test_an_item_is_made_and_changed(api: Api, visit: Visit, script: bool) -> None:
    """A purchaser's whole job: make it, rename it, say what it costs and where it comes from."""
    page = visit("editor", java_script_enabled=script)
    page.goto("/items")
    page.get_by_role("link", name="New item").click()
    page.get_by_label("Name", exact=True).fill("Deep groove ball bearing 608")
    page.locator("select[name=category]").select_option(label="R01 Bearings")
    page.get_by_label("Mass [kg]").fill("0,012")
    page.get_by_label("Standard cost").fill("1.35")
    page.get_by_label("Lead time [days]").fill("14")
    page.get_by_label("Supplier", exact=True).fill("Nordic Bearings")
    page.get_by_label("Supplier's part number").fill("608-2RS")
    page.get_by_role("button", name="Make the item").click()
    expect(page.locator(".notice")).to_contain_text("made")
    number = page.url.partition("?")[0].rpartition("/")[2]
    assert number.startswith("R01-")
    made = api.get(f"/api/items/{number}")
    assert made["properties"] == {
        "mass_kg": 0.012,
        "standard_cost": 1.35,
        "currency": "EUR",
        "lead_time_days": 14,
        "supplier": "Nordic Bearings",
        "supplier_part_number": "608-2RS",
    }
    expect(page.locator(".properties")).to_contain_text("Lead time14 days")
    page.get_by_role("link", name="Edit item").click()
    page.get_by_label("Part number", exact=True).fill(f"B{number}")
    page.locator("select[name=category]").select_option("F06")
    page.get_by_label("Description", exact=True).fill("sealed on both sides")
    page.get_by_label("Property").last.fill("RoHS")
    page.get_by_label("Value").last.fill("yes")
    page.get_by_label("Lead time [days]").fill("")
    page.get_by_role("button", name="Save").click()
    expect(page.get_by_role("heading", level=1)).to_contain_text(f"B{number}")
    after = api.get(f"/api/items/B{number}")
    assert after["id"] == made["id"]
    assert (after["category"], after["description"]) == ("F06", "sealed on both sides")
    kept = {name: value for name, value in made["properties"].items() if name != "lead_time_days"}
    assert after["properties"] == {**kept, "RoHS": "yes"}


def test_what_does_not_fit_is_asked_about_and_nothing_is_lost(api: Api, visit: Visit) -> None:
    """All problems together, in words; what was typed stays; nothing was written."""
    number = api.item(name="Spring")
    page = visit("editor", java_script_enabled=False)
    page.goto(f"/items/{number}/edit")
    page.get_by_label("Name", exact=True).fill("Long spring")
    page.get_by_label("Mass [kg]").fill("1,000")
    page.get_by_label("Lead time [days]").fill("2.5")
    page.get_by_label("Currency").fill("euro")
    page.get_by_label("Sourcing link").fill("javascript:alert(1)")
    page.get_by_role("button", name="Save").click()
    said = page.get_by_role("alert")
    for words in ("1000 or 1", "whole number", "such as EUR", "web address"):
        expect(said).to_contain_text(words)
    expect(page.get_by_label("Name", exact=True)).to_have_value("Long spring")
    expect(page.get_by_label("Mass [kg]")).to_have_value("1,000")
    assert api.get(f"/api/items/{number}")["name"] == "Spring"
    page.get_by_label("Mass [kg]").fill("-1")
    page.get_by_label("Lead time [days]").fill("20")
    page.get_by_label("Currency").fill("CHF")
    page.get_by_label("Sourcing link").fill("https://example.com/spring")
    page.get_by_role("button", name="Save").click()
    expect(said).to_contain_text("at least 0")
    page.get_by_label("Mass [kg]").fill("0.2")
    page.get_by_role("button", name="Save").click()
    expect(page.locator(".notice")).to_contain_text("changed")
    now = api.get(f"/api/items/{number}")
    assert (now["name"], now["properties"]["mass_kg"], now["properties"]["currency"]) == (
        "Long spring",
        0.2,
        "CHF",
    )


def test_two_people_edit_one_item(api: Api, visit: Visit) -> None:
    """Different fields: both stay. The same field: nothing is saved until somebody who saw both decides."""
    number = api.item(name="Lever")
    api.good("PATCH", f"/api/items/{number}/properties", {"supplier": "Old", "mass_kg": 1})
    mine, theirs = visit("editor"), visit("admin")
    for page in (mine, theirs):
        page.goto(f"/items/{number}/edit")
    theirs.get_by_label("Name", exact=True).fill("Hand lever")
    theirs.get_by_label("Supplier", exact=True).fill("Theirs")
    theirs.get_by_role("button", name="Save").click()
    mine.get_by_label("Mass [kg]").fill("2")
    mine.get_by_label("Supplier", exact=True).fill("Mine")
    mine.get_by_role("button", name="Save").click()
    expect(mine.get_by_role("alert")).to_contain_text("Meanwhile admin changed this item")
    expect(mine.locator(".hint.warn")).to_have_text("Now in Silo: Theirs")
    expect(mine.get_by_label("Name", exact=True)).to_have_value("Hand lever")
    assert api.get(f"/api/items/{number}")["properties"] == {"supplier": "Theirs", "mass_kg": 1}
    mine.get_by_role("button", name="Save").click()
    expect(mine.locator(".notice")).to_contain_text("changed")
    after = api.get(f"/api/items/{number}")
    assert (after["name"], after["properties"]) == ("Hand lever", {"supplier": "Mine", "mass_kg": 2})
    # Another field alone is no clash at all.
    mine.goto(f"/items/{number}/edit")
    api.good("PUT", f"/api/items/{number}", {"name": "Lever 2"})
    mine.get_by_label("Description", exact=True).fill("with a knob")
    mine.get_by_role("button", name="Save").click()
    expect(mine.locator(".notice")).to_contain_text("changed")
    after = api.get(f"/api/items/{number}")
    assert (after["name"], after["description"]) == ("Lever 2", "with a knob")


def test_a_form_sent_twice_makes_one_item(api: Api, visit: Visit) -> None:
    """As a double click or a browser that tries again sends it: the same item both times."""
    page = visit("editor", java_script_enabled=False)
    page.goto("/items/new?category=F01")
    hidden = {name: page.locator(f"input[name={name}]").first.input_value() for name in ("csrf_token", "id")}
    form = {**hidden, "name": "Sent twice", "category": "F01"}
    first, second = (page.request.post("/items/new", form=form) for _ in range(2))
    assert first.url.partition("?")[0] == second.url.partition("?")[0]
    assert "was made already" in second.text()
    assert len(api.get("/api/items?q=sent+twice")) == 1


def test_a_file_becomes_a_revision(api: Api, visit: Visit) -> None:
    """Uploaded with a comment; its picture is shown; an upload that was overtaken is refused."""
    number = api.item()
    page, late = visit("editor", java_script_enabled=False), visit("admin", java_script_enabled=False)
    for one in (page, late):
        one.goto(f"/items/{number}")
    for one, name in ((page, "first.FCStd"), (late, "late.FCStd")):
        one.get_by_label("File: a new model or another file").set_input_files(
            {"name": name, "mimeType": "application/zip", "buffer": fcstd_with_picture(len(name))}
        )
        one.get_by_label("Comment").fill(f"<b>{name}</b>")
        one.get_by_role("button", name="Upload").click()
    expect(page.locator(".notice")).to_contain_text("first.FCStd is revision 1")
    expect(page.locator(".portrait img")).to_have_count(1)
    expect(page.locator("tr", has_text="<b>first.FCStd</b>")).to_have_count(1)
    expect(late.locator("main")).to_contain_text("revision 1")
    assert len(api.get(f"/api/items/{number}/revisions")) == 1


def test_archived_and_found_again(api: Api, visit: Visit) -> None:
    """Out of the list, found under "Archived", brought back; its place in BOMs stays."""
    parent, number = api.item(), api.item("ARCH-77", name="Old clamp")
    api.merge(parent, {number: 2})
    page = visit("editor", java_script_enabled=False)
    page.goto(f"/items/{number}/edit")
    expect(page.locator("section[aria-labelledby=archive]")).to_contain_text("used in 1 BOM")
    page.get_by_role("button", name=f"Archive {number}").click()
    expect(page.locator(".notice")).to_contain_text("in the archive")
    page.goto(f"/items/{parent}")
    expect(page.locator("tr", has_text=number)).to_contain_text("archived")
    page.goto("/items?q=ARCH-77")
    expect(page.locator("#found")).to_contain_text("0 items")
    page.get_by_label("Archived").check()
    page.get_by_role("button", name="Search").click()
    page.get_by_role("link", name=number, exact=True).click()
    page.get_by_role("button", name="Bring it back").click()
    expect(page.locator(".notice")).to_contain_text("is back")
    assert api.get(f"/api/items/{number}")["name"] == "Old clamp"


def test_what_a_program_wrote_can_be_edited(api: Api, visit: Visit) -> None:
    """Spaces at ends, line breaks, a text too long for a form: none of them is a change of anybody's."""
    odd = {"supplier": "ACME ", "material": "steel\nhardened", "own": " x\r\ny ", "log": "z" * 20_000}
    child = api.item(properties=odd)
    api.good("PUT", f"/api/items/{child}", {"description": "long ", "long_description": "a\r\nb\rc \n"})
    parent = api.item()
    api.merge(parent, {child: 1})
    api.good("PUT", bom(parent, child), {"notes": " n1\r\nn2\n", "unit": "m ", "find_number": " 1"})
    page = visit("editor")
    page.goto(f"/items/{child}/edit")
    page.get_by_label("Name", exact=True).fill("Another name")
    page.get_by_role("button", name="Save").click()
    expect(page.locator(".notice")).to_contain_text(f"{child} changed")
    item = api.get(f"/api/items/{child}")
    assert (item["name"], item["description"], item["properties"]) == ("Another name", "long ", odd)
    page.goto(f"/items/{child}/edit")
    page.get_by_label("Supplier", exact=True).fill("Bolts Inc.")
    page.get_by_label("Description", exact=True).fill("short")
    page.get_by_role("button", name="Save").click()
    expect(page.locator(".notice")).to_contain_text(f"{child} changed")
    item = api.get(f"/api/items/{child}")
    assert (item["description"], item["properties"]) == ("short", {**odd, "supplier": "Bolts Inc."})
    page.goto(f"/items/{parent}/bom?edit={child}")
    page.locator("#edit").get_by_label("Find number").fill("2")
    page.locator("#edit").get_by_role("button", name="Save", exact=True).click()
    expect(page.locator(".notice")).to_contain_text(f"{child} changed")
    line = api.lines(parent)[child]
    assert (line["notes"], line["unit"], line["find_number"]) == (" n1\r\nn2\n", "m", "2")


def test_an_upload_refused_because_of_a_colleague_is_sent_again(
    api: Api, visit: Visit, tmp_path: Path
) -> None:
    """The page says who was quicker; the comment stays, and the file goes on top once it is chosen again."""
    (number,) = api.items(1)
    page = visit("editor")
    page.goto(f"/items/{number}")
    body, headers = form_body({"file": ("theirs.FCStd", model_file(b"theirs")), "comment": "theirs"})
    assert api.call("POST", f"/api/items/{number}/file", body=body, headers=headers).status == 201
    mine = tmp_path / "mine.FCStd"
    mine.write_bytes(model_file(b"mine"))
    page.get_by_label("File: a new model or another file").set_input_files(mine)
    page.get_by_label("Comment").fill("wider")
    page.get_by_role("button", name="Upload").click()
    expect(page.get_by_role("alert")).to_contain_text("made revision 1 after you opened this page")
    page.get_by_label("Choose mine.FCStd again").set_input_files(mine)
    page.get_by_role("button", name="Send it now").click()
    expect(page.locator(".notice")).to_contain_text("mine.FCStd is revision 2")
    newest = api.get(f"/api/items/{number}/revisions")[0]
    assert (newest["comment"], newest["file_name"]) == ("wider", "mine.FCStd")
