# SPDX-License-Identifier: LGPL-2.1-or-later
"""How a text is meant; whatever shows it gives it a colour and a sign."""

from __future__ import annotations

from enum import StrEnum


class Tone(StrEnum):
    """How a text is meant; the pane gives it a colour and a sign."""

    PLAIN = "plain"
    QUIET = "quiet"  # beside the point, such as a time
    GOOD = "good"
    CHANGED = "changed"
    WARNING = "warning"
    ERROR = "error"
