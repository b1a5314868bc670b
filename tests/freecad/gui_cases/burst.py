# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: several commits before the first one has arrived; a page without a browser.

Then FreeCAD is closed amid further commits; the next start sends those.
"""

from __future__ import annotations

import os
import sys
from typing import Any

sys.path.insert(0, os.environ["SILO_TEST_CASES"])

from inside import (
    App,
    Gui,
    QtWidgets,
    addon,
    ask,
    assembly,
    link,
    pane,
    part,
    register,
    run,
    settled,
    tell,
    wait,
)

TIMES, CLOSED = 5, 6
FILLING = "x" * 1000
SECOND = bool(os.environ.get("SILO_TEST_SECOND"))


def burst(one: Any, top: Any, bolt: Any) -> None:
    """Edit, commit, edit, commit … without a look at what became of it."""
    for number in range(TIMES):
        if number:
            link(top, f"More{number}", bolt)
        App.setActiveDocument(top.Document.Name)
        Gui.runCommand("Origin_Commit")
    tell(running=one.commits.running)
    wait(lambda: not one.commits.running and settled() and not one.session.shown.waiting)


def one_after_the_other(one: Any, top: Any, bolt: Any) -> None:
    """The same while nothing can be sent: each is a state of its own, and none is left out."""
    ask("server down")
    wait(lambda: one.session.shown.connection == "offline")
    for number in range(3):
        link(top, f"Offline{number}", bolt)
        App.setActiveDocument(top.Document.Name)
        Gui.runCommand("Origin_Commit")
        wait(lambda number=number: len(one.session.shown.waiting) > number and settled())
    tell(waiting=len(one.session.shown.waiting))
    ask("server up")
    one.session.retry_all()
    wait(lambda: settled() and not one.session.shown.waiting)


def told() -> list[str]:
    """The boxes of our commits, oldest first; the bolt goes along with the first of them."""
    ours = [box for box in reversed(pane()) if box.startswith(("BOM Updated", "Committed"))]
    return [box for box in ours if "Bolt" not in box.splitlines()[0]]


def page(one: Any) -> None:
    """Without a browser the address is on the clipboard; another server's page is not opened at all."""
    from silo.workbench.gui import qt

    asked: list[str] = []

    def no_browser(url: str) -> bool:
        asked.append(url)
        return False

    qt.open_url = no_browser
    clipboard = QtWidgets.QApplication.clipboard()
    one.buttons.open_page("https://example.org/items/A01-0001/bom")
    one.buttons.open_page("javascript:alert(1)//")
    one.buttons.open_page("file:///etc/passwd")
    one.buttons.open_page(os.environ["SILO_API_URL"] + "/items/A01-0001/bom")
    tell(asked=asked, copied=clipboard.text())


def close(one: Any) -> None:
    """Edit and commit part after part, then close, in one event: nothing had its turn yet."""
    made = [part(f"P{number}") for number in range(CLOSED)]
    tell(closed=register(*(box.Document for box in made)))
    for box in made:
        box.Length = 20
        box.Label2 = FILLING
        box.Document.recompute()
        App.setActiveDocument(box.Document.Name)
        Gui.runCommand("Origin_Commit")
    tell(closed_running=one.commits.running)
    Gui.getMainWindow().close()


def story() -> None:
    one = addon()
    one.preferences.set("AskComment", False)
    one.preferences.set("AskRegister", False)
    if SECOND:
        wait(lambda: one.session.shown.connection == "online")
        wait(lambda: settled() and not one.session.shown.waiting)
        tell(done=True)
        return
    bolt = part("Bolt")
    top = assembly("Top", ("B1", bolt, 0))
    numbers = register(bolt.Document, top.Document)
    wait(lambda: one.session.shown.connection == "online")
    burst(one, top, bolt)
    tell(numbers=numbers, first=told())
    one_after_the_other(one, top, bolt)
    tell(boxes=told())
    page(one)
    close(one)


run(story, closes=not SECOND)
