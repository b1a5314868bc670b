# SPDX-License-Identifier: LGPL-2.1-or-later
"""A commit knows what was edited from what was only recomputed, by content; and it registers what is new."""

from __future__ import annotations

from typing import Any

import pytest
from freecad_cases.machines import ENDS
from gui_cases.window import Window

VERSIONS = ENDS
PARTS = 11  # beside the assembly, as in the story

pytestmark = [pytest.mark.freecad, pytest.mark.slow]


@pytest.fixture(name="said", scope="module")
def _said(freecad: Window) -> dict[str, Any]:
    return freecad.run("edited.py")


def test_a_recompute_is_no_edit(said: dict[str, Any]) -> None:
    """FreeCAD marks all documents; one of them has an edit."""
    assert said["marked"] == PARTS + 1
    states = dict(said["states"])
    assert states.pop("Part7") == "changed"
    assert set(states.values()) == {"recomputed"}
    assert len(states) == PARTS


def test_only_what_was_edited_is_checked(said: dict[str, Any]) -> None:
    """And all, none or only this file by a click; without any there is nothing to commit."""
    told = said["dialog"]
    assert told["checked"] == ["Part7", "Top"]
    assert told["all"] == [PARTS + 1, True]
    assert told["none"] == [0, False]
    assert told["this"] == [1, True]
    assert told["edited"] == [2, True]
    assert f"{PARTS - 1} more files were only recomputed" in "\n".join(told["texts"])


def test_what_was_committed_has_no_edits_any_more(said: dict[str, Any]) -> None:
    """Ctrl+Return did it; the others stay as FreeCAD has them."""
    assert not said["edited_left"]
    assert said["left"] <= PARTS


@pytest.mark.parametrize("kind", ["length", "constraint", "placement", "label", "sheet", "new", "hidden"])
def test_an_edit_is_an_edit_until_it_is_undone(said: dict[str, Any], kind: str) -> None:
    """Whatever kind of property it is in."""
    done, undone = said["kinds"][kind]
    assert done
    assert undone == []


def test_what_cannot_be_told_is_an_edit(said: dict[str, Any]) -> None:
    """A property that was added; and "save a copy" writes another file."""
    kinds = said["kinds"]
    assert kinds["recomputed"] == [True, []]
    assert kinds["gone"][0] == ["Ball"]
    assert kinds["property"][0] == ["Ball.Finish"]
    assert kinds["saved"] == []
    assert kinds["saved a copy"] == ["Pad.Length"]


def test_an_unregistered_assembly_is_registered_within_its_commit(
    freecad: Window, said: dict[str, Any]
) -> None:
    """The comment that was asked for becomes that of its first file in Silo."""
    assert said["offers"]
    with freecad.server.client() as client:
        found = [r.comment for r in client.revisions(said["numbers"]["New.FCStd"]) if r.file_name]
    assert found == ["my first words"]
