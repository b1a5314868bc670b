# SPDX-License-Identifier: LGPL-2.1-or-later
"""Two states of the same assemblies, compared line by line: what a change of files means in parts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from silo.bom.compare.states import ComparedAssembly, ComponentMatch, first_state
from silo.bom.entry import BomEntry
from silo.bom.items.naming import display_name


@dataclass(frozen=True, slots=True)
class LineChange:
    """One line of an assembly. ``old`` is None for a new line, ``new`` for one that is gone."""

    old: BomEntry | None
    new: BomEntry | None

    @property
    def entry(self) -> BomEntry:
        """Return the component as it is now; if it is removed, as it was."""
        return first_state(self.new, self.old)

    @property
    def kind(self) -> str:
        """Return ``added``, ``removed``, ``quantity_changed`` or ``moved`` (same part, other file or
        object).
        """
        if self.old is None:
            return "added"
        if self.new is None:
            return "removed"
        return "moved" if self.old.quantity == self.new.quantity else "quantity_changed"


@dataclass(frozen=True, slots=True)
class AssemblyChange:
    """What became of one assembly. ``old`` is None for a new one, ``new`` for one that is gone."""

    old: ComparedAssembly | None
    new: ComparedAssembly | None
    lines: tuple[LineChange, ...] = ()

    @property
    def head(self) -> BomEntry:
        """Return the assembly as it is now; if it is removed, as it was."""
        return first_state(self.new, self.old).head

    @property
    def kind(self) -> str:
        """Return ``added``, ``removed``, ``changed``, or ``moved`` if only its file or object is another."""
        if self.old is None:
            return "added"
        if self.new is None:
            return "removed"
        return "changed" if self.lines else "moved"


def compare_assemblies(
    old: Sequence[ComparedAssembly], new: Sequence[ComparedAssembly]
) -> tuple[AssemblyChange, ...]:
    """Return every assembly whose lines or place differ, in the order of the new state; removed ones come
    last.
    """
    match = ComponentMatch(old, new)
    before = {match.of_old(assembly.head): assembly for assembly in old}
    changes = []
    for assembly in new:
        earlier = before.pop(assembly.head.key, None)
        lines = _changed_lines(match, earlier.lines if earlier else (), assembly.lines)
        if earlier is None or lines or earlier.head.key != assembly.head.key:
            changes.append(AssemblyChange(earlier, assembly, lines))
    gone = [
        AssemblyChange(assembly, None, _changed_lines(match, assembly.lines, ()))
        for assembly in before.values()
    ]
    return (*changes, *gone)


def _changed_lines(
    match: ComponentMatch, old: Iterable[BomEntry], new: Iterable[BomEntry]
) -> tuple[LineChange, ...]:
    """Return the lines that differ between two states of one assembly."""
    before = {match.of_old(entry): entry for entry in old}
    changes = []
    for entry in new:
        earlier = before.pop(entry.key, None)
        if earlier is None or earlier.quantity != entry.quantity or earlier.key != entry.key:
            changes.append(LineChange(earlier, entry))
    return (*changes, *(LineChange(entry, None) for entry in before.values()))


def changes_json(changes: Iterable[AssemblyChange]) -> list[dict[str, Any]]:
    """Return the comparison as JSON values."""
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
