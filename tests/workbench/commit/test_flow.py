# SPDX-License-Identifier: LGPL-2.1-or-later
"""A commit from the button to the server, without FreeCAD and Qt."""

from __future__ import annotations

import threading
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest
from desk import Office
from fcstd_writer import Doc, Raw, part

from silo.outbox.entry import Commit
from silo.outbox.store import Store
from silo.project_folder import Project
from silo.registering.journal import Journal
from silo.registering.request import RegistrationRequest
from silo.workbench.activity.box import Action, Do, EntryLine, PaneEntry
from silo.workbench.commit.flow import CommitFlow
from silo.workbench.register.flow import RegisterFlow


@pytest.fixture(name="flow")
def _flow(office: Office) -> CommitFlow:
    return CommitFlow(office.session, office.preferences, office.desk, path=office.folder / "same.json")


def titles(office: Office) -> list[str]:
    return [entry.title for entry in office.session.shown.activity.entries]


def test_a_document_and_what_it_links_to(office: Office, flow: CommitFlow) -> None:
    """Saved leaves first, asked about once, and in Silo."""
    leaf, top = office.document("Leaf"), office.document("Top")
    top.OutList = [leaf]
    flow.start(top)
    office.settle()
    assert office.desk.documents.saved == ["Leaf", "Top"]
    assert len(office.desk.asked) == 1
    assert [sent.entry.label for sent in office.sent] == ["Leaf", "Top"]
    assert {sent.entry.comment for sent in office.sent} == {"a comment"}


def marked(office: Office, *names: str) -> Doc:
    """A file with a registered part for each name."""
    doc = Doc(label="Both")
    for name in names:
        uuid = office.silo.create_item("kindred-rd", "M01", name).id
        own = Raw("App::PropertyString", f'<String value="{uuid}"/>')
        doc.add("Part::Box", name, Height=1.0, SiloItemId=own)
    return doc


def test_files_without_an_item_go_along(office: Office, flow: CommitFlow) -> None:
    """A library and a sheet that a part links to, though FreeCAD has neither open; nothing from outside."""
    vault = office.folder / "vault"
    marked(office, "Left", "Right").save(vault / "lib" / "Both.FCStd")
    Doc(label="S").add("Spreadsheet::Sheet", "Sheet").save(vault / "Sheet.FCStd")
    part("Far", "Box").save(office.folder / "Far.FCStd")
    Project(str(vault)).note({})
    top = office.document("Top")
    doc = Doc(label="Top", meta={"SiloUUID": top.identity}).link("L", "lib/Both.FCStd", "Left")
    top.content = doc.link("S", "Sheet.FCStd", "Sheet").link("F", "../Far.FCStd", "Box").bytes()
    flow.start(top)
    office.settle()
    files = {stored.revisions[-1].file_path: stored for stored in office.silo.documents.values()}
    assert set(files) == {"lib/Both.FCStd", "Sheet.FCStd"}
    assert files["lib/Both.FCStd"].files == {1: (vault / "lib" / "Both.FCStd").read_bytes()}
    assert {held.object for held in files["lib/Both.FCStd"].held} == {"Left", "Right"}
    assert office.files("Top") == [top.content]
    top.changed = True
    flow.start(top)
    office.settle()
    assert [len(stored.files) for stored in files.values()] == [1, 1]


def test_a_file_of_several_parts_is_committed_as_it_is(office: Office, flow: CommitFlow) -> None:
    """It needs no number of its own: nobody is advised to register it."""
    both = office.document("Both", registered=False)
    both.content, both.several = marked(office, "Left", "Right").bytes(), True
    flow.start(both)
    office.settle()
    (stored,) = office.silo.documents.values()
    assert stored.files == {1: both.content}
    assert titles(office) == ["Committed: Both.FCStd"]
    assert office.desk.registers == []


def test_who_says_no_commits_nothing(office: Office, flow: CommitFlow) -> None:
    """Not even saved."""
    office.desk.willing = False
    leaf, top = office.document("Leaf"), office.document("Top")
    top.OutList = [leaf]
    flow.start(top)
    office.settle()
    assert (office.desk.documents.saved, office.sent, flow.running) == ([], [], False)


