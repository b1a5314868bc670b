# SPDX-License-Identifier: LGPL-2.1-or-later
"""Standard streams that take any text, and whose end does not end the work."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import TextIO, TypeVar

T = TypeVar("T")


def open_streams() -> None:
    """Open standard streams that take any text; a job may have been started without them."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        # What a terminal or a log cannot show (a C locale knows no ×) is shown as "?", never a failure.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


class OutputStream(io.TextIOBase):
    """A stream whose end does not end the work: what can no longer be read is dropped, the rest is done.

    ``head`` closes its pipe after ten lines, a disk is full: a sync is finished anyway, and its report
    written. ``failure`` is what went wrong. ``strict``: raise it instead, for commands without an end. What a
    person alone reads is ``translated``.
    """

    def __init__(self, stream: TextIO, translated: Callable[[str], str] = str) -> None:
        self._stream, self._translated = stream, translated
        self.failure: OSError | None = None
        self.strict = self.begun = False

    def write(self, text: str, /) -> int:
        self.begun = True
        shown = self._translated(text)
        return self._attempt(lambda: self._stream.write(shown), len(text))

    def flush(self) -> None:
        self._attempt(self._stream.flush, None)

    def _attempt(self, act: Callable[[], T], otherwise: T) -> T:
        if self.failure is None:
            try:
                return act()
            except OSError as error:
                self.failure = error
                self._forget()
        if self.strict:
            raise self.failure
        return otherwise

    def _forget(self) -> None:
        """Drop what is left in a stream, since Python would write it at the end and fail again."""
        with suppress(OSError, ValueError):
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, self._stream.fileno())
            os.close(null)

    def fileno(self) -> int:
        return self._stream.fileno()

    def isatty(self) -> bool:
        return self._stream.isatty()

    @property
    def encoding(self) -> str:  # type: ignore[override]
        return getattr(self._stream, "encoding", None) or "utf-8"
