# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: commit a large assembly, and note every moment in which the window could not react."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from itertools import pairwise
from typing import Any

sys.path.insert(0, os.environ["SILO_TEST_CASES"])

from inside import VAULT, App, Gui, QtCore, QtWidgets, addon, boxes, register, run, settled, tell, wait

LINKS, PARTS = int(os.environ["SILO_BENCH_LINKS"]), int(os.environ["SILO_BENCH_PARTS"])


class Pulse:
    """A timer of 1 ms in the GUI thread; where it comes late, the window could not react."""

    def __init__(self) -> None:
        self.beats: list[float] = []
        self.known: list[tuple[float, float]] = []
        self._timer = QtCore.QTimer()
        self._timer.timeout.connect(lambda: self.beats.append(time.perf_counter()))

    def start(self) -> None:
        self.beats = [time.perf_counter()]
        self.known = []
        self._timer.start(1)

    def stop(self) -> None:
        self._timer.stop()

    def longest(self) -> float:
        """The longest gap in ms, without what is known of."""
        gaps = []
        for before, after in pairwise(self.beats):
            taken = sum(max(0.0, min(e, after) - max(b, before)) for b, e in self.known)
            gaps.append(after - before - taken)
        return 1e3 * max(gaps, default=0.0)

    def timed(self, call: Callable[..., Any], into: list[float]) -> Callable[..., Any]:
        """The call, with its time noted as known."""

        def timed(*arguments: Any) -> Any:
            begin = time.perf_counter()
            try:
                return call(*arguments)
            finally:
                end = time.perf_counter()
                self.known.append((begin, end))
                into.append(1e3 * (end - begin))

        return timed


def spin(reached: Callable[[], Any]) -> None:
    """Let FreeCAD work as its own loop does: no sleeping in between, that would look like a block."""
    end = time.monotonic() + 120
    while not reached():
        flags = QtCore.QEventLoop.ProcessEventsFlag
        QtWidgets.QApplication.processEvents(flags.AllEvents | flags.WaitForMoreEvents, 50)
        if time.monotonic() > end:
            raise TimeoutError


def make() -> Any:
    parts = []
    for number in range(PARTS):
        doc = App.newDocument(f"Part{number}", hidden=True)
        box = doc.addObject("Part::Box", "Box")
        doc.saveAs(str(VAULT / f"Part{number}.FCStd"))
        parts.append(box)
    doc = App.newDocument("Top")
    made = doc.addObject("App::Part", "Assembly")
    made.Type = "Assembly"
    doc.saveAs(str(VAULT / "Top.FCStd"))
    links = []
    for number in range(LINKS):
        link = doc.addObject("App::Link", f"L{number}")
        link.LinkedObject = parts[number % PARTS]
        links.append(link)
    made.Group = links
    register(*(part.Document for part in parts), doc)
    return doc


def story() -> None:
    one = addon()
    one.preferences.set("AskComment", False)
    one.preferences.set("AskRegister", False)
    wait(lambda: one.session.shown.connection == "online")
    doc = make()
    wait(settled)
    one.dock.show_and_raise()
    from silo.workbench import commit_flow

    pulse, saves, walks = Pulse(), [], []
    commit_flow.LiveDocuments.save = staticmethod(pulse.timed(commit_flow.saving.save, saves))
    one.commits._taker = commit_flow.Taker(
        commit_flow.LiveDocuments(),
        pulse.timed(commit_flow.take_snapshot, walks),
        one.session.spool.hold,
        commit_flow.new_key,
    )
    # The second commit counts: the first one imports modules, which is done once per FreeCAD.
    for number in range(2):
        doc.getObject("L0").ElementCount = 2 + number
        App.setActiveDocument(doc.Name)
        seen = len(boxes("BOM Updated"))
        saves.clear()
        walks.clear()
        pulse.start()
        begin = time.perf_counter()
        QtCore.QTimer.singleShot(0, lambda: Gui.runCommand("Origin_Commit"))
        spin(lambda seen=seen: len(boxes("BOM Updated")) > seen and settled())
        tell(sent=1e3 * (time.perf_counter() - begin))
        pulse.stop()
        tell(save=sum(saves), snapshot=sum(walks), block=pulse.longest(), first=[number, pulse.longest()])
    drawing(one, pulse)


def drawing(one: Any, pulse: Pulse) -> None:
    from silo.workbench.activity import Entry, Line, Tone

    lines = tuple(Line(f"<b>finding</b> {number}", Tone.ERROR) for number in range(10_000))
    begin = time.perf_counter()
    one.session.add(Entry("big", "Big", time.time(), lines=lines))
    one._draw()
    QtWidgets.QApplication.processEvents()
    tell(box=1e3 * (time.perf_counter() - begin))
    pulse.start()
    for number in range(2000):
        entry = Entry(f"e{number}", f"New item: M01-{number:04}", time.time())
        one.relay.post(lambda entry=entry: one.session.add(entry))
    spin(lambda: one.session.shown.activity.get("e1999") is not None)
    end = time.perf_counter() + 0.5
    spin(lambda: time.perf_counter() > end)
    pulse.stop()
    tell(burst=pulse.longest())


run(story)
