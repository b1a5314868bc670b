# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: it ends in the worst moment, three times; ``SILO_TEST_START`` counts the starts.

First it is closed amid commits. Then it is killed right after the server has merged, before anybody here
knows of that. At last it is only started.
"""

from __future__ import annotations

import os
import signal
from typing import Any

from inside import App, Gui, assembly, boxes, part, ready, register, run, settled, tell, wait

CLOSED = 6
FILLING = "x" * 1000


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


def die(_one: Any) -> None:
    from silo.api.client import SiloClient

    merge = SiloClient.merge_bom

    def merge_and_die(*arguments: Any, **more: Any) -> Any:
        merge(*arguments, **more)
        os.kill(os.getpid(), signal.SIGKILL)

    SiloClient.merge_bom = merge_and_die
    bolt = part("Bolt")
    top = assembly("Top", ("B1", bolt, 0), ("B2", bolt, 4)).Document
    tell(numbers=register(bolt.Document, top))
    App.setActiveDocument(top.Name)
    Gui.runCommand("Origin_Commit")
    wait(lambda: False)


def finish(one: Any) -> None:
    """Nothing is opened and nothing is pressed: it goes by itself."""
    wait(lambda: boxes("BOM Updated") and settled() and not one.session.shown.waiting)
    tell(boxes=boxes("BOM Updated"))


START = int(os.environ["SILO_TEST_START"])


def story() -> None:
    one = ready()
    if START:
        wait(lambda: settled() and not one.session.shown.waiting)
    (close, die, finish)[START](one)


run(story, closes=START == 0)
