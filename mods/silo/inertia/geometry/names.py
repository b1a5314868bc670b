# SPDX-License-Identifier: LGPL-2.1-or-later
"""The names of products in files: which are none, and which have lost characters."""

from __future__ import annotations

import re
import unicodedata

from silo.bom.message import message
from silo.inertia.notes import GeometryCode, Note

_GENERIC = re.compile(r"(?:(?:SOLID|COMPOUND|COMPSOLID|SHELL|FACE|WIRE|EDGE|VERTEX)(?:_?\d+)?|=>\[[\d:]*\])?")


def is_generic(name: str) -> bool:
    """Return True for names that the kernel makes up: ``SOLID``, ``COMPOUND``, ``=>[0:1:1:14]``, or none at
    all.
    """
    return _GENERIC.fullmatch(name.strip()) is not None


def lost_characters(name: str) -> list[Note]:
    """Note "?" and U+FFFD, which exporters write for characters that they lack ("Peça" → "Pe?a")."""
    if "?" not in name and "\ufffd" not in name:
        return []
    words = message("characters of its name were lost in the export: '{name}'", name=name)
    return [Note(GeometryCode.NAME, words)]


def clean(name: str) -> str:
    """Remove control characters and outer blanks from a name; the rest stays, even if it is garbled."""
    return "".join(c for c in name if unicodedata.category(c)[0] != "C" or c == "\ufffd").strip()
