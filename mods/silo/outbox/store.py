# SPDX-License-Identifier: LGPL-2.1-or-later
"""The outbox on disk: the copy of each commit's file, its description beside it, and an index of both.

The rules of this module:

* ``KEY.json`` beside the copy describes a commit whole: item, document, hash, base revision, comment, server,
  time. It is written before its row is committed, and a commit ends when it is renamed to ``KEY.gone``;
* the SQLite file is an index. If it is missing, damaged, foreign or of another format it is made again from
  the descriptions, and the old file is kept aside. Nothing that was not sent is deleted here;
* a copy has its name only when it is whole and on disk, and its row the copy's hash;
* several processes may share the folder; who sends, and who still has to copy a file, holds a lock, which
  ends with its process;
* a disk error leaves things as they are. Damage is a hash that differs or a BOM that cannot be parsed.

Every transaction is on disk when it returns. Methods open the file for themselves, so any thread and process
may call them. Standard library only: the first commit of a session must not wait for imports.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import sqlite3
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager, nullcontext, suppress
from dataclasses import fields
from pathlib import Path
from typing import Any, BinaryIO

from silo.api.address import canonical
from silo.api.pause import Pause
from silo.bom.errors import ConflictError, DocumentError, InputError, counted
from silo.bom.message import Message, message
from silo.bom.snapshot import to_plain
from silo.bom.system_refusals import why_refused
from silo.checksums import content_hash
from silo.folder_lock import folder_lock
from silo.outbox.entry import ASKED, SAME_PART, UNKNOWN, Commit, CommitFields, Entry, State, on_top
from silo.outbox.held_here import HeldHere, held_row
from silo.outbox.tables import SELECT, TABLES, VERSION, entry_of
from silo.platform.locks import has_locks, hold_lock_here
from silo.platform.memory_file import read_memory
from silo.platform.spelling import one_path
from silo.platform.stamp import stamp_of
from silo.platform.user_folders import data_folder
from silo.platform.whole_files import (
    private_file,
    remove_patiently,
    replace_patiently,
    replacing,
    scratch_folder,
    sync_folder,
)
from silo.project_folder import FileRecord, record_of

# What a saved file was made from is forgotten after two years.
_REMEMBERED = 2 * 366 * 86400.0
# Saves between two commits that are followed back.
_LONGEST_LINEAGE = 1000
_LOOK_FOR_IT = FileRecord("")
# Stands before the first content of a document that was saved over a file that another program had written.
_OTHER_FILE = message("another file")
# A copy of a file that was replaced is kept for so long, or until the user deletes it.
KEPT_ASIDE_DAYS = 90
_NEWEST_DAYS = 3

_TABLE_NAMES = ("entry", "sent", "pause", "derived", "known", "held_bom")
# Another process may be making the database; it takes no longer.
_PATIENCE_S = 20.0

_LOST = "what belonged to it is lost: only {} is left. Save a copy and commit it again, then discard this"


class OutboxError(InputError):
    """The outbox cannot be used now: its disk is full, its database is locked, or its folder is read-only."""


class _ClosedError(OutboxError):
    """Its folder is read-only; what is there can be read."""


class QueueDatabase:
    """The file, and the folder of copies beside it; made where they are missing, for their owner only."""

    def __init__(self, path: Path, clock: Callable[[], float] = time.time) -> None:
        self.path = path
        self.clock = clock
        self.copies = path.parent / f"{path.stem}-files"
        self._kept_aside = path.parent / "kept-aside"
        self.closed = ""  # why nothing can be written there, if reading found that
        self._lock = threading.Lock()
        self._is_ready = False
        self._has_locks = True  # of the disk

    @contextmanager
    def transaction(self) -> Iterator[sqlite3.Connection]:
        """Commit all or nothing, on disk when it returns."""
        self._make_ready()
        with self._open() as db, _transaction(db):
            yield db

    @contextmanager
    def send_lock(self) -> Iterator[bool]:
        """Yield True in the one process and thread that may send now. The lock ends with its process."""
        self._make_ready()
        with self._translated():
            lock = hold_lock_here(self.path.with_suffix(".lock"))
        with lock or nullcontext():
            yield lock is not None

    @contextmanager
    def _open(self) -> Iterator[sqlite3.Connection]:
        """Open the database for reading; or a copy of it, if its folder cannot be written."""
        with self._translated(), ExitStack() as stack:
            try:
                self._make_ready()
            except _ClosedError as error:
                self.closed = str(error)
                folder = Path(stack.enter_context(scratch_folder("silo-outbox-")))
                for end in ("", "-wal"):
                    if (file := self.path.with_name(self.path.name + end)).exists():
                        shutil.copyfile(file, folder / file.name)
                db = stack.enter_context(closing(self._connect(folder / self.path.name)))
                if not self._is_ours(db):
                    raise
                yield db
                return
            db = stack.enter_context(closing(self._connect()))
            if not self._is_ours(db):  # it was deleted or replaced while we run
                stack.pop_all().close()
                self._is_ready = False
                self._make_ready()
                db = stack.enter_context(closing(self._connect()))
            db.execute("PRAGMA synchronous = FULL")
            yield db

    def _connect(self, path: Path | None = None) -> sqlite3.Connection:
        if path is None and not self._has_locks:
            db = _connect_alone(self.path)
        else:
            db = sqlite3.connect(path or self.path, timeout=_PATIENCE_S, isolation_level=None)
        db.row_factory = sqlite3.Row
        return db

    @contextmanager
    def _translated(self) -> Iterator[None]:
        try:
            yield
        except (sqlite3.Error, OSError) as error:
            self._is_ready = False  # if it is damaged, the next call makes it again
            raise OutboxError(
                message(
                    "{path}: the outbox cannot be used now ({error}). What waits in it is still "
                    "there. {advice}",
                    path=self.path,
                    error=error,
                    advice=_advice(error),
                )
            ) from error

    def _make_ready(self) -> None:
        """Make folders and file when they are first needed, so not when FreeCAD has only just started."""
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
            self._has_locks = has_locks(self.path.with_suffix(".lock"))
        except OSError as error:
            waiting = len([*self.copies.glob("*.json")])
            text, again = message("Nothing was kept for sending"), message("commit again")
            if waiting:
                text, again = (
                    message(
                        "{waiting} in {copies} cannot be sent",
                        waiting=counted(waiting, "commit"),
                        copies=self.copies,
                    ),
                    message("try again"),
                )
            raise _ClosedError(
                message(
                    "{path}: the outbox cannot be written ({error}). {text}; make room or fix the "
                    "permissions, then {again}",
                    path=self.path,
                    error=why_refused(error),
                    text=text,
                    again=again,
                )
            ) from error
        with self._translated():
            if not self._is_whole():
                # Two processes may begin in the same moment.
                with folder_lock(
                    str(self.path.parent), f"{self.path.stem}.making", message("made ready"), _PATIENCE_S
                ):
                    if not self._is_whole():  # another process was quicker
                        self._make_anew()

    def _is_ours(self, db: sqlite3.Connection) -> bool:
        try:
            return bool(db.execute("PRAGMA user_version").fetchone()[0] == VERSION)
        except sqlite3.OperationalError:
            raise
        except sqlite3.DatabaseError:  # no database at all
            return False

    def _is_whole(self) -> bool:
        """Return True if the file is our database in this format, and no page of it is damaged."""
        with closing(self._connect()) as db:
            if not self._is_ours(db):
                return False
            try:
                for name in _TABLE_NAMES:
                    db.execute(f"SELECT * FROM {name} LIMIT 0")  # noqa: S608
                db.execute(f"{SELECT} LIMIT 0")
                return bool(db.execute("PRAGMA quick_check(1)").fetchone()[0] == "ok")
            except sqlite3.DatabaseError as error:
                if isinstance(error, sqlite3.OperationalError) and "no such" not in str(error):
                    raise
                return False

    def _make_anew(self) -> None:
        """Make the database again from the descriptions and from what can be read of the old file, which is
        kept.
        """
        old = {name: self._readable(name) for name in _TABLE_NAMES}
        for end in ("", "-wal", "-shm"):
            file = self.path.with_name(self.path.name + end)
            if file.exists() and file.stat().st_size:
                replace_patiently(file, self.aside(file.name))
        private_file(self.path)
        with closing(self._connect()) as db:
            with suppress(sqlite3.OperationalError):  # SQLite does not wait for others here
                db.execute("PRAGMA journal_mode = WAL")
            db.execute("PRAGMA synchronous = FULL")
            with _transaction(db):
                for statement in filter(None, map(str.strip, TABLES.split(";\n"))):
                    db.execute(statement)
                self._reconcile(db, old)
                db.execute(f"PRAGMA user_version = {VERSION}")

    def _readable(self, table: str) -> list[dict[str, Any]]:
        rows: list[dict[str, Any]] = []
        with suppress(sqlite3.DatabaseError), closing(self._connect()) as db:
            for row in db.execute(f"SELECT * FROM {table}"):  # noqa: S608
                rows.append(dict(row))  # what comes before the damage counts
        return rows

    def aside(self, path: str) -> Path:
        """Choose a new place for a copy of a file, and make its folder. DocumentError if that fails."""
        folder = self._kept_aside / time.strftime("%Y-%m-%d")
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        except OSError as error:
            raise DocumentError(
                str(folder), message("cannot be made ({error})", error=why_refused(error))
            ) from error
        return folder / f"{time.strftime('%H%M%S')}-{time.monotonic_ns() % 10**6}-{os.path.basename(path)}"

    # -- descriptions -----------------------------------------------------------------------------------

    def _described(self, key: str) -> Path:
        return self.copies / f"{key}.json"

    def _describe(self, db: sqlite3.Connection, key: str) -> None:
        """Write the description of a row beside its copy; called before the transaction ends."""
        for row in db.execute("SELECT * FROM entry WHERE key = ?", (key,)):  # none: discarded meanwhile
            with replacing(self._described(key)) as file:
                file.write(json.dumps(dict(row)).encode())

    def _end(self, db: sqlite3.Connection, entry: Entry) -> None:
        """Forget a commit; its files are removed after the transaction is on disk."""
        db.execute("DELETE FROM entry WHERE id = ?", (entry.id,))
        with suppress(FileNotFoundError):
            replace_patiently(self._described(entry.key), self.copies / f"{entry.key}.gone")
        sync_folder(self.copies)

    def _reconcile(
        self, db: sqlite3.Connection, old: Mapping[str, Iterable[Mapping[str, Any]]] | None = None
    ) -> None:
        """Make rows and descriptions agree: add what a crash or a lost database has left out.

        old
            table → rows of a database that is no longer used; a description is newer than a row.
        """
        names = sorted(name for name in os.listdir(self.copies) if not name.startswith("."))
        gone = {_key_of(name) for name in names if name.endswith(".gone")}
        db.executemany("DELETE FROM entry WHERE key = ?", [(key,) for key in gone])
        keys = _keys(db)
        lost = {_key_of(name): name for name in names if not name.endswith((".json", ".gone"))}
        described = []
        for name in names:
            key = _key_of(name)
            if name == f"{key}.json" and key not in keys | gone:
                if (row := read_memory(self.copies / name)).get("key") == key:
                    described.append(row)
                elif not self._described(key).exists():
                    gone.add(key)  # it ended in this moment, by a program that still has the old database
                else:
                    replace_patiently(self.copies / name, self.aside(name))
                    lost.setdefault(key, "")
        for record in sorted(described, key=lambda one: int(one["id"])):
            _insert(db, "entry", record)
        for table, rows in (old or {}).items():
            for before in rows:
                if table != "entry" or before.get("key") not in {None, *gone}:
                    _insert(db, table, before)
        for key in lost.keys() - _keys(db) - gone:  # so that the user sees it
            copy = lost[key]
            reason = _LOST.format(message("a copy of its file") if copy else message("its name"))
            row = {"key": key, "state": State.HELD, "path": "", "taken_at": self.clock(), "reason": reason}
            _insert(db, "entry", {**row, "file_name": copy, "copy": copy, "file_left": bool(copy)})
        for key in _keys(db):
            if not self._described(key).exists():
                self._describe(db, key)


def _keys(db: sqlite3.Connection) -> set[str]:
    return {str(row[0]) for row in db.execute("SELECT key FROM entry")}


def _insert(db: sqlite3.Connection, table: str, values: Mapping[str, Any]) -> None:
    """Insert those fields of a row that this format knows, unless the row is there."""
    columns = {str(row["name"]) for row in db.execute(f"PRAGMA table_info({table})")}
    row = {name: value for name, value in values.items() if name in columns}
    if "id" in row and db.execute("SELECT 1 FROM entry WHERE id = ?", (row["id"],)).fetchone():
        del row["id"]
    db.execute(
        f"INSERT OR IGNORE INTO {table} ({', '.join(row)}) VALUES (:{', :'.join(row)})",  # noqa: S608
        row,
    )


class FileOrigins(QueueDatabase):
    """What files were made from, as far as it is known here."""

    def lineage(self, sha256: str) -> list[str]:
        """Return the contents from which FreeCAD saved a file with this content here, the nearest first."""
        found: list[str] = []
        with self._open() as db:
            content = sha256
            while len(found) < _LONGEST_LINEAGE:
                row = db.execute("SELECT origin FROM derived WHERE sha256 = ?", (content,)).fetchone()
                if row is None or row[0] in (sha256, *found):
                    break
                content = str(row[0])
                found.append(content)
        return found

    def derived(self, sha256: str, origin: str) -> None:
        """Note that FreeCAD saved a file with this content; it had read or written ``origin`` before."""
        if not sha256 or sha256 == origin or not origin or origin == UNKNOWN:
            return
        with self.transaction() as db:
            db.execute("INSERT OR REPLACE INTO derived VALUES (?, ?, ?)", (sha256, origin, self.clock()))
            db.execute("DELETE FROM derived WHERE at < ?", (self.clock() - _REMEMBERED,))

    def replaced(self, content: str) -> None:
        """Note that a document of this content was saved over a file that another program had written since:
        the record of that file says nothing of the document.
        """
        if content and content != UNKNOWN:
            first = (self.lineage(content) or [content])[-1]
            if first != _OTHER_FILE:
                self.derived(first, _OTHER_FILE)

    def known_revision(self, server: str, sha256: str, item: str) -> int | None:
        """Return the revision that a file is, for servers that keep no checksums; None if it is not known."""
        with self._open() as db:
            row = db.execute(
                "SELECT revision FROM known WHERE server = ? AND sha256 = ? AND item = ?",
                (canonical(server), sha256, item),
            ).fetchone()
        return int(row[0]) if row else None

    def learn(self, server: str, sha256: str, item: str, revision: int) -> None:
        """Note that this file is that revision of an item."""
        if not (sha256 and item):
            return
        with self.transaction() as db:
            row = (canonical(server), sha256, item, revision)
            db.execute("INSERT OR REPLACE INTO known VALUES (?, ?, ?, ?)", row)

    def forget_aside(self) -> None:
        """Remove the copies of days before :data:`KEPT_ASIDE_DAYS` ago, and nothing else there.

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
        """Keep a copy of a file that is about to be replaced; returns its place, None if there is no file.

        Raises DocumentError if it cannot be written.
        """
        target = self.aside(path)
        try:
            shutil.copy2(path, target)
        except FileNotFoundError:
            return None
        except OSError as error:
            text = message(
                "no copy of it could be kept ({error}); it was not replaced", error=why_refused(error)
            )
            raise DocumentError(path, text) from error
        return target


