# SPDX-License-Identifier: LGPL-2.1-or-later
"""Commits on disk, before they reach the outbox."""

from __future__ import annotations

import hashlib
import json
import os
import stat
from pathlib import Path

import pytest

from silo.bom.errors import InputError
from silo.bom.model import BomEntry, Extraction
from silo.workbench.commit.snapshot import Snapshot
from silo.workbench.session.spool import Commit, Spool, new_key


@pytest.fixture(name="spool")
def _spool(tmp_path: Path) -> Spool:
    return Spool(tmp_path / "commits")


@pytest.fixture(name="document")
def _document(tmp_path: Path) -> Path:
    path = tmp_path / "vault" / "Top.FCStd"
    path.parent.mkdir()
    path.write_bytes(b"first")
    return path


def commit(document: Path, when: float = 1.0, key: str = "") -> Commit:
    snapshot = Snapshot(str(document), "Top", "top-id", Extraction(BomEntry(str(document))))
    return Commit(key or new_key(), snapshot, when, "why", document)


def test_what_is_added_waits_with_its_own_copy(spool: Spool, document: Path) -> None:
    """The document may be edited further; what was committed is what will be sent."""
    spool.add(commit(document))
    document.write_bytes(b"second")
    (waiting,) = Spool(spool.folder).waiting()
    assert waiting.file is not None
    assert waiting.file.read_bytes() == b"first"
    assert waiting.file.name == "Top.FCStd"
    assert waiting.sha256 == hashlib.sha256(b"first").hexdigest()
    assert (waiting.comment, waiting.taken_at) == ("why", 1.0)
    assert waiting.snapshot == commit(document).snapshot


def test_a_held_file_keeps_its_content_when_freecad_saves_again(spool: Spool, document: Path) -> None:
    """FreeCAD writes a new file and renames it; the name that is held still leads to the old one."""
    key = new_key()
    held = spool.hold(str(document), key)
    new = document.with_suffix(".new")
    new.write_bytes(b"second")
    os.replace(new, document)
    spool.add(Commit(key, Snapshot(str(document), "Top"), 1.0, file=held))
    (waiting,) = spool.waiting()
    assert waiting.file == held
    assert waiting.file is not None
    assert waiting.file.read_bytes() == b"first"


def test_a_commit_that_waits_shares_no_content_with_the_document(spool: Spool, document: Path) -> None:
    """Not every program writes a new file: one that overwrites the old one must not reach what waits."""
    key = new_key()
    held = spool.hold(str(document), key)
    kept = spool.add(Commit(key, Snapshot(str(document), "Top"), 1.0, file=held))
    before = document.read_bytes()
    with document.open("r+b") as file:
        file.write(b"overwritten")
    assert kept.file is not None
    assert kept.file.read_bytes() == before
    assert {path.name for path in kept.file.parent.iterdir()} == {"commit.json", document.name}


def test_what_cannot_be_held_is_told_by_none(spool: Spool, tmp_path: Path) -> None:
    """Another disk, or no file at all: then it is copied."""
    assert spool.hold(str(tmp_path / "none.FCStd"), new_key()) is None


def test_oldest_first(spool: Spool, document: Path) -> None:
    """By the time of the commit, not of the writing."""
    for when in (3.0, 1.0, 2.0):
        spool.add(commit(document, when))
    assert [one.taken_at for one in spool.waiting()] == [1.0, 2.0, 3.0]


def test_a_commit_without_a_file(spool: Spool, document: Path) -> None:
    """Only its BOM is to be synced."""
    spool.add(Commit("k", Snapshot(str(document), "Top"), 1.0))
    (waiting,) = spool.waiting()
    assert (waiting.file, waiting.sha256) == (None, "")


def test_removed_is_gone(spool: Spool, document: Path) -> None:
    """Its copy too; the document itself stays."""
    kept = spool.add(commit(document))
    spool.remove(kept)
    assert spool.waiting() == ()
    assert list(spool.folder.glob("*/")) == []
    assert document.exists()


def test_an_unreadable_commit_is_set_aside(spool: Spool, document: Path) -> None:
    """Neither lost nor in the way of others."""
    spool.add(commit(document, key="bad"))
    spool.add(commit(document, key="good"))
    (spool.folder / "bad" / "commit.json").write_text("{half")
    assert [one.key for one in spool.waiting()] == ["good"]
    assert (spool.folder / "bad" / "commit.unreadable").exists()
    assert (spool.folder / "bad" / "Top.FCStd").exists()


def test_a_commit_whose_copy_is_gone_is_set_aside(spool: Spool, document: Path) -> None:
    """It must not be sent as a commit without a file."""
    kept = spool.add(commit(document))
    assert kept.file is not None
    kept.file.unlink()
    assert spool.waiting() == ()


def test_a_path_in_the_file_leads_nowhere_else(spool: Spool, document: Path, tmp_path: Path) -> None:
    """Who can write there cannot make us upload another file."""
    kept = spool.add(commit(document))
    secret = tmp_path / "secret"
    secret.write_text("s")
    path = spool.folder / kept.key / "commit.json"
    data = json.loads(path.read_text())
    path.write_text(json.dumps({**data, "file": "../../secret"}))
    assert spool.waiting() == ()


def test_only_one_may_hand_over(spool: Spool) -> None:
    """Two FreeCADs share the folder."""
    with spool.forwarding() as first, Spool(spool.folder).forwarding() as second:
        assert first
        assert not second
    with spool.forwarding() as again:
        assert again


def test_what_a_crash_left_is_swept_up_later(spool: Spool, document: Path) -> None:
    """Never what waits, and never what another FreeCAD may be about to finish."""
    spool.add(commit(document, key="waits"))
    assert spool.hold(str(document), "orphan") is not None
    spool.sweep()
    assert (spool.folder / "orphan").exists()
    later = Spool(spool.folder, clock=lambda: (spool.folder / "orphan").stat().st_mtime + 7200)
    later.sweep()
    assert not (spool.folder / "orphan").exists()
    assert [one.key for one in later.waiting()] == ["waits"]


def test_a_disk_that_does_not_take_it_is_told(tmp_path: Path, document: Path) -> None:
    """With what to do, and nothing half done."""
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    with pytest.raises(InputError, match="commits cannot be kept there"):
        Spool(blocked / "commits").add(commit(document))


@pytest.mark.skipif(os.name != "posix", reason="file modes are POSIX")
def test_commits_are_private(spool: Spool, document: Path) -> None:
    """They hold other people's documents."""
    spool.add(commit(document))
    assert stat.S_IMODE(spool.folder.stat().st_mode) == 0o700
