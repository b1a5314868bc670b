# SPDX-License-Identifier: LGPL-2.1-or-later
"""A commit from the press of the button to the outbox: ask, save, snapshot, keep. GUI thread.

::

    start ── plan ──▶ ask a person ──▶ turns: one document each ──▶ outbox (a worker)
             refused: warn   └ no: nothing happens      └ a failure: a box, and the next document

Each document has a turn of the event loop of its own, so that the window stays alive between them. FreeCAD
and Qt come in through the :class:`~silo.workbench.commit.flow.Desk` only.

What a person decided once and is not to be asked again: files that are the same part on purpose.

One small JSON file in the user's data folder. Losing it costs a repeated question, no more.

What a colleague did to a file since it was opened here: the look at Silo, and its words. No widgets.

The look belongs in a worker; what it finds are values.

What the flows need of FreeCAD and of the person in front of it; :mod:`silo.workbench.live_desk`
has it.

With a desk of a test's own the flows run without FreeCAD and Qt. All calls are made in the GUI thread.
"""

from __future__ import annotations

import json
import os
import time
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from silo.bom.compare.states import ComparedAssembly
from silo.bom.compare.three_states import ThreeLines
from silo.bom.errors import DocumentError, NotFoundError, RouteMissingError, SiloError
from silo.bom.findings import Finding, FindingCode
from silo.bom.items.naming import display_name
from silo.bom.model import Extraction, walk_entries
from silo.outbox.entry import UNKNOWN, Commit, new_key, on_top
from silo.platform import data_folder, one_path, read_memory, write_memory
from silo.workbench.commit.opened import Base
from silo.workbench.commit.plan import (
    CommitPlan,
    CommittedDocument,
    DocumentRow,
    Documents,
    DocumentState,
    Snapshot,
    is_edited,
    plan,
    refusal,
    take_each,
)
from silo.workbench.pane.activity import Action, Do, PaneEntry, Tone, not_in_silo_key
from silo.workbench.pane.entries import own_box
from silo.workbench.session.session import Session
from silo.workbench.settings import ALLOW, Preferences
from silo.workbench.words import counted, filled, plain, quantity, translate

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.api.revisions import Standing
    from silo.api.transport import Cancel
    from silo.bom.objects import Key
    from silo.outbox.entry import Entry as QueueEntry
    from silo.outbox.store import Store
    from silo.registering.candidate import Candidate, OpenedFile
    from silo.workbench.preview.flow import PreviewFlow
    from silo.workbench.preview.flow import PreviewWindow as Preview
    from silo.workbench.register.flow import RegisterFlow
    from silo.workbench.register.flow import RegisterWindow as Registering
    from silo.workbench.revisions.flow import Differences, Ghost
    from silo.workbench.session.session import Newer


class Decisions:
    """Identities that may occur in several files: identity → the files."""

    def __init__(self, path: Path | None = None) -> None:
        self._path = path or data_folder() / "same-parts.json"

    def accept(self, identity: str, files: Iterable[str]) -> None:
        """Accept that these files are the same part."""
        accepted = self._read()
        accepted[identity.lower()] = sorted({*accepted.get(identity.lower(), ()), *files})
        write_memory(self._path, accepted)

    def without_accepted(self, extraction: Extraction) -> Extraction:
        """Remove the copied-identity findings that a person has accepted."""
        if not any(f.code is FindingCode.COPIED_IDENTITY for f in extraction.findings):
            return extraction
        accepted_now = self._read()
        identities = {
            entry.key: (entry.silo_uuid or "").lower()
            for entry in walk_entries((extraction.assembly, *extraction.entries))
        }

        def accepted(finding: Finding) -> bool:
            if finding.code is not FindingCode.COPIED_IDENTITY or not finding.where:
                return False
            first = finding.where[0]
            files = {place.doc_path for place in finding.where}
            return files <= set(accepted_now.get(identities.get((first.doc_path, first.obj), ""), ()))

        kept = tuple(f for f in extraction.findings if not accepted(f))
        return replace(extraction, findings=kept)

    def _read(self) -> dict[str, list[str]]:
        memory = read_memory(self._path)
        return {
            key: [str(file) for file in files] for key, files in memory.items() if isinstance(files, list)
        }


