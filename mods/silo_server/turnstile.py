# SPDX-License-Identifier: LGPL-2.1-or-later
"""A bounded queue before something scarce: the database's writers, the memory that a password hash needs."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from silo.bom.errors import BusyError


class Turnstile:
    """Lets ``places`` threads in at once; ``waiting`` more wait, each at most ``seconds``; the rest go away.

    who
        what those inside do, for the message of the BusyError (503) that the others get.
    """

    def __init__(self, places: int, waiting: int, seconds: float, who: str) -> None:
        self._free = threading.Semaphore(places)
        self._room = places + waiting
        self._here = 0
        self._lock = threading.Lock()
        self._seconds = seconds
        self._who = who

    @contextmanager
    def enter(self) -> Iterator[None]:
        """Inside until the block ends. Raises BusyError; then nothing was done."""
        with self._lock:
            if self.full:
                raise BusyError(f"too many {self._who} are waiting; nothing was changed, try again later")
            self._here += 1
        try:
            if not self._free.acquire(timeout=self._seconds):
                raise BusyError(
                    f"other {self._who} took longer than {self._seconds:g} s; nothing was changed, "
                    "try again later"
                )
            try:
                yield
            finally:
                self._free.release()
        finally:
            with self._lock:
                self._here -= 1

    @property
    def full(self) -> bool:
        """True where the next one is sent away."""
        return self._here >= self._room
