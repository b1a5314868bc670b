# SPDX-License-Identifier: LGPL-2.1-or-later
"""One worker thread with a queue: work that must not hold up the GUI, done in order.

A job is a function and what to do with its result. The function runs in the worker and must not touch
documents or widgets; ``done`` and ``failed`` are handed to ``deliver``, which in FreeCAD runs them in the GUI
thread (:class:`silo.workbench.gui.qt.Relay`), and in the tests wherever the test likes.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from silo.bom.message import message
from silo.workbench.garbage import collection_off

if TYPE_CHECKING:
    from silo.bom.errors import SiloError


Deliver = Callable[[Callable[[], None]], None]


@dataclass(frozen=True)
class Busy:
    """What a worker is doing, for a progress bar. ``fraction`` is None if it is unknown."""

    title: str
    detail: str = ""
    fraction: float | None = None
    waiting: int = 0


class Control:
    """A running job's way to the outside: report progress, and learn that it should stop."""

    def __init__(self, tell: Callable[[str, float | None], None]) -> None:
        self.cancelled = threading.Event()
        self._tell = tell

    def progress(self, detail: str = "", fraction: float | None = None) -> None:
        """Report how far the job is."""
        self._tell(detail, fraction)

    def check(self) -> None:
        """Raise :class:`CancelledError` if somebody asked the job to stop."""
        from silo.bom.errors import CancelledError  # late: FreeCAD's start waits for this module

        if self.cancelled.is_set():
            raise CancelledError("stopped")


@dataclass(frozen=True)
class Job:
    """Work for the worker; ``done`` gets what ``run`` returned, ``failed`` the error that ended it."""

    title: str
    run: Callable[[Control], Any]
    done: Callable[[Any], None] = lambda _result: None
    failed: Callable[[SiloError], None] = lambda _error: None
    # A job that asks for something which another one, still waiting, will bring anyway is not queued twice.
    same_as: str = ""


class Worker:
    """A thread that does jobs one after another.

    deliver
        runs a function where the results are wanted.
    on_busy
        told (through ``deliver``) whenever there is something new to show; None when idle.
    on_bug
        gets exceptions that are no :class:`SiloError`; the job then ends with a plain sentence.
    """

    def __init__(
        self,
        name: str,
        deliver: Deliver,
        *,
        on_busy: Callable[[Busy | None], None] = lambda _busy: None,
        on_bug: Callable[[BaseException], None] = lambda _error: None,
    ) -> None:
        self._name = name
        self._deliver = deliver
        self._on_busy = on_busy
        self._on_bug = on_bug
        self._change = threading.Condition()
        self._thread: threading.Thread | None = None
        self._current: tuple[Job, Control] | None = None
        self._waiting: deque[tuple[Job, Control]] = deque()
        self._closed = False

    def submit(self, job: Job) -> bool:
        """Queue a job; False if an equal one (``same_as``) waits already, or the worker is closed."""
        with self._change:
            twice = job.same_as and any(other.same_as == job.same_as for other, _ in self._waiting)
            if twice or self._closed:
                return False
            control = Control(lambda detail, fraction: self._tell(job, detail, fraction))
            self._waiting.append((job, control))
            if self._thread is None:
                # A daemon: a server that does not answer must not keep FreeCAD from closing.
                self._thread = threading.Thread(target=self._work, name=self._name, daemon=True)
                self._thread.start()
            self._change.notify_all()
        return True

    def cancel(self) -> None:
        """Ask the running job to stop. Jobs that wait are kept."""
        with self._change:
            if self._current is not None:
                self._current[1].cancelled.set()

    def left(self, seconds: float = 0.0) -> int:
        """Wait at most so many seconds until no job remains, and return how many run or wait."""
        with self._change:
            self._change.wait_for(lambda: self._current is None and not self._waiting, seconds)
            return len(self._waiting) + (self._current is not None)

    def close(self, timeout: float = 1.0) -> bool:
        """Ask the running job to end, and drop the waiting ones. Returns True if the thread has ended."""
        with self._change:
            self._closed = True
            self._waiting.clear()
            if self._current is not None:
                self._current[1].cancelled.set()
            thread = self._thread
            self._change.notify_all()
        if thread is not None:
            thread.join(timeout)
        return thread is None or not thread.is_alive()

    @property
    def idle(self) -> bool:
        """Return True if no job runs or waits, and the end of each job was handed to ``deliver``."""
        return not self.left()

    def _next(self) -> tuple[Job, Control] | None:
        with self._change:
            self._change.wait_for(lambda: self._waiting or self._closed)
            self._current = self._waiting.popleft() if self._waiting else None
            return self._current

    def _work(self) -> None:
        while (queued := self._next()) is not None:
            self._tell(queued[0], "", None)
            with collection_off():
                # Passed on before the worker counts as idle: a caller that waits for that must not miss it.
                self._deliver(self._finish(*queued))
            with self._change:
                self._current = None
                left = len(self._waiting)
                self._change.notify_all()
            if not left:
                self._deliver(lambda: self._on_busy(None))

    def _finish(self, job: Job, control: Control) -> Callable[[], None]:
        from silo.bom.errors import PackageError, SiloError

        failure: SiloError
        try:
            result = job.run(control)
        except SiloError as error:
            failure = error
        except ImportError as error:
            name = (error.name or str(error)).partition(".")[0]
            failure = PackageError(
                message("FreeCAD's Python cannot import the package {name}: {error}", name=name, error=error)
            )
            if name == "silo":
                self._on_bug(error)
        except Exception as error:  # noqa: BLE001  # a bug in one job must not end the thread for all others
            self._on_bug(error)
            failure = SiloError(
                message(
                    "{title}: unexpected problem ({name}: {error})",
                    title=job.title,
                    name=type(error).__name__,
                    error=error,
                )
            )
        else:
            return lambda: job.done(result)
        return lambda: job.failed(failure)

    def _tell(self, job: Job, detail: str, fraction: float | None) -> None:
        busy = Busy(job.title, detail, fraction, len(self._waiting))
        self._deliver(lambda: self._on_busy(busy))


def in_gui(deliver: Deliver, call: Callable[[], Any], control: Control) -> Any:
    """Run ``call`` in the GUI thread for a job; wait, and return or raise what it returns or raises."""
    from silo.bom.errors import SiloError

    finished = threading.Event()
    result: list[Any] = []
    problem: list[BaseException] = []

    def run() -> None:
        try:
            result.append(call())
        except BaseException as error:
            problem.append(error)
            if not isinstance(error, SiloError):
                raise
        finally:
            finished.set()

    deliver(run)
    while not finished.wait(0.2):
        # A user who closes FreeCAD, or presses Stop, must not wait for the GUI thread to have time.
        control.check()
    if problem:
        raise problem[0]
    return result[0]
