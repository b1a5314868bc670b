# SPDX-License-Identifier: LGPL-2.1-or-later
"""History, audit, activity and conflicts: who did what, to which part, when and why; and back again."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import Page, expect
from server_testing import Api, bom

Visit = Callable[..., Page]


def test_a_conflict_names_both_sides_and_agrees_with_its_line(api: Api, visit: Visit) -> None:
    """CAD said 3, then 16: banner and line say 16, who said it, who set 12, when and why."""
    parent, child = api.items(2)
    api.merge(parent, {child: 3}, document={"file": "Old.FCStd"})
    page = visit("editor")
    page.goto(f"/items/{parent}/bom?edit={child}")
    page.locator("#edit").get_by_label("Quantity").fill("12")
    page.locator("#edit").get_by_label("Reason for the change").fill("one row less")
    page.get_by_role("button", name="Save", exact=True).click()
    line = page.locator("section[aria-labelledby=lines] tbody tr")
    expect(line).to_contain_text("CAD said 3 before")
    api.merge(parent, {child: 16}, document={"file": "Top.FCStd"})
    page.goto(f"/items/{parent}/bom")
    conflict = page.locator(".banner.conflict li")
    expect(conflict).to_contain_text("CAD says 16, Silo says 12")
    expect(conflict).to_contain_text("CAD: sync by admin")
    expect(conflict).to_contain_text("from Top.FCStd")
    expect(conflict).to_contain_text("Silo: by editor")
    expect(conflict).to_contain_text("one row less")
    since = conflict.locator("time").get_attribute("datetime")
    expect(line).to_contain_text("CAD says 16")
    expect(line).not_to_contain_text("CAD said")
    # The same question again is as old as it is.
    api.merge(parent, {child: 16}, document={"file": "Top.FCStd"})
    page.reload()
    assert conflict.locator("time").get_attribute("datetime") == since
    api.merge(parent, {child: 12})
    page.reload()
    expect(line).to_contain_text("CAD says the same")


def test_the_history_names_parts_and_values_and_pages_both_ways(api: Api, visit: Visit) -> None:
    """Beyond the newest ten: part, old and new value on the list itself; older, and newer again."""
    parent, child = api.items(2)
    api.merge(parent, {child: 1})
    for n in range(2, 62):
        api.good("PUT", bom(parent, child), {"quantity": n})
    page = visit("viewer")
    page.goto(f"/items/{parent}/history")
    rows = page.locator("tbody tr")
    expect(rows).to_have_count(50)
    expect(rows.nth(49)).to_contain_text(child)
    expect(rows.nth(49)).to_contain_text("quantity 11 → 12")
    page.get_by_role("link", name="Older").click()
    expect(rows).to_have_count(11)
    expect(rows.nth(10)).to_contain_text("added, quantity 1")
    page.get_by_role("link", name="Newer").click()
    expect(rows).to_have_count(50)
    expect(rows.first).to_contain_text("quantity 60 → 61")
    expect(page.get_by_role("link", name="Newer")).to_have_count(0)


def test_the_audit_list_says_from_what_to_what(api: Api, visit: Visit) -> None:
    """A role that changed: which, from what, to what; and the list pages both ways."""
    api.good("POST", "/api/users", {"username": "audited", "role": "viewer"})
    api.good("PUT", "/api/users/audited", {"role": "editor", "display_name": "Ann Other"})
    page = visit("admin")
    page.goto("/audit")
    changed = page.locator("tbody tr", has_text="user.changed").filter(has_text="audited").first
    expect(changed).to_contain_text("role viewer → editor")
    expect(changed).to_contain_text("display name audited → Ann Other")
    for n in range(101):
        api.good("PUT", "/api/users/audited", {"display_name": f"Name {n}"})
    page.goto("/audit")
    page.get_by_role("link", name="Older").click()
    expect(page.locator("tbody")).to_contain_text("role viewer → editor")
    page.get_by_role("link", name="Newer").click()
    expect(page.locator("tbody tr").first).to_contain_text("Name 99 → Name 100")


def test_activity_has_names_users_and_filters(api: Api, visit: Visit) -> None:
    """Each entry names the item and who it was; kind, user and item filter, also what arrives live."""
    visit("editor")  # makes the user
    parent, child = api.item(name="Gearbox"), api.item(name="Bolt M8")
    editor = api.as_(api.good("POST", "/api/auth/tokens", {"name": "x"})["token"])
    api.merge(parent, {child: 4})
    page = visit("viewer")
    page.goto("/activity")
    first = page.locator("#entries > li").first
    expect(first).to_contain_text("Gearbox")
    expect(first).to_contain_text("admin")
    page.get_by_label("What").select_option("BOM edits")
    page.get_by_label("Part number").fill(parent)
    page.get_by_role("button", name="Show", exact=True).click()
    expect(page.locator("#empty")).to_contain_text("Nothing like this")
    expect(page.locator("#state")).to_contain_text("Live")
    editor.good("PUT", bom(parent, child), {"quantity": 5})
    editor.good("PUT", f"/api/items/{child}", {"name": "Bolt M8x20"})
    expect(page.locator("#entries > li")).to_have_count(1)
    expect(first).to_contain_text("quantity 4 → 5")
    page.goto(f"/activity?item={child}")
    expect(page.locator("#entries > li")).to_have_count(2)
    expect(first).to_contain_text("Bolt M8x20")
    page.goto("/activity?user=nobody")
    expect(page.locator("#empty")).to_be_visible()
    for _ in range(101):
        api.item()
    page.goto("/activity?kind=items&user=admin")
    expect(page.locator("#entries > li")).to_have_count(100)
    page.get_by_role("link", name="Older").click()
    expect(page.locator("#entries")).to_contain_text("Gearbox")
    expect(page.locator("#state")).to_contain_text("An earlier part")
    page.get_by_role("link", name="Newer").click()
    expect(page.locator("#entries > li")).to_have_count(100)
