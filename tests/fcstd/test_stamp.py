# SPDX-License-Identifier: LGPL-2.1-or-later
"""Stamping: the identity is there, everything else is byte for byte what it was."""

from __future__ import annotations

import io
import os
import stat
import zipfile
from pathlib import Path

import pytest
from fcstd_writer import COMMENT, Doc, container, part, save_xml
from hypothesis import given
from hypothesis import strategies as st
from other_disk import other_disk

from silo.bom.errors import DocumentError
from silo.bom.walk.identity import document_identity, identity_of
from silo.fcstd import check_stampable, open_document, stamp, unstamp
from silo.fcstd.container import ContainerFile, FileStat
from silo.fcstd.edit import replace_file
from silo.fcstd.limits import Limits
from silo.fcstd.repack import replaced_entry
from silo.fcstd.stamp import _read_back
from silo.platform.whole_files import sync_folder


def with_entries(folder: Path) -> Path:
    """A file with side entries of all kinds, Document.xml in the middle."""
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w") as file:
        file.writestr(
            zipfile.ZipInfo("first.brp", (2020, 1, 2, 3, 4, 6)), b"shape " * 500, zipfile.ZIP_DEFLATED
        )
        info = zipfile.ZipInfo("Document.xml", (2021, 2, 3, 4, 5, 8))
        info.external_attr, info.extra = 0o644 << 16, b"\x55\x54\x01\x00\x00"
        file.writestr(info, part().xml(), zipfile.ZIP_DEFLATED)
        file.writestr(
            zipfile.ZipInfo("stored.png", (2022, 3, 4, 5, 6, 10)), os.urandom(300), zipfile.ZIP_STORED
        )
        file.writestr("empty", b"")
        file.comment = COMMENT
    path = folder / "part.FCStd"
    path.write_bytes(target.getvalue())
    return path


def test_the_identity_is_read_back(tmp_path: Path) -> None:
    """Stamped, then read as the identity of what the file holds."""
    path = part().save(tmp_path / "part.FCStd")
    assert stamp(path, "u-1") is True
    document = open_document(path)
    assert document.Meta == {"SiloUUID": "u-1"}
    assert identity_of(document.getObject("Box")) == "u-1"


def test_one_object_of_several(tmp_path: Path) -> None:
    """One file may give several parts; each has its own key beside the document's."""
    path = part().add("Part::Box", "Other").save(tmp_path / "part.FCStd")
    assert stamp(path, "u-1")
    assert stamp(path, "u-2", object_name="Other")
    document = open_document(path)
    assert document.Meta == {"SiloUUID": "u-1", "SiloUUID/Other": "u-2"}
    assert [identity_of(obj) for obj in document.Objects] == ["u-1", "u-2"]


def test_an_identity_that_is_taken_back_leaves_no_trace_on_the_object(tmp_path: Path) -> None:
    """FreeCAD reads as many properties as are counted: a wrong count takes those of the next object."""
    path = part().add("Part::Box", "Other").save(tmp_path / "part.FCStd")
    before = objects_in(path)
    assert stamp(path, "u-1", object_name="Box", item_object="Box")
    assert objects_in(path) != before
    assert unstamp(path, "Box")
    assert objects_in(path) == before
    assert open_document(path).Meta == {}
    assert unstamp(path, "Box") is False


def objects_in(path: Path) -> list[bytes]:
    """The data of the objects, without the space between elements."""
    with zipfile.ZipFile(path) as archive:
        return archive.read("Document.xml").partition(b"<ObjectData")[2].split()


def test_nothing_else_changes(tmp_path: Path) -> None:
    """Packed bytes, order, times, attributes, extra fields and the comment of all other entries stay."""
    path = with_entries(tmp_path)
    before = path.read_bytes()
    assert stamp(path, "u-1")
    after = path.read_bytes()
    with zipfile.ZipFile(io.BytesIO(before)) as old, zipfile.ZipFile(io.BytesIO(after)) as new:
        assert new.testzip() is None
        assert new.comment == COMMENT
        assert new.namelist() == old.namelist()
        for was, now in zip(old.infolist(), new.infolist(), strict=True):
            assert (now.date_time, now.external_attr, now.extra) == (
                was.date_time,
                was.external_attr,
                was.extra,
            )
            if now.filename != "Document.xml":
                assert _entry(after, now) == _entry(before, was)


