# SPDX-License-Identifier: LGPL-2.1-or-later
"""What was begun and what was finished when components were registered: one SQLite file, for all processes.

An intent is on disk before the server is asked, and stays until the component's file names its item. What is
finished stays too: a FreeCAD that had the file open may save its own copy over the identity, and the item
must be found again then.

What is begun stands in the component's folder too until it is finished, so that another computer continues
it instead of making a second item.
"""

from __future__ import annotations

import json
import os
import sqlite3
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from silo.bom.entry import BomEntry
from silo.bom.errors import InputError
from silo.bom.message import message
from silo.bom.system_refusals import why_refused
from silo.folder_lock import folder_lock
from silo.platform.user_folders import data_folder
from silo.platform.whole_files import private_file, private_folder, remove_patiently, replacing


def component_key(entry: BomEntry) -> str:
    """Return the name of a component in the journal. A path may be no text, but SQLite keeps only text."""
    path = entry.doc_path.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")
    return f"{path}#{entry.object_name}"


RESERVED = ".silo-registering.json"

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
class RegistrationRecord:
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
        """Return ``file#object`` → the UUID that its item has, or will get."""
        return {record.component: record.item_id for record in self.unfinished()}

    def unfinished(self) -> list[RegistrationRecord]:
        """Return the registrations whose file does not name its item yet, the oldest first."""
        return self._records("finished_at IS NULL ORDER BY begun_at")

    def find(self, component: str) -> RegistrationRecord | None:
        """Return the registration of a component; None if there is none."""
        return next(iter(self._records("component = ?", component)), None)

    def begin(
        self, component: str, carried: str = "", beside: RegistrationRecord | None = None
    ) -> tuple[RegistrationRecord, bool]:
        """Begin the registration of a component, or continue an earlier one; also return if it was begun
        before.

        carried
            the identity that its file has from elsewhere, and that the item gets.
        beside
            what another computer has begun (:func:`begun_beside`). It has precedence over what this computer
            began.
        """
        for registration_record in (beside, self.find(component)):
            if (
                registration_record is not None
                and not registration_record.finished
                and carried in ("", registration_record.wanted, registration_record.item_id)
            ):
                self._keep(registration_record)
                return registration_record, True
        wanted = carried or str(uuid.uuid4())
        record = RegistrationRecord(component, wanted, wanted, "", self._clock(), None)
        self._keep(record)
        return record, False

    def _keep(self, record: RegistrationRecord) -> None:
        self._write(
            f"REPLACE INTO registrations ({_COLUMNS}) VALUES (?, ?, ?, ?, ?, ?)",  # noqa: S608
            *vars(record).values(),
        )

    def replace(self, component: str, item_id: str) -> None:
        """Remember the UUID that the server chose itself."""
        self._write("UPDATE registrations SET item_id = ? WHERE component = ?", item_id, component)

    def done(self, component: str, document_uid: str = "") -> None:
        """Note that the component's file names its item."""
        changed = "UPDATE registrations SET finished_at = ?, document_uid = ? WHERE component = ?"
        self._write(changed, self._clock(), document_uid, component)

    def forget(self, component: str) -> None:
        """Forget a component: the server made no item for it, or it was taken back."""
        self._write("DELETE FROM registrations WHERE component = ?", component)

    def item_ids(self) -> frozenset[str]:
        """Return the items of all components in this journal."""
        return frozenset(record.item_id for record in self._records("TRUE"))

    @contextmanager
    def turn(
        self, path: str, component: str, tell: Callable[[str], object] = lambda _text: None
    ) -> Iterator[Turn]:
        """Hold the folder of a component's file while the component is registered, on any computer, so that
        two processes never make an item for the same component. No project waits for the server of another.

        ``tell`` receives who else registers there, if that takes long. Raises InputError.
        """
        folder = os.path.dirname(path)
        with folder_lock(folder, ".silo-register.lock", "registered", self._patience, tell) as unseen:
            yield Turn(self, path, component, unseen)

    def _records(self, where: str, *values: str) -> list[RegistrationRecord]:
        with self._open() as db:
            rows = db.execute(f"SELECT {_COLUMNS} FROM registrations WHERE {where}", values)  # noqa: S608
            return [RegistrationRecord(*row) for row in rows]

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
                message(
                    "{path}: the journal of registrations cannot be read ({error}). Mend or move it; "
                    "items of an interrupted run may then exist without a file that names them.",
                    path=self.path,
                    error=error,
                )
            ) from error

    def _connect(self) -> sqlite3.Connection:
        private_folder(self.path.parent)
        private_file(self.path)  # before SQLite opens it
        return sqlite3.connect(self.path, timeout=20.0, isolation_level=None)


