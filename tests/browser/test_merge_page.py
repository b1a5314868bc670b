# SPDX-License-Identifier: LGPL-2.1-or-later
"""The page where a person decides: every button of it, from the keyboard, without script, and live."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import pytest
from playwright.sync_api import Page, Route, expect
from server_testing import Api, bom, wait_until
from settled import measured, wait_for_cursor

from silo_server.run import RunningServer

Visit = Callable[..., Page]


@dataclass(frozen=True)
class Case:
    """A BOM whose lines ``gone`` the assembly does not reference any more; ``used`` it does."""

    parent: str
    used: str
    gone: list[str]

    @property
    def path(self) -> str:
        return f"/items/{self.parent}/bom"


@pytest.fixture
def case(api: Api) -> Case:
    """Three unreferenced lines and one that is used."""
    parent, used, *gone = api.items(5)
    api.merge(parent, {used: 4, **dict.fromkeys(gone, 1)})
    api.merge(parent, {used: 4})
    return Case(parent, used, gone)


def line_of(page: Page, child: str) -> object:
    """The row of the BOM's own table."""
    return page.locator(
        "section[aria-labelledby=lines] tr", has=page.get_by_role("link", name=child, exact=True)
    )


def test_bulk_keep_and_undo(case: Case, api: Api, visit: Visit) -> None:
    """All lines are chosen at once, kept with one reason, and one click takes that back."""
    page = visit("editor")
    page.goto(case.path)
    before = api.lines(case.parent)
    page.get_by_role("button", name="Remove chosen").click()
    expect(page.locator(".notice")).to_contain_text("No line was chosen")
    assert api.lines(case.parent) == before
    page.get_by_label(f"Choose {case.gone[0]}").check()
    assert measured(page.get_by_label("Choose all 3"), "box => box.indeterminate")
    page.get_by_label("Choose all 3").check()
    expect(page.locator("#count")).to_have_text("3 of 3 chosen")
    page.get_by_label("Reason for keeping all chosen").fill("Spare parts")
    page.get_by_role("button", name="Keep chosen").click()
    expect(page.locator(".notice")).to_contain_text("3 lines kept as intentional")
    expect(page.locator(".banner.warn")).to_have_count(0)
    assert {line["reason"] for line in api.lines(case.parent).values()} == {None, "Spare parts"}
    page.locator(".notice").get_by_role("button", name="Undo").click()
    expect(page.locator(".banner.warn h2")).to_contain_text("3 items in the Silo BOM are not referenced")


def test_enter_in_a_reason_keeps_that_line(case: Case, api: Api, visit: Visit) -> None:
    """From the keyboard: Enter after a reason keeps this line, and no other, and removes nothing."""
    page = visit("editor")
    page.goto(case.path)
    page.get_by_label(f"Reason for keeping {case.gone[1]}").fill("Glue")
    page.keyboard.press("Enter")
    expect(page.locator(".notice")).to_contain_text(f"{case.gone[1]} kept as intentional")
    lines = api.lines(case.parent)
    assert lines[case.gone[1]]["source"] == "manual"
    assert set(lines) == {case.used, *case.gone}


def test_a_conflict_shows_both_and_either_is_one_click(api: Api, visit: Visit) -> None:
    """CAD says 4, Silo says 6: keep Silo's, and after CAD changed again take CAD's."""
    parent, child = api.items(2)
    api.merge(parent, {child: 3})
    api.good("PUT", bom(parent, child), {"quantity": 6})
    api.merge(parent, {child: 4})
    page = visit("editor")
    page.goto(f"/items/{parent}/bom")
    conflict = page.locator(".banner.conflict li")
    expect(conflict).to_contain_text("CAD says 4, Silo says 6")
    page.get_by_role("button", name=f"Keep 6 for {child}").click()
    expect(page.locator(".notice")).to_contain_text(f"{child} left as Silo says")
    expect(page.locator(".banner.conflict")).to_have_count(0)
    api.merge(parent, {child: 5})
    page.reload()
    expect(conflict).to_contain_text("CAD says 5, Silo says 6")
    page.get_by_role("button", name=f"Take 5 from CAD for {child}").click()
    expect(page.locator(".banner.calm")).to_be_visible()
    assert api.quantities(parent) == {child: 5}


def test_cad_counts_pieces_whatever_the_line_counts(api: Api, visit: Visit) -> None:
    """6 pieces in CAD beside 0.5 m in Silo: the page never says 6 m, nor makes it so."""
    parent, child = api.items(2)
    api.merge(parent, {child: 5})
    api.good("PUT", bom(parent, child), {"quantity": 0.5, "unit": "m"})
    api.merge(parent, {child: 6})
    page = visit("editor")
    page.goto(f"/items/{parent}/bom")
    expect(page.locator(".banner.conflict li")).to_contain_text("CAD says 6 pieces, Silo says 0.5 m")
    expect(page.locator(".remarks").first).to_contain_text("CAD says 6 pieces")
    page.get_by_role("button", name=f"Take 6 pieces from CAD for {child}").click()
    expect(page.locator(".banner.calm")).to_be_visible()
    assert (api.lines(parent)[child]["quantity"], api.lines(parent)[child]["unit"]) == (6, None)


