# SPDX-License-Identifier: LGPL-2.1-or-later
"""The worker: one thread, jobs in order, results where they are wanted."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from silo.bom.errors import CancelledError, InputError, PackageError, SiloError
from silo.workbench.session.worker import Busy, Control, Job, Worker

WAIT_S = 300  # reached only if the test fails; a busy machine may need minutes


class Gui:
    """Stands for the GUI thread: runs what was delivered when the test asks for it."""

    def __init__(self) -> None:
        self.calls: queue.Queue[Callable[[], None]] = queue.Queue()

    def run_until(self, reached: Callable[[], bool]) -> None:
        while not reached():
            self.calls.get(timeout=WAIT_S)()


@pytest.fixture(name="gui")
def _gui() -> Gui:
    return Gui()


@pytest.fixture(name="busy")
def _busy() -> list[Busy | None]:
    return []


@pytest.fixture(name="bugs")
def _bugs() -> list[BaseException]:
    return []


@pytest.fixture(name="worker")
def _worker(gui: Gui, busy: list[Busy | None], bugs: list[BaseException]) -> Iterator[Worker]:
    worker = Worker("test", gui.calls.put, on_busy=busy.append, on_bug=bugs.append)
    yield worker
    worker.close(WAIT_S)


def test_jobs_are_done_in_order_and_in_one_other_thread(worker: Worker, gui: Gui) -> None:
    """Results are handed over, never called from the worker."""
    done: list[tuple[int, str]] = []

    def job(number: int) -> Job:
        return Job(
            "j", lambda _c: threading.current_thread().name, done=lambda name: done.append((number, name))
        )

    for number in range(20):
        worker.submit(job(number))
    gui.run_until(lambda: len(done) == 20)
    assert done == [(number, "test") for number in range(20)]


def test_a_failure_is_reported_and_the_next_job_runs(worker: Worker, gui: Gui) -> None:
    """One bad job does not end the thread for all others."""
    told: list[Any] = []

    def fail(_control: Control) -> None:
        raise InputError("wrong")

    worker.submit(Job("bad", fail, failed=told.append))
    worker.submit(Job("good", lambda _c: "fine", done=told.append))
    gui.run_until(lambda: len(told) == 2)
    assert isinstance(told[0], InputError)
    assert told[1] == "fine"


def test_a_bug_is_reported_in_one_plain_sentence(worker: Worker, gui: Gui, bugs: list[BaseException]) -> None:
    """The exception goes to those who look for causes, the sentence to the person."""
    told: list[SiloError] = []

    def bug(_control: Control) -> None:
        raise KeyError("oops")

    worker.submit(Job("Sending", bug, failed=told.append))
    gui.run_until(lambda: bool(told))
    assert str(told[0]) == "Sending: unexpected problem (KeyError: 'oops')"
    assert isinstance(bugs[0], KeyError)


@pytest.mark.parametrize(("name", "is_bug"), [("pydantic_core._pydantic_core", False), ("silo.gone", True)])
def test_a_package_that_cannot_be_imported_is_no_bug(
    worker: Worker, gui: Gui, bugs: list[BaseException], name: str, is_bug: bool
) -> None:
    """Installing it mends that, and the sentence names it."""
    told: list[SiloError] = []

    def lack(_control: Control) -> None:
        raise ImportError("wrong version", name=name)

    worker.submit(Job("Connecting", lack, failed=told.append))
    gui.run_until(lambda: bool(told))
    assert isinstance(told[0], PackageError)
    assert f"package {name.partition('.')[0]}: wrong version" in str(told[0])
    assert bool(bugs) == is_bug


def test_progress_is_reported(worker: Worker, gui: Gui, busy: list[Busy | None]) -> None:
    """Title, detail and fraction while it runs, None when nothing is left."""
    worker.submit(Job("Sending", lambda control: control.progress("a.FCStd", 0.5)))
    gui.run_until(lambda: bool(busy) and busy[-1] is None)
    assert busy == [Busy("Sending"), Busy("Sending", "a.FCStd", 0.5), None]


def test_a_running_job_can_be_stopped_and_waiting_ones_stay(worker: Worker, gui: Gui) -> None:
    """Stop ends what runs now, nothing else."""
    started = threading.Event()
    told: list[Any] = []

    def long(control: Control) -> None:
        started.set()
        assert control.cancelled.wait(WAIT_S)
        control.check()

    worker.submit(Job("long", long, failed=told.append))
    worker.submit(Job("next", lambda _c: "done", done=told.append))
    assert started.wait(WAIT_S)
    worker.cancel()
    gui.run_until(lambda: len(told) == 2)
    assert isinstance(told[0], CancelledError)
    assert told[1] == "done"


def test_an_equal_job_that_waits_already_is_not_queued_twice(worker: Worker, gui: Gui) -> None:
    """But one that runs already may have looked too early, so the next one is queued."""
    started, go = threading.Event(), threading.Event()
    runs: list[int] = []

    def send(_control: Control) -> None:
        started.set()
        assert go.wait(WAIT_S)

    def job() -> Job:
        return Job("send", send, done=lambda _r: runs.append(1), same_as="send")

    assert worker.submit(job())
    assert started.wait(WAIT_S)
    assert worker.submit(job())
    assert not worker.submit(job())
    go.set()
    gui.run_until(lambda: len(runs) == 2)
    assert worker.left(WAIT_S) == 0


@pytest.mark.parametrize("refused", [False, True])
def test_a_worker_is_idle_once_the_end_of_its_job_was_handed_over(refused: bool) -> None:
    """Not before: who waits for it to be idle, and for an empty queue of calls, would miss that end."""
    idle: list[bool] = []
    worker = Worker("test", lambda call: call())

    def run(_control: Control) -> None:
        if refused:
            raise InputError("no")

    def end(_what: object) -> None:
        idle.append(worker.idle)

    worker.submit(Job("one", run, done=end, failed=end))
    assert worker.left(WAIT_S) == 0
    assert idle == [False]
    assert worker.close(WAIT_S)


def test_after_close_nothing_is_taken(worker: Worker) -> None:
    """And closing twice, or before the first job, is harmless."""
    assert worker.close()
    assert not worker.submit(Job("late", lambda _c: None))
    assert worker.close()


def test_close_ends_a_running_job() -> None:
    """FreeCAD's end does not wait for a server."""
    started = threading.Event()

    def long(control: Control) -> None:
        started.set()
        control.cancelled.wait(WAIT_S)

    worker = Worker("test", lambda _call: None)
    worker.submit(Job("long", long))
    assert started.wait(WAIT_S)
    assert worker.close(WAIT_S)
