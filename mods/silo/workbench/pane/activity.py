# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the Database Activity pane shows, as plain values; the widgets only draw them (spec bom-sync §6).

A :class:`PaneEntry` is a box. Its texts are shown as text, never as markup, and are made safe here, once: the
fields of an entry hold no control characters and are never longer than can be read.

What is in the outbox, as rows of the pane: each with its reason, and what a person can do about it.
Pure.

The line at the top of the pane: how the connection is, in words and colours. Pure.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from silo.api.address import canonical
from silo.outbox.entry import ASKED, State, host_of, parts, words
from silo.outbox.entry import Entry as QueueEntry
from silo.workbench.words import counted, plain, spoken, translate

if TYPE_CHECKING:
    from silo.api.pause import Pause
    from silo.workbench.commit.flow import Theirs
    from silo.workbench.session.session import Newer, PaneState


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


class EntryBatch(StrEnum):
    """What comes by the dozen."""

    COMMITTED = "committed"
    CREATED = "created"
    REVISED = "revised"


# Seconds between two events of a batch; from how many events on they are one box; how many names it has.
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
    COMPARE = "compare"  # show it as a ghost beside one's own
    TAKE_THEIRS = "take theirs"  # and take it in the place of one's own
    SEND_HERE = "send here"  # send what waits for another address to the server in use
    SAVE_COPY = "save copy"  # write the file of what waits somewhere else
    DISCARD = "discard"  # drop what waits in the outbox
    DETAILS = "details"  # show all lines of the BOM difference for which a commit is held
    STOP = "stop"  # end what a worker is doing
    SETTINGS = "settings"  # open the preferences
    INSTALL = "install"  # install the Python packages that are missing


@dataclass(frozen=True)
class Action:
    """A button. ``document`` and ``objects`` are of the CAD model; ``target`` is a page or an id."""

    do: Do
    text: str
    target: str = ""
    document: str = ""
    objects: tuple[str, ...] = ()


@dataclass(frozen=True)
class EntryLine:
    """One line of a box."""

    text: str
    tone: Tone = Tone.PLAIN
    actions: tuple[Action, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "text", plain(self.text, 400))


