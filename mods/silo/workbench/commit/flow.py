# SPDX-License-Identifier: LGPL-2.1-or-later
"""A commit from the press of the button to the outbox: ask, save, snapshot, keep. GUI thread.

::

    start ── plan ──▶ ask a user ──▶ turns: one document each ──▶ outbox (a worker)
             refused: warn   └ no: nothing happens      └ a failure: a box, and the next document

Each document has a turn of the event loop of its own, so that the window stays alive between them. FreeCAD
and Qt come in through the :class:`~silo.workbench.commit.desk.CommitDesk` only.
"""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo.bom.compare.states import ComparedAssembly
from silo.bom.errors import DocumentError, SiloError
from silo.outbox.entry import UNKNOWN, Commit, new_key, on_top
from silo.platform.spelling import one_path
from silo.project_folder import record_of
from silo.workbench.activity.box import Action, Do, PaneEntry, not_in_silo_key, own_box
from silo.workbench.colleagues.look import FileToCheck, look
from silo.workbench.colleagues.theirs import Choice, Theirs
from silo.workbench.commit.below import below_box
from silo.workbench.commit.desk import CommitAnswer, CommitDesk
from silo.workbench.commit.plan import CommitPlan, DocumentRow, DocumentState, plan, refusal
from silo.workbench.commit.same_parts import Decisions
from silo.workbench.commit.take import CommittedDocument, take_each
from silo.workbench.desk import is_edited
from silo.workbench.documents.snapshot import Snapshot
from silo.workbench.session.session import Session
from silo.workbench.settings.preferences import ALLOW, Preferences
from silo.workbench.tone import Tone
from silo.workbench.words import translate

if TYPE_CHECKING:
    from silo.vault.project import FileStanding, SentAlong


