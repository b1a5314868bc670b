# SPDX-License-Identifier: LGPL-2.1-or-later
"""Live documents in a session: unsaved edits, files opened twice, closed, broken, partial, hostile ones."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from freecad_cases import corpora, machines
from freecad_cases.machines import REPOSITORY, WANTED

pytestmark = pytest.mark.freecad

SCRIPT = Path(__file__).parent / "freecad_cases" / "session.py"


@pytest.fixture(scope="session", params=WANTED)
def session(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What one FreeCAD answered to all steps."""
    freecad = machines.need(request.param)
    folder = tmp_path_factory.mktemp("session").resolve()
    corpora.unpack(corpora.ARCHIVES / "corpus-0.20.zip", folder / "corpus")
    env = {
        **freecad.profile(folder / "profile"),
        "SILO_CASES": str(folder / "corpus"),
        "SILO_OUT": str(folder / "answers.json"),
        "SILO_MODS": str(REPOSITORY / "mods"),
    }
    freecad.must_run(SCRIPT, env, cwd=folder)
    answers = json.loads((folder / "answers.json").read_text())
    assert isinstance(answers, dict)
    return answers


def test_unsaved_edits_count(session: dict[str, Any]) -> None:
    """The BOM is that of the session, not that of the file."""
    assert session["unsaved_edits"] == {"bom": {"Bolt": 2}, "findings": [], "blocked": False}


def test_a_document_open_under_another_path_is_found(session: dict[str, Any]) -> None:
    """It is not opened a second time, and its unsaved edits are counted."""
    assert session["found_open_by_another_path"] == {
        "bom": {"Bolt": 2},
        "findings": [],
        "blocked": False,
        "documents": 2,
    }


def test_a_document_with_broken_links_is_not_reloaded(session: dict[str, Any]) -> None:
    """FreeCAD itself would close and read it again, and the edits would be lost."""
    answer = session["broken_document_is_not_reloaded"]
    assert answer == {"bom": {"Bolt": 2, "Gone": 2}, "findings": ["missing_file"], "blocked": True}


def test_a_partly_loaded_document_is_completed_where_needed(session: dict[str, Any]) -> None:
    """The links of others follow, and the person's document stays the active one."""
    assert session["part_document_is_completed"] == {
        "partial": [True, False],
        "more objects": True,
        "active": True,
        "bom": {"Bolt": 1},
        "findings": [],
        "blocked": False,
    }


def test_a_part_closed_by_hand_never_reads_as_removed(session: dict[str, Any]) -> None:
    """The file is there, but FreeCAD dropped the link: a missing line that blocks the sync and says why."""
    answer = session["closed_part"]
    assert (answer["bom"], answer["findings"], answer["blocked"]) == ({"Bolt": 1}, ["broken_link"], True)
    assert "bolt.FCStd" in answer["message"]


def test_a_lost_original_of_a_changed_copy_is_named(session: dict[str, Any]) -> None:
    """FreeCAD shows the copy and says nothing; the file that a person must bring back is reported."""
    answer = session["lost_original"]
    assert (answer["bom"], answer["findings"], answer["blocked"]) == ({"Bolt": 1}, ["missing_file"], True)
    assert "copy_on_change/bolt.FCStd is missing (it is the original of a changed copy)" in answer["message"]


def test_a_document_that_was_never_saved_can_be_read(session: dict[str, Any]) -> None:
    """It has no file and no components yet."""
    assert session["unsaved_document"] == {"bom": {}, "findings": ["empty_bom"], "blocked": False}


def test_a_file_with_a_doctype_is_not_given_to_freecad(session: dict[str, Any]) -> None:
    """Old FreeCADs follow external entities while they open a file."""
    assert session["hostile_file"].endswith(
        "bad.FCStd: its Document.xml declares a DOCTYPE, which FreeCAD never writes; not opened"
    )


def test_a_broken_file_is_told_with_its_reason(session: dict[str, Any]) -> None:
    """Not in FreeCAD's words but in ours."""
    assert "truncated_zip/bad.FCStd: " in session["broken_file"]
    assert "opened" not in session["broken_file"]


def test_a_damaged_part_is_a_missing_line_as_in_its_file(session: dict[str, Any]) -> None:
    """FreeCAD opens a part that was cut short without a word, its shape missing."""
    of_part = [answer for answer in session["damaged_files"] if answer["file"] == "bolt.FCStd"]
    assert {answer["damage"] for answer in of_part if answer["live"]["blocked"]} >= {
        *("_cut_behind_xml", "_without_directory", "_one_bit")
    }
    for answer in of_part:
        assert answer["live"] == answer["from file"], answer["damage"]
        if answer["live"]["blocked"]:
            assert answer["live"] == {"bom": {"Bolt": 1}, "findings": ["unreadable_file"], "blocked": True}
            assert "bolt.FCStd cannot be read" in answer["messages"][0]


def test_a_damaged_assembly_blocks_whatever_freecad_opened_of_it(session: dict[str, Any]) -> None:
    """As much of it as FreeCAD found must not read as the whole."""
    of_top = [answer for answer in session["damaged_files"] if answer["file"] == "top.FCStd"]
    for answer in of_top:
        assert "refused" in answer["from file"], answer["damage"]
        if "live" in answer:
            assert answer["live"] == {"bom": {}, "findings": ["unreadable_file"], "blocked": True}
    assert sum("live" in answer for answer in of_top) >= 3


def test_a_damaged_file_is_not_saved_over(session: dict[str, Any]) -> None:
    """Saving what FreeCAD opened of it would make the loss final."""
    for answer in session["damaged_files"]:
        assert answer["unchanged"], answer
        assert answer["refused"], answer
