# SPDX-License-Identifier: LGPL-2.1-or-later
"""Two browsers at one BOM, and a sync in between: nobody's work is lost or reverted without a choice."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import pytest
from playwright.sync_api import Locator, Page, expect
from server_testing import Api, bom

Visit = Callable[..., Page]


@dataclass(frozen=True)
class Case:
    """An assembly with two lines, 4 of ``one`` and 2 of ``other``."""

    parent: str
    one: str
    other: str

    @property
    def path(self) -> str:
        return f"/items/{self.parent}/bom"


@pytest.fixture
def case(api: Api) -> Case:
    """Synced once."""
    parent, one, other = api.items(3)
    api.merge(parent, {one: 4, other: 2})
    return Case(parent, one, other)


def edit(page: Page, case: Case, child: str) -> Locator:
    """The open form of a line."""
    page.goto(case.path)
    page.get_by_role("link", name=f"Edit {child}").click()
    page.wait_for_url("**edit=*")  # loaded: until then the first field may still take the focus
    return page.locator("#edit")


def save(form: Locator) -> None:
    """Send the form."""
    form.get_by_role("button", name="Save", exact=True).click()


def test_the_same_field_of_two_people_is_a_choice(case: Case, api: Api, visit: Visit) -> None:
    """Mine and theirs stand side by side, with who and why; nothing is written before the choice."""
    ann, bob = visit("editor"), visit("admin")
    mine, theirs = edit(ann, case, case.one), edit(bob, case, case.one)
    theirs.get_by_label("Quantity").fill("6")
    theirs.get_by_label("Reason for the change").fill("two spares")
    save(theirs)
    expect(bob.locator(".notice")).to_contain_text(f"{case.one} changed")
    mine.get_by_label("Quantity").fill("8")
    mine.get_by_label("Notes").fill("as ordered")
    save(mine)
    alert = ann.get_by_role("alert")
    expect(alert).to_contain_text("Nothing was saved yet")
    expect(alert).to_contain_text("quantity 4 → 6")
    expect(alert).to_contain_text("by admin")
    expect(alert).to_contain_text("two spares")
    assert api.quantities(case.parent)[case.one] == 6
    expect(mine.get_by_role("textbox", name="Quantity")).to_have_value("8")
    expect(mine.get_by_label("Notes")).to_have_value("as ordered")
    # Pressing Save again is no choice.
    save(mine)
    assert api.quantities(case.parent)[case.one] == 6
    mine.get_by_label("theirs: 6").check()
    save(mine)
    expect(ann.locator(".notice")).to_contain_text(f"{case.one} changed")
    line = api.lines(case.parent)[case.one]
    assert (line["quantity"], line["notes"]) == (6, "as ordered")
    # And the other way: mine.
    mine = edit(ann, case, case.one)
    api.good("PUT", bom(case.parent, case.one), {"quantity": 7})
    mine.get_by_label("Quantity").fill("8")
    save(mine)
    mine.get_by_label("yours: 8").check()
    save(mine)
    expect(ann.locator(".notice")).to_contain_text(f"{case.one} changed")
    assert api.quantities(case.parent)[case.one] == 8


def test_a_note_with_a_sync_in_between_is_only_a_note(case: Case, api: Api, visit: Visit) -> None:
    """The quantity that CAD has changed stays CAD's, and the page says that it changed."""
    page = visit("editor")
    form = edit(page, case, case.one)
    api.merge(case.parent, {case.one: 9, case.other: 2}, document={"file": "Top.FCStd"})
    form.get_by_label("Notes").fill("grease")
    save(form)
    expect(page.locator(".notice")).to_contain_text("quantity 4 → 9")
    expect(page.locator(".notice")).to_contain_text("from Top.FCStd")
    line = api.lines(case.parent)[case.one]
    assert (line["quantity"], line["source"], line["notes"]) == (9, "assembly", "grease")