class _Alone(sqlite3.Connection):
    """A connection to a database whose disk has no locks: a lock of this computer ends with it."""

    lock: BinaryIO | None = None

    def close(self) -> None:
        super().close()
        if self.lock is not None:
            self.lock.close()


def _connect_alone(path: Path) -> sqlite3.Connection:
    until = time.monotonic() + _PATIENCE_S
    while (lock := hold_lock_here(f"{path}.alone")) is None:
        if time.monotonic() > until:
            raise sqlite3.OperationalError(_LOCKED)
        time.sleep(0.01)
    try:
        # Not "nolock": that refuses a database with a log, which it has from when its disk had locks.
        address = f"{path.absolute().as_uri()}?vfs=unix-none"
        db = sqlite3.connect(address, uri=True, isolation_level=None, factory=_Alone)
        db.lock = lock
        # SQLite reads that log alone, without memory that programs share.
        db.execute("PRAGMA locking_mode = EXCLUSIVE")
    except BaseException:
        lock.close()
        raise
    return db


def _advice(error: Exception) -> str:
    if isinstance(error, sqlite3.OperationalError) and "locked" in str(error):
        return message("Another program uses it for a long time: wait for it or end it, then try again")
    return message("Make room on the disk or fix its permissions, then try again")


@contextmanager
def _transaction(db: sqlite3.Connection) -> Iterator[None]:
    db.execute("BEGIN IMMEDIATE")
    try:
        yield
    except BaseException:
        db.execute("ROLLBACK")
        raise
    db.execute("COMMIT")


