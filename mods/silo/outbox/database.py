# SPDX-License-Identifier: LGPL-2.1-or-later
"""The outbox's SQLite file: its tables, its transactions, its lock, and how an older one becomes today's.

Every transaction is on disk when it returns. Methods open the file for themselves, so any thread and
process may call them. Standard library only.
"""

from __future__ import annotations

import sqlite3
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from silo.bom.errors import InputError
from silo.durable import private_file, sync_folder

VERSION = 3

_TABLES = """
CREATE TABLE entry (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    key TEXT NOT NULL UNIQUE,
    server TEXT NOT NULL DEFAULT '',
    state TEXT NOT NULL CHECK (state IN ('keeping', 'waiting', 'held')),
    path TEXT NOT NULL,
    label TEXT NOT NULL DEFAULT '',
    identity TEXT NOT NULL DEFAULT '',
    part_number TEXT NOT NULL DEFAULT '',
    taken_at REAL NOT NULL,
    comment TEXT NOT NULL DEFAULT '',
    properties TEXT NOT NULL DEFAULT '{}',
    file_left INTEGER NOT NULL DEFAULT 0,
    file_name TEXT NOT NULL DEFAULT '',
    copy TEXT NOT NULL DEFAULT '',
    sha256 TEXT NOT NULL DEFAULT '',
    size INTEGER NOT NULL DEFAULT 0,
    bom_left INTEGER NOT NULL DEFAULT 0,
    allow_missing INTEGER NOT NULL DEFAULT 0,
    remark TEXT NOT NULL DEFAULT '',
    reason TEXT NOT NULL DEFAULT '',
    attempts INTEGER NOT NULL DEFAULT 0,
    next_attempt REAL NOT NULL DEFAULT 0,
    base_revision INTEGER,
    revision INTEGER,
    origin TEXT NOT NULL DEFAULT '',
    on_top_of INTEGER,
    newer TEXT NOT NULL DEFAULT '',        -- JSON; "" where there is none
    place TEXT NOT NULL DEFAULT '',
    links TEXT NOT NULL DEFAULT '',        -- JSON; "" where nobody looked
    renamed TEXT NOT NULL DEFAULT '',      -- '', 'asked', 'same part'
    extraction TEXT NOT NULL DEFAULT '',   -- JSON; "" where there is none
    request TEXT NOT NULL DEFAULT ''       -- JSON; written before it is sent, and then sent again unchanged
);
CREATE TABLE sent (
    server TEXT NOT NULL,
    item TEXT NOT NULL COLLATE NOCASE,     -- a part number or an identity
    kind TEXT NOT NULL CHECK (kind IN ('file', 'bom')),
    entry_id INTEGER NOT NULL,             -- the newest entry that arrived
    PRIMARY KEY (server, item, kind)
);
"""
_ORIGINS = """
CREATE TABLE derived (
    sha256 TEXT PRIMARY KEY,               -- a file that was saved, and not committed
    origin TEXT NOT NULL,                  -- the committed file that it was made from
    at REAL NOT NULL
);
CREATE TABLE known (
    server TEXT NOT NULL,
    sha256 TEXT NOT NULL,
    item TEXT NOT NULL COLLATE NOCASE,     -- its identity
    revision INTEGER NOT NULL,
    PRIMARY KEY (server, sha256, item)
);
"""
_SINCE_2 = """
ALTER TABLE entry ADD COLUMN origin TEXT NOT NULL DEFAULT '';
ALTER TABLE entry ADD COLUMN on_top_of INTEGER;
ALTER TABLE entry ADD COLUMN newer TEXT NOT NULL DEFAULT '';
ALTER TABLE entry ADD COLUMN place TEXT NOT NULL DEFAULT '';
ALTER TABLE entry ADD COLUMN links TEXT NOT NULL DEFAULT '';
"""


class OutboxError(InputError):
    """The database cannot be used now: its disk is full, it is locked, or it is no database."""


class Database:
    """The file, and the folder of copies beside it; made where they are missing, for their owner only."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.copies = path.parent / f"{path.stem}-files"
        self._lock = threading.Lock()
        self._is_ready = False

    @contextmanager
    def transaction(self) -> Iterator[sqlite3.Connection]:
        """All or nothing, on disk when it returns."""
        with self._open() as db, _transaction(db):
            yield db

    @contextmanager
    def send_lock(self) -> Iterator[bool]:
        """True for the one process and thread that may send now.

        A transaction on a database of its own: the system ends it with the process, however that dies.
        """
        self._make_ready()
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
        self._make_ready()
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
            raise OutboxError(
                f"{self.path}: the outbox cannot be used now ({error}). What waits in it is still there. "
                "Make room on the disk or mend its permissions; a file that is no database must be moved away"
            ) from error

    def _make_ready(self) -> None:
        """Make folders and file when they are first needed: not where FreeCAD has only just started."""
        with self._lock:
            if not self._is_ready:
                self._prepare()
                self._is_ready = True

    def _prepare(self) -> None:
        try:
            self.copies.mkdir(mode=0o700, parents=True, exist_ok=True)
            # Made for its owner only before SQLite opens it; the -wal and -shm files take over its mode.
            for path in (self.path, self.path.with_suffix(".lock")):
                private_file(path)
            sync_folder(self.path.parent)
        except OSError as error:
            raise InputError(
                f"{self.path}: the outbox cannot be made ({error.strerror or error}). Nothing was kept for "
                "sending; make room or mend the permissions, then commit again"
            ) from error
        self._migrate()

    def _migrate(self) -> None:
        with self._translated(), closing(self._connect(self.path)) as db:
            db.row_factory = sqlite3.Row
            if _version(db) == VERSION:
                return
            if db.execute("PRAGMA journal_mode").fetchone()[0] != "wal":
                db.execute("PRAGMA journal_mode = WAL")
            db.execute("PRAGMA synchronous = FULL")
            with _transaction(db):
                version = _version(db)
                if version > VERSION:
                    raise InputError(
                        f"{self.path}: this outbox was written by a newer silo-mod; update this one"
                    )
                if version == 1:
                    db.execute("ALTER TABLE entry RENAME TO entry1")
                    db.execute("ALTER TABLE sent RENAME TO sent1")
                for statement in _statements(version):
                    db.execute(statement)
                if version == 1:
                    from silo.outbox.takeover import of_first_outbox

                    of_first_outbox(db)
                db.execute(f"PRAGMA user_version = {VERSION}")


@contextmanager
def _transaction(db: sqlite3.Connection) -> Iterator[None]:
    db.execute("BEGIN IMMEDIATE")
    try:
        yield
    except BaseException:
        db.execute("ROLLBACK")
        raise
    db.execute("COMMIT")


def _statements(version: int) -> Iterator[str]:
    """What makes a file of this version (0: a new one) one of today."""
    for part in (_SINCE_2 if version == 2 else _TABLES, _ORIGINS):
        yield from filter(None, map(str.strip, part.split(";\n")))


def insert(db: sqlite3.Connection, row: dict[str, Any]) -> None:
    """Add a row; columns that it does not name have their defaults."""
    names, places = ", ".join(row), ", ".join(f":{name}" for name in row)
    db.execute(f"INSERT INTO entry ({names}) VALUES ({places})", row)  # noqa: S608


def _version(db: sqlite3.Connection) -> int:
    return int(db.execute("PRAGMA user_version").fetchone()[0])
