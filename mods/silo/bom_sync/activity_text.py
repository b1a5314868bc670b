# SPDX-License-Identifier: LGPL-2.1-or-later
"""A merge in the words of the Activity pane (spec bom-sync §6): plain text, never markup.

The command line shows it in English, the pane in the user's language: it passes its ``translate``.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from silo.api.wire import MergeDiff, MergeEvent, MergeResult, MergeWarning, ProductSummary, Revision
from silo.bom.errors import Translate, english
from silo.bom.message import message


@dataclass(frozen=True)
class ActivityText:
    """What one merge shows: a headline, the counts, and where a reviewer decides."""

    headline: str
    counts: str
    resolve_url: str
    unregistered: str = ""

    def lines(self) -> tuple[str, ...]:
        """Return all texts of the box, a line each."""
        link = message("View in Silo →") if self.resolve_url else ""
        return tuple(line for line in (self.headline, self.counts, link, self.unregistered) if line)


class MergeCount(StrEnum):
    """What a merge counts, in the order in which it is shown."""

    ADDED = "added"
    CHANGED = "changed"
    UNREFERENCED = "unreferenced"
    IN_CONFLICT = "in conflict"


def headline(item: str, translate: Translate = english) -> str:
    """Write ``BOM Updated: ASM-001``."""
    return translate("Silo", "BOM Updated: {number}").replace("{number}", item)


def count_texts(
    diff: MergeDiff, warnings: Iterable[MergeWarning] = (), translate: Translate = english
) -> dict[MergeCount, str]:
    """Write each count of a merge that is not zero in words, such as ``+1 added``."""
    conflicts = sum(1 for warning in warnings if warning.type == "conflict")
    counted = (
        (MergeCount.ADDED, len(diff.added), translate("Silo", "+{n} added")),
        (MergeCount.CHANGED, len(diff.quantity_changed), translate("Silo", "~{n} qty changed")),
        (MergeCount.UNREFERENCED, len(diff.removed), translate("Silo", "⚠{n} unreferenced")),
        (MergeCount.IN_CONFLICT, conflicts, translate("Silo", "⚡{n} in conflict")),
    )
    return {kind: text.replace("{n}", str(count)) for kind, count, text in counted if count}


def no_changes(translate: Translate = english) -> str:
    """Return the text that replaces the counts if all are zero."""
    return translate("Silo", "no changes")


def counts_text(diff: MergeDiff, warnings: Iterable[MergeWarning] = ()) -> str:
    """Write ``+1 added ~1 qty changed ⚠1 unreferenced``, without counts that are zero."""
    return "  ".join(count_texts(diff, warnings).values()) or no_changes()


def unregistered_text(count: int, translate: Translate = english) -> str:
    """Write ``2 components have no Silo part number``; "" for none."""
    text = translate("Silo", "{n} component has no Silo part number")
    many = translate("Silo", "{n} components have no Silo part number")
    return (text if count == 1 else many).replace("{n}", str(count)) if count else ""


def draft_text(result: MergeResult | Revision | None, translate: Translate = english) -> str:
    """Say which draft a change of a released product is part of; "" if it is not part of one."""
    draft = result.draft if result is not None else None
    if draft is None:
        return ""
    text = translate("Silo", "This is part of draft {draft}. Revision {released} stays released as it is.")
    return text.replace("{draft}", draft.label).replace("{released}", draft.released)


def summary_texts(summary: ProductSummary, translate: Translate = english) -> tuple[list[str], list[str]]:
    """Say what is open in each BOM of a product, and what the product weighs and costs, as the server
    has it.
    """
    texts: list[str] = [
        message("{number}: {words}", number=number, words=words)
        for number, words in (*summary.open.items(), *summary.incomplete.items())
    ]
    mass = (
        message("{total_mass_kg} kg", total_mass_kg=f"{summary.total_mass_kg:g}")
        if summary.total_mass_kg
        else ""
    )
    costs = ", ".join(f"{total.total_cost:.2f} {total.currency}" for total in summary.totals)
    values: list[str] = []
    for value, lacking in ((mass, summary.mass_missing), (costs, summary.cost_missing)):
        text = translate("Silo", "{value} for {n} of {all} parts") if lacking.count else "{value}"
        text = text.replace("{n}", str(summary.parts - lacking.count)).replace("{all}", str(summary.parts))
        values += [text.replace("{value}", value)] if value else []
    return texts, values


def rules_text(problem: str, translate: Translate = english) -> str:
    """Say which mistake the site's category rules have; "" if they have none."""
    text = translate("Silo", "The category rules of this Silo are not used until they are mended: {problem}")
    return text.replace("{problem}", problem) if problem else ""


def activity_text(
    item: str, merge: MergeEvent | MergeResult, *, resolve_url: str = "", unregistered: int = 0
) -> ActivityText:
    """Make the box of one merge; ``resolve_url`` (made absolute by the caller) overrides the event's."""
    without = unregistered_text(unregistered)
    return ActivityText(
        headline=headline(item),
        counts=counts_text(merge.diff, tuple(merge.warnings)),
        resolve_url=resolve_url or merge.resolve_url,
        unregistered=message("⚠ {without}", without=without) if without else "",
    )