class Choice(StrEnum):
    """What a person wants to be done about a file that a colleague has changed."""

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
        the number of the revision that mine was made from; None where nobody knows.
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


@dataclass(frozen=True)
class FileToCheck:
    """A file to look at: its path, the identity of its item, and what the document was made from."""

    path: str
    identity: str
    base: Base


def look(
    client: SiloClient,
    outbox: Store,
    asked: Iterable[FileToCheck],
    mine: Callable[[str], ComparedAssembly | None],
    cancelled: Cancel | None = None,
) -> dict[str, Theirs]:
    """Find the files that a colleague has committed since: path → what they committed. For a worker.

    mine
        returns the present BOM of the document of a path.
    """
    files = [check for check in asked if check.identity]
    items = client.get_items_by_uuid([check.identity for check in files], cancelled=cancelled)
    theirs: dict[str, Theirs] = {}
    for check in files:
        if (item := items.get(check.identity)) is None:
            continue
        file = _CommitFile(check.path, item.part_number, check.identity, check.base.settle(outbox))
        if (stands := file.standing(client, outbox)) is not None:
            lines: tuple[ThreeLines, ...] = ()
            with suppress(SiloError):  # the question stands without its details
                lines = file.lines(client, stands, mine(check.path), cancelled)
            theirs[check.path] = file.theirs(stands, lines)
    return theirs


def gone(client: SiloClient, announced: Mapping[str, Newer], cancelled: Cancel | None = None) -> list[str]:
    """Find the items of which the server no longer has the announced commit. For a worker: one request for
    each.
    """
    from silo.api.revisions import newest_number
    from silo.api.transport import stop_if

    identities = []
    for identity, newer in announced.items():
        stop_if(cancelled)
        try:
            revisions = client.revisions(newer.part_number, newest=1)
        except RouteMissingError:
            continue
        except NotFoundError:
            revisions = []
        if newest_number(revisions) < newer.revision:
            identities.append(identity)
    return identities


def look_held(
    client: SiloClient, outbox: Store, entry: QueueEntry, cancelled: Cancel | None = None
) -> Theirs | None:
    """Find the newest revision that a held commit would undo, with the BOM base → theirs → mine. None for a
    part, for a commit to another server, and if nothing would be undone any more. For a worker.

    Raises SiloError if the server does not answer, or a file cannot be read.
    """
    from silo.api.address import canonical
    from silo.bom.report import from_plain
    from silo.vault.pull import top_of

    extraction = outbox.bom(entry.id)[0]
    if not extraction or entry.server != canonical(client.base_url):
        return None
    try:
        mine = top_of(from_plain(json.loads(extraction)))
    except ValueError:
        return None  # sending it says so
    file = _CommitFile(entry.path, entry.part_number, entry.identity, entry.origin)
    stands = file.standing(client, outbox)
    return None if stands is None else file.theirs(stands, file.lines(client, stands, mine, cancelled))


@dataclass(frozen=True)
class _CommitFile:
    path: str
    part_number: str
    identity: str
    origin: str

    def standing(self, client: SiloClient, outbox: Store) -> Standing | None:
        """Compare the file with the item's revisions; None if committing it would undo nothing."""
        from silo.api.revisions import is_newest, standing

        # The newest one decides it nearly always; an item may have hundreds.
        if is_newest(self.origin, client.revisions(self.part_number, newest=1)):
            return None
        revision = outbox.known_revision(client.base_url, self.origin, self.identity)
        stands = standing(client.revisions(self.part_number), self.origin, revision)
        return None if stands.newer is None else stands

    def lines(
        self, client: SiloClient, stands: Standing, mine: ComparedAssembly | None, cancelled: Cancel | None
    ) -> tuple[ThreeLines, ...]:
        from silo.vault.pull import RevisionBoms

        if mine is None:
            return ()
        with RevisionBoms(client, self.part_number, self.path, cancelled) as boms:
            return boms.three(stands, mine)

    def theirs(self, stands: Standing, lines: tuple[ThreeLines, ...]) -> Theirs:
        newest = stands.newest
        assert newest is not None  # something is newer
        return Theirs(
            self.path,
            self.part_number,
            newest.revision_number,
            newest.created_by or "",
            newest.created_at.timestamp() if newest.created_at else None,
            newest.comment,
            stands.base.revision_number if stands.base is not None else None,
            lines,
            newest.model_dump(mode="json", exclude={"properties", "links"}),
        )