def test_a_line_that_is_gone_keeps_what_was_typed(case: Case, api: Api, visit: Visit) -> None:
    """Who removed it stands there, and the text stands in the form for a new line."""
    page = visit("editor")
    form = edit(page, case, case.one)
    api.good("DELETE", bom(case.parent, case.one))
    form.get_by_label("Quantity").fill("11")
    form.get_by_label("Notes").fill("do not lose me")
    save(form)
    expect(page.get_by_role("alert")).to_contain_text("no longer in the BOM")
    expect(page.get_by_role("alert")).to_contain_text("removed, by admin")
    add = page.locator("section[aria-labelledby=add]")
    expect(add.get_by_label("Part number")).to_have_value(case.one)
    expect(add.get_by_label("Notes")).to_have_value("do not lose me")
    add.get_by_role("button", name="Add line").click()
    expect(page.locator(".notice")).to_contain_text(f"{case.one} added")
    assert api.lines(case.parent)[case.one]["notes"] == "do not lose me"
    form = edit(page, case, case.other)
    api.good("PUT", bom(case.parent, case.other), {"notes": "needed for the prototype"})
    form.get_by_role("button", name="Remove from BOM").click()
    expect(page.get_by_role("alert")).to_contain_text("Nothing was removed")
    expect(page.get_by_role("alert")).to_contain_text("needed for the prototype")
    assert case.other in api.lines(case.parent)
    page.get_by_role("button", name="Remove from BOM").click()
    expect(page.locator(".notice")).to_contain_text(f"{case.other} removed")


def test_a_part_that_is_there_opens_its_line(case: Case, api: Api, visit: Visit) -> None:
    """Added by a colleague meanwhile: the line is open with what was typed; the rest stays as it is."""
    page = visit("editor")
    page.goto(case.path)
    api.good("PUT", bom(case.parent, case.one), {"notes": "theirs"})
    page.get_by_label("Part number").fill(case.one)
    page.get_by_label("Quantity").fill("12")
    page.get_by_role("button", name="Add line").click()
    expect(page.get_by_role("alert")).to_contain_text("is in the BOM")
    form = page.locator("#edit")
    expect(form.get_by_label("Quantity")).to_have_value("12")
    expect(form.get_by_label("Notes")).to_have_value("theirs")
    save(form)
    expect(page.locator(".notice")).to_contain_text(f"{case.one} changed")
    line = api.lines(case.parent)[case.one]
    assert (line["quantity"], line["notes"]) == (12, "theirs")


def test_a_number_with_two_readings_is_asked_about(case: Case, api: Api, visit: Visit) -> None:
    """1,000: nothing is stored; both readings are a button, in the forms for a new and for an old line."""
    page = visit("editor")
    form = edit(page, case, case.one)
    form.get_by_label("Quantity").fill("1,000")
    form.get_by_label("Notes").fill("kept")
    form.get_by_label("Quantity").press("Enter")
    expect(page.get_by_role("alert")).to_contain_text("1000 or 1")
    assert api.quantities(case.parent)[case.one] == 4
    expect(form.get_by_label("Quantity")).to_have_value("1,000")
    page.get_by_role("button", name="Save with 1000", exact=True).click()
    expect(page.locator(".notice")).to_be_visible()
    line = api.lines(case.parent)[case.one]
    assert (line["quantity"], line["notes"]) == (1000, "kept")
    new = api.item()
    page.get_by_label("Part number").fill(new)
    page.get_by_label("Quantity").fill("2.500")
    page.get_by_role("button", name="Add line").click()
    page.get_by_role("button", name="Add with 2.5", exact=True).click()
    expect(page.locator(".notice")).to_contain_text(f"{new} added")
    assert api.quantities(case.parent)[new] == 2.5


def test_undo_belongs_to_what_was_just_done(case: Case, api: Api, visit: Visit) -> None:
    """No button beside "nothing was changed"; the one beside a change takes back that change only."""
    page = visit("editor")
    form = edit(page, case, case.one)
    form.get_by_label("Quantity").fill("5")
    save(form)
    expect(page.locator(".notice").get_by_role("button", name="Undo")).to_be_visible()
    save(edit(page, case, case.other))
    expect(page.locator(".notice")).to_contain_text("nothing was changed")
    expect(page.locator(".notice").get_by_role("button")).to_have_count(0)
    assert api.quantities(case.parent) == {case.one: 5, case.other: 2}
    form = edit(page, case, case.other)
    form.get_by_label("Quantity").fill("3")
    save(form)
    undo = page.locator(".notice").get_by_role("button", name="Undo")
    expect(undo).to_be_visible()
    api.good("PUT", bom(case.parent, case.one), {"notes": "another change, by somebody else"})
    undo.click()
    expect(page.locator(".notice")).to_contain_text("Undone")
    assert api.quantities(case.parent) == {case.one: 5, case.other: 2}
    assert api.lines(case.parent)[case.one]["notes"] == "another change, by somebody else"
    with page.expect_navigation():
        page.locator(".notice").get_by_role("button", name="Do it again").click()
    expect(page.locator(".notice")).to_contain_text("Undone")
    assert api.quantities(case.parent)[case.other] == 3


