# SPDX-License-Identifier: LGPL-2.1-or-later
"""The line at the top of the pane: how the connection is, in words and colours. Pure."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from silo.workbench.activity.box import Action, Do
from silo.workbench.tone import Tone
from silo.workbench.words import plain, spoken, translate

if TYPE_CHECKING:
    from silo.workbench.colleagues.announced import Newer
    from silo.workbench.session.state import PaneState


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
    if kind == "no-reader":
        text = translate(
            "Silo", "Live events need the package sseclient-py. What you commit is shown without it, too."
        )
        install = Action(Do.INSTALL, translate("Silo", "Install What Silo Needs…"))
        return Banner(text, Tone.QUIET, actions=(install, again))
    return Banner(translate("Silo", "{host} (live events are off)", host=host), Tone.QUIET)
