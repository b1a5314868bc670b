# SPDX-License-Identifier: LGPL-2.1-or-later
"""The SQLite file of the index, which several processes may use, and which may be lost at any time.

A database that is damaged or of another format is made again; one that cannot be written is left alone.
Nothing here makes a run fail.
"""

from __future__ import annotations

import logging
import sqlite3
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO

from silo.bom.errors import InputError
from silo.bom.message import message
from silo.bom.system_refusals import why_refused
from silo.platform.locks import hold_lock
from silo.platform.whole_files import remove_patiently

log = logging.getLogger("silo.vault")

_APPLICATION = 0x51107A11  # marks our databases (SQLite's application_id)

_MAGIC = b"SQLite format 3\0"

_BUSY_S = 10.0

_VARIABLES = 250  # of one statement; SQLite takes at least 999

_TABLES = """
CREATE TABLE files (path TEXT PRIMARY KEY, seen TEXT NOT NULL, mark INTEGER NOT NULL) WITHOUT ROWID;
CREATE TABLE facts (path TEXT PRIMARY KEY, facts TEXT NOT NULL, mark BLOB NOT NULL);
CREATE TABLE answers (
    path TEXT NOT NULL, question TEXT NOT NULL, answer TEXT NOT NULL, trail TEXT NOT NULL,
    made_at REAL NOT NULL, mark INTEGER NOT NULL, PRIMARY KEY (path, question)
);
CREATE TABLE told (vault TEXT, sentence BLOB, PRIMARY KEY (vault, sentence)) WITHOUT ROWID;
CREATE TABLE places (vault TEXT, uuid TEXT, path TEXT, PRIMARY KEY (vault, uuid, path)) WITHOUT ROWID;
"""


class IndexDatabase:
    """A database at a path; None for one of this process alone.

    given
        the user named this path: a file that is no index of ours is not touched (InputError).
    trouble
        why nothing is kept, "" where all is well.
    writes
        False once writing failed.
    """

    def __init__(self, path: Path | None, given: bool) -> None:
        self.path = path
        self.trouble = ""
        self.writes = True
        self._guard: BinaryIO | None = None
        self._database = _empty()
        if path is not None:
            try:
                self._open(path, given)
            except InputError:
                self.close()
                raise

    def close(self) -> None:
        """Let others rebuild the database."""
        self._database.close()
        if self._guard is not None:
            self._guard.close()

    def select(self, statement: str, *values: str) -> list[Any]:
        """Return the rows; [] if the database fails."""
        try:
            return self._database.execute(statement, values).fetchall()
        except sqlite3.Error as error:
            self._give_up(error)
            return []

    def select_in(self, statement: str, paths: Sequence[str], *values: str) -> Iterator[Any]:
        """Yield rows whose path is one of these; ``statement`` ends with ``IN``."""
        for at in range(0, len(paths), _VARIABLES):
            group = paths[at : at + _VARIABLES]
            marks = ",".join("?" * len(group))
            yield from self.select(f"{statement} ({marks})", *values, *group)

    def write(self, *changes: tuple[str, Sequence[tuple[Any, ...]]]) -> bool:
        """Carry out statements, each for its rows, all or nothing. Returns True if that succeeded."""
        if not self.writes:
            return False
        try:
            self._database.execute("BEGIN IMMEDIATE")
            try:
                for statement, rows in changes:
                    self._database.executemany(statement, rows)
                self._database.execute("COMMIT")
            except BaseException:
                if self._database.in_transaction:
                    self._database.execute("ROLLBACK")
                raise
        except sqlite3.Error as error:
            self._give_up(error)
            return False
        return True

    def _open(self, path: Path, given: bool) -> None:
        try:
            if given and not _may_replace(path):
                raise InputError(
                    message(
                        "{path} is not an index of silo-mod, so it is left as it is. Name another file.",
                        path=path,
                    )
                )
            path.parent.mkdir(parents=True, exist_ok=True)
            for attempt in range(2):
                self._guard = hold_lock(f"{path}.lock", shared=True)
                if self._guard is None:
                    self.trouble = message(
                        "the index {path} is being made again by another process", path=path
                    )
                    return
                try:
                    database = _connected(path)
                    self._database.close()
                    self._database = database
                    return
                except _Unusable as error:
                    log.info("%s: %s; it is made again", path, error)
                    self._guard.close()
                    if attempt or not _removed(path):
                        self.trouble = message(
                            "the index {path} cannot be used ({error})", path=path, error=error
                        )
                        return
        except (OSError, sqlite3.Error) as error:
            self._give_up(error)

    def _give_up(self, error: sqlite3.Error | OSError) -> None:
        """Stop writing to a database that fails; read from it as long as that works."""
        if not self.trouble:
            self.trouble = message(
                "the index {path} cannot be used ({error}); nothing is lost but time",
                path=self.path,
                error=why_refused(error),
            )
            log.warning("%s", self.trouble)
        self.writes = False
        if isinstance(error, sqlite3.DatabaseError) and not isinstance(error, sqlite3.OperationalError):
            self._database.close()
            self._database = _empty()
            if self._guard is not None and self.path is not None:
                self._guard.close()
                self._guard = None
                _removed(self.path)


def _empty() -> sqlite3.Connection:
    """Make a database for this process alone; SQLite moves it to the disk if it grows large."""
    database = sqlite3.connect("", isolation_level=None)
    database.executescript(_TABLES)
    return database


class _Unusable(Exception):
    """The file is no database that this code can use."""


def _connected(path: Path) -> sqlite3.Connection:
    """Open a database of our format, or make it. Raises _Unusable, sqlite3.OperationalError (locked, full, no
    right).
    """
    database = sqlite3.connect(path, timeout=_BUSY_S, isolation_level=None)
    try:
        database.execute("PRAGMA synchronous = NORMAL")
        database.execute("BEGIN IMMEDIATE")
        (application,) = database.execute("PRAGMA application_id").fetchone()
        (version,) = database.execute("PRAGMA user_version").fetchone()
        (tables,) = database.execute("SELECT count(*) FROM sqlite_master").fetchone()
        if (application, version) == (0, 0) and not tables:
            for statement in _TABLES.split(";"):
                database.execute(statement)
            database.execute(f"PRAGMA application_id = {_APPLICATION}")
            database.execute(f"PRAGMA user_version = {FORMAT}")
        elif (application, version) != (_APPLICATION, FORMAT):
            raise _Unusable(
                message("it has format {version}, wanted is {format}", version=version, format=FORMAT)
            )
        database.execute("COMMIT")
        return database
    except sqlite3.OperationalError:
        database.close()
        raise
    except sqlite3.DatabaseError as error:
        database.close()
        raise _Unusable(str(error)) from error
    except _Unusable:
        database.close()
        raise


def _removed(path: Path) -> bool:
    """Delete a database that is not open; returns True if it is gone."""
    guard = hold_lock(f"{path}.lock")
    if guard is None:
        return False
    with guard:
        for name in (path, f"{path}-journal", f"{path}-wal", f"{path}-shm"):
            remove_patiently(name)
    return True


def _may_replace(path: Path) -> bool:
    """Return True if the path is free, or holds a database of ours, even if it is damaged behind its head."""
    try:
        with path.open("rb") as file:
            head = file.read(72)
    except FileNotFoundError:
        return True
    ours = head.startswith(_MAGIC) and head[68:72] == _APPLICATION.to_bytes(4, "big")
    return ours or not head


FORMAT = 6
