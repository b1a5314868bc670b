# SPDX-License-Identifier: LGPL-2.1-or-later
"""The whole story: an assembly is synced, a person decides in the browser, and the next sync is quiet."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from gearbox_story import GearboxStory
from playwright.sync_api import Page, expect

from silo.api.client import SiloClient
from silo.bom_sync.steps import Status
from silo_server.run import RunningServer

Visit = Callable[..., Page]


@pytest.fixture
def story(server: RunningServer, tmp_path: Path) -> Iterator[GearboxStory]:
    """The example assembly, registered."""
    with SiloClient(server.base_url, server.token) as client:
        made = GearboxStory(tmp_path, client)
        made.register()
        yield made


def test_from_the_assembly_to_a_quiet_sync(story: GearboxStory, visit: Visit) -> None:
    """Sync, banner, keep one with a reason, remove one; then there is nothing to do, and nothing is sent."""
    story.sync()
    top, cover, plate = (story.number_of(name) for name in ("TopAssembly", "Cover", "BasePlate"))
    story.remove("Cover")
    story.remove("BasePlate")
    story.more_bolts(4)
    merged = story.sync()[-1]
    assert merged.result is not None
    page = visit("editor")

    page.goto(story.client.web_url(merged.result.resolve_url))
    expect(page.get_by_role("heading", level=2).first).to_contain_text(
        "2 items in the Silo BOM are not referenced by components in this assembly"
    )
    told = page.locator(".columns")
    expect(told).to_contain_text("M8x20 Bolt: quantity 12 → 16")
    expect(told).to_contain_text("Cover: no longer referenced by the assembly")
    expect(told).to_contain_text("TopAssembly.FCStd")

    page.get_by_label(f"Reason for keeping {cover}").fill("Ordered with the housing")
    page.get_by_role("button", name=f"Keep as intentional {cover}").click()
    expect(page.get_by_role("status").first).to_contain_text(f"{cover} kept as intentional")
    expect(page.get_by_role("heading", level=2).first).to_contain_text(
        "1 item in the Silo BOM is not referenced by components in this assembly"
    )
    page.get_by_role("button", name=f"Remove {plate}").click()
    expect(page.locator(".banner.calm")).to_contain_text("Nothing to decide")
    line = page.locator("tr", has=page.get_by_role("link", name=cover, exact=True))
    expect(line).to_contain_text("by hand")
    expect(line).to_contain_text("Ordered with the housing")
    expect(page.get_by_role("link", name=plate, exact=True)).to_have_count(0)

    assert [outcome.status for outcome in story.sync()] == [Status.UNCHANGED, Status.UNCHANGED]
    assert story.number_of("TopAssembly") == top
    page.reload()
    expect(page.locator(".banner.calm")).to_be_visible()
