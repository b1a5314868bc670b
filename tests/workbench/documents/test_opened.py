# SPDX-License-Identifier: LGPL-2.1-or-later
"""What each open document was made from."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path

import pytest
from desk import Office

from silo.outbox.entry import Commit
from silo.outbox.send import send_all
from silo.platform.stamp import stamp_of
from silo.workbench.documents.opened import Opened


class Store:
    """What is remembered of saved files."""

    def __init__(self) -> None:
        self.known: dict[str, str] = {}

    def derived(self, sha256: str, origin: str, /) -> None:
        self.known[sha256] = origin

    def replaced(self, content: str, /) -> None:
        self.known[content] = "another file"

    def first(self, sha256: str) -> str:
        """What it was made from in the first place."""
        return self.first(self.known[sha256]) if sha256 in self.known else sha256


class Doc:
    """A document with FreeCAD's names."""

    def __init__(self, name: str) -> None:
        self.Name, self.FileName, self.Objects = name, "", []  # type: ignore[var-annotated]


def opened_as(opened: Opened, path: Path, name: str = "Doc") -> Doc:
    doc = Doc(name)
    doc.FileName = str(path)
    opened.slotChangedDocument(doc, "FileName")
    return doc


def save(opened: Opened, doc: Doc, content: bytes) -> None:
    opened.slotStartSaveDocument(doc, doc.FileName)
    new = Path(doc.FileName + ".new")
    new.write_bytes(content)
    new.replace(doc.FileName)
    opened.slotFinishSaveDocument(doc, doc.FileName)


@pytest.mark.parametrize("busy", [False, True], ids=["a worker is there", "it has no time"])
def test_own_saves_keep_the_origin_over_a_restart(tmp_path: Path, busy: bool) -> None:
    """Opened, saved twice, opened again by another FreeCAD: still made from what was opened first."""
    path, store = tmp_path / "a.FCStd", Store()
    path.write_bytes(b"one")
    opened = Opened(lambda: store)
    if not busy:
        opened.begin(lambda call: call())
    doc = opened_as(opened, path)
    for content in (b"two", b"three"):
        save(opened, doc, content)
        assert not opened.of(doc).replaced
    if busy:
        opened.begin(lambda call: call())
    assert opened.of(doc).settle() == sha256(b"three").hexdigest()
    again = Opened(lambda: store)
    assert store.first(again.of(opened_as(again, path)).settle()) == sha256(b"one").hexdigest()


@pytest.mark.parametrize("is_sent", [False, True], ids=["it waits", "it is in Silo"])
def test_saved_first_and_committed_then_nothing_is_asked_after_a_restart(
    office: Office, is_sent: bool
) -> None:
    """Made, saved, committed as it is; opened again, saved, committed: each is made from the one before."""
    store, client = office.session.outbox, office.silo
    path = office.folder / "Plate.FCStd"
    identity = client.create_item("kindred-rd", "M01", "Plate").id
    for round_, contents in enumerate(((b"one", b"two"), (b"three", b"four"))):
        opened = Opened(lambda: store)
        opened.begin(lambda call: call())
        doc = Doc("Plate")
        if round_:
            doc = opened_as(opened, path)
        else:
            doc.Objects.append("Box")
            doc.FileName = str(path)
            opened.slotChangedDocument(doc, "FileName")
        for content in contents:
            save(opened, doc, content)
        base = opened.of(doc)
        assert base.settle() == sha256(contents[1]).hexdigest()
        commit = Commit(str(path), float(round_), "Plate", identity, file=path, origin=base.settle())
        base.committed(store.add(commit, client.base_url).sha256)
        if is_sent:
            send_all(store, client)
    send_all(store, client)
    assert store.entries() == ()
    assert office.files("Plate") == [b"two", b"four"]


def test_a_file_that_another_wrote_is_replaced_and_its_origin_stays(tmp_path: Path) -> None:
    """Two FreeCADs on one file."""
    path, store = tmp_path / "a.FCStd", Store()
    path.write_bytes(b"one")
    mine, other = Opened(lambda: store), Opened(lambda: store)
    for opened in (mine, other):
        opened.begin(lambda call: call())
    doc, theirs = opened_as(mine, path), opened_as(other, path)
    save(other, theirs, b"by the other")
    assert (mine.of(doc).replaced, other.of(theirs).replaced) == (True, False)
    assert mine.of(doc).settle() == sha256(b"one").hexdigest()


def test_a_document_that_was_made_here_has_no_origin(tmp_path: Path) -> None:
    """Saved over an existing file it is not made from that one."""
    path, store = tmp_path / "a.FCStd", Store()
    path.write_bytes(b"somebody's")
    opened = Opened(lambda: store)
    doc = Doc("New")
    doc.Objects.append("Box")
    doc.FileName = str(path)
    opened.slotChangedDocument(doc, "FileName")
    save(opened, doc, b"new")
    assert opened.of(doc).settle() != sha256(b"somebody's").hexdigest()


def test_a_commit_is_what_comes_after_it_is_made_from(tmp_path: Path) -> None:
    """And closing a document forgets it."""
    path, store = tmp_path / "a.FCStd", Store()
    path.write_bytes(b"one")
    opened = Opened(lambda: store)
    doc = opened_as(opened, path)
    opened.of(doc).committed(sha256(b"two").hexdigest())
    assert opened.of(doc).settle() == sha256(b"two").hexdigest()
    opened.slotDeletedDocument(doc)
    assert opened.of(doc).content == ""
    assert opened.of(doc).stamp == stamp_of(str(path))
