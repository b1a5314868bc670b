# SPDX-License-Identifier: LGPL-2.1-or-later
"""Getting files from Silo into FreeCAD: take a colleague's, open it beside one's own, open an item, history.

Nothing of the user's is replaced without their word, and a copy of what is replaced is kept. Downloads and
reading are a worker's; opening and closing documents is done in the GUI thread.

The project view: all files of a project folder, each with how it stands to Silo. The folder is the one that
the person chose, or a marked one above an open document; it is never guessed.
"""

from __future__ import annotations

import os
import re
import shutil
import time
from collections.abc import Callable, Sequence, Set
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from silo.bom.errors import DocumentError, InputError, SiloError
from silo.outbox.store import KEPT_ASIDE_DAYS
from silo.platform import cache_folder, one_path
from silo.project_folder import PROJECT_FILE, Project
from silo.workbench.activity.box import own_box
from silo.workbench.colleagues.theirs import Choice, Theirs, theirs_of
from silo.workbench.commit.flow import CommitFlow
from silo.workbench.desk import MOST_S
from silo.workbench.documents.opened import DocumentOrigin
from silo.workbench.ghost import Differences, Ghost
from silo.workbench.revisions.desk import RevisionDesk
from silo.workbench.session.session import Session
from silo.workbench.tone import Tone
from silo.workbench.words import filled, plain, translate

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.api.wire import Item, Revision
    from silo.inertia.geometry.together import Mesh
    from silo.outbox.store import Store
    from silo.vault.project import ProjectState as StandState
    from silo.vault.pull import Pulled
    from silo.workbench.session.worker import Control
    from silo.workbench.settings import Preferences

MOST_FOUND = 60


@dataclass(frozen=True)
class ItemHistory:
    """An item with its revisions that have a file, newest first, and its picture (PNG).

    base
        the revision that the document was made from; None: unknown, or no document was asked about.
    """

    item: Item
    revisions: tuple[Revision, ...]
    picture: bytes = b""
    base: int | None = None


def ghosts(client: SiloClient, part_number: str, revision: int, control: Control) -> list[Ghost]:
    """Fetch the model of a revision, and find what it shows. For a worker."""
    import numpy as np

    from silo.drawing import products

    scene = client.get_scene(part_number, revision)
    found: list[Ghost] = []
    meshes: dict[int, dict[str, Mesh]] = {}
    for occurrence in scene.occurrences:
        control.check()
        if occurrence.geometry is None:
            continue
        if occurrence.geometry not in meshes:
            meshes[occurrence.geometry] = products(
                client.get_geometry(scene.geometries[occurrence.geometry].id)
            )
        if (mesh := meshes[occurrence.geometry].get(occurrence.key)) is not None:
            matrix = np.array(occurrence.matrix).reshape(4, 4).T
            found.append(Ghost(tuple(occurrence.path), matrix, mesh.moved(matrix)))
    return found


def _in_words(differences: Differences | None, revision: int) -> str:
    if differences is None:
        return translate("Silo", "The ghost is removed.")
    text = translate(
        "Silo", "Ghost: {removed} only in revision {n}, {moved} elsewhere there. Only here: {added}."
    )
    if differences.unknown:
        text += " " + translate("Silo", "Not compared: {unknown} in groups and arrays without links.")
    return filled(text, n=revision, **vars(differences))