class Turn:
    """The registration of one component, while nothing else is registered in its folder.

    unseen
        why other computers see nothing of it but the component's file; "" if they do.
    """

    def __init__(self, journal: Journal, path: str, component: str, unseen: str) -> None:
        self.journal, self.component, self.unseen = journal, component, unseen
        self._path = path

    def begin(self, carried: str, document_uid: str) -> tuple[RegistrationRecord, bool]:
        """Begin, or continue what this or another computer began with the same document
        (:meth:`Journal.begin`). Raises InputError."""
        beside = begun_beside(self._path, self.component, document_uid)
        record, begun = self.journal.begin(self.component, carried, beside)
        if not self.unseen:
            try:
                self._reserve(replace(record, document_uid=document_uid))
            except FileNotFoundError:  # no such folder: nothing else is in it
                pass
            except OSError as error:
                self.unseen = why_refused(error)
        return record, begun

    def replace(self, item_id: str) -> None:
        """Remember the UUID that the server chose itself."""
        self.journal.replace(self.component, item_id)

    def done(self, document_uid: str) -> None:
        """Note that the component's file names its item."""
        self.journal.done(self.component, document_uid)
        self._release()

    def forget(self) -> None:
        """Forget a component: the server certainly made no item for it."""
        self.journal.forget(self.component)
        self._release()

    def _release(self) -> None:
        with suppress(OSError):  # what stays is found in the file first, or continued by the same document
            self._reserve(None)

    def _reserve(self, record: RegistrationRecord | None) -> None:
        path, name = _beside(self._path), os.path.basename(self.component)
        others = {key: value for key, value in _reserved(path).items() if key != name}
        if record is not None:
            others[name] = {k: v for k, v in asdict(record).items() if k not in ("component", "finished_at")}
        if others:
            with replacing(path, mode=0o666) as file:  # the next one may be another user
                file.write(json.dumps(others, indent=1).encode())
        elif os.path.lexists(path):
            remove_patiently(path)


def begun_beside(path: str, component: str, document_uid: str) -> RegistrationRecord | None:
    """Read what a computer began for a component, from the note in the folder of its file.

    document_uid
        FreeCAD's own UUID of the present file; another file of the same name continues nothing.

    Raises InputError.
    """
    reservation = _reserved(_beside(path)).get(os.path.basename(component))
    if reservation is None or not document_uid or reservation["document_uid"] != document_uid:
        return None
    return RegistrationRecord(
        component, reservation["wanted"], reservation["item_id"], "", float(reservation["begun_at"]), None
    )


def _beside(path: str) -> str:
    return os.path.join(os.path.dirname(path), RESERVED)


def _reserved(path: str) -> dict[str, dict[str, Any]]:
    """Read the registrations begun in a folder, by ``file#object``."""
    try:
        with open(path, encoding="utf-8") as file:
            reserved = json.load(file)
        for note in reserved.values():
            uuid.UUID(note["wanted"])
            float(note["begun_at"])
            if not isinstance(note["item_id"], str) or not isinstance(note["document_uid"], str):
                raise TypeError("UUIDs are texts")
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
        raise InputError(
            message(
                "{path}: what another computer began to register here cannot be read ({error}). "
                "Register on that computer, or delete this file: an item that was begun may then "
                "be made a second time.",
                path=path,
                error=repr(error),
            )
        ) from error
    return dict(reserved)
