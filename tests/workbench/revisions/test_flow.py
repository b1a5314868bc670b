# SPDX-License-Identifier: LGPL-2.1-or-later
"""A commit that is held because of a colleague's: open theirs, take theirs. Without FreeCAD and Qt."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from desk import Cad, Document, Office
from fcstd_writer import Doc as File
from fcstd_writer import part
from model_scenes import body, geometry
from other_disk import other_disk

from silo.api.files import Origin
from silo.api.wire import Occurrence, Scene, SceneGeometry
from silo.inertia.geometry.together import mesh_volume
from silo.workbench.colleagues.theirs import Choice, Theirs, of_held
from silo.workbench.commit.flow import CommitFlow
from silo.workbench.revisions.flow import RevisionFlow


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


def test_another_revision_is_shown_as_a_ghost_and_removed_again(day: Day) -> None:
    """Each body once where it stands there, in m; what cannot be shown is a sentence."""
    number = day.held.part_number
    places = [np.eye(4), np.diag([1.0, -1, 1, 1]), np.eye(4)]
    places[0][:3, 3] = places[2][:3, 3] = 0.5, 0, 1
    rows = [("A.1", 0, "Plate"), ("A.2", 0, "Plate"), ("B", 0, "Gone"), ("C", None, "Plate")]
    occurrences = [
        Occurrence(
            path=path.split("."), lines=[], geometry=geometry, key=key, matrix=place.T.ravel().tolist()
        )
        for (path, geometry, key), place in zip(rows, [*places, np.eye(4)], strict=True)
    ]
    files = [SceneGeometry(id="sha", url="", bytes=1)]
    day.office.silo.scenes[number, 1] = Scene(
        part_number=number, revision=1, geometries=files, occurrences=occurrences
    )
    day.office.silo.scenes[number, 3] = Scene(part_number=number, revision=3)
    day.office.silo.geometries["sha"] = geometry({"Plate": (body("block", 0.2), (1, 0, 0, 1))})

    def compared(revision: int) -> str:
        answers: list[str] = []
        path = day.doc.FileName
        day.flow.compare(path, number, revision, answers.append, lambda error: answers.append(str(error)))
        day.office.settle()
        (answer,) = answers
        return answer

    assert compared(1) == (
        "Ghost: 2 only in revision 1, 1 elsewhere there. Only here: 2. "
        "Not compared: 3 in groups and arrays without links."
    )
    assert [ghost.path for ghost in day.cad.ghosts] == [("A", "1"), ("A", "2")]
    middles = [ghost.mesh.vertices.mean(axis=0) for ghost in day.cad.ghosts]
    np.testing.assert_allclose(middles, [[0.5, 0, 1], [0, 0, 0]], atol=1e-5)
    assert mesh_volume(day.cad.ghosts[1].mesh) == pytest.approx(0.2 * 0.14 * 0.08, rel=1e-3)
    assert compared(1) == "The ghost is removed."
    assert compared(3) == "Silo has no model of revision 3 yet."
    assert "no revision 9" in compared(9)
    day.cad.docs.clear()
    assert "it is not open any more" in compared(1)