@dataclass(frozen=True)
class PaneEntry:
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
    badges: tuple[EntryLine, ...] = ()
    lines: tuple[EntryLine, ...] = ()
    actions: tuple[Action, ...] = ()
    rank: int = 0
    also: tuple[str, ...] = ()
    icon: str = ""
    part_of: EntryBatch | None = None
    document: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "title", plain(self.title))
        object.__setattr__(self, "who", plain(self.who, 60))
        if len(self.lines) > MOST_LINES:
            object.__setattr__(self, "lines", shortened(self.lines))

    def without_questions(self, is_answered: Callable[[Action], bool] = lambda _same: True) -> PaneEntry:
        """Drop the buttons of answered questions about copied identities.

        is_answered
            returns True for the action of an answered *Same part*.
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
    """Return the key of the box for a document without an item; the box of a commit that arrives
    replaces it.
    """
    return f"not-in-silo:{path}"


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


def shortened(
    lines: tuple[EntryLine, ...], most: int = MOST_LINES, actions: tuple[Action, ...] = ()
) -> tuple[EntryLine, ...]:
    """Return the first lines, and a line with the number of further ones; ``actions`` lead to these."""
    if len(lines) <= most:
        return lines
    left = len(lines) - most + 1
    more = counted(
        left,
        translate("Silo", "… and {n} more line"),
        translate("Silo", "… and {n} more lines; the preview shows all"),
    )
    return (*lines[: most - 1], EntryLine(more, Tone.QUIET, actions))


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


# Ground and ink; yellow read-only, orange degraded, red offline, as the Kindred workbench has them.
_YELLOW, _ORANGE, _RED = ("#ffe08a", "#4a3b00"), ("#ffc078", "#5c2b00"), ("#f8b4b9", "#5f0a12")

_MOST_PRESENT = 5


@dataclass(frozen=True)
class Banner:
    """What the banner says; ``ground`` is "" where it should not stand out."""

    text: str
    tone: Tone = Tone.PLAIN
    ground: str = ""
    ink: str = ""
    actions: tuple[Action, ...] = ()


def presence_text(newer: Newer, label: str) -> str:
    """Say that a colleague committed a document since it was opened."""
    return translate(
        "Silo",
        "{who} committed {name} (revision {n}) since you opened it.",
        who=newer.who or translate("Silo", "Somebody"),
        name=plain(f"{newer.part_number} {label}", 60),
        n=newer.revision,
    )


def banner(shown: PaneState) -> Banner:
    """Make the banner for a state: the connection, and what colleagues committed of the open documents."""
    made = _connection(shown)
    if not shown.presence:
        return made
    more = shown.presence[:_MOST_PRESENT]
    left = len(shown.presence) - len(more)
    if left:
        more = (*more, translate("Silo", "… and {n} more", n=left))
    ground, ink = (made.ground, made.ink) if made.ground else _YELLOW
    return replace(made, text="\n".join((made.text, *more)), ground=ground, ink=ink)


def _connection(shown: PaneState) -> Banner:
    settings = Action(Do.SETTINGS, translate("Silo", "Settings…"))
    again = Action(Do.RETRY, translate("Silo", "Try again"))
    if shown.connection == "packages":
        mend = Action(Do.INSTALL, translate("Silo", "Install What Silo Needs…"))
        return Banner(plain(spoken(shown.reason), 400), ground=_RED[0], ink=_RED[1], actions=(mend, again))
    if not shown.server.configured:
        text = translate("Silo", "No Silo server is set up yet.")
        return Banner(text, Tone.QUIET, actions=(settings,))
    host = plain(urlsplit(shown.server.url).netloc or shown.server.url, 80)
    reason = plain(spoken(shown.reason), 300)
    kind = shown.connection
    if kind == "online":
        return Banner("● " + translate("Silo", "Connected to {host}", host=host), Tone.GOOD)
    if kind == "read-only":
        text = translate(
            "Silo", "{host} is read-only now. Commits wait here until it takes changes again.", host=host
        )
        return Banner(text, ground=_YELLOW[0], ink=_YELLOW[1])
    if kind == "degraded":
        text = translate("Silo", "{host} works only in part. What cannot be sent waits here.", host=host)
        return Banner(text, ground=_ORANGE[0], ink=_ORANGE[1])
    if kind == "offline":
        text = translate("Silo", "No connection to {host}. Commits wait here and are sent later.", host=host)
        sentence = "\n".join(filter(None, (text, reason[:1].upper() + reason[1:])))
        return Banner(sentence, ground=_RED[0], ink=_RED[1], actions=(again,))
    if kind == "refused":
        text = translate("Silo", "{host} does not accept the token.", host=host)
        return Banner(text, ground=_RED[0], ink=_RED[1], actions=(settings, again))
    if kind == "connecting":
        return Banner(translate("Silo", "Connecting to {host}…", host=host), Tone.QUIET)
    if kind == "unsupported":
        text = translate("Silo", "{host} sends no live events; what you commit is shown anyway.", host=host)
        return Banner(text, Tone.QUIET)
    return Banner(translate("Silo", "{host} (live events are off)", host=host), Tone.QUIET)


# Lines of a BOM difference; a button shows all of them.
MOST_DETAILS = 3


@dataclass(frozen=True)
class WaitingRow:
    """One entry.

    urgent
        a person has to look at it.
    since
        seconds since 1970.
    details, more
        the BOM base → theirs → mine, for a commit that is held because of a colleague's: its first lines, and
        the button that shows all.
    """

    title: str
    what: str
    state: str
    since: float
    reason: str = ""
    urgent: bool = False
    actions: tuple[Action, ...] = ()
    details: tuple[str, ...] = ()
    more: tuple[Action, ...] = ()


def rows(
    entries: Iterable[QueueEntry],
    server_url: str,
    theirs: Mapping[int, Theirs | None] | None = None,
    said: str = "",
    pause: Pause | None = None,
) -> tuple[WaitingRow, ...]:
    """Make a row of each entry; those that need a person come first.

    said
        the reason that the pane shows above them; no row repeats it.
    """
    here = _address(server_url)
    made = [_row(entry, here, (theirs or {}).get(entry.id), pause, said) for entry in entries]
    return tuple(sorted(made, key=lambda row: not row.urgent))


def can_send(entries: Iterable[QueueEntry], server_url: str) -> bool:
    """Return True if *Send now* would send something: not all entries wait for a person, an address or
    settings.
    """
    here = _address(server_url)
    # The same press also sends what a server that was set back has lost.
    return bool(here) and not all(
        _is_urgent(entry, here) and (entry.is_away(here) or not entry.newer.get("set_back"))
        for entry in entries
    )


def heading(entries: Sequence[QueueEntry], server_url: str) -> str:
    """Say how many entries wait, and for whom."""
    here = _address(server_url)
    urgent = sum(_is_urgent(entry, here) for entry in entries)
    text, many = (
        translate("Silo", "{n} thing waits to be sent"),
        translate("Silo", "{n} things wait to be sent"),
    )
    if urgent == len(entries):
        text = translate("Silo", "{n} thing waits for your choice")
        many = translate("Silo", "{n} things wait for your choice")
    elif urgent:
        many += translate("Silo", ", {urgent} of them for your choice", urgent=urgent)
    return counted(len(entries), text, many)


def meant_for_another(entries: Iterable[QueueEntry], server_url: str) -> tuple[int, ...]:
    """Return the numbers of the entries for another address than the one in use."""
    here = _address(server_url)
    return tuple(entry.id for entry in entries if entry.is_away(here))


def _address(server_url: str) -> str:
    """Return the address in use in the form that entries have; "" for none."""
    return canonical(server_url) if server_url else ""


def _is_urgent(entry: QueueEntry, here: str) -> bool:
    """Return True if the entry waits for a person, not for the server."""
    return entry.state is State.HELD or entry.is_away(here)


def _row(entry: QueueEntry, here: str, theirs: Theirs | None, pause: Pause | None, said: str) -> WaitingRow:
    row_words = words(entry, here, is_paused=pause is not None, translate=translate)
    text = "" if row_words.reason == said else row_words.reason
    details: list[str] = []
    more: tuple[Action, ...] = ()
    if theirs is not None and theirs.lines:
        # Late: FreeCAD's start waits for this module.
        from silo.workbench.commit.flow import line_texts, more_text

        details = line_texts(theirs, MOST_DETAILS)
        names = tuple(name for line in theirs.lines for name in line.entry.instances)
        if names:
            more = (Action(Do.SHOW, translate("Silo", "Show"), document=entry.path, objects=names),)
        if (left := len(theirs.lines) - MOST_DETAILS) > 0:
            more += (Action(Do.DETAILS, more_text(left), target=str(entry.id)),)
    return WaitingRow(
        title=plain(" ".join(filter(None, (entry.part_number, entry.label or entry.file_name))), 80),
        what=parts(entry, translate),
        state=row_words.state,
        since=entry.taken_at,
        reason=plain(spoken(text), 400),
        urgent=row_words.urgent,
        actions=tuple(_actions(entry, here)) if row_words.urgent or entry.reason else (),
        details=tuple(details),
        more=more,
    )


def _actions(entry: QueueEntry, here: str) -> Iterable[Action]:
    target = str(entry.id)
    if entry.is_away(here):
        text = translate("Silo", "Send to {host}", host=plain(host_of(here), 80))
        yield Action(Do.SEND_HERE, text, target=target)
    elif entry.state is State.HELD and not entry.superseded:
        asked = entry.renamed == ASKED
        text = translate("Silo", "Same part") if asked else translate("Silo", "Retry")
        if entry.newer and not entry.newer.get("set_back"):
            # The choices of the commit dialog.
            if entry.path:
                yield Action(Do.OPEN_THEIRS, translate("Silo", "Open theirs beside mine"), target=target)
                number = entry.newer.get("revision_number", "")
                text = translate("Silo", "Compare with revision {n}", n=number)
                yield Action(Do.COMPARE, text, target=target)
                yield Action(Do.TAKE_THEIRS, translate("Silo", "Take theirs"), target=target)
            text = translate("Silo", "Commit mine on top")
        yield Action(Do.RETRY, text, target=target)
        if asked:
            yield Action(Do.DECIDE, translate("Silo", "New part…"), document=entry.path)
    if entry.file_left:
        name = os.path.basename(entry.path) or entry.file_name
        yield Action(Do.SAVE_COPY, translate("Silo", "Save a copy…"), target=target, document=name)
    yield Action(Do.DISCARD, translate("Silo", "Discard"), target=target)
