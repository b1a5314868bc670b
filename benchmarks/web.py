# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the pages weigh and how quick they are in Chromium: 10 000 lines, 18 levels, 100 thumbnails.

    python benchmarks/web.py [--repeat N]

The server is a process of its own on SQLite, on the loopback. Each page is opened N times in a fresh context.
Printed are medians: kB over the wire with all style sheets, scripts and pictures; the same once more with
what the browser kept; requests; ms of CPU of the server, and of the page's main thread in the browser; ms
until the last byte of the page; ms until the first contentful paint (it shows the table: all comes as one
piece); DOM nodes; and of an interaction (a filter, a sort, …) ms from the key or the click to the new table
on the screen, and ms of CPU of the server.

Then models of 300 and 2 000 bodies, in software WebGL: ms until all is loaded; frames per second while the
model turns at 1280 × 800, and ms of CPU of a frame, in all of Chromium's processes; ms of a pick with its
highlight, worst of twelve, and until the highlight is on the screen.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import random
import shutil
import statistics
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import Browser, CDPSession, Page, StorageState, sync_playwright

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "support"))

from large_boms import upload_pictures, write_boms
from model_scenes import body, commit, use
from server_testing import Api, ServerProcess
from web_visitor import link_of

TOKEN = "silo_" + "benchweb" * 5
PAINT = "() => performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? 0"
TIMER = """() => {
    scrollTo(0, 0);
    let began = 0;
    for (const kind of ["click", "input"]) {
        document.addEventListener(kind, () => { began = performance.now(); }, true);
    }
    window.done = new Promise((done) => document.addEventListener("shown", () => requestAnimationFrame(
        () => setTimeout(() => done(performance.now() - began))), { once: true }));
}"""
SERVED = "() => performance.getEntriesByType('navigation')[0].responseEnd"


COLUMNS = ("kB", "again", "requests", "cpu", "browser", "served", "paint", "nodes", "act", "act cpu")


