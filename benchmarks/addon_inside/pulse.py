# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: every moment in which the window could not react."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from inside import QtCore, QtWidgets


@dataclass(frozen=True)
class Times:
    """The clock on the wall, and the processor time of the GUI's thread; seconds."""

    wall: float
    cpu: float

    @classmethod
    def now(cls) -> Times:
        return cls(time.perf_counter(), time.thread_time())


class Pulse:
    """A timer of 1 ms in the GUI thread; where it comes late, the window could not react.

    What other programs take from the processors makes it late as well. So each gap is also told in processor
    time of the GUI's thread; waiting for a lock is not in that.
    """

    def __init__(self) -> None:
        self._beats: list[Times] = []
        self._known: list[tuple[Times, Times]] = []
        self._timer = QtCore.QTimer()
        self._timer.timeout.connect(lambda: self._beats.append(Times.now()))

    def start(self) -> None:
        """Begin to measure."""
        self._beats, self._known = [Times.now()], []
        self._timer.start(1)

    def stop(self) -> None:
        """End."""
        self._timer.stop()

    def longest(self) -> dict[str, float]:
        """The longest gap in ms, without what is known of."""
        return {
            "wall": max((self._gap(a, b, "wall") for a, b in pairwise(self._beats)), default=0.0),
            "cpu": max((self._gap(a, b, "cpu") for a, b in pairwise(self._beats)), default=0.0),
        }

    def _gap(self, before: Times, after: Times, kind: str) -> float:
        first, last = getattr(before, kind), getattr(after, kind)
        known = sum(
            max(0.0, min(getattr(end, kind), last) - max(getattr(begin, kind), first))
            for begin, end in self._known
        )
        return 1e3 * (last - first - known)

    def timed(self, call: Callable[..., Any], into: list[Times]) -> Callable[..., Any]:
        """The call, with its time in ms noted in ``into``, and known."""

        def timed(*arguments: Any) -> Any:
            begin = Times.now()
            try:
                return call(*arguments)
            finally:
                end = Times.now()
                self._known.append((begin, end))
                into.append(Times(1e3 * (end.wall - begin.wall), 1e3 * (end.cpu - begin.cpu)))

        return timed


def total(times: list[Times]) -> dict[str, float]:
    """All of them together."""
    return {"wall": sum(one.wall for one in times), "cpu": sum(one.cpu for one in times)}


def clocked(call: Callable[[], Any]) -> dict[str, float]:
    """What one call takes, in ms."""
    begin = Times.now()
    call()
    end = Times.now()
    return {"wall": 1e3 * (end.wall - begin.wall), "cpu": 1e3 * (end.cpu - begin.cpu)}


def rest() -> None:
    """Let FreeCAD draw what it has just opened, which is none of ours."""
    end = time.monotonic() + 4
    spin(lambda: time.monotonic() > end)


def spin(reached: Callable[[], Any], seconds: float = 120) -> None:
    """Let FreeCAD work as its own loop does: no sleeping in between, that would look like a block."""
    end = time.monotonic() + seconds
    flags = QtCore.QEventLoop.ProcessEventsFlag
    while not reached():
        QtWidgets.QApplication.processEvents(flags.AllEvents | flags.WaitForMoreEvents, 50)
        if time.monotonic() > end:
            raise TimeoutError