class RevisionFlow:
    """One per FreeCAD."""

    def __init__(self, session: Session, desk: RevisionDesk) -> None:
        self._session, self._desk = session, desk
        # Of which server, and what it showed without any words.
        self._recent: tuple[str, list[Item]] = ("", [])

    # -- a colleague's file -----------------------------------------------------------------------------

    def choose(
        self, path: str, theirs: Theirs, choice: Choice, *, taken: Callable[[], object] = lambda: None
    ) -> None:
        """Carry out what a person chose in the commit dialog or in the pane.

        taken
            called when their file is in the place of mine.
        """
        if choice is Choice.TAKE:
            self._take(path, theirs, taken)
        elif choice is Choice.OPEN:
            self._open_beside(path, theirs)

    def _open_beside(self, path: str, theirs: Theirs) -> None:
        if not theirs.revision:
            target = _aside("on-disk", os.path.basename(path))
            self._guarded(path, lambda: self._open_copy(path, target))
            return
        from silo.api.files import DocumentId

        if isinstance(theirs.part_number, DocumentId):  # of no item: nothing says what it links to
            target = _aside(f"{theirs.part_number}-r{theirs.revision}", os.path.basename(path))
            self._fetch(path, theirs, target, lambda: self._desk.open(str(target)))
            return
        folder = _aside(f"{_word(theirs.part_number)}-r{theirs.revision}")
        self.pull(
            theirs.part_number,
            theirs.revision,
            folder,
            overwrite=True,
            done=lambda pulled: self._guarded(path, lambda: self._desk.open(str(pulled.top))),
            failed=lambda error: self._box_error(path, error),
        )

    def compare(
        self,
        path: str,
        part_number: str,
        revision: int,
        report: Callable[[str], object],
        failed: Callable[[SiloError], None],
    ) -> None:
        """Show another revision as a ghost beside the open document, and say what differs; or remove it."""

        def done(theirs: list[Ghost]) -> None:
            if not theirs:
                report(translate("Silo", "Silo has no model of revision {n} yet.", n=revision))
                return
            try:
                report(_in_words(self._desk.compare(path, revision, theirs), revision))
            except SiloError as error:
                failed(error)

        title = translate("Silo", "Fetching from Silo")
        self._session.ask(
            title,
            lambda client, control: ghosts(client, part_number, revision, control),
            done=done,
            failed=failed,
        )

    def _open_copy(self, path: str, target: Path) -> None:
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(path, target)
        self._desk.open(str(target))

    def _take(self, path: str, theirs: Theirs, taken: Callable[[], object]) -> None:
        def put(content: Path | None) -> None:
            self._replace(path, content, theirs)
            taken()

        if not theirs.revision:
            self._guarded(path, lambda: put(None))
            return
        content = self._session.outbox.path.parent / "fetched" / f"{time.monotonic_ns()}.FCStd"
        self._fetch(path, theirs, content, lambda: put(content))

    def _fetch(self, path: str, theirs: Theirs, content: Path, then: Callable[[], object]) -> None:
        """Fetch their file alone."""

        def fetch(client: SiloClient, control: Control) -> None:
            content.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            from silo.api.files import download_revision

            checksum = str((theirs.newer or {}).get("file_checksum") or "")
            number = theirs.part_number
            download_revision(client, number, content, theirs.revision, checksum, cancelled=control.cancelled)

        self._session.ask(
            translate("Silo", "Fetching from Silo"),
            fetch,
            done=lambda _none: self._guarded(path, then),
            failed=lambda error: self._box_error(path, error),
        )

    def _replace(self, path: str, content: Path | None, theirs: Theirs) -> None:
        """Put their file in the place of mine, and keep a copy of mine. ``content`` None: theirs is there
        already.
        """
        from silo.checksums import content_hash
        from silo.platform import remove_patiently, replacing

        doc, outbox, kept = self._desk.find(path), self._session.outbox, list[str]()
        # The file on disk is mine, or it is a third person's.
        is_mine = doc is not None and not self._desk.documents.base(doc).replaced
        is_theirs = content is None or (os.path.exists(path) and content_hash(path) == content_hash(content))
        if not is_mine and not is_theirs:
            kept += filter(None, [str(outbox.keep_aside(path) or "")])
        if doc is not None:
            mine = outbox.aside(path)
            self._desk.save_copy(doc, mine)
            kept.append(str(mine))
        if content is not None:
            try:
                with content.open("rb") as read, replacing(path, mode=0o644) as write:
                    shutil.copyfileobj(read, write)
            except OSError as error:
                raise DocumentError(path, f"cannot be written ({error.strerror or error})") from error
            remove_patiently(content)
        if doc is not None:
            self._desk.close(doc)
        self._desk.open(path)
        text = ""
        if kept:
            text = translate(
                "Silo", "Yours is kept for {n} days at {path}", n=KEPT_ASIDE_DAYS, path=", ".join(kept)
            )
        if lost := _not_here(path):
            sentence = translate(
                "Silo",
                "It links to {names}, not in this folder: Open from Silo… fetches them.",
                names=plain(", ".join(lost), 200),
            )
            text = " ".join(filter(None, (sentence, text)))
        title = translate("Silo", "Took {who}'s revision {n}: {name}") if theirs.revision else ""
        title = title or translate("Silo", "Took the file on disk: {name}")
        self._box(path, filled(title, who=theirs.who, n=theirs.revision, name=_name(path)), text)

    def _guarded(self, path: str, call: Callable[[], object]) -> None:
        try:
            call()
        except SiloError as error:
            self._box_error(path, error)
        except OSError as error:
            self._box_error(path, DocumentError(path, error.strerror or str(error)))

    def _box_error(self, path: str, error: SiloError) -> None:
        self._box(
            path,
            translate("Silo", "Not fetched: {name}", name=_name(path)),
            str(error),
            Tone.ERROR,
        )

    def _box(self, path: str, title: str, text: str, tone: Tone = Tone.PLAIN) -> None:
        key, lines = f"fetched:{path}:{time.time()}", filter(None, [text])
        self._session.add(own_box(key, title, *lines, tone=tone, icon="silo-open"))

    # -- items ------------------------------------------------------------------------------------------

    def search(
        self, words: str, done: Callable[[list[Item]], None], failed: Callable[[SiloError], None]
    ) -> None:
        """Search items whose number, name or description have all these words."""
        url = self._session.shown.server.url

        def told(items: list[Item]) -> None:
            if not words:
                self._recent = url, items
            done(items)

        self._session.ask(
            translate("Silo", "Searching"),
            lambda client, _control: client.search_items(words, limit=MOST_FOUND),
            told,
            failed,
        )

    @property
    def recent(self) -> list[Item]:
        """Return the items that the server in use showed last for a search without words."""
        url, items = self._recent
        return items if url == self._session.shown.server.url else []

    def details(
        self, part_number: str, done: Callable[[ItemHistory], None], failed: Callable[[SiloError], None]
    ) -> None:
        """Fetch an item's revisions and picture."""
        self._session.ask(
            translate("Silo", "Asking Silo"),
            lambda client, _control: _history_of(client, part_number),
            done,
            failed,
        )

    def pull(
        self,
        part_number: str,
        revision: int | None,
        folder: Path,
        *,
        overwrite: bool = False,
        done: Callable[[Pulled], None],
        failed: Callable[[SiloError], None],
    ) -> None:
        """Fetch a file with all linked files. Files that FreeCAD has open, or that have edits that are not in
        Silo, are left alone; ``overwrite`` replaces the latter and keeps copies.
        """
        from silo.platform import Spelling  # late: FreeCAD's start waits for this module

        real = Spelling().real  # a link may have opened the file under another spelling of its name
        mine = {real(path) for path in self._desk.open_paths()}
        outbox = self._session.outbox

        def run(client: SiloClient, control: Control) -> Pulled:
            from silo.vault.pull import Rules, fetched, place

            def progress(name: str, count: int) -> None:
                control.progress(f"{count + 1}: {plain(name, 60)}", None)

            rules = Rules(
                overwrite=overwrite,
                keep=outbox.keep_aside,
                is_open=lambda path: real(path) in mine or self._desk.is_open_elsewhere(path),
                learn=lambda sha256, item, number: outbox.learn(client.base_url, sha256, item, number),
            )
            with fetched(
                client, part_number, revision, cancelled=control.cancelled, progress=progress
            ) as tree:
                folder.mkdir(parents=True, exist_ok=True)
                return place(tree, folder, rules)

        self._session.ask(translate("Silo", "Fetching from Silo"), run, done, failed)

    def open(self, path: str) -> None:
        """Open a fetched file in FreeCAD; a problem becomes a box of the pane."""
        self._guarded(path, lambda: self._desk.open(path))

    # -- the history of a document ----------------------------------------------------------------------

    def history(
        self,
        identity: str,
        base: DocumentOrigin,
        done: Callable[[ItemHistory], None],
        failed: Callable[[SiloError], None],
    ) -> None:
        """Fetch the revisions of a document's item.

        base
            the base from which the document was made.
        """
        outbox = self._session.outbox

        def run(client: SiloClient, _control: Control) -> ItemHistory:
            from silo.api.revisions import standing
            from silo.bom.errors import NotFoundError

            item = client.get_item_by_uuid(identity)
            if item is None:
                raise NotFoundError(translate("Silo", "This server does not know the item of this document."))
            item_history = _history_of(client, item.part_number)
            origin = base.settle(outbox)
            number = outbox.known_revision(client.base_url, origin, identity)
            made_from = standing(item_history.revisions, origin, number).base
            return replace(item_history, base=made_from.revision_number if made_from is not None else None)

        self._session.ask(translate("Silo", "Asking Silo"), run, done, failed)

    def bom_change(
        self,
        part_number: str,
        path: str,
        older: int | None,
        newer: int,
        done: Callable[[list[str]], None],
        failed: Callable[[SiloError], None],
    ) -> None:
        """Compare a revision's BOM with the one before, line by line in words; both files are read."""

        def run(client: SiloClient, control: Control) -> list[str]:
            from silo.vault.pull import RevisionBoms, line_texts

            with RevisionBoms(client, part_number, path, control.cancelled) as boms:
                return line_texts(boms.change(older, newer))

        self._session.ask(translate("Silo", "Comparing revisions"), run, done, failed)


