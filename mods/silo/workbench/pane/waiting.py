# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is in the outbox, as rows of the pane: each with its reason, and what a person can do about it.
Pure."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from silo.api.address import canonical
from silo.outbox.entry import ASKED, Entry, State
from silo.workbench.pane.activity import Action, Do
from silo.workbench.words import counted, plain, translate

if TYPE_CHECKING:
    from silo.workbench.commit.theirs import Theirs

# Lines of a BOM difference; a button shows all of them.
MOST_DETAILS = 3


@dataclass(frozen=True)
class Row:
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
    since: float
    reason: str = ""
    urgent: bool = False
    actions: tuple[Action, ...] = ()
    details: tuple[str, ...] = ()
    more: tuple[Action, ...] = ()


def rows(
    entries: Iterable[Entry],
    server_url: str,
    theirs: Mapping[int, Theirs | None] | None = None,
    said: str = "",
) -> tuple[Row, ...]:
    """The entries, those first that a person has to look at.

    said
        the reason that the pane shows above them; no row repeats it.
    """
    here = _address(server_url)
    made = [_row(entry, here, (theirs or {}).get(entry.id), said) for entry in entries]
    return tuple(sorted(made, key=lambda row: not row.urgent))


def can_send(entries: Iterable[Entry], server_url: str) -> bool:
    """True where *Send now* would send something: not all waits for a person, an address or settings."""
    here = _address(server_url)
    return bool(here) and not all(_is_urgent(entry, here) for entry in entries)


def heading(entries: Sequence[Entry], server_url: str) -> str:
    """How many things wait, and for whom."""
    here = _address(server_url)
    urgent = sum(_is_urgent(entry, here) for entry in entries)
    one, many = (
        translate("Silo", "{n} thing waits to be sent"),
        translate("Silo", "{n} things wait to be sent"),
    )
    if urgent == len(entries):
        one = translate("Silo", "{n} thing waits for your choice")
        many = translate("Silo", "{n} things wait for your choice")
    elif urgent:
        many += translate("Silo", ", {urgent} of them for your choice").replace("{urgent}", str(urgent))
    return counted(len(entries), one, many)


def meant_for_another(entries: Iterable[Entry], server_url: str) -> tuple[int, ...]:
    """Entries that wait for another address than the one in use."""
    here = _address(server_url)
    return tuple(entry.id for entry in entries if _is_away(entry, here))


def _address(server_url: str) -> str:
    """The address in use, as entries have theirs; "" for none."""
    return canonical(server_url) if server_url else ""


def _is_away(entry: Entry, here: str) -> bool:
    return bool(here) and entry.server not in ("", here)


def _is_urgent(entry: Entry, here: str) -> bool:
    """It waits for a person, not for the server."""
    return entry.state is State.HELD or _is_away(entry, here)


def _row(entry: Entry, here: str, theirs: Theirs | None, said: str) -> Row:
    away, urgent = _is_away(entry, here), _is_urgent(entry, here)
    text = "" if entry.reason == said else entry.reason
    if away:
        meant = translate("Silo", "It is meant for {there}, which is not the server in use.")
        text = "\n".join(filter(None, (meant.replace("{there}", host_of(entry.server)), text)))
    elif entry.superseded:
        text = translate("Silo", "A newer commit of it has arrived since; this one would undo it.")
    elif entry.state is State.KEEPING and not entry.reason:
        text = translate("Silo", "Its file is being copied.")
    details: list[str] = []
    more: tuple[Action, ...] = ()
    if theirs is not None and theirs.lines:
        # Late: FreeCAD's start waits for this module.
        from silo.workbench.commit.theirs import line_texts, more_text

        details = line_texts(theirs, MOST_DETAILS)
        if (left := len(theirs.lines) - MOST_DETAILS) > 0:
            more = (Action(Do.DETAILS, more_text(left), target=str(entry.id)),)
    return Row(
        title=plain(" ".join(filter(None, (entry.part_number, entry.label or entry.file_name))), 80),
        what=_what(entry),
        since=entry.taken_at,
        reason=plain(text, 400),
        urgent=urgent,
        actions=tuple(_actions(entry, here, away=away)) if urgent or entry.reason else (),
        details=tuple(details),
        more=more,
    )


def _actions(entry: Entry, here: str, *, away: bool) -> Iterable[Action]:
    target = str(entry.id)
    if away:
        text = translate("Silo", "Send to {host}").replace("{host}", host_of(here))
        yield Action(Do.SEND_HERE, text, target=target)
    elif entry.state is State.HELD and not entry.superseded:
        asked = entry.renamed == ASKED
        text = translate("Silo", "Same part") if asked else translate("Silo", "Retry")
        if entry.newer:
            # The choices of the commit dialog.
            if entry.path:
                yield Action(Do.OPEN_THEIRS, translate("Silo", "Open theirs beside mine"), target=target)
                yield Action(Do.TAKE_THEIRS, translate("Silo", "Take theirs"), target=target)
            text = translate("Silo", "Commit mine on top")
        yield Action(Do.RETRY, text, target=target)
        if asked:
            yield Action(Do.DECIDE, translate("Silo", "New part…"), document=entry.path)
    if entry.file_left:
        name = os.path.basename(entry.path) or entry.file_name
        yield Action(Do.SAVE_COPY, translate("Silo", "Save a copy…"), target=target, document=name)
    yield Action(Do.DISCARD, translate("Silo", "Discard"), target=target)


def _what(entry: Entry) -> str:
    if entry.file_left and entry.bom_left:
        return translate("Silo", "file and BOM")
    return translate("Silo", "BOM") if entry.bom_left else translate("Silo", "file")


def host_of(address: str) -> str:
    """An address as people read it."""
    return plain(urlsplit(address).netloc or address, 80)
