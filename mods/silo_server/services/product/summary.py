# SPDX-License-Identifier: LGPL-2.1-or-later
"""The one summary of a product over its whole graph: what is open, mass and cost, counts, the last change.

Every view, export and answer shows it and counts nothing itself.

A line in a unit of another kind than its part's is open: it counts in no sum, and what it holds is without a
value. Mass: each leaf's ``mass_kg`` [kg] times its total quantity. If something below a sub-assembly has no
mass but the sub-assembly states ``mass_kg``, that stands for the whole of it. Cost: per currency, as
:mod:`silo_server.services.product.cost` has it; a bought assembly counts with its own price.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from silo.bom.errors import counted
from silo.bom.message import joined, message
from silo_server.services.product.amounts import UNIT_OPEN
from silo_server.services.product.worth import MassAndCost


class OpenBom(NamedTuple):
    """What is open in one BOM: lines that CAD no longer has, conflicts, what its last sync left out.

    units
        lines in a unit of another kind than their part's.
    """

    part_number: str
    unreferenced: int = 0
    conflicts: int = 0
    incomplete: str = ""
    units: int = 0

    @property
    def questions(self) -> str:
        """Count what a user has to decide there, in words."""
        counts = ((self.unreferenced, "unreferenced line"), (self.conflicts, "conflict"))
        words = [counted(count, word) for count, word in counts if count]
        return _listed(
            [
                *words,
                message("{unit_open} on {lines}", unit_open=UNIT_OPEN, lines=counted(self.units, "line")),
            ]
            if self.units
            else words
        )

    @property
    def words(self) -> str:
        """Describe all that is open, with what the last sync left out."""
        return _listed([text for text in (self.questions, self.incomplete) if text])


def _listed(words: Sequence[str]) -> str:
    return joined(", ", words) if words else ""


class LastChange(NamedTuple):
    """When something of the product changed last, who did it, and to which item."""

    at: str
    username: str
    part_number: str


@dataclass(frozen=True, slots=True)
class Summary:
    """One product, or a part.

    open
        a BOM's internal id → what is open there; of the product's own BOM and of all below it.
    worth, as_part
        mass and cost of what is in it; and those that it counts with in another product.
    levels
        how many rows each level of its tree has, at most ``MAX_DEPTH`` levels.
    parts, assemblies, lines
        how many different leaf parts and sub-assemblies are in it, and lines in all their BOMs.
    no_mass, no_cost
        how many of the parts lack a value that nothing above them states, but for graded prices.
    open_graded
        parts of a graded price (internal ids) that ``no_cost`` counts, as a line of theirs has an open unit.
    mass_missing, cost_missing
        the first of their part numbers.
    outdated
        lines, over all levels, that name an older revision than the newest.
    """

    open: Mapping[int, OpenBom]
    worth: MassAndCost
    as_part: MassAndCost
    changed: LastChange
    levels: Sequence[int] = ()
    parts: int = 0
    assemblies: int = 0
    lines: int = 0
    no_mass: int = 0
    no_cost: int = 0
    outdated: int = 0
    mass_missing: Sequence[str] = ()
    cost_missing: Sequence[str] = ()
    open_graded: Sequence[int] = ()

    def open_boms(self, but: int | None = None) -> list[tuple[str, str]]:
        """List (part number, what is open there) of each BOM except ``but``, by part number."""
        return sorted((bom.part_number, bom.words) for item_id, bom in self.open.items() if item_id != but)

    def inside(self, own: int, *, is_open: bool) -> list[str]:
        """Describe what is open in an item, for its row in a tree.

        ``own`` is the item's internal id. An open row shows its lines, so that only what is incomplete is
        named.
        """
        here = self.open.get(own, OpenBom(""))
        below = len(self.open) - (own in self.open)
        words = [here.incomplete]
        if not is_open:
            words += [
                here.questions,
                message("open in {boms} below", boms=counted(below, "BOM")) if below else "",
            ]
        return [*filter(None, words)]

    @property
    def stands_alone(self) -> bool:
        """Return True if the assembly states its mass in place of parts that state none."""
        return self.as_part.mass_whole and not self.worth.mass_whole

    @property
    def questions(self) -> int:
        """Count the lines that wait for a decision."""
        return sum(bom.unreferenced + bom.conflicts + bom.units for bom in self.open.values())

    @property
    def incomplete(self) -> int:
        """Count the BOMs that lack something."""
        return sum(bool(bom.incomplete) for bom in self.open.values())
