# SPDX-License-Identifier: LGPL-2.1-or-later
"""The add-on as a guest: partial documents, forks, missing packages, its dock, files of newer FreeCADs."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
from freecad_cases import machines
from freecad_cases.machines import MOSTLY_ENDS, MOSTLY_NEWEST, REPOSITORY
from gui_cases.window import Window, window

VERSIONS = MOSTLY_ENDS

pytestmark = [pytest.mark.freecad, pytest.mark.slow]

# An add-on as a fork's own workbench would be; it loads before "Silo".
FORK = """
class Commit:
    def __init__(self, text, saves):
        self.text, self.saves = text, saves
    def GetResources(self):
        return {"MenuText": self.text, "ToolTip": "the fork's own"}
    def Activated(self):
        if self.saves:
            import FreeCAD
            FreeCAD.ActiveDocument.save()

class ForkWorkbench(Workbench):
    MenuText = "Fork"
    def Initialize(self):
        self.appendToolbar("Fork", ["Origin_Commit"])
    def GetClassName(self):
        return "Gui::PythonWorkbench"

FreeCADGui.addCommand("Origin_Commit", Commit("Fork commit", False))
FreeCADGui.addCommand("Fork_SaveAndCommit", Commit("Save and commit", True))
FreeCADGui.addWorkbench(ForkWorkbench())
"""


@pytest.fixture(name="corners", scope="module")
def _corners(freecad: Window) -> dict[str, Any]:
    return freecad.run("corners.py")


def test_a_partly_loaded_document_with_edits_is_told_and_kept(corners: dict[str, Any]) -> None:
    """FreeCAD would write nothing, or half of it; it is neither saved nor reloaded."""
    assert corners["partial"]
    (first, top) = corners["partial_dialog"]
    assert first[0] == "Bolt.FCStd"
    assert first[1].startswith("FreeCAD has loaded it only in part and cannot save these edits")
    assert (first[2], top[2]) == (0, 1)
    assert corners["partial_edit"] == 44.0
    assert corners["partial_file_untouched"]


def test_a_document_without_a_file_is_told(corners: dict[str, Any]) -> None:
    """In words that say what to do."""
    assert corners["unnamed"] == "Nameless has no file yet. Save it under a name first."


def test_a_copied_identity_asks(corners: dict[str, Any]) -> None:
    """The box says so and offers the decision."""
    box = corners["copied_box"]
    assert "2 files carry the same Silo identity" in box
    assert "[Same part] [New part…]" in box
    rows = {component: (number, checked) for component, number, checked in corners["copied_rows"]}
    assert rows == {"Bracket.FCStd": ("ask", False), "Bracket2.FCStd": ("ask", False)}


def test_a_new_part_has_its_own_identity_then(corners: dict[str, Any]) -> None:
    """And nothing is asked any more."""
    assert "identity" not in corners["copied_after"]


def test_the_same_part_is_counted_at_a_press_in_the_pane(corners: dict[str, Any]) -> None:
    """Both files count as the one item, now and at the next commit."""
    asked, counted = corners["same"]
    assert "2 files carry the same Silo identity" in asked
    assert "identity" not in counted
    assert "identity" not in corners["same_again"]


@pytest.mark.parametrize("version", MOSTLY_NEWEST)
def test_a_forks_commit_is_hooked_and_not_replaced(version: str, tmp_path: Path) -> None:
    """By its QAction, by the save, by its origin; the BOM follows once each time."""
    with window(version, tmp_path) as freecad:
        fork = freecad.home / "Mod" / "AFork"
        fork.mkdir()
        (fork / "InitGui.py").write_text(FORK)
        said = freecad.run("fork.py")
    assert (said["text"], said["own"]) == ("Fork commit", "Commit to Silo")
    assert said["committed"] == ["Top"]
    counts = [box.splitlines()[1] for box in reversed(said["boxes"])]
    assert counts == ["+1 added", "~1 qty changed", "~1 qty changed", "~1 qty changed"]


BESIDE = """
import FreeCADGui as Gui


class Other:
    def __init__(self, text):
        self.text = text

    def GetResources(self):
        return {"MenuText": self.text}

    def Activated(self):
        pass


class SiloWorkbench(Gui.Workbench):
    MenuText = "Their Silo"

    def Initialize(self):
        self.appendMenu("Their Silo", ["Silo_BOM", "Silo_Settings", "Silo_Commit"])

    def GetClassName(self):
        return "Gui::PythonWorkbench"


for name in NAMES:
    Gui.addCommand(name, Other("their " + name))
