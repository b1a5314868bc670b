# SPDX-License-Identifier: LGPL-2.1-or-later
"""Commits on disk: kept whole from their first moment, never set aside, never invisible."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import shutil
import sqlite3
import stat
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from other_disk import other_disk

from silo.api.pause import Pause
from silo.api.revisions import standing
from silo.api.wire import Revision
from silo.bom.entry import BomEntry, Extraction
from silo.bom.errors import DocumentError, InputError
from silo.bom.system_refusals import why_refused
from silo.checksums import seen_as
from silo.outbox.entry import Commit, Entry, State, new_key
from silo.outbox.send import send_all
from silo.outbox.store import OutboxError, Store
from silo.outbox.tables import VERSION
from silo.platform.stamp import stamp_of
from silo.platform.whole_files import replacing
from silo.project_folder import FileRecord, write_record
from silo.testing import FakeSilo
from vault import died


@pytest.fixture(name="store")
def _store(tmp_path: Path) -> Store:
    return Store(tmp_path / "outbox.sqlite3")


@pytest.fixture(name="document")
def _document(tmp_path: Path) -> Path:
    path = tmp_path / "vault" / "Top.FCStd"
    path.parent.mkdir()
    path.write_bytes(b"first")
    return path


def commit(document: Path, key: str = "", file: Path | None = None) -> Commit:
    return Commit(
        str(document),
        1.0,
        "Top",
        "top-id",
        key=key or new_key(),
        comment="why",
        file=file or document,
        extraction=Extraction(BomEntry(str(document))),
    )


def with_item() -> tuple[FakeSilo, str]:
    """A server with one assembly, and its identity."""
    silo = FakeSilo()
    return silo, silo.create_item("kindred-rd", "A01", "Top").id


def test_what_is_added_waits_as_it_was(store: Store, document: Path) -> None:
    """File and BOM of one moment, also for the next process; the document may be edited further in place."""
    entry = store.add(commit(document), "http://silo")
    with document.open("r+b") as file:
        file.write(b"other")
    (waiting,) = Store(store.path).entries()
    assert waiting == entry
    assert (store.copies / waiting.copy).read_bytes() == b"first"
    assert waiting.sha256 == hashlib.sha256(b"first").hexdigest()
    assert (waiting.comment, waiting.taken_at, waiting.label) == ("why", 1.0, "Top")
    assert (waiting.server, waiting.file_name, waiting.size) == ("http://silo:80/api", "Top.FCStd", 5)
    assert (waiting.file_left, waiting.bom_left) == (True, True)


def test_a_commit_that_cannot_be_kept_is_reported_and_leaves_nothing(store: Store, document: Path) -> None:
    """At once, not when it is sent: a file that cannot be read, or neither file nor BOM."""
    with pytest.raises(DocumentError, match=r"gone\.FCStd.*nothing was kept"):
        store.add(commit(document.with_name("gone.FCStd")))
    with pytest.raises(InputError, match="neither a file nor a BOM"):
        store.add(Commit(str(document), 1.0))
    assert (store.entries(), list(store.copies.iterdir())) == ((), [])


def test_the_default_place_is_the_users_data_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where data that must not be lost belongs."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    if sys.platform == "linux":
        assert Store().path == tmp_path / "silo-mod" / "outbox.sqlite3"


def test_a_held_file_keeps_its_content_when_freecad_saves_again(store: Store, document: Path) -> None:
    """FreeCAD writes a new file and renames it; the name that is held still leads to the old one."""
    key = new_key()
    held = store.hold(str(document), key)
    new = document.with_suffix(".new")
    new.write_bytes(b"second")
    os.replace(new, document)
    entry = store.add(commit(document, key, held))
    assert (store.copies / entry.copy).read_bytes() == b"first"
    # One copy, and no second name any more.
    assert [p for p in store.path.parent.rglob("*.FCStd") if p != document] == [store.copies / entry.copy]


def test_a_disk_where_each_name_of_a_file_is_another_file(tmp_path: Path) -> None:
    """A second name that looks like another file would be refused as written since: the file is copied."""
    with other_disk(tmp_path, "each-spelling") as disk:
        document = disk / "Top.FCStd"
        document.write_bytes(b"first")
        store, key = Store(disk / "data" / "outbox.sqlite3"), new_key()
        stamp = stamp_of(document)
        held = store.hold(str(document), key)
        entry = store.add(replace(commit(document, key, held), stamp=stamp))
        assert (store.copies / entry.copy).read_bytes() == b"first"


def test_killed_before_the_copy_was_made(store: Store, document: Path) -> None:
    """From its row on a commit is not lost: the next start makes the copy from the second name."""
    key = new_key()
    held = store.hold(str(document), key)
    store.stage(commit(document, key, held))
    document.unlink()
    died(store)
    after = Store(store.path)
    assert [entry.state for entry in after.entries()] == [State.KEEPING]
    send_all(after, FakeSilo())
    (entry,) = after.entries()
    assert (after.copies / entry.copy).read_bytes() == b"first"
    assert entry.sha256 == hashlib.sha256(b"first").hexdigest()


def test_killed_without_a_second_name(store: Store, document: Path) -> None:
    """What the document says by then may be another thing: a person is asked, and nothing is sent."""
    store.stage(commit(document))
    died(store)
    after = Store(store.path)
    send_all(after, FakeSilo())
    (entry,) = after.entries()
    assert (entry.state, entry.sha256) == (State.HELD, "")
    assert "commit it again" in entry.reason


def test_a_copy_whose_row_was_not_written_any_more_is_used(store: Store, document: Path) -> None:
    """It has its name only when it is whole."""
    made = commit(document)
    store.stage(made)
    entry = store.by_key(made.key)
    assert entry is not None
    (store.copies / entry.copy).write_bytes(b"whole")
    store.finish(made.key)
    (after,) = store.entries()
    assert (after.state, after.sha256) == (State.WAITING, hashlib.sha256(b"whole").hexdigest())


def test_sweeping_leaves_a_copy_that_is_being_made(store: Store, document: Path) -> None:
    """Another thread or program may be at it; what a killed one left goes with its row."""
    made = commit(document)
    store.stage(made)
    with replacing(store.copies / f"{made.key}.FCStd") as file:
        file.write(b"half")
        store.sweep()
    (copy,) = store.copies.glob("*.FCStd")
    copy.rename(store.copies / f".{made.key}.FCStd.killed.part")
    store.sweep()
    assert [*store.copies.iterdir()]
    (entry,) = store.entries()
    store.discard(entry.id)
    assert [*store.copies.iterdir()] == []


def database(store: Store) -> list[Path]:
    return [file for file in store.path.parent.glob(f"{store.path.name}*") if file.is_file()]


def lose(store: Store) -> None:
    for file in database(store):
        file.unlink()


def rewritten(store: Store, write: Callable[[Path], object]) -> None:
    """The database as a whole file with another content."""
    with closing(sqlite3.connect(store.path)) as db:
        db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        db.execute("PRAGMA journal_mode = DELETE")
    write(store.path)


def foreign(path: Path) -> None:
    path.unlink()
    with closing(sqlite3.connect(path)) as db:
        db.execute("CREATE TABLE entry (id INTEGER, photo BLOB)")
        db.execute(f"PRAGMA user_version = {VERSION}")
        db.execute("INSERT INTO entry VALUES (1, 'x')")
        db.commit()


def half_read(path: Path) -> None:
    content = path.read_bytes()
    path.write_bytes(content[:4096] + b"\xff" * (len(content) - 4096))


def of_format(version: int, *, described: bool) -> Callable[[Store], None]:
    """Make a database of another format, as another version of silo-mod wrote it."""

    def make(store: Store) -> None:
        with closing(sqlite3.connect(store.path)) as db:
            if version < 8:
                db.execute("DROP TABLE pause")
                db.execute("ALTER TABLE entry ADD COLUMN attempts INTEGER NOT NULL DEFAULT 0")
            if version > VERSION:
                db.execute("ALTER TABLE entry ADD COLUMN mood TEXT NOT NULL DEFAULT 'fine'")
            elif version < 6:
                db.execute("ALTER TABLE entry DROP COLUMN renamed")
                db.execute("DROP TABLE known")
            db.execute(f"PRAGMA user_version = {version}")
            db.commit()
        if not described:
            for file in store.copies.glob("*.json"):
                file.unlink()

    return make


DAMAGES: dict[str, Callable[[Store], object]] = {
    "deleted": lose,
    "emptied": lambda store: [file.write_bytes(b"") for file in database(store)],
    "moved away": lambda store: [file.rename(f"{file}.bad") for file in database(store)],
    "a text": lambda store: rewritten(store, lambda path: path.write_text("not a database at all" * 999)),
    "another program's": lambda store: rewritten(store, foreign),
    "cut off": lambda store: rewritten(store, lambda path: os.truncate(path, 5000)),
    "damaged pages": lambda store: rewritten(store, half_read),
    "format 5": of_format(5, described=False),
    "format 6": of_format(6, described=False),
    "format 7": of_format(7, described=True),
    "a newer format": of_format(VERSION + 1, described=True),
}


@pytest.mark.parametrize(
    ("damage", "remedy", "running"),
    [
        *((damage, "nothing", running) for damage in DAMAGES for running in (False, True)),
        *(
            (damage, remedy, False)
            for damage in ("format 6", "damaged pages", "a newer format")
            for remedy in ("moved away", "deleted")
        ),
    ],
)
def test_a_lost_database_costs_no_commit(
    store: Store, document: Path, damage: str, remedy: str, running: bool
) -> None:
    """Whatever was promised is in Silo once or in view, whatever a person does to the file."""
    silo = FakeSilo()
    bolt = silo.create_item("kindred-rd", "F01", "Bolt")
    made: dict[str, Commit] = {}
    for number, name in enumerate(("Waiting", "Held", "Staged", "Second")):
        item = silo.create_item("kindred-rd", "A01", name)
        path = document.with_name(f"{name}.FCStd")
        path.write_bytes(name.encode())
        head = BomEntry(str(path), silo_uuid=item.id, is_assembly=True)
        lines = (BomEntry("/v/Bolt.FCStd", silo_uuid=bolt.id, quantity=number + 1),)
        one = Commit(
            *(str(path), float(number), name, item.id),
            file=path,
            comment=f"why {name}",
            extraction=Extraction(head, lines),
        )
        if name == "Staged":
            one = replace(one, file=store.hold(str(path), one.key))
        store.stage(one, silo.base_url)
        if name != "Staged":
            store.finish(one.key, path)
        made[name] = one
    held = store.by_key(made["Held"].key)
    assert held is not None
    store.update(held.id, state=State.HELD, reason="a person looks")
    died(store)
    before = {entry.key: entry for entry in store.entries()}
    DAMAGES[damage](store)
    if remedy != "nothing":
        DAMAGES[remedy](store)
    after = store if running else Store(store.path)
    if running and damage in ("another program's", "cut off", "damaged pages"):
        with suppress(OutboxError):  # said once; the next call makes it again
            after.entries()
    told = {entry.key: entry for entry in after.entries()}
    lost_all = damage in ("format 5", "format 6") and remedy != "nothing"
    if lost_all:  # those formats had no descriptions; the copies that were made are in view
        assert {key: entry.state for key, entry in told.items()} == {
            one.key: State.HELD for name, one in made.items() if name != "Staged"
        }
        assert all("Save a copy and commit it again" in entry.reason for entry in told.values())
        return
    assert told == before
    after.retry(told[held.key].id)
    assert send_all(after, silo).held == []
    assert after.entries() == ()
    for item in silo.search_items():
        if item.name != "Bolt":
            (revision,) = [one for one in silo.revisions(item.part_number) if one.file_name]
            assert revision.comment == f"why {item.name}"
            assert [line.quantity for line in silo.get_bom(item.part_number)] == [
                list(made).index(item.name) + 1
            ]
    after.sweep()
    assert [*after.copies.iterdir()] == []
    # What was there is kept, and nothing comes back with it.
    lose(after)
    assert Store(store.path).entries() == ()


def test_a_description_that_is_lost_with_the_database_is_in_view(store: Store, document: Path) -> None:
    """Two things are damaged at once: its copy is what can be saved, and a person is asked."""
    for number, damage in enumerate((Path.unlink, lambda path: path.write_bytes(b"{half"))):
        entry = store.add(commit(document))
        lose(store)
        damage(store.copies / f"{entry.key}.json")
        (found,) = [one for one in Store(store.path).entries() if one.key == entry.key]
        assert (found.state, "Save a copy" in found.reason, found.file_left) == (State.HELD, True, True)
        kept = [file.read_bytes() for file in store.path.parent.glob("kept-aside/*/*.json")]
        assert kept == [b"{half"] * number
        target = document.with_name(f"saved {number}.FCStd")
        store.save_copy(found.id, target)
        assert target.read_bytes() == b"first"
        store.retry(found.id)  # without an item it cannot be sent, and stays in view
        assert [one.key for one in send_all(store, FakeSilo(), force=True).held] == [entry.key]
        store.discard(found.id)
        assert [*store.copies.iterdir()] == []


@pytest.mark.parametrize("damage", ["nothing", "deleted", "a newer format"])
def test_what_ended_does_not_come_back(store: Store, document: Path, damage: str) -> None:
    """Killed after the mark that a commit has ended, before its row and its copy are gone."""
    entry = store.add(commit(document))
    store._described(entry.key).rename(store.copies / f"{entry.key}.gone")
    DAMAGES.get(damage, lambda _store: None)(store)
    after = Store(store.path)
    assert damage == "nothing" or after.entries() == ()
    after.sweep()
    assert (after.entries(), [*after.copies.iterdir()]) == ((), [])


def test_a_database_that_is_lost_twice_costs_no_commit(store: Store, document: Path) -> None:
    """Its first format had no descriptions; what is read of it has them then."""
    store.add(commit(document))
    of_format(6, described=False)(store)
    before = Store(store.path).entries()
    lose(store)
    assert Store(store.path).entries() == before
    assert [entry.state for entry in before] == [State.WAITING]


def test_commits_of_one_number_are_both_kept_in_their_order(store: Store, document: Path) -> None:
    """Two programs had a database each for a while."""
    for key in ("a", "b", "c"):
        store.add(commit(document, key))
    described = store._described("b")
    described.write_text(json.dumps(json.loads(described.read_text()) | {"id": 1}))
    lose(store)
    assert [entry.key for entry in Store(store.path).entries()] == ["a", "b", "c"]


def test_a_copy_of_a_description_brings_nothing_back(store: Store, document: Path) -> None:
    """It has another name than the commit in it: a person is asked about that name only."""
    entry = store.add(commit(document))
    shutil.copy(store._described(entry.key), store._described("another"))
    store.discard(entry.id)
    store.sweep()
    assert [(one.key, one.state) for one in store.entries()] == [("another", State.HELD)]


def test_a_commit_that_ends_while_the_database_is_made_is_no_lost_one(
    store: Store, document: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another program still has the old file open, and its answer has just arrived."""
    entry = store.add(commit(document))
    lose(store)

    def read(path: Path) -> dict[str, Any]:
        path.rename(path.with_suffix(".gone"))
        return {}

    monkeypatch.setattr("silo.outbox.store.read_memory", read)
    after = Store(store.path)
    assert after.entries() == ()
    after.sweep()
    assert [*after.copies.iterdir()] == [], entry.key


