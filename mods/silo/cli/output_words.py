# SPDX-License-Identifier: LGPL-2.1-or-later
"""Help texts cut for places that have one short line."""

from __future__ import annotations

import re

_LONGEST = 70


def first_sentence(text: str) -> str:
    """Return the beginning of a help text, up to the first full stop, bracket or semicolon."""
    return re.split(r"[.;(\n]", " ".join(text.split()))[0].strip()[:_LONGEST]
