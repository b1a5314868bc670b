# SPDX-License-Identifier: LGPL-2.1-or-later
"""The category that fits a component best, as a guess.

The site's own rules come first. Then the words of the name are compared with those of the categories. The
last word says what a thing is: a motor frame is a frame, and a top plate is a plate.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from silo.bom.entry import BomEntry
from silo.bom.items.standard_kind import OTHER_NAMES, standard_kind
from silo.bom.items.stems import stems
from silo.bom.message import message

SURE = 0.5
"""From this confidence on, a category is proposed without a question."""

# Categories for standard parts of any kind.
_STANDARD_WORDS = ("fastener", "hardware", message("standard part"), "purchased", "bought")

# In the order of preference, for components whose name fits no category.
_PART_WORDS = ("part", "machin", "custom", "manufactur", "component", "mechanic")


@dataclass(frozen=True)
class Guess:
    """A category, and how sure it is: 0 (any would do) to 1 (a rule says so)."""

    code: str
    confidence: float

    @property
    def is_sure(self) -> bool:
        return self.confidence >= SURE


def proposed_category(entry: BomEntry, name: str, categories: Mapping[str, str]) -> Guess:
    """Choose the category that fits best; its code is "" if there are no categories.

    categories
        code → description, in the schema's order; ``Categories`` of the schema has the rules too.
    """
    assemblies = assembly_categories(categories)
    fitting = {code: text for code, text in categories.items() if (code in assemblies) == entry.is_assembly}
    if not fitting:
        return Guess(next(iter(categories), ""), 0.0)
    first = next(iter(fitting))
    if len(fitting) == 1:
        return Guess(first, 1.0)
    if entry.standard:
        return _standard_category(entry.standard, fitting, categories)
    words = stems(name)
    if guess := _by_rule(words, fitting, categories):
        return guess
    if entry.is_assembly:
        # The name of an assembly says what it is for, not which kind it is.
        return Guess(first, SURE)
    scores = {code: _score(words, stems(text)) for code, text in fitting.items()}
    best = max(scores.values())
    if best:
        codes = [code for code in fitting if scores[code] == best]
        return Guess(codes[0], best / len(codes))
    code = _first_with(_PART_WORDS, fitting)
    return Guess(code, 0.1) if code else Guess(first, 0.0)


def _by_rule(words: Iterable[str], fitting: Mapping[str, str], categories: Mapping[str, str]) -> Guess | None:
    """Guess by the first rule of the site that applies; None if none does."""
    for rule in getattr(categories, "rules", ()):
        if rule.category in fitting and rule.fits(frozenset(words)):
            return Guess(rule.category, 1.0)
    return None


def _first_with(words: Iterable[str], fitting: Mapping[str, str]) -> str:
    """Return the first category with the first of the words that any text has; "" if none has one."""
    return next((code for word in words for code, text in fitting.items() if word in text.casefold()), "")


def _standard_category(designation: str, fitting: Mapping[str, str], categories: Mapping[str, str]) -> Guess:
    """Guess by the site's rules, else the one category of the kind, else one for standard parts of any
    kind.
    """
    kind = standard_kind(designation)
    for named in filter(None, (kind, OTHER_NAMES.get(kind))):
        if guess := _by_rule(stems(f"{designation} {named}"), fitting, categories):
            return guess
        codes = [code for code, text in fitting.items() if set(stems(named)) <= set(stems(text))]
        if codes:
            return Guess(codes[0], 1.0 if len(codes) == 1 else SURE / 2)
    if code := _first_with(_STANDARD_WORDS, fitting):
        return Guess(code, 1.0)
    return Guess(_first_with(["screw"], fitting) or next(iter(fitting)), 0)


def assembly_categories(categories: Mapping[str, str]) -> frozenset[str]:
    """Return the codes for assemblies: "assembl" is in their text, or in that of most of their group.

    The codes of a group begin with the same letter: "Top-level product" is among the assemblies.
    """
    named = {code for code, text in categories.items() if "assembl" in text.casefold()}
    groups: dict[str, list[str]] = {}
    for code in categories:
        groups.setdefault(code[:1], []).append(code)
    whole = (codes for codes in groups.values() if 2 * sum(code in named for code in codes) > len(codes))
    return frozenset(named.union(*whole))


def _score(name: list[str], category: list[str]) -> float:
    """Rate how well a name fits a category: its last word counts most, the others say what the part is
    for.
    """
    if not name:
        return 0.0
    common = len(set(name) & set(category)) / len(set(name))
    return 0.6 + 0.4 * common if name[-1] in category else 0.2 * common
