# SPDX-License-Identifier: LGPL-2.1-or-later
"""Containers that are damaged, hostile or no containers at all: a plain error, little memory, no hang."""

from __future__ import annotations

import os
import struct
import zipfile
import zlib
from pathlib import Path

import pytest
from fcstd_writer import COMMENT, Doc, container, part, save_xml

from silo.bom.errors import DocumentError
from silo.bom.findings import FindingCode
from silo.fcstd import Limits, open_document
from silo.fcstd.container import ContainerFile
from silo.fcstd.errors import FcstdError


def refused(path: Path, limits: Limits | None = None) -> str:
    """The reason why a file is not read."""
    with pytest.raises(DocumentError) as caught:
        open_document(path, limits=limits)
    assert str(caught.value).startswith(os.path.realpath(path))
    return caught.value.reason


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    """A file that is not there is an error that says so."""
    assert refused(tmp_path / "none.FCStd") == "there is no such file"


def test_a_file_below_a_file_is_missing(tmp_path: Path) -> None:
    """A path through a file, as if it were a folder, leads nowhere."""
    path = part().save(tmp_path / "part.FCStd")
    assert refused(path / "x.FCStd") == "there is no such file"


def test_an_empty_file_is_refused(tmp_path: Path) -> None:
    """Zero bytes are no document."""
    path = tmp_path / "empty.FCStd"
    path.touch()
    assert refused(path) == "it is empty"


def test_any_other_file_is_refused(tmp_path: Path) -> None:
    """A text file with a document's name is distinguished from a cut one."""
    path = tmp_path / "text.FCStd"
    path.write_text("hello" * 100)
    assert "not a FreeCAD document" in refused(path)


def test_a_folder_with_the_name_of_a_document_is_refused(tmp_path: Path) -> None:
    """FreeCAD forks may keep documents as folders; they are not read."""
    (tmp_path / "folder.FCStd").mkdir()
    assert refused(tmp_path / "folder.FCStd") == "it is a folder, not a FreeCAD document"


@pytest.mark.usefixtures("needs_pipes")
def test_a_named_pipe_does_not_hang(tmp_path: Path) -> None:
    """Opening a pipe that nobody writes to would wait forever."""
    os.mkfifo(tmp_path / "pipe.FCStd")
    assert "no regular file" in refused(tmp_path / "pipe.FCStd")


@pytest.mark.usefixtures("needs_symlinks")
def test_a_symlink_loop_is_an_error(tmp_path: Path) -> None:
    """Symlinks in a circle end in an error of the system, reported in its words."""
    (tmp_path / "a.FCStd").symlink_to("b.FCStd")
    (tmp_path / "b.FCStd").symlink_to("a.FCStd")
    assert "cannot be opened" in refused(tmp_path / "a.FCStd")


def test_an_lfs_pointer_says_what_to_do(tmp_path: Path) -> None:
    """A pointer file of Git LFS is the commonest "broken" file of a clone."""
    path = tmp_path / "part.FCStd"
    path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 1\n")
    assert "git lfs pull" in refused(path)
    with pytest.raises(FcstdError) as caught:
        open_document(path)
    assert caught.value.finding is FindingCode.LFS_POINTER


@pytest.mark.parametrize("length", [1, 100, 500])
def test_a_container_cut_short_is_refused(tmp_path: Path, length: int) -> None:
    """The end of a container is its directory; without it, nothing is trusted."""
    path = tmp_path / "cut.FCStd"
    path.write_bytes(part().bytes()[:-length])
    assert "cut short" in refused(path)


def test_a_container_without_a_document_is_refused(tmp_path: Path) -> None:
    """Any zip may be called FCStd."""
    path = tmp_path / "other.FCStd"
    path.write_bytes(container({"readme.txt": b"hello"}))
    assert "no Document.xml" in refused(path)