@dataclass(frozen=True)
class ProjectRow:
    """A file of the project.

    edits
        FreeCAD has it open, with edits that are not in the file.
    theirs
        the newest revision in Silo, if it is newer than what the file was made from.
    """

    place: str
    path: str
    state: StandState
    moved_from: str = ""
    edits: bool = False
    theirs: Theirs | None = None

    @property
    def is_fine(self) -> bool:
        """Return True if Silo has the file as it is here."""
        return self.state.name == "SAME" and not self.edits

    @property
    def tone(self) -> Tone:
        """Return the tone for its state."""
        if self.is_fine:
            return Tone.GOOD
        return Tone.WARNING if self.state.name in ("BOTH", "NO_ITEM") else Tone.CHANGED

    def words(self) -> str:
        """Describe its state, for people."""
        texts = {
            "SAME": translate("Silo", "in Silo"),
            "NEW": translate("Silo", "not in Silo"),
            "EDITED": translate("Silo", "edited since its commit"),
            "NEWER": translate("Silo", "newer in Silo"),
            "BOTH": translate("Silo", "edited, and newer in Silo"),
            "WAITING": translate("Silo", "waits to be sent"),
            "NO_ITEM": translate("Silo", "its item is not on this server"),
        }
        row_words = [texts[self.state.name]]
        if self.edits:
            row_words.append(translate("Silo", "unsaved edits"))
        if self.moved_from:
            row_words.append(translate("Silo", "was {place}", place=self.moved_from))
        if self.theirs is not None:
            row_words.append(self.theirs.headline)
        return plain("; ".join(row_words), 300)


