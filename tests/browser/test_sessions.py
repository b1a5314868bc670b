# SPDX-License-Identifier: LGPL-2.1-or-later
"""Sessions that end in the middle: what was typed is kept, and nothing is done twice."""

from __future__ import annotations

import re
import uuid
from collections.abc import Callable

import pytest
from playwright.sync_api import Dialog, Page, Route, expect
from server_testing import Api, bom, wait_until
from settled import measured

Visit = Callable[..., Page]
PASSWORD = "correct horse battery"


@pytest.fixture
def user(api: Api) -> str:
    """An editor with a password."""
    name = f"user-{uuid.uuid4().hex[:8]}"
    api.good("POST", "/api/users", {"username": name, "role": "editor", "password": PASSWORD})
    return name


def log_in(page: Page, user: str) -> None:
    """Fill in the login form that the page shows."""
    page.get_by_label("User name").fill(user)
    page.get_by_label("Password").fill(PASSWORD)
    page.get_by_role("button", name="Log in", exact=True).click()


def enter(visit: Visit, user: str, path: str, **options: bool) -> Page:
    """Somebody who is logged in, at this page."""
    page = visit(None, **options)
    page.goto(path)
    log_in(page, user)
    page.locator(".who").wait_for()
    return page


@pytest.mark.parametrize("script", [True, False])
def test_what_was_typed_survives_the_login(api: Api, visit: Visit, user: str, script: bool) -> None:
    """The session ends in an edit: after the login the text is there, is sent on a click, and only once."""
    parent, one, other = api.items(3)
    api.merge(parent, {one: 4, other: 1})
    page = enter(visit, user, f"/items/{parent}/bom?edit={one}", java_script_enabled=script)
    page.locator("#edit").get_by_label("Quantity").fill("8")
    page.locator("#edit").get_by_label("Notes").fill("two lines\nof text")
    page.context.clear_cookies()
    api.good("PUT", bom(parent, other), {"quantity": 3})
    page.get_by_role("button", name="Save", exact=True).click()
    expect(page.get_by_role("heading", level=1)).to_have_text("Log in")
    expect(page.locator("main")).to_contain_text("What you typed is kept")
    assert api.quantities(parent)[one] == 4
    page.get_by_label("User name").fill(user)
    page.get_by_label("Password").fill("wrong")
    page.get_by_role("button", name="Log in", exact=True).click()
    expect(page.get_by_role("alert")).to_contain_text("wrong")
    log_in(page, user)
    expect(page.get_by_role("heading", level=1)).to_contain_text("Not sent yet")
    expect(page.locator("main")).to_contain_text("two lines")
    assert api.quantities(parent)[one] == 4
    page.get_by_role("button", name="Send it now").click()
    expect(page.locator(".notice")).to_contain_text(f"{one} changed")
    line = api.lines(parent)[one]
    assert (line["quantity"], line["notes"]) == (8, "two lines\nof text")


def test_a_decision_survives_a_login_by_link(api: Api, visit: Visit) -> None:
    """Who has no password logs in by a link in another tab, and continues in the first."""
    parent, *gone = api.items(3)
    api.merge(parent, dict.fromkeys(gone, 1))
    api.merge(parent, {})
    page = visit("editor")
    page.goto(f"/items/{parent}/bom")
    page.get_by_label("Choose all 2").check()
    page.get_by_label("Reason for keeping all chosen").fill("Spare parts")
    page.context.clear_cookies()
    page.get_by_role("button", name="Keep chosen").click()
    expect(page.get_by_role("heading", level=1)).to_have_text("Log in")
    page.get_by_role("button", name="I have logged in").click()
    expect(page.get_by_role("alert")).to_contain_text("not logged in yet")
    tab = page.context.new_page()
    tab.goto(str(api.good("POST", "/api/users/editor/login-link")["path"]))
    tab.get_by_role("button", name="Log in").click()
    tab.locator(".who").wait_for()
    page.get_by_role("button", name="I have logged in").click()
    expect(page.locator("main")).to_contain_text("Spare parts")
    page.get_by_role("button", name="Send it now").click()
    expect(page.locator(".notice")).to_contain_text("2 lines kept as intentional")
    assert {line["reason"] for line in api.lines(parent).values()} == {"Spare parts"}


def test_a_login_in_another_tab_keeps_the_text_of_the_first(api: Api, visit: Visit, user: str) -> None:
    """The form's secret is that of the session before: nothing is done unasked, nothing is lost."""
    parent, child = api.items(2)
    page = enter(visit, user, f"/items/{parent}/bom")
    page.get_by_label("Part number").fill(child)
    page.get_by_label("Notes").fill("typed before")
    tab = page.context.new_page()
    tab.goto("/items")
    tab.get_by_role("button", name="Log out").click()
    log_in(tab, user)
    expect(tab.locator(".who")).to_contain_text(user)
    page.get_by_role("button", name="Add line").click()
    expect(page.get_by_role("heading", level=1)).to_contain_text("Not sent yet")
    assert api.lines(parent) == {}
    page.get_by_role("button", name="Send it now").click()
    expect(page.locator(".notice")).to_contain_text(f"{child} added")
    assert api.lines(parent)[child]["notes"] == "typed before"


