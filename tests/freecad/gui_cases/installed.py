# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside a FreeCAD into which ``silo-mod install-addon`` put the add-on: the first commit."""

from __future__ import annotations

import os
import sys

sys.path.insert(0, os.environ["SILO_TEST_CASES"])

from inside import App, Gui, addon, boxes, part, register, run, settled, tell, wait


def story() -> None:
    import silo

    one = addon()
    one.preferences.set("AskComment", False)
    wait(lambda: one.session.shown.connection == "online")
    doc = part(os.environ["SILO_PART"]).Document
    register(doc)
    App.setActiveDocument(doc.Name)
    Gui.runCommand("Origin_Commit")
    wait(lambda: boxes("Committed: ") and settled())
    tell(**{"from": silo.__path__[0]}, committed=boxes("Committed: "))


run(story)