if "Silo_BOM" in NAMES:
    Gui.addWorkbench(SiloWorkbench())
"""
# Loaded before ours, and after it.
BESIDE_IN = {"ARealSilo": ("Silo_BOM", "Silo_Settings"), "ZRealSilo": ("Silo_Commit", "Origin_Commit")}


@pytest.mark.parametrize("version", MOSTLY_ENDS)
def test_beside_the_real_silos_workbench(version: str, tmp_path: Path) -> None:
    """Whichever loads first, both menus have their own commands. Ours is the start-up workbench."""
    with window(version, tmp_path) as freecad:
        config = freecad.home / "user.cfg"
        config.write_text(config.read_text().replace("NoneWorkbench", "SiloModWorkbench"))
        for place, names in BESIDE_IN.items():
            other = freecad.home / "Mod" / place
            other.mkdir()
            (other / "InitGui.py").write_text(f"NAMES = {names!r}\n{BESIDE}")
        said = freecad.run("beside.py")
        log = (freecad.folder / "freecad.log").read_text(errors="replace")
    assert "Unknown command" not in log + said["report"]
    assert said["theirs"] == ["their Silo_BOM", "their Silo_Settings", "their Silo_Commit"]
    assert said["ours"] == [
        "Commit to Silo",
        "Project",
        "Open from Silo…",
        "History…",
        "Compare BOM with Silo…",
        "Register Parts…",
        "Mass of the Assembly…",
        "Database Activity",
        "Silo Settings…",
        "Help on Silo",
    ]
    assert said["works"]
    assert said["help"]
    assert said["whats_this"]
    # No other command of FreeCAD has our keys, in any workbench that a designer uses.
    ours = {keys: text for text, keys in said["shortcuts"].items() if keys}
    assert sorted(ours) == [f"Ctrl+Alt+{key}" for key in "ABMPRS"]
    assert ours["Ctrl+Alt+R"] == "Register Parts…"
    found = said["commands_of_keys"]
    assert "Ctrl+Z" in found
    assert {keys: [*set(found[keys])] for keys in ours} == {keys: [text] for keys, text in ours.items()}


# A part with coordinate systems of 1.1; the origins of its containers have points, which 1.1 makes again.
_PART_OF_1_1 = """
import os
import FreeCAD

doc = FreeCAD.newDocument("Bracket")
doc.addObject("PartDesign::Body", "Body")
doc.addObject("Part::LocalCoordinateSystem", "Mount").Label = "Mount of the motor"
doc.addObject("Part::DatumPoint", "Tip")
doc.recompute()
doc.saveAs(os.environ["SILO_OUT"])
"""


@pytest.mark.parametrize(
    ("version", "name", "lost"),
    [
        ("0.20", "TopAssembly.FCStd", "(Assembly::AssemblyObject)"),
        ("1.0", "Bracket.FCStd", "Mount of the motor (Part::LocalCoordinateSystem), Tip (Part::DatumPoint)"),
    ],
)
def test_a_file_of_a_newer_freecad_keeps_what_is_unknown_here(
    version: str, name: str, lost: str, tmp_path: Path
) -> None:
    """This FreeCAD has dropped its objects already. A commit refuses to save that; a save is a question."""
    with window(version, tmp_path) as freecad:
        shutil.copytree(REPOSITORY / "examples" / "gearbox", freecad.vault, dirs_exist_ok=True)
        if name == "Bracket.FCStd":
            script = tmp_path / "part.py"
            script.write_text(_PART_OF_1_1)
            newer = machines.need("1.1")
            env = {**newer.profile(tmp_path / "newer"), "SILO_OUT": str(freecad.vault / name)}
            newer.must_run(script, env, cwd=tmp_path)
        freecad.server.down()
        freecad.server.freecad_version = "1.1"
        freecad.server.up()
        said = freecad.run("newer.py", env={"SILO_NEWER": name})
    assert said["team"][0].startswith(f"Your team works with FreeCAD 1.1; this is {version}")
    assert said["untouched"]
    (text,) = said["told"]
    assert text.startswith(f"{name}: made by a newer FreeCAD: saving it here would destroy")
    for words in (text, *said["opened"], said["asked"], said["again"], *said["over"]):
        assert lost in words
        assert "App::Point" not in words
    assert said["kept"]
    assert "The newer file was kept" in said["after_keeping"][0]
    assert "Saved over the newer file" in said["over"][0]
    assert (said["replaced"], said["modified"]) == (True, False)
    assert len(said["aside"]) == 3  # the newer file before each save, and what the first save wrote
