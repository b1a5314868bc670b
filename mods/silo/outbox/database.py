# SPDX-License-Identifier: LGPL-2.1-or-later
"""The outbox's SQLite file: its tables, its transactions, its lock, and what is remembered of files.

Every transaction is on disk when it returns. Methods open the file for themselves, so any thread and
process may call them. Standard library only.
"""

from __future__ import annotations

import os
import shutil
import sqlite3
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path

from silo.api.address import canonical
from silo.bom.errors import DocumentError, InputError
from silo.durable import private_file, sync_folder

VERSION = 6
# What a saved file was made from is forgotten after two years.
_REMEMBERED = 2 * 366 * 86400.0
# A copy of a file that was replaced is kept for so long, or until a person deletes it.
KEPT_ASIDE_DAYS = 90
_NEWEST_DAYS = 3

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
    file_left INTEGER NOT NULL DEFAULT 0,
    file_name TEXT NOT NULL DEFAULT '',
    copy TEXT NOT NULL DEFAULT '',
    sha256 TEXT NOT NULL DEFAULT '',
    size INTEGER NOT NULL DEFAULT 0,
    stamp TEXT NOT NULL DEFAULT '',        -- JSON; of the file at the commit
    bom_left INTEGER NOT NULL DEFAULT 0,
    allow_missing INTEGER NOT NULL DEFAULT 0,
    remark TEXT NOT NULL DEFAULT '',
    reason TEXT NOT NULL DEFAULT '',
    attempts INTEGER NOT NULL DEFAULT 0,
    next_attempt REAL NOT NULL DEFAULT 0,
    base_revision INTEGER,
    revision INTEGER,
    origin TEXT NOT NULL DEFAULT '',
    on_top_of TEXT NOT NULL DEFAULT '',    -- number and SHA-256
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


class OutboxError(InputError):
    """The database cannot be used now: its disk is full, it is locked, or it is no database."""


class Database:
    """The file, and the folder of copies beside it; made where they are missing, for their owner only."""

    def __init__(self, path: Path, clock: Callable[[], float] = time.time) -> None:
        self.path = path
        self.clock = clock
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
        self._make_tables()

    def _make_tables(self) -> None:
        with self._translated(), closing(self._connect(self.path)) as db:
            db.row_factory = sqlite3.Row
            if db.execute("PRAGMA journal_mode").fetchone()[0] != "wal":
                # SQLite does not wait for others here. Where another is at it, the next start finds it done.
                with suppress(sqlite3.OperationalError):
                    db.execute("PRAGMA journal_mode = WAL")
            if _version(db) == VERSION:
                return
            db.execute("PRAGMA synchronous = FULL")
            with _transaction(db):
                version = _version(db)
                if version == VERSION:  # another process was quicker
                    return
                if version:
                    raise InputError(
                        f"{self.path}: another version of silo-mod wrote this outbox (format {version}, "
                        f"wanted {VERSION}). It may hold commits that are not in Silo yet: send them with "
                        "that version, or move the file away"
                    )
                for statement in filter(None, map(str.strip, _TABLES.split(";\n"))):
                    db.execute(statement)
                db.execute(f"PRAGMA user_version = {VERSION}")


class Origins(Database):
    """What files were made from, as far as it is known here."""

    def origin_of(self, sha256: str) -> str:
        """SHA-256 of the committed file that a file with this content was made from, as far as is known here;
        the content itself where it was never saved over.

        A file that was saved first and committed then is a committed one itself, also while it waits.
        """
        with self._open() as db:
            row = db.execute(
                "SELECT origin FROM derived WHERE sha256 = :sha256"
                " AND NOT EXISTS (SELECT 1 FROM known WHERE sha256 = :sha256)"
                " AND NOT EXISTS (SELECT 1 FROM entry WHERE sha256 = :sha256)",
                {"sha256": sha256},
            ).fetchone()
        return str(row[0]) if row else sha256

    def derived(self, sha256: str, origin: str) -> None:
        """A file was saved without being committed; it was made from ``origin``."""
        if not sha256 or sha256 == origin:
            return
        with self.transaction() as db:
            db.execute("INSERT OR REPLACE INTO derived VALUES (?, ?, ?)", (sha256, origin, self.clock()))
            db.execute("DELETE FROM derived WHERE at < ?", (self.clock() - _REMEMBERED,))

    def known_revision(self, server: str, sha256: str, item: str) -> int | None:
        """The revision that a file is, for servers that keep no checksums; None where that is not known."""
        with self._open() as db:
            row = db.execute(
                "SELECT revision FROM known WHERE server = ? AND sha256 = ? AND item = ?",
                (canonical(server), sha256, item),
            ).fetchone()
        return int(row[0]) if row else None

    def learn(self, server: str, sha256: str, item: str, revision: int) -> None:
        """This file is that revision of an item."""
        if not (sha256 and item):
            return
        with self.transaction() as db:
            row = (canonical(server), sha256, item, revision)
            db.execute("INSERT OR REPLACE INTO known VALUES (?, ?, ?, ?)", row)

    def aside(self, path: str) -> Path:
        """A new place for a copy of a file; its folder is there. DocumentError where it cannot be made."""
        folder = self._kept_aside / time.strftime("%Y-%m-%d")
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        except OSError as error:
            raise DocumentError(str(folder), f"cannot be made ({error.strerror or error})") from error
        return folder / f"{time.strftime('%H%M%S')}-{time.monotonic_ns() % 10**6}-{os.path.basename(path)}"

    @property
    def _kept_aside(self) -> Path:
        return self.path.parent / "kept-aside"

    def forget_aside(self) -> None:
        """Remove the copies of the days that are over :data:`KEPT_ASIDE_DAYS` ago; nothing else in there.

        The newest days that have copies stay: the clock may be months ahead.
        """
        limit = self.clock() - KEPT_ASIDE_DAYS * 86400.0
        oldest = time.strftime("%Y-%m-%d", time.localtime(limit))
        days = sorted(self._kept_aside.glob("[0-9][0-9][0-9][0-9]-[0-9][0-9]-[0-9][0-9]"))
        for folder in days[:-_NEWEST_DAYS]:
            with suppress(OSError):
                if folder.name < oldest and folder.stat().st_mtime < limit and not folder.is_symlink():
                    shutil.rmtree(folder, ignore_errors=True)

    def keep_aside(self, path: str) -> Path | None:
        """Keep a copy of a file that is about to be replaced; where it is, None where there is no file.

        Raises DocumentError where the disk does not take it.
        """
        target = self.aside(path)
        try:
            shutil.copy2(path, target)
        except FileNotFoundError:
            return None
        except OSError as error:
            told = f"no copy of it could be kept ({error.strerror or error}); it was not replaced"
            raise DocumentError(path, told) from error
        return target


@contextmanager
def _transaction(db: sqlite3.Connection) -> Iterator[None]:
    db.execute("BEGIN IMMEDIATE")
    try:
        yield
    except BaseException:
        db.execute("ROLLBACK")
        raise
    db.execute("COMMIT")


def _version(db: sqlite3.Connection) -> int:
    return int(db.execute("PRAGMA user_version").fetchone()[0])
