# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: it is killed in the worst moment, and started again.

``SILO_TEST_KILL`` names the call of the client after which the process kills itself.
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


def kill_after(name: str) -> None:
    """The process dies right after the server has acted, before anybody here knows of it."""
    from silo.api.client import SiloClient

    original: Callable[..., Any] = getattr(SiloClient, name)

    def call(*arguments: Any, **more: Any) -> Any:
        original(*arguments, **more)
        os.kill(os.getpid(), signal.SIGKILL)

    setattr(SiloClient, name, call)


def first_run(one: Any) -> None:
    bolt = part("Bolt")
    top = assembly("Top", ("B1", bolt, 0), ("B2", bolt, 4))
    if KILL != "create_item":
        tell(numbers=register(bolt.Document, top.Document))
    App.setActiveDocument(top.Document.Name)
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


def second_run(one: Any) -> None:
    if (VAULT / "Top.FCStd").exists() and os.environ.get("SILO_TEST_REGISTER"):
        App.openDocument(str(VAULT / "Top.FCStd"))
        register_all(one)
    else:
        # Nothing is opened and nothing is pressed: it goes by itself.
        wait(lambda: boxes("BOM Updated") and settled())
        wait(lambda: not one.session.shown.waiting)
    tell(boxes=boxes("BOM Updated"), waiting=[w.label for w in one.session.shown.waiting])


def story() -> None:
    one = addon()
    one.preferences.set("AskComment", False)
    one.preferences.set("AskRegister", False)
    wait(lambda: one.session.shown.connection == "online")
    if KILL:
        first_run(one)
    else:
        second_run(one)


run(story)
