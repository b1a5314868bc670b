# SPDX-License-Identifier: LGPL-2.1-or-later
"""The project view: which files there are, how they stand, *Commit All*, and newer files over edits."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from pathlib import Path

import pytest
from desk import Cad, Document, Office
from fcstd_writer import part

from silo.api.files import Origin
from silo.bom.errors import UnreachableError
from silo.workbench.colleagues.theirs import Choice
from silo.workbench.commit.flow import CommitFlow
from silo.workbench.revisions.flow import RevisionFlow
from silo.workbench.revisions.project import ProjectFlow, ProjectView, file_in_project


@dataclass
class Place:
    """A project of a registered plate, and a file without an item."""

    office: Office
    root: Path
    identity: str
    cad: Cad

    def flow(self) -> ProjectFlow:
        """That of a FreeCAD that has just been started."""
        office = self.office
        commits = CommitFlow(office.session, office.preferences, office.desk, path=self.root / "same.json")
        files = RevisionFlow(office.session, self.cad)
        return ProjectFlow(office.session, office.preferences, commits, self.cad, files)

    def write(self, label: str) -> bytes:
        """Write the plate with this label."""
        path = self.root / "parts" / "Plate.FCStd"
        part("Plate", label, uuid=self.identity).save(path)
        return path.read_bytes()

    def look(self, flow: ProjectFlow) -> ProjectView:
        views: list[ProjectView] = []
        errors: list[Exception] = []
        flow.look(str(self.root), views.append, errors.append)
        self.office.settle()
        assert not errors
        return views[-1]

    def commit_all(self, flow: ProjectFlow, comment: str) -> None:
        flow.commit_all(comment)
        self.office.settle()

    def committed(self) -> ProjectFlow:
        """That of a FreeCAD which has sent all files."""
        flow = self.flow()
        self.look(flow)
        self.commit_all(flow, "")
        return flow

    def opened(self, doc: Document) -> Document:
        """Let FreeCAD have a document open."""
        for docs in (self.cad.docs, self.office.desk.open):
            docs.append(doc)
        return doc

    def states(self, flow: ProjectFlow) -> dict[str, str]:
        return {row.place: row.state.name for row in self.look(flow).rows}

    def colleague_commits(self) -> bytes:
        theirs = self.office.folder / "theirs" / "Plate.FCStd"
        theirs.parent.mkdir(exist_ok=True)
        part("Plate", "theirs", uuid=self.identity).save(theirs)
        self.office.silo.user = "alice"
        number = self.office.silo.get_items_by_uuid([self.identity])[self.identity].part_number
        self.office.silo.upload_file(number, theirs, "thinner", origin=Origin(base_revision=1))
        self.office.silo.user = "designer"
        return theirs.read_bytes()


@pytest.fixture(name="place")
def _place(office: Office) -> Place:
    root = office.folder / "project"
    (root / "parts").mkdir(parents=True)
    identity = office.silo.create_item("kindred-rd", "M01", "Plate").id
    made = Place(office, root, identity, Cad(office.desk.documents, []))
    made.write("Plate")
    part("Sheet", "Sheet").save(root / "Sheet.FCStd")
    return made


def test_the_folder_is_chosen_once_and_found_after_a_restart(place: Place) -> None:
    """It is never guessed; whoever has a file of it open finds it by its mark."""
    flow = place.flow()
    stray = Document("Stray", str(place.root / "parts" / "Plate.FCStd"))
    place.cad.docs.append(stray)
    assert flow.roots() == []
    flow.choose(str(place.root))
    place.look(flow)
    place.cad.docs.clear()
    assert place.flow().roots() == [str(place.root)]
    place.office.preferences.set("ProjectFolder", "")
    assert place.flow().roots() == []
    place.cad.docs.append(stray)
    assert place.flow().roots() == [str(place.root)]


def test_commit_all_sends_every_file_that_silo_does_not_have(place: Place) -> None:
    flow = place.flow()
    assert place.states(flow) == {"Sheet.FCStd": "NEW", "parts/Plate.FCStd": "NEW"}
    assert [row.place for row in flow.view.shown("plate", only_left=True)] == ["parts/Plate.FCStd"]
    place.commit_all(flow, "the first")
    assert place.states(flow) == {"Sheet.FCStd": "SAME", "parts/Plate.FCStd": "SAME"}
    assert flow.view.shown("", only_left=True) == []
    assert flow.view.heading() == "2 files, 0 of them different from Silo"
    assert file_in_project(str(place.root), place.identity.upper()) == str(
        place.root / "parts" / "Plate.FCStd"
    )
    assert file_in_project(str(place.office.folder), place.identity) == ""


def test_unsaved_edits_are_shown_saved_and_sent(place: Place) -> None:
    flow = place.committed()
    path = place.root / "parts" / "Plate.FCStd"
    before = path.read_bytes()
    edited = place.write("edited")
    path.write_bytes(before)
    doc = place.opened(Document("Plate", str(path), edited, place.identity))
    place.office.desk.documents.base(doc).settle()  # as when it is opened
    doc.recomputed = True  # FreeCAD marks it, but nothing differs
    assert not any(row.edits for row in place.look(flow).rows)
    doc.recomputed = False
    view = place.look(flow)
    assert [(row.place, row.edits) for row in view.shown("", only_left=True)] == [("parts/Plate.FCStd", True)]
    assert view.rows[1].words().endswith("unsaved edits")
    place.commit_all(flow, "edited")
    assert place.office.files("Plate")[-1] == edited
    assert place.look(flow).shown("", only_left=True) == []


def test_an_open_file_without_an_item_is_saved_and_sent(place: Place) -> None:
    """It is a document of its own."""
    flow = place.committed()
    path = place.root / "Sheet.FCStd"
    before = path.read_bytes()
    part("Sheet", "edited").save(path)
    edited = path.read_bytes()
    path.write_bytes(before)
    place.opened(Document("Sheet", str(path), edited, "", several=True))
    assert [row.place for row in place.look(flow).shown("", only_left=True)] == ["Sheet.FCStd"]
    place.commit_all(flow, "edited")
    assert path.read_bytes() == edited
    assert place.look(flow).shown("", only_left=True) == []


@pytest.mark.parametrize("choice", [Choice.ON_TOP, Choice.TAKE, Choice.OPEN])
def test_a_new_version_over_edits_is_a_question(place: Place, choice: Choice) -> None:
    """Commit All leaves the file alone; each answer does what it says, and loses nothing."""
    flow = place.committed()
    theirs = place.colleague_commits()
    assert place.states(flow)["parts/Plate.FCStd"] == "NEWER"
    mine = place.write("mine")
    row = place.look(flow).rows[1]
    assert row.state.name == "BOTH"
    assert row.theirs is not None
    assert row.theirs.headline.startswith("alice committed revision 2")
    place.commit_all(flow, "not this one")
    assert place.office.files("Plate")[-1] == theirs
    flow.decide(row, choice)
    place.office.settle()
    path = place.root / "parts" / "Plate.FCStd"
    newest, on_disk = place.office.files("Plate")[-1], path.read_bytes()
    assert (newest, on_disk) == {
        Choice.ON_TOP: (mine, mine),
        Choice.TAKE: (theirs, theirs),
        Choice.OPEN: (theirs, mine),
    }[choice]
    kept = [file.read_bytes() for file in (place.office.folder / "data").rglob("kept-aside/**/*.FCStd")]
    assert (mine in kept) == (choice is Choice.TAKE)
    assert [one.name for one in place.cad.opened] == ([] if choice is Choice.ON_TOP else ["Plate.FCStd"])


def test_without_a_connection_the_folder_says_what_it_remembers(place: Place) -> None:
    flow = place.committed()
    place.write("edited")

    def refuse(_name: str) -> None:
        raise UnreachableError("no route")

    place.office.silo.before = refuse
    assert place.states(flow) == {"Sheet.FCStd": "SAME", "parts/Plate.FCStd": "EDITED"}


def test_an_older_look_does_not_replace_a_newer_one(place: Place) -> None:
    """A look that found no server works beside the others, and can end after them."""
    flow, office = place.committed(), place.office
    free = threading.Event()
    office.session.aside("in the way", lambda _control: free.wait(60), lambda _done: None, print)

    def refuse(_name: str) -> None:
        raise UnreachableError("no route")

    office.silo.before = refuse
    older: list[object] = []
    flow.look(str(place.root), older.append, older.append)
    office.gui.run_until(lambda: office.session._aside.left() == 2)
    office.silo.before = lambda _name: None
    place.write("edited")
    newer: list[ProjectView] = []
    flow.look(str(place.root), newer.append, older.append)
    office.gui.run_until(lambda: newer)
    free.set()
    office.settle()
    assert (flow.view, older) == (newer[0], [])
    assert [row.state.name for row in flow.view.rows] == ["SAME", "EDITED"]
