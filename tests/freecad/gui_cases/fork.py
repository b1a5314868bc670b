# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside a FreeCAD that has an ``Origin_Commit`` of its own (see ``test_gui_corners.py``)."""

from __future__ import annotations

from typing import Any

from inside import App, Gui, addon, assembly, boxes, link, part, register, run, settled, tell, wait


class Origin:
    """A fork's origin, in Python."""

    def __init__(self) -> None:
        self.committed: list[str] = []

    def commitDocument(self, doc: Any) -> bool:
        self.committed.append(doc.Name)
        return True


def story() -> None:
    one = addon()
    wait(lambda: one.session.shown.connection == "online")
    bolt = part("Bolt")
    top = assembly("Top", ("B1", bolt, 0))
    number = register(bolt.Document, top.Document)["Top"]
    title = f"BOM Updated: {number}"
    wait(lambda: settled())
    App.setActiveDocument("Top")
    tell(
        text=Gui.Command.get("Origin_Commit").getInfo()["menuText"],
        own=Gui.Command.get("Silo_Commit").getInfo()["menuText"],
    )
    # Saving a document of Silo is a commit there: the BOM follows.
    wait(lambda: len(boxes(title)) == 1 and settled())

    # From a menu, by the command's QAction. Nothing is saved, so only the action can tell.
    link(top, "B2", bolt)
    Gui.activateWorkbench("ForkWorkbench")
    action = wait(lambda: next(iter(Gui.Command.get("Origin_Commit").getAction()), None))
    action.trigger()
    wait(lambda: len(boxes(title)) == 2 and settled())

    # From a macro: no QAction, but the command saves.
    link(top, "B3", bolt)
    Gui.runCommand("Fork_SaveAndCommit")
    wait(lambda: len(boxes(title)) == 3 and settled())

    # By the origin itself.
    origin = Origin()
    Gui.getOrigin = lambda _doc: origin
    Gui.activateWorkbench("PartWorkbench")
    link(top, "B4", bolt)
    origin.commitDocument(top.Document)
    wait(lambda: len(boxes(title)) == 4 and settled())
    tell(committed=origin.committed, boxes=boxes(title))


run(story)
