# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is in the outbox, as rows of the pane: each with its reason, and what a person can do about it.
Pure.

The line at the top of the pane: how the connection is, in words and colours. Pure.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from silo.api.config import canonical
from silo.outbox.entry import ASKED, State, host_of, parts, words
from silo.outbox.entry import Entry as QueueEntry
from silo.workbench.pane.activity import Action, Do, Tone
from silo.workbench.session.session import Newer, Shown
from silo.workbench.words import counted, plain, translate

if TYPE_CHECKING:
    from silo.api.config import Pause
    from silo.workbench.commit.flow import Theirs


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
    """That a colleague committed a document since it was opened."""
    text = translate("Silo", "{who} committed {name} (revision {n}) since you opened it.")
    for key, value in (
        ("{who}", newer.who or translate("Silo", "Somebody")),
        ("{name}", plain(f"{newer.part_number} {label}", 60)),
        ("{n}", str(newer.revision)),
    ):
        text = text.replace(key, value)
    return text


def banner(shown: Shown) -> Banner:
    """The banner for a state: the connection, and what colleagues committed of the open documents."""
    made = _connection(shown)
    if not shown.presence:
        return made
    more = shown.presence[:_MOST_PRESENT]
    left = len(shown.presence) - len(more)
    if left:
        more = (*more, translate("Silo", "… and {n} more").replace("{n}", str(left)))
    ground, ink = (made.ground, made.ink) if made.ground else _YELLOW
    return replace(made, text="\n".join((made.text, *more)), ground=ground, ink=ink)


def _connection(shown: Shown) -> Banner:
    settings = Action(Do.SETTINGS, translate("Silo", "Settings…"))
    again = Action(Do.RETRY, translate("Silo", "Try again"))
    if not shown.server.configured:
        text = translate("Silo", "No Silo server is set up yet.")
        return Banner(text, Tone.QUIET, actions=(settings,))
    host = plain(urlsplit(shown.server.url).netloc or shown.server.url, 80)
    reason = plain(shown.reason, 300)
    kind = shown.connection
    if kind == "online":
        return Banner("● " + translate("Silo", "Connected to {host}").replace("{host}", host), Tone.GOOD)
    if kind == "read-only":
        text = translate("Silo", "{host} is read-only now. Commits wait here until it takes changes again.")
        return Banner(text.replace("{host}", host), ground=_YELLOW[0], ink=_YELLOW[1])
    if kind == "degraded":
        text = translate("Silo", "{host} works only in part. What cannot be sent waits here.")
        return Banner(text.replace("{host}", host), ground=_ORANGE[0], ink=_ORANGE[1])
    if kind == "offline":
        text = translate("Silo", "No connection to {host}. Commits wait here and are sent later.")
        told = "\n".join(filter(None, (text.replace("{host}", host), reason[:1].upper() + reason[1:])))
        return Banner(told, ground=_RED[0], ink=_RED[1], actions=(again,))
    if kind == "refused":
        text = translate("Silo", "{host} does not accept the token.").replace("{host}", host)
        return Banner(text, ground=_RED[0], ink=_RED[1], actions=(settings, again))
    if kind == "connecting":
        return Banner(translate("Silo", "Connecting to {host}…").replace("{host}", host), Tone.QUIET)
    if kind == "unsupported":
        text = translate("Silo", "{host} sends no live events; what you commit is shown all the same.")
        return Banner(text.replace("{host}", host), Tone.QUIET)
    return Banner(translate("Silo", "{host} (live events are off)").replace("{host}", host), Tone.QUIET)


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
) -> tuple[Row, ...]:
    """The entries, those first that a person has to look at.

    said
        the reason that the pane shows above them; no row repeats it.
    """
    here = _address(server_url)
    made = [_row(entry, here, (theirs or {}).get(entry.id), pause, said) for entry in entries]
    return tuple(sorted(made, key=lambda row: not row.urgent))


def can_send(entries: Iterable[QueueEntry], server_url: str) -> bool:
    """True where *Send now* would send something: not all waits for a person, an address or settings."""
    here = _address(server_url)
    # What a server that was set back has lost is sent by the same press.
    return bool(here) and not all(
        _is_urgent(entry, here) and (entry.is_away(here) or not entry.newer.get("set_back"))
        for entry in entries
    )


def heading(entries: Sequence[QueueEntry], server_url: str) -> str:
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


def meant_for_another(entries: Iterable[QueueEntry], server_url: str) -> tuple[int, ...]:
    """Entries that wait for another address than the one in use."""
    here = _address(server_url)
    return tuple(entry.id for entry in entries if entry.is_away(here))


def _address(server_url: str) -> str:
    """The address in use, as entries have theirs; "" for none."""
    return canonical(server_url) if server_url else ""


def _is_urgent(entry: QueueEntry, here: str) -> bool:
    """It waits for a person, not for the server."""
    return entry.state is State.HELD or entry.is_away(here)


def _row(entry: QueueEntry, here: str, theirs: Theirs | None, pause: Pause | None, said: str) -> Row:
    told = words(entry, here, is_paused=pause is not None, translate=translate)
    text = "" if told.reason == said else told.reason
    details: list[str] = []
    more: tuple[Action, ...] = ()
    if theirs is not None and theirs.lines:
        # Late: FreeCAD's start waits for this module.
        from silo.workbench.commit.flow import line_texts, more_text

        details = line_texts(theirs, MOST_DETAILS)
        if (left := len(theirs.lines) - MOST_DETAILS) > 0:
            more = (Action(Do.DETAILS, more_text(left), target=str(entry.id)),)
    return Row(
        title=plain(" ".join(filter(None, (entry.part_number, entry.label or entry.file_name))), 80),
        what=parts(entry, translate),
        state=told.state,
        since=entry.taken_at,
        reason=plain(text, 400),
        urgent=told.urgent,
        actions=tuple(_actions(entry, here)) if told.urgent or entry.reason else (),
        details=tuple(details),
        more=more,
    )


def _actions(entry: QueueEntry, here: str) -> Iterable[Action]:
    target = str(entry.id)
    if entry.is_away(here):
        text = translate("Silo", "Send to {host}").replace("{host}", plain(host_of(here), 80))
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
