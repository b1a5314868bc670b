# SPDX-License-Identifier: LGPL-2.1-or-later
"""An accessibility pass (axe-core) over every page, light and dark, wide and on a phone.

axe-core comes from npm into a cache folder when the tests first run; without npm, or without a way to its
registry, these tests are skipped, loudly.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import pytest
from model_scenes import machine
from playwright.sync_api import Page
from public_projects import ASSEMBLIES
from server_testing import Api, bom
from settled import come_late, measured

Visit = Callable[..., Page]

REAL = ASSEMBLIES / "lmn3"
AXE = "axe-core@4.10.3"
RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]
# Dark differs from light in colours alone.
RUN = """tags => axe.run(document, {
    runOnly: matchMedia("(prefers-color-scheme: dark)").matches
        ? { type: "rule", values: ["color-contrast", "link-in-text-block"] }
        : tags,
})"""
OVERFLOW = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
# A control whose own words break within, or that is taller than its lines of text.
TALL = """() => {
    const found = [];
    for (const control of document.querySelectorAll("button, .button, td a, th a, nav a, summary, label")) {
        if (control.closest("thead")?.getBoundingClientRect().width <= 1) continue; // only for a reader
        const walker = document.createTreeWalker(control, NodeFilter.SHOW_TEXT);
        const lines = new Set();
        for (let node = walker.nextNode(); node; node = walker.nextNode()) {
            if (node.parentElement.closest(".hidden, [hidden], option, textarea, datalist")) continue;
            for (const word of node.data.matchAll(/[^\\s-]+/g)) {
                const range = document.createRange();
                range.setStart(node, word.index);
                range.setEnd(node, word.index + word[0].length);
                const tops = new Set([...range.getClientRects()].map(one => Math.round(one.top)));
                tops.forEach(top => lines.add(top));
                const ours = !node.parentElement.closest("bdi");
                if (ours && tops.size > 1) found.push("breaks: " + word[0] + " in " + control.outerHTML);
            }
        }
        if (!lines.size || !control.matches("button, .button")) continue;
        const style = getComputedStyle(control);
        const sides = ["paddingTop", "paddingBottom", "borderTopWidth", "borderBottomWidth"];
        const around = sides.reduce((sum, side) => sum + parseFloat(style[side]), 0);
        // The least height of a finger's target is meant, up to 44 px.
        const least = Math.min(parseFloat(style.minHeight) || 0, 44);
        const needed = Math.max(around + lines.size * parseFloat(style.lineHeight), least);
        if (control.getBoundingClientRect().height > needed + 2) found.push("tall: " + control.textContent);
        const short = control.textContent.length <= 30;
        if (innerWidth > 1400 && short && lines.size > 1) found.push("two lines: " + control.textContent);
    }
    return found.map(text => text.slice(0, 200));
}"""
# Words of our controls that were left in English; the foot offers the language by its own name.
ENGLISH = """() => [...document.querySelectorAll("button:not([lang]), .button, summary, th a, nav a")]
    .map(one => one.textContent)
    .filter(words => /\\b(the|of|and|by|with|save|remove|show|keep|edit|add|find)\\b/i.test(words))"""
HEADER = "getComputedStyle(document.querySelector('.top')).display"
# Wide; a phone; a small one, or a zoomed page. Both phones have the same style sheet: one of them is for axe.
WIDTHS, FOR_AXE = (1440, 390, 320), (1440, 320)
SCHEMES: tuple[Literal["dark", "light"], ...] = ("dark", "light")
PAGES = (
    "/login",
    "/items",
    "/items?q=nothing-like-this",
    "/items?sort=-name&archived=1",
    "/items/{parent}/print",
    "/items/{parent}/print?view=flat&pieces=4",
    "/waiting",
    "/waiting?q=nothing-like-this",
    "/items/new",
    "/items/{child}/edit",
    "/items/{parent}",
    "/items/{parent}?depth=1&sort=-mass&pieces=3",
    "/items/{parent}?q=nothing-like-this",
    "/items/{parent}?view=flat",
    "/items/{parent}?beside={child}",
    "/items/{parent}/changes?since=2020-01-01",
    "/items/{parent}/releases",
    "/items/{parent}/releases/A",
    "/mine",
    "/items/{child}",
    "/items/{parent}/bom",
    "/items/{parent}/bom?edit={child}",
    "/items/{child}/bom",
    "/items/{parent}/history",
    "/items/{parent}/compare?old=0&all=1",
    "/items/{parent}/import",
    "/items/{parent}/order?pieces=3",
    "/items/{child}/suppliers",
    "/suppliers",
    "/activity",
    "/account",
    "/users",
    "/audit",
    "/nowhere",
)


@pytest.fixture(scope="session")
def axe(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The source of axe-core."""
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "silo-mod-tests"
    script = cache / AXE / "node_modules" / "axe-core" / "axe.min.js"
    if not script.is_file():
        npm = shutil.which("npm")
        if npm is None:
            pytest.skip("npm is not on this machine, so axe-core cannot be had; accessibility is NOT tested")
        folder = tmp_path_factory.mktemp("axe")
        options = ["--no-audit", "--no-fund", "--ignore-scripts", "--prefix", str(folder)]
        command = [npm, "install", *options, AXE]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=180)
        except subprocess.TimeoutExpired:
            pytest.skip("npm did not answer within 180 s; accessibility is NOT tested")
        if done.returncode != 0:
            pytest.skip(f"npm cannot install {AXE}; accessibility is NOT tested: {done.stderr[-300:]}")
        # Another process may do the same at this moment, or read it: it is there whole or not at all.
        whole = folder / "node_modules" / "axe-core" / "axe.min.js"
        script.parent.mkdir(parents=True, exist_ok=True)
        part = script.with_suffix(f".{os.getpid()}")
        shutil.copy(whole, part)
        part.replace(script)
    return script.read_text("utf-8")


