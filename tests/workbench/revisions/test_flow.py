# SPDX-License-Identifier: LGPL-2.1-or-later
"""A commit that is held because of a colleague's: open theirs, take theirs. Without FreeCAD and Qt."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from desk import Document, Documents, Office
from fcstd_writer import Doc as File
from fcstd_writer import part
from other_disk import other_disk

from silo.api.files import Origin
from silo.workbench.commit.flow import Choice, CommitFlow, Theirs, of_held
from silo.workbench.revisions.flow import RevisionFlow


@dataclass
class Cad:
    """FreeCAD's documents and files."""

    documents: Documents
    docs: list[Document]
    opened: list[Path] = field(default_factory=list)

    def find(self, path: str, /) -> Document | None:
        return next((doc for doc in self.docs if doc.FileName == path), None)

    def open(self, path: str, /) -> None:
        self.opened.append(Path(path))

    def close(self, doc: Any, /) -> None:
        self.docs.remove(doc)

    def save_copy(self, doc: Any, path: Path, /) -> None:
        path.write_bytes(doc.content)

    def open_paths(self) -> tuple[str, ...]:
        return tuple(doc.FileName for doc in self.docs)

    def is_open_elsewhere(self, _path: str, /) -> bool:
        return False


@dataclass
class Day:
    """A held commit of "Plate", whose revision 2 is a colleague's."""

    office: Office
    doc: Document
    cad: Cad
    flow: RevisionFlow

    @property
    def held(self) -> Any:
        return next(iter(self.office.session.shown.waiting), None)

    def choose(self, choice: Choice) -> None:
        entry_id = self.held.id
        self.flow.choose(
            self.doc.FileName,
            of_held(self.held),
            choice,
            taken=lambda: self.office.session.discard(entry_id, keep=True),
        )
        self.office.settle()

    def kept(self) -> list[bytes]:
        return sorted(p.read_bytes() for p in (self.office.folder / "data" / "kept-aside").rglob("*.FCStd"))

    def boxes(self) -> list[str]:
        return [entry.title for entry in self.office.session.shown.activity.entries]


@pytest.fixture(name="day")
def _day(office: Office, monkeypatch: pytest.MonkeyPatch) -> Day:
    monkeypatch.setenv("XDG_CACHE_HOME", str(office.folder / "cache"))
    commits = CommitFlow(office.session, office.preferences, office.desk, path=office.folder / "same.json")
    doc = office.document("Plate", b"one")
    commits.start(doc)
    office.settle()
    theirs = office.folder / "theirs" / "Plate.FCStd"
    theirs.parent.mkdir()
    theirs.write_bytes(b"theirs")
    office.silo.user = "alice"
    number = next(iter(office.silo.items.values())).item.part_number
    office.silo.upload_file(number, theirs, "less", origin=Origin(base_revision=1))
    office.silo.user = "designer"
    doc.content, doc.changed = b"mine", True
    commits.start(doc)
    office.settle()
    cad = Cad(office.desk.documents, [doc])
    return Day(office, doc, cad, RevisionFlow(office.session, cad))


def test_taking_theirs_ends_the_held_commit_and_keeps_mine(day: Day) -> None:
    """What is open, with its newest edits, and what was committed; nothing of mine reaches the server."""
    day.doc.content = b"mine, and edits since"
    day.choose(Choice.TAKE)
    assert Path(day.doc.FileName).read_bytes() == b"theirs"
    assert (day.cad.opened, day.cad.docs) == ([Path(day.doc.FileName)], [])
    assert day.kept() == [b"mine", b"mine, and edits since"]
    assert day.held is None
    assert day.office.files("Plate") == [b"one", b"theirs"]
    assert day.boxes()[0] == "Took alice's revision 2: Plate.FCStd"
    (where,) = day.office.session.shown.activity.entries[0].lines
    assert where.text.startswith("Yours is kept for 90 days at ")


def test_a_third_persons_file_is_kept_as_well(day: Day) -> None:
    """Saved over the shared file, and in Silo nowhere."""
    Path(day.doc.FileName).write_bytes(b"by a third person")
    day.choose(Choice.TAKE)
    assert Path(day.doc.FileName).read_bytes() == b"theirs"
    assert day.kept() == [b"by a third person", b"mine", b"mine"]
    (where,) = day.office.session.shown.activity.entries[0].lines
    assert where.text.count("kept-aside") == 2  # both copies that were made here are named


