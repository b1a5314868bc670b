# SPDX-License-Identifier: LGPL-2.1-or-later
"""A commit from the press of the button to the outbox: ask, save, snapshot, keep. GUI thread.

::

    start ── plan ──▶ ask a person ──▶ turns: one document each ──▶ outbox (a worker)
             refused: warn   └ no: nothing happens      └ a failure: a box, and the next document

Each document has a turn of the event loop of its own, so that the window stays alive between them. FreeCAD
and Qt come in through the :class:`~silo.workbench.commit.desk.Desk` only.
"""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from silo.bom.changes import Assembly
from silo.bom.errors import DocumentError, SiloError
from silo.outbox.entry import UNKNOWN, Commit, new_key
from silo.outbox.store import on_top, seen
from silo.spelling import one_path
from silo.workbench.commit.decisions import Decisions
from silo.workbench.commit.desk import Answer, Desk
from silo.workbench.commit.plan import Plan, Row, State, Taken, is_edited, plan, refusal, take_each
from silo.workbench.commit.snapshot import Snapshot
from silo.workbench.commit.theirs import Asked, Choice, Theirs, look
from silo.workbench.pane.activity import Action, Do, Entry, Line, Tone, not_in_silo_key
from silo.workbench.session.session import Session
from silo.workbench.settings.preferences import ALLOW, Preferences
from silo.workbench.words import translate


