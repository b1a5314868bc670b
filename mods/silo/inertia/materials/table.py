# SPDX-License-Identifier: LGPL-2.1-or-later
"""The table that finds a material by its text: the user's rows, the package's rows, FreeCAD's cards."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from silo.bom.message import message
from silo.inertia.materials.cards import installed_cards
from silo.inertia.materials.files import package_rows, user_rows
from silo.inertia.materials.material import Material, MaterialHit, MaterialMiss
from silo.inertia.materials.words import (
    COMPOUND_SHAPES,
    MEANING,
    Words,
    contradiction,
    not_understood,
    without_platings,
    words,
)
from silo.inertia.names import Suggester


@dataclass(frozen=True, eq=False)
class MaterialTable:
    """Looks densities up. ``layers``: rows by rank, the first wins; ``cards``: read only when needed."""

    layers: Sequence[Sequence[Material]]
    cards: Callable[[], Sequence[Material]] = field(default=lambda: ())
    _known: dict[str, MaterialHit | MaterialMiss] = field(default_factory=dict, init=False, repr=False)

    def find(self, text: str) -> MaterialHit | MaterialMiss:
        """Find the material that ``text`` names: first an equal name, then whole words, then the name of a
        FreeCAD card.

        It never uses parts of words, nor similarity. A card fills a gap of the tables; it replaces a guess by
        one word, but never what the tables know.
        """
        if text not in self._known:
            self._known[text] = self._look_up(text)
        return self._known[text]

    def _look_up(self, text: str) -> MaterialHit | MaterialMiss:
        tokens = words(text)
        if not tokens:
            return MaterialMiss(message("it names nothing"))
        answer = self._index.find(tokens)
        if isinstance(answer, MaterialHit) and not answer.doubt:
            return answer
        card = self._cards_by_words.get(tokens)
        if card is None:
            return answer
        if isinstance(answer, MaterialMiss) or card.density == answer.material.density:
            return MaterialHit(card)
        doubt = message(
            "{doubt}; a FreeCAD card on this machine has that name, and its {density} kg/m³ "
            "were used instead of the {table_density} kg/m³ of {name}",
            doubt=answer.doubt,
            density=f"{card.density:g}",
            table_density=f"{answer.material.density:g}",
            name=answer.material.name,
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
        text = without_platings(tokens, self._single)
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
        turn = next((w for w in rest if w in MEANING["compound"] or COMPOUND_SHAPES.fullmatch(w)), None)
        if turn is not None:
            return MaterialMiss(
                message("“{turn}” makes it something else than {name}", turn=turn, name=left[0].name), left[0]
            )
        if len({row.density for row in left}) > 1:
            return MaterialMiss(
                message("it names more than one material: ") + " and ".join(row.name for row in left)
            )
        start, end = next((start, end) for start, end, row in hits if row is left[0])
        doubt = contradiction(left[0].name, text[start:end], left[0].density, tokens, rest)
        strange = not_understood(rest)
        if strange and not doubt:
            doubt = message(
                "“{strange}” in it is not understood, and may make it another material",
                strange=" ".join(strange),
            )
        return MaterialHit(left[0], doubt)

    def _hits(self, text: Words) -> list[tuple[int, int, Material]]:
        hits = [
            (starts[0], starts[0] + len(key), row)
            for key, row in self.exact.items()
            if (starts := [i for i in range(len(text)) if text[i : i + len(key)] == key])
        ]
        # "stainless steel" in a text covers "steel" in it.
        return [
            (start, end, row)
            for start, end, row in hits
            if not any(a <= start and end <= b and b - a > end - start for a, b, _ in hits)
        ]

    def _nothing(self, tokens: Words, text: Words) -> MaterialMiss:
        if text != tokens and not not_understood(text):
            # Most parts of which only the plating is known are of steel.
            reason = message("it names what lies on the part, and not what the part is made of")
            return MaterialMiss(reason, self.exact.get(("steel",)))
        return MaterialMiss(message("it is in no table"), self._alike(tokens))

    def _alike(self, tokens: Words) -> Material | None:
        """Find the row with the most similar spelling and the same digits, since 6063 is another alloy than
        6061.
        """
        wanted = " ".join(tokens)
        near = self._suggester.near(wanted, 1) if len(wanted) > 3 else ()  # "Air" is not like "acier"
        return self.exact[tuple(near[0].split())] if near else None

    def _ancestors(self, name: str) -> set[str]:
        ancestors: set[str] = set()
        above = self._family.get(name, "")
        while above and above not in ancestors:
            ancestors.add(above)
            above = self._family.get(above, "")
        return ancestors


def load_materials(paths: Iterable[Path | str] = (), *, freecad: bool = True) -> MaterialTable:
    """Load the usual table with the user tables at ``paths``, of which the last one wins; ``freecad``: and
    the cards of installed FreeCADs.
    """
    layers = [user_rows(path) for path in paths]
    layers.reverse()
    return MaterialTable((*layers, package_rows()), installed_cards if freecad else lambda: ())
