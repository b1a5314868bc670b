# SPDX-License-Identifier: LGPL-2.1-or-later
"""An incomplete BOM never looks complete, and an assembly that was never synced never like a part."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import Page, expect
from server_testing import Api, bom, merge_body

Visit = Callable[..., Page]

LEFT_OUT = [
    {"reason": "missing", "name": "Cover", "file": "parts/Cover.FCStd", "object": "Body", "quantity": 2},
    {"reason": "unregistered", "name": "Pin <b>", "file": "Pin.FCStd", "object": "Pin", "quantity": 3},
]


def test_every_page_says_that_a_bom_is_incomplete(api: Api, visit: Visit) -> None:
    """Item page, tree and flat list of what is above, decision page; until a sync brings all of it."""
    top, part = api.items(2)
    sub, never = (api.item(item_type="assembly") for _ in range(2))
    body = merge_body({part: 1})
    api.good("POST", bom(sub, "merge"), {**body, "left_out": LEFT_OUT})
    api.merge(top, {sub: 1, never: 1})
    page = visit("viewer")
    for path in (f"/items/{sub}", f"/items/{sub}/bom"):
        page.goto(path)
        banner = page.locator("section[aria-labelledby=incomplete]")
        expect(banner.get_by_role("heading")).to_contain_text("Incomplete: 1 missing, 1 unregistered")
        expect(banner).to_contain_text("2 × Cover (parts/Cover.FCStd)")
        expect(banner).to_contain_text("3 × Pin <b> (Pin.FCStd): no part number yet")
        expect(page.locator(".banner.calm")).to_have_count(0)
    page.goto(f"/items/{top}")
    tree = page.locator(".tree")
    expect(tree.locator("tr", has_text=sub)).to_contain_text("incomplete: 1 missing, 1 unregistered")
    expect(tree.locator("tr", has_text=never)).to_contain_text("never synced")
    expect(tree.locator("tr", has_text=part)).not_to_contain_text("never synced")
    page.goto(f"/items/{top}?view=flat")
    expect(page.locator("tr", has_text=never)).to_contain_text("never synced")
    page.goto(f"/items/{never}")
    expect(page.locator("section[aria-labelledby=bom]")).to_contain_text("never synced")
    page.goto(f"/items/{part}")
    expect(page.locator("section[aria-labelledby=bom]")).to_contain_text("this item has no children")
    api.good("POST", bom(sub, "merge"), {**body, "left_out": []})
    page.goto(f"/items/{sub}/bom")
    expect(page.locator("section[aria-labelledby=incomplete]")).to_have_count(0)
    expect(page.locator(".banner.calm")).to_contain_text("Nothing to decide")