def test_two_documents_in_one_container_are_refused(tmp_path: Path) -> None:
    """Which of two entries of one name is meant, nobody knows."""
    path = tmp_path / "two.FCStd"
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("Document.xml", Doc().xml())
        with pytest.warns(UserWarning, match="Duplicate"):
            file.writestr("Document.xml", part().xml())
    assert refused(path) == "it holds 2 entries named Document.xml"


def test_an_encrypted_document_is_refused(tmp_path: Path) -> None:
    """FreeCAD writes none, and nobody could type the password."""
    raw = bytearray(part().bytes())
    raw[6] |= 1
    raw[raw.index(b"PK\x01\x02") + 8] |= 1
    path = tmp_path / "secret.FCStd"
    path.write_bytes(raw)
    assert "encrypted" in refused(path)


def test_another_packing_is_refused(tmp_path: Path) -> None:
    """FreeCAD knows stored and deflated entries only."""
    path = tmp_path / "lzma.FCStd"
    path.write_bytes(container({"Document.xml": part().xml().encode()}, zipfile.ZIP_LZMA))
    assert "method 14" in refused(path)


def test_a_stored_document_is_read(tmp_path: Path) -> None:
    """FreeCAD opens containers that were written without packing, and so do we."""
    path = tmp_path / "stored.FCStd"
    path.write_bytes(container({"Document.xml": part().xml().encode()}, zipfile.ZIP_STORED))
    assert [o.Name for o in open_document(path).Objects] == ["Box"]


def test_bytes_before_and_behind_the_container_do_no_harm(tmp_path: Path) -> None:
    """A zip may have something before it and behind it; its directory still says where things are."""
    path = tmp_path / "wrapped.FCStd"
    path.write_bytes(b"#!something\n" + part().bytes() + b"\0\0")
    assert [o.Name for o in open_document(path).Objects] == ["Box"]


def test_a_comment_that_looks_like_an_end_record_does_no_harm(tmp_path: Path) -> None:
    """The last record that fits with its comment counts."""
    raw = part().bytes()
    end = raw.rindex(b"PK\x05\x06")
    comment = b"PK\x05\x06 not really"
    path = tmp_path / "odd.FCStd"
    path.write_bytes(raw[: end + 20] + struct.pack("<H", len(comment)) + comment)
    assert [o.Name for o in open_document(path).Objects] == ["Box"]


@pytest.mark.parametrize("at", ["central", "local"])
def test_a_directory_that_disagrees_with_its_entries_is_refused(tmp_path: Path, at: str) -> None:
    """Readers that trust the one or the other would see different documents."""
    raw = bytearray(container({"Document.xml": Doc().xml().encode(), "Evil.xmlxxxx": part().xml().encode()}))
    first, second = raw.index(b"Document.xml"), raw.rindex(b"Document.xml")
    place = first if at == "local" else second
    raw[place : place + 12] = b"Xocument.xml"
    path = tmp_path / "two-faced.FCStd"
    path.write_bytes(raw)
    assert ("disagree" if at == "local" else "no Document.xml") in refused(path)


def test_a_wrong_checksum_is_noticed(tmp_path: Path) -> None:
    """A file that lost a bit is not half right."""
    raw = bytearray(part().bytes())
    place = raw.index(b"PK\x01\x02") + 16
    raw[place] ^= 1
    path = tmp_path / "bit.FCStd"
    path.write_bytes(raw)
    assert "checksum" in refused(path)


@pytest.mark.parametrize("seed", range(3))
def test_packed_bytes_that_were_changed_are_noticed(tmp_path: Path, seed: int) -> None:
    """A flipped bit in the packed text breaks the unpacking or the checksum."""
    raw = bytearray(part().bytes())
    raw[60 + seed * 30] ^= 0x10
    path = tmp_path / "bit.FCStd"
    path.write_bytes(raw)
    assert "damaged" in refused(path) or "well-formed" in refused(path)


