# SPDX-License-Identifier: LGPL-2.1-or-later
"""The pause of one server, or of one item: until when nothing is sent, and why."""

from __future__ import annotations

import math
from dataclasses import dataclass

LONGEST_TOLD = 3600.0
"""Seconds: a server that names a longer pause is asked again after this one."""


@dataclass(frozen=True)
class Pause:
    """Why nothing is sent to a server, or nothing of one item, before ``until``.

    until
        seconds since 1970; infinite: until a user acts.
    code
        of the error.
    failures
        how often it failed in a row.
    told
        the server itself named the time: only a user shortens it.
    """

    until: float
    reason: str
    code: str = ""
    failures: int = 1
    told: bool = False

    def left(self, now: float) -> float:
        """Return how many seconds of the pause remain; 0 if it is over."""
        # A pause that is longer than any of ours was noted before the clock was set back.
        left = self.until - now
        return left if 0 < left <= LONGEST_TOLD or math.isinf(left) else 0.0
