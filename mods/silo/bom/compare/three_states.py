# SPDX-License-Identifier: LGPL-2.1-or-later
"""Three states of one assembly, compared line by line: the common base, and what each of two editors made of
it.
"""

from __future__ import annotations

from dataclasses import dataclass

from silo.bom.compare.states import ComparedAssembly, ComponentMatch, first_state
from silo.bom.entry import BomEntry


@dataclass(frozen=True, slots=True)
class ThreeLines:
    """A line in three states of an assembly: as two people opened it, as one left it, as the other did.

    None where the state has no such line.
    """

    base: BomEntry | None
    theirs: BomEntry | None
    mine: BomEntry | None

    @property
    def entry(self) -> BomEntry:
        """Return the component as I have it; if I do not, as they have it, or as the base has it."""
        return first_state(self.mine, self.theirs, self.base)

    @property
    def quantities(self) -> tuple[float, float, float]:
        """Return the quantities in (base, theirs, mine); 0 means no line."""
        base, theirs, mine = (entry.quantity if entry else 0 for entry in (self.base, self.theirs, self.mine))
        return base, theirs, mine

    @property
    def by_them(self) -> bool:
        """Return True if they changed the quantity."""
        return self.quantities[1] != self.quantities[0]

    @property
    def by_me(self) -> bool:
        """Return True if I changed the quantity."""
        return self.quantities[2] != self.quantities[0]

    @property
    def undoes(self) -> bool:
        """Return True if mine, in place of theirs, would undo their change."""
        return self.by_them and self.quantities[1] != self.quantities[2]


def compare_three(
    base: ComparedAssembly | None, theirs: ComparedAssembly, mine: ComparedAssembly
) -> tuple[ThreeLines, ...]:
    """Return every line of an assembly that one of two people changed; first those whose change would be
    undone.

    Without ``base``, returns every line in which the two differ; who changed it is then not known.
    """
    common = base or ComparedAssembly(mine.head)
    to_theirs, to_mine = ComponentMatch([common], [theirs]), ComponentMatch([common], [mine])
    across = ComponentMatch([theirs], [mine])
    left_theirs = {entry.key: entry for entry in theirs.lines}
    left_mine = {entry.key: entry for entry in mine.lines}
    rows = []
    for entry in common.lines:
        other = left_theirs.pop(to_theirs.of_old(entry), None)
        rows.append(ThreeLines(entry, other, left_mine.pop(to_mine.of_old(entry), None)))
    for entry in left_theirs.values():
        rows.append(ThreeLines(None, entry, left_mine.pop(across.of_old(entry), None)))
    rows += [ThreeLines(None, None, entry) for entry in left_mine.values()]
    if base is None:
        return tuple(row for row in rows if row.quantities[1] != row.quantities[2])
    changed = [row for row in rows if row.by_them or row.by_me]
    return tuple(sorted(changed, key=lambda row: not row.undoes))