class CommitFlow:
    """Commits documents, one commit after another.

    register
        opens the Register Parts dialog for the document of this path.
    """

    def __init__(
        self,
        session: Session,
        preferences: Preferences,
        desk: Desk,
        *,
        path: Path | None = None,
        register: Callable[[str], None] = lambda _path: None,
        choose: Callable[[str, Theirs, Choice], object] = lambda _path, _theirs, _choice: None,
    ) -> None:
        self._session, self._preferences, self._desk = session, preferences, desk
        self._register = register
        self.decisions = Decisions(path)
        self.choose = choose
        self._turns: deque[tuple[Iterator[Taken], str]] = deque()
        self._asked_for: set[str] = set()
        # Path → what a person wrote about a file that has no item yet.
        self._comments: dict[str, str] = {}

    @property
    def running(self) -> bool:
        """True while documents are being saved."""
        return bool(self._turns)

    def was_asked_for(self, key: str) -> bool:
        """True for the commit of a document that a person committed, not one below it."""
        return key in self._asked_for

    def snapshot(self, doc: Any) -> Snapshot:
        """A document as it is, without what a person has decided already (files that are one part)."""
        taken = self._desk.snapshot(doc)
        if taken.extraction is None:
            return taken
        return replace(taken, extraction=self.decisions.without_accepted(taken.extraction))

    def accept(self, identity: str, files: Iterable[str]) -> None:
        """A person says that these files are one part; the boxes of the pane ask no more."""
        same = set(files)
        self.decisions.accept(identity, same)
        self._session.answered(
            lambda asked: asked.target.lower() == identity.lower() and same.issuperset(asked.objects)
        )

    def has_identity(self, doc: Any) -> bool:
        """True for a document that belongs to Silo."""
        try:
            return bool(self._desk.snapshot(doc).identity)
        except SiloError:
            return False

    def start(self, doc: Any) -> None:
        """Commit a document: ask where there is something to ask, then return without waiting."""
        if not doc.FileName:
            self._desk.save_as(doc)
        unregistered = bool(doc.FileName) and not self._desk.is_registered(doc)
        planned = plan(doc, self._desk.documents, unregistered=unregistered)
        if text := refusal(planned):
            if planned.top.state is not State.UNNAMED:
                self._desk.warn(translate("Silo", "Commit to Silo"), text)
            return
        answer: Answer | None = Answer(planned.wanted)
        if self._preferences.flag("AskComment") or not planned.is_simple or self._heard(planned):
            comment = self._comments.get(planned.top.path, "")
            answer = self._desk.ask(
                planned, self._note(planned), comment, lambda back: self._look(planned, back)
            )
        if answer is None:
            return
        self.run(answer.rows, answer.comment)
        for row, theirs, choice in answer.choices:
            self.choose(row.path, theirs, choice)
        if answer.register:
            self._turns.append((self._registering(planned.top.path), ""))

    def _registering(self, path: str) -> Iterator[Taken]:
        """A turn after the documents are saved."""
        self._register(path)
        yield from ()

    def comment_of(self, path: str) -> str:
        """What a person wrote about a file when it had no item yet; told once."""
        return self._comments.pop(path, "")

    def _heard(self, planned: Plan) -> bool:
        """True where the server has announced a colleague's commit of one of these documents."""
        return bool(self._session.shown.newer) and any(
            self._session.newer_than(one.identity, one.base.since) for one in self._asked(planned)
        )

    def _asked(self, planned: Plan) -> list[Asked]:
        return [
            Asked(row.path, self._desk.identity(row.document) or "", self._desk.documents.base(row.document))
            for row in planned.rows
            if row.path
        ]

    def _look(self, planned: Plan, back: Callable[[Mapping[str, Theirs]], None]) -> None:
        """Ask Silo, in a worker, what colleagues committed since. What it cannot be asked now is caught when
        the commit is sent."""
        local = {row.path: Theirs(row.path) for row in planned.rows if row.replaced}
        if local:
            back(local)
        asked, documents = self._asked(planned), {row.path: row.document for row in planned.rows}
        announced = self._session.shown.newer

        def question(client: Any, control: Any) -> dict[str, Theirs]:
            from silo.vault.revisions import top_of

            def mine(path: str) -> Assembly | None:
                taken = self._session.in_gui(lambda: self._desk.snapshot(documents[path]), control)
                return top_of(taken.extraction) if taken.extraction is not None else None

            return look(client, self._session.outbox, asked, mine, control.cancelled)

        def done(found: dict[str, Theirs]) -> None:
            news = {one.identity for one in asked if one.path in found}  # copies have one identity
            self._session.no_news(announced, {one.identity for one in asked} - news)
            back({**local, **found})

        self._session.ask(
            translate("Silo", "Looking for colleagues' commits"),
            question,
            done=done,
            failed=lambda _error: back(local),
        )

    def run(self, rows: tuple[Row, ...], comment: str = "") -> None:
        """Commit these documents, in order, after those of an earlier commit."""
        turns = take_each(rows, self._desk.documents, self.snapshot, self._session.outbox)
        self._turns.append((turns, comment))
        if len(self._turns) == 1:
            self._desk.later(self._turn)

    def finish(self) -> None:
        """Do at once what is left to do: FreeCAD is about to close the documents."""
        self._register = lambda _path: None
        while self._turns:
            self._step()

    def sync_only(self, doc: Any, *, by_fork: bool = False) -> None:
        """Sync the BOM of a document whose file is committed already: its parts were registered, or a
        question about them was answered. ``by_fork``: a fork's ``Origin_Commit`` did it, in its own way."""
        try:
            taken = self.snapshot(doc)
            commit = self._commit_of(taken, new_key()) if taken.identity and taken.is_assembly else None
            if commit is None:
                return
            if not by_fork:
                commit = self.made_from(commit, doc)
                if not commit.sha256:
                    told = translate(
                        "Silo", "Its BOM was not synced: it is not as it was committed. Commit it."
                    )
                    raise DocumentError(taken.path, told)
        except SiloError as error:
            self._tell_error(str(doc.Label), str(error))
        else:
            # A BOM alone changes nothing about what the document was made from.
            self._session.keep(commit, failed=lambda error: self._tell_error(taken.label, str(error)))

    def made_from(self, commit: Commit, doc: Any) -> Commit:
        """The commit of a BOM alone, with what its document was made from: it must not undo the BOM of a
        colleague's newer file. ``doc``: None where the file is not open."""
        from silo.files import sha256_of  # late: FreeCAD's start waits for this module

        if doc is None:
            return replace(commit, sha256=sha256_of(commit.path))
        documents = self._desk.documents
        base = documents.base(doc)
        as_saved = not is_edited(documents, doc) and not base.replaced
        content = sha256_of(commit.path) if as_saved else ""
        return replace(commit, origin=base.settle(self._session.outbox), sha256=content)

    def send(self, doc: Any, comment: str) -> None:
        """Send a document that has just been saved, as it is."""
        path = one_path(doc.FileName)
        self.run((Row(doc, path, str(doc.Label), State.SAVED, is_new=True),), comment)

    def _turn(self) -> None:
        try:
            if self._turns:
                self._step()
        finally:
            # Whatever went wrong with one document, the others have their turn.
            if self._turns:
                self._desk.later(self._turn)

    def _step(self) -> None:
        steps, comment = self._turns[0]
        taken = next(steps, None)
        if taken is None:
            self._turns.popleft()
        else:
            self._done(taken, comment)

    def _done(self, taken: Taken, comment: str) -> None:
        if taken.error is not None:
            self._tell_error(taken.row.label, str(taken.error))
        elif taken.snapshot is not None and not taken.snapshot.identity:
            self._session.add(not_in_silo(taken.snapshot))
            if comment:
                self._comments[taken.snapshot.path] = comment
        else:
            self._keep(taken, comment)

    def _keep(self, taken: Taken, comment: str) -> None:
        if taken.snapshot is None:
            return
        row, base = taken.row, taken.base
        if row.is_top:
            self._asked_for.add(taken.key)
        commit = self._commit_of(taken.snapshot, taken.key, comment, taken.held or Path(row.path))
        if commit is None:
            return
        commit = replace(commit, stamp=taken.stamp)
        if base is not None and not row.is_new:
            commit = replace(commit, origin=base.origin or UNKNOWN)
        if newer := row.on_top:
            commit = replace(commit, on_top_of=seen(newer), comment=on_top(comment, newer))
        self._session.keep(commit, failed=lambda error: self._tell_error(row.label, str(error)), base=base)

    def _commit_of(
        self, taken: Snapshot, key: str, comment: str = "", file: Path | None = None
    ) -> Commit | None:
        return commit_of(
            taken,
            key=key,
            comment=comment,
            file=file,
            sync_bom=self._preferences.flag("SyncBom"),
            allow_missing=self._preferences.text("MissingLinks") == ALLOW,
        )

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