def test_a_refusal_shows_what_was_typed(api: Api, visit: Visit, user: str) -> None:
    """An admin took the role away meanwhile: the text stands on the page that says so."""
    parent, child = api.items(2)
    page = enter(visit, user, f"/items/{parent}/bom")
    page.get_by_label("Part number").fill(child)
    page.get_by_label("Notes").fill("an hour of work")
    api.good("PUT", f"/api/users/{user}", {"role": "viewer"})
    page.get_by_role("button", name="Add line").click()
    expect(page.get_by_role("alert")).to_contain_text("this needs editor")
    expect(page.locator("main")).to_contain_text("an hour of work")
    api.good("PUT", f"/api/users/{user}", {"role": "editor"})
    page.get_by_role("button", name="Send it now").click()
    expect(page.locator(".notice")).to_contain_text(f"{child} added")


def test_a_password_is_never_kept(api: Api, visit: Visit, user: str) -> None:
    """It has to be typed again, on its own page."""
    page = enter(visit, user, "/account")
    page.get_by_label("Your password now").fill(PASSWORD)
    for label in ("New password", "Once more"):
        page.get_by_label(label).fill("another long password")
    page.context.clear_cookies()
    page.get_by_role("button", name="Set password").click()
    expect(page.get_by_role("heading", level=1)).to_have_text("Log in")
    assert "another long" not in page.content()
    log_in(page, user)
    expect(page.get_by_role("heading", level=1)).to_contain_text("My account")


def test_a_failed_form_and_an_ended_session_lead_back(api: Api, visit: Visit, user: str) -> None:
    """The address of a form that failed is no page of its own; it leads to the page that the form was on."""
    parent = api.item()
    page = enter(visit, user, f"/items/{parent}/bom")
    page.get_by_label("Part number").fill("NO-SUCH")
    page.get_by_role("button", name="Add line").click()
    expect(page.get_by_role("alert")).to_contain_text("does not exist")
    page.context.clear_cookies()
    page.goto(page.url)
    log_in(page, user)
    expect(page.get_by_role("heading", level=1)).to_contain_text("BOM of")


def test_loading_a_page_again_makes_nothing_twice(api: Api, visit: Visit, user: str) -> None:
    """A new token and a new login link are shown once; to load the page again makes no second."""
    page = enter(visit, user, "/account")
    page.get_by_label("Name of a new token").fill("laptop")
    page.get_by_role("button", name="Make token").click()
    secret = page.get_by_label("The token").input_value()
    assert api.as_(secret).get("/api/auth/me")["username"] == user
    page.reload()
    expect(page.get_by_label("The token")).to_have_count(0)
    expect(page.get_by_role("rowheader", name="laptop")).to_have_count(1)
    page.get_by_role("button", name="Revoke laptop").click()
    expect(page.locator(".notice")).to_contain_text("revoked")
    assert api.as_(secret).call("GET", "/api/auth/me").status == 401
    admin = visit("admin")
    admin.goto("/users")
    admin.get_by_role("button", name=f"Login link for {user}").click()
    link = admin.get_by_label("The login link").input_value()
    admin.reload()
    expect(admin.get_by_label("The login link")).to_have_count(0)
    other = visit(None)
    other.goto(link)
    other.get_by_role("button", name="Log in").click()
    expect(other.locator(".who")).to_contain_text(user)


def test_two_admins_at_one_user(api: Api, visit: Visit, user: str) -> None:
    """One changes the role while the other locks the user out: neither is reverted."""
    first, second, third = visit("admin"), visit("admin"), visit("admin")
    for page in (first, second, third):
        page.goto("/users")
    first.get_by_label(f"Role of {user}").select_option("viewer")
    first.get_by_role("button", name=f"Save {user}").click()
    expect(first.locator(".notice")).to_be_visible()
    second.get_by_label(f"Access of {user}").select_option("no")
    second.get_by_role("button", name=f"Save {user}").click()
    expect(second.locator(".notice")).to_be_visible()
    known = next(one for one in api.get("/api/users") if one["username"] == user)
    assert (known["role"], known["active"]) == ("viewer", False)
    third.get_by_label(f"Role of {user}").select_option("admin")
    third.get_by_role("button", name=f"Save {user}").click()
    expect(third.get_by_role("alert")).to_contain_text("Somebody else changed")
    known = next(one for one in api.get("/api/users") if one["username"] == user)
    assert known["role"] == "viewer"


