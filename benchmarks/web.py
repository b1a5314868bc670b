# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the pages weigh and how quick they are in Chromium: 1 000 and 10 000 lines, 18 levels, 100 thumbnails.

    python benchmarks/web.py [--repeat N]

The server is a process of its own on SQLite, on the loopback. Each page is opened N times in a fresh context.
Printed are medians: kB over the wire with all style sheets, scripts and pictures; the same once more with
what the browser kept; requests; ms of CPU of the server, and of the page's main thread in the browser; ms
until the last byte of the page; ms until the first contentful paint (it shows the table: all comes as one
piece); DOM nodes; and ms of an interaction, from the key or the click to the new table on the screen.
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import Browser, CDPSession, Page, StorageState, sync_playwright

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "support"))

from large_boms import upload_pictures, write_boms
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


COLUMNS = ("kB", "again", "requests", "cpu", "browser", "served", "paint", "nodes", "act")


def main() -> None:
    """Build, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeat", type=int, default=5)
    repeat = parser.parse_args().repeat
    with tempfile.TemporaryDirectory() as scratch, sync_playwright() as playwright:
        url = f"sqlite:///{Path(scratch) / 'silo.db'}"
        with ServerProcess(url, Path(scratch) / "files", TOKEN) as server, Api(server.base_url, TOKEN) as api:
            wide, deep = write_boms(url)
            upload_pictures(api, 100)
            browser = playwright.chromium.launch(
                executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"]
            )
            state = _log_in(browser, server.base_url, api)
            pages: list[tuple[str, str, Callable[[Page], object]]] = [
                ("BOM of 1 000 lines", f"/items/{wide}/bom", _filter),
                ("tree, 1 000 lines", f"/items/{wide}", _filter),
                ("flat list, 1 000 parts", f"/items/{wide}?view=flat", _sort),
                ("tree, 10 000 rows, 18 levels, as it opens", f"/items/{deep}", _open_branch),
                ("the same, all levels, page 1 of 10", f"/items/{deep}?depth=18", _next_page),
                ("items, 100 thumbnails", "/items?q=pictured", _filter),
            ]
            print(f"{'':<42}" + "".join(f"{name:>9}" for name in COLUMNS))
            for name, path, act in pages:
                runs = [_measure(browser, server, state, path, act) for _ in range(repeat)]
                middle = [statistics.median(run[column] for run in runs) for column in COLUMNS]
                print(f"{name:<42}" + "".join(f"{value:9.0f}" for value in middle))
            browser.close()


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
    browser: Browser, server: ServerProcess, state: StorageState, path: str, act: Callable[[Page], object]
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
    page.evaluate(TIMER)
    act(page)
    found["act"] = page.evaluate("() => window.done")
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
