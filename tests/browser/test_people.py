# SPDX-License-Identifier: LGPL-2.1-or-later
"""The pages about people in a browser: account, users, audit, mode, login and log-out, the keyboard."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import Locator, Page, expect
from server_testing import Api
from settled import measured, wait_for_cursor

Visit = Callable[..., Page]


def row(page: Page, name: str) -> Locator:
    """The table row that begins with this name."""
    return page.locator("tr", has=page.get_by_role("rowheader", name=name, exact=True))


@pytest.fixture
def machine(api: Api) -> dict[str, str]:
    """A machine with a plate."""
    numbers = dict(zip(("machine", "plate"), api.items(2), strict=True))
    api.merge(numbers["machine"], {numbers["plate"]: 1})
    return numbers


# --- account, users, audit ----------------------------------------------------------------------------------


def test_users_roles_and_login_links(api: Api, visit: Visit) -> None:
    """A new user comes in by a link, becomes an editor, sets a password, and is locked out."""
    page = visit("admin")
    page.goto("/users")
    page.get_by_label("User name").fill("newcomer")
    page.get_by_label("Full name").fill("New <b>Comer</b>")
    page.get_by_role("button", name="Make user").click()
    expect(row(page, "newcomer")).to_contain_text("New <b>Comer</b>")
    page.get_by_role("button", name="Login link for newcomer").click()
    link = page.get_by_label("The login link").input_value()
    other = visit(None)
    other.goto(link)
    # Only the button uses the link up: a mail program that looks at it does not.
    other.get_by_role("button", name="Log in").click()
    expect(other.locator(".who")).to_contain_text("viewer")
    page.get_by_label("Role of newcomer").select_option("editor")
    page.get_by_role("button", name="Save newcomer").click()
    expect(page.locator(".notice")).to_contain_text("newcomer is changed")
    other.goto("/account")
    expect(other.locator(".who")).to_contain_text("editor")
    other.get_by_label("New password").fill("correct horse battery")
    other.get_by_label("Once more").fill("correct horse battery")
    other.get_by_role("button", name="Set password").click()
    other.get_by_label("User name").fill("newcomer")
    other.get_by_label("Password").fill("correct horse battery")
    other.get_by_role("button", name="Log in").click()
    expect(other.locator(".who")).to_contain_text("New <b>Comer</b>")
    page.get_by_label("Access of newcomer").select_option("no")
    with page.expect_navigation():  # the notice of the change before says the same
        page.get_by_role("button", name="Save newcomer").click()
    expect(page.locator(".notice")).to_contain_text("newcomer is changed")
    other.goto("/items")
    expect(other.get_by_role("heading", level=1)).to_have_text("Log in")
    page.get_by_role("link", name="Audit").click()
    expect(page.locator("tbody")).to_contain_text("user.created")
    expect(page.locator("tbody")).to_contain_text("login.link")


def test_read_only_and_back(machine: dict[str, str], visit: Visit) -> None:
    """An open page hears of it, and a form that is sent anyway is answered in plain words."""
    admin, editor = visit("admin"), visit("editor")
    editor.goto(f"/items/{machine['machine']}/bom?edit={machine['plate']}")
    admin.goto("/users")
    admin.get_by_role("button", name="Stop taking changes").click()
    try:
        expect(admin.locator("#mode + form")).to_contain_text("takes no changes at the moment")
        expect(editor.locator("#live")).to_contain_text("takes no changes now")
        editor.get_by_role("button", name="Remove from BOM").click()
        expect(editor.get_by_role("alert")).to_contain_text("read-only at the moment")
    finally:
        admin.get_by_role("button", name="Take changes again").click()
    expect(admin.locator(".notice")).to_contain_text("takes changes")


def test_while_it_is_read_only_what_changes_is_switched_off(
    machine: dict[str, str], api: Api, visit: Visit
) -> None:
    """A banner with the reason; the account is not switched off."""
    editor = visit("editor")
    base = f"/items/{machine['machine']}"
    api.merge(machine["machine"], {})
    api.good("PUT", "/api/admin/mode", {"mode": "read-only"})
    try:
        editor.goto(f"{base}/bom")
        expect(editor.locator("#closed")).to_contain_text("Read-only at the moment")
        for name in ("Keep as intentional", "Remove", "Add line"):
            button = editor.get_by_role("button", name=name).first
            expect(button).to_be_disabled()
            group = button.locator("xpath=ancestor::fieldset")
            expect(group).to_have_accessible_description(re.compile("takes no changes"))
        edit = editor.get_by_role("link", name="Edit")
        expect(edit).to_have_attribute("aria-disabled", "true")
        assert edit.get_attribute("href") is None
        editor.goto("/account")
        expect(editor.get_by_role("button", name="Make token")).to_be_enabled()
    finally:
        api.good("PUT", "/api/admin/mode", {"mode": "normal"})
    editor.goto(f"{base}/bom")
    expect(editor.locator("#closed")).to_have_count(0)
    expect(editor.get_by_role("button", name="Keep as intentional")).to_be_enabled()


def test_the_keyboard_is_enough(visit: Visit) -> None:
    """The first Tab offers to skip to the content, and every stop on the way shows where one is."""
    page = visit("viewer")
    page.goto("/items")
    page.keyboard.press("Tab")
    skip = page.get_by_role("link", name="Skip to content")
    wait_for_cursor(skip)
    expect(skip).to_be_in_viewport()
    page.keyboard.press("Enter")
    page.keyboard.press("Tab")
    wait_for_cursor(page.get_by_role("link", name="Categories"))
    page.keyboard.press("Tab")
    wait_for_cursor(page.get_by_label("Search"))
    assert measured(page.get_by_label("Search"), "e => getComputedStyle(e).outlineStyle") == "solid"
