# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a colleague did to a file since it was opened here, and the words for it. No widgets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from silo.bom.compare.three_states import ThreeLines
from silo.bom.items.naming import display_name
from silo.workbench.words import counted, filled, plain, quantity, translate

if TYPE_CHECKING:
    from silo.outbox.entry import Entry as QueueEntry


class Choice(StrEnum):
    """What a user wants to be done about a file that a colleague has changed."""

    LEAVE = "leave"  # leave mine out of this commit
    OPEN = "open"  # open theirs beside mine
    TAKE = "take"  # take theirs; mine is kept aside
    ON_TOP = "on top"  # commit mine on top of theirs


def choice_texts() -> dict[str, str]:
    """Return the values of the choices in words; the harmless one comes first."""
    return {
        Choice.LEAVE.value: translate("Silo", "leave out"),
        Choice.OPEN.value: translate("Silo", "open theirs beside mine"),
        Choice.TAKE.value: translate("Silo", "take theirs"),
        Choice.ON_TOP.value: translate("Silo", "commit mine on top"),
    }


@dataclass(frozen=True)
class Theirs:
    """A colleague's state of a file.

    part_number, revision
        theirs in Silo; "" and 0 where it is only the file on disk that is another one.
    base
        the number of the revision that mine was made from; None if it is unknown.
    lines
        the BOM base → theirs → mine, for assemblies.
    """

    path: str
    part_number: str = ""
    revision: int = 0
    who: str = ""
    when: float | None = None
    comment: str = ""
    base: int | None = None
    lines: tuple[ThreeLines, ...] = ()
    newer: Mapping[str, Any] | None = None

    @property
    def headline(self) -> str:
        """Say who committed which revision, and from what mine was made."""
        if not self.revision:
            return translate("Silo", "the file on disk was changed since you opened it")
        if self.base is None:
            base = translate("Silo", "a file that is no revision in Silo")
        else:
            base = translate("Silo", "revision {n}", n=self.base)
        who = plain(self.who, 60) or translate("Silo", "Somebody")
        return translate(
            "Silo",
            "{who} committed revision {n}; yours was made from {base}",
            base=base,
            n=self.revision,
            who=who,
        )


def of_held(entry: QueueEntry) -> Theirs:
    """Return the revision that a held commit of the outbox would undo, as it was when the commit was to be
    sent.
    """
    return theirs_of(entry.path, entry.part_number, entry.newer)


def theirs_of(path: str, part_number: str, newer: Mapping[str, Any]) -> Theirs:
    """Describe a revision that is newer than the one from which a file was made, in plain values."""
    return Theirs(
        path,
        part_number,
        newer["revision_number"],
        newer.get("created_by") or "",
        comment=newer.get("comment") or "",
        newer=newer,
    )


def line_words(line: ThreeLines, *, known: bool = True) -> str:
    """Write ``Bolt: 6 → 4 by them, 8 by you``; ``known``: True if the base is known."""
    base, theirs, mine = (quantity(value) for value in line.quantities)
    name = plain(display_name(line.entry) or line.entry.object_name, 60)
    if not known:
        text = translate("Silo", "{name}: {theirs} in theirs, {mine} in yours")
    elif line.by_them and line.by_me and theirs == mine:
        text = translate("Silo", "{name}: {base} → {mine} by both of you")
    elif line.by_them and line.by_me:
        text = translate("Silo", "{name}: {base} → {theirs} by them, {mine} by you")
    elif line.by_them:
        text = translate("Silo", "{name}: {base} → {theirs} by them, as before in yours")
    else:
        text = translate("Silo", "{name}: {base} → {mine} by you, as before in theirs")
    return filled(text, name=name, base=base, theirs=theirs, mine=mine)


def line_texts(theirs: Theirs, most: int | None = None) -> list[str]:
    """Write the lines of a change, at most ``most`` of them."""
    return [line_words(line, known=theirs.base is not None) for line in theirs.lines[:most]]


def more_text(left: int) -> str:
    """Return the text of the button that shows the rest."""
    return counted(left, translate("Silo", "… and {n} more line"), translate("Silo", "… and {n} more lines"))