class CommitFlow:
    """Commits documents, one commit after another.

    register
        opens the Register Parts dialog for the document of this path.
    """

    def __init__(
        self,
        session: Session,
        preferences: Preferences,
        desk: CommitDesk,
        *,
        path: Path | None = None,
        register: Callable[[str], None] = lambda _path: None,
        choose: Callable[[str, Theirs, Choice], object] = lambda _path, _theirs, _choice: None,
    ) -> None:
        self._session, self._preferences, self._desk = session, preferences, desk
        self._register = register
        self.decisions = Decisions(path)
        self.choose = choose
        self._turns: deque[tuple[Iterator[CommittedDocument], str]] = deque()
        self._asked_for: set[str] = set()
        # Path → what a user wrote about a file that has no item yet.
        self._comments: dict[str, str] = {}
        # Files without an item that are sent as documents once they are saved.
        self._documents: set[str] = set()

    @property
    def running(self) -> bool:
        """Return True while documents are being saved."""
        return bool(self._turns)

    def was_asked_for(self, key: str) -> bool:
        """Return True if a user committed this very document, not one above it."""
        return key in self._asked_for

    def snapshot(self, doc: Any) -> Snapshot:
        """Take a snapshot of a document, without findings that a user has decided already (files that are
        one part).
        """
        taken = self._desk.snapshot(doc)
        if taken.extraction is None:
            return taken
        return replace(taken, extraction=self.decisions.without_accepted(taken.extraction))

    def accept(self, identity: str, files: Iterable[str]) -> None:
        """Accept that these files are one part; the boxes of the pane no longer ask."""
        same = set(files)
        self.decisions.accept(identity, same)
        self._session.answered(
            lambda asked: asked.target.lower() == identity.lower() and same.issuperset(asked.objects)
        )

    def has_identity(self, doc: Any) -> bool:
        """Return True if the document belongs to an item in Silo."""
        try:
            return bool(self._desk.snapshot(doc).identity)
        except SiloError:
            return False

    def start(self, doc: Any) -> None:
        """Commit a document: ask if there is something to ask, then return without waiting."""
        if not doc.FileName:
            self._desk.save_as(doc)
        unregistered = bool(doc.FileName and not self._desk.identity(doc) and not self._is_document(doc))
        planned = plan(doc, self._desk.documents, unregistered=unregistered)
        if text := refusal(planned):
            if planned.top.state is not DocumentState.UNNAMED:
                self._desk.warn(translate("Silo", "Commit to Silo"), text)
            return
        answer: CommitAnswer | None = CommitAnswer(planned.wanted)
        if self._preferences.flag("AskComment") or not planned.is_simple or self._heard(planned):
            comment = self._comments.get(planned.top.path, "")
            answer = self._desk.ask(
                planned, self._note(planned), comment, lambda back: self._look(planned, back)
            )
        if answer is None:
            return
        if not unregistered:
            # What is no item is sent as a document, after it is saved: nothing else sends it.
            self._documents |= {row.path for row in answer.rows if not self._desk.identity(row.document)}
        self.run(answer.rows, answer.comment)
        if not unregistered:
            self.send_linked(planned.top.path, self._decided(planned, answer), answer.comment)
        for row, theirs, choice in answer.choices:
            self.choose(row.path, theirs, choice)
        if answer.register:
            self._then(self._registering(planned.top.path))

    def _is_document(self, doc: Any) -> bool:
        """Return True for a file that is no item's and needs none: of several registered parts, or one that
        is a document in Silo already, such as a skeleton.
        """
        record = record_of(doc.FileName)
        is_known = record is not None and bool(record.revision) and not record.item
        return is_known or self._desk.snapshot(doc).several

    def _decided(self, planned: CommitPlan, answer: CommitAnswer) -> set[str]:
        """Return the files that the commit itself sends, and those that the user left out. All others are
        compared with Silo as they are on disk: FreeCAD's marks say what must be saved, not what differs.
        """
        sent = {row.path for row in answer.rows if self._desk.identity(row.document)}
        chosen = {row.path for row in answer.rows}
        left_out = {
            row.path for row in planned.rows if row.path not in chosen and (row.wanted or row.replaced)
        }
        return sent | left_out | {row.path for row, _theirs, _choice in answer.choices}

    def commit_folder(self, root: str, paths: Iterable[str], comment: str) -> None:
        """Save the edited ones of these open files of a project, then send what Silo does not have of it."""
        rows: dict[str, DocumentRow] = {}
        wanted = set(paths)
        for doc in filter(None, map(self._desk.find, wanted)):
            document_rows = (row for row in plan(doc, self._desk.documents).rows if row.path in wanted)
            rows.update((row.path, row) for row in document_rows if row.path not in rows)
        left = [row for row in rows.values() if not row.wanted and row.state is not DocumentState.RECOMPUTED]
        for row in left:
            self._tell_error(row.label, row.note)
        ready = tuple(row for row in rows.values() if row.wanted and row.state is DocumentState.CHANGED)
        sent = {row.path for row in ready if self._desk.identity(row.document)}
        self._documents |= {row.path for row in ready} - sent
        self.run(ready, comment)
        self.send_linked(root, {*sent, *(row.path for row in left)}, comment)

    def send_linked(self, path: str, skip: set[str], comment: str, over: Collection[str] = ()) -> None:
        """Send the linked files of a file, or the files of a folder, that Silo does not have, after the
        documents are saved.

        over
            files that are sent on top of a colleague's newer revision.
        """
        self._then(self._along(path, skip, comment, over, time.monotonic()))

    def _then(self, steps: Iterator[CommittedDocument], comment: str = "") -> None:
        """Take these steps, a turn each, after those of an earlier commit."""
        self._turns.append((steps, comment))
        if len(self._turns) == 1:
            self._desk.later(self._turn)

    def _along(
        self, path: str, skip: set[str], comment: str, over: Collection[str], begun: float
    ) -> Iterator[CommittedDocument]:
        """Commit, a turn after the documents are saved, the linked files that Silo does not have."""
        how: dict[str, Any] = {"comment": comment, "over_newer": over}
        how["allow_missing"] = self._preferences.text("MissingLinks") == ALLOW
        title = translate("Silo", "Looking at the linked files")

        def work(client: Any, server: str) -> SentAlong:
            from silo.vault.project import send_along  # late: FreeCAD's start waits for this module

            return send_along(path, client, self._session.outbox, server, skip, **how)

        def sent(along: SentAlong) -> None:
            if along.queued or along.more:
                self._session.send(force=True)
            if along.standings:
                self._prove(path, along, begun)

        def failed(error: SiloError) -> None:
            self._tell_error(os.path.basename(path), str(error))

        def offline(_error: SiloError) -> None:
            self._session.aside(title, lambda _control: work(None, ""), done=sent, failed=failed)

        def ask() -> None:
            self._session.ask(
                title, lambda client, _control: work(client, client.base_url), done=sent, failed=offline
            )

        self._session.after_keeping(ask)
        yield from ()

    def _prove(self, path: str, along: SentAlong, begun: float) -> None:
        """Look again after sending, and say of each file below whether Silo has it as it is here.

        begun
            when the commit began: what became a revision since was sent by it.
        """

        def sent(standings: Iterable[FileStanding]) -> set[str]:
            return {one.file.path for one in standings if self._session.has_sent(one.file.path, begun)}

        def look(client: Any, _control: Any) -> tuple[FileStanding, ...]:
            from silo.vault.project import find_project, stand  # late: FreeCAD's start waits for this module

            return tuple(stand([path], find_project([path]), client, self._session.outbox)[1])

        def done(standings: tuple[FileStanding, ...]) -> None:
            if len(standings) > 1:
                self._session.add(below_box(path, standings, sent(standings)))

        def failed(_error: SiloError) -> None:  # without an answer, what was found before the sending counts
            if along.left_out:
                self._session.add(below_box(path, along.standings, sent(along.standings)))

        self._session.ask(translate("Silo", "Looking at what Silo has now"), look, done, failed)

    def _registering(self, path: str) -> Iterator[CommittedDocument]:
        """Offer registering, a turn after the documents are saved."""
        self._register(path)
        yield from ()

    def comment_of(self, path: str) -> str:
        """Return what a user wrote about a file when it had no item yet, and forget it."""
        return self._comments.pop(path, "")

    def _heard(self, planned: CommitPlan) -> bool:
        """Return True if the server announced a colleague's commit of one of these documents."""
        return bool(self._session.shown.newer) and any(
            self._session.newer_than(check.identity, check.base.since)
            for check in self._files_to_check(planned)
        )

    def _files_to_check(self, planned: CommitPlan) -> list[FileToCheck]:
        return [
            FileToCheck(
                row.path, self._desk.identity(row.document) or "", self._desk.documents.base(row.document)
            )
            for row in planned.rows
            if row.path
        ]

    def _look(self, planned: CommitPlan, back: Callable[[Mapping[str, Theirs]], None]) -> None:
        """Ask Silo, in a worker, what colleagues committed since. If it cannot answer now, the commit finds
        it out when it is sent.
        """
        local = {row.path: Theirs(row.path) for row in planned.rows if row.replaced}
        if local:
            back(local)
        asked, documents = self._files_to_check(planned), {row.path: row.document for row in planned.rows}
        announced = self._session.shown.newer

        def question(client: Any, control: Any) -> dict[str, Theirs]:
            from silo.vault.revisions import top_of

            def mine(path: str) -> ComparedAssembly | None:
                taken = self._session.in_gui(lambda: self._desk.snapshot(documents[path]), control)
                return top_of(taken.extraction) if taken.extraction is not None else None

            return look(client, self._session.outbox, asked, mine, control.cancelled)

        def done(theirs: dict[str, Theirs]) -> None:
            news = {check.identity for check in asked if check.path in theirs}  # copies have one identity
            self._session.no_news(announced, {check.identity for check in asked} - news)
            back({**local, **theirs})

        self._session.ask(
            translate("Silo", "Looking for colleagues' commits"),
            question,
            done=done,
            failed=lambda _error: back(local),
        )

    def run(self, rows: tuple[DocumentRow, ...], comment: str = "") -> None:
        """Commit these documents, in order, after those of an earlier commit."""
        self._then(take_each(rows, self._desk.documents, self.snapshot, self._session.outbox), comment)

    def finish(self) -> None:
        """Do everything that is left at once, since FreeCAD is about to close the documents."""
        self._register = lambda _path: None
        while self._turns:
            self._step()

    def sync_only(self, doc: Any, *, by_fork: bool = False, allow_missing: bool = False) -> None:
        """Sync the BOM of a document whose file is committed already: its parts were registered, or a
        question about them was answered. ``by_fork``: a fork's ``Origin_Commit`` did it, in its own way.
        ``allow_missing``: a user wants it without the missing components.
        """
        try:
            taken = self.snapshot(doc)
            commit = self._commit_of(taken, new_key()) if taken.identity and taken.is_assembly else None
            if commit is None:
                return
            commit = replace(commit, allow_missing=commit.allow_missing or allow_missing)
            if not by_fork:
                commit = self.made_from(commit, doc)
                if not commit.sha256:
                    text = translate(
                        "Silo",
                        "Its BOM was not synced: it changed after its commit. Commit it again.",
                    )
                    raise DocumentError(taken.path, text)
        except SiloError as error:
            self._tell_error(str(doc.Label), str(error))
        else:
            # A BOM alone changes nothing about what the document was made from.
            self._session.keep(commit, failed=lambda error: self._tell_error(taken.label, str(error)))

    def made_from(self, commit: Commit, doc: Any) -> Commit:
        """Add to the commit of a BOM alone what its document was made from, so that it does not undo the BOM
        of a colleague's newer file. ``doc``: None if the file is not open.
        """
        from silo.checksums import sha256_of

        if doc is None:
            return replace(commit, sha256=sha256_of(commit.path))
        documents = self._desk.documents
        base = documents.base(doc)
        as_saved = not is_edited(documents, doc) and not base.replaced
        content = sha256_of(commit.path) if as_saved else ""
        origins = self._session.outbox.document_origins(base.settle(), commit.path, commit.identity)
        return replace(commit, origin=" ".join(origins), sha256=content)

    def send(self, doc: Any, comment: str) -> None:
        """Send a document that has just been saved, as it is."""
        path = one_path(doc.FileName)
        self.run((DocumentRow(doc, path, str(doc.Label), DocumentState.SAVED, is_new=True),), comment)

    def _turn(self) -> None:
        try:
            if self._turns:
                self._step()
        finally:
            # If one document fails, the others still have their turn.
            if self._turns:
                self._desk.later(self._turn)

    def _step(self) -> None:
        steps, comment = self._turns[0]
        taken = next(steps, None)
        if taken is None:
            self._turns.popleft()
        else:
            self._keep_saved(taken, comment)

    def _keep_saved(self, taken: CommittedDocument, comment: str) -> None:
        snapshot = taken.snapshot
        if snapshot is None:
            self._tell_error(taken.row.label, str(taken.error))
        elif snapshot.identity:
            self._keep(taken, snapshot, comment)
        else:
            if not snapshot.several and snapshot.path not in self._documents:
                self._session.add(not_in_silo(snapshot))
            self._documents.discard(snapshot.path)
            if comment:
                self._comments[snapshot.path] = comment

    def _keep(self, taken: CommittedDocument, snapshot: Snapshot, comment: str) -> None:
        row, base = taken.row, taken.base
        if row.is_top:
            self._asked_for.add(taken.key)
        commit = self._commit_of(snapshot, taken.key, comment, taken.held or Path(row.path))
        if commit is None:
            return
        commit = replace(commit, stamp=taken.stamp)
        if base is not None and not row.is_new:
            commit = replace(commit, origin=base.content or UNKNOWN)
        if newer := row.on_top:
            commit = replace(commit, **on_top(comment, newer))
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
        title = translate("Silo", "Not committed: {name}", name=label)
        self._session.add(own_box(f"commit-error:{label}:{time.time()}", title, text, tone=Tone.ERROR))

    def _note(self, planned: CommitPlan) -> str:
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
    """Make a commit for the outbox from a snapshot; None if there is neither a file nor a BOM to send."""
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


def not_in_silo(taken: Snapshot) -> PaneEntry:
    """Make the box for a document that has no item yet."""
    name = taken.label or os.path.basename(taken.path)
    text = taken.problem or translate("Silo", "It has no Silo part number yet, so it was not sent.")
    tone = Tone.PLAIN if taken.problem else Tone.WARNING
    register = Action(Do.REGISTER, translate("Silo", "Register Parts…"), document=taken.path)
    title = translate("Silo", "Saved, but not in Silo: {name}", name=name)
    box = own_box(not_in_silo_key(taken.path), title, text, tone=tone)
    return box if taken.problem else replace(box, actions=(register,))
