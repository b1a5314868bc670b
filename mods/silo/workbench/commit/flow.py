# SPDX-License-Identifier: LGPL-2.1-or-later
"""A commit from the press of the button to the worker: ask, save, snapshot, hand over. GUI thread.

Each document is saved in a turn of the event loop of its own, so that the window stays alive between them.
"""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from silo.bom.errors import SiloError
from silo.workbench.commit import snapshot
from silo.workbench.commit.decisions import Decisions
from silo.workbench.commit.dialog import CommitDialog, refusal
from silo.workbench.commit.plan import Plan, Row, State, Taken, Taker, plan
from silo.workbench.commit.snapshot import Snapshot
from silo.workbench.freecad import host, live, saving
from silo.workbench.gui import qt, widgets
from silo.workbench.pane.activity import Action, Do, Entry, Line, Tone
from silo.workbench.session.session import Session
from silo.workbench.session.spool import Commit, new_key
from silo.workbench.settings.preferences import ALLOW, Preferences
from silo.workbench.words import translate


class LiveDocuments:
    """FreeCAD's documents, as :class:`silo.workbench.commit.plan.Documents` wants them."""

    linked = staticmethod(host.linked_documents)
    is_partial = staticmethod(host.is_partial)
    is_modified = staticmethod(saving.is_modified)
    is_writable = staticmethod(saving.is_writable)
    lost_assemblies = staticmethod(live.lost_assemblies)
    save = staticmethod(saving.save)


def take_snapshot(doc: Any) -> Snapshot:
    """Snapshot of a live document; the assembly that is active in the 3D view decides between several."""
    cached = live.cached_document(doc)
    active = host.active_assembly() if host.has_gui() else None
    hint = cached.getObject(active.Name) if active is not None and active.Document == doc else None
    return snapshot.take(cached, assembly=hint, walk=live.extract_object)


class CommitFlow:
    """Commits documents, one commit after another."""

    def __init__(self, session: Session, preferences: Preferences) -> None:
        self._session, self._preferences = session, preferences
        self.decisions = Decisions()
        self._taker = Taker(LiveDocuments(), take_snapshot, session.spool.hold, new_key)
        self._turns: deque[tuple[Iterator[Taken], str]] = deque()
        self._asked_for: set[str] = set()

    @property
    def running(self) -> bool:
        """True while documents are being saved."""
        return bool(self._turns)

    def was_asked_for(self, key: str) -> bool:
        """True for the commit of a document that a person committed, not one below it."""
        return key in self._asked_for

    def start(self, doc: Any) -> None:
        """Commit a document: ask where there is something to ask, then go on without waiting."""
        if not doc.FileName:
            # FreeCAD's own dialog asks for the name.
            host.run_command("Std_Save")
        planned = plan(doc, LiveDocuments())
        if text := refusal(planned):
            if planned.top.state is not State.UNNAMED:
                widgets.warn(host.main_window(), translate("Silo", "Commit to Silo"), text)
            return
        rows, comment = planned.rows, ""
        if self._preferences.flag("AskComment") or not planned.is_simple:
            dialog = CommitDialog(planned, host.main_window(), note=self._note(planned))
            if not qt.run_dialog(dialog):
                return
            rows, comment = dialog.chosen(), dialog.text()
        self.run(rows, comment)

    def run(self, rows: tuple[Row, ...], comment: str = "") -> None:
        """Commit these documents, in order, after those of an earlier commit."""
        self._turns.append((self._taker.each(rows), comment))
        if len(self._turns) == 1:
            qt.later(0, self._turn)

    def sync_only(self, doc: Any) -> None:
        """Sync the BOM of a document whose file somebody else has committed (``Origin_Commit`` of a fork)."""
        try:
            taken = take_snapshot(doc)
        except SiloError as error:
            self._tell_error(str(doc.Label), str(error))
            return
        if taken.identity and taken.is_assembly:
            row = Row(doc, taken.path, taken.label, State.SAVED)
            self._keep(Taken(row, taken, new_key()), "", with_file=False)

    def send(self, doc: Any, comment: str) -> None:
        """Send a document that has just been saved, as it is."""
        path = os.path.realpath(doc.FileName)
        self.run((Row(doc, path, str(doc.Label), State.SAVED),), comment)

    def _turn(self) -> None:
        if not self._turns:
            return
        steps, comment = self._turns[0]
        try:
            taken = next(steps, None)
        except Exception:
            self._turns.popleft()
            raise
        if taken is None:
            self._turns.popleft()
        else:
            self._done(taken, comment)
        if self._turns:
            qt.later(0, self._turn)

    def _done(self, taken: Taken, comment: str) -> None:
        if taken.error is not None:
            self._tell_error(taken.row.label, str(taken.error))
        elif taken.snapshot is not None and not taken.snapshot.identity:
            self._session.add(not_in_silo(taken.snapshot))
        else:
            self._keep(taken, comment)

    def _keep(self, taken: Taken, comment: str, *, with_file: bool = True) -> None:
        if taken.snapshot is None:
            return
        if taken.row.is_top and with_file:
            self._asked_for.add(taken.key)
        commit = Commit(
            key=taken.key,
            snapshot=self.decided(taken.snapshot),
            taken_at=time.time(),
            comment=comment,
            file=(taken.held or Path(taken.row.path)) if with_file else None,
            sync_bom=self._preferences.flag("SyncBom"),
            allow_missing=self._preferences.text("MissingLinks") == ALLOW,
        )
        label = taken.row.label
        self._session.keep(commit, failed=lambda error: self._tell_error(label, str(error)))

    def decided(self, taken: Snapshot) -> Snapshot:
        """The snapshot without what a person has decided already (files that are one part)."""
        if taken.extraction is None:
            return taken
        return replace(taken, extraction=self.decisions.without_accepted(taken.extraction))

    def _tell_error(self, label: str, text: str) -> None:
        self._session.add(
            Entry(
                key=f"commit-error:{label}:{time.time()}",
                title=translate("Silo", "Not committed: {name}").replace("{name}", label),
                when=time.time(),
                tone=Tone.ERROR,
                lines=(Line(text, Tone.ERROR),),
                rank=1,
                icon="silo-commit",
            )
        )

    def _note(self, planned: Plan) -> str:
        if not self._session.shown.server.configured:
            return translate("Silo", "No Silo server is set up: the files are saved, and wait to be sent.")
        if self._session.shown.connection == "offline":
            return translate("Silo", "There is no connection now: the files are saved, and sent later.")
        return ""


def has_identity(doc: Any) -> bool:
    """True for a document that belongs to Silo."""
    try:
        return bool(take_snapshot(doc).identity)
    except SiloError:
        return False


def not_in_silo(taken: Snapshot) -> Entry:
    """The box for a document that has no item yet."""
    name = taken.label or os.path.basename(taken.path)
    text = taken.problem or translate("Silo", "It has no Silo part number yet, so it was not sent.")
    tone = Tone.PLAIN if taken.problem else Tone.WARNING
    register = Action(Do.REGISTER, translate("Silo", "Register Parts…"), document=taken.path)
    return Entry(
        key=f"not-in-silo:{taken.path}",
        title=translate("Silo", "Saved, but not in Silo: {name}").replace("{name}", name),
        when=time.time(),
        tone=tone,
        lines=(Line(text, tone),),
        actions=() if taken.problem else (register,),
        rank=1,
        icon="silo-commit",
    )
