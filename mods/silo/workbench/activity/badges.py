# SPDX-License-Identifier: LGPL-2.1-or-later
"""The counts of a merge, each with its tone. Pure."""

from __future__ import annotations

from collections.abc import Iterable

from silo.api.wire import MergeDiff, MergeWarning
from silo.bom_sync.activity_text import MergeCount, count_texts, no_changes
from silo.workbench.activity.box import EntryLine
from silo.workbench.tone import Tone
from silo.workbench.words import translate


def badges(diff: MergeDiff, warnings: Iterable[MergeWarning] = ()) -> tuple[EntryLine, ...]:
    """Write the counts of a merge as the spec's box has them, without those that are zero."""
    texts = count_texts(diff, warnings, translate)
    if not texts:
        return (EntryLine(no_changes(translate), Tone.QUIET),)
    return tuple(EntryLine(text, _TONES[kind]) for kind, text in texts.items())


_TONES = {
    MergeCount.ADDED: Tone.GOOD,
    MergeCount.CHANGED: Tone.CHANGED,
    MergeCount.UNREFERENCED: Tone.WARNING,
    MergeCount.IN_CONFLICT: Tone.WARNING,
}
