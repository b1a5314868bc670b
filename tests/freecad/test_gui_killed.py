# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD is killed in the worst moment; after a restart nothing is lost and nothing is doubled."""

from __future__ import annotations

from typing import Any

import pytest
from freecad_cases.machines import NEWEST
from gui_cases.window import Window

VERSIONS = NEWEST

pytestmark = [pytest.mark.freecad, pytest.mark.slow]

KILLED = -9


def stand(freecad: Window, number: str) -> tuple[list[str], dict[str, float | None]]:
    """The files and the lines of an item."""
    with freecad.server.client() as client:
        files = [r.file_name for r in client.revisions(number) if r.file_name]
        return files, {line.child_part_number: line.quantity for line in client.get_bom(number)}


@pytest.fixture(name="told", scope="module")
def _told(freecad: Window) -> dict[str, Any]:
    """Four starts of FreeCAD; each but the last is killed, each but the first finishes what was begun."""

    def run(kill: str, tasks: str = "") -> dict[str, Any]:
        env = {"SILO_TEST_KILL": kill, "SILO_TEST_TASKS": tasks}
        return freecad.run("killed.py", env=env, code=KILLED if kill else 0)

    told: dict[str, Any] = {"numbers": run("upload_file")["numbers"]}
    top = told["numbers"]["Top"]
    told["upload_file"] = {**run("merge_bom", "finish"), "stand": stand(freecad, top)}
    told["merge_bom"] = {**run("create_item", "finish"), "stand": stand(freecad, top)}
    with freecad.server.client() as client:
        told["items before"] = {item.name: item.id for item in client.search_items()}
    run("", "register")
    with freecad.server.client() as client:
        told["items"] = [(item.name, item.id) for item in client.search_items()]
        (frame,) = client.search_items("Frame")
        (nut,) = client.search_items("Nut")
        told["lines"] = [line.child_part_number for line in client.get_bom(frame.part_number)]
        told["nut"] = nut.part_number
    return told


def test_killed_after_the_upload_before_the_bom(told: dict[str, Any]) -> None:
    """The next start finishes it. (The next commit was killed after its merge, so that is in the BOM too.)"""
    found = told["upload_file"]
    assert (found["waiting"], len(found["boxes"])) == ([], 1)
    assert "+1 added" in found["boxes"][0]


def test_killed_after_the_merge_before_its_answer(told: dict[str, Any]) -> None:
    """Two commits are two files and one line."""
    found = told["merge_bom"]
    assert (found["waiting"], len(found["boxes"])) == ([], 1)
    files, lines = found["stand"]
    assert files == ["Top.FCStd"] * 2
    assert lines == {told["numbers"]["Bolt"]: 7}


def test_killed_between_item_and_identity(told: dict[str, Any]) -> None:
    """The item exists, no file names it: registering again finds it, and makes no second one."""
    before = told["items before"]
    assert sorted(before) == ["Bolt", "Nut", "Top"]
    assert sorted(name for name, _ in told["items"]) == ["Bolt", "Frame", "Nut", "Top"]
    assert dict(told["items"])["Nut"] == before["Nut"]
    assert told["lines"] == [told["nut"]]
