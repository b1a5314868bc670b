# SPDX-License-Identifier: LGPL-2.1-or-later
"""Register Parts' sections, a moved part and the comparison with the view, in FreeCAD's window."""

from __future__ import annotations

from typing import Any

import pytest
from freecad_cases.machines import ENDS
from gui_cases.window import Window

VERSIONS = ENDS

pytestmark = [pytest.mark.freecad, pytest.mark.slow]


@pytest.fixture(name="said", scope="module")
def _said(freecad: Window) -> dict[str, Any]:
    return freecad.run("counting.py")


def test_what_is_modelled_in_the_file_is_declared_and_taken_back(said: dict[str, Any]) -> None:
    """Sections with headings; no check mark; equal copies in one press; nothing is left behind."""
    assert said["offered"] == [
        *("Components", "Bolt.FCStd", "Top.FCStd", "Standard parts", "Standard part: ISO 4762 M4×16"),
        *("Modelled in this file, not counted", "Motor (2 copies)", "Jig"),
    ]
    assert said["checked"] == ["Bolt.FCStd", "Top.FCStd", "Standard part: ISO 4762 M4×16"]
    assert said["number"]
    assert len(set(said["ids"])) == 1
    assert said["again"] == [
        *(
            "Modelled in this file, not counted",
            "Jig",
            "Modelled in this file, and counted",
            "Motor (2 copies)",
        ),
    ]
    assert not said["left"]
    assert not [key for key in said["meta"] if "Motor" in key]


def test_what_is_no_part_is_one_press_and_another_takes_it_back(said: dict[str, Any]) -> None:
    """The file keeps the answer; the dialog lists it in a section of its own, without a question."""
    assert (said["excluded"], said["remark"]) == (True, "not a part: not listed again")
    assert said["third"] == [
        *("Modelled in this file, not counted", "Motor (2 copies)"),
        *("Modelled in this file, not a part", "Jig"),
    ]
    assert said["asked_again"]


def test_a_hidden_body_is_answered_by_one_press_each_way(said: dict[str, Any]) -> None:
    """The table says what it is, and the object keeps the answer."""
    assert said["offered_0"] == [True, "hidden, does not count"]
    assert said["offered_1"] == [True, "hidden, counts"]
    assert said["answered"] == [False, True]
    assert said["words"].startswith("References from now on, not counted: Jig.")


def test_a_missing_part_has_both_ways_out_in_the_pane(said: dict[str, Any]) -> None:
    """The BOM waits; a person syncs it without the part, or has the link mended."""
    assert "[Relink…] [Sync without it]" in said["waits"]
    assert "Incomplete: 1 component is missing" in said["without"]
    assert said["relinked"] == "moved/Bolt.FCStd"


def test_a_moved_part_is_found_and_its_live_links_are_mended(said: dict[str, Any]) -> None:
    assert said["can_mend"]
    assert said["mended"] == "moved/Bolt.FCStd"


def test_the_preview_says_why_a_line_counts_so_many(said: dict[str, Any]) -> None:
    """In the words of the command line: the number, then each chain."""
    assert (said["line"], said["why"]) == ("1", "1 × Bolt in Assembly:\nFirst")


def test_the_comparison_with_the_view_takes_what_a_finding_names(said: dict[str, Any]) -> None:
    """A visible original lies where its array shows it: a finding names it, so nothing differs."""
    assert "the BOM explains" in said["agrees"]
    assert ("They differ" in said["agrees"], said["selected"]) == (False, [])
    assert "1 left out as the findings say" in said["differs"]
