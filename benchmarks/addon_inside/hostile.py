# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: how long the window takes over ten thousand links, most of them with something wrong."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, os.environ["SILO_TEST_CASES"])
sys.path.insert(0, str(Path(__file__).parent))

import inside
from inside import VAULT, App, Gui, addon, boxes, run, settled, tell, wait
from pulse import Pulse, Times, clocked, rest, spin, total


def fills(dialog: Any, pulse: Pulse) -> list[Times]:
    """Have the times noted that a kind of dialog takes to show what the worker found."""
    times: list[Times] = []
    timed = pulse.timed(dialog.fill, times)
    dialog.fill = lambda self, found: timed(self, found)
    return times


def story() -> None:
    from silo.workbench.preview.dialog import PreviewDialog
    from silo.workbench.register.dialog import RegisterDialog

    one = addon()
    one.preferences.set("AskComment", False)
    one.preferences.set("AskRegister", False)
    wait(lambda: one.session.shown.connection == "online")
    doc = App.openDocument(str(VAULT / "Top.FCStd"))
    App.setActiveDocument(doc.Name)
    one.dock.show_and_raise()
    rest()
    snapshots = [clocked(lambda: one.commits.snapshot(doc)) for _ in range(3)]
    tell(snapshot=min(snapshots, key=lambda one: one["cpu"]))

    pulse = Pulse()
    walks: list[Times] = []
    desk = one.commits._desk
    desk.snapshot = pulse.timed(desk.snapshot, walks)
    pulse.start()
    Gui.runCommand("Origin_Commit")
    spin(lambda: boxes("BOM not synced") and settled())
    pulse.stop()
    tell(commit=pulse.longest())

    previews, registers = fills(PreviewDialog, pulse), fills(RegisterDialog, pulse)
    Gui.runCommand("Silo_BOM")
    window = wait(lambda: next(iter(one.previews._open.values()), None))
    wait(lambda: window._preview is not None)
    tell(preview=total(previews[:1]))
    window.close()
    Gui.runCommand("Silo_RegisterParts")
    window = wait(lambda: next(iter(one.registrations._open.values()), None))
    wait(lambda: window.rows)
    tell(register=total(registers[:1]))
    window.close()
    names = tuple(obj.Name for obj in doc.Objects if obj.TypeId == "App::Link")
    tell(show=clocked(lambda: one.buttons.show_objects(doc.FileName, names)), shown=len(names))


inside.LONGEST_S = 170
run(story)
