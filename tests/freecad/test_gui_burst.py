# SPDX-License-Identifier: LGPL-2.1-or-later
"""Commits in quick succession arrive in order, each with what it was; FreeCAD is closed amid others."""

from __future__ import annotations

from typing import Any

import pytest
from freecad_cases.machines import NEWEST
from gui_cases.window import Window

VERSIONS = NEWEST

pytestmark = [pytest.mark.freecad, pytest.mark.slow]

TIMES, OFFLINE = 5, 3


@pytest.fixture(name="burst", scope="module")
def _burst(freecad: Window) -> dict[str, Any]:
    said = freecad.run("burst.py")
    with freecad.server.client() as client:
        top, bolt = said["numbers"]["Top"], said["numbers"]["Bolt"]
        said["files"] = sum(1 for r in client.revisions(top) if r.file_name)
        said["quantity"] = {ln.child_part_number: ln.quantity for ln in client.get_bom(top)}[bolt]
    freecad.run("burst.py", env={"SILO_TEST_SECOND": "1"})
    with freecad.server.client() as client:
        said["closed_files"] = {
            name: [r.file_name for r in client.revisions(number) if r.file_name]
            for name, number in said["closed"].items()
        }
    return {**said, "url": freecad.server.url}


def test_a_burst_ends_with_what_was_committed_last(burst: dict[str, Any]) -> None:
    """The first one is still under way when the last is asked for; the BOM is that of the last."""
    assert burst["running"]
    assert "+1 added" in burst["first"][0]
    assert burst["quantity"] == TIMES + OFFLINE


def test_commits_that_wait_are_kept_apart(burst: dict[str, Any]) -> None:
    """Three commits without a server are three merges once it is back, in their order."""
    assert burst["waiting"] >= OFFLINE
    late = burst["boxes"][-OFFLINE:]
    assert [box.splitlines()[1] for box in late] == ["~1 qty changed"] * OFFLINE


def test_no_revision_is_lost_or_doubled(burst: dict[str, Any]) -> None:
    """In the order of the commits; a file that is the same as before is no new revision."""
    lines = [line for box in burst["boxes"] for line in box.splitlines()]
    uploaded = [int(line.split()[1]) for line in lines if line.endswith("uploaded")]
    assert uploaded == list(range(1, burst["files"] + 1))
    assert len(uploaded) + lines.count("The file is in Silo already") == TIMES + OFFLINE


def test_pages_of_other_servers_are_not_opened(burst: dict[str, Any]) -> None:
    """What is no page of any server is at most a page of ours that does not exist."""
    assert not [url for url in burst["asked"] if not url.startswith(f"{burst['url']}/")]
    assert "example.org" not in " ".join(burst["asked"])


def test_without_a_browser_the_address_is_copied(burst: dict[str, Any]) -> None:
    """So it can be pasted elsewhere."""
    page = f"{burst['url']}/items/A01-0001/bom"
    assert burst["asked"][-1] == page
    assert burst["copied"] == page


def test_closed_right_after_many_commits(burst: dict[str, Any]) -> None:
    """No modal question, none lost, none doubled; the next start sends them."""
    assert burst["closed_running"]
    assert burst["closed_files"] == {f"P{number}": [f"P{number}.FCStd"] for number in range(6)}
