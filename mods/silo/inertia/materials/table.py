# SPDX-License-Identifier: LGPL-2.1-or-later
"""The material table: the package's rows, the user's on top, an installed FreeCAD's cards behind."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from silo.inertia.materials.words import (
    Words,
    compound,
    contradiction,
    find,
    not_understood,
    uncovered,
    words,
)
from silo.inertia.names import Suggester


@dataclass(frozen=True)
class Material:
    """One material.

    density
        [kg/m^3] at room temperature; it varies by ± ``spread`` of itself between kinds of the material.
    family
        the more general row, or "".
    """

    name: str
    density: float
    aliases: tuple[str, ...] = ()
    source: str = ""
    family: str = ""
    spread: float = 0.0


@dataclass(frozen=True)
class MaterialHit:
    """A material text that was understood; ``doubt`` says why it may mean another material, or is empty."""

    material: Material
    doubt: str = ""


@dataclass(frozen=True)
class MaterialMiss:
    """A material text that was not understood, and why, in words that end a sentence.

    nearest
        the material that it may mean, for a person to decide; None where nothing is near.
    """

    reason: str
    nearest: Material | None = None

    @property
    def advice(self) -> str:
        """The reason, with the nearest material where there is one."""
        if self.nearest is None:
            return self.reason
        return f"{self.reason} (the nearest is {self.nearest.name}, {self.nearest.density:g} kg/m³)"


@dataclass(frozen=True, eq=False)
class MaterialTable:
    """Looks densities up. ``layers``: rows by rank, the first wins; ``cards``: read only when needed."""

    layers: Sequence[Sequence[Material]]
    cards: Callable[[], Sequence[Material]] = field(default=lambda: ())
    _known: dict[str, MaterialHit | MaterialMiss] = field(default_factory=dict, init=False, repr=False)

    def find(self, text: str) -> MaterialHit | MaterialMiss:
        """The material that ``text`` names: equal first, then whole words, then FreeCAD's cards by name.

        Never by parts of words, and never by likeness. A card fills a gap of the tables; it replaces a guess
        with a word, and never what the tables know.
        """
        if text not in self._known:
            self._known[text] = self._look_up(text)
        return self._known[text]

    def _look_up(self, text: str) -> MaterialHit | MaterialMiss:
        tokens = words(text)
        if not tokens:
            return MaterialMiss("it names nothing")
        answer = self._index.find(tokens)
        if isinstance(answer, MaterialHit) and not answer.doubt:
            return answer
        card = self._cards_by_words.get(tokens)
        if card is None:
            return answer
        if isinstance(answer, MaterialMiss) or card.density == answer.material.density:
            return MaterialHit(card)
        doubt = (
            f"{answer.doubt}; a FreeCAD card on this machine has that name, and its {card.density:g} kg/m³ "
            f"were used instead of the {answer.material.density:g} kg/m³ of {answer.material.name}"
        )
        return MaterialHit(card, doubt)

    @cached_property
    def _index(self) -> _Index:
        return _Index([row for rows in self.layers for row in rows])

    @cached_property
    def _cards_by_words(self) -> dict[Words, Material]:
        return {words(alias): card for card in self.cards() for alias in (card.name, *card.aliases)}


class _Index:
    """Rows by the words of their names and aliases; of two with the same words the first wins."""

    def __init__(self, rows: Sequence[Material]) -> None:
        self.exact: dict[Words, Material] = {}
        self._family: dict[str, str] = {}
        for row in rows:
            self._family.setdefault(row.name, row.family)
            for alias in (row.name, *row.aliases):
                key = words(alias)
                if key:
                    self.exact.setdefault(key, row)
        self._joined = {"".join(key): row for key, row in reversed(self.exact.items())}
        self._suggester = Suggester((" ".join(key) for key in self.exact), budget=1_000_000)
        self._single = frozenset(key[0] for key in self.exact if len(key) == 1)

    def find(self, tokens: Words) -> MaterialHit | MaterialMiss:
        equal = self.exact.get(tokens)
        if equal is None and not (joined := "".join(tokens)).isdecimal():
            equal = self._joined.get(joined)  # "GG-25", "AISI316L"
        if equal is not None:
            return MaterialHit(equal)
        text = uncovered(tokens, self._single)
        hits = self._hits(text)
        named: dict[str, Material] = {}
        for _, _, row in hits:
            named.setdefault(row.name, row)
        general = {ancestor for name in named for ancestor in self._ancestors(name)}
        left = [row for name, row in named.items() if name not in general]
        if not left:
            return self._nothing(tokens, text)
        covered = {index for start, end, _ in hits for index in range(start, end)}
        rest = tuple(word for index, word in enumerate(text) if index not in covered)
        turn = compound(rest)
        if turn is not None:
            return MaterialMiss(f"“{turn}” makes it something else than {left[0].name}", left[0])
        if len({row.density for row in left}) > 1:
            return MaterialMiss("it names more than one material: " + " and ".join(row.name for row in left))
        start, end = next((start, end) for start, end, row in hits if row is left[0])
        doubt = contradiction(left[0].name, text[start:end], left[0].density, tokens, rest)
        strange = not_understood(rest)
        if strange and not doubt:
            doubt = f"“{' '.join(strange)}” in it is not understood, and may make it another"
        return MaterialHit(left[0], doubt)

    def _hits(self, text: Words) -> list[tuple[int, int, Material]]:
        hits = [
            (start, start + len(key), row)
            for key, row in self.exact.items()
            if (start := find(key, text)) is not None
        ]
        # "stainless steel" in a text covers "steel" in it.
        return [hit for hit in hits if not any(_covers(other, hit) for other in hits)]

    def _nothing(self, tokens: Words, text: Words) -> MaterialMiss:
        if text != tokens and not not_understood(text):
            # Most parts that only their plating is known of are of steel.
            reason = "it names what lies on the part, and not what the part is made of"
            return MaterialMiss(reason, self.exact.get(("steel",)))
        return MaterialMiss("it is in no table", self._alike(tokens))

    def _alike(self, tokens: Words) -> Material | None:
        """The row with the most similar spelling and the same digits: 6063 is another alloy than 6061."""
        wanted = " ".join(tokens)
        near = self._suggester.near(wanted, 1) if len(wanted) > 3 else ()  # "Air" is not like "acier"
        return self.exact[tuple(near[0].split())] if near else None

    def _ancestors(self, name: str) -> set[str]:
        found: set[str] = set()
        above = self._family.get(name, "")
        while above and above not in found:
            found.add(above)
            above = self._family.get(above, "")
        return found


def _covers(outer: tuple[int, int, Material], inner: tuple[int, int, Material]) -> bool:
    longer = outer[1] - outer[0] > inner[1] - inner[0]
    return longer and outer[0] <= inner[0] and inner[1] <= outer[1]
