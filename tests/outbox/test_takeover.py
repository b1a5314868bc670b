# SPDX-License-Identifier: LGPL-2.1-or-later
"""What older versions left waiting is sent by this one, once."""

from __future__ import annotations

import json
import sqlite3
from pathlib import Path
from typing import Any

import pytest

from silo.bom.model import BomEntry, Extraction
from silo.bom.snapshot import to_plain
from silo.outbox.entry import State
from silo.outbox.send import send_all
from silo.outbox.store import Store
from silo.outbox.takeover import of_commit_folder
from silo.testing import FakeSilo

# As the version before wrote it.
FIRST_OUTBOX = """
CREATE TABLE entry (
    id INTEGER PRIMARY KEY AUTOINCREMENT, key TEXT NOT NULL UNIQUE, commit_key TEXT NOT NULL,
    kind TEXT NOT NULL CHECK (kind IN ('file', 'bom')), server TEXT NOT NULL, part_number TEXT NOT NULL,
    taken_at REAL NOT NULL, payload TEXT NOT NULL,
    state TEXT NOT NULL DEFAULT 'waiting' CHECK (state IN ('waiting', 'rejected')),
    reason TEXT NOT NULL DEFAULT '', attempts INTEGER NOT NULL DEFAULT 0,
    next_attempt REAL NOT NULL DEFAULT 0, base_revision INTEGER
);
CREATE INDEX entry_by_server ON entry (server, state, id);
CREATE TABLE sent (
    server TEXT NOT NULL, part_number TEXT NOT NULL, kind TEXT NOT NULL, entry_id INTEGER NOT NULL,
    sent_at REAL NOT NULL, PRIMARY KEY (server, part_number, kind)
);
PRAGMA user_version = 1;
"""


@pytest.fixture(name="silo")
def _silo() -> FakeSilo:
    made = FakeSilo()
    made.create_item("kindred-rd", "A01", "Top", item_type="assembly")
    made.create_item("kindred-rd", "F01", "Bolt")
    return made


def first_outbox(folder: Path, server: str) -> None:
    """A file and a BOM of one commit, and a BOM that was refused."""
    copy = folder / "outbox-files" / "k1.FCStd"
    copy.parent.mkdir()
    copy.write_bytes(b"content")
    file: dict[str, Any] = {
        "path": "/v/Top.FCStd",
        "copy": "k1.FCStd",
        "file_name": "Top.FCStd",
        "sha256": "ed7002b439e9ac845f22357d822bac1444730fbdb6016d3ec9432297b9ec9f73",
        "size": 7,
        "comment": "first",
        "properties": {},
    }
    bom = {"entries": [{"child_part_number": "F01-0001", "quantity": 2}], "sync_id": "commit-1"}
    bad = {"entries": [{"child_part_number": "none", "quantity": 2}], "sync_id": "commit-0"}
    with sqlite3.connect(folder / "outbox.sqlite3") as db:
        db.executescript(FIRST_OUTBOX)
        rows = (
            (5, "k0", "c0", "bom", json.dumps(bad), "rejected", "unknown part"),
            (7, "k1", "c1", "file", json.dumps(file), "waiting", ""),
            (8, "k2", "c1", "bom", json.dumps(bom), "waiting", ""),
        )
        for number, key, commit, kind, payload, state, reason in rows:
            db.execute(
                "INSERT INTO entry (id, key, commit_key, kind, server, part_number, taken_at, payload, "
                "state, reason)"
                " VALUES (?, ?, ?, ?, ?, 'A01-0001', 9.0, ?, ?, ?)",
                (number, key, commit, kind, server, payload, state, reason),
            )
        db.execute("INSERT INTO sent VALUES (?, 'A01-0001', 'bom', 20, 1.0)", (server,))
    db.close()


def old_commit(
    folder: Path, key: str, *, name: str = "commit.json", identity: str, when: float = 1.0
) -> Path:
    """A commit in the folder of that time."""
    place = folder / "commits" / key
    place.mkdir(parents=True)
    (place / "Top.FCStd").write_bytes(b"content")
    head = BomEntry("/v/Top.FCStd", silo_uuid=identity, is_assembly=True)
    snapshot = {
        "format": 1,
        "path": "/v/Top.FCStd",
        "label": "Top",
        "identity": identity,
        "problem": "",
        "bom": to_plain(Extraction(head)),
    }
    data = {
        "key": key,
        "taken_at": when,
        "comment": "why",
        "file": "Top.FCStd",
        "sha256": "ed7002b439e9ac845f22357d822bac1444730fbdb6016d3ec9432297b9ec9f73",
        "sync_bom": True,
        "allow_missing": False,
        "snapshot": snapshot,
    }
    (place / name).write_text(json.dumps(data))
    return place


