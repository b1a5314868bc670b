# SPDX-License-Identifier: LGPL-2.1-or-later
"""Changes of a BOM in plain words, for the pages."""

from __future__ import annotations

from collections.abc import Sequence

from silo_server.services.history import ChangedLine
from silo_server.values import LineState
from silo_server.web.render import quantity

_NAMES = {
    "unit": "unit",
    "reference_designators": "reference designators",
    "find_number": "find number",
    "notes": "notes",
    "child_revision": "revision",
    "rel_type": "relation",
}


def sentence(line: ChangedLine) -> str:
    """What one change made of one line: ``F01-0001 M8x20 Bolt: quantity 8 → 12``."""
    who = f"{line.child.part_number} {line.child.name}".strip()
    if line.before is None and line.after is not None:
        return f"{who}: added, quantity {quantity(line.after.quantity, line.after.unit)}"
    if line.after is None:
        return f"{who}: removed"
    assert line.before is not None  # a changed line has both states
    return f"{who}: {', '.join(changes(line.before, line.after)) or 'no visible change'}"


def changes(before: LineState, after: LineState) -> list[str]:
    """What differs between two states of a line."""
    said: list[str] = []
    if (before.quantity, before.unit) != (after.quantity, after.unit):
        said.append(
            f"quantity {quantity(before.quantity, before.unit)} → {quantity(after.quantity, after.unit)}"
        )
    if before.unreferenced_since is None and after.unreferenced_since is not None:
        said.append("no longer referenced by the assembly")
    if (
        before.unreferenced_since is not None
        and after.unreferenced_since is None
        and after.source == "assembly"
    ):
        said.append("referenced again")
    if before.source != after.source:
        kept = f" ({after.reason})" if after.reason else ""
        said.append(f"now a manual line{kept}" if after.source == "manual" else "now owned by the assembly")
    said += [
        f"{words} changed" for name, words in _NAMES.items() if getattr(before, name) != getattr(after, name)
    ]
    return said


def sentences(lines: Sequence[ChangedLine], most: int = 30) -> list[str]:
    """The lines of a change; beyond ``most`` only how many more."""
    told = [sentence(line) for line in lines[:most]]
    return [*told, f"and {len(lines) - most} more lines"] if len(lines) > most else told
