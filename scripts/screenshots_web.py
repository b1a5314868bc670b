# SPDX-License-Identifier: LGPL-2.1-or-later
"""Photograph the web pages into ``docs/images/web-*.png``: the example assembly on a server of its own.

Run: ``.venv/bin/python scripts/screenshots_web.py [FOLDER]`` (needs Chromium on the machine). Into another
FOLDER every page is photographed, in light and wide, in dark and on the narrowest phone, to look at while
working on them: with the example, with a real project where the test data are at hand, and with 10 000 lines.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from playwright.sync_api import Browser, Page, sync_playwright

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "support"))

from gearbox_story import PROPERTIES, GearboxStory  # noqa: E402
from large_boms import write_boms  # noqa: E402

from silo.api.client import SiloClient  # noqa: E402
from silo_server.run import RunningServer, running_server  # noqa: E402
from silo_server.settings import Settings  # noqa: E402

DOCS = ROOT / "docs" / "images"
WIDE, NARROW = {"width": 1200, "height": 800}, {"width": 390, "height": 844}
WINDOW = {"width": 1440, "height": 900}
SMALLEST = {"width": 320, "height": 640}
REAL = ROOT.parent / "shared" / "data" / "assemblies" / "lmn3"
REAL_TOP = "assemblies/assembly.FCStd"
# A picture of ten thousand rows is too tall for any viewer; its beginning shows how it looks.
MOST_HEIGHT = 3000
IMPORT = (
    "Part number,Quantity,Unit,Notes\nM01-0001,1,,\nF01-0001,14,,torque 25 Nm\nC01-0002,0.05,l,oil\nX99,1,,\n"
)


@dataclass(frozen=True)
class Shot:
    """A page to photograph. ``show`` is a selector that must be there before."""

    name: str
    path: str
    show: str = "main"


def main() -> None:
    """Play the story, then photograph."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    with tempfile.TemporaryDirectory() as scratch, _server(Path(scratch)) as (server, story):
        top = _play(server, story)
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(
                executable_path=shutil.which("chromium"),
                args=["--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader"],
            )
            state = _log_in(browser, server, Path(scratch) / "state.json")
            if folder is None:
                _for_docs(browser, server, state, top)
            else:
                folder.mkdir(parents=True, exist_ok=True)
                _all(browser, server, state, top, folder)
                real = _real(server, Path(scratch))
                large = write_boms(f"sqlite:///{Path(scratch) / 'silo.db'}")
                _views(browser, server, state, {"real": real, "wide": large[0], "deep": large[1]}, folder)
            browser.close()


@contextmanager
def _server(folder: Path) -> Iterator[tuple[RunningServer, GearboxStory]]:
    url = f"sqlite:///{folder / 'silo.db'}"
    settings = Settings(database_url=url, admin_username="designer")
    with (
        running_server(url, token="silo_" + "0" * 40, settings=settings) as server,
        SiloClient(server.base_url, server.token) as client,
    ):
        yield server, GearboxStory(folder, client)


def _play(server: RunningServer, story: GearboxStory) -> str:
    """Everything that the pages can show; the part number of the top assembly."""
    client = story.client
    story.register()
    _commit(server, story.top, "first issue")
    for name, properties in PROPERTIES.items():
        number = story.number_of(name)
        client.update_item(number, properties={**client.get_properties(number), **properties})
    top = story.number_of("TopAssembly")
    glue = client.create_item("kindred-rd", "C01", "Thread locker", item_type="consumable")
    client.create_item("kindred-rd", "C01", "Gear oil ISO VG 220", item_type="consumable")
    client.add_bom_line(top, glue.part_number, quantity=0.02, unit="l", notes="cover bolts, medium strength")
    client.update_bom_line(top, story.number_of("MotorMount"), quantity=2)
    story.remove("Cover")
    story.remove("BasePlate")
    story.more_bolts(4)
    _commit(server, story.top, "without cover and base plate")
    return top


def _commit(server: RunningServer, top: Path, comment: str) -> None:
    """Send the files with their models, and the BOMs, as a user does it."""
    environ = {**os.environ, "SILO_API_URL": server.base_url, "SILO_API_TOKEN": str(server.token)}
    command = [sys.executable, "-m", "silo.cli.main", "commit", str(top), "--comment", comment]
    subprocess.run(command, env=environ, check=True)


def _log_in(browser: Browser, server: RunningServer, state: Path) -> Path:
    context = browser.new_context()
    page = context.new_page()
    page.goto(server.login_url)
    page.get_by_role("button", name="Log in").click()
    context.storage_state(path=state)
    context.close()
    return state


def _shots(top: str) -> list[Shot]:
    return [
        Shot("items", "/items", "tbody"),
        Shot("new", "/items/new"),
        Shot("edititem", "/items/F01-0001/edit"),
        Shot("waiting", "/waiting"),
        Shot("item", f"/items/{top}", ".tree"),
        Shot("flat", f"/items/{top}?view=flat"),
        Shot("merge", f"/items/{top}/bom", ".banner.warn"),
        Shot("edit", f"/items/{top}/bom?edit=F01-0001", "#edit"),
        Shot("history", f"/items/{top}/history"),
        Shot("compare", f"/items/{top}/compare?old=2", ".compare"),
        Shot("activity", "/activity", ".live.on"),
        Shot("import", f"/items/{top}/import"),
        Shot("account", "/account"),
        Shot("users", "/users"),
        Shot("audit", "/audit"),
        Shot("missing", "/items/NO-SUCH"),
    ]


