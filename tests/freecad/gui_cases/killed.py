# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: it is killed in the worst moment, and started again.

``SILO_TEST_TASKS`` says what is done first; ``SILO_TEST_KILL`` names the call of the client after which the
process kills itself.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from typing import Any

sys.path.insert(0, os.environ["SILO_TEST_CASES"])

from inside import VAULT, App, Gui, addon, assembly, boxes, part, register, run, settled, tell, wait

KILL = os.environ.get("SILO_TEST_KILL", "")
TASKS = os.environ.get("SILO_TEST_TASKS", "").split()


def kill_after(name: str) -> None:
    """The process dies right after the server has acted, before anybody here knows of it."""
    from silo.api.client import SiloClient

    original: Callable[..., Any] = getattr(SiloClient, name)

    def call(*arguments: Any, **more: Any) -> Any:
        original(*arguments, **more)
        os.kill(os.getpid(), signal.SIGKILL)

    setattr(SiloClient, name, call)


def die(one: Any) -> None:
    if KILL == "upload_file":
        bolt = part("Bolt")
        top = assembly("Top", ("B1", bolt, 0), ("B2", bolt, 4)).Document
        tell(numbers=register(bolt.Document, top))
    elif KILL == "merge_bom":
        top = App.openDocument(str(VAULT / "Top.FCStd"))
        top.getObject("B2").ElementCount = 6
        top.recompute()
    else:
        top = assembly("Frame", ("N", part("Nut"), 0)).Document
    App.setActiveDocument(top.Name)
    kill_after(KILL)
    if KILL == "create_item":
        register_all(one)
    else:
        Gui.runCommand("Origin_Commit")
    wait(lambda: False)


def register_all(one: Any) -> None:
    Gui.runCommand("Silo_RegisterParts")
    dialog = wait(lambda: next(iter(one.registrations._open.values()), None))
    wait(lambda: dialog.rows)
    tell(rows=[row.component() for row in dialog.rows], notes=[row.note()[0] for row in dialog.rows])
    dialog.register_button.click()
    wait(lambda: all(row.finished for row in dialog.rows) and settled())
    wait(lambda: boxes("BOM Updated") and settled())


def finish(one: Any) -> None:
    """Nothing is opened and nothing is pressed: it goes by itself."""
    wait(lambda: boxes("BOM Updated") and settled())
    wait(lambda: not one.session.shown.waiting)
    tell(boxes=boxes("BOM Updated"), waiting=[w.label for w in one.session.shown.waiting])


def story() -> None:
    one = addon()
    one.preferences.set("AskComment", False)
    one.preferences.set("AskRegister", False)
    wait(lambda: one.session.shown.connection == "online")
    if "finish" in TASKS:
        finish(one)
    if "register" in TASKS:
        App.openDocument(str(VAULT / "Frame.FCStd"))
        register_all(one)
    if KILL:
        die(one)


run(story)