def test_a_document_that_was_closed_meanwhile_stops_no_other(office: Office, flow: CommitFlow) -> None:
    """Its ReferenceError is its own; the next document and the next commit have their turn."""
    gone, fine, later = office.document("Gone"), office.document("Fine"), office.document("Later")
    fine.OutList = [gone]
    flow.start(fine)
    gone.closed = True
    flow.start(later)
    office.settle()
    assert [sent.entry.label for sent in office.sent] == ["Fine", "Later"]
    (lost,) = [e for e in office.session.shown.activity.entries if e.title == "Not committed: Gone"]
    assert "closed before it was saved" in lost.lines[0].text
    assert not flow.running


def test_a_fault_of_ours_stops_no_other_either(office: Office, flow: CommitFlow) -> None:
    """Whatever goes wrong when a document is handed over."""
    bad, good = office.document("Bad"), office.document("Good")
    keep = office.session.keep

    def fail(commit: object, failed: object, base: object = None) -> None:
        office.session.keep = keep  # type: ignore[method-assign]
        raise ZeroDivisionError

    office.session.keep = fail  # type: ignore[method-assign, assignment]
    flow.start(bad)
    flow.start(good)
    with pytest.raises(ZeroDivisionError):
        office.desk.pass_turns()
    office.settle()
    assert [sent.entry.label for sent in office.sent] == ["Good"]


def test_closing_saves_what_was_committed(office: Office, flow: CommitFlow) -> None:
    """FreeCAD's window is asked to close before the turns had their time."""
    docs = [office.document(f"P{number}") for number in range(3)]
    for doc in docs:
        flow.start(doc)
    flow.finish()
    for doc in docs:
        doc.closed = True
    assert office.desk.documents.saved == ["P0", "P1", "P2"]
    office.session.close(lambda left: left(30.0))
    office.session = office.start()
    office.session.begin(live=False)
    office.settle()
    assert [office.files(doc.Name) for doc in docs] == [[b"content"]] * 3


def test_without_a_number_it_is_saved_and_said(office: Office, flow: CommitFlow) -> None:
    """With the way to register it."""
    flow.start(office.document("New", registered=False))
    office.settle()
    assert titles(office) == ["Saved, but not in Silo: New"]
    assert [action.do for action in office.session.shown.activity.entries[0].actions] == [Do.REGISTER]


def test_a_recomputed_document_stays_as_it_is(office: Office, flow: CommitFlow) -> None:
    """Only what was edited is saved and sent, and nothing has to be asked for that."""
    leaf, top = office.document("Leaf"), office.document("Top")
    leaf.recomputed, top.OutList = True, [leaf]
    flow.start(top)
    office.settle()
    assert office.desk.documents.saved == ["Top"]
    assert office.desk.asked == []


def test_an_unregistered_one_is_registered_with_its_comment(office: Office) -> None:
    """The dialog for its part number comes after it is saved; what a person wrote becomes the revision's."""
    opened: list[str] = []
    flow = CommitFlow(office.session, office.preferences, office.desk, register=opened.append)
    new = office.document("New", registered=False)
    flow.start(new)
    office.settle()
    assert opened == [new.FileName]
    assert office.desk.documents.saved == ["New"]

    # Not registered, and committed again: the comment is there to begin with.
    office.desk.comments.clear()
    flow.start(new)
    office.settle()
    assert office.desk.comments == ["a comment"]
    registering = RegisterFlow(
        office.session, office.preferences, flow, office.desk, journal=Journal(office.folder / "journal")
    )
    registering.start(new)
    office.settle()
    (window,) = office.desk.registers
    window.register([RegistrationRequest(c, "New", "part", "M01") for c in window.offers[0].candidates])
    office.settle()
    (number,) = (s.item.part_number for s in office.silo.items.values())
    assert [r.comment for r in office.silo.revisions(number) if r.file_name] == ["a comment"]
    assert flow.comment_of(new.FileName) == ""
    # What the first two commits said of it is not so any more.
    assert titles(office) == [f"Committed: {number} New"]


def test_a_disk_that_does_not_take_it_is_a_box(office: Office, flow: CommitFlow) -> None:
    """The person hears of it at once."""
    (office.folder / "data").write_text("a file in the way")
    flow.start(office.document("Bolt"))
    office.settle()
    assert titles(office) == ["Not committed: Bolt"]


