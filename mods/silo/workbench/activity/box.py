# SPDX-License-Identifier: LGPL-2.1-or-later
"""One box of the Database Activity pane, as plain values; the widgets only draw it (spec bom-sync §6).

Its texts are shown as text, never as markup, and are made safe here, once: the fields of a
:class:`PaneEntry` hold no control characters and are never longer than can be read.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum

from silo.workbench.tone import Tone
from silo.workbench.words import counted, plain, translate

MOST_LINES = 16


class EntryBatch(StrEnum):
    """What comes by the dozen."""

    COMMITTED = "committed"
    CREATED = "created"
    REVISED = "revised"


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


_ANSWERS = frozenset({Do.SAME, Do.DECIDE, Do.MEND, Do.SYNC_WITHOUT})


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

    @property
    def asks(self) -> bool:
        """Return True for a box of this FreeCAD that needs an answer of the user."""
        actions = (action for line in self.lines for action in line.actions)
        return bool(self.rank) and (self.tone is Tone.ERROR or any(one.do in _ANSWERS for one in actions))

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


def revision_key(number: str, revision: int) -> str:
    """Return the key of the box for a revision; the box of our own upload of it has the same."""
    return f"revision:{number}:{revision}"


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


def own_box(key: str, title: str, *lines: str, tone: Tone, icon: str = "silo-commit") -> PaneEntry:
    """Make a box of something that happens here and now; its lines have its tone."""
    made = tuple(EntryLine(text, tone) for text in lines)
    return PaneEntry(key, title, time.time(), tone, lines=made, rank=1, icon=icon)
