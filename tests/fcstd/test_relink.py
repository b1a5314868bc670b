# SPDX-License-Identifier: LGPL-2.1-or-later
"""Mending links to a file that has moved: only the recorded path changes, or nothing at all."""

from __future__ import annotations

import os
import zipfile
from pathlib import Path

import pytest
from fcstd_writer import Doc, Raw, locals_

from silo.bom.errors import DocumentError, InputError
from silo.bom.walk.links import extract
from silo.fcstd import open_document
from silo.fcstd.relink import Relinked, read_back, relink


@pytest.fixture
def top(tmp_path: Path) -> Path:
    """Three links to a file that lies in another folder than they record, and one to another file."""
    for name in ("new/part", "other"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        Doc().add("Part::Box", "Box").add("Part::Box", "Rod").save(tmp_path / f"{name}.FCStd")
    doc = Doc().link("L1", "old/part.FCStd", "Box").link("L2", "./old/part.FCStd", "Rod")
    doc.link("L3", "other.FCStd", "Box")
    subs = '<XLinkSub file="old/part.FCStd" stamp="" name="Box" sub="Face1"/>'
    doc.add("Part::Feature", "Ref", Support=Raw("App::PropertyXLinkSub", subs))
    doc.add("App::Part", "A", Group=locals_("L1", "L2", "L3"))
    return doc.save(tmp_path / "top.FCStd")


def test_links_lead_to_the_new_file(top: Path, tmp_path: Path) -> None:
    """All that record the old one, however it is spelt; the others stay."""
    (done,) = relink([top], tmp_path / "old/part.FCStd", tmp_path / "new/part.FCStd")
    assert (done.path, done.links, done.objects) == (str(top), 3, ("Box", "Rod"))
    found = extract(open_document(top).getObject("A"))
    assert [(os.path.relpath(e.doc_path, tmp_path), e.object_name, e.missing) for e in found.entries] == [
        ("new/part.FCStd", "Box", False),
        ("new/part.FCStd", "Rod", False),
        ("other.FCStd", "Box", False),
    ]


def test_nothing_but_the_paths_changes(top: Path, tmp_path: Path) -> None:
    """Every other entry keeps its bytes, every other byte of Document.xml stays."""
    with zipfile.ZipFile(top) as file:
        before = {info.filename: file.read(info) for info in file.infolist()}
    relink([top], tmp_path / "old/part.FCStd", tmp_path / "new/part.FCStd")
    with zipfile.ZipFile(top) as file:
        after = {info.filename: file.read(info) for info in file.infolist()}
    text = after.pop("Document.xml")
    xml = before.pop("Document.xml").replace(b'"./old/part.FCStd"', b'"new/part.FCStd"')
    assert text == xml.replace(b'"old/part.FCStd"', b'"new/part.FCStd"')
    assert after == before


def test_a_dry_run_writes_nothing(top: Path, tmp_path: Path) -> None:
    """It says what would change."""
    before = top.read_bytes()
    (one,) = relink([top], tmp_path / "old/part.FCStd", tmp_path / "new/part.FCStd", dry_run=True)
    assert one.links == 3
    assert top.read_bytes() == before


def test_a_file_that_lacks_an_object_is_refused(top: Path, tmp_path: Path) -> None:
    """A link to nothing is no better than one to a missing file."""
    Doc().add("Part::Box", "Box").save(tmp_path / "half.FCStd")
    before = top.read_bytes()
    with pytest.raises(InputError, match=r"half\.FCStd does not hold what the links .* want: Rod"):
        relink([top], tmp_path / "old/part.FCStd", tmp_path / "half.FCStd")
    assert top.read_bytes() == before


def test_one_file_that_cannot_be_written_keeps_all_as_they_are(top: Path, tmp_path: Path) -> None:
    """Checked before the first is written."""
    second = tmp_path / "second.FCStd"
    second.write_bytes(top.read_bytes())
    second.chmod(0o444)
    before = top.read_bytes()
    with pytest.raises(DocumentError, match="read-only"):
        relink([top, second], tmp_path / "old/part.FCStd", tmp_path / "new/part.FCStd")
    assert top.read_bytes() == before


def test_a_name_with_everything_in_it(top: Path, tmp_path: Path) -> None:
    """Quotes, ampersands and umlauts are escaped as XML wants it."""
    odd = tmp_path / "new" / "Größe <M8> & \"Co\" 'x'.FCStd"
    (tmp_path / "new/part.FCStd").rename(odd)
    relink([top], tmp_path / "old/part.FCStd", odd)
    found = extract(open_document(top).getObject("A"))
    assert found.entries[0].doc_path == str(odd)
    relink([top], odd, tmp_path / "other.FCStd")
    assert {e.doc_path for e in extract(open_document(top).getObject("A")).entries} == {
        str(tmp_path / "other.FCStd")
    }


def test_a_file_does_not_link_to_itself(top: Path, tmp_path: Path) -> None:
    """FreeCAD has no such link."""
    Doc().link("Box", "old/part.FCStd", "Box").save(tmp_path / "loop.FCStd")
    with pytest.raises(InputError, match="link to itself"):
        relink([tmp_path / "loop.FCStd"], tmp_path / "old/part.FCStd", tmp_path / "loop.FCStd")


def test_files_without_such_links_are_not_touched(top: Path, tmp_path: Path) -> None:
    """They are not named either."""
    assert relink([tmp_path / "other.FCStd"], tmp_path / "old/part.FCStd", tmp_path / "new/part.FCStd") == []


@pytest.mark.parametrize(("left", "before"), [(1, 0), (0, 1)])
def test_a_copy_that_does_not_hold_the_links_is_never_written(tmp_path: Path, left: int, before: int) -> None:
    """Links that still lead to the old file, or fewer new ones than were asked for."""
    old, new = str(tmp_path / "old.FCStd"), str(tmp_path / "new.FCStd")
    doc = Doc()
    for number in range(2):
        doc.link(f"L{number}", "old.FCStd" if number < left else "new.FCStd", "Box")
    copy = str(doc.save(tmp_path / "copy.FCStd"))
    mended = Relinked(str(tmp_path / "top.FCStd"), 2, ("Box",))
    with pytest.raises(DocumentError, match="nothing was written"):
        read_back(mended, copy, old, new, before)
    if not left:
        read_back(mended, copy, old, new, 0)


def test_a_file_that_may_not_be_written_now_keeps_all_as_they_are(top: Path, tmp_path: Path) -> None:
    """As one that FreeCAD has open; a dry run may look at it."""
    before = top.read_bytes()

    def refuse(path: str) -> None:
        raise DocumentError(path, "is open")

    order = ([top], tmp_path / "old/part.FCStd", tmp_path / "new/part.FCStd")
    with pytest.raises(DocumentError, match="is open"):
        relink(*order, check=refuse)
    assert top.read_bytes() == before
    assert relink(*order, dry_run=True, check=refuse)


def test_an_import_of_a2plus_leads_to_the_new_file(tmp_path: Path) -> None:
    """Its file is a text of a property; other texts stay."""
    (tmp_path / "new").mkdir()
    Doc().add("Part::Box", "Box").save(tmp_path / "new/part.FCStd")
    doc = Doc()
    for name, file in (("A", "./part.FCStd"), ("B", ".\\part.FCStd"), ("C", "./other.FCStd")):
        doc.add("Part::FeaturePython", name, sourceFile=file, a2p_Version="V0.4", note="./part.FCStd")
    top = doc.save(tmp_path / "top.FCStd")
    (done,) = relink([top], tmp_path / "part.FCStd", tmp_path / "new/part.FCStd")
    assert done.links == 2
    read = {obj.Name: (obj.sourceFile, obj.note) for obj in open_document(top).Objects}
    assert read == {
        "A": ("new/part.FCStd", "./part.FCStd"),
        "B": ("new/part.FCStd", "./part.FCStd"),
        "C": ("./other.FCStd", "./part.FCStd"),
    }
