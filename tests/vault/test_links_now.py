# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a link leads to is asked of the server when it is pulled; and a pull proves what it gives."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest
from fcstd_writer import Doc, locals_, part

from silo.outbox.send import send_all
from silo.outbox.store import Store
from silo.project_folder import record_of
from silo.testing import FakeSilo
from silo.vault.project import commits, compare, find_project, keep, name_documents, read_project
from silo.vault.pull import Pulled, place, rules_of
from silo.vault.tree import fetched


@dataclass
class Desk:
    """A computer with a project of an assembly, a part and a skeleton."""

    root: Path
    silo: FakeSilo
    store: Store

    def write(self, name: str, *, item: str = "", text: str = "one") -> Path:
        path = self.root / f"{name}.FCStd"
        if name == "Top":
            doc = Doc("Top", meta={"SiloUUID": item}).link("P", "Plate.FCStd", "Box")
            doc.link("S", "Skeleton.FCStd", "Sheet")
            doc.add("App::Part", "Assembly", Type="Assembly", Label=text, Group=locals_("P"))
        elif name == "Skeleton":
            doc = Doc(label=text)
            doc.add("Spreadsheet::Sheet", "Sheet")
        else:
            doc = part("Plate", text, uuid=item or None)
        doc.save(path)
        return path

    def commit(self, *tops: Path) -> None:
        named = [str(top) for top in tops] or [str(self.root)]
        found = name_documents(read_project(named, find_project([str(self.root)])), self.silo)
        for file, one in commits(found, compare(found, self.silo, self.store), allow_missing=True):
            keep(found.project, self.store, file, one, self.silo.base_url)
        report = send_all(self.store, self.silo, force=True)
        assert [*report.held, *report.failed] == []

    def pull(self, number: str, into: Path) -> Pulled:
        with fetched(self.silo, number) as tree:
            return place(tree, into, rules_of(self.store, self.silo, is_open=lambda _path: False))


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    (tmp_path / "work").mkdir()
    made = Desk(tmp_path / "work", FakeSilo(), Store(tmp_path / "outbox.sqlite3"))
    made.write("Skeleton")
    made.write("Plate")
    return made


def item(desk: Desk, name: str, category: str = "M01", kind: str = "part") -> tuple[str, str]:
    made = desk.silo.create_item("kindred-rd", category, name, item_type=kind)
    return made.part_number, made.id


def test_a_part_that_is_registered_later_is_found_without_a_new_revision_of_its_parent(
    desk: Desk, tmp_path: Path
) -> None:
    """And taken out of its item again it is a document of its own, which is no revision of the item."""
    number, identity = item(desk, "Top", "A01", "assembly")
    desk.write("Top", item=identity)
    desk.commit()
    part_number, plate = item(desk, "Plate")
    desk.write("Plate", item=plate, text="registered")
    desk.commit(desk.root / "Plate.FCStd")
    edited = desk.write("Plate", item=plate, text="edited").read_bytes()
    desk.commit(desk.root / "Plate.FCStd")
    pulled = desk.pull(number, tmp_path / "back")
    assert pulled.complete, pulled.lost
    assert (tmp_path / "back" / "Plate.FCStd").read_bytes() == edited
    assert len(desk.silo.revisions(number)) == 1
    undone = desk.write("Plate", text="no number again").read_bytes()
    desk.commit(desk.root / "Plate.FCStd")
    assert len(desk.silo.revisions(part_number)) == 2
    pulled = desk.pull(number, tmp_path / "undone")
    assert pulled.complete, pulled.lost
    assert (tmp_path / "undone" / "Plate.FCStd").read_bytes() == undone