def test_restoring_does_not_revert_what_came_meanwhile(api: Api, visit: Visit, user: str) -> None:
    """A colleague's edit after the page was loaded: the page says so, and the reason stays."""
    parent, child = api.items(2)
    api.merge(parent, {child: 1})
    api.good("PUT", bom(parent, child), {"quantity": 5})
    page = enter(visit, user, f"/items/{parent}/compare")
    api.good("PUT", bom(parent, child), {"notes": "a colleague's"})
    page.get_by_label("Reason").fill("too early")
    page.get_by_role("button", name="Make the BOM again as in the old state").click()
    expect(page.get_by_role("alert")).to_contain_text("Nothing was restored")
    assert api.lines(parent)[child]["notes"] == "a colleague's"
    expect(page.get_by_label("Reason")).to_have_value("too early")
    page.get_by_role("button", name="Make the BOM again as in the old state").click()
    expect(page.locator(".notice")).to_contain_text("Restored")
    assert api.quantities(parent) == {child: 1}
    page.locator(".notice").get_by_role("button", name="Undo").click()
    expect(page.locator(".notice")).to_contain_text("Undone")
    assert api.lines(parent)[child]["notes"] == "a colleague's"


def test_a_second_click_sends_nothing(visit: Visit, user: str) -> None:
    """While the answer to the first is on its way."""
    page = enter(visit, user, "/account")
    sent: list[Route] = []
    page.route("**/account/tokens", lambda route: sent.append(route))
    page.get_by_label("Name of a new token").fill("laptop")
    form = page.locator("form[action$=tokens]")
    again = "setTimeout(() => { form.requestSubmit(); console.log('twice'); })"
    with (
        page.expect_request("**/account/tokens"),
        page.expect_console_message(lambda message: message.text == "twice"),
    ):
        measured(form, f"form => {{ form.requestSubmit(); {again} }}")
    wait_until(lambda: bool(sent or page.wait_for_timeout(10)), "the request")
    sent[0].continue_()
    expect(page.get_by_label("The token")).to_be_visible()
    assert len(sent) == 1
    expect(page.get_by_role("rowheader", name="laptop")).to_have_count(1)


def test_no_form_is_shown_before_it_is_guarded(api: Api, visit: Visit, user: str) -> None:
    """Somebody may be quicker than a script that comes later."""
    (number,) = api.items(1)
    page = enter(visit, user, "/items")
    page.add_init_script(
        "const add = addEventListener; window.addEventListener = (type, ...rest) => {"
        " if (type === 'beforeunload') window.formsBefore = document.forms.length; add(type, ...rest); }"
    )
    page.goto(f"/items/{number}/bom")
    expect(page.get_by_role("button", name="Add line")).to_be_visible()
    assert measured(page, "() => window.formsBefore") == 0


def test_what_is_typed_in_another_form_is_not_left_without_a_question(
    api: Api, visit: Visit, user: str
) -> None:
    """A form of the page is sent, or a link followed, while another one holds something unsaved."""
    parent, child, gone = api.items(3)
    api.merge(parent, {child: 1, gone: 1})
    api.merge(parent, {child: 1})
    page = enter(visit, user, f"/items/{parent}/bom?edit={child}")
    asked: list[str] = []
    stay = True

    def answer(dialog: Dialog) -> None:
        asked.append(dialog.type)
        if stay:
            dialog.dismiss()
        else:
            dialog.accept()

    page.on("dialog", answer)
    notes = page.locator("#edit").get_by_label("Notes")
    notes.fill("an hour of work")
    page.get_by_role("button", name=f"Keep as intentional {gone}").click()
    expect(notes).to_have_value("an hour of work")
    page.get_by_role("link", name="History").click()
    expect(notes).to_have_value("an hour of work")
    assert asked == ["beforeunload"] * 2
    assert api.lines(parent)[gone]["unreferenced_since"]
    # Its own form is sent without a question, after "Stay" too; refused, it is still unsaved.
    page.locator("#edit").get_by_label("Quantity").fill("many")
    page.locator("#edit").get_by_role("button", name="Save", exact=True).click()
    expect(page.get_by_role("alert")).to_contain_text("wanted a number")
    assert len(asked) == 2
    page.get_by_role("button", name=f"Keep as intentional {gone}").click()
    expect(notes).to_have_value("an hour of work")
    assert len(asked) == 3
    page.locator("#edit").get_by_role("link", name="Cancel").click()
    expect(page.locator("#edit")).to_have_count(0)
    assert len(asked) == 3
    # A choice in a list, a box; and whoever wants to leave may.
    page.goto("/account")
    page.get_by_label("Ends").select_option("365")
    stay = False
    page.get_by_role("link", name="Items", exact=True).click()
    expect(page).to_have_url(re.compile("/items$"))
    assert len(asked) == 4


def test_a_user_that_is_refused_stays_typed(visit: Visit) -> None:
    """All but the password, which goes nowhere but where it was typed for."""
    page = visit("admin")
    page.goto("/users")
    page.get_by_label("User name").fill("not a name")
    page.get_by_label("Full name").fill("Nora")
    new = page.locator("form[action$='/users']")
    new.get_by_label("Role").select_option("editor")
    page.get_by_role("button", name="Make user").click()
    expect(page.get_by_role("alert")).to_contain_text("1 to 64 letters")
    expect(page.get_by_label("User name")).to_have_value("not a name")
    expect(page.get_by_label("Full name")).to_have_value("Nora")
    expect(new.get_by_label("Role")).to_have_value("editor")