def test_a_commit_that_comes_while_another_program_sweeps_is_kept(
    store: Store, document: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Between its look at the rows and its removal of what has ended."""
    store.add(commit(document))
    other, made = Store(store.path), commit(document)
    forget = Store.forget_aside

    def late(self: Store) -> None:
        if self is store:
            other.add(made)
        forget(self)

    monkeypatch.setattr(Store, "forget_aside", late)
    store.sweep()
    entry = store.by_key(made.key)
    assert entry is not None
    assert (store.copies / entry.copy).read_bytes() == b"first"
    assert store._described(made.key).exists()


def test_a_description_is_its_row(store: Store, document: Path) -> None:
    """After each change: else a rebuilt queue would send what has arrived, or to another server."""
    entry = store.add(commit(document))

    def described() -> Entry | None:
        copy = store.path.with_name("copy")
        shutil.rmtree(copy, ignore_errors=True)
        shutil.copytree(store.copies, copy / "outbox-files")
        return Store(copy / "outbox.sqlite3").by_key(entry.key)

    def sent_without_bom() -> None:
        now = store.entry(entry.id)
        assert now is not None
        store.arrived(now, "file", 4)

    for change in (
        lambda: None,
        lambda: store.update(entry.id, server="http://there", base_revision=3, part_number="A01-0001"),
        sent_without_bom,
        lambda: store.update(entry.id, state=State.HELD, reason="why"),
        lambda: store.retry(entry.id, server="http://elsewhere"),
    ):
        change()
        assert described() == store.by_key(entry.key)


class Moody(Store):
    """A disk that does not answer for a while."""

    error: OSError | None = None

    def _copied(self, source: Path, copy: Path, stamp: str) -> tuple[str, int]:
        if self.error is not None:
            raise self.error
        return super()._copied(source, copy, stamp)

    def verified(self, entry: Any) -> Path:
        if self.error is not None:
            raise self.error
        return super().verified(entry)


@pytest.mark.parametrize("number", [errno.EIO, errno.ENOSPC, errno.EACCES, errno.ESTALE])
def test_a_disk_that_does_not_answer_is_no_damage(tmp_path: Path, document: Path, number: int) -> None:
    """While the copy is made, and while it is sent: the entry stays, says why, and goes later by itself."""
    silo, item = with_item()
    store = Moody(tmp_path / "outbox.sqlite3")
    store.error = OSError(number, os.strerror(number))
    why = why_refused(store.error)
    key = new_key()
    held = store.hold(str(document), key)
    store.add(Commit(str(document), 1.0, identity=item, key=key, file=held))
    send_all(store, silo, force=True)
    (entry,) = store.entries()
    assert (entry.state, why in entry.reason) == (
        State.KEEPING,
        True,
    )
    store.error = None
    store.finish(key)
    store.error = OSError(number, os.strerror(number))
    report = send_all(store, silo, force=True)
    (entry,) = report.failed
    assert (entry.state, why in entry.reason) == (
        State.WAITING,
        True,
    )
    store.error = None
    send_all(store, silo, force=True)
    assert (store.entries(), silo.revisions("A01-0001")[0].file_name) == ((), "Top.FCStd")


def test_without_a_second_name_the_disk_is_synced_at_once(tmp_path: Path, document: Path) -> None:
    """Nothing is kept half, and the person still has the document open."""
    store = Moody(tmp_path / "outbox.sqlite3")
    store.error = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    with pytest.raises(DocumentError, match=r"the disk is full.*nothing was kept, commit it again"):
        store.add(commit(document))
    assert store.entries() == ()


class Stuck(Moody):
    """A disk that takes no change of a row either."""

    def discard(self, entry_id: int, *, keep: bool = False) -> None:
        if self.error is not None:
            raise OutboxError("the outbox cannot be used now (database or disk is full)")
        super().discard(entry_id, keep=keep)


def test_what_is_lost_is_reported_as_lost_also_where_its_row_cannot_go(
    tmp_path: Path, document: Path
) -> None:
    """An OutboxError would be taken for a commit that is kept. The row that stays says what to do."""
    store = Stuck(tmp_path / "outbox.sqlite3")
    store.error = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    with pytest.raises(DocumentError, match=r"the disk is full.*nothing was kept, commit it again"):
        store.add(commit(document))
    store.error = None
    send_all(store, FakeSilo())
    (left,) = store.entries()
    assert (left.state, left.reason) == (
        State.HELD,
        "its file was not copied in time; commit it again, then discard this",
    )


@pytest.mark.parametrize("content", [b"", b"fir", b"first and more"])
def test_a_damaged_copy_is_not_sent(store: Store, document: Path, content: bytes) -> None:
    """Cut short by a power cut or a full disk; a person sees it and can save what there is."""
    silo, item = with_item()
    entry = store.add(Commit(str(document), 1.0, identity=item, file=document))
    (store.copies / entry.copy).write_bytes(content)
    send_all(store, silo)
    (after,) = store.entries()
    assert (after.state, "damaged" in after.reason) == (State.HELD, True)
    assert silo.revisions("A01-0001") == []
    target = document.with_name("rescued.FCStd")
    store.save_copy(after.id, target)
    assert target.read_bytes() == content


def test_a_bom_that_cannot_be_parsed_is_held(store: Store, document: Path) -> None:
    """The file goes anyway."""
    silo, item = with_item()
    entry = store.add(Commit(str(document), 1.0, identity=item, request='{"entries": 5}'))
    store.update(entry.id, request="{half")
    send_all(store, silo)
    (after,) = store.entries()
    assert (after.state, "cannot be read any more" in after.reason) == (State.HELD, True)


def test_a_second_name_for_which_no_commit_came_is_swept_up_later(store: Store, document: Path) -> None:
    """Never one for which it may just be coming."""
    key = new_key()
    held = store.hold(str(document), key)
    assert held is not None
    store.sweep()
    assert held.exists()
    later = Store(store.path, clock=lambda: held.parent.stat().st_mtime + 7200)
    later.sweep()
    assert not held.exists()
    assert document.exists()


def test_a_path_in_a_commit_leads_nowhere_else(store: Store, document: Path, tmp_path: Path) -> None:
    """A document's name is not where its copy goes."""
    outside = tmp_path / "outside"
    outside.write_bytes(b"mine")
    entry = store.add(Commit("../../outside", 1.0, "Top", "top-id", file=document))
    assert (store.copies / entry.copy).parent == store.copies
    assert outside.read_bytes() == b"mine"


def test_a_folder_that_does_not_take_it_is_reported(tmp_path: Path, document: Path) -> None:
    """With what to do, and nothing half done."""
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    with pytest.raises(InputError, match=r"cannot be written .*Nothing was kept"):
        Store(blocked / "outbox.sqlite3").add(commit(document))


def test_a_full_disk_under_the_database_loses_nothing(store: Store, document: Path) -> None:
    """The error is not the entry's: it is neither held nor forgotten."""
    silo, item = with_item()
    store.add(Commit(str(document), 1.0, identity=item, file=document))

    class Full(Store):
        def update(self, entry_id: int, **values: Any) -> None:
            raise OutboxError("the outbox cannot be used now (database or disk is full)")

    with pytest.raises(OutboxError, match="disk is full"):
        send_all(Full(store.path), silo)
    assert [entry.state for entry in store.entries()] == [State.WAITING]
    send_all(store, silo)
    assert (store.entries(), len(silo.revisions("A01-0001"))) == ((), 1)


@pytest.mark.usefixtures("needs_modes")
def test_commits_are_private(store: Store, document: Path) -> None:
    """Database, its companions, copies, folder: they hold other people's documents."""
    store.entries()
    with closing(sqlite3.connect(store.path)) as reader:
        reader.execute("SELECT * FROM entry").fetchall()
        store.add(commit(document))
        found = [path for path in store.path.parent.glob("outbox*") if path.is_file()]
        assert {path.name for path in found} >= {"outbox.sqlite3", "outbox.sqlite3-wal", "outbox.lock"}
        for path in (*found, store.copies, *store.copies.iterdir()):
            assert stat.S_IMODE(path.stat().st_mode) & 0o077 == 0, path


def test_copies_of_replaced_files_are_kept_for_ninety_days(tmp_path: Path) -> None:
    """Then whole days go; what is no folder of ours stays."""
    file, now = tmp_path / "a.FCStd", [time.time()]
    file.write_bytes(b"mine")
    store = Store(tmp_path / "data" / "outbox.sqlite3", clock=lambda: now[0])
    kept = store.keep_aside(str(file))
    assert kept is not None
    others = kept.parent.parent / "2001-01-01 by a person"
    others.mkdir()
    # Whatever its name, what was put there of late is not old.
    restored = kept.parent.parent / "2001-01-01"
    restored.mkdir()
    for days, is_kept in ((0, True), (89, True), (92, True), (92, False)):
        now[0] = time.time() + days * 86400.0
        store.sweep()
        assert (kept.exists(), restored.exists(), others.exists()) == (is_kept, is_kept, True)
        if days == 92:
            # The newest days stay: the clock may be months ahead.
            for day in ("2999-01-01", "2999-01-02", "2999-01-03"):
                (kept.parent.parent / day).mkdir(exist_ok=True)


def test_what_is_written_after_the_commit_is_no_part_of_it(store: Store, document: Path) -> None:
    """Without a second name (another disk) the document itself is copied, in its own time: not a later save
    of it, and not a colleague's file that has come into its place."""
    for name, write in (("saved", Path.write_bytes), ("replaced", replaced)):
        made = replace(commit(document), stamp=stamp_of(document))
        store.stage(made)
        write(document, f"{name} later".encode())
        with pytest.raises(DocumentError, match=r"written again since the commit.*commit it again"):
            store.finish(made.key, document)
        assert store.entries() == ()
        store.sweep()
        assert list(store.copies.iterdir()) == []
    entry = store.add(replace(commit(document), stamp=stamp_of(document)))
    assert entry.sha256 == hashlib.sha256(b"replaced later").hexdigest()


def replaced(path: Path, content: bytes) -> None:
    part = path.with_suffix(".part")
    part.write_bytes(content)
    part.replace(path)


def test_several_programs_may_make_the_outbox_at_once(tmp_path: Path) -> None:
    """Two FreeCADs that commit for the first time in the same moment."""
    path, start = tmp_path / "outbox.sqlite3", threading.Barrier(8)

    def first(number: int) -> None:
        start.wait()
        Store(path).stage(Commit("", float(number), part_number="A", request="{}"))

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(first, range(8)))
    assert len(Store(path).entries()) == 8


