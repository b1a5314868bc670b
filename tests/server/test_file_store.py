# SPDX-License-Identifier: LGPL-2.1-or-later
"""The store: by hash, atomically, never by a client's name."""

from __future__ import annotations

import hashlib
import io
import zipfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from silo.bom.errors import NotFoundError
from silo_server.services.file_store import FileStore, clean_name
from silo_server.services.thumbnails import MAX_THUMBNAIL, PNG, read_thumbnail


def fcstd(picture: bytes) -> bytes:
    """An FCStd file with this picture."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("thumbnails/Thumbnail.png", picture)
    return out.getvalue()


def test_content_is_found_by_its_hash(tmp_path: Path) -> None:
    """Kept once; nothing temporary is left."""
    store = FileStore(tmp_path / "new" / "files")
    content = b"x" * 3_000_000
    first = store.keep("a.FCStd", io.BytesIO(content))
    again = store.keep("b.FCStd", io.BytesIO(content))
    assert first.checksum == again.checksum == hashlib.sha256(content).hexdigest()
    assert store.path_of(first.checksum).read_bytes() == content
    assert len([path for path in store.root.rglob("*") if path.is_file()]) == 1
    with pytest.raises(NotFoundError):
        store.path_of("0" * 64)


def test_content_that_somebody_reads_is_kept_again(tmp_path: Path) -> None:
    """A download is under way; Windows then replaces no file, and need not: it is the same one."""
    store = FileStore(tmp_path / "files")
    first = store.keep("a.FCStd", io.BytesIO(b"content"))
    with store.path_of(first.checksum).open("rb") as reading:
        assert store.keep("b.FCStd", io.BytesIO(b"content")).checksum == first.checksum
        assert reading.read() == b"content"
    assert len([path for path in store.root.rglob("*") if path.is_file()]) == 1


def test_an_upload_that_breaks_off_leaves_nothing(tmp_path: Path) -> None:
    """The reader fails in the middle: no half file."""

    class Broken(io.BytesIO):
        def read(self, size: int | None = -1) -> bytes:
            raise OSError("gone")

    store = FileStore(tmp_path / "files")
    with pytest.raises(OSError, match="gone"):
        store.keep("a", Broken())
    assert [path for path in store.root.rglob("*") if path.is_file()] == []


# As FreeCAD saves it if no 3D view is open.
ICON = PNG + b"\0\0\0\x0dIHDR" + b"\0\0\0\x40" * 2


def test_thumbnails_are_taken_with_care(tmp_path: Path) -> None:
    """A PNG of sane size, or nothing: bombs, other types, broken zips and FreeCAD's icon are no pictures."""
    path = tmp_path / "f"
    for content, expected in (
        (fcstd(PNG + b"ok"), PNG + b"ok"),
        (fcstd(b"<svg/>"), None),
        (fcstd(ICON), None),
        (fcstd(PNG + b"\0" * (MAX_THUMBNAIL + 1)), None),
        (fcstd(PNG)[:-30], None),
        (b"no zip", None),
        (b"", None),
    ):
        path.write_bytes(content)
        assert read_thumbnail(path) == expected


@pytest.mark.parametrize("name", ["CON", "nul.FCStd", "vault\\com1.FCStd", "Aux .tar.gz", "\0LPT¹"])
def test_a_name_is_no_device_of_windows(name: str) -> None:
    """Nobody on Windows can save such a download; the rule is that of links and of pulled files."""
    assert clean_name(name).startswith("_")
    assert not clean_name("Console.FCStd").startswith("_")


@given(st.text(max_size=300))
def test_a_name_is_only_a_name(name: str) -> None:
    """Whatever a client sends: no path, no control characters, not empty, not endless."""
    cleaned = clean_name(name)
    assert cleaned
    assert len(cleaned) <= 200
    assert not set(cleaned) & set("/\\\0\n\r")
    assert cleaned.strip(".")
    assert cleaned.isprintable()
