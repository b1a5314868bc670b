# SPDX-License-Identifier: LGPL-2.1-or-later
"""The boxes of the pane: made from entries, and read as plain text."""

from __future__ import annotations

from collections.abc import Iterable
from functools import reduce

from silo.workbench.activity.box import PaneEntry
from silo.workbench.activity.feed import Activity


def activity_of(entries: Iterable[PaneEntry]) -> Activity:
    """With these entries, added one after another."""
    return reduce(Activity.add, entries, Activity())


def entry_text(entry: PaneEntry) -> str:
    """A box as plain text."""
    parts = [entry.title]
    if entry.badges:
        parts.append("  ".join(badge.text for badge in entry.badges))
    for line in entry.lines:
        buttons = "".join(f" [{action.text}]" for action in line.actions)
        parts.append(line.text + buttons)
    if entry.actions:
        parts.append(" ".join(f"[{action.text}]" for action in entry.actions))
    return "\n".join(parts)
