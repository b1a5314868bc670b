# SPDX-License-Identifier: LGPL-2.1-or-later
"""A merge in the words of the Activity pane (spec bom-sync §6); plain text, never markup."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from silo.api.wire import MergeDiff, MergeEvent, MergeResult, MergeWarning


@dataclass(frozen=True)
class ActivityText:
    """What one merge shows: a headline, the counts, and where a person decides."""

    headline: str
    counts: str
    resolve_url: str
    unregistered: str = ""

    def lines(self) -> tuple[str, ...]:
        """All of it, a line each."""
        link = "View in Silo →" if self.resolve_url else ""
        return tuple(line for line in (self.headline, self.counts, link, self.unregistered) if line)


class Counts(NamedTuple):
    """What a merge counts, in the order in which it is shown."""

    added: int
    changed: int
    unreferenced: int
    in_conflict: int


def counts(diff: MergeDiff, warnings: Iterable[MergeWarning] = ()) -> Counts:
    """The counts of a merge; the pane has its own, translated words for them."""
    conflicts = sum(1 for warning in warnings if warning.type == "conflict")
    return Counts(len(diff.added), len(diff.quantity_changed), len(diff.removed), conflicts)


def counts_text(diff: MergeDiff, warnings: Iterable[MergeWarning] = ()) -> str:
    """``+1 added  ~1 qty changed  ⚠1 unreferenced``, leaving out what is zero."""
    words = ("+{} added", "~{} qty changed", "⚠{} unreferenced", "⚡{} in conflict")
    parts = zip(words, counts(diff, warnings), strict=True)
    return "  ".join(text.format(count) for text, count in parts if count) or "no changes"


def unregistered_text(count: int) -> str:
    """``2 components have no Silo part number``; "" for none."""
    if not count:
        return ""
    return f"⚠ {count} {'component has' if count == 1 else 'components have'} no Silo part number"


def activity_text(
    item: str, merge: MergeEvent | MergeResult, *, resolve_url: str = "", unregistered: int = 0
) -> ActivityText:
    """The box of one merge; ``resolve_url`` overrides the event's (made absolute by the caller)."""
    return ActivityText(
        headline=f"BOM Updated: {item}",
        counts=counts_text(merge.diff, tuple(merge.warnings)),
        resolve_url=resolve_url or merge.resolve_url,
        unregistered=unregistered_text(unregistered),
    )
