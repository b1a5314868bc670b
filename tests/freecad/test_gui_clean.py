# SPDX-License-Identifier: LGPL-2.1-or-later
"""No command leaves a document marked as edited, touched, or with another undo stack than before."""

from __future__ import annotations

import ast
from typing import Any

import pytest
from freecad_cases.machines import ENDS, REPOSITORY
from gui_cases.window import Window

VERSIONS = ENDS

pytestmark = [pytest.mark.freecad, pytest.mark.slow]

# The names of the commands, read and not imported: there is no FreeCAD here.
COMMANDS = sorted(
    node.value.value
    for node in ast.parse((REPOSITORY / "mods/silo/workbench/commands.py").read_text("utf-8")).body
    if isinstance(node, ast.Assign)
    and isinstance(node.targets[0], ast.Name)
    and isinstance(node.value, ast.Constant)
    and node.targets[0].id not in ("OWN_COMMIT", "INSTALL")
    and str(node.value.value).startswith(("Silo_", "Origin_"))
)


@pytest.fixture(name="said", scope="module")
def _said(freecad: Window) -> dict[str, Any]:
    return freecad.run("clean.py")


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_leaves_the_documents_as_they_were(said: dict[str, Any], command: str) -> None:
    """Registering writes and saves; all others only read or send."""
    assert said["done"][command] == {"known": True, "changed": {}}


def test_the_commands_did_their_work(said: dict[str, Any]) -> None:
    """The bolt got its number, and the mass needed the materials where FreeCAD has them."""
    assert said["registered"] == ["Bolt.FCStd"]
    assert said["mass"]
    assert all("Longer" in state["undo"] for state in said["start"].values())


def test_our_save_takes_the_mark_away(said: dict[str, Any]) -> None:
    """Also of a document without a window, which FreeCAD 0.20 saves for nobody."""
    assert [state["modified"] for state in said["edited"].values()] == [True] * 3
    assert [state["modified"] for state in said["saved"].values()] == [False] * 3
    assert said["active"] == "Top"
    assert len(said["windows"]) == 1


def test_the_property_editor_has_number_and_state(said: dict[str, Any]) -> None:
    """Of each selected component, read only, in a group of its own; the file has nothing of it."""
    assert (said["shown_early"], said["selecting_changed"]) == ([], {})
    number, *rest = said["shown"]["P"]
    assert number.startswith("M01-")
    assert rest == ["in Silo", "Silo", True]
    assert said["shown"]["B"][1:] == ["in Silo", "Silo", True]
    assert not said["in_file"]


def test_the_project_opens_without_marks(said: dict[str, Any]) -> None:
    """Registering a part saves the assembly too, which keeps the times at which its parts were saved."""
    clean = {"modified": False, "undo": [], "touched": []}
    assert said["reopened"] == dict.fromkeys(("Bolt", "Plate", "Top"), clean)