Look = Callable[[Callable[[Mapping[str, Theirs]], None]], object]


@dataclass(frozen=True)
class CommitAnswer:
    """What a person says in the commit dialog.

    register
        give it a part number as well.
    choices
        what to do about files that colleagues have changed, beside committing.
    """

    rows: tuple[DocumentRow, ...]
    comment: str = ""
    register: bool = False
    choices: tuple[tuple[DocumentRow, Theirs, Choice], ...] = ()


class CountedSolids(Protocol):
    """One assembly's solids (:class:`silo.workbench.freecad.witness.SolidCount`)."""

    @property
    def doc_path(self) -> str: ...

    @property
    def agrees(self) -> bool: ...

    @property
    def unexplained(self) -> tuple[str, ...]: ...

    def sentence(self) -> str: ...


class Desk(Protocol):
    """FreeCAD's documents, its window, and a person."""

    @property
    def documents(self) -> Documents: ...

    def snapshot(self, doc: Any, /) -> Snapshot:
        """Take a snapshot of a live document."""

    def find(self, path: str, /) -> Any | None:
        """Return the open document of a file; None if it is not open."""

    def save_as(self, doc: Any, /) -> None:
        """Let a person give a document its first name."""

    def identity(self, doc: Any, /) -> str | None:
        """Return the item to which a document belongs, without looking at its components."""

    def ask(self, planned: CommitPlan, note: str, comment: str, look: Look, /) -> CommitAnswer | None:
        """Ask which documents to commit, and with which comment; None if the person cancels.

        comment
            what the person wrote before, if it is not in Silo yet.
        look
            asks Silo, and calls back with what colleagues did meanwhile.
        """

    def warn(self, title: str, text: str, /) -> None:
        """Show a message that a person must see."""

    def later(self, call: Callable[[], None], /) -> None:
        """Run something in a turn of its own, once the present event is done."""

    # -- files ------------------------------------------------------------------------------------------

    def open(self, path: str, /) -> Any:
        """Open the document of a file completely."""

    def close(self, doc: Any, /) -> None:
        """Close a document without saving it."""

    def save_copy(self, doc: Any, path: Path, /) -> None:
        """Write a document, with its unsaved edits, to another file."""

    def open_paths(self) -> tuple[str, ...]:
        """Return the files that this FreeCAD has open."""

    def is_open_elsewhere(self, path: str, /) -> bool:
        """Return True if another FreeCAD of this user has the file open."""

    # -- previews ---------------------------------------------------------------------------------------

    def preview_window(self, title: str, path: str, flow: PreviewFlow, /) -> Preview:
        """Open the preview of a document."""

    def accounts(self, extraction: Extraction, /) -> Sequence[CountedSolids]:
        """Count the solids that FreeCAD shows, for the assembly and each sub-assembly."""

    def why(self, doc: Any, assembly: str, parts: Collection[Key], /) -> list[str]:
        """Say why an assembly of a document has this quantity of a part: the number, then each chain to
        it.
        """

    def relink(self, finding: Finding, /) -> list[str]:
        """Set the live links of a finding to the file that was meant; returns their labels."""

    def light(self, doc: Any, names: Sequence[str], /) -> int:
        """Select objects and draw them in front of what covers them; returns how many there are."""

    def compare(self, path: str, revision: int, theirs: Sequence[Ghost], /) -> Differences | None:
        """Draw another revision as a ghost beside a document; None if it was drawn already, and is removed.

        Raises DocumentError if the document is not open.
        """

    # -- registering ------------------------------------------------------------------------------------

    def register_window(self, title: str, path: str, flow: RegisterFlow, /, *, asks: bool) -> Registering:
        """Open the Register Parts dialog of a document."""

    def look_at(self, paths: Iterable[str], /) -> dict[str, OpenedFile]:
        """Find out how the files of components stand."""

    def write_identity(self, candidate: Candidate, identity: str, /) -> None:
        """Write an identity into a component's document and save it."""

    def remove_identity(self, candidate: Candidate, /, *, no_part: bool) -> None:
        """Take the identity from an object modelled in an assembly's own file, and save it; with or without
        the mark that it is no part.
        """

    def restore_identity(self, candidate: Candidate, /) -> None:
        """Give a component's file the identity that it had before it was registered, or none, and save it."""

    def unedited(self) -> list[Any]:
        """Return the documents without unsaved edits, each after those to which it links."""

    def save_marked(self, doc: Any, /) -> None:
        """Save a document that was unedited, if FreeCAD has marked it because of a file below it."""


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
        self._turns: deque[tuple[Iterator[CommittedDocument], str]] = deque()
        self._asked_for: set[str] = set()
        # Path → what a person wrote about a file that has no item yet.
        self._comments: dict[str, str] = {}

    @property
    def running(self) -> bool:
        """Return True while documents are being saved."""
        return bool(self._turns)

    def was_asked_for(self, key: str) -> bool:
        """Return True if a person committed this very document, not one above it."""
        return key in self._asked_for

    def snapshot(self, doc: Any) -> Snapshot:
        """Take a snapshot of a document, without findings that a person has decided already (files that are
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
        # A file of several registered parts is no item, and needs none: it is sent as a document.
        unregistered = bool(
            doc.FileName and not self._desk.identity(doc) and not self._desk.snapshot(doc).several
        )
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
        self.run(answer.rows, answer.comment)
        if not unregistered:
            decided = {row.path for row in planned.rows}
            top = planned.top.path
            # The top too, if it is no item: nothing else sends it.
            skip = decided if self._desk.identity(doc) else decided - {top}
            self.send_linked(top, skip, answer.comment)
        for row, theirs, choice in answer.choices:
            self.choose(row.path, theirs, choice)
        if answer.register:
            self._then(self._registering(planned.top.path))

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
        self.run(ready, comment)
        sent = {row.path for row in ready if self._desk.identity(row.document)}
        self.send_linked(root, {*sent, *(row.path for row in left)}, comment)

    def send_linked(self, path: str, skip: set[str], comment: str, over: Collection[str] = ()) -> None:
        """Send the linked files of a file, or the files of a folder, that Silo does not have, after the
        documents are saved.

        over
            files that are sent on top of a colleague's newer revision.
        """
        self._then(self._along(path, skip, comment, over))

    def _then(self, steps: Iterator[CommittedDocument], comment: str = "") -> None:
        """Take these steps, a turn each, after those of an earlier commit."""
        self._turns.append((steps, comment))
        if len(self._turns) == 1:
            self._desk.later(self._turn)

    def _along(
        self, path: str, skip: set[str], comment: str, over: Collection[str]
    ) -> Iterator[CommittedDocument]:
        """Commit, a turn after the documents are saved, the linked files that Silo does not have."""
        how: dict[str, Any] = {"comment": comment, "over_newer": over}
        how["allow_missing"] = self._preferences.text("MissingLinks") == ALLOW
        title = translate("Silo", "Looking at the linked files")

        def work(client: Any, server: str) -> int:
            from silo.vault.project import send_along  # late: FreeCAD's start waits for this module

            return send_along(path, client, self._session.outbox, server, skip, **how)

        def sent(count: int) -> None:
            if count:
                self._session.send(force=True)

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

    def _registering(self, path: str) -> Iterator[CommittedDocument]:
        """Offer registering, a turn after the documents are saved."""
        self._register(path)
        yield from ()

    def comment_of(self, path: str) -> str:
        """Return what a person wrote about a file when it had no item yet, and forget it."""
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
            from silo.vault.pull import top_of

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
        ``allow_missing``: a person wants it without the missing components.
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
            if not snapshot.several:
                self._session.add(not_in_silo(snapshot))
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
            commit = replace(commit, origin=base.origin or UNKNOWN)
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