class SlowDisk(Store):
    """Copies wait until the test lets them go.

    apart
        the project is on another disk than the outbox, so that there are no second names.
    """

    def __init__(self, path: Path, *, apart: bool = False) -> None:
        super().__init__(path)
        self.gate, self.apart = threading.Event(), apart

    def hold(self, path: str, key: str) -> Path | None:
        return None if self.apart else super().hold(path, key)

    def finish(self, *arguments: Any, **more: Any) -> str:
        self.gate.wait(60)
        return super().finish(*arguments, **more)


def test_a_save_before_the_copy_is_made_is_no_part_of_the_commit(office: Office, flow: CommitFlow) -> None:
    """The commit is reported as not done; a BOM never goes with a later file."""
    office.session.outbox = disk = SlowDisk(office.session.outbox.path, apart=True)
    doc = office.document("Plate", b"as committed")
    flow.start(doc)
    office.desk.pass_turns()
    doc.content = b"as saved later"
    office.desk.documents.save(doc)
    disk.gate.set()
    office.settle()
    assert (office.sent, office.files("Plate")) == ([], [])
    (box,) = [e for e in office.session.shown.activity.entries if e.title == "Not committed: Plate"]
    assert "commit it again" in box.lines[0].text
    flow.start(doc)
    office.settle()
    assert office.files("Plate") == [b"as saved later"]


def test_the_bom_is_that_of_the_file_whatever_is_edited_meanwhile(office: Office, flow: CommitFlow) -> None:
    """A document that was saved when the commit was asked for, and is edited before its turn comes."""
    bolt, top = office.document("Bolt"), office.document("Top", b"one bolt")
    top.parts[bolt] = 1
    office.desk.documents.save(top)
    flow.start(top)
    top.parts[bolt], top.content, top.changed = 2, b"two bolts", True
    office.settle()
    number = next(s.item.part_number for s in office.silo.items.values() if s.item.name == "Top")
    assert office.files("Top") == [b"two bolts"]
    assert [line.quantity for line in office.silo.get_bom(number)] == [2]


def test_a_second_commit_before_the_first_is_copied_is_made_from_it(office: Office, flow: CommitFlow) -> None:
    """Neither is held because of the other."""
    office.session.outbox = disk = SlowDisk(office.session.outbox.path)
    doc = office.document("Plate", b"one")
    for content in (b"one", b"two", b"three"):
        doc.content, doc.changed = content, True
        flow.start(doc)
        office.desk.pass_turns()
    disk.gate.set()
    office.settle()
    assert (office.files("Plate"), office.session.shown.waiting) == ([b"one", b"two", b"three"], ())


def test_a_bom_names_the_files_content_where_the_document_is_as_saved(
    office: Office, flow: CommitFlow
) -> None:
    """A recompute is no edit; what somebody else has written meanwhile is not this document's content."""
    doc = office.document("Top", b"top")
    path = Path(doc.FileName)
    path.write_bytes(b"top")
    office.desk.documents.base(doc)
    commit = Commit(doc.FileName, 0.0, "Top")

    def named() -> bool:
        made = flow.made_from(commit, doc)
        assert made.sha256 in ("", sha256(path.read_bytes()).hexdigest())
        return bool(made.sha256)

    told = []
    for doc.changed, doc.recomputed in ((False, False), (True, True), (True, False)):
        told.append(named())
    doc.changed = False
    office.desk.documents.base(doc).stamp = (0, 0, 0)  # type: ignore[assignment]
    assert (*told, named()) == (True, True, False, False)


def test_two_files_that_are_one_part_hide_no_question_about_a_third(office: Office, flow: CommitFlow) -> None:
    """The box about all three still asks; the box about the two does not."""
    for key, files in (("two", ("a", "b")), ("three", ("a", "b", "c"))):
        ask = Action(Do.SAME, "Same part", "ID", "Top", files)
        line = EntryLine("one identity", actions=(ask,))
        office.session.add(PaneEntry(key, key, 1.0, lines=(line,), rank=1))
    flow.accept("id", ("a", "b"))
    asks = {entry.key: bool(entry.lines[0].actions) for entry in office.session.shown.activity.entries}
    assert asks == {"two": False, "three": True}
