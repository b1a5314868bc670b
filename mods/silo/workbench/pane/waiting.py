# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is in the outbox, as rows of the pane: each with its reason, and what the user can do about it.

Pure.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from silo.api.address import canonical
from silo.outbox.entry import ASKED, State
from silo.outbox.entry import Entry as QueueEntry
from silo.outbox.status_text import host_of, parts, status_text
from silo.workbench.activity.box import Action, Do
from silo.workbench.words import counted, plain, spoken, translate

if TYPE_CHECKING:
    from silo.api.pause import Pause
    from silo.outbox.held_here import HeldHere
    from silo.workbench.colleagues.theirs import Theirs


# Lines of a BOM difference; a button shows all of them.
MOST_DETAILS = 3


@dataclass(frozen=True)
class WaitingRow:
    """One entry.

    urgent
        a user has to look at it.
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
    """Make a row of each entry; those that need a user come first.

    said
        the reason that the pane shows above them; no row repeats it.
    """
    here = _address(server_url)
    made = [_row(entry, here, (theirs or {}).get(entry.id), pause, said) for entry in entries]
    return tuple(sorted(made, key=lambda row: not row.urgent))


def can_send(entries: Iterable[QueueEntry], server_url: str) -> bool:
    """Return True if *Send now* would send something: not all entries wait for a decision, an address or
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


def held_rows(held: Iterable[HeldHere]) -> tuple[WaitingRow, ...]:
    """Make a row of each BOM that is held: why, and how it gets into Silo."""
    return tuple(_held_row(one) for one in held)


def _held_row(held: HeldHere) -> WaitingRow:
    return WaitingRow(
        title=plain(" ".join(filter(None, (held.part_number, held.label))), 80),
        what=translate("Silo", "BOM"),
        state=translate("Silo", "held: {why}", why=spoken(held.why)),
        since=held.since,
        urgent=True,
        actions=(
            Action(Do.MEND, translate("Silo", "Relink…"), document=held.path),
            Action(Do.SYNC_WITHOUT, translate("Silo", "Sync without what is missing"), document=held.path),
        ),
    )


def held_heading(count: int) -> str:
    """Say how many BOMs are held."""
    return counted(
        count,
        translate("Silo", "{n} BOM is held: Silo has the file, and the BOM of before"),
        translate("Silo", "{n} BOMs are held: Silo has the files, and the BOMs of before"),
    )


def _address(server_url: str) -> str:
    """Return the address in use in the form that entries have; "" for none."""
    return canonical(server_url) if server_url else ""


def _is_urgent(entry: QueueEntry, here: str) -> bool:
    """Return True if the entry waits for a decision, not for the server."""
    return entry.state is State.HELD or entry.is_away(here)


def _row(entry: QueueEntry, here: str, theirs: Theirs | None, pause: Pause | None, said: str) -> WaitingRow:
    row_words = status_text(entry, here, is_paused=pause is not None, translate=translate)
    text = "" if row_words.reason == said else row_words.reason
    details: list[str] = []
    more: tuple[Action, ...] = ()
    if theirs is not None and theirs.lines:
        # Late: FreeCAD's start waits for this module.
        from silo.workbench.colleagues.theirs import line_texts, more_text

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
