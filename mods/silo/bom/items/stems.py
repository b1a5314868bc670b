# SPDX-License-Identifier: LGPL-2.1-or-later
"""The words of a name by which categories are found."""

from __future__ import annotations

import re

_WORD = re.compile(r"[^\W\d_]{3,}")

# BasePlate is two words.
_HUMP = re.compile(r"(?<=[a-z])(?=[A-Z])")


def stems(text: str) -> list[str]:
    """Split a name into the words by which categories are found, without the plural's s."""
    return [stem(word) for word in _WORD.findall(_HUMP.sub(" ", text))]


def stem(word: str) -> str:
    """Return a word in lower case, without the plural's s."""
    word = word.casefold()
    return word[:-1] if word.endswith("s") and len(word) > 3 else word