def commit_of(
    taken: Snapshot,
    *,
    key: str,
    comment: str = "",
    file: Path | None = None,
    sync_bom: bool = True,
    allow_missing: bool = False,
) -> Commit | None:
    """A snapshot as the outbox wants it; None where neither a file nor a BOM is to be sent."""
    if file is None and (taken.extraction is None or not sync_bom):
        return None
    return Commit(
        path=taken.path,
        label=taken.label,
        identity=taken.identity or "",
        taken_at=time.time(),
        key=key,
        comment=comment,
        file=file,
        extraction=taken.extraction if sync_bom else None,
        allow_missing=allow_missing,
        remark=taken.problem,
    )


def not_in_silo(taken: Snapshot) -> Entry:
    """The box for a document that has no item yet."""
    name = taken.label or os.path.basename(taken.path)
    text = taken.problem or translate("Silo", "It has no Silo part number yet, so it was not sent.")
    tone = Tone.PLAIN if taken.problem else Tone.WARNING
    register = Action(Do.REGISTER, translate("Silo", "Register Parts…"), document=taken.path)
    return Entry(
        key=not_in_silo_key(taken.path),
        title=translate("Silo", "Saved, but not in Silo: {name}").replace("{name}", name),
        when=time.time(),
        tone=tone,
        lines=(Line(text, tone),),
        actions=() if taken.problem else (register,),
        rank=1,
        icon="silo-commit",
    )