@dataclass(frozen=True)
class ProjectView:
    """All files of a project, and what is wrong beside them, in sentences."""

    root: str = ""
    rows: tuple[ProjectRow, ...] = ()
    notes: tuple[str, ...] = ()

    def shown(self, words: str, *, only_left: bool) -> list[ProjectRow]:
        """Return the rows that contain all of these words; ``only_left``: only those that differ from
        Silo.
        """
        wanted = words.casefold().split()
        return [
            row
            for row in self.rows
            if not (only_left and row.is_fine)
            and all(word in f"{row.place} {row.words()}".casefold() for word in wanted)
        ]

    def heading(self) -> str:
        """Say how many files there are, and how many of them differ from Silo."""
        left = sum(not row.is_fine for row in self.rows)
        return translate("Silo", "{n} files, {left} of them different from Silo", n=len(self.rows), left=left)


class ProjectFlow:
    """One per FreeCAD: the project folder, how its files stand, and *Commit All*."""

    def __init__(
        self,
        session: Session,
        preferences: Preferences,
        commits: CommitFlow,
        desk: RevisionDesk,
        files: RevisionFlow,
    ) -> None:
        self._session, self._preferences, self._commits = session, preferences, commits
        self._desk, self._files = desk, files
        self._newest = object()
        self.view = ProjectView()

    def roots(self) -> list[str]:
        """Return the root of the project that was shown last, and those of the projects of open documents."""
        folders = {os.path.dirname(path) for path in self._desk.open_paths()}
        project_roots = {project.root for folder in folders if (project := Project.of(folder)) is not None}
        last = self._preferences.text("ProjectFolder")
        roots_before = [last] if last and os.path.isdir(last) else []
        return [*roots_before, *sorted(project_roots - {last})]

    def choose(self, root: str) -> None:
        """Remember the folder: here, and by the mark in it, which everybody who shares it finds."""
        self._preferences.set("ProjectFolder", one_path(root))

    def look(
        self, root: str, done: Callable[[ProjectView], None], failed: Callable[[SiloError], None]
    ) -> None:
        """Find out how the files of a project stand; without a connection, as far as the folder
        remembers it. Only the newest look is reported.
        """
        look = self._newest = object()
        edited = self._edited()

        def work(client: SiloClient | None) -> ProjectView:
            return _project_view(root, client, self._session.outbox, edited)

        def seen(view: ProjectView) -> None:
            if look is self._newest:
                self.view = view
                done(view)

        def unseen(error: SiloError) -> None:
            if look is self._newest:
                failed(error)

        def offline(error: SiloError) -> None:
            # A look without a server works beside the others, so an older look can end after a newer.
            if isinstance(error, (DocumentError, InputError)):
                unseen(error)
            else:
                self._session.aside(title, lambda _control: work(None), seen, unseen)

        title = translate("Silo", "Looking at the project")
        self._session.ask(title, lambda client, _control: work(client), seen, offline)

    def _edited(self) -> set[str]:
        """Return the open files with edits, as far as there is time to compare; marks of FreeCAD alone do not
        count.
        """
        documents, until = self._desk.documents, time.thread_time() + MOST_S
        return {
            one_path(path)
            for path in self._desk.open_paths()
            if (doc := self._desk.find(path)) is not None
            and documents.is_modified(doc)
            and documents.is_edited(doc, until)
        }

    def commit_all(self, comment: str) -> None:
        """Save what is edited, and send all files that differ from Silo."""
        paths = {row.path for row in self.view.rows}
        self._commits.commit_folder(self.view.root, paths & self._edited(), comment)

    def decide(self, row: ProjectRow, choice: Choice) -> None:
        """Do what a person chose about a file that is newer in Silo."""
        if choice is Choice.ON_TOP:
            if row.edits:
                self._commits.commit_folder(self.view.root, (row.path,), "")
            self._commits.send_linked(row.path, set(), "", over=(row.path,))
        elif row.theirs is not None:
            self._files.choose(row.path, row.theirs, choice)

    def open(self, row: ProjectRow) -> None:
        """Open a file of the project."""
        self._files.open(row.path)