@pytest.fixture
def numbers(api: Api) -> dict[str, str]:
    """A BOM with everything: used, unreferenced, manual, in conflict, several levels."""
    parent, child, module, gone, also_gone, disputed = api.items(6)
    api.good("PUT", f"/api/items/{child}", {"properties": {"mass_kg": 0.5}, "comment": "weighed"})
    price = {"quantity": "1", "price": "0.5"}
    sold = {"supplier": "Misumi", "number": "A-1", "pack_size": "10", "prices": [price]}
    api.good("PUT", f"/api/items/{child}/suppliers", {"supplier_parts": [sold]})
    api.merge(module, {child: 2})
    whole = {child: 4, module: 1, gone: 1, also_gone: 2, disputed: 3}
    api.merge(parent, whole)
    api.good("PUT", bom(parent, disputed), {"quantity": 6, "notes": "one spare"})
    api.merge(parent, {child: 5, module: 1, disputed: 4})
    api.good("POST", f"/api/items/{parent}/releases", {"label": "A"})
    return {"parent": parent, "child": child}


def test_no_page_has_a_finding(axe: str, numbers: dict[str, str], visit: Visit) -> None:
    """Not a single violation of WCAG 2.2 AA or of axe's best practices, whatever its weight."""
    page = visit("admin")
    stranger = visit(None)
    findings: list[str] = []
    for path in PAGES:
        shown = stranger if path == "/login" else page
        shown.goto(path.format(**numbers))
        findings += in_each_width(shown, axe, path)
    assert findings == []


@pytest.mark.parametrize("locale", ["en-US", "de-DE"])
def test_no_control_is_taller_than_its_text(api: Api, visit: Visit, locale: str) -> None:
    """With the names of a real project: no word of ours breaks, no button is taller than its words."""
    if not REAL.is_dir():
        pytest.skip(f"the real assemblies are not at hand: {REAL}")
    names = sorted({path.stem for path in REAL.rglob("*.FCStd")})[:60]
    parent, *parts = [api.item(name=name, description=name) for name in names]
    api.merge(parent, dict.fromkeys(parts, 2), document={"file": "assembly.FCStd", "folder": "lmn3"})
    api.good("PUT", bom(parent, parts[0]), {"quantity": 0.5, "unit": "m", "notes": " ".join(names[:9])})
    api.good("PUT", bom(parent, parts[1]), {"find_number": "10", "notes": names[5]})
    api.merge(parent, dict.fromkeys([parts[0], *parts[3:]], 3))
    page = visit("admin", locale=locale)
    findings: list[str] = []
    of_item = ("", "?view=flat", "/bom", f"/bom?edit={parts[1]}", "/history", "/print", "/edit", "/releases")
    for path in (
        *(f"/items/{parent}{one}" for one in of_item),
        "/items",
        "/waiting",
        "/mine",
        "/users",
        "/account",
    ):
        page.goto(path)
        english = measured(page, ENGLISH) if locale == "de-DE" else []
        findings += [f"{path}: {words}" for words in english]
        for width in WIDTHS:
            page.set_viewport_size({"width": width, "height": 844})
            findings += [f"{path} at {width}: {tall}" for tall in measured(page, TALL)]
    assert not findings, "\n".join(findings)


