# SPDX-License-Identifier: LGPL-2.1-or-later
"""The material table: the package's rows, the user's on top, an installed FreeCAD's cards behind."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property

from silo.inertia.materials.words import Words, find, turned, uncovered, words


class Found(StrEnum):
    """How a material text led to its density."""

    NAME = "name"  # equal to a name or alias of the table
    WORDS = "words"  # a name or alias stands in the text as whole words
    CARD = "card"  # equal to the name of a FreeCAD material card


@dataclass(frozen=True)
class Material:
    """One material. ``density`` [kg/m^3] at room temperature; ``family``: the more general row, or ""."""

    name: str
    density: float
    aliases: tuple[str, ...] = ()
    source: str = ""
    family: str = ""


@dataclass(frozen=True)
class MaterialHit:
    """A material text that was understood."""

    material: Material
    found: Found


@dataclass(frozen=True)
class MaterialMiss:
    """A material text that was not understood, and why, in words that end a sentence."""

    reason: str


@dataclass(frozen=True, eq=False)
class MaterialTable:
    """Looks densities up. ``layers``: rows by rank, the first wins; ``cards``: read only when needed."""

    layers: Sequence[Sequence[Material]]
    cards: Callable[[], Sequence[Material]] = field(default=lambda: ())
    _known: dict[str, MaterialHit | MaterialMiss] = field(default_factory=dict, init=False, repr=False)

    def find(self, text: str) -> MaterialHit | MaterialMiss:
        """The material that ``text`` names: equal first, then whole words, then FreeCAD's cards by name.

        Never by parts of words, and never by likeness.
        """
        if text not in self._known:
            self._known[text] = self._look_up(text)
        return self._known[text]

    def _look_up(self, text: str) -> MaterialHit | MaterialMiss:
        tokens = words(text)
        if not tokens:
            return MaterialMiss("it names nothing")
        for layer in self._layers:
            hit = layer.exact.get(tokens)
            if hit is not None:
                return MaterialHit(hit, Found.NAME)
        card = self._card(tokens)
        if card is not None:
            return MaterialHit(card, Found.CARD)
        miss: MaterialMiss | None = None
        for layer in self._layers:
            answer = layer.inside(tokens)
            if isinstance(answer, MaterialHit):
                return answer
            miss = miss or answer
        return miss or MaterialMiss("it is in no table")

    def with_layer(self, rows: Iterable[Material]) -> MaterialTable:
        """The same with ``rows`` before all others."""
        return MaterialTable((tuple(rows), *self.layers), self.cards)

    def _card(self, tokens: Words) -> Material | None:
        return self._cards_by_words.get(tokens)

    @cached_property
    def _layers(self) -> tuple[_Layer, ...]:
        return tuple(_Layer(rows) for rows in self.layers)

    @cached_property
    def _cards_by_words(self) -> dict[Words, Material]:
        return {words(alias): card for card in self.cards() for alias in (card.name, *card.aliases)}


class _Layer:
    """One set of rows, indexed by words."""

    def __init__(self, rows: Sequence[Material]) -> None:
        self.exact: dict[Words, Material] = {}
        self._family = {row.name: row.family for row in rows}
        for row in rows:
            for alias in (row.name, *row.aliases):
                key = words(alias)
                if key:
                    self.exact.setdefault(key, row)
        self._single = frozenset(key[0] for key in self.exact if len(key) == 1)

    def inside(self, tokens: Words) -> MaterialHit | MaterialMiss | None:
        text = uncovered(tokens, self._single)
        hits = [
            (start, start + len(key), row)
            for key, row in self.exact.items()
            if (start := find(key, text)) is not None
        ]
        # "stainless steel" in a text covers "steel" in it.
        hits = [h for h in hits if not any(_covers(other, h) for other in hits)]
        named = {row.name: row for _, _, row in hits}
        general = {ancestor for name in named for ancestor in self._ancestors(name)}
        left = [row for name, row in named.items() if name not in general]
        if not left:
            return None
        covered = {index for start, end, _ in hits for index in range(start, end)}
        turn = turned(tuple(word for index, word in enumerate(text) if index not in covered))
        if turn is not None:
            return MaterialMiss(f"“{turn}” makes it something else than {left[0].name}")
        if len({row.density for row in left}) > 1:
            return MaterialMiss("it names more than one material: " + " and ".join(row.name for row in left))
        return MaterialHit(left[0], Found.WORDS)

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