def _project_view(root: str, client: SiloClient | None, store: Store, edited: Set[str]) -> ProjectView:
    from silo.vault.project import ProjectState as StandState
    from silo.vault.project import address_of, stand

    project = Project(one_path(root))
    if not os.path.isfile(project.path(PROJECT_FILE)):
        with suppress(DocumentError):  # a folder that takes nothing can be looked at
            project.note({})
    belonging, standings = stand([project.root], project, client, store)
    rows = []
    for standing in standings:
        theirs, file = None, standing.file
        if (
            standing.state in (StandState.NEWER, StandState.BOTH)
            and standing.newest is not None
            and client is not None
        ):
            newest = standing.newest.model_dump(mode="json", exclude={"properties", "links"})
            theirs = theirs_of(file.path, address_of(file, client), newest)
        rows.append(
            ProjectRow(file.place, file.path, standing.state, file.moved_from, file.path in edited, theirs)
        )
    sentences = {
        translate("Silo", "{place} links to {name}, which is not there."): belonging.missing,
        translate("Silo", "{place} links to {name}, outside the project: it is not sent."): belonging.outside,
        translate("Silo", "{place} cannot be read: {name}"): belonging.unreadable,
        translate("Silo", "{place} is a copy of {name}, which has the item."): belonging.doubtful,
        translate("Silo", "{place} is gone since its commit."): [(place, "") for place in belonging.gone],
    }
    notes = [
        plain(filled(text, place=place, name=name), 300)
        for text, pairs in sentences.items()
        for place, name in pairs
    ]
    return ProjectView(project.root, tuple(sorted(rows, key=lambda row: row.place)), tuple(notes))