def _real(server: RunningServer, scratch: Path) -> str:
    """A real project, registered and synced as a user does it; "" where it is not at hand."""
    if not REAL.is_dir():
        return ""
    copy = scratch / "lmn3"
    shutil.copytree(REAL, copy, copy_function=shutil.copyfile)  # the data are read-only
    environ = {**os.environ, "SILO_API_URL": server.base_url, "SILO_API_TOKEN": str(server.token)}
    command = [sys.executable, "-m", "silo.cli.main"]
    top = str(copy / REAL_TOP)
    subprocess.run([*command, "register", top, "--yes"], env=environ, check=False)
    # Some of its files are really missing: what an incomplete BOM looks like.
    subprocess.run([*command, "sync", top, "--recursive", "--allow-missing"], env=environ, check=False)
    with SiloClient(server.base_url, server.token) as client:
        found = client.search_items("assembly")
    return next((item.part_number for item in found if item.name == "assembly"), "")


def _views(browser: Browser, server: RunningServer, state: Path, tops: dict[str, str], folder: Path) -> None:
    for name, top in tops.items():
        if not top:
            continue
        path = f"/items/{top}"
        shots = [
            Shot(f"{name}-tree", path),
            Shot(f"{name}-tree-all", f"{path}?depth=18&page=10"),
            Shot(f"{name}-flat", f"{path}?view=flat&sort=-cost&pieces=10"),
            Shot(f"{name}-found", f"{path}?q=bearing"),
            Shot(f"{name}-bom", f"{path}/bom"),
            Shot(f"{name}-history", f"{path}/history"),
            Shot(f"{name}-compare", f"{path}/compare"),
            Shot(f"{name}-print", f"{path}/print"),
            Shot(f"{name}-edit", f"{path}/edit"),
            Shot(f"{name}-import", f"{path}/import"),
            Shot(f"{name}-items", "/items?sort=-changed"),
            Shot(f"{name}-waiting", "/waiting"),
            Shot(f"{name}-activity", "/activity"),
        ]
        for scheme, viewport in (("light", WIDE), ("dark", SMALLEST)):
            context = browser.new_context(
                base_url=server.base_url, storage_state=state, color_scheme=scheme, viewport=viewport
            )
            page = context.new_page()
            for shot in shots:
                _photograph(page, shot, folder / f"{shot.name}-{scheme}.png")
            context.close()


def _all(browser: Browser, server: RunningServer, state: Path, top: str, folder: Path) -> None:
    for scheme, width, viewport in (("light", "wide", WIDE), ("dark", "narrow", SMALLEST)):
        context = browser.new_context(
            base_url=server.base_url, storage_state=state, color_scheme=scheme, viewport=viewport
        )
        page = context.new_page()
        for shot in _shots(top):
            _photograph(page, shot, folder / f"{shot.name}-{width}-{scheme}.png")
        _check_import(page, top)
        page.screenshot(path=folder / f"checked-{width}-{scheme}.png", full_page=True)
        context.close()
        stranger = browser.new_context(
            base_url=server.base_url, color_scheme=scheme, viewport=viewport
        ).new_page()
        _photograph(stranger, Shot("login", "/login"), folder / f"login-{width}-{scheme}.png")
        stranger.context.close()


def _for_docs(browser: Browser, server: RunningServer, state: Path, top: str) -> None:
    wanted = {"items", "item", "merge", "compare", "activity", "waiting", "edititem"}
    for scheme, viewport, suffix in (("light", WIDE, ""), ("dark", NARROW, "-phone")):
        context = browser.new_context(
            base_url=server.base_url, storage_state=state, color_scheme=scheme, viewport=viewport
        )
        page = context.new_page()
        for shot in _shots(top):
            if shot.name in wanted and (not suffix or shot.name == "merge"):
                _photograph(page, shot, DOCS / f"web-{shot.name}{suffix}.png")
        if not suffix:
            _decision(page, top)
        context.close()


def _decision(page: Page, top: str) -> None:
    """The decision page's first question in the model, in a window, and a sub-assembly of the product."""
    page.set_viewport_size(WINDOW)
    page.goto(f"/items/{top}/bom#model")
    page.locator("#model[data-ready]").wait_for()
    page.evaluate("scrollTo(0, 0)")
    page.screenshot(path=DOCS / "web-decision.png")
    page.goto(f"/items/{top}")
    page.locator("#model[data-ready]").wait_for()
    page.get_by_role("button", name="Show A01-0001 in the model").click()
    page.screenshot(path=DOCS / "web-model.png")


def _photograph(page: Page, shot: Shot, path: Path) -> None:
    page.goto(shot.path)
    page.locator(shot.show).first.wait_for()
    if page.locator("#model").count():
        page.locator("#model[data-ready]").wait_for()
    width, height = page.evaluate("() => [innerWidth, document.documentElement.scrollHeight]")
    if page.evaluate("() => document.documentElement.scrollWidth > innerWidth"):
        print(f"{shot.path} is wider than the screen of {width}")
    clip = {"x": 0, "y": 0, "width": width, "height": min(height, MOST_HEIGHT)}
    page.screenshot(path=path, full_page=True, clip=clip)


def _check_import(page: Page, top: str) -> None:
    page.goto(f"/items/{top}/import")
    page.get_by_label("CSV file").set_input_files(
        {"name": "bom.csv", "mimeType": "text/csv", "buffer": IMPORT.encode()}
    )
    page.get_by_role("button", name="Check the file").click()
    page.locator("#checked").wait_for()


if __name__ == "__main__":
    main()
