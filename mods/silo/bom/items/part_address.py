# SPDX-License-Identifier: LGPL-2.1-or-later
"""A part number in an address. The number itself is data, and stays as it is.

There a number is one segment of the path, whatever it holds. Web servers decode ``%2F`` before they
look for a page, browsers resolve ``..`` however it is quoted, and some words have a meaning after
``/items/``. So ``/``, ``~`` and a number of dots alone are written ``~2F``, ``~7E`` and ``~2E``, and such a
word gets ``~_`` before it; all else is quoted as usual.
"""

from __future__ import annotations

import re
from urllib.parse import quote

# Words that stand where a part number stands in a path.
WORDS = frozenset({"by-uuid", "search", "export.csv", "import", "new"})
_WORD = "~_"
_ESCAPES = {"/": "~2F", "~": "~7E"}
_ESCAPED = {escape: character for character, escape in (*_ESCAPES.items(), (".", "~2E"))}
_ESCAPE = re.compile("~2F|~7E|~2E")


def part_segment(part_number: str) -> str:
    """Write a part number as one segment of an address."""
    if part_number and not part_number.strip("."):
        return "~2E" * len(part_number)
    escaped = "".join(_ESCAPES.get(character, character) for character in part_number)
    if part_number.casefold() in WORDS:
        escaped = _WORD + escaped
    return quote(escaped, safe="")


def part_number_of(segment: str) -> str:
    """Read a part number from a segment that is no longer quoted; what is no escape stays."""
    return _ESCAPE.sub(lambda found: _ESCAPED[found[0]], segment.removeprefix(_WORD))


def part_page(part_number: str, *more: str) -> str:
    """Return the path of an item's page, or of a page below it: ``/items/F01-0001/bom``."""
    return "/".join(("/items", part_segment(part_number), *more))
