# SPDX-License-Identifier: LGPL-2.1-or-later
"""A turnstile: a bounded queue before something scarce, such as the database's writers or the memory of a
password hash.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from silo.bom.errors import BusyError
from silo.bom.message import message


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
        self._closed = False

    @contextmanager
    def enter(self) -> Iterator[None]:
        """Wait for a place, and stay inside until the block ends. Raises BusyError; then nothing was done."""
        with self._lock:
            if self.full:
                raise BusyError(
                    message(
                        "too many {requests} are waiting; nothing was changed, try again later",
                        requests=self._who,
                    )
                )
            self._here += 1
        try:
            if not self._free.acquire(timeout=self._seconds):
                raise BusyError(
                    message(
                        "other {requests} took longer than {seconds} s; nothing was changed, try again later",
                        requests=self._who,
                        seconds=f"{self._seconds:g}",
                    )
                )
            try:
                self.check()
                yield
            finally:
                self._free.release()
        finally:
            with self._lock:
                self._here -= 1

    def close(self) -> None:
        """Send all away, as the server stops: those who wait now, those inside at the next :meth:`check`."""
        self._closed = True
        self._free.release(self._room)

    def check(self) -> None:
        """Raise BusyError if the server is stopping."""
        if self._closed:
            raise BusyError(message("the server is stopping; try again later"))

    @property
    def here(self) -> int:
        """Return how many threads are inside or wait."""
        return self._here

    @property
    def full(self) -> bool:
        """Return True if the next thread is sent away."""
        return self._here >= self._room