def _entry(raw: bytes, info: zipfile.ZipInfo) -> bytes:
    """Header and packed bytes."""
    return raw[info.header_offset : info.header_offset + 30 + len(info.filename) + info.compress_size]


def test_the_text_changes_by_the_item_only(tmp_path: Path) -> None:
    """Every other line of Document.xml stays."""
    path = with_entries(tmp_path)
    before = zipfile.ZipFile(path).read("Document.xml").decode().splitlines()
    stamp(path, "u-1")
    after = zipfile.ZipFile(path).read("Document.xml").decode().splitlines()
    assert [line for line in after if line not in before] == [
        '            <Map count="1">',
        '                <Item key="SiloUUID" value="u-1"/>',
        "            </Map>",
    ]


def test_the_same_identity_again_writes_nothing(tmp_path: Path) -> None:
    """Idempotent, to the byte and the time."""
    path = with_entries(tmp_path)
    stamp(path, "u-1")
    before = (path.read_bytes(), path.stat().st_mtime_ns, path.stat().st_ino)
    assert stamp(path, "U-1") is False
    assert (path.read_bytes(), path.stat().st_mtime_ns, path.stat().st_ino) == before


def refused(path: Path, identity: str = "u-2", **options: object) -> str:
    """Why a file is not stamped; it must then be as it was, with nothing beside it."""
    before = path.read_bytes(), sorted(os.listdir(path.parent))
    with pytest.raises(DocumentError) as caught:
        stamp(path, identity, **options)  # type: ignore[arg-type]
    assert (path.read_bytes(), sorted(os.listdir(path.parent))) == before
    return caught.value.reason


def test_another_identity_is_not_overwritten(tmp_path: Path) -> None:
    """A file that is a part already stays that part, unless somebody insists."""
    path = part(uuid="u-1").save(tmp_path / "part.FCStd")
    assert "another identity already (SiloUUID): u-1" in refused(path)
    assert stamp(path, "u-2", replace=True)
    assert open_document(path).Meta == {"SiloUUID": "u-2"}


def test_a_property_that_would_go_first_is_an_identity_too(tmp_path: Path) -> None:
    """Meta beside a contrary property would have no effect, so it is not written."""
    path = (
        Doc(extra={"SiloUUID": "u-1"}).add("Part::Box", "Box", SiloItemId="u-3").save(tmp_path / "part.FCStd")
    )
    assert "SiloUUID is another identity already: u-1" in refused(path)
    assert "SiloItemId is another identity already: u-3" in refused(path, object_name="Box")
    assert stamp(path, "u-1")
    assert stamp(path, "u-3", object_name="Box")


def test_replacing_reaches_every_place_of_an_identity(tmp_path: Path) -> None:
    """A part that FreeCAD registered carries its identity in properties too, which go before Meta."""
    doc = Doc(extra={"SiloUUID": "u-1"}).add("Part::Box", "Box", SiloItemId="u-1", SiloUUID="u-1")
    path = doc.add("Part::Box", "Other", SiloItemId="u-9").save(tmp_path / "part.FCStd")
    check_stampable(path, item_object="Box", replace=True)
    assert stamp(path, "u-2", item_object="Box", replace=True)
    document = open_document(path)
    names = ("Box", "Other")
    assert (document_identity(document), *(identity_of(document.getObject(name)) for name in names)) == (
        *("u-2", "u-2"),
        "u-9",
    )
    assert stamp(path, "u-2", item_object="Box", replace=True) is False


def test_an_object_that_is_not_there(tmp_path: Path) -> None:
    """No identity for what the file does not hold."""
    assert "no object named 'Gone'" in refused(part().save(tmp_path / "p.FCStd"), object_name="Gone")


@pytest.mark.parametrize("identity", ["", "  ", " u", "a\nb", "a\0", "x" * 201, "\ufffe", "\x85"])
def test_what_is_no_identity(tmp_path: Path, identity: str) -> None:
    """One line of text, as long as an identity may be."""
    assert "is not an identity" in refused(part().save(tmp_path / "p.FCStd"), identity)


def test_read_only_files_stay(tmp_path: Path) -> None:
    """A file that its owner protected is not replaced, though the folder would allow it."""
    path = part().save(tmp_path / "p.FCStd")
    path.chmod(0o444)
    assert refused(path) == "it is read-only; nothing was written"


