# SPDX-License-Identifier: LGPL-2.1-or-later
"""All boxes of the Database Activity pane, newest first. Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

from silo.workbench.activity.box import Action, EntryBatch, EntryLine, PaneEntry
from silo.workbench.tone import Tone
from silo.workbench.words import translate

MOST_ENTRIES = 300

# Seconds between two events of a batch; from how many events on they are one box; how many names it has.
PAUSE_S, FEWEST, MOST_NAMES = 60.0, 3, 6


def gathered(entries: Iterable[PaneEntry]) -> tuple[PaneEntry, ...]:
    """Merge the entries of one batch into one box.

    A batch has one kind and one person, and no pause of more than :data:`PAUSE_S`. Its box is at the place of
    its newest entry.
    """
    made: list[list[PaneEntry]] = []
    last: dict[tuple[str, str], list[PaneEntry]] = {}
    for entry in entries:
        group = last.get((entry.part_of, entry.who)) if entry.part_of else None
        if group is not None and group[-1].when - entry.when <= PAUSE_S:
            group.append(entry)
            continue
        group = [entry]
        made.append(group)
        if entry.part_of:
            last[entry.part_of, entry.who] = group
    pane_entries: list[PaneEntry] = []
    for group in made:
        pane_entries += group if len(group) < FEWEST else [_together(group)]
    return tuple(sorted(pane_entries, key=lambda entry: -entry.when))


def _together(group: list[PaneEntry]) -> PaneEntry:
    newest = group[0]
    words = {
        EntryBatch.COMMITTED: translate("Silo", "{n} items committed"),
        EntryBatch.CREATED: translate("Silo", "{n} new items"),
        EntryBatch.REVISED: translate("Silo", "{n} new revisions"),
    }
    names = [entry.title.partition(": ")[2] or entry.title for entry in reversed(group)]
    shown = ", ".join(names[:MOST_NAMES]) + (", …" if len(names) > MOST_NAMES else "")
    comments = dict.fromkeys(line.text for entry in group for line in entry.lines if line.tone is Tone.PLAIN)
    assert newest.part_of is not None
    return PaneEntry(
        key=f"batch:{group[-1].key}",
        title=words[newest.part_of].replace("{n}", str(len(group))),
        when=newest.when,
        who=newest.who,
        tone=newest.tone,
        lines=(EntryLine(shown, Tone.QUIET), *(EntryLine(text) for text in comments if len(comments) == 1)),
        icon=newest.icon,
    )


@dataclass(frozen=True)
class Activity:
    """All boxes, newest first; immutable, :meth:`add` gives the next state."""

    entries: tuple[PaneEntry, ...] = ()

    def add(self, entry: PaneEntry) -> Activity:
        """Add an entry. An entry with the same key and a higher rank is not replaced."""
        mine = {entry.key, *entry.also}
        # Events may come by the thousand, and hardly one has to do with another.
        related = [e for e in self.entries if e.key in mine or entry.key in e.also]
        if any(e.rank > entry.rank and entry.key in (e.key, *e.also) for e in related):
            return self
        rest = tuple(e for e in self.entries if e.key not in mine) if related else self.entries
        if entry.document:
            rest = tuple(
                e.without_questions() if e.document == entry.document and e.when <= entry.when else e
                for e in rest
            )
        place = next((i for i, e in enumerate(rest) if e.when <= entry.when), len(rest))
        return replace(self, entries=(*rest[:place], entry, *rest[place:])[:MOST_ENTRIES])

    def answered(self, is_answered: Callable[[Action], bool]) -> Activity:
        """Drop the buttons of answered questions (:meth:`PaneEntry.without_questions`)."""
        return replace(self, entries=tuple(e.without_questions(is_answered) for e in self.entries))
