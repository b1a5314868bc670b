# SPDX-License-Identifier: LGPL-2.1-or-later
"""Changes of a BOM in plain words, for the pages."""

from __future__ import annotations

from collections.abc import Sequence

from silo_server.services.bom.changes import ChangeKind
from silo_server.services.bom.history import Change, ChangedLine
from silo_server.values import LineState
from silo_server.web.render import isolate, plural, quantity

# What a person fills in on a line, with its label.
FIELDS = {
    "quantity": "Quantity",
    "unit": "Unit",
    "reference_designators": "Reference designators",
    "find_number": "Find number",
    "notes": "Notes",
}
_NAMES = {
    "reference_designators": "reference designators",
    "find_number": "find number",
    "notes": "notes",
    "child_revision": "revision",
    "rel_type": "type",
}


def by_whom(change: Change) -> str:
    """``by ann, 2026-02-08 22:15: one spare``; a sync names its file."""
    from_file = f", from {isolate(change.document_file)}" if change.document_file else ""
    what = "sync " if change.kind == ChangeKind.MERGE else ""
    why = f": {isolate(change.reason)}" if change.reason else ""
    return f"{what}by {isolate(change.username)}, {change.at[:16].replace('T', ' ')}{from_file}{why}"


def sentence(line: ChangedLine) -> tuple[str, str]:
    """(mark, words) of what one change made of one line: ``~``, ``F01-0001 M8x20 Bolt: quantity 8 → 12``."""
    who = f"{isolate(line.child.part_number)} {isolate(line.child.name)}".strip()
    if line.before is None and line.after is not None:
        return "added", f"{who}: added, quantity {quantity(line.after.quantity, line.after.unit)}"
    if line.after is None:
        return "removed", f"{who}: removed"
    assert line.before is not None  # a changed line has both states
    gone = line.after.unreferenced_since is not None and line.before.unreferenced_since is None
    said = ", ".join(changes(line.before, line.after)) or "no visible change"
    return ("warn" if gone else "changed"), f"{who}: {said}"


def changes(before: LineState, after: LineState) -> list[str]:
    """What differs between two states of a line."""
    said: list[str] = []
    if (before.quantity, before.unit) != (after.quantity, after.unit):
        old, new = quantity(before.quantity, before.unit), quantity(after.quantity, after.unit)
        said.append(f"quantity {old} → {new}")
    if before.unreferenced_since is None and after.unreferenced_since is not None:
        said.append("no longer referenced by the assembly")
    back = before.unreferenced_since is not None and after.unreferenced_since is None
    if back and after.source == "assembly":
        said.append("referenced again")
    if before.source != after.source:
        said.append("now a manual line" if after.source == "manual" else "owned by the assembly again")
    if before.reason != after.reason and after.reason:
        said.append(f"reason: {isolate(after.reason)}")
    for name, words in _NAMES.items():
        old, new = (_shown(getattr(state, name)) for state in (before, after))
        if old != new:
            said.append(f"{words} {old} → {new}")
    return said


def sentences(
    lines: Sequence[ChangedLine], most: int = 30, count: int | None = None
) -> list[tuple[str, str]]:
    """The lines of a change, which has ``count`` of them; beyond ``most`` only how many more."""
    told = [sentence(line) for line in lines[:most]]
    rest = (len(lines) if count is None else count) - most
    return [*told, ("", f"and {plural(rest, 'more line', 'more lines')}")] if rest > 0 else told


def _shown(value: object) -> str:
    if isinstance(value, tuple):
        return isolate(" ".join(map(str, value))) or "none"
    return "none" if value is None or value == "" else f"“{isolate(str(value))}”"