def test_the_first_outbox_is_sent(tmp_path: Path, silo: FakeSilo) -> None:
    """File and BOM arrive once; what was refused is still there with its reason, and out of date."""
    first_outbox(tmp_path, silo.base_url)
    store = Store(tmp_path / "outbox.sqlite3")
    assert [(e.id, e.state) for e in store.entries()] == [
        (5, State.HELD),
        (7, State.WAITING),
        (8, State.WAITING),
    ]
    # The older version had sent a BOM with the id 20 to the same server.
    assert [e.superseded for e in store.entries()] == [True, False, True]
    send_all(store, silo)
    (left,) = store.entries()
    assert (left.reason, left.superseded) == ("unknown part", True)
    assert [(r.file_name, r.comment) for r in silo.revisions("A01-0001")] == [("Top.FCStd", "first")]
    assert [line.quantity for line in silo.get_bom("A01-0001")] == [2]


def test_what_comes_next_is_newer_than_all_that_was_sent(tmp_path: Path, silo: FakeSilo) -> None:
    """Or it would look out of date."""
    from silo.outbox.entry import Commit

    first_outbox(tmp_path, silo.base_url)
    store = Store(tmp_path / "outbox.sqlite3")
    assert store.add(Commit("/v/Top.FCStd", 1.0, part_number="A01-0001", request="{}")).id > 20


@pytest.mark.parametrize("name", ["commit.json", "commit.unreadable"])
def test_the_folder_of_commits_is_sent(tmp_path: Path, silo: FakeSilo, name: str) -> None:
    """Also what was set aside because the disk did not answer for a moment."""
    identity = silo.items["a01-0001"].item.id
    for key, when in (("two", 2.0), ("one", 1.0)):
        old_commit(tmp_path, key, name=name, identity=identity, when=when)
    store = Store(tmp_path / "outbox.sqlite3")
    assert of_commit_folder(store, tmp_path / "commits") == ()
    assert [(e.key, e.comment, e.file_name) for e in store.entries()] == [
        ("one", "why", "Top.FCStd"),
        ("two", "why", "Top.FCStd"),
    ]
    assert not (tmp_path / "commits").exists()
    send_all(store, silo)
    assert (store.entries(), len(silo.revisions("A01-0001"))) == ((), 1)


def test_killed_between_row_and_folder(tmp_path: Path, silo: FakeSilo) -> None:
    """The commit is there already: its folder is only rubbish."""
    place = old_commit(tmp_path, "one", identity="x")
    store = Store(tmp_path / "outbox.sqlite3")
    of_commit_folder(store, tmp_path / "commits")
    assert not place.exists()
    old_commit(tmp_path, "one", identity="x")
    of_commit_folder(store, tmp_path / "commits")
    assert len(store.entries()) == 1


def test_what_was_handed_over_already_is_not_taken_twice(tmp_path: Path, silo: FakeSilo) -> None:
    """The older version was killed after the hand-over and before it removed the folder."""
    first_outbox(tmp_path, silo.base_url)
    old_commit(tmp_path, "commit-1", identity="x")  # by the BOM's name
    old_commit(tmp_path, "a part", identity="x", when=9.0)  # by the file's moment
    store = Store(tmp_path / "outbox.sqlite3")
    of_commit_folder(store, tmp_path / "commits")
    assert len(store.entries()) == 3


def test_a_copy_that_was_cut_short_is_held(tmp_path: Path) -> None:
    """The older version never looked at the hash that it had noted."""
    place = old_commit(tmp_path, "one", identity="x")
    (place / "Top.FCStd").write_bytes(b"con")
    store = Store(tmp_path / "outbox.sqlite3")
    of_commit_folder(store, tmp_path / "commits")
    (entry,) = store.entries()
    assert (entry.state, "cut short" in entry.reason) == (State.HELD, True)


@pytest.mark.parametrize("text", ["", "{half", "[]", '{"snapshot": {}}'])
def test_what_cannot_be_parsed_is_held_with_its_file(tmp_path: Path, text: str) -> None:
    """It is shown, and its copy can be saved."""
    place = old_commit(tmp_path, "one", identity="x")
    (place / "commit.json").write_text(text)
    store = Store(tmp_path / "outbox.sqlite3")
    of_commit_folder(store, tmp_path / "commits")
    (entry,) = store.entries()
    assert (entry.state, entry.file_left, "damaged" in entry.reason) == (State.HELD, True, True)
    store.save_copy(entry.id, tmp_path / "saved")
    assert (tmp_path / "saved").read_bytes() == b"content"
    send_all(store, FakeSilo())
    assert len(store.entries()) == 1


def test_what_cannot_be_read_now_stays_and_is_reported(tmp_path: Path) -> None:
    """A disk that does not answer is no damage."""
    place = old_commit(tmp_path, "one", identity="x")
    text = (place / "commit.json").read_text()
    (place / "commit.json").unlink()
    (place / "commit.json").mkdir()  # reading it is an OSError, for root too
    store = Store(tmp_path / "outbox.sqlite3")
    (left,) = of_commit_folder(store, tmp_path / "commits")
    assert left.startswith(str(place))
    assert store.entries() == ()
    (place / "commit.json").rmdir()
    (place / "commit.json").write_text(text)
    assert of_commit_folder(store, tmp_path / "commits") == ()
    assert len(store.entries()) == 1
