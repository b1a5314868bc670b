# SPDX-License-Identifier: LGPL-2.1-or-later
"""What was begun and what was finished when components were registered: one SQLite file, for all processes.

An intent is on disk before the server is asked, and stays until the component's file names its item. What is
finished stays too: a FreeCAD that had the file open may save its own copy over the identity, and the item
must be found again then.
"""

from __future__ import annotations

import hashlib
import sqlite3
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

from silo.bom.errors import InputError
from silo.platform import data_folder, private_file, private_folder

_TABLE = """
CREATE TABLE IF NOT EXISTS registrations (
    component TEXT PRIMARY KEY,
    wanted TEXT NOT NULL,
    item_id TEXT NOT NULL,
    server TEXT NOT NULL DEFAULT '',
    document_uid TEXT NOT NULL DEFAULT '',
    begun_at REAL NOT NULL,
    finished_at REAL
)
"""
_COLUMNS = "component, wanted, item_id, server, document_uid, begun_at, finished_at"


@dataclass(frozen=True)
class Record:
    """One component's registration.

    wanted
        the UUID that we asked the server to give the item; ``item_id`` the one that it has.
    document_uid
        FreeCAD's own UUID of the document, which survives saving; "" where unknown.
    begun_at, finished_at
        seconds since 1970; ``finished_at`` is None while the file does not name its item.
    """

    component: str
    wanted: str
    item_id: str
    server: str
    document_uid: str
    begun_at: float
    finished_at: float | None

    @property
    def finished(self) -> bool:
        return self.finished_at is not None


class Journal:
    """The user's registrations. Safe to use from several threads and processes.

    path
        the file; by default in the user's data folder.
    """

    def __init__(
        self, path: Path | None = None, *, clock: Callable[[], float] = time.time, patience: float = 300.0
    ) -> None:
        self.path = path or data_folder() / "registrations.sqlite3"
        self._clock, self._patience = clock, patience

    def pending(self) -> dict[str, str]:
        """``file#object`` → the UUID that its item was to get, or has."""
        with self._open() as db:
            rows = db.execute("SELECT component, item_id FROM registrations WHERE finished_at IS NULL")
            return dict(rows.fetchall())

    def find(self, component: str) -> Record | None:
        """What is known of a component."""
        with self._open() as db:
            row = db.execute(
                f"SELECT {_COLUMNS} FROM registrations WHERE component = ?",  # noqa: S608
                (component,),
            ).fetchone()
        return Record(*row) if row is not None else None

    def begin(self, component: str, server: str = "") -> tuple[Record, bool]:
        """The intent for a component's item, and whether an earlier run had already begun with it."""
        known = self.find(component)
        if known is not None and not known.finished:
            return known, True
        wanted = str(uuid.uuid4())
        record = Record(component, wanted, wanted, server, "", self._clock(), None)
        with self._open() as db:
            db.execute(
                f"REPLACE INTO registrations ({_COLUMNS}) VALUES (?, ?, ?, ?, ?, ?, ?)",  # noqa: S608
                tuple(vars(record).values()),
            )
        return record, False

    def replace(self, component: str, item_id: str) -> None:
        """Remember the UUID that the server chose itself."""
        with self._open() as db:
            db.execute("UPDATE registrations SET item_id = ? WHERE component = ?", (item_id, component))

    def done(self, component: str, document_uid: str = "") -> None:
        """The component's file names its item."""
        with self._open() as db:
            db.execute(
                "UPDATE registrations SET finished_at = ?, document_uid = ? WHERE component = ?",
                (self._clock(), document_uid, component),
            )

    def forget(self, component: str) -> None:
        """The server certainly made no item for it."""
        with self._open() as db:
            db.execute("DELETE FROM registrations WHERE component = ?", (component,))

    def item_ids(self) -> frozenset[str]:
        """The items of all components that are known here."""
        with self._open() as db:
            return frozenset(row[0] for row in db.execute("SELECT item_id FROM registrations"))

    @contextmanager
    def turn(self, server: str = "") -> Iterator[None]:
        """Hold while one component is registered at a server: two processes never make an item for the same
        one, and a slow server holds nobody up at another.

        A transaction on a database of its own: the system ends it with the process, however that dies.
        """
        name = hashlib.sha256(server.encode()).hexdigest()[:16]
        with closing(self._locked(self.path.with_name(f"{self.path.stem}-{name}.lock"))):
            yield

    def _locked(self, path: Path) -> sqlite3.Connection:
        with self._translated():
            db = self._connect(path, self._patience)
            try:
                db.execute("BEGIN EXCLUSIVE")
            except sqlite3.OperationalError as error:
                db.close()
                if "locked" not in str(error):
                    raise
                raise InputError("another registration runs and does not end; try again later") from error
        return db

    @contextmanager
    def _open(self) -> Iterator[sqlite3.Connection]:
        with self._translated(), closing(self._connect(self.path, 20.0)) as db:
            db.execute("PRAGMA synchronous = FULL")
            db.execute("BEGIN IMMEDIATE")
            db.execute(_TABLE)
            yield db
            db.execute("COMMIT")

    def _connect(self, path: Path, timeout: float) -> sqlite3.Connection:
        private_folder(path.parent)
        private_file(path)  # before SQLite opens it
        return sqlite3.connect(path, timeout=timeout, isolation_level=None)

    @contextmanager
    def _translated(self) -> Iterator[None]:
        try:
            yield
        except (sqlite3.Error, OSError) as error:
            raise self._unusable(error, self.path) from error

    @staticmethod
    def _unusable(error: Exception, path: Path) -> InputError:
        return InputError(
            f"{path}: the journal of registrations cannot be read ({error}). Mend or move it; items of "
            "an interrupted run may then exist without a file that names them."
        )
