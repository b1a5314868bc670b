# SPDX-License-Identifier: LGPL-2.1-or-later
"""Names in STEP files: which are none, and which have lost characters. Pure."""

from __future__ import annotations

import re
import unicodedata

_GENERIC = re.compile(r"(?:(?:SOLID|COMPOUND|COMPSOLID|SHELL|FACE|WIRE|EDGE|VERTEX)(?:_?\d+)?|=>\[[\d:]*\])?")


def is_generic(name: str) -> bool:
    """True for the names that the kernel makes up: ``SOLID``, ``COMPOUND``, ``=>[0:1:1:14]``, none at all."""
    return _GENERIC.fullmatch(name.strip()) is not None


def has_lost_characters(name: str) -> bool:
    """True where an exporter put "?" or U+FFFD for what its character set lacks ("Peça" → "Pe?a")."""
    return "?" in name or "\ufffd" in name


def clean(name: str) -> str:
    """The name without control characters and outer blanks; what it says is kept, mojibake as well."""
    return "".join(c for c in name if unicodedata.category(c)[0] != "C" or c == "\ufffd").strip()


def file_key(name: str) -> str:
    """How a product's name is compared with a file's: NFC, case folded, outer blanks gone."""
    return unicodedata.normalize("NFC", name).strip().casefold()
