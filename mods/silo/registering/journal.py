# SPDX-License-Identifier: LGPL-2.1-or-later
"""What was begun and what was finished when components were registered: one SQLite file, for all processes.

An intent is on disk before the server is asked, and stays until the component's file names its item. What is
finished stays too: a FreeCAD that had the file open may save its own copy over the identity, and the item
must be found again then.
"""

from __future__ import annotations

import os
import sqlite3
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

from silo.bom.errors import InputError
from silo.files import folder_lock
from silo.platform import data_folder, private_file, private_folder

_TABLE = """
CREATE TABLE IF NOT EXISTS registrations (
    component TEXT PRIMARY KEY,
    wanted TEXT NOT NULL,
    item_id TEXT NOT NULL,
    document_uid TEXT NOT NULL DEFAULT '',
    begun_at REAL NOT NULL,
    finished_at REAL
)
"""
_COLUMNS = "component, wanted, item_id, document_uid, begun_at, finished_at"


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
        return {record.component: record.item_id for record in self.unfinished()}

    def unfinished(self) -> list[Record]:
        """The registrations whose file does not name its item yet, oldest first."""
        return self._records("finished_at IS NULL ORDER BY begun_at")

    def find(self, component: str) -> Record | None:
        """What is known of a component."""
        return next(iter(self._records("component = ?", component)), None)

    def begin(self, component: str, carried: str = "") -> tuple[Record, bool]:
        """The intent for a component's item, and whether an earlier run had already begun with it.

        carried
            the identity that its file has from elsewhere, and that the item shall have.
        """
        known = self.find(component)
        if known is not None and not known.finished and carried in ("", known.wanted, known.item_id):
            return known, True
        wanted = carried or str(uuid.uuid4())
        record = Record(component, wanted, wanted, "", self._clock(), None)
        self._write(
            f"REPLACE INTO registrations ({_COLUMNS}) VALUES (?, ?, ?, ?, ?, ?)",  # noqa: S608
            *vars(record).values(),
        )
        return record, False

    def replace(self, component: str, item_id: str) -> None:
        """Remember the UUID that the server chose itself."""
        self._write("UPDATE registrations SET item_id = ? WHERE component = ?", item_id, component)

    def done(self, component: str, document_uid: str = "") -> None:
        """The component's file names its item."""
        changed = "UPDATE registrations SET finished_at = ?, document_uid = ? WHERE component = ?"
        self._write(changed, self._clock(), document_uid, component)

    def forget(self, component: str) -> None:
        """The server certainly made no item for it."""
        self._write("DELETE FROM registrations WHERE component = ?", component)

    def item_ids(self) -> frozenset[str]:
        """The items of all components that are known here."""
        return frozenset(record.item_id for record in self._records("TRUE"))

    def turn(
        self, path: str, tell: Callable[[str], object] = lambda _text: None
    ) -> AbstractContextManager[str]:
        """Hold a file's folder while one component of it is registered, on whichever computer: two processes
        never make an item for the same one, and nobody waits for another project's server.

        Gives why other computers do not see that, "" where they do. ``tell`` gets who else does it, if that
        takes long. Raises InputError.
        """
        return folder_lock(os.path.dirname(path), ".silo-register.lock", "registered", self._patience, tell)

    def _records(self, where: str, *values: str) -> list[Record]:
        with self._open() as db:
            rows = db.execute(f"SELECT {_COLUMNS} FROM registrations WHERE {where}", values)  # noqa: S608
            return [Record(*row) for row in rows]

    def _write(self, statement: str, *values: object) -> None:
        with self._open() as db:
            db.execute(statement, values)

    @contextmanager
    def _open(self) -> Iterator[sqlite3.Connection]:
        try:
            with closing(self._connect()) as db:
                db.execute("PRAGMA synchronous = FULL")
                db.execute("BEGIN IMMEDIATE")
                db.execute(_TABLE)
                yield db
                db.execute("COMMIT")
        except (sqlite3.Error, OSError) as error:
            raise InputError(
                f"{self.path}: the journal of registrations cannot be read ({error}). Mend or move it; items "
                "of an interrupted run may then exist without a file that names them."
            ) from error

    def _connect(self) -> sqlite3.Connection:
        private_folder(self.path.parent)
        private_file(self.path)  # before SQLite opens it
        return sqlite3.connect(self.path, timeout=20.0, isolation_level=None)
