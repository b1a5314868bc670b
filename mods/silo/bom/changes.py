# SPDX-License-Identifier: LGPL-2.1-or-later
"""Two states of the same assemblies, compared line by line: what a change of files means in parts. Pure.

A component is the same in both states where its identity is the same, or, where one of them has no identity
of its own, where file and object are the same. An identity that several components of one state share (a
copied file) proves nothing; then file and object decide.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from silo.bom.model import BomEntry
from silo.bom.naming import display_name

Key = tuple[str, str]
T = TypeVar("T")


def _first(*states: T | None) -> T:
    """The first state there is; one of them always is."""
    return next(state for state in states if state is not None)


@dataclass(frozen=True, slots=True)
class Assembly:
    """An assembly and its lines, quantities per one assembly. Paths are relative to the compared folder."""

    head: BomEntry
    lines: tuple[BomEntry, ...] = ()


@dataclass(frozen=True, slots=True)
class LineChange:
    """One line of an assembly. ``old`` is None for a new line, ``new`` for one that is gone."""

    old: BomEntry | None
    new: BomEntry | None

    @property
    def entry(self) -> BomEntry:
        """The component as it is now, or as it was last."""
        return _first(self.new, self.old)

    @property
    def kind(self) -> str:
        """``added``, ``removed``, ``quantity_changed`` or ``moved`` (another file or object, same part)."""
        if self.old is None:
            return "added"
        if self.new is None:
            return "removed"
        return "moved" if self.old.quantity == self.new.quantity else "quantity_changed"


@dataclass(frozen=True, slots=True)
class AssemblyChange:
    """What became of one assembly. ``old`` is None for a new one, ``new`` for one that is gone."""

    old: Assembly | None
    new: Assembly | None
    lines: tuple[LineChange, ...] = ()

    @property
    def head(self) -> BomEntry:
        """The assembly as it is now, or as it was last."""
        return _first(self.new, self.old).head

    @property
    def kind(self) -> str:
        """``added``, ``removed``, ``changed``, or ``moved`` where only its file or object is another."""
        if self.old is None:
            return "added"
        if self.new is None:
            return "removed"
        return "changed" if self.lines else "moved"


def compare_assemblies(old: Sequence[Assembly], new: Sequence[Assembly]) -> tuple[AssemblyChange, ...]:
    """Every assembly whose lines or place differ, in the order of the new state, removed ones last."""
    match = _Match(old, new)
    before = {match.of_old(assembly.head): assembly for assembly in old}
    found = []
    for assembly in new:
        known = before.pop(assembly.head.key, None)
        lines = match.lines(known.lines if known else (), assembly.lines)
        if known is None or lines or known.head.key != assembly.head.key:
            found.append(AssemblyChange(known, assembly, lines))
    gone = [AssemblyChange(known, None, match.lines(known.lines, ())) for known in before.values()]
    return (*found, *gone)


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
        """The component, by the newest state that has it."""
        return _first(self.mine, self.theirs, self.base)

    @property
    def quantities(self) -> tuple[float, float, float]:
        """Of base, theirs and mine; 0 where there is no line."""
        base, theirs, mine = (entry.quantity if entry else 0 for entry in (self.base, self.theirs, self.mine))
        return base, theirs, mine

    @property
    def by_them(self) -> bool:
        """They changed it."""
        return self.quantities[1] != self.quantities[0]

    @property
    def by_me(self) -> bool:
        """I changed it."""
        return self.quantities[2] != self.quantities[0]

    @property
    def undoes(self) -> bool:
        """True where mine in the place of theirs would undo what they did."""
        return self.by_them and self.quantities[1] != self.quantities[2]


def compare_three(base: Assembly | None, theirs: Assembly, mine: Assembly) -> tuple[ThreeLines, ...]:
    """Every line of an assembly that one of two people changed; what would be undone comes first.

    Without ``base``, every line in which the two differ; who changed it is then not known.
    """
    common = base or Assembly(mine.head)
    to_theirs, to_mine = _Match([common], [theirs]), _Match([common], [mine])
    across = _Match([theirs], [mine])
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


class _Match:
    """Which component of the old state is which of the new one."""

    def __init__(self, old: Sequence[Assembly], new: Sequence[Assembly]) -> None:
        was, now = _components(old), _components(new)
        by_id_old, by_id_new = _by_identity(was), _by_identity(now)
        self._new_key: dict[Key, Key] = {}
        taken = set()
        for uuid, key in by_id_old.items():
            if uuid in by_id_new:
                self._new_key[key] = by_id_new[uuid]
                taken.add(by_id_new[uuid])
        for key, entry in was.items():
            if key in self._new_key or key not in now or key in taken:
                continue
            # Two identities that differ are two parts, though the second took the first one's place.
            unlike = entry.silo_uuid in by_id_old and now[key].silo_uuid in by_id_new
            if not unlike:
                self._new_key[key] = key

    def of_old(self, entry: BomEntry) -> Key:
        """The new key of an old component; one that no new component has where it is gone."""
        return self._new_key.get(entry.key, ("\0gone", "\0".join(entry.key)))

    def lines(self, old: Iterable[BomEntry], new: Iterable[BomEntry]) -> tuple[LineChange, ...]:
        """The lines of one assembly that differ."""
        before = {self.of_old(entry): entry for entry in old}
        found = []
        for entry in new:
            known = before.pop(entry.key, None)
            if known is None or known.quantity != entry.quantity or known.key != entry.key:
                found.append(LineChange(known, entry))
        return (*found, *(LineChange(entry, None) for entry in before.values()))


def _components(assemblies: Iterable[Assembly]) -> dict[Key, BomEntry]:
    return {entry.key: entry for assembly in assemblies for entry in (assembly.head, *assembly.lines)}


def _by_identity(components: Mapping[Key, BomEntry]) -> dict[str, Key]:
    times = Counter(entry.silo_uuid for entry in components.values())
    return {
        entry.silo_uuid: key
        for key, entry in components.items()
        if entry.silo_uuid is not None and times[entry.silo_uuid] == 1
    }


# --- for machines ---------------------------------------------------------------------------------------


def changes_json(changes: Iterable[AssemblyChange]) -> list[dict[str, Any]]:
    """The comparison for machines."""
    return [
        {
            **_entry(change.head),
            "change": change.kind,
            "moved_from": _moved(
                change.old.head if change.old else None, change.new.head if change.new else None
            ),
            "lines": [
                {
                    **_entry(line.entry),
                    "change": line.kind,
                    "old_quantity": line.old.quantity if line.old else None,
                    "new_quantity": line.new.quantity if line.new else None,
                    "moved_from": _moved(line.old, line.new),
                }
                for line in change.lines
            ],
        }
        for change in changes
    ]


def _entry(entry: BomEntry) -> dict[str, Any]:
    return {
        "doc_path": entry.doc_path,
        "object": entry.object_name,
        "name": display_name(entry),
        "silo_uuid": entry.silo_uuid,
        "missing": entry.missing,
    }


def _moved(old: BomEntry | None, new: BomEntry | None) -> dict[str, str] | None:
    if old is None or new is None or old.key == new.key:
        return None
    return {"doc_path": old.doc_path, "object": old.object_name}