def test_a_file_that_is_not_open_is_kept(day: Day) -> None:
    """Closed meanwhile, and edited by another program."""
    day.cad.docs.clear()
    Path(day.doc.FileName).write_bytes(b"later")
    day.choose(Choice.TAKE)
    assert day.kept() == [b"later", b"mine"]
    assert day.held is None


def test_theirs_cannot_be_written(day: Day) -> None:
    """Nothing is closed, nothing is lost, and the commit still waits."""
    folder = Path(day.doc.FileName)
    folder.unlink()
    folder.mkdir()
    (folder / "in the way").touch()
    day.cad.documents.base(day.doc).stamp = None
    day.choose(Choice.TAKE)
    assert day.cad.docs == [day.doc]
    assert day.held.newer["revision_number"] == 2
    assert day.boxes()[0] == "Not fetched: Plate.FCStd"


def test_their_file_cannot_be_fetched(day: Day) -> None:
    """The server has lost it."""
    for stored in day.office.silo.items.values():
        stored.files.pop(2, None)
    day.choose(Choice.TAKE)
    assert Path(day.doc.FileName).read_bytes() == b"mine"
    assert day.held.newer["revision_number"] == 2
    assert (day.cad.opened, day.boxes()[0]) == ([], "Not fetched: Plate.FCStd")


def test_theirs_opens_beside_mine_and_the_question_stays(day: Day) -> None:
    """In a folder of its own."""
    day.choose(Choice.OPEN)
    (opened,) = day.cad.opened
    assert opened.read_bytes() == b"theirs"
    assert opened.parent != Path(day.doc.FileName).parent
    assert Path(day.doc.FileName).read_bytes() == b"mine"
    assert day.held.newer["revision_number"] == 2


def test_what_is_open_under_another_spelling_is_left_alone(day: Day, tmp_path: Path) -> None:
    """On a disk that ignores case: a link opened ``PLATE.fcstd``, the folder lists ``Plate.FCStd``."""
    number = next(iter(day.office.silo.items.values())).item.part_number
    with other_disk(tmp_path) as disk:
        (disk / "Plate.FCStd").write_bytes(b"open, with edits")
        day.doc.FileName = str(disk / "PLATE.fcstd")
        pulled: list[Any] = []
        day.flow.pull(number, None, disk, overwrite=True, done=pulled.append, failed=pulled.append)
        day.office.settle()
        assert (disk / "Plate.FCStd").read_bytes() == b"open, with edits"
    assert "open" in str(pulled[0])


def test_what_theirs_links_to_and_is_not_here_is_named(day: Day) -> None:
    """Only the file itself is taken; a part that they added is not in this folder yet."""
    links = File("Plate").link("New", "parts/New.FCStd", "Box").link("Old", "Old.FCStd", "Box")
    theirs = day.office.folder / "theirs" / "Plate.FCStd"
    theirs.write_bytes(links.bytes())
    part("Old").save(Path(day.doc.FileName).with_name("Old.FCStd"))
    day.office.silo.upload_file(day.held.part_number, theirs, "a new part")
    newest = day.office.silo.revisions(day.held.part_number)[0]
    day.flow.choose(day.doc.FileName, Theirs(day.doc.FileName, day.held.part_number, 3, "alice"), Choice.TAKE)
    day.office.settle()
    assert newest.revision_number == 3
    (line,) = day.office.session.shown.activity.entries[0].lines
    assert line.text.startswith("It links to New.FCStd, not in this folder: Open from Silo… fetches them.")


def test_theirs_is_not_taken_where_it_is_not_what_they_committed(day: Day) -> None:
    """Damaged in the server's store: mine stays, open and on the disk, and the commit still waits."""
    stored = next(iter(day.office.silo.items.values()))
    stored.files[2] = b"thei"
    day.choose(Choice.TAKE)
    assert Path(day.doc.FileName).read_bytes() == b"mine"
    assert (day.cad.docs, day.kept(), day.held is None) == ([day.doc], [], False)
    assert day.boxes()[0] == "Not fetched: Plate.FCStd"


def test_what_was_found_without_words_is_there_at_once(day: Day) -> None:
    """*Open from Silo* shows it before the server has answered; what words found is no such list."""
    found: list[list[str]] = []

    def search(words: str) -> None:
        day.flow.search(words, lambda items: found.append([item.name for item in items]), pytest.fail)
        day.office.settle()

    search("nothing is called so")
    assert day.flow.recent == []
    search("")
    assert [item.name for item in day.flow.recent] == found[-1] != []
    search("nothing is called so")
    assert [item.name for item in day.flow.recent] == found[1]
