# SPDX-License-Identifier: LGPL-2.1-or-later
"""The project view: all files of a project folder, each with how it stands to Silo.

The folder is the one that the user chose, or a marked one above an open document; it is never guessed.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Set
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from silo.bom.errors import DocumentError, InputError, SiloError
from silo.outbox.entry import State
from silo.platform.spelling import one_path
from silo.project_folder import PROJECT_FILE, Project
from silo.workbench.colleagues.states import state_words
from silo.workbench.colleagues.theirs import Choice, Theirs, theirs_of
from silo.workbench.commit.flow import CommitFlow
from silo.workbench.desk import MOST_S
from silo.workbench.revisions.desk import RevisionDesk
from silo.workbench.revisions.flow import RevisionFlow
from silo.workbench.session.session import Session
from silo.workbench.tone import Tone
from silo.workbench.words import counted, filled, plain, spoken, translate

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.file_state import FileState as StandState
    from silo.outbox.store import Store
    from silo.workbench.settings.preferences import Preferences


@dataclass(frozen=True)
class ProjectRow:
    """A file of the project.

    edits
        FreeCAD has it open, with edits that are not in the file.
    theirs
        the newest revision in Silo, if it is newer than what the file was made from.
    held
        why its BOM could not be sent; "" if none is held.
    """

    place: str
    path: str
    state: StandState
    moved_from: str = ""
    edits: bool = False
    theirs: Theirs | None = None
    held: str = ""

    @property
    def is_fine(self) -> bool:
        """Return True if Silo has the file as it is here."""
        return self.state.name == "SAME" and not self.edits and not self.held

    @property
    def tone(self) -> Tone:
        """Return the tone for its state."""
        if self.is_fine:
            return Tone.GOOD
        if self.held:
            return Tone.ERROR
        return Tone.WARNING if self.state.name in ("BOTH", "HELD", "SET_BACK", "UNKNOWN") else Tone.CHANGED

    def words(self) -> str:
        """Describe its state, for people."""
        row_words = [state_words(self.state)]
        if self.held:
            row_words.append(translate("Silo", "its BOM is held: {why}", why=spoken(self.held)))
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
        text = translate("Silo", "{n} files, {left} of them different from Silo", n=len(self.rows), left=left)
        held = sum(bool(row.held) for row in self.rows)
        if not held:
            return text
        one, many = translate("Silo", "{n} BOM is held"), translate("Silo", "{n} BOMs are held")
        return f"{text}; {counted(held, one, many)}"


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
            if any(row.held for row in view.rows):
                self._session.free_held()
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
        """Do what a user chose about a file that is newer in Silo."""
        if choice is Choice.ON_TOP:
            if row.edits:
                self._commits.commit_folder(self.view.root, (row.path,), "")
            self._commits.send_linked(row.path, set(), "", over=(row.path,))
        elif row.theirs is not None:
            self._files.choose(row.path, row.theirs, choice, taken=lambda: self._drop_held(row.path))

    def _drop_held(self, path: str) -> None:
        """Discard the held commits of a file that was replaced by the newer one; copies of them are kept."""
        for entry in self._session.outbox.entries():
            if entry.path == path and entry.state is State.HELD:
                self._session.discard(entry.id, keep=True)

    def open(self, row: ProjectRow) -> None:
        """Open a file of the project."""
        self._files.open(row.path)


def _project_view(root: str, client: SiloClient | None, store: Store, edited: Set[str]) -> ProjectView:
    from silo.file_state import FileState as StandState
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
            ProjectRow(
                file.place,
                file.path,
                standing.state,
                file.moved_from,
                file.path in edited,
                theirs,
                standing.held,
            )
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
    items = project.records().items()
    paths = [project.path(place) for place, kept in items if kept.document.lower() == item.lower()]
    return next(filter(os.path.isfile, paths), "")
