# SPDX-License-Identifier: LGPL-2.1-or-later
"""Long names, and names that turn the direction of text: no page breaks sideways, and no sentence turns."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect
from server_testing import Api, bom, form_body
from settled import measured

Visit = Callable[..., Page]

# U+2069 ends the isolate of a <bdi>; what stands after it turns the page's own words.
TURNED = "\u2069\u2069\u202eMARK\u2067"
LONG = "L" + "w" * 199
PAGES = (
    "/items",
    "/items/{top}",
    "/items/{top}?view=flat",
    "/items/{part}",
    "/items/{top}/bom",
    "/items/{top}/bom?edit={part}",
    "/items/{top}/history",
    "/items/{top}/compare?old=0&all=1",
    "/items/{top}/import",
    "/activity",
    "/account",
    "/users",
    "/audit",
)
# Text of people outside of a <bdi>, or with a character that turns what follows it.
LOOSE = """() => {
    const found = [];
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    for (let node = walker.nextNode(); node; node = walker.nextNode()) {
        const text = node.data, parent = node.parentElement;
        if (parent.closest("option, datalist, textarea, script")) continue;
        const opened = (text.match(/[\\u2066-\\u2068]/g) || []).length;
        const closed = (text.match(/\\u2069/g) || []).length;
        if (/[\\u202a-\\u202e]/.test(text) || opened !== closed) found.push("turns: " + parent.outerHTML);
        const before = text.split("MARK")[0];
        const isolated = parent.closest("bdi") || /[\u2066-\u2068][^\u2069]*$/.test(before);
        if (text.includes("MARK") && !isolated) found.push("loose: " + parent.outerHTML);
    }
    return found.map(text => text.slice(0, 200));
}"""
WIDER = "document.documentElement.scrollWidth - document.documentElement.clientWidth"


@pytest.fixture(scope="module")
def names() -> dict[str, str]:
    """What the items are called, once for all tests of this file."""
    return {}


def fill(api: Api, names: dict[str, str]) -> None:
    """A BOM with everything on it; every text that people type is long or turned."""
    if names:
        return
    top = api.item("TOP-" + "W" * 60, name=LONG, description=TURNED + "x")
    part, gone, disputed = (api.item(name=name) for name in (TURNED, LONG, TURNED))
    document = {"file": f"{TURNED}.FCStd"}
    left_out = [{"reason": "missing", "name": LONG, "file": f"{TURNED}/{LONG}", "object": "B", "quantity": 2}]
    api.merge(top, {part: 1, gone: 2, disputed: 3}, document=document)
    api.good("PUT", bom(top, disputed), {"quantity": 6, "unit": TURNED, "notes": LONG})
    api.good("PUT", bom(top, part), {"notes": TURNED, "find_number": TURNED, "reference_designators": [LONG]})
    api.merge(top, {part: 2, disputed: 4}, document=document, left_out=left_out)
    api.good("PUT", f"/api/items/{part}", {"properties": {LONG: TURNED, TURNED: LONG}, "comment": LONG})
    body, headers = form_body({"file": (f"{LONG}.txt", b"x"), "comment": TURNED})
    assert api.call("POST", f"/api/items/{part}/file", body=body, headers=headers).status == 201
    api.good("POST", "/api/auth/tokens", {"name": TURNED})
    api.good("POST", "/api/auth/tokens", {"name": LONG})
    api.good("POST", "/api/users", {"username": "u" * 64, "display_name": LONG})
    api.good("POST", "/api/users", {"username": "turned", "display_name": TURNED})
    names |= {"top": top, "part": part}


@pytest.mark.parametrize("width", [320, 390, 1440])
def test_no_name_breaks_a_page_or_turns_its_words(
    api: Api, visit: Visit, names: dict[str, str], width: int
) -> None:
    """A name of 200 characters and one that closes its isolate, on every page."""
    fill(api, names)
    page = visit("admin", viewport={"width": width, "height": 844})
    findings: list[str] = []
    for path in PAGES:
        page.goto(path.format(**names))
        if (wider := measured(page, WIDER)) > 0:
            findings.append(f"{path}: {wider} px too wide")
        findings += [f"{path}: {found}" for found in measured(page, LOOSE)]
    assert not findings, "\n".join(findings)


def test_a_notice_and_a_problem_do_not_turn(api: Api, visit: Visit, names: dict[str, str]) -> None:
    """Also what an action answers: a file's name in a notice, a part number in a problem."""
    fill(api, names)
    page = visit("editor", viewport={"width": 320, "height": 844})
    page.goto(f"/items/{names['top']}/bom")
    page.get_by_label("Part number").fill("\u202eMARK" + "W" * 50)
    page.get_by_role("button", name="Add line").click()
    expect(page.get_by_role("alert")).to_contain_text("does not exist")
    assert measured(page, LOOSE) == []
    assert measured(page, WIDER) <= 0
    page.goto(f"/items/{names['top']}/import")
    text = f"Part number,Quantity\n{names['part']},9\nMARK\u202e,1\n".encode()
    file = {"name": f"{TURNED}{LONG}.csv", "mimeType": "text/csv", "buffer": text}
    page.get_by_label("CSV file or workbook").set_input_files([file])  # type: ignore[list-item]
    page.get_by_role("button", name="Check the file").click()
    page.locator("#checked").wait_for()
    assert measured(page, LOOSE) == []
    assert measured(page, WIDER) <= 0
