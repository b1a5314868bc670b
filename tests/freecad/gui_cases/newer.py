# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD 0.20: an assembly of FreeCAD 1.0 is open; saving it would destroy it."""

from __future__ import annotations

import os
import sys

sys.path.insert(0, os.environ["SILO_TEST_CASES"])

from inside import VAULT, App, Gui, addon, run, settled, tell, wait


def story() -> None:
    one = addon()
    wait(lambda: one.session.shown.connection == "online")
    path = VAULT / "TopAssembly.FCStd"
    before = path.read_bytes()
    doc = App.openDocument(str(path))
    doc.addObject("Part::Box", "Edit")
    from silo.workbench.gui import widgets

    told: list[str] = []
    widgets.warn = lambda _parent, _title, text: told.append(text)
    Gui.runCommand("Origin_Commit")
    wait(lambda: told and settled())
    tell(told=told, untouched=path.read_bytes() == before)


run(story)
