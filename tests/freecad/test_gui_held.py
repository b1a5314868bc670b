# SPDX-License-Identifier: LGPL-2.1-or-later
"""A BOM that is held is seen in FreeCAD's window, and goes out when it can."""

from __future__ import annotations

from typing import Any

import pytest
from freecad_cases.machines import NEWEST
from gui_cases.window import Window

VERSIONS = NEWEST

pytestmark = [pytest.mark.freecad, pytest.mark.slow]


@pytest.fixture(name="told", scope="module")
def _told(freecad: Window) -> dict[str, Any]:
    said = freecad.run("held.py")
    with freecad.server.client() as client:
        number = said["numbers"]["Top"]
        said["lines"] = [line.child_part_number for line in client.get_bom(number)]
        said["last"] = client.get_item(number).last_sync
    return said


def test_a_held_bom_is_seen_everywhere(told: dict[str, Any]) -> None:
    """In the status bar, in the tree, in the project view; the pane opens, and says how it gets into Silo."""
    number = told["numbers"]["Top"]
    assert told["held"] == [[number, "1 file missing"]]
    assert told["sign"] == "⚠ Silo: 1 BOM held"
    assert told["pane"]
    assert told["tree"] == [f"The BOM of {number} is held here: 1 file missing"]
    text = "\n".join(told["labels"])
    assert "1 BOM is held" in text
    assert "held: 1 file missing" in text
    assert any("1 BOM is held" in line for line in told["project"])


def test_it_goes_out_when_its_file_is_back(told: dict[str, Any]) -> None:
    """By a look at the project; nobody commits anything. The sign goes, and Silo knows."""
    assert (told["after"], told["pane_after"], told["tree_after"]) == (False, False, [])
    assert sorted(told["lines"]) == sorted([told["numbers"]["Bolt"], told["numbers"]["Plate"]])
    assert (told["last"].held, told["last"].left_out) == (None, [])
