# SPDX-License-Identifier: LGPL-2.1-or-later
"""Other processors for one reading: processes that help to read part files and to measure shapes.

Helpers only make things faster. They get what is to be done as (function, arguments) and do it one after the
other; what a helper cannot do, because it crashed, has no memory left or was never ready, is done here
instead, so the result and the errors are those of one process. Only the process that reads has helpers, and
they end with it.

Each helper may use its share of the memory that the reading process may use. Each is a pool of one worker
(:func:`silo.platform.processes.workers`), for a worker that dies breaks its pool, and loses what that one had
begun.
"""

from __future__ import annotations

import os
import pickle
import tempfile
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import BrokenExecutor, Future, ThreadPoolExecutor
from contextlib import suppress
from itertools import count
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Self, TypeAlias, TypeVar

from silo.platform import limits, processes
from silo.platform.processes import processors
from silo.platform.whole_files import remove_patiently, scratch_folder

T = TypeVar("T")
R = TypeVar("R")

Task: TypeAlias = tuple[Callable[..., T], tuple[Any, ...]]
"""A function that a helper can import, and its arguments."""

LEAST_MB = 2000
"""Memory of a helper; with less, no helper is started."""

WORTH_HELP = 2_000_000
"""Bytes of geometry from where a second processor is worth its start."""

MOST = 7
"""Helpers of one reading; more of them wait for the disk and for each other."""

AHEAD = 2
"""Tasks that a helper has at once: the kernel keeps the interpreter while it works here, and a helper that
waits for its next task would wait as long. The last task of all is for who is free first."""


def helpers_for(processes: int, memory_mb: int) -> Helpers:
    """Make helpers, so that ``processes`` work in all; 0: as many as there are processors."""
    wanted = (processes or processors()) - 1
    fitting = memory_mb // LEAST_MB if memory_mb else wanted
    count = max(0, min(wanted, fitting, MOST))
    return Helpers(count, memory_mb // (count + 1))


class Helpers:
    """Processes that help; none by default, so that everything is done here."""

    def __init__(self, count: int = 0, memory_mb: int = 0) -> None:
        self.count = count
        self._memory_mb = memory_mb
        self._running: list[_Helper] = []
        self._folder: tempfile.TemporaryDirectory[str] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.end()
        if self._folder is not None:
            self._folder.cleanup()

    def folder(self) -> Path:
        """Return the folder for files that are exchanged with the helpers; it is deleted at the end."""
        if self._folder is None:
            self._folder = scratch_folder("silo-helpers-")
        return Path(self._folder.name)

    def start(self) -> bool:
        """Start them, without waiting; each start costs a second of processor time. False: there is none."""
        while len(self._running) < self.count:
            self._running.append(_Helper(Path(tempfile.mkdtemp(dir=self.folder())), self._memory_mb))
        return bool(self._running)

    def end(self) -> None:
        """End the helpers now; they can be started again."""
        for helper in self._running:
            helper.end()
        self._running.clear()

    def load_kernel(self) -> None:
        """Let every helper load the geometry kernel now, which takes it a second."""
        for helper in self._running:
            helper.one(_load_kernel, ())

    def begin(self, function: Callable[..., T], *arguments: Any) -> Callable[[], T]:
        """Let the first helper do one task; returns a function that gives the result."""
        if not self._running:
            return lambda: function(*arguments)
        begun = self._running[0].one(function, arguments)

        def result() -> T:
            outcome = begun.result()
            return function(*arguments) if outcome is None else outcome[0]

        return result

    def all(
        self,
        rows: Sequence[R],
        task: Callable[[R], Task[T]],
        done: Callable[[int, int], Any],
    ) -> list[T]:
        """Do the task of each row, here and in the helpers, and return the results in the order of the rows.

        task
            makes the task of a row, which any process can do.
        done
            called in this process with the number of begun tasks, and the total; its errors end everything.
        """
        results: dict[int, T] = {}
        waiting = deque(range(len(rows)))
        working = [helper.rows(rows, task, waiting, results) for helper in self._running]

        def here(row: R) -> T:
            function, arguments = task(row)
            return function(*arguments)

        while waiting:
            with suppress(IndexError):  # a helper took the last one
                number = waiting.popleft()
                done(number + 1, len(rows))
                results[number] = here(rows[number])
        for future in working:
            # A helper that is still loading the kernel has nothing left to do, so it is not waited for.
            if not future.cancel():
                future.result()
        return [results[n] if n in results else here(row) for n, row in enumerate(rows)]


class _Helper:
    """One process, and one thread here that waits for it: it does one thing after the other."""

    def __init__(self, folder: Path, memory_mb: int) -> None:
        self._files = (folder / str(number) for number in count())
        self._process = processes.workers(1, _begin, memory_mb)
        self._process.submit(int)  # it starts with the first task
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="helper")

    def one(self, function: Callable[..., T], arguments: tuple[Any, ...]) -> Future[tuple[T] | None]:
        """Let the helper call ``function``; the future's result is (result,), or None if the helper cannot do
        it.
        """

        def run() -> tuple[T] | None:
            answer: tuple[T] | None = None
            with suppress(BrokenExecutor):
                answer = _received(self._sent(function, arguments))
            return answer

        return self._thread.submit(run)

    def rows(
        self,
        rows: Sequence[R],
        task: Callable[[R], Task[T]],
        waiting: deque[int],
        results: dict[int, T],
    ) -> Future[None]:
        """Take rows from ``waiting`` until none is left, and put what they give into ``results``."""

        def run() -> None:
            taken: deque[tuple[int, Future[Path]]] = deque()
            while True:
                with suppress(IndexError, BrokenExecutor):
                    while not taken or (len(taken) < AHEAD and len(waiting) > 1):
                        number = waiting.popleft()
                        taken.append((number, self._sent(*task(rows[number]))))
                if not taken:
                    return
                number, sent = taken.popleft()
                if (answer := _received(sent)) is not None:
                    results[number] = answer[0]

        return self._thread.submit(run)

    def end(self) -> None:
        """End at once; the helper's present task is no longer needed."""
        processes.end_workers(self._process)
        self._thread.shutdown(wait=True, cancel_futures=True)

    def _sent(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Future[Path]:
        return self._process.submit(_answer, next(self._files), function, arguments)


def _received(sent: Future[Path]) -> Any:
    try:
        path = sent.result()
    except Exception:  # noqa: BLE001 - this process does it again, and reports what it meets
        return None
    noise, value = pickle.loads(path.read_bytes())
    remove_patiently(path)
    if noise:
        os.write(1, noise)  # what the kernel complains of is read there
    return (value,)


# --- in the helper ----------------------------------------------------------------------------------------


_noise: IO[bytes]
"""What the kernel prints in a helper."""


def _begin(memory_mb: int) -> None:
    global _noise
    limits.limit_this_process(memory=memory_mb * 1024**2)
    _noise = tempfile.TemporaryFile()  # noqa: SIM115 - open as long as the process
    os.dup2(_noise.fileno(), 1)


def _answer(path: Path, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Path:
    """Do one task. Its result goes into a file, since a pipe is full until the kernel lets its reader run."""
    value = function(*arguments)
    _noise.seek(0)
    printed = _noise.read()
    _noise.seek(0)
    _noise.truncate()
    path.write_bytes(pickle.dumps((printed, value)))
    return path


def _load_kernel() -> None:
    from silo.inertia.geometry.kernel import quiet, solids  # noqa: F401 - solids is what measures

    quiet()
