# SPDX-License-Identifier: LGPL-2.1-or-later
"""Two FreeCADs with the same assemblies open, and a real server: nobody's commit is undone without a word."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import pytest
from freecad_cases.machines import ENDS
from gui_cases.window import Window

VERSIONS = ENDS

pytestmark = [pytest.mark.freecad, pytest.mark.slow]


@dataclass
class Day:
    """What the two told, and the server that they talked to."""

    alice: dict[str, Any]
    bob: dict[str, Any]
    window: Window

    def revisions(self, name: str) -> list[tuple[int, str]]:
        """(number, comment) of an item's files, oldest first."""
        with self.window.server.client() as client:
            found = client.revisions(self.alice["numbers"][name])
        return [(one.revision_number, one.comment) for one in reversed(found) if one.file_name]

    def lines(self, name: str) -> dict[str, bool]:
        """Part → whether the assembly still uses it, by the names of the parts."""
        names = {number: name for name, number in self.alice["numbers"].items()}
        with self.window.server.client() as client:
            found = client.get_bom(self.alice["numbers"][name])
        return {names[line.child_part_number]: line.unreferenced_since is None for line in found}


@pytest.fixture(name="day", scope="module")
def _day(freecad: Window) -> Day:
    alice, bob = freecad, Window(freecad.freecad, freecad.folder / "bob", freecad.server)
    bob.folder.mkdir()
    bob.prepare()
    shared = {"SILO_TEST_SHARED": str(alice.folder)}
    with ThreadPoolExecutor() as pool:
        hers = pool.submit(alice.run, "colleague.py", env={**shared, "SILO_TEST_ROLE": "alice"})
        his = pool.submit(bob.run, "colleague.py", env={**shared, "SILO_TEST_ROLE": "bob"})
        # Where she fails he waits for her in vain, so her failure is the one to show.
        return Day(hers.result(), his.result(), bob)


def test_the_pane_says_who_committed_meanwhile(day: Day) -> None:
    """Without being asked, by the server's events."""
    (text,) = day.bob["pane"]
    assert text.count("since you opened it") == 5
    assert f"{day.alice['numbers']['Left']} Left (revision 2)" in text


def test_without_a_choice_nothing_is_undone(day: Day) -> None:
    """The row is not checked, and says who, what, and what mine would undo."""
    left = day.bob["left"]
    assert left["title"].startswith("Commit to Silo – ")
    assert left["row"][0] == "Left.FCStd"
    assert "committed revision 2; yours was made from revision 1" in left["row"][1]
    assert "without the plate" in left["details"][0]
    assert "Plate: 1 → 0 by them, as before in yours" in left["details"]
    assert "Bolt: 4 → 0 by you, as before in theirs" in left["details"]
    assert left["can_commit"] is False
    assert day.revisions("Left") == [(1, "first"), (2, "without the plate")]
    assert day.lines("Left") == {"Bolt": True, "Plate": False}


def test_a_long_difference_is_shown_whole(day: Day) -> None:
    """In the dialog, for a commit that is held, and in the history: the first lines, and all at a press."""
    first, every = day.bob["left"]["all"]
    assert len(first) == 1 + 12 + 1
    assert len(every) == 30
    assert {*every} == {*first[1:-1]}
    assert sorted(day.bob["held_all"]) == [
        "Bolt: 4 → 0 by you, as before in theirs",
        "Plate: 1 → 0 by them, as before in yours",
    ]
    assert day.bob["history_all"] == 20


def test_in_a_low_window_nothing_of_what_waits_is_cut(day: Day) -> None:
    """It scrolls with the news, and does not make the window higher."""
    assert (day.bob["held_height"], day.bob["held_cut"]) == (400, [])


def test_on_top_at_a_persons_word(day: Day) -> None:
    """The comment says so, the BOM is mine; the commit after it asks nothing."""
    numbers = [number for number, _ in day.revisions("OnTop")]
    comments = [comment for _, comment in day.revisions("OnTop")]
    assert numbers == [1, 2, 3, 4]
    assert comments[2].startswith("mine (on top of revision 2 by ")
    assert comments[3] == "next"
    assert day.lines("OnTop") == {"Bolt": False, "Plate": True}


def test_theirs_is_taken_and_mine_is_kept(day: Day) -> None:
    """FreeCAD has theirs open, with its links; a copy of mine is there."""
    assert day.bob["has"] == ["Bolts"]
    assert day.bob["linked"] == [True]
    assert len(day.revisions("Taken")) == 2
    kept = list(day.window.folder.rglob("kept-aside/**/*Taken.FCStd"))
    # The other one is of the window *Open from Silo*.
    assert len(kept) == 2


def test_a_copied_folder_knows_what_it_was_made_from(day: Day) -> None:
    """Though its file was saved since; theirs opens beside mine with all its links."""
    assert "yours was made from revision 1" in day.bob["copied"]["row"][1]
    assert day.bob["beside"] == [["Bolts", True]]
    assert day.bob["both"] == ["Plate"]
    assert len(day.revisions("Copied")) == 2
    assert day.bob["waiting"] == []


def test_the_history_and_an_old_revision_with_all_that_it_links_to(day: Day) -> None:
    """Newest first, with what each changed; revision 1 opens whole from an empty folder."""
    numbers = [row[0] for row in day.bob["history"]]
    assert numbers == ["4 ← yours", "3", "2", "1"]
    assert day.bob["history"][2][1] == "without the plate"
    assert "+ Plate 1" in day.bob["change"]
    assert "- Bolt 4" in day.bob["change"]
    assert day.bob["opened"] == [["Bolts", True], ["Plate", True]]


def test_a_held_commit_is_decided_in_the_pane(day: Day) -> None:
    """With the choices of the dialog; theirs is taken, mine is kept aside, and nothing waits any more."""
    (reason,) = day.bob["held"]
    assert "committed revision 2 of" in reason
    assert {"Open theirs beside mine", "Take theirs", "Commit mine on top"} <= {*day.bob["held_buttons"]}
    assert "Send now" not in day.bob["held_buttons"]
    assert day.bob["held_difference"] == ["Plate: 1 → 0 by them, as before in yours"]
    assert day.bob["held_beside"] == day.bob["held_has"] == ["Bolts"]
    assert len(day.revisions("Held")) == 2
    # Hers, which his save replaced; what he committed; what he had open.
    assert len(list(day.window.folder.rglob("kept-aside/**/*Held.FCStd"))) == 3


def test_get_this_revision_fetches_a_copy_with_its_links(day: Day) -> None:
    """Revision 1, in the folder that was chosen, in a folder of its own."""
    number = day.alice["numbers"]["OnTop"]
    assert day.bob["got_in"].split("/")[0] == f"{number}-r1"
    assert day.bob["got"] == [["Bolts", True], ["Plate", True]]


def test_a_new_version_over_edits_is_a_question(day: Day) -> None:
    """Until then the file is left alone and named; a copy of the edit is kept."""
    assert "Taken.FCStd has edits that are not in Silo; it was left alone." in day.bob["left_alone"]
    assert day.bob["untouched"]
    assert day.bob["replaced"] == ["Bolts", "Plate"]
    assert day.bob["edit_kept"]
    assert day.bob["opened_in_place"]


def test_the_line_of_news_stays_readable(day: Day) -> None:
    """However often its text and its colour change."""
    assert day.bob["news_contrast"] >= 4.5
