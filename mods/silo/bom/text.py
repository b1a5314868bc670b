# SPDX-License-Identifier: LGPL-2.1-or-later
"""Texts as the project accepts and compares them.

A text has no control characters and no half of a surrogate pair. Two texts that read as one are equal when
they are folded.
"""

from __future__ import annotations

import re
import unicodedata
from functools import cache

from silo.bom.message import message

# A class of a regular expression: control characters but tab and line ends, and Unicode's non-characters.
# XML, and so a workbook, has no place for them. No text may have one of them, nor half of a surrogate pair.
REFUSED_CHARACTERS = r"\u0000-\u0008\u000b\u000c\u000e-\u001f\u007f-\u009f\ufdd0-\ufdef" + "".join(
    chr(plane * 0x10000 + last) for plane in range(17) for last in (0xFFFE, 0xFFFF)
)

_REFUSED = re.compile(rf"[{REFUSED_CHARACTERS}\ud800-\udfff]")
_SIGNS = {0xD7: "x", 0x2300: "ø", 0x2205: "ø"}  # × ⌀ ∅
_TIMES = re.compile(r"(?<=\d)\s*x\s*(?=\d)")
_COMMA = re.compile(r"(?<=\d),(?=\d)")
_GLUE = re.compile(r"(?<=[^\W\d_])[\s_-]+(?=\d)")
_MOST_READ = 2000
_SUFFIX = re.compile(r"\.fcstd$", re.IGNORECASE)


def character_problem(text: str) -> str | None:
    """Say what is wrong with the characters of a text; None if nothing is."""
    refused = _REFUSED.search(text)
    if refused is None:
        return None
    return message(
        "wanted text without control characters and non-characters, got U+{code} as its "
        "character {position}; type it again instead of pasting it",
        code=f"{ord(refused[0]):04X}",
        position=refused.start() + 1,
    )


def with_allowed_characters(text: str, instead: str = "\ufffd") -> str:
    """Write ``instead`` for each character that :func:`character_problem` reports."""
    return _REFUSED.sub(instead, text)


def clean_name(text: str) -> str:
    """Make a name for people from a label: no file suffix, no control characters, single spaces."""
    # A label may be megabytes long, but only its beginning is used.
    text = _SUFFIX.sub("", unicodedata.normalize("NFC", with_allowed_characters(text[:_MOST_READ], " ")))
    printable = "".join(" " if unicodedata.category(c) in ("Cc", "Cf", "Cs", "Zl", "Zp") else c for c in text)
    return " ".join(printable.replace("_", " ").split())[:200]


@cache
def _unaccented(character: str) -> str:
    # Called once for each character: whole products are searched.
    return "" if unicodedata.combining(character) else character


def folded(text: str) -> str:
    """Return a text as searches compare it: without case and accents, and with one spelling of sizes.

    ``M3 × 6`` and ``M3x6``, ``2,5`` and ``2.5``, ``⌀`` and ``Ø`` are the same.
    """
    plain = text.casefold()
    if not plain.isascii():
        plain = "".join(map(_unaccented, unicodedata.normalize("NFKD", plain)))
        plain = plain.casefold().translate(_SIGNS)
    return _COMMA.sub(".", _TIMES.sub("x", plain))


def glued(text: str) -> str:
    """Join each number in a folded text to the word before it: ``iso4762`` for ``iso 4762``."""
    return _GLUE.sub("", text)


def name_key(text: str) -> str:
    """Return a text that is equal for two names that read as one: cleaned, folded, glued."""
    return glued(folded(clean_name(text)))
