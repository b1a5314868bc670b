# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a session shows, and who hears about it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from silo.outbox.entry import Entry as Waiting
from silo.outbox.entry import State
from silo.workbench.activity.feed import Activity
from silo.workbench.colleagues.announced import Newer
from silo.workbench.session.worker import Busy
from silo.workbench.settings.server import ServerChoice

if TYPE_CHECKING:
    from silo.api.pause import Pause
    from silo.outbox.held_here import HeldHere
    from silo.outbox.report import Sent
    from silo.workbench.colleagues.theirs import Theirs


@dataclass(frozen=True)
class PaneState:
    """Everything that the pane shows.

    waiting
        all that is in the outbox, oldest first.
    held
        the BOMs of this computer that Silo lacks, because they cannot be sent.
    pause
        why nothing is sent to the server now; None where nothing keeps it.
    theirs
        id in the outbox → what a colleague's revision changed, for commits that are held because of one; None
        where there is nothing to compare.
    newer
        UUID of an item → the newest commit of it that another FreeCAD has made since this one runs.
    presence
        the same in words, for the documents that are open.
    """

    server: ServerChoice = field(default_factory=ServerChoice)
    connection: str = "stopped"
    reason: str = ""
    busy: Busy | None = None
    waiting: tuple[Waiting, ...] = ()
    held: tuple[HeldHere, ...] = ()
    pause: Pause | None = None
    theirs: Mapping[int, Theirs | None] = field(default_factory=dict)
    activity: Activity = field(default_factory=Activity)
    newer: Mapping[str, Newer] = field(default_factory=dict)
    presence: tuple[str, ...] = ()

    def questions(self) -> frozenset[tuple[str, str]]:
        """Return the keys of all that needs an answer of the user: commits, BOMs, and boxes that ask."""
        urgent = {("commit", str(entry.id)) for entry in self.waiting if entry.state is State.HELD}
        boms = {("BOM", held.identity + held.why) for held in self.held}
        boxes = {("box", entry.key) for entry in self.activity.entries if entry.asks}
        return frozenset(urgent | boms | boxes)


@dataclass(frozen=True)
class Listener:
    """Who hears what happens in a session; all calls come through ``deliver``.

    shown
        something to show has changed.
    console
        a line for the report view.
    sent
        a commit of this FreeCAD arrived.
    bug
        an exception that should not have been.
    """

    shown: Callable[[PaneState], None] = lambda _shown: None
    console: Callable[[str], None] = lambda _text: None
    sent: Callable[[Sent], None] = lambda _sent: None
    bug: Callable[[BaseException], None] = lambda _error: None