def _lying(content: bytes, size: int, packed: bytes | None = None) -> bytes:
    """A container whose directory says ``size`` for a text of another length."""
    raw = bytearray(container({"Document.xml": content}))
    for mark, place in ((b"PK\x03\x04", 22), (b"PK\x01\x02", 24)):
        at = raw.index(mark) + place
        raw[at : at + 4] = struct.pack("<L", size)
    return bytes(raw)


def test_a_bomb_by_size_is_refused_unread(tmp_path: Path) -> None:
    """What the directory calls too large is not unpacked."""
    path = save_xml(tmp_path / "big.FCStd", b" " * 2000)
    assert "too large: 2000 bytes" in refused(path, Limits(document_xml=1000))


def test_a_bomb_that_lies_about_its_size_is_stopped(tmp_path: Path) -> None:
    """The bytes that come out are counted, not those that are promised."""
    path = tmp_path / "liar.FCStd"
    path.write_bytes(_lying(b" " * 50_000_000, 900))
    assert "longer than the directory says" in refused(path, Limits(document_xml=1000))


def test_a_bomb_by_ratio_is_stopped(tmp_path: Path) -> None:
    """More than 300 : 1 is no assembly of FreeCAD's."""
    path = save_xml(tmp_path / "bomb.FCStd", b" " * 40_000_000)
    assert "zip bombs" in refused(path)
    assert "zip bombs" in refused(path, Limits(document_xml=40_000_001))


def test_a_regular_large_assembly_is_no_bomb(tmp_path: Path) -> None:
    """The ratio bound lets the most regular real texts pass (44 : 1 for 1000 equal links)."""
    doc = Doc()
    for number in range(3000):
        doc.link(f"L{number}", "part.FCStd", "Box")
    doc.entries.clear()
    path = doc.save(tmp_path / "large.FCStd")
    assert len(doc.xml()) > Limits().ratio_from
    assert len(open_document(path).Objects) == 3000


def test_a_directory_with_too_many_entries_is_refused(tmp_path: Path) -> None:
    """The number of entries is bounded before the directory is walked."""
    path = tmp_path / "many.FCStd"
    path.write_bytes(container({"Document.xml": Doc().xml().encode(), **{f"x{i}": b"" for i in range(20)}}))
    assert "absurdly large" in refused(path, Limits(entries=10))


def test_an_end_record_that_claims_gigabytes_is_refused(tmp_path: Path) -> None:
    """Claimed lengths are compared with the file before anything is read or reserved."""
    end = struct.pack("<4sHHHHLLH", b"PK\x05\x06", 0, 0, 3, 3, 0xFFFFFF00, 10, len(COMMENT)) + COMMENT
    path = tmp_path / "claim.FCStd"
    path.write_bytes(b"\0" * 100 + end)
    assert "absurdly large" in refused(path)


def test_zip64_is_refused_in_plain_words(tmp_path: Path) -> None:
    """FreeCAD neither writes nor reads it."""
    end = struct.pack("<4sHHHHLLH", b"PK\x05\x06", 0, 0, 0xFFFF, 0xFFFF, 0xFFFFFFFF, 0xFFFFFFFF, 0)
    path = tmp_path / "zip64.FCStd"
    path.write_bytes(b"\0" * 100 + end)
    assert "ZIP64" in refused(path)


def test_it_reads_what_zipfile_reads(tmp_path: Path) -> None:
    """Names, sizes and bytes are those that the standard library sees."""
    path = tmp_path / "all.FCStd"
    path.write_bytes(container({"Document.xml": Doc().xml().encode(), "ümlaut": b"x" * 1000, "empty": b""}))
    with ContainerFile(str(path), Limits()) as ours, zipfile.ZipFile(path) as theirs:
        entries = list(ours.directory.entries())
        assert [e.name.decode() for e in entries] == theirs.namelist()
        for entry, info in zip(entries, theirs.infolist(), strict=True):
            assert (entry.size, entry.packed, entry.crc) == (info.file_size, info.compress_size, info.CRC)
            packed = ours.packed(entry, 10**6)
            assert (zlib.decompress(packed, -15) if entry.method else packed) == theirs.read(info)
