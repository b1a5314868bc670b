# SPDX-License-Identifier: LGPL-2.1-or-later
"""Rules that a change of one character would break, and that no other test would miss."""

from __future__ import annotations

import ntpath
import posixpath
import zipfile
from pathlib import Path

import pytest
from fcstd_writer import Doc, part

from silo.api.address import canonical
from silo.bom.compare.merge import plan_merge
from silo.bom.entry import BomEntry, Extraction
from silo.bom.errors import DocumentError
from silo.bom.quantities import same_quantity
from silo.bom.snapshot import from_plain, to_plain
from silo.bom.walk.document import relative
from silo.fcstd import open_document, stamp
from silo.fcstd.container import CENTRAL, LOCAL
from silo.outbox.entry import Commit
from silo.outbox.store import Store


def test_quantities_differ_by_a_thousandth() -> None:
    """A length of cable of 1000 and 1001 mm is not the same; the last bits of a sum are."""
    assert not same_quantity(1000, 1001)
    assert not same_quantity(1.0, 1.0005)
    assert same_quantity(0.1 + 0.2, 0.3)


@pytest.mark.parametrize(("heard", "told"), [(None, True), (4, False), (4.001, True)])
def test_a_conflict_is_reported_until_the_server_heard_of_it(heard: float | None, told: bool) -> None:
    """``assembly_quantity`` None is "heard of no quantity", not "heard of this one"."""
    line = {"child_part_number": "A", "quantity": 7, "source": "manual", "assembly_told": True}
    plan = plan_merge([{"child_part_number": "A", "quantity": 4}], [{**line, "assembly_quantity": heard}])
    assert (plan.conflicts_to_report == ("A",)) == told


def test_a_path_on_another_drive_stays_whole() -> None:
    """There is no way from one drive to another."""
    assert relative(r"D:\v\a.FCStd", r"C:\v", ntpath) == "D:/v/a.FCStd"
    assert relative(r"C:\v\s\a.FCStd", r"C:\v", ntpath) == "s/a.FCStd"
    assert relative("/w/a.FCStd", "/v", posixpath) == "../w/a.FCStd"


def test_a_snapshot_keeps_every_level() -> None:
    """Children of children come back."""
    leaf = BomEntry(doc_path="/c", object_name="C", quantity=3, level=3)
    middle = BomEntry(doc_path="/b", object_name="B", children=(leaf,), is_assembly=True, level=2)
    outer = BomEntry(doc_path="/a", object_name="A", children=(middle,), is_assembly=True)
    top = BomEntry(doc_path="/t", object_name="T", level=0)
    assert from_plain(to_plain(Extraction(top, (outer,)))) == Extraction(top, (outer,))


# -- containers ------------------------------------------------------------------------------------


def flagged(path: Path, flag: int) -> None:
    """Set a general purpose flag of Document.xml, in its local header and in the directory."""
    raw = bytearray(path.read_bytes())
    for mark, layout, field in ((b"PK\3\4", LOCAL, 2), (b"PK\1\2", CENTRAL, 3)):
        at = raw.index(mark)
        fields = list(layout.unpack_from(raw, at))
        fields[field] |= flag
        layout.pack_into(raw, at, *fields)
    path.write_bytes(raw)


@pytest.mark.parametrize("flag", [0x1, 0x40, 0x2000])
def test_each_kind_of_encryption_is_refused(tmp_path: Path, flag: int) -> None:
    """APPNOTE 4.4.4: bits 0, 6 and 13."""
    path = part().save(tmp_path / "a.FCStd")
    flagged(path, flag)
    with pytest.raises(DocumentError, match="encrypted"):
        open_document(path)


def test_a_stamped_entry_has_no_data_descriptor_any_more(tmp_path: Path) -> None:
    """Its sizes are in the header; the flag would announce bytes that are not there."""
    path = part().save(tmp_path / "a.FCStd")
    flagged(path, 0x8)
    assert stamp(path, "u-1")
    raw = path.read_bytes()
    assert not LOCAL.unpack_from(raw, raw.index(b"PK\3\4"))[2] & 0x8
    assert not CENTRAL.unpack_from(raw, raw.index(b"PK\1\2"))[3] & 0x8


def test_an_entry_that_reaches_into_the_directory_is_damage(tmp_path: Path) -> None:
    """One byte beyond its place is too many; up to the last byte is right."""
    path = part().save(tmp_path / "a.FCStd")
    raw = bytearray(path.read_bytes())
    at = raw.index(b"PK\1\2")
    last = at
    while (more := raw.find(b"PK\1\2", last + 1)) >= 0:
        last = more
    fields = list(CENTRAL.unpack_from(raw, last))
    begin = fields[16] + LOCAL.size + sum(LOCAL.unpack_from(raw, fields[16])[9:11])
    fields[8] = at - begin + 1
    CENTRAL.pack_into(raw, last, *fields)
    path.write_bytes(raw)
    with pytest.raises(DocumentError, match="outside its place"):
        stamp(path, "u-1")


def test_meta_is_written_in_the_order_of_its_bytes(tmp_path: Path) -> None:
    """As FreeCAD's own map is, so that a save there changes nothing."""
    path = (
        Doc(meta={"b": "1", "Z": "2", "é": "3", "a": "4"}).add("Part::Box", "Box").save(tmp_path / "a.FCStd")
    )
    assert stamp(path, "u-1")
    with zipfile.ZipFile(path) as archive:
        text = archive.read("Document.xml").decode()
    places = [text.index(f'key="{key}"') for key in ("SiloUUID", "Z", "a", "b", "é")]
    assert places == sorted(places)


def test_what_was_seen_of_the_old_server_is_forgotten_on_a_move(tmp_path: Path) -> None:
    """Revision 7 there says nothing of revision 7 here; and part numbers compare in any case."""
    path = tmp_path / "a.FCStd"
    path.write_bytes(b"x")
    store = Store(tmp_path / "outbox.sqlite3")
    entry = store.add(Commit(str(path), 0.0, part_number="M01-0001", file=path), "http://old")
    store.update(entry.id, base_revision=7)
    store.retry(entry.id, "HTTP://OLD:80/")
    assert store.entries()[0].base_revision == 7
    store.retry(entry.id, "http://new")
    moved = store.entries()[0]
    assert (moved.base_revision, moved.server, moved.item) == (None, canonical("http://new"), "m01-0001")
