# SPDX-License-Identifier: LGPL-2.1-or-later
"""Other processors for one reading: helper processes that read part files and measure shapes.

Helpers only make things faster. They get what is to be done as (function, arguments) and do it one after the
other; what a helper cannot do, because it crashed, has no memory left or was never ready, is done here
instead, so the result and the errors are those of one process. Only the process that reads has helpers, and
they end with it: their standard input closes.

Each helper may use its share of the memory that the reading process may use.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tempfile
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from itertools import count
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Self, TypeAlias, TypeVar

from silo import platform
from silo.durable import remove_patiently
from silo.folders import scratch_folder

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

_CODE = "from silo.inertia.geometry.helpers import main; main()"


def processors() -> int:
    """Those that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def helpers_for(processes: int, memory_mb: int) -> Helpers:
    """So many that there are ``processes`` in all; 0: as many as there are processors."""
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
        """A folder for what goes to and fro; taken away at the end."""
        if self._folder is None:
            self._folder = scratch_folder("silo-helpers-")
        return Path(self._folder.name)

    def start(self) -> bool:
        """Start them, without waiting; each start costs a second of processor time. False: there is none."""
        while len(self._running) < self.count:
            self._running.append(_Helper(Path(tempfile.mkdtemp(dir=self.folder())), self._memory_mb))
        return bool(self._running)

    def end(self) -> None:
        """End them now; they can be started again."""
        for helper in self._running:
            helper.end()
        self._running.clear()

    def load_kernel(self) -> None:
        """Have every helper load the geometry kernel now, which takes it a second."""
        for helper in self._running:
            helper.one(_load_kernel, ())

    def begin(self, function: Callable[..., T], *arguments: Any) -> Callable[[], T]:
        """Have one thing done by the first helper; gives the result when it is called."""
        if not self._running:
            return lambda: function(*arguments)
        begun = self._running[0].one(function, arguments)

        def result() -> T:
            found = begun.result()
            return function(*arguments) if found is None else found[0]

        return result

    def all(
        self,
        rows: Sequence[R],
        here: Callable[[R], T],
        there: Callable[[R], Task[T]],
        done: Callable[[int, int], Any],
    ) -> list[T]:
        """One result for each row, in order.

        here, there
            how a row is done in this process, and what a helper is sent of it.
        done
            called in this process with how many have begun, and the total; its errors end everything.
        """
        results: dict[int, T] = {}
        waiting = deque(range(len(rows)))
        working = [helper.rows(rows, there, waiting, results) for helper in self._running]
        while waiting:
            with suppress(IndexError):  # a helper took the last one
                number = waiting.popleft()
                done(number + 1, len(rows))
                results[number] = here(rows[number])
        for one in working:
            # One that is still loading the kernel has nothing to do any more, and nobody waits for it.
            if not one.cancel():
                one.result()
        return [results[n] if n in results else here(row) for n, row in enumerate(rows)]


class _Helper:
    """One process, and one thread here that talks to it: it does one thing after the other."""

    def __init__(self, folder: Path, memory_mb: int) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-u", "-c", _CODE, str(folder), str(memory_mb)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            **platform.child_options(),
        )
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="helper")

    def one(self, function: Callable[..., T], arguments: tuple[Any, ...]) -> Future[tuple[T] | None]:
        """(result,), or None where the helper cannot do it."""

        def run() -> tuple[T] | None:
            self._send(function, arguments)
            found: tuple[T] | None = self._receive()
            return found

        return self._thread.submit(run)

    def rows(
        self,
        rows: Sequence[R],
        there: Callable[[R], Task[T]],
        waiting: deque[int],
        results: dict[int, T],
    ) -> Future[None]:
        """Take rows from ``waiting`` until none is left, and put what they give into ``results``."""

        def run() -> None:
            taken: deque[int] = deque()
            while True:
                with suppress(IndexError):
                    while not taken or (len(taken) < AHEAD and len(waiting) > 1):
                        taken.append(waiting.popleft())
                        self._send(*there(rows[taken[-1]]))
                if not taken:
                    return
                found = self._receive()
                number = taken.popleft()
                if found is not None:
                    results[number] = found[0]
                elif self._process.poll() is not None:
                    return

        return self._thread.submit(run)

    def end(self) -> None:
        """At once: whatever it does is not needed any more."""
        self._process.kill()
        self._thread.shutdown(wait=True, cancel_futures=True)
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                with suppress(OSError):
                    stream.close()
        self._process.wait()

    def _send(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
        data = pickle.dumps((function, arguments))
        if self._process.stdin is not None:
            with suppress(OSError, ValueError):
                self._process.stdin.write(len(data).to_bytes(8, "little") + data)
                self._process.stdin.flush()

    def _receive(self) -> Any:
        if self._process.stdout is None:
            return None
        line = self._process.stdout.readline().rstrip(b"\n")
        if not line.startswith(b"done "):
            return None
        path = Path(os.fsdecode(line[5:]))
        noise, value = pickle.loads(path.read_bytes())
        remove_patiently(path)
        if noise:
            os.write(1, noise)  # what the kernel complains of is read there
        return (value,)


def _load_kernel() -> None:
    from silo.inertia.geometry.kernel import brep, occt  # noqa: F401 - brep is what measures

    occt.quiet()


def main() -> None:
    """A helper: read (function, arguments) from standard input, do it, answer; until the input ends."""
    folder, memory_mb = Path(sys.argv[1]), int(sys.argv[2])
    platform.limit_this_process(memory=memory_mb * 1024**2, cpu_s=0)
    tasks, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    with tempfile.TemporaryFile() as noise:
        os.dup2(noise.fileno(), 1)
        for number in count():
            head = tasks.read(8)
            if len(head) < 8:
                os._exit(0)
            task = tasks.read(int.from_bytes(head, "little"))
            try:
                function, arguments = pickle.loads(task)
                value = function(*arguments)
                path = folder / f"{number}"
                path.write_bytes(pickle.dumps((_said(noise), value)))
                answers.write(b"done " + os.fsencode(path) + b"\n")
            except Exception:  # noqa: BLE001 - the process that reads does it again, and reports what it meets
                answers.write(b"failed\n")
            answers.flush()


def _said(noise: IO[bytes]) -> bytes:
    sys.stdout.flush()
    noise.seek(0)
    text = noise.read()
    noise.seek(0)
    noise.truncate()
    return text
