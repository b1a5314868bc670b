# SPDX-License-Identifier: LGPL-2.1-or-later
"""What lies below a commit: what a designer saved goes into Silo, whatever FreeCAD has marked, or is said."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import pytest
from desk import Document, Office, Watched
from fcstd_writer import Doc, locals_, part

from silo.api.files import Origin
from silo.bom.errors import UnreachableError
from silo.outbox.entry import State
from silo.project_folder import Project, record_of
from silo.workbench.commit.flow import CommitFlow
from silo.workbench.documents.opened import Opened


@dataclass
class Week:
    """Top links Sub and a skeleton, Sub links Plate; all are open, and in Silo."""

    office: Office
    flow: CommitFlow
    ids: dict[str, str] = field(default_factory=dict)
    docs: dict[str, Document] = field(default_factory=dict)
    count: int = 0

    @property
    def root(self) -> Path:
        return self.office.folder / "vault"

    def content(self, name: str, label: str) -> bytes:
        """The bytes of a file with this label."""
        if name == "Plate":
            return part(label, uuid=self.ids["Plate"]).bytes()
        if name == "Skeleton":
            doc = Doc(label=label)
            return doc.add("Spreadsheet::Sheet", "Sheet").bytes()
        below = {"Sub": "Plate", "Top": "Sub"}[name]
        doc = Doc(name, meta={"SiloUUID": self.ids[name]}).link("L", f"{below}.FCStd", "Box")
        if name == "Top":
            doc.link("S", "Skeleton.FCStd", "Sheet")
        return doc.add("App::Part", "Assembly", Type="Assembly", Label=label, Group=locals_("L")).bytes()

    def edit(self, name: str) -> None:
        """Edit a document in FreeCAD, which marks it, and everything that links to it."""
        self.count += 1
        self.docs[name].content = self.content(name, f"{name} {self.count}")
        self.docs[name].changed, self.docs[name].recomputed = True, False

    def save(self, name: str) -> None:
        """Save it with Ctrl+S: FreeCAD marks whatever links to it."""
        self.office.desk.documents.save(self.docs[name])
        for user in {"Plate": ("Sub", "Top"), "Sub": ("Top",)}.get(name, ()):
            if not self.docs[user].changed:
                self.docs[user].changed = self.docs[user].recomputed = True

    def commit(self, name: str) -> None:
        self.flow.start(self.docs[name])
        self.office.settle()

    def newest(self, name: str) -> bytes:
        return self.office.files(name)[-1]

    def theirs(self, name: str) -> bytes:
        """A colleague commits another state of a file."""
        content = self.content(name, "theirs")
        path = self.office.folder / "theirs.FCStd"
        path.write_bytes(content)
        stored = next(s for s in self.office.silo.items.values() if s.item.name == name)
        base = max(stored.files)
        self.office.silo.user = "alice"
        self.office.silo.upload_file(
            stored.item.part_number, path, file_name=f"{name}.FCStd", origin=Origin(base_revision=base)
        )
        self.office.silo.user = "designer"
        return content

    def titles(self) -> list[str]:
        return [entry.title for entry in self.office.session.shown.activity.entries]


@pytest.fixture(name="week")
def _week(office: Office) -> Week:
    opened = Opened(lambda: office.session.outbox)
    opened.begin(lambda call: call())
    office.desk.documents = Watched(opened)
    flow = CommitFlow(office.session, office.preferences, office.desk, path=office.folder / "same.json")
    made = Week(office, flow)
    for name in ("Plate", "Sub", "Skeleton", "Top"):
        doc = made.docs[name] = office.document(name, registered=name != "Skeleton")
        made.ids[name] = doc.identity
    for name, doc in made.docs.items():
        doc.content = made.content(name, name)
        office.desk.documents.save(doc)
    made.docs["Top"].OutList = [made.docs["Sub"], made.docs["Skeleton"]]
    made.docs["Sub"].OutList = [made.docs["Plate"]]
    Project(str(made.root)).note({})
    made.commit("Top")
    assert not office.session.shown.waiting
    return made


def test_what_was_saved_goes_along_though_freecad_says_recomputed(week: Week) -> None:
    """Sub was edited and saved; then Plate was, which marked Sub again."""
    week.edit("Sub")
    week.save("Sub")
    week.edit("Plate")
    week.save("Plate")
    assert week.docs["Sub"].recomputed
    week.edit("Top")
    week.commit("Top")
    for name in ("Plate", "Sub", "Top"):
        assert week.newest(name) == (week.root / f"{name}.FCStd").read_bytes()


def test_a_saved_edit_below_a_colleagues_is_a_question_and_never_silence(week: Week) -> None:
    """It is held in the pane with its choices; a second commit asks nothing twice."""
    theirs = week.theirs("Plate")
    week.edit("Plate")
    week.save("Plate")
    week.edit("Top")
    for _ in range(2):
        week.commit("Top")
        (held,) = week.office.session.shown.waiting
        assert (held.state, held.newer["created_by"], held.label) == (State.HELD, "alice", "Plate.FCStd")
    assert week.newest("Plate") == theirs


def test_an_older_file_below_is_said(week: Week) -> None:
    """A colleague committed Plate; mine is the older one, without edits."""
    week.theirs("Plate")
    week.edit("Top")
    week.commit("Top")
    (box,) = [one for one in week.office.session.shown.activity.entries if "Not all files" in one.title]
    assert [line.text for line in box.lines] == [
        "Plate.FCStd: newer in Silo",
        "Top.FCStd: sent",
        "Sub.FCStd: the same",
        "Skeleton.FCStd: the same",
    ]


def test_each_file_below_has_its_line_and_the_look_comes_after_the_sending(week: Week) -> None:
    """Sent, or the same; also of a file that nothing has open."""
    week.edit("Plate")
    week.save("Plate")
    del week.docs["Skeleton"]
    week.edit("Top")
    week.commit("Top")
    box = week.office.session.shown.activity.entries[0]
    assert box.title == "4 files of it are in Silo as they are here: Top.FCStd"
    assert {line.text for line in box.lines} == {
        "Plate.FCStd: sent",
        "Sub.FCStd: the same",
        "Skeleton.FCStd: the same",
        "Top.FCStd: sent",
    }


def test_a_file_that_is_written_while_it_is_sent_is_no_success(week: Week) -> None:
    """What Silo has after the sending decides, not what was put into the queue."""
    week.edit("Plate")
    week.save("Plate")
    week.edit("Top")

    def written(name: str) -> None:
        if name == "upload_file" and len(week.office.files("Top")) == 2:  # now Plate is on its way
            week.office.silo.before = lambda _name: None
            (week.root / "Plate.FCStd").write_bytes(week.content("Plate", "a sync tool"))

    week.office.silo.before = written
    week.commit("Top")
    box = next(one for one in week.office.session.shown.activity.entries if "Not all files" in one.title)
    assert box.lines[0].text == "Plate.FCStd: edited since its commit"


def test_nobody_is_in_conflict_with_their_own_commit(week: Week) -> None:
    """A commit of Top sent Plate along; the next edit of Plate is an edit."""
    for _ in range(3):
        week.edit("Plate")
        week.save("Plate")
        week.commit("Top")
        week.edit("Plate")
        week.commit("Plate")
        assert not week.office.session.shown.waiting
        assert week.newest("Plate") == week.docs["Plate"].content
    assert len(week.office.files("Plate")) == 7


def test_a_discarded_commit_leaves_an_edit(week: Week) -> None:
    """The server was away; the file is edited, not "newer in Silo", and goes with the next commit."""
    before = record_of(week.docs["Plate"].FileName)

    def away(_name: str) -> None:
        raise UnreachableError("nobody answers")

    week.office.silo.before = away
    week.edit("Plate")
    week.commit("Plate")
    (entry,) = week.office.session.outbox.entries()
    assert record_of(week.docs["Plate"].FileName) == before
    week.office.session.discard(entry.id)
    week.office.settle()
    week.office.silo.before = lambda _name: None
    week.office.session.retry_all()
    week.office.settle()
    week.edit("Plate")
    week.commit("Plate")
    assert not week.office.session.outbox.entries()
    assert week.newest("Plate") == week.docs["Plate"].content


def test_a_skeleton_with_unsaved_edits_is_the_document_that_it_is(week: Week) -> None:
    """Nobody is advised to register it, below a top and alone."""
    for name in ("Top", "Skeleton"):
        week.edit("Skeleton")
        week.commit(name)
        (stored,) = week.office.silo.documents.values()
        assert stored.files[max(stored.files)] == week.docs["Skeleton"].content
    assert not [title for title in week.titles() if "not in Silo" in title]
    assert week.office.desk.registers == []


def test_a_bom_that_was_held_goes_once_the_part_is_back(week: Week) -> None:
    """With the next commit above it, although its file is in Silo already."""
    (week.root / "Plate.FCStd").rename(week.root / "away")
    week.edit("Sub")
    week.save("Sub")
    week.commit("Top")
    number = next(s for s in week.office.silo.items.values() if s.item.name == "Sub").item.part_number
    week.office.silo._stored(number).lines.clear()
    (week.root / "away").rename(week.root / "Plate.FCStd")
    week.commit("Top")
    assert [line.child_name for line in week.office.silo.get_bom(number)] == ["Plate"]


def test_what_silo_had_already_was_not_sent(week: Week) -> None:
    """The committed file itself too: FreeCAD marked it, or the user commits it once more."""

    def lines() -> dict[str, str]:
        activity = week.office.session.shown.activity.entries
        below = next(entry for entry in activity if entry.key.startswith("below:"))
        return dict(line.text.split(": ") for line in below.lines)  # type: ignore[misc]

    week.edit("Plate")
    week.save("Plate")
    week.commit("Top")
    same = dict.fromkeys(("Plate.FCStd", "Sub.FCStd", "Skeleton.FCStd", "Top.FCStd"), "the same")
    # Saving Top gives it nothing new: its bytes are those of its revision.
    assert lines() == same | {"Plate.FCStd": "sent"}
    week.commit("Top")
    assert lines() == same
