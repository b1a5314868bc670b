# SPDX-License-Identifier: LGPL-2.1-or-later
"""How entries of the outbox stand, in words, for the pane and the command line."""

from __future__ import annotations

import math
from dataclasses import dataclass
from urllib.parse import urlsplit

from silo.api.pause import Pause
from silo.bom.errors import Translate, duration, english
from silo.outbox.entry import Entry, State


@dataclass(frozen=True)
class EntryStatusText:
    """How an entry stands, in words: its state, and why. ``urgent``: the user decides."""

    state: str
    reason: str
    urgent: bool


def status_text(
    entry: Entry, here: str, *, is_paused: bool, translate: Translate = english
) -> EntryStatusText:
    """Say in words how an entry stands. ``here``: the address in use, "" for none."""
    reason, urgent = entry.reason, entry.state is State.HELD or entry.is_away(here)
    if entry.is_away(here):
        meant = translate("Silo", "It is meant for {there}, which is not the server in use.")
        reason = "\n".join(filter(None, (meant.replace("{there}", host_of(entry.server)), reason)))
        state = translate("Silo", "for another server")
    elif entry.superseded:
        state = translate("Silo", "out of date")
        reason = translate("Silo", "A newer commit of it has arrived since; this one would undo it.")
    elif entry.state is State.HELD:
        state = translate("Silo", "held for your choice")
    elif entry.state is State.KEEPING:
        state = translate("Silo", "being copied")
        reason = reason or translate("Silo", "Its file is being copied.")
    elif is_paused:
        state = translate("Silo", "paused")
    else:
        state = translate("Silo", "tried again later") if reason else translate("Silo", "waiting")
    return EntryStatusText(state, reason, urgent)


def parts(entry: Entry, translate: Translate = english) -> str:
    """Say which part of an entry is not in Silo yet."""
    if entry.file_left and entry.bom_left:
        return translate("Silo", "file and BOM")
    return translate("Silo", "BOM") if entry.bom_left else translate("Silo", "file")


def pause_text(pause: Pause, server: str, now: float, translate: Translate = english) -> str:
    """Say why nothing is sent to a server now, and until when."""
    text = translate("Silo", "Nothing is sent to {host} before you retry: {reason}")
    if not math.isinf(left := pause.left(now)):
        text = translate("Silo", "Nothing is sent to {host} for {time}: {reason}")
    for name, value in (("host", host_of(server)), ("time", duration(left)), ("reason", pause.reason)):
        text = text.replace(f"{{{name}}}", value)
    return text


def host_of(address: str) -> str:
    """Return the host of an address, for users."""
    return urlsplit(address).netloc or address