def file_in_project(folder: str, item: str) -> str:
    """Find the file of an item in a project; "" if there is none."""
    if (project := Project.of(folder)) is None:
        return ""
    items = project.files().items()
    paths = [project.path(place) for place, kept in items if kept.document.lower() == item.lower()]
    return next(filter(os.path.isfile, paths), "")


def _history_of(client: SiloClient, part_number: str) -> ItemHistory:
    from silo.vault.pull import file_revisions

    item = client.get_item(part_number)
    revisions = file_revisions(client.revisions(part_number))
    return ItemHistory(item, tuple(revisions), client.thumbnail(part_number) or b"")


def over_edits(pulled: Pulled) -> list[Theirs]:
    """Return the new versions of files whose edits are not in Silo."""
    return [
        Theirs(str(file.path), file.part_number, file.revision, newer={"revision_number": file.revision})
        for file in pulled.files
        if file.state.value == "edited"
    ]


def left_alone(pulled: Pulled) -> Sequence[str]:
    """Say what a pull did not do, in sentences."""
    from silo.vault.pull import PullState

    texts = {
        PullState.EDITED: translate("Silo", "{name} has edits that are not in Silo; it was left alone."),
        PullState.OPEN: translate("Silo", "{name} is open in FreeCAD; it was left alone."),
    }
    lines = [
        texts[file.state].replace("{name}", file.path.name) for file in pulled.files if file.state in texts
    ]
    lost = translate("Silo", "{path}, which {name} links to, was not fetched: {reason}")
    for link in pulled.lost:
        text = filled(lost, path=link.path or "?", name=link.position, reason=link.reason)
        lines.append(plain(text, 300))
    return lines


def _not_here(path: str) -> list[str]:
    """Return the files to which a file links and that are missing."""
    from silo.fcstd.linked import recorded_paths
    from silo.locator import FoundFile, Locator

    locator, folder = Locator(), (os.path.dirname(path),)
    try:
        recorded = recorded_paths(path)
    except DocumentError:
        return []  # FreeCAD says what it cannot read
    return [
        os.path.basename(place)
        for place in recorded
        if not isinstance(locator.find(place, folder), FoundFile)
    ]


def _aside(*names: str) -> Path:
    return cache_folder().joinpath("revisions", *names)


def _word(text: str) -> str:
    return re.sub(r"[^\w.-]", "_", text) or "item"


def _name(path: str) -> str:
    return plain(os.path.basename(path), 80)
