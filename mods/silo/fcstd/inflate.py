# SPDX-License-Identifier: LGPL-2.1-or-later
"""Unpacking in bounded steps: sizes and ratios are counted on the bytes that really come out."""

from __future__ import annotations

import zlib
from io import BytesIO
from typing import Any

from silo.fcstd.container import STORED, Entry
from silo.fcstd.limits import Limits
from silo.fcstd.problem import FcstdError

# Deflate cannot pack better than this, so so many packed bytes are safe to unpack in one go.
_HIGHEST_RATIO = 1032
# zlib joins what it unpacks in one step, so a large text in one step would be there twice.
_LONGEST_STEP = 1 << 24


class Inflater:
    """Unpacks one entry step by step, so that a reader can stop when it has seen what it wants.

    The last step checks length and checksum; a reader that stops earlier has what it read, unchecked.
    """

    def __init__(self, path: str, entry: Entry, packed: bytes, most: int, limits: Limits) -> None:
        self._path, self._entry, self._packed = path, entry, packed
        self._most, self._limits = most, limits
        self._engine: Any = None
        self._rest = packed
        self._crc = 0
        self.produced = 0
        self.finished = False
        if entry.size > most:
            raise self._error(f"is too large: {entry.size} bytes unpacked, at most {most}")

    def step(self, length: int) -> bytes:
        """Up to ``length`` (> 0) more bytes; b"" and ``finished`` at the end. Raises FcstdError."""
        if self.finished:
            return b""
        data = self._stored(length) if self._entry.method == STORED else self._inflated(length)
        self._count(data)
        return data

    def whole(self) -> bytes:
        """All of an entry that was not begun; in one go where it cannot become too large."""
        highest = len(self._packed) * _HIGHEST_RATIO + 1
        if self._entry.method == STORED or highest > self._most:
            return self.rest()
        try:
            data = zlib.decompress(
                self._packed, -zlib.MAX_WBITS, bufsize=max(1, min(self._entry.size, highest))
            )
        except zlib.error as error:
            raise self._error("is damaged (it cannot be unpacked)") from error
        self.finished = True
        self._count(data)
        return data

    def rest(self, end: int | None = None) -> bytes:
        """All that is left, or what is left before a position."""
        most = len(self._packed) + 1 if self._entry.method == STORED else _LONGEST_STEP
        parts = BytesIO()
        while not self.finished and (end is None or self.produced < end):
            # Some more than is promised, so that the end is met in this very step.
            left = max(self._entry.size - self.produced + 1, 1 << 16) if end is None else end - self.produced
            parts.write(self.step(min(left, most)))
        return parts.getvalue()

    def _stored(self, length: int) -> bytes:
        data, self._rest = self._rest[:length], self._rest[length:]
        self.finished = not self._rest
        return data

    def _inflated(self, length: int) -> bytes:
        if self._engine is None:
            self._engine = zlib.decompressobj(-zlib.MAX_WBITS)
        engine = self._engine
        try:
            data: bytes = engine.decompress(self._rest, length)
        except zlib.error as error:
            raise self._error("is damaged (it cannot be unpacked)") from error
        self._rest = engine.unconsumed_tail
        if engine.eof:
            self.finished = True
        elif not data and not self._rest:
            raise self._error("is damaged (it ends too early)")
        return data

    def _count(self, data: bytes) -> None:
        produced = self.produced = self.produced + len(data)
        self._crc = zlib.crc32(data, self._crc)
        limits, size = self._limits, self._entry.size
        if produced > size:
            raise self._error("is damaged (it is longer than the directory says)")
        if produced > limits.ratio_from and produced > limits.ratio * len(self._packed):
            raise self._error(f"is packed more than {limits.ratio} times, as zip bombs are")
        if self.finished and (produced != size or self._crc != self._entry.crc):
            raise self._error("is damaged (its length or checksum is wrong)")

    def _error(self, reason: str) -> FcstdError:
        return FcstdError(self._path, f"its {self._entry.name.decode('utf-8', 'replace')} {reason}")
