# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD is closed or killed in the worst moment; after a restart nothing is lost and nothing is doubled.

``tests/outbox/test_crash.py`` has the other moments, without FreeCAD.
"""

from __future__ import annotations

from typing import Any

import pytest
from freecad_cases.machines import NEWEST
from gui_cases.window import Window

VERSIONS = NEWEST

pytestmark = [pytest.mark.freecad, pytest.mark.slow]


@pytest.fixture(name="told", scope="module")
def _told(freecad: Window) -> dict[str, Any]:
    """Three starts of FreeCAD: closed, killed, and left alone."""
    told: dict[str, Any] = {}
    for start, code in enumerate((0, -9, 0)):
        told |= freecad.run("ended.py", env={"SILO_TEST_START": str(start)}, code=code)
    top = told["numbers"]["Top"]
    with freecad.server.client() as client:
        told["files"] = {
            name: [r.file_name for r in client.revisions(number) if r.file_name]
            for name, number in {**told["closed"], "Top": top}.items()
        }
        told["lines"] = {line.child_part_number: line.quantity for line in client.get_bom(top)}
    return told


def test_each_file_is_in_silo_once(told: dict[str, Any]) -> None:
    """No modal question, none lost, none doubled; the next start sends what is left."""
    assert told["closed_running"]
    assert told["files"] == {name: [f"{name}.FCStd"] for name in told["files"]}
    assert len(told["files"]) == 7


def test_killed_after_the_merge_before_its_answer(told: dict[str, Any]) -> None:
    """The next start finishes it, and shows it."""
    (box,) = told["boxes"]
    assert "+1 added" in box
    assert told["lines"] == {told["numbers"]["Bolt"]: 5}