def test_answers_have_no_finding(axe: str, api: Api, numbers: dict[str, str], visit: Visit) -> None:
    """Pages that only a form or an event brings: an import, a token, a notice, a problem, read-only."""
    page = visit("admin")
    findings: list[str] = []

    def look(what: str) -> None:
        findings.extend(in_each_width(page, axe, what))

    page.goto(f"/items/{numbers['parent']}/import")
    text = f"Part number,Quantity\n{numbers['child']},9\nNO-SUCH,1\n".encode()
    page.get_by_label("CSV file or workbook").set_input_files(
        {"name": "x.csv", "mimeType": "text/csv", "buffer": text}
    )
    page.get_by_role("button", name="Check the file").click()
    page.locator("#checked").wait_for()
    look("import")
    page.goto("/account")
    page.get_by_label("Name of a new token").fill("laptop")
    page.get_by_role("button", name="Make token").click()
    page.locator("#fresh").wait_for()
    look("token")
    page.goto(f"/items/{numbers['parent']}/bom")
    page.get_by_role("button", name="Keep 6").click()
    page.locator(".notice").wait_for()
    look("notice")
    page.get_by_label("Part number").fill("NO-SUCH")
    page.get_by_role("button", name="Add line").click()
    page.get_by_role("alert").wait_for()
    look("problem")
    api.good("PUT", "/api/admin/mode", {"mode": "read-only"})
    try:
        page.goto(f"/items/{numbers['parent']}/bom")
        look("read-only")
    finally:
        api.good("PUT", "/api/admin/mode", {"mode": "normal"})
    assert findings == []


def in_each_width(page: Page, axe: str, what: str) -> list[str]:
    """What is wrong with the page as it is shown now, in each width, light and dark."""
    findings = []
    for width in WIDTHS:
        page.set_viewport_size({"width": width, "height": 844})
        for scheme in SCHEMES if width in FOR_AXE else ():
            page.emulate_media(color_scheme=scheme)
            findings += [f"{what} at {width}, {scheme}: {finding}" for finding in violations(page, axe)]
        if measured(page, OVERFLOW) > 0:
            findings.append(f"{what} at {width}: it is wider than the window")
        findings += [f"{what} at {width}: {tall}" for tall in measured(page, TALL)]
    page.set_viewport_size({"width": WIDTHS[0], "height": 844})
    return findings


def violations(page: Page, axe: str) -> list[str]:
    """What axe finds on the page as it is shown now: rule, weight, and where."""
    if measured(page, "typeof axe") == "undefined":
        measured(page, axe)
    found: dict[str, Any] = measured(page, RUN, RULES)
    return [
        f"{violation['id']} ({violation['impact']}): {node['target'][0]} {node['failureSummary']}"
        for violation in found["violations"]
        for node in violation["nodes"]
    ]


def test_pages_of_an_edit_have_no_finding(axe: str, api: Api, numbers: dict[str, str], visit: Visit) -> None:
    """A choice, two readings, a kept form, columns by hand, a filter; at 1440, 390 and 320 px."""
    page = visit("editor")
    findings: list[str] = []
    parent, child = numbers["parent"], numbers["child"]
    path = f"/items/{parent}/bom?edit={child}"

    def look(what: str) -> None:
        findings.extend(in_each_width(page, axe, what))

    def save(quantity: str) -> None:
        page.locator("#edit").get_by_label("Quantity").fill(quantity)
        page.get_by_role("button", name="Save", exact=True).click()

    page.goto(path)
    api.good("PUT", bom(parent, child), {"quantity": 7, "notes": "theirs"})
    save("8")
    page.get_by_label("theirs:").wait_for()
    look("choice")
    page.goto(path)
    save("1,000")
    page.get_by_role("button", name="Save with 1000").wait_for()
    look("readings")
    page.context.clear_cookies()
    save("9")
    page.get_by_role("button", name="I have logged in").wait_for()
    look("kept over a login")
    tab = page.context.new_page()
    tab.goto(str(api.good("POST", "/api/users/editor/login-link")["path"]))
    tab.get_by_role("button", name="Log in").click()
    tab.locator(".who").wait_for()
    page.get_by_role("button", name="I have logged in").click()
    page.get_by_role("button", name="Send it now").wait_for()
    look("not sent yet")
    page.goto(f"/items/{parent}/import")
    file = {"name": "x.csv", "mimeType": "text/csv", "buffer": b"a;b\n1;2\n"}
    page.get_by_label("CSV file or workbook").set_input_files([file])  # type: ignore[list-item]
    page.get_by_role("button", name="Check the file").click()
    page.get_by_role("button", name="Check again").wait_for()
    look("columns")
    page.goto("/activity?kind=syncs")
    look("activity")
    page.goto(f"/items/{parent}/history")
    look("history")
    assert findings == []


def test_a_page_is_measured_with_its_style_sheet(visit: Visit) -> None:
    """Text comes before the style sheet; what tests measure waits for both."""
    page = visit("viewer")
    page.goto("/items")
    plain = measured(page, HEADER)
    come_late(page.context, 1)
    page.get_by_role("link", name="Activity").click()
    page.get_by_role("heading", name="Activity").wait_for()
    assert measured(page, HEADER) == plain


def test_pages_with_a_model_have_no_finding(axe: str, api: Api, visit: Visit) -> None:
    """The controls of the model, beside a product, a decision and a comparison."""
    top = machine(api, "A")
    page = visit("admin")
    findings: list[str] = []
    for path in ("", "/bom", "/compare"):
        page.goto(f"/items/{top}{path}")
        page.locator("#model[data-ready]").wait_for()
        findings += in_each_width(page, axe, path)
    assert findings == []
