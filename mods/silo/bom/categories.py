# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which category of a schema a component belongs in, and how sure that is.

The site's own rules come first. Then the words of the name are compared with those of the categories. The
last word says what a thing is: a motor frame is a frame, and a top plate is a plate.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from silo.bom.errors import InputError
from silo.bom.model import BomEntry

SURE = 0.5
"""From this confidence on, a category is proposed without a question."""

_WORD = re.compile(r"[^\W\d_]{3,}")
# BasePlate is two words.
_HUMP = re.compile(r"(?<=[a-z])(?=[A-Z])")
_STANDARD_WORDS = ("fastener", "screw", "hardware", "standard part", "purchased", "bought")
# In the order of preference, for components whose name fits no category.
_PART_WORDS = ("part", "machin", "custom", "manufactur", "component", "mechanic")


@dataclass(frozen=True)
class Rule:
    """A rule of the site: all of ``words`` in the name, none of ``without``, give the category."""

    category: str
    words: frozenset[str]
    without: frozenset[str] = frozenset()

    @classmethod
    def read(cls, raw: object) -> Rule:
        """From TOML or JSON: ``{words = ["motor", "frame"], category = "M06"}``. InputError."""
        if not isinstance(raw, Mapping):
            raise InputError(f"category rule: wanted a table with words and category, got {raw!r}")
        if unknown := sorted(set(raw) - {"category", "words", "without"}):
            raise InputError(f"category rule: unknown keys: {', '.join(map(str, unknown))}")
        category, words = raw.get("category"), _texts(raw, "words")
        if not isinstance(category, str) or not category or not words:
            raise InputError(f"category rule: wanted words and a category, got {dict(raw)!r}")
        return cls(category, words, _texts(raw, "without"))

    def fits(self, words: frozenset[str]) -> bool:
        """True for the words of a name."""
        return self.words <= words and not self.without & words


def _texts(raw: Mapping[str, object], key: str) -> frozenset[str]:
    value = raw.get(key, [])
    if not isinstance(value, list) or not all(isinstance(word, str) and word for word in value):
        raise InputError(f"category rule: {key} must be a list of words, got {value!r}")
    return frozenset(_stem(word) for word in value)


class Categories(dict[str, str]):
    """Code → description, in the schema's order, with the rules of the site.

    problem
        why the rules of the site are not used; "" where they are, or where there are none.
    """

    def __init__(self, known: Mapping[str, str], rules: Iterable[Rule] = (), problem: str = "") -> None:
        super().__init__(known)
        self.rules = tuple(rules)
        self.problem = problem


@dataclass(frozen=True)
class Guess:
    """A category, and how sure it is: 0 (any would do) to 1 (a rule says so)."""

    code: str
    confidence: float

    @property
    def is_sure(self) -> bool:
        return self.confidence >= SURE


def proposed_category(entry: BomEntry, name: str, categories: Mapping[str, str]) -> Guess:
    """The category that fits best; the code is "" where there is none to choose from.

    categories
        code → description, in the schema's order; :class:`Categories` brings rules along.
    """
    assemblies = assembly_categories(categories)
    fitting = [code for code in categories if (code in assemblies) == entry.is_assembly]
    if not fitting:
        return Guess(next(iter(categories), ""), 0.0)
    if len(fitting) == 1:
        return Guess(fitting[0], 1.0)
    if entry.standard:
        for wanted in _STANDARD_WORDS:
            for code in fitting:
                if wanted in categories[code].casefold():
                    return Guess(code, 1.0)
    words = _stems(name)
    for rule in getattr(categories, "rules", ()):
        if rule.category in fitting and rule.fits(frozenset(words)):
            return Guess(rule.category, 1.0)
    if entry.is_assembly:
        # The name of an assembly says what it is for, not which kind it is.
        return Guess(fitting[0], SURE)
    scores = {code: _score(words, _stems(categories[code])) for code in fitting}
    best = max(scores.values())
    if best:
        found = [code for code in fitting if scores[code] == best]
        return Guess(found[0], best / len(found))
    for wanted in _PART_WORDS:
        for code in fitting:
            if wanted in categories[code].casefold():
                return Guess(code, 0.1)
    return Guess(fitting[0], 0.0)


def assembly_categories(categories: Mapping[str, str]) -> frozenset[str]:
    """The codes that are for assemblies: by their names, or because most of their group are.

    A group is what begins with the same letter: "Top-level product" stands among the assemblies.
    """
    named = {code for code, text in categories.items() if "assembl" in text.casefold()}
    groups: dict[str, list[str]] = {}
    for code in categories:
        groups.setdefault(code[:1], []).append(code)
    whole = (codes for codes in groups.values() if 2 * sum(code in named for code in codes) > len(codes))
    return frozenset(named.union(*whole))


def _score(name: list[str], category: list[str]) -> float:
    """How well a name fits a category: its last word counts, the others say what it is for."""
    if not name:
        return 0.0
    common = len(set(name) & set(category)) / len(set(name))
    return 0.6 + 0.4 * common if name[-1] in category else 0.2 * common


def _stems(text: str) -> list[str]:
    return [_stem(word) for word in _WORD.findall(_HUMP.sub(" ", text))]


def _stem(word: str) -> str:
    word = word.casefold()
    return word[:-1] if word.endswith("s") and len(word) > 3 else word