@pytest.mark.usefixtures("needs_modes", "needs_user_without_rights")
def test_read_only_folders_stay(tmp_path: Path) -> None:
    """No rights in the folder: a plain sentence."""
    path = part().save(tmp_path / "in" / "p.FCStd")
    path.parent.chmod(0o555)
    try:
        assert "folder is read-only" in refused(path)
    finally:
        path.parent.chmod(0o755)


def write(path: Path, state: FileStat, content: bytes) -> None:
    real = str(path)
    replace_file(real, state, [content], lambda copy: _read_back(real, copy, "SiloUUID", "u-1"))


def test_a_file_that_changed_meanwhile_is_left_alone(tmp_path: Path) -> None:
    """Whoever saved between our reading and our writing wins."""
    path = part().save(tmp_path / "p.FCStd")
    state = FileStat.of(path.stat())
    content = part(uuid="u-1").bytes()
    other = part("saved by FreeCAD").bytes()
    path.write_bytes(other)
    with pytest.raises(DocumentError, match="changed by somebody else"):
        write(path, state, content)
    assert path.read_bytes() == other
    assert os.listdir(tmp_path) == ["p.FCStd"]


def test_a_copy_without_the_identity_is_thrown_away(tmp_path: Path) -> None:
    """The new file is read before it takes the place of the old one."""
    path = part().save(tmp_path / "p.FCStd")
    state = FileStat.of(path.stat())
    for content, words in ((part().bytes(), "does not hold"), (part().bytes()[:-9], "cannot be read")):
        with pytest.raises(DocumentError, match=words):
            write(path, state, content)
    assert path.read_bytes() == part().bytes()
    assert os.listdir(tmp_path) == ["p.FCStd"]


