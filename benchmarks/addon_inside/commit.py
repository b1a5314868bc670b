# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: commit a large assembly, and note every moment in which the window could not react."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import Any

sys.path.insert(0, os.environ["SILO_TEST_CASES"])
sys.path.insert(0, str(Path(__file__).parent))

import inside
from inside import VAULT, App, Gui, QtCore, QtWidgets, addon, boxes, run, settled, tell, wait
from pulse import Pulse, Times, clocked, rest, spin, total

COMMITS = 6


def commits(one: Any, doc: Any) -> None:
    """The first commit imports modules, once per FreeCAD; it is reported apart."""
    from silo.workbench import live_desk
    from silo.workbench.freecad import saving

    pulse = Pulse()
    saves: list[Times] = []
    walks: list[Times] = []
    live_desk.LiveDocuments.save = staticmethod(pulse.timed(saving.save, saves))
    desk = one.commits._desk
    desk.snapshot = pulse.timed(desk.snapshot, walks)
    told = []
    for number in range(COMMITS):
        doc.getObject("L0").ElementCount = 2 + number
        App.setActiveDocument(doc.Name)
        seen = len(boxes("BOM Updated"))
        saves.clear()
        walks.clear()
        pulse.start()
        begin = time.perf_counter()
        QtCore.QTimer.singleShot(0, lambda: Gui.runCommand("Origin_Commit"))
        spin(lambda seen=seen: len(boxes("BOM Updated")) > seen and settled())
        sent = 1e3 * (time.perf_counter() - begin)
        pulse.stop()
        told.append(
            {"save": total(saves), "snapshot": total(walks), "block": pulse.longest(), "sent": {"wall": sent}}
        )
    tell(commits=told)


def drawing(one: Any) -> None:
    """A commit with 10 000 findings, and 2000 events in one burst."""
    from silo.workbench.activity.box import EntryLine, PaneEntry
    from silo.workbench.tone import Tone

    lines = tuple(EntryLine(f"<b>finding</b> {number}", Tone.ERROR) for number in range(10_000))

    def draw() -> None:
        one.session.add(PaneEntry("big", "Big", time.time(), lines=lines))
        one._draw()
        QtWidgets.QApplication.processEvents()

    tell(box=clocked(draw))
    pulse = Pulse()
    pulse.start()
    for number in range(2000):
        entry = PaneEntry(f"e{number}", f"New item: M01-{number:04}", time.time())
        one.relay.post(lambda entry=entry: one.session.add(entry))
    spin(lambda: any(entry.key == "e1999" for entry in one.session.shown.activity.entries))
    end = time.perf_counter() + 0.5
    spin(lambda: time.perf_counter() > end)
    pulse.stop()
    tell(burst=pulse.longest())


def story() -> None:
    one = addon()
    one.preferences.set("AskComment", False)
    one.preferences.set("AskRegister", False)
    wait(lambda: one.session.shown.connection == "online")
    doc = App.openDocument(str(VAULT / "Top.FCStd"))
    one.dock.show_and_raise()
    rest()
    commits(one, doc)
    drawing(one)


inside.LONGEST_S = 170
run(story)
