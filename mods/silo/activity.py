# SPDX-License-Identifier: LGPL-2.1-or-later
"""A merge in the words of the Activity pane (spec bom-sync §6); plain text, never markup.

The command line shows them in English, the pane in the user's language: it passes its ``translate``.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from silo.api.wire import MergeDiff, MergeEvent, MergeResult, MergeWarning
from silo.bom.errors import Translate, english


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


class Count(StrEnum):
    """What a merge counts, in the order in which it is shown."""

    ADDED = "added"
    CHANGED = "changed"
    UNREFERENCED = "unreferenced"
    IN_CONFLICT = "in conflict"


def headline(item: str, translate: Translate = english) -> str:
    """``BOM Updated: ASM-001``."""
    return translate("Silo", "BOM Updated: {number}").replace("{number}", item)


def count_texts(
    diff: MergeDiff, warnings: Iterable[MergeWarning] = (), translate: Translate = english
) -> dict[Count, str]:
    """Each count of a merge in words, such as ``+1 added``, without those that are zero."""
    conflicts = sum(1 for warning in warnings if warning.type == "conflict")
    counted = (
        (Count.ADDED, len(diff.added), translate("Silo", "+{n} added")),
        (Count.CHANGED, len(diff.quantity_changed), translate("Silo", "~{n} qty changed")),
        (Count.UNREFERENCED, len(diff.removed), translate("Silo", "⚠{n} unreferenced")),
        (Count.IN_CONFLICT, conflicts, translate("Silo", "⚡{n} in conflict")),
    )
    return {kind: text.replace("{n}", str(count)) for kind, count, text in counted if count}


def no_changes(translate: Translate = english) -> str:
    """What stands there instead of counts."""
    return translate("Silo", "no changes")


def counts_text(diff: MergeDiff, warnings: Iterable[MergeWarning] = ()) -> str:
    """``+1 added  ~1 qty changed  ⚠1 unreferenced``, without what is zero."""
    return "  ".join(count_texts(diff, warnings).values()) or no_changes()


def unregistered_text(count: int, translate: Translate = english) -> str:
    """``2 components have no Silo part number``; "" for none."""
    one = translate("Silo", "{n} component has no Silo part number")
    many = translate("Silo", "{n} components have no Silo part number")
    return (one if count == 1 else many).replace("{n}", str(count)) if count else ""


def draft_text(result: MergeResult | None, translate: Translate = english) -> str:
    """Which draft a change of a released product is part of; "" if nothing of it is released."""
    draft = result.draft if result is not None else None
    if draft is None:
        return ""
    text = translate("Silo", "This is part of draft {draft}. Revision {released} stays released as it is.")
    return text.replace("{draft}", draft.label).replace("{released}", draft.released)


def rules_text(problem: str, translate: Translate = english) -> str:
    """That the site's category rules have a mistake, and which; "" where they have none."""
    text = translate("Silo", "The category rules of this Silo are not used until they are mended: {problem}")
    return text.replace("{problem}", problem) if problem else ""


def activity_text(
    item: str, merge: MergeEvent | MergeResult, *, resolve_url: str = "", unregistered: int = 0
) -> ActivityText:
    """The box of one merge; ``resolve_url`` overrides the event's (made absolute by the caller)."""
    without = unregistered_text(unregistered)
    return ActivityText(
        headline=headline(item),
        counts=counts_text(merge.diff, tuple(merge.warnings)),
        resolve_url=resolve_url or merge.resolve_url,
        unregistered=f"⚠ {without}" if without else "",
    )