def test_a_part_that_left_the_assembly_in_conflict(api: Api, visit: Visit) -> None:
    """A person's quantity on a part that CAD has no more: in words, with a button that removes it."""
    parent, child, other = api.items(3)
    api.merge(parent, {child: 3, other: 1})
    api.good("PUT", bom(parent, child), {"quantity": 6})
    api.merge(parent, {other: 1})
    page = visit("editor")
    page.goto(f"/items/{parent}/bom")
    expect(page.locator(".banner.conflict li")).to_contain_text("CAD no longer has it, Silo says 6")
    page.get_by_role("button", name=f"Remove it for {child}").click()
    expect(page.locator(".banner.calm")).to_be_visible()
    assert api.quantities(parent) == {other: 1}


def test_a_merge_arrives_live(case: Case, api: Api, visit: Visit) -> None:
    """The open page says that its own merge arrived, and shows it on a click; nothing moves before."""
    page = visit("viewer")
    page.goto(case.path)
    expect(page.locator(".news")).to_have_count(0)
    other, child = api.items(2)
    api.merge(other, {child: 1})
    api.merge(case.parent, {case.used: 9, case.gone[0]: 1})
    news = page.locator("#live")
    expect(news).to_contain_text("A new merge arrived")
    expect(news).to_contain_text("1 quantity changed")
    expect(news).not_to_contain_text("2 changes")
    expect(page.locator(".banner.warn h2")).to_contain_text("3 items")
    news.get_by_role("link", name="Show it").click()
    expect(page.locator(".banner.warn h2")).to_contain_text("2 items")
    expect(page.locator(".columns")).to_contain_text("quantity 4 → 9")
    expect(page.locator("#live")).to_be_empty()


def test_what_happens_before_the_stream_stands_is_not_missed(case: Case, api: Api, visit: Visit) -> None:
    """A merge between the page and its event stream is reported: the page says up to where it knows."""
    page = visit("viewer")
    held: list[Route] = []
    page.route("**/api/events*", lambda route: held.append(route))
    page.goto(case.path)
    wait_until(lambda: _pumped(page, bool(held)), "the request for events")
    api.merge(case.parent, {case.used: 7})
    held[0].continue_()
    expect(page.locator("#live")).to_contain_text("A new merge arrived")


def test_a_hidden_tab_gives_its_connection_back(
    case: Case, api: Api, visit: Visit, server: RunningServer
) -> None:
    """Hidden: no stream. Visible again: a new one, and what happened meanwhile is reported."""
    hub = server.app.state.server.hub
    wait_until(lambda: hub.listeners == 0, "the end of earlier streams")
    page = visit("viewer")
    page.goto(case.path)
    wait_until(lambda: _pumped(page, hub.listeners == 1), "the stream")
    _set_hidden(page, True)
    wait_until(lambda: _pumped(page, hub.listeners == 0), "the end of the stream")
    api.merge(case.parent, {case.used: 6})
    _set_hidden(page, False)
    expect(page.locator("#live")).to_contain_text("A new merge arrived")


def test_lines_are_added_changed_and_removed(api: Api, visit: Visit) -> None:
    """By hand: the number is completed while typing, a line is changed in its place, and taken out."""
    parent, child = api.items(2)
    page = visit("editor")
    page.goto(f"/items/{parent}/bom")
    number = page.get_by_label("Part number")
    number.press_sequentially(child[:-1])
    expect(page.locator(f'#known option[value="{child}"]')).to_have_count(1)
    number.fill(child)
    page.get_by_label("Quantity").fill("2,5")
    page.get_by_label("Unit").fill("m")
    page.get_by_role("button", name="Add line").click()
    expect(page.locator(".notice")).to_contain_text(f"{child} added")
    expect(line_of(page, child)).to_contain_text("2.5 m")
    page.get_by_role("link", name=f"Edit {child}").click()
    form = page.locator("#edit")
    wait_for_cursor(form.get_by_label("Quantity"))
    form.get_by_label("Quantity").fill("3")
    form.get_by_label("Reference designators").fill("R1, R2 R3")
    form.get_by_label("Notes").fill("cut to length")
    form.get_by_role("button", name="Save").click()
    expect(line_of(page, child)).to_contain_text("R1 R2 R3")
    assert api.lines(parent)[child]["reference_designators"] == ["R1", "R2", "R3"]
    page.get_by_role("link", name=f"Edit {child}").click()
    page.get_by_role("button", name="Remove from BOM").click()
    expect(page.locator(".notice")).to_contain_text(f"{child} removed")
    assert api.lines(parent) == {}


def test_everything_works_without_script(case: Case, api: Api, visit: Visit) -> None:
    """Keep, remove, bulk, undo, add and edit are plain forms."""
    page = visit("editor", java_script_enabled=False)
    page.goto(case.path)
    page.get_by_role("button", name=f"Keep as intentional {case.gone[0]}").click()
    page.get_by_role("button", name=f"Remove {case.gone[1]}").click()
    expect(page.locator(".banner.warn h2")).to_contain_text("1 item in the Silo BOM is not referenced")
    page.locator(".notice").get_by_role("button", name="Undo").click()
    expect(page.locator(".banner.warn h2")).to_contain_text("2 items")
    for child in case.gone[1:]:
        page.get_by_label(f"Choose {child}").check()
    page.get_by_role("button", name="Remove chosen").click()
    expect(page.locator(".banner.calm")).to_be_visible()
    assert set(api.lines(case.parent)) == {case.used, case.gone[0]}


def _pumped(page: Page, value: bool) -> bool:
    # Playwright's own events are only handled while one of its calls runs.
    measured(page, "1")
    return value


def _set_hidden(page: Page, hidden: bool) -> None:
    measured(
        page,
        """hidden => {
            Object.defineProperty(document, "hidden", { configurable: true, get: () => hidden });
            document.dispatchEvent(new Event("visibilitychange"));
        }""",
        hidden,
    )
