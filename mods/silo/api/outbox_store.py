# SPDX-License-Identifier: LGPL-2.1-or-later
"""The outbox on disk: one SQLite file, and beside it a folder with the copies of files not yet sent.

The rules of this module:

* a copy is on disk, whole and synced, before its row is; a row is gone before its copy is: whatever is
  interrupted leaves at most a copy that nobody names, which is swept up later;
* every change is one transaction, synced when it returns;
* several processes may share the file; who sends holds the send lock, which ends with its process.
"""

from __future__ import annotations

import hashlib
import json
import os
import sqlite3
import time
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from silo.bom.errors import DocumentError, InputError
from silo.durable import sync_folder

_ORPHAN_AGE = 3600.0
_BLOCK = 1 << 20

# Each script brings the file from its index to the next version; `user_version` says where it is.
_MIGRATIONS = (
    """
    CREATE TABLE entry (
        id INTEGER PRIMARY KEY AUTOINCREMENT,
        key TEXT NOT NULL UNIQUE,          -- idempotency key of a file, sync_id of a BOM
        commit_key TEXT NOT NULL,          -- the same for the file and the BOM of one commit
        kind TEXT NOT NULL CHECK (kind IN ('file', 'bom')),
        server TEXT NOT NULL,
        part_number TEXT NOT NULL,
        taken_at REAL NOT NULL,            -- seconds since 1970, UTC
        payload TEXT NOT NULL,             -- JSON
        state TEXT NOT NULL DEFAULT 'waiting' CHECK (state IN ('waiting', 'rejected')),
        reason TEXT NOT NULL DEFAULT '',
        attempts INTEGER NOT NULL DEFAULT 0,
        next_attempt REAL NOT NULL DEFAULT 0,
        base_revision INTEGER              -- the server's latest revision before the first attempt
    );
    CREATE INDEX entry_by_server ON entry (server, state, id);
    CREATE TABLE sent (
        server TEXT NOT NULL,
        part_number TEXT NOT NULL,
        kind TEXT NOT NULL,
        entry_id INTEGER NOT NULL,         -- the newest entry that arrived
        sent_at REAL NOT NULL,
        PRIMARY KEY (server, part_number, kind)
    );
    """,
)


class Kind(StrEnum):
    """What an entry brings to the server."""

    FILE = "file"  # a new revision of the item's file
    BOM = "bom"  # a merge of the assembly's direct children


class State(StrEnum):
    """How an entry stands."""

    WAITING = "waiting"  # will be sent
    REJECTED = "rejected"  # the server does not want it; a person retries or discards


@dataclass(frozen=True)
class OutboxEntry:
    """One thing that was not sent yet.

    payload
        of a file: ``path``, ``copy``, ``file_name``, ``sha256``, ``size``, ``comment``, ``properties``; of a
        BOM: the merge request of spec §5 with its ``sync_id``.
    taken_at, next_attempt
        seconds since 1970, UTC.
    superseded
        a newer file or BOM of the same item has arrived since, so that this one must not be sent any more.
    """

    id: int
    key: str
    commit_key: str
    kind: Kind
    server: str
    part_number: str
    taken_at: float
    payload: Mapping[str, Any]
    state: State = State.WAITING
    reason: str = ""
    attempts: int = 0
    next_attempt: float = 0.0
    base_revision: int | None = None
    superseded: bool = False


