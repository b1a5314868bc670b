# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a running command does now, on standard error: after 5 seconds, then every 10."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Self

from silo import spoken
from silo.bom.message import message

if TYPE_CHECKING:
    from silo.outbox.entry import Entry


class ProgressPrinter:
    """Prints on standard error what a command does, after 5 seconds and then every 10.

    A thread prints it, so that a long step is reported too. An empty ``step`` is silence, for commands that
    wait for a decision.
    """

    def __init__(self, command: str, clock: Callable[[], float] = time.monotonic) -> None:
        self.step = "working"
        self._command, self._clock, self._begun = command, clock, clock()
        self._due, self._ended = self._begun + 5, threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._ended.wait(0.2):
            self.report()

    def report(self) -> None:
        """Print the step if it is time."""
        now = self._clock()
        if now >= self._due:
            self._due = now + 10
            if self.step:
                from silo.cli.terminal import plain

                text = plain(
                    message(
                        "silo-mod {command}: {step}, {begun} s",
                        command=self._command,
                        step=spoken(self.step),
                        begun=f"{now - self._begun:.0f}",
                    )
                )
                print(text, file=sys.stderr, flush=True)


_running: list[ProgressPrinter] = []


@contextmanager
def progress_of(command: str) -> Iterator[None]:
    """Report the progress of a command until the block ends."""
    with ProgressPrinter(command) as progress:
        _running.append(progress)
        try:
            yield
        finally:
            _running.remove(progress)


def set_step(step: str) -> None:
    """Set the text for what the running command does now."""
    for progress in _running[-1:]:
        progress.step = step


def set_sending_step(entry: Entry, done: int, total: int) -> None:
    """Set that a file of the queue is being sent; both counts in bytes."""
    set_step(
        message(
            "sending {file_name}, {total} %",
            file_name=entry.label or entry.file_name,
            total=done * 100 // max(total, 1),
        )
    )


def count_steps(count: int) -> Callable[[str], None]:
    """Return a function that shows the next of ``count`` steps, by its name; a name counts once."""
    seen: dict[str, None] = {}

    def show(name: str) -> None:
        seen.setdefault(name)
        set_step(f"[{len(seen)}/{max(count, len(seen))}] {name}")

    return show
