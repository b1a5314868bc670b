# SPDX-License-Identifier: LGPL-2.1-or-later
"""A project is registered as one fills a spreadsheet, seen whole, and taken back.

In the newest FreeCAD only: the flows below the window have tests of their own.
"""

from __future__ import annotations

from typing import Any

import pytest
from freecad_cases.machines import NEWEST
from gui_cases.window import Window

VERSIONS = NEWEST

pytestmark = [pytest.mark.freecad, pytest.mark.slow]


@pytest.fixture(name="many", scope="module")
def _many(freecad: Window) -> dict[str, Any]:
    return freecad.run("register_many.py")


def test_a_project_is_registered_in_fewer_than_15_actions(freecad: Window, many: dict[str, Any]) -> None:
    """Parts of many files, most of them guesses; nothing wrong in the items."""
    assert (many["rows"], many["documents"], many["left"]) == (17, True, [])
    assert many["unsure"] > 8
    assert many["shown"] == 4
    assert len(many["actions"]) < 15, many["actions"]
    numbers = many["numbers"]
    with freecad.server.client() as client:
        there = {item.part_number for item in client.search_items("", limit=200)}
    kinds = {name: number[:3] for name, number in numbers.items()}
    assert {kind for name, kind in kinds.items() if name.startswith("Widget")} == {"R27"}
    assert {kind for name, kind in kinds.items() if name.startswith("Gizmo")} == {"E03"}
    assert {kind for name, kind in kinds.items() if name.startswith("Bracket")} == {"S06"}
    # A tool's label is no name.
    assert many["names"] == ["Bracket 0", "Bracket 1"]
    # Undo archived them.
    assert not there & set(numbers.values())


def test_the_table_fits_a_small_screen_and_is_grouped_by_folder(many: dict[str, Any]) -> None:
    """800 × 500 is what a screen of 1600 × 1000 has at scale 2."""
    width, height = many["smallest"]
    assert (width <= 800, height <= 500) == (True, True), many["smallest"]
    assert [text.split("/")[-1] for text in many["headings"]] == ["frame", "bought", "electronics", "vault"]


def test_the_project_view_shows_each_file_and_sends_all(many: dict[str, Any]) -> None:
    """Nothing is guessed: the folder is asked for once. An edit is shown there and in FreeCAD's tree."""
    assert many["asked"].startswith("Choose the project's folder")
    assert many["left_rows"] == [["frame/Bracket 3.FCStd", "in Silo; unsaved edits"]]
    assert many["shown_rows"] == 1
    assert many["several"] == ["not in Silo"]
    assert many["all_left"] == 4
    assert "unsaved edits" in many["in_tree"]
    # The edited part and what links to it, as FreeCAD marks it; the view marks nothing.
    assert set(many["marked"]) <= {"Bracket 3", "Machine"}
    assert many["left_after"] == 0
    assert many["root"].endswith("vault")


def test_one_press_takes_back_what_was_registered(many: dict[str, Any]) -> None:
    """The files forget the items; what the person chose is proposed the next time, and shown as such."""
    assert (many["undone"], many["identities"]) == ([], 0)
    assert many["again"] == [
        "R27",
        "purchased",
        "Miracle Motors",
        True,
        "as you chose in this folder before",
    ]
    assert many["recent"] == "E03"
