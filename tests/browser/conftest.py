# SPDX-License-Identifier: LGPL-2.1-or-later
"""A real browser against a real server.

Chromium is the machine's own. Without one these tests are skipped, loudly; with ``SILO_REQUIRE_BROWSER=1``
they fail instead.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect, sync_playwright
from server_testing import Api, sqlite_database
from settled import come_late
from web_visitor import enter

from silo_server.run import RunningServer, running_server

TOKEN = "silo_" + "browser0" * 5
SECONDS = 90
# Style sheets, scripts and pictures come so many seconds late: a hunt for tests that depend on time.
LATE = float(os.environ.get("SILO_LATE_ASSETS", "0"))

Visit = Callable[..., Page]


def need(found: bool, what: str) -> None:
    """Skip, or fail where the machine promised to have it."""
    if found:
        return
    if os.environ.get("SILO_REQUIRE_BROWSER") == "1":
        pytest.fail(f"SILO_REQUIRE_BROWSER is 1, but {what}")
    pytest.skip(f"{what}; set SILO_REQUIRE_BROWSER=1 to make this an error")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Everything in this folder needs the browser."""
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.browser)


@pytest.fixture(scope="session")
def chromium() -> Iterator[Browser]:
    """The machine's Chromium; without its window if it is there, which costs half the processor."""
    names = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
    path = next(filter(None, map(shutil.which, names)), None)
    need(path is not None, "there is no Chromium on this machine")
    # A machine that does much else at the same time is slow, not wrong.
    expect.set_options(timeout=SECONDS * 1000)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=path,
            # Pages are drawn by Chromium itself; models by WebGL in software.
            args=["--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader"],
            timeout=SECONDS * 1000,
        )
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    """A server over an empty database; each test makes its own items."""
    folder = tmp_path_factory.mktemp("server")
    with running_server(sqlite_database(folder / "silo.db"), token=TOKEN) as running:
        yield running


@pytest.fixture
def api(server: RunningServer) -> Iterator[Api]:
    """The admin's token."""
    with Api(server.base_url, TOKEN) as caller:
        yield caller


@pytest.fixture
def visit(chromium: Browser, server: RunningServer, api: Api) -> Iterator[Visit]:
    """``visit(role)``: an empty tab of somebody who is logged in (nobody for ``None``).

    A script that fails, and whatever our own Content-Security-Policy refuses, fails the test.
    """
    contexts: list[BrowserContext] = []
    faults: list[str] = []

    def open_page(role: str | None = "admin", **options: Any) -> Page:
        context = chromium.new_context(base_url=server.base_url, **options)
        context.set_default_timeout(SECONDS * 1000)
        contexts.append(context)
        if LATE:
            come_late(context, LATE)
        if role is not None:
            name, _, value = cookie_of(api, role).partition("=")
            context.add_cookies([{"name": name, "value": value, "url": server.base_url}])
        page = context.new_page()
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.on("console", lambda message: _refused(message.text, faults))
        return page

    yield open_page
    for context in contexts:
        context.unroute_all(behavior="ignoreErrors")
        context.close()
    assert not faults


def cookie_of(api: Api, role: str) -> str:
    """Log in as a user with this role, who is made where there is none, and return the session's cookie."""
    if role != "admin" and api.call("POST", "/api/users", {"username": role, "role": role}).status != 201:
        api.good("PUT", f"/api/users/{role}", {"role": role, "active": True})
    return enter(api, role).cookie


def _refused(text: str, faults: list[str]) -> None:
    if "Content Security Policy" in text or "Uncaught" in text:
        faults.append(text)