def main() -> None:
    """Build, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeat", type=int, default=5)
    repeat = parser.parse_args().repeat
    with tempfile.TemporaryDirectory() as scratch, sync_playwright() as playwright:
        url = f"sqlite:///{Path(scratch) / 'silo.db'}"
        with ServerProcess(url, Path(scratch) / "files", TOKEN) as server, Api(server.base_url, TOKEN) as api:
            wide, deep = write_boms(url, lines=10_000)
            upload_pictures(api, 100)
            browser = playwright.chromium.launch(
                executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"]
            )
            state = _log_in(browser, server.base_url, api)
            pages: list[tuple[str, str, Callable[[Page], object] | None]] = [
                ("BOM of 10 000 lines", f"/items/{wide}/bom", _filter),
                ("tree, 10 000 lines", f"/items/{wide}", _filter),
                ("flat list, 10 000 parts, sorted", f"/items/{wide}?view=flat", _sort),
                ("the same, filtered", f"/items/{wide}?view=flat", _filter),
                ("what changed in it", f"/items/{wide}/changes", None),
                ("its order list", f"/items/{wide}/order", None),
                ("tree, 10 000 rows, 18 levels, as it opens", f"/items/{deep}", _open_branch),
                ("the same, all levels, page 1 of 10", f"/items/{deep}?depth=18", _next_page),
                ("items, 100 thumbnails", "/items?q=pictured", _filter),
            ]
            print(f"{'':<42}" + "".join(f"{name:>9}" for name in COLUMNS))
            for name, path, act in pages:
                runs = [_measure(browser, server, state, path, act) for _ in range(repeat)]
                middle = [statistics.median(run[column] for run in runs) for column in COLUMNS]
                print(f"{name:<42}" + "".join(f"{value:9.0f}" for value in middle))
            print(f"{'':<42}" + "".join(f"{name:>9}" for name in MODEL_COLUMNS))
            for count in (300, 2000):
                path = f"/items/{_model_of(api, count)}"
                runs = [_turn(browser, server, state, path) for _ in range(repeat)]
                middle = [statistics.median(run[column] for run in runs) for column in MODEL_COLUMNS]
                print(f"{f'model of {count} bodies':<42}" + "".join(f"{value:9.1f}" for value in middle))
            browser.close()


MODEL_COLUMNS = ("loaded", "frames", "cpu", "pick", "lit")
# All of the window, as a person with a large screen has it.
WIDE = """() => Object.assign(document.querySelector(".view").style, {
    position: "fixed", inset: 0, width: "1280px", height: "800px", zIndex: 9 })"""
COUNT = """() => {
    let n = 0;
    const one = () => { n++; requestAnimationFrame(one); };
    one();
    window.frames_now = () => n;
}"""
PICKS = """() => Math.max(...Array.from({ length: 12 }, (_, n) => {
    const canvas = document.querySelector("canvas");
    const at = { clientX: 500 + 25 * n, clientY: 380 + 5 * n };
    canvas.dispatchEvent(new PointerEvent("pointerdown", { ...at, pointerId: 1 }));
    canvas.dispatchEvent(new PointerEvent("pointerup", { ...at, pointerId: 1 }));
    const began = performance.now();
    canvas.dispatchEvent(new MouseEvent("click", at));
    return performance.now() - began;
}))"""
LIT = """async () => {
    const began = performance.now();
    document.querySelector(".spot").click();
    for (let n = 0; n < 2; n++) await new Promise(requestAnimationFrame);
    return performance.now() - began;
}"""


def _model_of(api: Api, count: int) -> str:
    """A product with so many bodies of 40 kinds, 120 000 triangles for 300 of them."""
    dice = random.Random(12)
    kinds = ("block", "ball", "rod")
    bodies = {
        f"Body{n}": (
            body(kinds[n % 3], 0.02 + 0.1 * dice.random() ** 2),
            [*(dice.random() for _ in range(3)), 1],
        )
        for n in range(40)
    }
    part = api.item(f"BODY-{count}")
    uuid = api.get(f"/api/items/{part}")["id"]
    uses = [
        use(f"Use{n}", f"Body{dice.randrange(40)}", uuid, *(dice.uniform(-0.6, 0.6) for _ in range(3)))
        for n in range(count)
    ]
    top = api.item(f"MODEL-{count}")
    api.merge(top, {part: count})
    commit(api, top, f"model {count}".encode(), bodies, {"Top": uses})
    return top


def _turn(browser: Browser, server: ServerProcess, state: StorageState, path: str) -> dict[str, float]:
    context = browser.new_context(
        base_url=server.base_url, storage_state=state, viewport={"width": 1280, "height": 800}
    )
    page = context.new_page()
    page.goto(path)
    page.locator("#model[data-ready]").wait_for()
    found = {"loaded": page.evaluate("performance.now()")}
    page.evaluate(WIDE)
    page.mouse.move(640, 400)
    page.mouse.down()
    page.evaluate(COUNT)
    before, began = _cpu_of_chromium(), page.evaluate("performance.now()")
    for n in range(80):
        page.mouse.move(640 + 4 * n, 400 + n % 20)
        page.wait_for_timeout(25)
    frames, seconds = page.evaluate("frames_now()"), (page.evaluate("performance.now()") - began) / 1000
    found |= {"frames": frames / seconds, "cpu": (_cpu_of_chromium() - before) / frames}
    page.mouse.up()
    page.wait_for_timeout(1000)
    found |= {"pick": page.evaluate(PICKS), "lit": page.evaluate(LIT)}
    context.close()
    return found


def _cpu_of_chromium() -> float:
    """The CPU time of all processes of Chromium so far [ms]."""
    found = 0.0
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            if b"chromium" in (folder / "cmdline").read_bytes():
                found += _cpu(int(folder.name))
    return found


def _log_in(browser: Browser, base_url: str, api: Api) -> StorageState:
    context = browser.new_context(base_url=base_url)
    page = context.new_page()
    page.goto(link_of(api, "admin"))
    page.get_by_role("button", name="Log in").click()
    page.get_by_role("heading", name="Items").wait_for()
    state = context.storage_state()
    context.close()
    return state


def _measure(
    browser: Browser,
    server: ServerProcess,
    state: StorageState,
    path: str,
    act: Callable[[Page], object] | None,
) -> dict[str, float]:
    context = browser.new_context(base_url=server.base_url, storage_state=state)
    page = context.new_page()
    session = context.new_cdp_session(page)
    sizes: list[float] = []
    session.on("Network.loadingFinished", lambda event: sizes.append(event["encodedDataLength"]))
    session.send("Network.enable")
    session.send("Performance.enable", {"timeDomain": "threadTicks"})
    page.goto(path, wait_until="networkidle")
    work = _task_time(session)
    _see_all(page)
    found = {
        "kB": sum(sizes) / 1e3,
        "requests": len(sizes),
        "served": page.evaluate(SERVED),
        "paint": page.evaluate(PAINT),
        "browser": work,
        "nodes": page.evaluate("() => document.querySelectorAll('*').length"),
    }
    sizes.clear()
    before = _cpu(server.pid)
    page.goto(path, wait_until="networkidle")
    _see_all(page)
    found |= {"again": sum(sizes) / 1e3, "cpu": _cpu(server.pid) - before}
    found |= {"act": 0, "act cpu": 0}
    if act is not None:
        page.evaluate(TIMER)
        before = _cpu(server.pid)
        act(page)
        found |= {"act": page.evaluate("() => window.done"), "act cpu": _cpu(server.pid) - before}
    context.close()
    return found


def _task_time(session: CDPSession) -> float:
    """The CPU time of the page's main thread so far: parsing, style, layout, paint, scripts [ms]."""
    metrics = session.send("Performance.getMetrics")["metrics"]
    return next(one["value"] for one in metrics if one["name"] == "TaskDuration") * 1000


def _cpu(pid: int) -> float:
    """The CPU time of a process so far [ms]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) * 1000 / os.sysconf("SC_CLK_TCK")


def _see_all(page: Page) -> None:
    """Thumbnails come when they are scrolled to."""
    page.evaluate(
        "async () => { for (let y = 0; y < document.body.scrollHeight; y += 600) {"
        "scrollTo(0, y); await new Promise(requestAnimationFrame); } }"
    )
    page.wait_for_load_state("networkidle")


def _filter(page: Page) -> None:
    page.get_by_role("searchbox").press_sequentially("9")


def _sort(page: Page) -> None:
    page.get_by_role("link", name="Cost", exact=True).click()


def _open_branch(page: Page) -> None:
    page.locator(".twist[aria-expanded]").first.click()


def _next_page(page: Page) -> None:
    page.get_by_role("link", name="Next").click()


if __name__ == "__main__":
    main()
