# SPDX-License-Identifier: LGPL-2.1-or-later
"""No garbage collection in our threads: what it destroys may be a window."""

from __future__ import annotations

import gc
import threading
from collections.abc import Iterator

import pytest

from silo.workbench.garbage import collect_due, collection_off
from silo.workbench.session.worker import Control, Job, Worker

WAIT_S = 300  # reached only if the test fails; a busy machine may need minutes


class Window:
    """Closed, and in a ring with itself: Python's collection destroys it, in the thread that collects."""

    def __init__(self, ended_in: list[threading.Thread]) -> None:
        self._ended_in, self._ring = ended_in, self

    def __del__(self) -> None:
        self._ended_in.append(threading.current_thread())


@pytest.fixture(autouse=True)
def _on() -> Iterator[None]:
    """Collections as often as can be, so that a forgotten guard shows at once."""
    before = gc.get_threshold()
    gc.collect()
    gc.enable()
    gc.set_threshold(20, 5, 5)
    yield
    gc.set_threshold(*before)
    assert gc.isenabled()


def busy(_control: Control) -> int:
    """As an import is: very many new objects that stay."""
    return len([[number] for number in range(5000)])


def test_a_worker_destroys_no_window() -> None:
    """What was closed before is destroyed in the GUI thread, though only the worker works."""
    ended: list[threading.Thread] = []
    done = threading.Event()
    worker = Worker("test", lambda call: call())
    with collection_off():
        Window(ended)
        worker.submit(Job("j", busy, done=lambda _count: done.set()))
        assert done.wait(WAIT_S)
        assert worker.close(WAIT_S)
        assert ended == []
    gc.collect()
    assert ended == [threading.main_thread()]


def test_a_job_works_without_collections_and_the_next_moment_has_them_again() -> None:
    """Also where the job fails."""
    seen: list[bool] = []

    def look(_control: Control) -> None:
        seen.append(gc.isenabled())
        raise ZeroDivisionError

    worker = Worker("test", lambda call: call())
    worker.submit(Job("j", look))
    while not worker.idle:
        pass
    assert worker.close(WAIT_S)
    assert seen == [False]
    assert gc.isenabled()


def test_several_threads_may_hold_it() -> None:
    """The last one that lets go switches it on."""
    with collection_off():
        with collection_off():
            assert not gc.isenabled()
        assert not gc.isenabled()
    assert gc.isenabled()


def test_who_switched_it_off_finds_it_off() -> None:
    """A script that measures, say."""
    gc.disable()
    try:
        with collection_off():
            pass
        assert not gc.isenabled()
    finally:
        gc.enable()


def test_what_is_due_is_collected_in_the_gui_thread() -> None:
    """Long work reports its progress there, so that garbage does not pile up meanwhile."""
    ended: list[threading.Thread] = []
    with collection_off():
        Window(ended)
        assert busy(Control(lambda _detail, _fraction: None)) == 5000
        kept = [[number] for number in range(100)]
        collect_due()
        assert ended == [threading.main_thread()]
        assert len(kept) == 100


def test_nothing_is_collected_that_python_looks_after_itself() -> None:
    """Outside a hold it is not our business."""
    gc.set_threshold(100_000, 5, 5)
    ended: list[threading.Thread] = []
    Window(ended)
    collect_due()
    assert ended == []