def test_a_second_name_that_is_written_to_in_place_is_no_commit(store: Store, document: Path) -> None:
    """``cp`` over the project's file writes into the content that the second name keeps."""
    made = commit(document)
    held = store.hold(str(document), made.key)
    store.stage(replace(made, file=held, stamp=stamp_of(document)))
    document.write_bytes(b"a colleague's, by cp")
    died(store)
    again = Store(store.path)
    assert again.finish(made.key) == ""
    (entry,) = again.entries()
    assert (entry.state, entry.sha256) == (State.HELD, "")
    assert "was written again since the commit; commit it again" in entry.reason
    again.retry(entry.id)
    assert send_all(again, FakeSilo()).sent == []
    assert [one.state for one in again.entries()] == [State.HELD]


@pytest.mark.parametrize("written", ["{}", "sha256:{}"])
def test_a_revision_that_a_person_saw_is_known_however_its_checksum_is_written(written: str) -> None:
    checksum = written.format("AB" * 32)
    theirs = Revision(revision_number=2, file_name="A.FCStd", file_checksum=checksum)
    assert standing([theirs], "", seen=seen_as(2, checksum)).newer is None
    assert standing([theirs], "", seen=seen_as(2, "cd" * 32)).newer


def test_a_folder_that_takes_nothing_is_listed_truthfully(
    tmp_path: Path, document: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What waits is seen, also what no checkpoint has brought into the database yet; nothing is written."""
    store = Store(tmp_path / "data" / "outbox.sqlite3")
    first = store.add(Commit(str(document), 1.0, label="first", file=document))
    with closing(sqlite3.connect(store.path)) as reader:
        reader.execute("SELECT * FROM entry").fetchall()  # keeps the log of changes from being folded in
        second = store.add(Commit(str(document), 2.0, label="second", file=document))
        store.set_pause("http://silo", Pause(10.0, "busy", "busy", 1, told=True))
        before = {path: path.read_bytes() for path in store.path.parent.rglob("*") if path.is_file()}

        def closed(path: Path) -> None:
            raise OSError(errno.EROFS, os.strerror(errno.EROFS), str(path))

        monkeypatch.setattr("silo.outbox.store.private_file", closed)
        looked = Store(store.path)
        assert [one.key for one in looked.entries()] == [first.key, second.key]
        assert (looked.pause("http://silo") or Pause(0.0, "")).reason == "busy"
        assert "2 commits in " in looked.closed
        for write in (
            lambda: looked.sweep(),
            lambda: looked.discard(first.id),
            lambda: looked.stage(commit(document)),
        ):
            with pytest.raises(
                OutboxError,
                match=r"cannot be written \(the disk is read-only.*2 commits in .* cannot be sent",
            ):
                write()
    descriptions = {path: path.read_bytes() for path in store.copies.iterdir()}
    assert descriptions == {path: before[path] for path in descriptions}
    store.path.write_bytes(b"damaged")
    with pytest.raises(OutboxError, match="2 commits in "):
        Store(store.path).entries()


def test_an_older_entry_that_arrives_late_undoes_nothing(store: Store, document: Path) -> None:
    """What is newer than an arrived one stays newer, in whatever order people let them go."""
    first, second, third = (store.add(commit(document)) for _ in range(3))
    store.arrived(third, "file")
    store.arrived(first, "file")
    assert [entry.superseded for entry in store.entries() if entry.id == second.id] == [True]
    bom = replace(first, id=first.id, file_left=False)
    store.arrived(bom, "bom")
    fourth = store.add(commit(document))
    assert (store.by_key(fourth.key) or fourth).superseded is False


def test_a_disk_error_of_one_entry_stops_no_other(tmp_path: Path, document: Path) -> None:
    """It waits with its reason; the next one is sent."""
    silo = FakeSilo()
    other = document.with_name("Other.FCStd")
    other.write_bytes(b"other")
    numbers = [silo.create_item("kindred-rd", "M01", name).part_number for name in ("Top", "Other")]

    class OneBad(Store):
        def verified(self, entry: Entry) -> Path:
            if entry.part_number == numbers[0]:
                raise OSError(errno.EIO, os.strerror(errno.EIO))
            return super().verified(entry)

    store = OneBad(tmp_path / "outbox.sqlite3")
    for path, number in zip((document, other), numbers, strict=True):
        store.add(Commit(str(path), 1.0, part_number=number, file=path))
    report = send_all(store, silo)
    assert ([sent.part_number for sent in report.sent], report.stopped_by) == ([numbers[1]], None)
    (left,) = store.entries()
    assert (left.part_number, left.state, "the disk reports a fault" in left.reason) == (
        numbers[0],
        State.WAITING,
        True,
    )
    assert store.pause(silo.base_url) is None


def test_what_a_file_was_made_from(store: Store, document: Path) -> None:
    """What FreeCAD saved it from, the nearest first; then what waits, its record, and the file itself."""
    store.derived("same", "same")
    assert store.origins("same", str(document), "ID") == ("same",)
    for content, before in (("b", "a"), ("c", "b"), ("d", "c"), ("a", "d")):  # saved in a ring, by an undo
        store.derived(content, before)
    assert store.lineage("d") == ["c", "b", "a"]
    store.learn("http://silo", "b", "ID", 2)
    assert store.origins("d", str(document), "ID") == ("b", "a", "d")
    entry = store.add(replace(commit(document), identity="ID"))
    assert store.origins("other", str(document), "ID") == (entry.sha256, "other")
    assert store.origins("other", str(document), "another") == ("other",)
    write_record(str(document), FileRecord("ID", "pulled", since=entry.taken_at + 1))
    assert store.origins("other", str(document), "ID") == ("pulled", "other")
    assert store.origins("pulled", str(document), "ID") == ("pulled",)
    store.derived("stale", "read before")
    store.replaced("stale")
    assert store.origins("stale", str(document), "ID") == ("read before", "stale")  # its record says nothing
    write_record(str(document), None)
    store.discard(entry.id)
    assert store.origins("other", str(document), "ID") == ("other",)


def numbered_by_name(path: Path | str | int) -> tuple[int, int, int] | None:
    """As a disk that gives each name of a file a number of its own."""
    name = os.readlink(f"/proc/self/fd/{path}") if isinstance(path, int) else str(path)
    found = stamp_of(path)
    return found and (*found[:2], found[2] + ("-held" in name))


@pytest.mark.skipif(not os.path.isdir("/proc/self/fd"), reason="the name of an open file is known on Linux")
def test_a_second_name_with_another_number_is_no_other_file(
    store: Store, document: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same without FUSE: the file is copied to the promise, and not refused as written since."""
    monkeypatch.setattr("silo.outbox.store.stamp_of", numbered_by_name)
    key, stamp = new_key(), numbered_by_name(document)
    held = store.hold(str(document), key)
    document.write_bytes(b"second")
    entry = store.add(replace(commit(document, key, held), stamp=stamp))
    assert (entry.state, (store.copies / entry.copy).read_bytes()) == (State.WAITING, b"first")


class Overtaken(Store):
    """Another program makes the copy in the moment before this one."""

    def _copied(self, source: Path, copy: Path, stamp: str) -> tuple[str, int]:
        Store(self.path).finish(copy.stem)
        return super()._copied(source, copy, stamp)


def test_a_copy_that_another_program_makes_meanwhile_is_no_trouble(store: Store, document: Path) -> None:
    """Its second name is gone then, and nothing is said of a disk."""
    key = new_key()
    held = store.hold(str(document), key)
    sha256 = Overtaken(store.path).add(commit(document, key, held)).sha256
    (entry,) = store.entries()
    assert (entry.state, entry.reason, entry.sha256) == (State.WAITING, "", sha256)
    assert sha256 == hashlib.sha256(b"first").hexdigest()


@pytest.mark.parametrize("name", ["part.json", "part.gone", "part.JSON", ".json"])
def test_a_file_that_is_called_like_a_description_is_a_file(store: Store, document: Path, name: str) -> None:
    """Its copy neither replaces the description nor ends the commit, also if the database is lost."""
    path = document.with_name(name)
    path.write_bytes(b"{}")
    entry = store.add(commit(path))
    lose(store)
    again = Store(store.path)
    again.sweep()
    (found,) = again.entries()
    assert (found.key, found.state, found.file_name) == (entry.key, State.WAITING, name)
    assert again.verified(found).read_bytes() == b"{}"


# -- a disk without hard links ---------------------------------------------------------------------


@pytest.fixture(name="no_links", params=[errno.EPERM, errno.EXDEV, errno.ENOTSUP, errno.EMLINK])
def _no_links(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """exFAT, another disk, a share, too many names."""

    def refuse(source: object, target: object, **_: object) -> None:
        raise OSError(request.param, os.strerror(request.param), source)

    monkeypatch.setattr(os, "link", refuse)


@pytest.mark.usefixtures("no_links")
def test_without_hard_links_a_quick_second_save_drops_nothing(store: Store, document: Path) -> None:
    """Each commit has the content that it was made of, written in place or by a new file."""
    keys, contents = [new_key(), new_key()], (b"first", b"second")
    helds = []
    for key, content in zip(keys, contents, strict=True):
        document.write_bytes(content)
        helds.append(store.hold(str(document), key))
        store.stage(replace(commit(document, key, helds[-1]), stamp=stamp_of(document)))
    document.write_bytes(b"third")
    for key, held in zip(keys, helds, strict=True):
        store.finish(key, held)
    assert [(store.copies / entry.copy).read_bytes() for entry in store.entries()] == [*contents]
    assert [entry.state for entry in store.entries()] == [State.WAITING] * 2
    assert not [path for path in store.path.parent.glob("*-held/*/*") if path.is_file()]


@pytest.mark.usefixtures("no_links")
@pytest.mark.parametrize("promised", [True, False], ids=["with a copy", "with the document alone"])
def test_without_hard_links_a_second_freecad_leaves_the_commit_of_the_first(
    store: Store, document: Path, promised: bool
) -> None:
    """It sees that the first one is about to copy; or it copies what was promised itself."""
    silo, key = FakeSilo(), new_key()
    held = store.hold(str(document), key) if promised else None
    store.stage(commit(document, key, held))
    second = Store(store.path)
    send_all(second, silo)
    (entry,) = second.entries()
    assert (entry.state is State.HELD, "not copied in time" in entry.reason) == (False, False)
    store.finish(key, held or document)
    (entry,) = second.entries()
    assert (entry.state, (second.copies / entry.copy).read_bytes()) == (State.WAITING, b"first")


@pytest.mark.usefixtures("no_links")
def test_a_promise_that_was_cut_off_is_no_content(store: Store, document: Path) -> None:
    """Killed while the disk was copying: half a file is never sent."""
    key = new_key()
    held = store.hold(str(document), key)
    assert held is not None
    half = held.with_name(f".{held.name}.x.part")
    held.rename(half)
    store.stage(commit(document, key, held))
    died(store)
    after = Store(store.path)
    send_all(after, FakeSilo())
    (entry,) = after.entries()
    assert (entry.state, entry.sha256) == (State.HELD, "")