_BLOCK = 1 << 20
# If no row has a second name, its commit may just be on the way.
_HELD_AGE = 3600.0

# The folder of a second name that is a copy, if the disk has no second names.
_COPIED = "copied"

_LOCKED = "database is locked"  # as SQLite says it

_PAUSE = "until, reason, code, failures, told"


class _WrittenError(OSError):
    """The file has another content by now."""


class Store(FileOrigins):
    """Rows and copies. Any thread may call the methods, and other processes share the file.

    path
        the database; in the user's data folder unless given.
    """

    def __init__(self, path: Path | None = None, *, clock: Callable[[], float] = time.time) -> None:
        super().__init__(path or data_folder() / "outbox.sqlite3", clock)
        self._held = self.path.parent / f"{self.path.stem}-held"
        self._coming: dict[str, BinaryIO | None] = {}

    # -- a commit comes in ------------------------------------------------------------------------------

    def hold(self, path: str, key: str) -> Path | None:
        """Keep a file's present content: by a second name, which takes no time, else by a copy. None if the
        disk can do neither.

        FreeCAD writes a new file at each save and renames it, so the old content stays under this name.
        """
        held = self._held / key / os.path.basename(path)
        try:
            held.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            with suppress(OSError):  # exFAT, many shares, another disk
                os.link(path, held)
                if stamp_of(held) == stamp_of(path):
                    return held
                # Some network disks give each name of a file a number of its own: a later look at the second
                # name would take it for another file.
                remove_patiently(held)
            stamp, held = stamp_of(path), held.parent / _COPIED / held.name
            held.parent.mkdir(mode=0o700)
            self._copied(Path(path), held, json.dumps(stamp))
        except OSError:
            return None
        return held

    def _second(self, key: str) -> Path | None:
        """Return the file that :meth:`hold` has kept for a commit."""
        paths = (path for path in (self._held / key).rglob("*") if path.is_file())
        return next((path for path in paths if not path.name.endswith(".part")), None)

    def stage(self, commit: Commit, server: str = "") -> None:
        """Put a commit's row on disk, which takes no time; the caller then calls :meth:`finish`."""
        if commit.file is None and commit.extraction is None and not commit.request:
            raise InputError(
                message(
                    "{part_number}: neither a file nor a BOM to keep",
                    part_number=commit.path or commit.part_number,
                )
            )
        row = {field.name: getattr(commit, field.name) for field in fields(CommitFields)} | {
            "server": canonical(server) if server else "",
            "state": State.KEEPING if commit.file is not None else State.WAITING,
            "stamp": json.dumps(commit.stamp) if commit.stamp else "",
            "file_left": commit.file is not None,
            "file_name": os.path.basename(commit.path) or (commit.file.name if commit.file else ""),
            "copy": f"{commit.key}{_ending(commit.file)}" if commit.file is not None else "",
            "bom_left": bool(commit.extraction is not None or commit.request),
            "extraction": json.dumps(to_plain(commit.extraction)) if commit.extraction is not None else "",
            "request": commit.request,
        }
        try:
            with self.transaction() as db:
                if commit.file is not None:
                    # Any program may copy a file with a second name, even while this one runs.
                    self._coming[commit.key] = None
                    if self._held not in commit.file.parents:
                        self._held.mkdir(mode=0o700, exist_ok=True)
                        self._coming[commit.key] = hold_lock_here(self._coming_lock(commit.key))
                db.execute(f"INSERT INTO entry ({', '.join(row)}) VALUES (:{', :'.join(row)})", row)  # noqa: S608
                self._describe(db, commit.key)
        except BaseException:
            self._has_come(commit.key)
            raise

    def _coming_lock(self, key: str) -> Path:
        return self._held / f"{key}.lock"

    def _has_come(self, key: str) -> None:
        if lock := self._coming.pop(key, None):
            lock.close()
            with suppress(OSError):
                remove_patiently(self._coming_lock(key))

    def is_coming(self, key: str) -> bool:
        """Return True if a running program is about to copy a commit's file; no other program does it
        then.
        """
        if key in self._coming:
            return True
        path = self._coming_lock(key)
        with self._translated():
            lock = hold_lock_here(path) if path.exists() else None
            if lock is None:
                return path.exists()
            with lock, suppress(OSError):
                remove_patiently(path)
        return False

    def finish(self, key: str, source: Path | None = None, parent: str = "") -> str:
        """Make the copy of a staged commit's file, from its second name rather than from ``source``.

        If the copy cannot be written, a commit with a second name stays and is tried again later. A commit
        without one is forgotten, and DocumentError says so. After an OutboxError the commit stays. A file
        that was written since the commit is not sent.

        ``parent``: what FreeCAD had read or written before this file; else the commit's first origin. Returns
        the file's SHA-256, "" if there is no copy of it.
        """
        try:
            self._finish(key, source, parent)
        finally:
            self._has_come(key)
        entry = self.by_key(key)
        return entry.sha256 if entry is not None else ""

    def _finish(self, key: str, source: Path | None, parent: str) -> None:
        entry = self.by_key(key)
        if entry is None or not entry.file_left or entry.sha256:
            return
        held, copy = self._second(key), self.copies / entry.copy
        # A copy that has its final name is complete: only its row was not written.
        content = copy if copy.exists() else held or source
        if content is None:
            text = message("its file was not copied in time; commit it again, then discard this")
            self.update(entry.id, state=State.HELD, reason=text)
            return
        try:
            is_copied = content.parent.name == _COPIED and content is held
            sha256, size = self._copied(content, copy, "" if is_copied else entry.stamp)
        except _WrittenError as error:
            if held is not None:
                sentence = message(
                    "{file_name}: {error}; commit it again, then discard this",
                    file_name=entry.path or entry.file_name,
                    error=error,
                )
                self.update(entry.id, state=State.HELD, reason=sentence)
                return
            raise self._lost(entry, content, str(error)) from error
        except OSError as error:
            now = self.by_key(key)
            if now is None or now.sha256:  # another program was quicker
                return
            sentence = message("cannot be copied for sending ({error})", error=why_refused(error))
            if held is not None or content is copy:
                self.update(
                    entry.id,
                    reason=message(
                        "{file_name}: {sentence}; it is tried again",
                        file_name=entry.path or entry.file_name,
                        sentence=sentence,
                    ),
                )
                return
            raise self._lost(entry, content, sentence) from error
        values = {"origin": self._made_from(entry, sha256, parent)} if entry.origin else {}
        place = _place(copy, entry.path)
        self.update(entry.id, state=State.WAITING, sha256=sha256, size=size, reason="", **place, **values)
        shutil.rmtree(self._held / key, ignore_errors=True)
        if self.by_key(key) is None:  # discarded meanwhile
            self._drop_files(entry)

    def _made_from(self, entry: Entry, sha256: str, parent: str) -> str:
        told = entry.origin.split()
        self.derived(sha256, parent or told[0])
        origins = self.origins(sha256, entry.path, entry.identity, entry.key)
        return " ".join(dict.fromkeys([*origins, *(content for content in told if content != UNKNOWN)]))

    def _lost(self, entry: Entry, content: Path, reason: str) -> DocumentError:
        with suppress(OutboxError):  # a row that stays has no file: the next sending holds it and says so
            self.discard(entry.id)
        return DocumentError(
            str(content), message("{reason}; nothing was kept, commit it again", reason=reason)
        )

    def add(self, commit: Commit, server: str = "") -> Entry:
        """Add row and copy; both are on disk when it returns."""
        self.stage(commit, server)
        self.finish(commit.key, commit.file)
        entry = self.by_key(commit.key)
        if entry is None:
            raise InputError(message("{path}: discarded while its copy was made", path=commit.path))
        return entry

    # -- what the user decides --------------------------------------------------------------------------

    def retry(self, entry_id: int, server: str | None = None) -> None:
        """Let an entry be sent with the next run; ``server`` sends it there instead (the server moved).

        For a file with another name than the item's, the user confirms that it is the same part. Raises
        :class:`ConflictError` if something newer of the same item has arrived since.
        """
        entry = self._existing(entry_id)
        if entry.superseded:
            raise ConflictError(
                message(
                    "{label}: a newer commit was sent; this one would overwrite it. Discard this commit",
                    label=entry.part_number or entry.label,
                )
            )
        ready = State.WAITING if entry.sha256 or not entry.file_left else State.KEEPING
        renamed = SAME_PART if entry.renamed == ASKED else entry.renamed
        changed: dict[str, Any] = {"state": ready, "reason": "", "renamed": renamed}
        if entry.newer:
            changed |= {"newer": "", **on_top(entry.comment, entry.newer)}
        if server is not None and canonical(server) != entry.server:
            # What was seen of the old server is not true of the new one.
            changed |= {"server": canonical(server), "base_revision": None, "on_top_of": ""}
            changed |= {"revision": None, "comment": entry.comment}
        if self.bom(entry_id)[0]:
            # A refused request is made again, since the missing part may have its number now.
            changed["request"] = ""
        self.update(entry_id, **changed)
        self.set_pause(changed.get("server", entry.server), None, entry.item)

    def discard(self, entry_id: int, *, keep: bool = False) -> None:
        """Forget an entry and its copy; the document itself is not touched.

        ``keep``: the copy is kept aside first.
        """
        entry = self._existing(entry_id)
        if keep and entry.file_left:
            self.save_copy(entry_id, self.aside(entry.file_name))
        with self.transaction() as db:
            self._end(db, entry)
            db.execute("DELETE FROM pause WHERE item = ?", (entry.item,))
        self._has_come(entry.key)
        self._drop_files(entry)

    def save_copy(self, entry_id: int, target: Path) -> None:
        """Write an entry's file to another place, as it is, even if it is damaged."""
        entry = self._existing(entry_id)
        held = self._second(entry.key)
        try:
            with open(held or self.copies / entry.copy, "rb") as read, replacing(target, mode=0o644) as out:
                shutil.copyfileobj(read, out, _BLOCK)
        except OSError as error:
            raise DocumentError(
                str(target), message("cannot be written ({error})", error=why_refused(error))
            ) from error

    # -- pauses -----------------------------------------------------------------------------------------

    def pause(self, server: str, item: str = "") -> Pause | None:
        """Return the last pause of a server, or of one item there; None if all went well since then."""
        where = (canonical(server), item)
        with self._open() as db:
            row = db.execute(f"SELECT {_PAUSE} FROM pause WHERE server = ? AND item = ?", where).fetchone()  # noqa: S608
        return Pause(**dict(row) | {"told": bool(row["told"])}) if row else None

    def set_pause(self, server: str, pause: Pause | None, item: str = "") -> None:
        """Note a pause, or that there is none."""
        where = (canonical(server), item)
        with self.transaction() as db:
            db.execute("DELETE FROM pause WHERE server = ? AND item = ?", where)
            if pause is not None:
                row = (*where, *(getattr(pause, name) for name in _PAUSE.split(", ")))
                db.execute(f"INSERT INTO pause (server, item, {_PAUSE}) VALUES (?, ?, ?, ?, ?, ?, ?)", row)  # noqa: S608

    def resume(self, server: str, *, told: bool = True) -> None:
        """End all pauses of a server; ``told``: also those that the server asked for."""
        with self.transaction() as db:
            db.execute("DELETE FROM pause WHERE server = ? AND told <= ?", (canonical(server), told))

    # -- BOMs that are held -----------------------------------------------------------------------------

    def held_boms(self, server: str = "") -> tuple[HeldHere, ...]:
        """Return the BOMs that a server lacks since they cannot be sent, oldest first; "": of any server."""
        here = canonical(server) if server else ""
        with self._open() as db:
            rows = db.execute("SELECT * FROM held_bom WHERE ? IN (server, '') ORDER BY since", (here,))
            return tuple(map(held_row, rows))

    def hold_bom(self, held: HeldHere) -> None:
        """Remember that a BOM is held; it keeps the time from which it was."""
        why = held.why.as_json() if isinstance(held.why, Message) else held.why
        row = vars(held) | {"server": canonical(held.server), "why": json.dumps(why)}
        with self.transaction() as db:
            db.execute(
                f"INSERT INTO held_bom ({', '.join(row)}) VALUES (:{', :'.join(row)})"  # noqa: S608
                " ON CONFLICT (server, identity) DO UPDATE SET part_number = excluded.part_number,"
                " path = excluded.path, label = excluded.label, why = excluded.why",
                row,
            )

    def free_bom(self, server: str, identity: str) -> bool:
        """Forget that a BOM is held; returns True if it was."""
        where = (canonical(server), identity)
        with self._open() as db:
            if not db.execute("SELECT 1 FROM held_bom WHERE server = ? AND identity = ?", where).fetchone():
                return False
        with self.transaction() as db:
            db.execute("DELETE FROM held_bom WHERE server = ? AND identity = ?", where)
        return True

    # -- reading and changing ---------------------------------------------------------------------------

    def entries(self) -> tuple[Entry, ...]:
        """Return all entries, oldest first."""
        with self._open() as db:
            return tuple(entry_of(row) for row in db.execute(f"{SELECT} ORDER BY e.id"))

    def entry(self, entry_id: int) -> Entry | None:
        """Return one entry; None if it is gone."""
        return self._entry_where("e.id = ?", entry_id)

    def by_key(self, key: str) -> Entry | None:
        """Return the entry of a commit; None if it is gone."""
        return self._entry_where("e.key = ?", key)

    def next_due(self, server: str, after: int) -> Entry | None:
        """Return the oldest entry after ``after`` that may be sent to a server without a decision of
        the user.
        """
        where = "e.state <> 'held' AND e.server IN ('', ?) AND e.id > ? ORDER BY e.id LIMIT 1"
        return self._entry_where(where, canonical(server), after)

    def origins(
        self,
        sha256: str,
        path: str,
        identity: str,
        key: str = "",
        record: FileRecord | None = _LOOK_FOR_IT,
    ) -> tuple[str, ...]:
        """Return what a file with this content was made from, the nearest first (:mod:`silo.file_state`).

        These are what FreeCAD saved it from here, what of this file waits in the queue since its record was
        written, the content of the record, and the content itself.

        key
            of the commit that asks; its own content is no origin.
        record
            of the file, where the caller has read it: a file that has moved has it at another place.
        """
        if record is _LOOK_FOR_IT:
            record = record_of(path) if path else None
        line = self.lineage(sha256)
        if line[-1:] == [_OTHER_FILE]:  # it was saved over a file that it does not come from
            return tuple(dict.fromkeys([*line[:-1], sha256]))
        if record is not None and record.sha256 == sha256:
            return (sha256,)
        with self._open() as db:
            known = {
                content
                for content in line
                if db.execute("SELECT 1 FROM known WHERE sha256 = ?", (content,)).fetchone()
            }
        real = one_path(path) if path else ""
        since = record.since if record is not None else 0.0
        waiting = [
            entry
            for entry in reversed(self.entries())
            if entry.sha256 and entry.key != key and entry.identity.casefold() == identity.casefold()
        ]
        queued = [
            entry.sha256
            for entry in waiting
            if entry.has_file and entry.path and entry.taken_at >= since and one_path(entry.path) == real
        ]
        recorded = [record.sha256] if record is not None and record.sha256 else []
        told = known.union(recorded, (entry.sha256 for entry in waiting))
        near = [content for content in line if content in told] + line[-1:]
        return tuple(dict.fromkeys([*near, *queued, *recorded, sha256]))

    def document_origins(self, content: str, path: str, identity: str) -> tuple[str, ...]:
        """Return what an open document was made from, the nearest first: the content that it was read from
        or saved to, and what that was made from.
        """
        if content == UNKNOWN:  # the file has another content by now, and its record is of that
            return (UNKNOWN,)
        return tuple(dict.fromkeys((content, *self.origins(content, path, identity))))

    def bom(self, entry_id: int) -> tuple[str, str]:
        """Return the extraction and the merge request of an entry, as JSON; "" if there is none."""
        with self._open() as db:
            row = db.execute("SELECT extraction, request FROM entry WHERE id = ?", (entry_id,)).fetchone()
        return (str(row[0]), str(row[1])) if row else ("", "")

    def update(self, entry_id: int, **values: Any) -> None:
        """Set columns of an entry."""
        columns = ", ".join(f"{name} = :{name}" for name in values)
        with self.transaction() as db:
            parameters = {**values, "id": entry_id}
            for row in db.execute(f"UPDATE entry SET {columns} WHERE id = :id RETURNING key", parameters):  # noqa: S608
                self._describe(db, row[0])

    def arrived(
        self,
        entry: Entry,
        kind: str,
        revision: int | None = None,
        *,
        base: int | None = None,
        note: bool = True,
    ) -> None:
        """Note that the server has an entry's file or its BOM. If nothing remains to be sent, the entry is
        removed with its copy; until then, a server that is restored from a backup may need the copy again.

        base
            the revision that the file was made from. A BOM of that revision that still waits for the user may
            be sent although its file is no longer the newest, because everything newer comes from here.
        note
            False: it was not sent, and makes nothing older out of date.
        """
        left = entry.bom_left if kind == "file" else entry.file_left
        with self.transaction() as db:
            if left:
                number = revision if kind == "file" else entry.revision
                db.execute(f"UPDATE entry SET {kind}_left = 0, revision = ? WHERE id = ?", (number, entry.id))  # noqa: S608
                self._describe(db, entry.key)
            else:
                self._end(db, entry)
            if base is not None:
                changed = db.execute(
                    "UPDATE entry SET revision = ? WHERE server = ? AND identity = ? AND revision = ?"
                    " AND NOT file_left RETURNING key",
                    (revision, entry.server, entry.identity, base),
                ).fetchall()
                for row in changed:
                    self._describe(db, row[0])
            for item in filter(None, {entry.identity, entry.part_number} if note else ()):
                db.execute(
                    "INSERT INTO sent VALUES (?, ?, ?, ?) ON CONFLICT (server, item, kind)"
                    " DO UPDATE SET entry_id = max(entry_id, excluded.entry_id)",
                    (entry.server, item, kind, entry.id),
                )
        if not left:
            self._drop_files(entry)

    # -- copies -----------------------------------------------------------------------------------------

    def verified(self, entry: Entry) -> Path:
        """Check the hash of the copy, and return its path. InputError if it is damaged, OSError if it cannot
        be read.
        """
        path = self.copies / entry.copy
        if content_hash(path) != entry.sha256:
            raise InputError(
                message(
                    "{file_name}: the copy kept for sending is damaged, so it was not sent. Commit "
                    "the document again, then discard this",
                    file_name=entry.path or entry.file_name,
                )
            )
        return path

    def sweep(self) -> None:
        """Make rows and descriptions agree, and remove what has ended or was kept aside long ago."""
        with self.transaction() as db:
            self._reconcile(db)
            keys = _keys(db)
            # Listed before others may write again: what comes later is a commit.
            ended = {_key_of(name) for name in os.listdir(self.copies)} - keys
        self.forget_aside()
        for key in ended:
            self._drop(key)
        with suppress(OSError):
            for folder in [*self._held.iterdir()]:
                is_old = self.clock() - folder.stat().st_mtime > _HELD_AGE
                if _key_of(folder.name) not in keys and is_old:
                    with suppress(OSError, DocumentError):
                        for file in [path for path in folder.rglob("*") if path.is_file()]:
                            replace_patiently(file, self.aside(file.name))
                        shutil.rmtree(folder)

    def _copied(self, source: Path, copy: Path, stamp: str) -> tuple[str, int]:
        if source == copy:
            return content_hash(copy), copy.stat().st_size
        digest, size = hashlib.sha256(), 0
        with source.open("rb") as read, replacing(copy) as write:
            while block := read.read(_BLOCK):
                digest.update(block)
                size += len(block)
                write.write(block)
            if stamp and json.dumps(stamp_of(read.fileno())) != stamp:
                raise _WrittenError(message("it was written again since the commit"))
        return digest.hexdigest(), size

    def _drop_files(self, entry: Entry) -> None:
        """Remove the files of a row; those that cannot be removed now are swept up later."""
        self._drop(entry.key)
        shutil.rmtree(self._held / entry.key, ignore_errors=True)

    def _drop(self, key: str) -> None:
        with suppress(OSError):
            # The mark that it has ended goes last: a copy alone would be taken for a lost commit.
            names = [name for name in os.listdir(self.copies) if _key_of(name) == key]
            for name in sorted(names, key=lambda label: label.endswith(".gone")):
                remove_patiently(self.copies / name)

    def _entry_where(self, where: str, *values: Any) -> Entry | None:
        with self._open() as db:
            row = db.execute(f"{SELECT} WHERE {where}", values).fetchone()
        return entry_of(row) if row else None

    def _existing(self, entry_id: int) -> Entry:
        entry = self.entry(entry_id)
        if entry is None:
            raise InputError(
                message(
                    "the outbox has no entry {entry_id}; it was sent or discarded meanwhile",
                    entry_id=entry_id,
                )
            )
        return entry


def _place(copy: Path, path: str) -> dict[str, str]:
    """Find the file's place and its links; {} if it is not a FreeCAD file."""
    if not path:
        return {}
    from silo.fcstd.linked import place_of

    try:
        place = place_of(copy, path)
    except InputError:
        return {}
    return {"place": place.path, "links": json.dumps(place.as_dicts())}


def _key_of(copy: str) -> str:
    """Return the key of the commit that owns a copy. While it is written, or if it was cut off, its name
    begins with a point.
    """
    return copy.lstrip(".").split(".")[0]


def _ending(file: Path) -> str:
    """Return the ending for a copy, which never is that of a description."""
    ending = file.suffix[:20]
    return f"{ending}.copy" if ending.casefold() in (".json", ".gone") else ending
