# SPDX-License-Identifier: LGPL-2.1-or-later
"""The words of a material's text: which name it, and which make another material of it.

Texts are compared by whole words. "Aluminum - 6061" is aluminium; "PCB FR4" is not PC. A material inside a
longer text is judged by the words around it (``words.toml``):

* platings and coats are left out: "zinc plated steel" is steel, and "zinc plated" alone is nothing;
* fills, percentages and compounds make something else of it: "PLA, 20 %", "bronzefill PLA", "lead free";
* colours, forms, treatments and grades say nothing about a density: "6061-T6 plate, black anodized";
* any other word makes the answer a guess: "tin can" may be tin, and may be a can.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Set
from importlib.resources import files

from silo.bom.message import message
from silo.bom.numbers import plain_text

Words = tuple[str, ...]

# A number keeps its point (1.4301, A356.0); percent signs and marks of doubt count; all else separates.
_WORD = re.compile(r"[^\W_]+(?:\.\d+)*|[%?~≈]")

MEANING = {
    kind: frozenset(text.split())
    for kind, text in tomllib.loads((files(__package__) / "words.toml").read_text("utf-8")).items()
}

COMPOUND_SHAPES = re.compile(
    r"\d*(?:ca|cf|gb|gf|gk|gl|md|mf|td)\d{1,2}|\d{1,2}(?:ca|cf|gb|gf|gk|gl)|t[1-4]0"
    r"|%|\w+fills?|\w+filled|\w+gefüllt|\w+verstärkt|\w+schaum"
)

_FINISHES = (("black", "oxide"), ("oxide", "finish"), ("hot", "dip"), ("hot", "dipped"))


def words(text: str) -> Words:
    """Split a material's name into words of plain characters, case-folded; a percent sign is a word."""
    # The only symbol that is another material without its capitals.
    return tuple(_WORD.findall(plain_text(re.sub(r"\bTiN\b", message("titanium nitride"), text)).casefold()))


def without_platings(text: Words, covered: Set[str]) -> Words:
    """Leave out platings: ("zinc", "plated", "steel") → ("steel",), ("zinc", "plated") → ().

    covered
        words that name a material by themselves.
    """
    kept: list[str] = []
    with_what = False
    for index, word in enumerate(text):
        if (
            with_what
            and word not in MEANING["thick"]
            and (word in covered or word in MEANING["coat"] or word in MEANING["with"])
        ):
            continue
        with_what = word in MEANING["covered"] and bool(MEANING["with"] & set(text[index + 1 : index + 2]))
        if word in MEANING["cover"] or (kept and (kept[-1], word) in _FINISHES):
            if word not in MEANING["cover"]:
                kept.pop()
        elif word in MEANING["covered"]:
            if (
                kept
                and not with_what
                and kept[-1] not in MEANING["thick"]
                and (kept[-1] in covered | MEANING["coat"])
            ):
                kept.pop()
        else:
            kept.append(word)
    return tuple(kept)


def not_understood(rest: Words) -> Words:
    """Return the words that may mean another material: those that are no colour, form, treatment or grade."""
    return tuple(
        word
        for word in rest
        if word in "?~≈" or (len(word) > 1 and word not in MEANING["harmless"] and not re.search(r"\d", word))
    )


def contradiction(name: str, hit: Words, density: float, text: Words, rest: Words) -> str:
    """Say why the words around a material contradict it, as the end of a sentence; "" if they do not.

    name, hit, density
        the material, the words by which it was found, and its density [kg/m^3].
    text, rest
        all words, and those that are neither ``hit`` nor platings.
    """
    words_around = set(rest)
    for kind, wrong in ((MEANING["plastic"], density > 2300), (MEANING["metal"], density < 1700)):
        if wrong and kind & words_around:
            return message(
                "“{words_around}” in it does not fit {name}", words_around=min(kind & words_around), name=name
            )
    if (
        len(hit) == 1
        and hit[0] in MEANING["colour metal"]
        and (MEANING["hue"] & words_around or MEANING["dyed"] & set(text))
    ):
        return message("“{hit}” in it may be a colour", hit=hit[0])
    if name in MEANING["pure"] and rest:
        return message("“{rest}” in it may be an alloy or another purity", rest=" ".join(rest))
    return ""