class Store:
    """The file and its folder. Methods open the database for themselves, so any thread may call them."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.copies = path.parent / f"{path.stem}-files"
        self._prepare()

    # -- reading and changing ---------------------------------------------------------------------------

    def insert(self, rows: list[dict[str, Any]]) -> list[int]:
        """Add rows in one transaction; gives their ids."""
        with self.transaction() as db:
            return [
                int(
                    db.execute(
                        "INSERT INTO entry (key, commit_key, kind, server, part_number, taken_at, payload)"
                        " VALUES (:key, :commit_key, :kind, :server, :part_number, :taken_at, :payload)",
                        row,
                    ).lastrowid
                    or 0
                )
                for row in rows
            ]

    def entries(self) -> tuple[OutboxEntry, ...]:
        """All entries, oldest first."""
        with self._open() as db:
            return tuple(_entry(row) for row in db.execute(f"{_SELECT} ORDER BY e.id"))

    def entry(self, entry_id: int) -> OutboxEntry | None:
        """One entry, None where it is gone."""
        with self._open() as db:
            row = db.execute(f"{_SELECT} WHERE e.id = ?", (entry_id,)).fetchone()
        return _entry(row) if row else None

    def next_waiting(self, server: str, after: int) -> OutboxEntry | None:
        """The oldest entry for a server that waits and is newer than ``after``."""
        where = "WHERE e.server = ? AND e.state = 'waiting' AND e.id > ? ORDER BY e.id LIMIT 1"
        with self._open() as db:
            row = db.execute(f"{_SELECT} {where}", (server, after)).fetchone()
        return _entry(row) if row else None

    def update(self, entry_id: int, **values: Any) -> None:
        """Set columns of an entry."""
        columns = ", ".join(f"{name} = :{name}" for name in values)
        with self.transaction() as db:
            db.execute(f"UPDATE entry SET {columns} WHERE id = :id", {**values, "id": entry_id})  # noqa: S608

    def remove(self, entry: OutboxEntry) -> None:
        """Forget an entry, then its copy."""
        with self.transaction() as db:
            db.execute("DELETE FROM entry WHERE id = ?", (entry.id,))
        self.drop_copy(entry)

    def arrived(self, entry: OutboxEntry, now: float, revision: int | None = None) -> None:
        """The server has it: forget it, note that it arrived, and tell the commit's BOM its file revision."""
        with self.transaction() as db:
            db.execute("DELETE FROM entry WHERE id = ?", (entry.id,))
            db.execute(
                "INSERT INTO sent VALUES (?, ?, ?, ?, ?) ON CONFLICT (server, part_number, kind)"
                " DO UPDATE SET entry_id = max(entry_id, excluded.entry_id), sent_at = excluded.sent_at",
                (entry.server, entry.part_number, entry.kind, entry.id, now),
            )
            if revision is not None:
                _name_revision(db, entry.commit_key, revision)
        self.drop_copy(entry)

    # -- copies -----------------------------------------------------------------------------------------

    def copy_in(self, source: Path, name: str) -> tuple[str, int]:
        """Copy a file to be sent, synced; gives its SHA-256 and size. The original may change afterwards."""
        digest, size = hashlib.sha256(), 0
        target = self.copies / name
        partial = target.with_name(f"{name}.part")
        try:
            with source.open("rb") as read, _private(partial) as write:
                while block := read.read(_BLOCK):
                    digest.update(block)
                    size += len(block)
                    write.write(block)
                write.flush()
                os.fsync(write.fileno())
            os.replace(partial, target)
            sync_folder(self.copies)
        except OSError as error:
            partial.unlink(missing_ok=True)
            raise DocumentError(
                str(source), f"cannot be kept for sending ({error.strerror or error}); nothing was put aside"
            ) from error
        return digest.hexdigest(), size

    def drop_copy(self, entry: OutboxEntry) -> None:
        """Remove an entry's copy; one that cannot be removed now is swept up later."""
        name = entry.payload.get("copy")
        if entry.kind is Kind.FILE and isinstance(name, str):
            try:
                (self.copies / name).unlink(missing_ok=True)
            except OSError:
                return

    def sweep(self) -> None:
        """Remove copies that no entry names and that no other process can be about to name."""
        named = {entry.payload.get("copy") for entry in self.entries()}
        for file in self.copies.glob("*"):
            try:
                if file.name not in named and time.time() - file.stat().st_mtime > _ORPHAN_AGE:
                    file.unlink()
            except OSError:
                continue

    # -- the database -----------------------------------------------------------------------------------

    @contextmanager
    def transaction(self) -> Iterator[sqlite3.Connection]:
        """All or nothing, on disk when it returns."""
        with self._open() as db:
            db.execute("BEGIN IMMEDIATE")
            try:
                yield db
            except BaseException:
                db.execute("ROLLBACK")
                raise
            db.execute("COMMIT")

    @contextmanager
    def send_lock(self) -> Iterator[bool]:
        """True for the one process and thread that may send now.

        A transaction on a database of its own: the system ends it with the process, however that dies.
        """
        with self._translated(), closing(self._connect(self.path.with_suffix(".lock"), timeout=0)) as db:
            try:
                db.execute("BEGIN EXCLUSIVE")
            except sqlite3.OperationalError as error:
                if "locked" not in str(error):
                    raise
                yield False
                return
            yield True

    @contextmanager
    def _open(self) -> Iterator[sqlite3.Connection]:
        with self._translated(), closing(self._connect(self.path)) as db:
            db.row_factory = sqlite3.Row
            db.execute("PRAGMA synchronous = FULL")
            yield db

    def _connect(self, path: Path, timeout: float = 20.0) -> sqlite3.Connection:
        return sqlite3.connect(path, timeout=timeout, isolation_level=None)

    @contextmanager
    def _translated(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            raise InputError(
                f"{self.path}: the outbox cannot be used ({error}). What waits in it is still there; "
                "mend the file or the disk, or move the file away to begin a new one"
            ) from error

    def _prepare(self) -> None:
        try:
            self.copies.mkdir(mode=0o700, parents=True, exist_ok=True)
            # Made for its owner only before SQLite opens it; the -wal and -shm files take over its mode.
            for path in (self.path, self.path.with_suffix(".lock")):
                os.close(os.open(path, os.O_RDWR | os.O_CREAT, 0o600))
                path.chmod(0o600)
        except OSError as error:
            raise InputError(f"{self.path}: the outbox cannot be made ({error.strerror or error})") from error
        self._migrate()

    def _migrate(self) -> None:
        with self._open() as db:
            if _version(db) == len(_MIGRATIONS):
                return
            if db.execute("PRAGMA journal_mode").fetchone()[0] != "wal":
                db.execute("PRAGMA journal_mode = WAL")
        with self.transaction() as db:
            version = _version(db)
            if version > len(_MIGRATIONS):
                raise InputError(f"{self.path}: this outbox was written by a newer silo-mod; update this one")
            for script in _MIGRATIONS[version:]:
                for statement in script.split(";\n"):
                    db.execute(statement)
            db.execute(f"PRAGMA user_version = {len(_MIGRATIONS)}")


_SELECT = """SELECT e.*, EXISTS (
    SELECT 1 FROM sent s WHERE s.server = e.server AND s.part_number = e.part_number COLLATE NOCASE
    AND s.kind = e.kind AND s.entry_id > e.id) AS superseded FROM entry e"""


def _entry(row: sqlite3.Row) -> OutboxEntry:
    values = dict(row)
    values["kind"], values["state"] = Kind(values["kind"]), State(values["state"])
    values["superseded"] = bool(values["superseded"])
    values["payload"] = json.loads(values["payload"])
    return OutboxEntry(**values)


def _name_revision(db: sqlite3.Connection, commit_key: str, revision: int) -> None:
    # A BOM taken offline could not know which revision its file would become.
    rows = db.execute("SELECT id, payload FROM entry WHERE commit_key = ? AND kind = 'bom'", (commit_key,))
    for row in rows.fetchall():
        payload = json.loads(row["payload"])
        if isinstance(payload.get("document"), dict) and payload["document"].get("revision") is None:
            payload["document"]["revision"] = revision
            db.execute("UPDATE entry SET payload = ? WHERE id = ?", (json.dumps(payload), row["id"]))


def _version(db: sqlite3.Connection) -> int:
    return int(db.execute("PRAGMA user_version").fetchone()[0])


@contextmanager
def _private(path: Path) -> Iterator[Any]:
    handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | getattr(os, "O_BINARY", 0), 0o600)
    with os.fdopen(handle, "wb") as file:
        yield file
