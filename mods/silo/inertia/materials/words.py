# SPDX-License-Identifier: LGPL-2.1-or-later
"""Material texts compared by whole words. "Aluminum - 6061" is aluminium; "PCB FR4" is not PC. Pure.

A material is found inside a longer text only where nothing in that text turns it into something else: foam
of aluminium is not aluminium, lead-free solder is not lead, nylon with 30 % glass is not nylon.
"""

from __future__ import annotations

import re
import unicodedata

Words = tuple[str, ...]

# A number keeps its point (1.4301, A356.0); everything else that is no letter or digit separates words.
_WORD = re.compile(r"[^\W_]+(?:\.\d+)*")

_TURNS = {
    "foam", "foamed", "foaming", "schaum", "sponge", "honeycomb", "wabe", "porous", "expanded", "lw",
    "lightweight", "powder", "pulver", "wool", "wolle", "mesh", "filled", "gefüllt", "reinforced",
    "verstärkt", "renforcé", "cf", "gf", "oxide", "dioxide", "nitride", "chloride", "sulfate", "sulphate",
    "paint", "lacquer", "lack", "spray", "paste", "ink", "coating", "plating", "beschichtung", "free", "non",
    "sintered", "gesintert", "infill", "füllung", "rope", "seil", "cable", "kabel", "braid", "braided",
    "like", "imitation", "replacement", "substitute", "infused", "effect",
}  # fmt: skip
_TURNS_WITH_NUMBER = re.compile(r"(?:cf|gf|gk)\d{1,2}")
# "zinc plated steel" is steel: the word before is what lies on it.
_COVERS = {
    "plated", "coated", "galvanized", "galvanised", "painted", "verzinkt", "vernickelt", "beschichtet",
    "lackiert", "anodized", "anodised", "eloxiert", "passivated", "clad", "lined",
}  # fmt: skip


def words(text: str) -> Words:
    """The words of a material's name: NFKC, case-folded, separated by anything that is no letter or digit."""
    return tuple(_WORD.findall(unicodedata.normalize("NFKC", text).casefold()))


def uncovered(text: Words, known: frozenset[str]) -> Words:
    """Without platings: ("zinc", "plated", "steel") → ("steel",). ``known``: words that name a material."""
    kept: list[str] = []
    for word in text:
        if word in _COVERS:
            if kept and kept[-1] in known and len(text) > 2:
                kept.pop()
            continue
        kept.append(word)
    return tuple(kept) or text


def turned(rest: Words) -> str | None:
    """The word that makes a material with these other words something else; None where there is none."""
    return next((word for word in rest if word in _TURNS or _TURNS_WITH_NUMBER.fullmatch(word)), None)


def find(needle: Words, hay: Words) -> int | None:
    """Where ``needle`` stands in ``hay`` as a run of whole words."""
    for start in range(len(hay) - len(needle) + 1):
        if hay[start : start + len(needle)] == needle:
            return start
    return None
