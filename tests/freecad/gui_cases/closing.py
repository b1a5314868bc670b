# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: many commits, and the window is closed at once; the next start sends what was committed."""

from __future__ import annotations

import os
import sys
import traceback
from typing import Any

sys.path.insert(0, os.environ["SILO_TEST_CASES"])

from inside import FOLDER, App, Gui, QtCore, addon, part, register, run, settled, tell, wait

TIMES = 6
# Some megabytes each, so that the copies take a moment.
FILLING = "x" * 1000


def ready(one: Any) -> None:
    one.preferences.set("AskComment", False)
    one.preferences.set("AskRegister", False)
    wait(lambda: one.session.shown.connection == "online")


def many(one: Any) -> None:
    """Edit and commit part after part, then close, in one event: nothing had its turn yet."""
    boxes = [part(f"P{number}") for number in range(TIMES)]
    numbers = register(*(box.Document for box in boxes))
    tell(numbers=numbers)
    for box in boxes:
        box.Length = 20
        box.Label2 = FILLING
        box.Document.recompute()
        App.setActiveDocument(box.Document.Name)
        Gui.runCommand("Origin_Commit")
    tell(running=one.commits.running)
    Gui.getMainWindow().close()


def first() -> None:
    """As a person would: FreeCAD ends by itself, and not by our hand."""
    try:
        wait(lambda: addon() is not None)
        ready(addon())
        many(addon())
    except BaseException:  # noqa: BLE001  # whatever it is, the test has to hear of it
        (FOLDER / "trace.txt").write_text(traceback.format_exc())
        os._exit(1)


def second() -> None:
    one = addon()
    ready(one)
    wait(lambda: settled() and not one.session.shown.waiting)
    tell(done=True)


if os.environ.get("SILO_TEST_CLOSE"):
    QtCore.QTimer.singleShot(500, first)
else:
    run(second)