def test_decisions_are_about_lines_as_they_were_seen(api: Api, visit: Visit) -> None:
    """A line that somebody else changed is decided again; boxes and reason stay."""
    parent, used, *gone = api.items(5)
    api.merge(parent, {used: 4, **dict.fromkeys(gone, 1)})
    api.merge(parent, {used: 4})
    page = visit("editor")
    page.goto(f"/items/{parent}/bom")
    api.good("PUT", bom(parent, used), {"notes": "no matter"})
    page.get_by_role("button", name=f"Remove {gone[0]}").click()
    expect(page.locator(".notice")).to_contain_text(f"{gone[0]} removed")
    api.good("PUT", bom(parent, gone[1]), {"notes": "do not remove"})
    page.get_by_label("Choose all 2").check()
    page.get_by_label("Reason for keeping all chosen").fill("Spare parts")
    page.get_by_role("button", name="Remove chosen").click()
    alert = page.get_by_role("alert")
    expect(alert).to_contain_text("1 line was changed while you were deciding")
    expect(alert).to_contain_text("do not remove")
    assert set(gone[1:]) <= set(api.lines(parent))
    expect(page.get_by_label("Reason for keeping all chosen")).to_have_value("Spare parts")
    expect(page.get_by_label(f"Choose {gone[1]}")).not_to_be_checked()
    expect(page.get_by_label(f"Choose {gone[2]}")).to_be_checked()
    page.get_by_role("button", name="Keep chosen").click()
    expect(page.locator(".notice")).to_contain_text(f"{gone[2]} kept")
    assert api.lines(parent)[gone[2]]["reason"] == "Spare parts"


def test_a_conflict_is_decided_with_the_number_that_was_seen(case: Case, api: Api, visit: Visit) -> None:
    """CAD said 16 on the page and says 12 now: the button of 16 does nothing."""
    api.good("PUT", bom(case.parent, case.one), {"quantity": 6})
    api.merge(case.parent, {case.one: 16, case.other: 2})
    page = visit("editor")
    page.goto(case.path)
    api.merge(case.parent, {case.one: 12, case.other: 2})
    page.get_by_role("button", name=f"Take 16 from CAD for {case.one}").click()
    expect(page.get_by_role("alert")).to_contain_text("Nothing was done")
    assert api.quantities(case.parent)[case.one] == 6
    page.get_by_role("button", name=f"Take 12 from CAD for {case.one}").click()
    expect(page.locator(".notice")).to_be_visible()
    assert api.quantities(case.parent)[case.one] == 12


def test_the_last_lines_of_a_long_bom_can_be_edited(api: Api, visit: Visit) -> None:
    """Far down, from a filtered table and by address, with and without script; the page stays in place."""
    parent, *children = api.parts(f"LAST-{number:03}" for number in range(483))
    api.merge(parent, dict.fromkeys(children, 1))
    for script, last in zip((True, False), reversed(children), strict=False):
        page = visit("editor", java_script_enabled=script)
        page.goto(f"/items/{parent}/bom?show=cad")
        page.get_by_role("link", name=f"Edit {last}").click()
        form = page.locator("#edit")
        expect(form.get_by_label("Quantity")).to_be_in_viewport()
        form.get_by_label("Quantity").fill("2")
        save(form)
        expect(page.locator(".notice")).to_contain_text(f"{last} changed")
        assert "show=cad" in page.url
        line_id = api.lines(parent)[last]["id"]
        page.goto(f"/items/{parent}/bom?edit={line_id}")
        form.get_by_label("Quantity").fill("0")
        save(form)
        expect(page.get_by_role("alert")).to_contain_text("wanted a number above 0")
        expect(form.get_by_label("Quantity")).to_have_value("0")
        form.get_by_label("Quantity").fill("3")
        save(form)
        expect(page.locator(".notice")).to_contain_text(f"{last} changed")
        assert api.quantities(parent)[last] == 3