@pytest.mark.usefixtures("needs_limits")
def test_a_full_disk_leaves_the_file(tmp_path: Path) -> None:
    """An error of the system while writing leaves no half file and no rest."""
    import resource

    path = part().save(tmp_path / "p.FCStd")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, hard))
    try:
        found = refused(path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert found == "it cannot be written: the file is larger than the disk allows"


@pytest.mark.usefixtures("needs_modes", "needs_symlinks")
def test_rights_and_links_stay(tmp_path: Path) -> None:
    """Mode bits are kept; a symlink stays a symlink and its file is stamped."""
    path = part().save(tmp_path / "store" / "p.FCStd")
    path.chmod(0o640)
    link = tmp_path / "p.FCStd"
    link.symlink_to("store/p.FCStd")
    assert stamp(link, "u-1")
    assert link.is_symlink()
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    assert open_document(path).Meta == {"SiloUUID": "u-1"}


META = '<Property name="Meta" type="App::PropertyMap" status="1">\n<Map count="0">\n</Map>\n</Property>'


@pytest.mark.parametrize(
    "meta",
    [
        META,
        META.replace('<Map count="0">\n</Map>', '<Map count="0"/>'),
        META.replace('"', "'"),
        '<Property type="App::PropertyMap" name="Meta"/>',
        f"<!-- {META.replace('Meta', 'Other')} -->{META}",
        META.replace('status="1"', 'doc="a > b"'),
    ],
)
def test_meta_in_other_forms(tmp_path: Path, meta: str) -> None:
    """However a writer lays it out, the map is found and filled."""
    xml = part().xml()
    start = xml.index('        <Property name="Meta"')
    end = xml.index("</Property>", start) + len("</Property>")
    path = save_xml(tmp_path / "p.FCStd", xml[:start] + meta + xml[end:])
    assert stamp(path, "u-1")
    document = open_document(path)
    assert document.Meta == {"SiloUUID": "u-1"}
    assert [o.Name for o in document.Objects] == ["Box"]


def test_without_meta_one_is_added(tmp_path: Path) -> None:
    """A document without the map gets one, and counts it."""
    path = Doc(meta=None).add("Part::Box", "Box").save(tmp_path / "p.FCStd")
    before = open_document(path).PropertiesList
    assert stamp(path, "u-1")
    document = open_document(path)
    assert document.PropertiesList == (*before, "Meta")
    assert not document.properties._careful
    assert document.Meta == {"SiloUUID": "u-1"}


def test_without_any_property_one_is_added(tmp_path: Path) -> None:
    """An empty list of properties is opened for it."""
    xml = '<?xml version="1.0" encoding="utf-8"?><Document SchemaVersion="4"><Properties Count="0"/>'
    xml += '<Objects Count="0"/><ObjectData Count="0"/></Document>'
    path = save_xml(tmp_path / "p.FCStd", xml)
    assert stamp(path, "u-1")
    assert open_document(path).Meta == {"SiloUUID": "u-1"}


def test_without_a_place_for_it_it_is_refused(tmp_path: Path) -> None:
    """A document without properties has no room for an identity."""
    path = save_xml(tmp_path / "p.FCStd", "<Document><Objects/><ObjectData/></Document>")
    assert "no document properties" in refused(path)


def test_other_encodings_are_refused(tmp_path: Path) -> None:
    """Only UTF-8 is edited in place."""
    xml = part().xml().replace("utf-8", "iso-8859-1")
    assert "not in UTF-8" in refused(save_xml(tmp_path / "p.FCStd", xml.encode("latin-1")))


def test_files_that_cannot_be_read_cannot_be_stamped(tmp_path: Path) -> None:
    """A damaged file is not made worse."""
    path = tmp_path / "p.FCStd"
    path.write_bytes(part().bytes()[:-5])
    assert "cut short" in refused(path)


def test_entries_with_data_descriptors(tmp_path: Path) -> None:
    """Containers written as a stream have lengths behind the data; those of the other entries stay there."""

    class Stream(io.RawIOBase):
        def __init__(self) -> None:
            self.data = bytearray()

        def writable(self) -> bool:
            return True

        def write(self, chunk) -> int:  # type: ignore[no-untyped-def]
            self.data += chunk
            return len(chunk)

    stream = Stream()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as file:  # type: ignore[call-overload]
        for name, content in (("Document.xml", part().xml()), ("a.brp", "shape" * 99), ("b.brp", "")):
            with file.open(zipfile.ZipInfo(name), "w") as entry:
                entry.write(content.encode())
    path = tmp_path / "p.FCStd"
    path.write_bytes(bytes(stream.data))
    assert stamp(path, "u-1")
    assert open_document(path).Meta == {"SiloUUID": "u-1"}
    with zipfile.ZipFile(path) as file:
        assert file.testzip() is None
        assert file.read("a.brp") == b"shape" * 99


def test_overlapping_entries_are_refused(tmp_path: Path) -> None:
    """A second entry that begins within Document.xml would be torn by a longer one."""
    raw = bytearray(container({"Document.xml": part().xml().encode(), "other": b"x"}))
    at = raw.rindex(b"PK\x01\x02") + 42
    raw[at : at + 4] = (40).to_bytes(4, "little")
    path = tmp_path / "p.FCStd"
    path.write_bytes(raw)
    assert "overlap" in refused(path)


TEXT = st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs", "Cn")), max_size=9)


@given(st.dictionaries(TEXT, TEXT, max_size=4))
def test_what_was_in_meta_stays(tmp_path_factory: pytest.TempPathFactory, meta: dict[str, str]) -> None:
    """Whatever people keep in Meta, in any characters, survives."""
    path = Doc(meta=meta).add("Part::Box", "Box").save(tmp_path_factory.mktemp("meta") / "p.FCStd")
    stamp(path, "u-1", replace=True)
    assert open_document(path).Meta == {**meta, "SiloUUID": "u-1"}


def test_what_cannot_be_stamped_is_known_before(tmp_path: Path) -> None:
    """The check refuses what the stamp would refuse, and changes nothing."""
    path = tmp_path / "a.FCStd"
    Doc().add("Part::Feature", "Box").save(path)
    content = path.read_bytes()
    check_stampable(path)
    check_stampable(path, object_name="Box")
    with pytest.raises(DocumentError, match="no object named"):
        check_stampable(path, object_name="Sphere")
    assert path.read_bytes() == content
    path.chmod(0o444)
    with pytest.raises(DocumentError, match="read-only"):
        check_stampable(path)
    path.chmod(0o644)
    stamp(path, "u-1")
    with pytest.raises(DocumentError, match="another identity"):
        check_stampable(path)


LINUX = pytest.mark.skipif(not os.path.exists("/proc/self"), reason="needs /proc")


def test_a_disk_without_extended_attributes_is_no_failure(tmp_path: Path) -> None:
    """As FUSE and some shares are: what can be kept is kept, and the file is written."""
    with other_disk(tmp_path) as disk:
        path = part().save(disk / "a.FCStd")
        assert stamp(path, "u-1")
        assert open_document(path).Meta == {"SiloUUID": "u-1"}


def test_a_file_is_stamped_under_any_of_its_spellings(tmp_path: Path) -> None:
    """Where each spelling has a number of its own, the file seemed to be changed by somebody else."""
    with other_disk(tmp_path, "each-spelling") as disk:
        part().save(disk / "Part.FCStd")
        assert stamp(disk / "part.fcstd", "u-1")
        assert open_document(disk / "Part.FCStd").Meta == {"SiloUUID": "u-1"}
        assert os.listdir(disk) == ["Part.FCStd"]


@LINUX
def test_a_folder_that_cannot_be_synced_is_no_failure() -> None:
    """/proc says EINVAL, as some shares do: the file was written anyway."""
    sync_folder("/proc/self")
    with pytest.raises(OSError, match="No such file"):
        sync_folder("/proc/self/nothing")


def test_a_file_with_several_names_is_not_torn_apart(tmp_path: Path) -> None:
    """Replacing one name would leave the old content under the others."""
    path, other = tmp_path / "a.FCStd", tmp_path / "b.FCStd"
    part().save(path)
    other.hardlink_to(path)
    before = path.read_bytes()
    for refused in (lambda: check_stampable(path), lambda: stamp(path, "u-1")):
        with pytest.raises(DocumentError, match=r"2 names.*hard links"):
            refused()
    assert (path.read_bytes(), path.samefile(other)) == (before, True)
    other.unlink()
    assert stamp(path, "u-1")


def test_a_big_file_is_not_held_in_memory(tmp_path: Path) -> None:
    """Only Document.xml is; the rest goes from file to file."""
    path = tmp_path / "big.FCStd"
    doc = part()
    doc.entries["shape.brp"] = os.urandom(3_000_000)
    doc.save(path)
    with ContainerFile(str(path), Limits()) as container:
        entry = container.entry(b"Document.xml")
        assert entry is not None
        pieces = replaced_entry(container, entry, b"<Document/>")
    assert sum(len(piece) for piece in pieces if isinstance(piece, bytes)) < 100_000
    assert stamp(path, "u-1")
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        assert archive.read("shape.brp") == doc.entries["shape.brp"]


def test_the_object_names_its_item_too(tmp_path: Path) -> None:
    """As the add-on writes it, and as the real Silo finds its own documents."""
    path = tmp_path / "a.FCStd"
    Doc().add("Part::Box", "Other").add("Part::Box", "Box", Note="<Properties Count='9'>").save(path)
    with zipfile.ZipFile(path) as archive:
        before = archive.read("Document.xml").decode()
    assert stamp(path, "u-1", item_object="Box")
    document = open_document(path)
    assert document.getObject("Box").SiloItemId == "u-1"
    # FreeCAD's property editor shows it, and nobody changes it there by accident.
    assert b'attr="8" ro="1"' in zipfile.ZipFile(path).read("Document.xml")
    assert not hasattr(document.getObject("Other"), "SiloItemId")
    assert (document.Meta, identity_of(document.getObject("Box"))) == ({"SiloUUID": "u-1"}, "u-1")
    with zipfile.ZipFile(path) as archive:
        after = archive.read("Document.xml").decode()
    assert len(after.splitlines()) > len(before.splitlines())
    for count, more in (("3", -1), ("4", 1)):  # Box has one more property than before, nothing else changed
        word = f'Count="{count}" TransientCount'
        assert after.count(word) == before.count(word) + more
    assert stamp(path, "u-1", item_object="Box") is False
    with pytest.raises(DocumentError, match="SiloItemId is another identity"):
        stamp(path, "u-2", item_object="Box")
    with pytest.raises(DocumentError, match="no object named"):
        check_stampable(tmp_path / "a.FCStd", item_object="Gone")


@pytest.mark.parametrize("object_name", [None, "Box"])
def test_an_object_that_lacks_the_identity_of_meta_gets_it(tmp_path: Path, object_name: str | None) -> None:
    """The file was said to have it already, and Silo did not find the object."""
    path = tmp_path / "a.FCStd"
    Doc().add("Part::Box", "Box").save(path)
    assert stamp(path, "u-1", object_name=object_name)
    meta = open_document(path).Meta
    assert stamp(path, "u-1", object_name=object_name, item_object="Box")
    document = open_document(path)
    assert (document.getObject("Box").SiloItemId, document.Meta) == ("u-1", meta)
    assert stamp(path, "u-1", object_name=object_name, item_object="Box") is False
