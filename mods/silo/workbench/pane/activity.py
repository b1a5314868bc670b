# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the Database Activity pane shows, as plain values; the widgets only draw them (spec bom-sync §6).

An :class:`Entry` is one box. Its texts are shown as text, never as markup, and are made safe here, once: the
fields of an entry hold no control characters and are never longer than can be read.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from enum import StrEnum

from silo.workbench.words import counted, plain, translate

MOST_ENTRIES = 300
MOST_LINES = 16


class Tone(StrEnum):
    """How a text is meant; the pane gives it a colour and a sign."""

    PLAIN = "plain"
    QUIET = "quiet"  # beside the point, such as a time
    GOOD = "good"
    CHANGED = "changed"
    WARNING = "warning"
    ERROR = "error"


class Batch(StrEnum):
    """What comes by the dozen."""

    COMMITTED = "committed"
    CREATED = "created"
    REVISED = "revised"


# Seconds between two of a batch; from so many on they are one box, which has so many names.
PAUSE_S, FEWEST, MOST_NAMES = 60.0, 3, 6


class Do(StrEnum):
    """What a button of the pane asks for."""

    VIEW = "view"  # open a page of the server
    SHOW = "show"  # select the instances in the 3D view and the tree
    REGISTER = "register"  # open the Register Parts dialog
    PREVIEW = "preview"  # open the BOM preview
    MEND = "mend"  # lead broken links to the files that were meant, in the preview
    SYNC_WITHOUT = "sync without"  # sync a BOM although components are missing
    SAME = "same"  # these files are the same part, on purpose
    DECIDE = "decide"  # a new part: opens the Register Parts dialog
    RETRY = "retry"  # send what waits in the outbox
    OPEN_THEIRS = "open theirs"  # open the colleague's revision that a held commit would undo
    TAKE_THEIRS = "take theirs"  # and take it in the place of one's own
    SEND_HERE = "send here"  # send what waits for another address to the server in use
    SAVE_COPY = "save copy"  # write the file of what waits somewhere else
    DISCARD = "discard"  # drop what waits in the outbox
    DETAILS = "details"  # show all lines of the BOM difference for which a commit is held
    STOP = "stop"  # end what a worker is doing
    SETTINGS = "settings"  # open the preferences


@dataclass(frozen=True)
class Action:
    """A button. ``document`` and ``objects`` are of the CAD model; ``target`` is a page or an id."""

    do: Do
    text: str
    target: str = ""
    document: str = ""
    objects: tuple[str, ...] = ()


@dataclass(frozen=True)
class Line:
    """One line of a box."""

    text: str
    tone: Tone = Tone.PLAIN
    actions: tuple[Action, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "text", plain(self.text, 400))


@dataclass(frozen=True)
class Entry:
    """One box of the pane.

    key
        a later entry with the same key takes the place of this one.
    rank
        but only if it knows at least as much: our own sync (1) is not replaced by the server's event (0).
    also
        the keys of other entries that this one includes or settles, such as the upload of the file.
    icon
        name of one of the add-on's icons.
    badges
        the counts, each with its tone: ``+1 added``, ``~1 qty changed``, ``⚠1 unreferenced``.
    part_of
        what many of these boxes say together, for one box in their place (:func:`gathered`); "" where a box
        has something of its own to say.
    document
        the assembly whose BOM was looked at, with all questions about it: older boxes ask no more.
    """

    key: str
    title: str
    when: float
    tone: Tone = Tone.PLAIN
    who: str = ""
    badges: tuple[Line, ...] = ()
    lines: tuple[Line, ...] = ()
    actions: tuple[Action, ...] = ()
    rank: int = 0
    also: tuple[str, ...] = ()
    icon: str = ""
    part_of: Batch | None = None
    document: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "title", plain(self.title))
        object.__setattr__(self, "who", plain(self.who, 60))
        if len(self.lines) > MOST_LINES:
            object.__setattr__(self, "lines", shortened(self.lines))

    def without_questions(self, is_answered: Callable[[Action], bool] = lambda _same: True) -> Entry:
        """Without the buttons of the questions about copied identities that have their answer.

        is_answered
            says so of a *Same part*.
        """
        answered = [
            any(action.do is Do.SAME and is_answered(action) for action in line.actions)
            for line in self.lines
        ]
        if not any(answered):
            return self
        lines = (
            replace(line, actions=()) if done else line
            for line, done in zip(self.lines, answered, strict=True)
        )
        return replace(self, lines=tuple(lines))


def not_in_silo_key(path: str) -> str:
    """The key of the box for a document without an item; a commit of it that arrives takes its place."""
    return f"not-in-silo:{path}"


def gathered(entries: Iterable[Entry]) -> tuple[Entry, ...]:
    """With one box for each batch: 54 registered parts are one piece of news, and bury nothing.

    A batch is of one kind and one person, and has no pause of more than :data:`PAUSE_S` in it. Its box stands
    where its newest one would.
    """
    made: list[list[Entry]] = []
    last: dict[tuple[str, str], list[Entry]] = {}
    for entry in entries:
        group = last.get((entry.part_of, entry.who)) if entry.part_of else None
        if group is not None and group[-1].when - entry.when <= PAUSE_S:
            group.append(entry)
            continue
        group = [entry]
        made.append(group)
        if entry.part_of:
            last[entry.part_of, entry.who] = group
    told: list[Entry] = []
    for group in made:
        told += group if len(group) < FEWEST else [_together(group)]
    return tuple(sorted(told, key=lambda entry: -entry.when))


def _together(group: list[Entry]) -> Entry:
    newest = group[0]
    words = {
        Batch.COMMITTED: translate("Silo", "{n} items committed"),
        Batch.CREATED: translate("Silo", "{n} new items"),
        Batch.REVISED: translate("Silo", "{n} new revisions"),
    }
    names = [entry.title.partition(": ")[2] or entry.title for entry in reversed(group)]
    shown = ", ".join(names[:MOST_NAMES]) + (", …" if len(names) > MOST_NAMES else "")
    comments = dict.fromkeys(line.text for entry in group for line in entry.lines if line.tone is Tone.PLAIN)
    assert newest.part_of is not None
    return Entry(
        key=f"batch:{group[-1].key}",
        title=words[newest.part_of].replace("{n}", str(len(group))),
        when=newest.when,
        who=newest.who,
        tone=newest.tone,
        lines=(Line(shown, Tone.QUIET), *(Line(text) for text in comments if len(comments) == 1)),
        icon=newest.icon,
    )


def shortened(
    lines: tuple[Line, ...], most: int = MOST_LINES, actions: tuple[Action, ...] = ()
) -> tuple[Line, ...]:
    """The first lines, and how many more there are; ``actions`` is the way to see those."""
    if len(lines) <= most:
        return lines
    left = len(lines) - most + 1
    more = counted(
        left,
        translate("Silo", "… and {n} more line"),
        translate("Silo", "… and {n} more lines; the preview shows all"),
    )
    return (*lines[: most - 1], Line(more, Tone.QUIET, actions))


@dataclass(frozen=True)
class Activity:
    """All boxes, newest first; immutable, :meth:`add` gives the next state."""

    entries: tuple[Entry, ...] = ()

    def add(self, entry: Entry) -> Activity:
        """With one more entry. One with the same key and a higher rank stays as it is."""
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
        """Without the buttons of questions that have their answer (:meth:`Entry.without_questions`)."""
        return replace(self, entries=tuple(e.without_questions(is_answered) for e in self.entries))