def test_a_skeleton_that_was_sent_after_its_assembly_is_found(desk: Desk, tmp_path: Path) -> None:
    """The assembly did not know then which document it would be."""
    number, identity = item(desk, "Top", "A01", "assembly")
    top = desk.write("Top", item=identity)
    belonging = read_project([str(top)], find_project([str(desk.root)]))
    alone = [file for file in belonging.files if file.item]
    for file in alone:
        desk.silo.upload_file(number, file.path)
    from silo.api.files import Origin
    from silo.api.wire import LinkedFile
    from silo.fcstd.linked import place_of

    told = place_of(top, str(top))
    links = [LinkedFile.model_validate(link) for link in told.as_dicts()]
    assert {link.document for link in links} == {""}
    desk.silo.upload_file(number, top, origin=Origin(file_path=told.path, links=links))
    desk.commit()
    pulled = desk.pull(number, tmp_path / "back")
    assert pulled.complete, pulled.lost
    for name in ("Top", "Plate", "Skeleton"):
        assert (tmp_path / "back" / f"{name}.FCStd").read_bytes() == (
            desk.root / f"{name}.FCStd"
        ).read_bytes()


def test_a_copy_made_outside_is_never_replaced_by_its_original(desk: Desk, tmp_path: Path) -> None:
    """Sent, it is a document of its own; left out, the pull says that it is not in Silo."""
    number, identity = item(desk, "Top", "A01", "assembly")
    _, plate = item(desk, "Plate")
    desk.write("Plate", item=plate)
    doc = Doc("Top", meta={"SiloUUID": identity}).link("P", "Plate.FCStd", "Box")
    doc.link("C", "PlateB.FCStd", "Box").add(
        "App::Part", "Assembly", Type="Assembly", Group=locals_("P", "C")
    )
    doc.save(desk.root / "Top.FCStd")
    desk.commit(desk.root / "Plate.FCStd")
    part("Plate", "another", uuid=plate).save(desk.root / "PlateB.FCStd")
    desk.commit()
    pulled = desk.pull(number, tmp_path / "back")
    assert pulled.complete, pulled.lost
    for name in ("Plate", "PlateB"):
        assert (tmp_path / "back" / f"{name}.FCStd").read_bytes() == (
            desk.root / f"{name}.FCStd"
        ).read_bytes()
    copy = record_of(str(desk.root / "PlateB.FCStd"))
    assert copy is not None
    del desk.silo.documents[copy.document]
    pulled = desk.pull(number, tmp_path / "lost")
    assert [lost.reason for lost in pulled.lost] == [
        "Top.FCStd was committed with another PlateB.FCStd, which is not in Silo"
    ]
    assert not pulled.complete
    assert not (tmp_path / "lost" / "PlateB.FCStd").exists()


def test_an_assembly_that_went_with_an_edit_that_did_not_go_is_said(desk: Desk, tmp_path: Path) -> None:
    """The part that is in Silo is given, and the pull does not call itself complete."""
    number, identity = item(desk, "Top", "A01", "assembly")
    desk.write("Top", item=identity)
    desk.commit()
    before = (desk.root / "Plate.FCStd").read_bytes()
    desk.write("Plate", text="edited")
    desk.write("Top", item=identity, text="edited too")
    found = name_documents(read_project([str(desk.root)], find_project([str(desk.root)])), desk.silo)
    for file, one in commits(found, compare(found, desk.silo, desk.store), allow_missing=True):
        if file.item:
            keep(found.project, desk.store, file, one, desk.silo.base_url)
    send_all(desk.store, desk.silo)
    pulled = desk.pull(number, tmp_path / "back")
    assert [lost.reason for lost in pulled.lost] == [
        "Top.FCStd was committed with another Plate.FCStd, which is not in Silo"
    ]
    assert (tmp_path / "back" / "Plate.FCStd").read_bytes() == before


def test_a_folder_that_takes_nothing_has_its_records_with_the_user(desk: Desk, tmp_path: Path) -> None:
    """A commit from it is possible, and known afterwards."""
    locked = tmp_path / "locked"
    shutil.copytree(desk.root, locked)
    (locked / ".silo-project.json").mkdir()  # as a folder that cannot be written
    found = find_project([str(locked)])
    belonging = name_documents(read_project([str(locked)], found), desk.silo)
    for file, one in commits(belonging, compare(belonging, desk.silo, desk.store)):
        keep(belonging.project, desk.store, file, one, desk.silo.base_url)
    assert not send_all(desk.store, desk.silo).held
    again = name_documents(read_project([str(locked)], found), desk.silo, new=False)
    assert {one.state.value for one in compare(again, desk.silo, desk.store)} == {"same"}
