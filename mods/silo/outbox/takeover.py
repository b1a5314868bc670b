# SPDX-License-Identifier: LGPL-2.1-or-later
"""What older versions left waiting: the first outbox, and the folder of commits that lay before it.

Until this version a commit waited in ``commits/<key>/`` (``commit.json`` and a copy) for its part number,
then as one or two rows of the first outbox. Nothing of it is lost, also not what an older version had set
aside as ``commit.unreadable`` because the disk did not answer for a moment.
"""

from __future__ import annotations

import json
import shutil
import sqlite3
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from silo.api.address import canonical
from silo.bom.errors import DocumentError, SiloError
from silo.bom.snapshot import from_plain
from silo.durable import remove_patiently
from silo.outbox.database import insert
from silo.outbox.entry import Commit, State
from silo.outbox.store import Store

_NAMES = ("commit.json", "commit.unreadable")
_WAITING = {"waiting": State.WAITING, "rejected": State.HELD}


def of_first_outbox(db: sqlite3.Connection) -> None:
    """Bring the rows of ``entry1`` and ``sent1`` into the tables of today, with their ids; inside a
    transaction."""
    for row in db.execute("SELECT * FROM entry1 ORDER BY id").fetchall():
        payload = json.loads(row["payload"])
        is_file = row["kind"] == "file"
        values: dict[str, Any] = {
            name: row[name]
            for name in ("id", "key", "part_number", "taken_at", "reason", "attempts", "next_attempt")
        }
        values |= {"server": canonical(row["server"]), "state": _WAITING[row["state"]]}
        if is_file:
            values |= {
                "path": str(payload.get("path", "")),
                "base_revision": row["base_revision"],
                "file_left": True,
                **{name: payload.get(name, "") for name in ("file_name", "copy", "sha256", "comment")},
                "size": payload.get("size", 0),
                "properties": json.dumps(payload.get("properties") or {}),
            }
        else:
            # The request has its own sync_id, which is the commit's name in the folder of that time.
            values |= {"path": "", "bom_left": True, "request": row["payload"]}
        insert(db, values)
    db.execute(
        "INSERT OR IGNORE INTO sent SELECT server, part_number, kind, entry_id FROM sent1 ORDER BY "
        "entry_id DESC"
    )
    for server in {str(row[0]) for row in db.execute("SELECT server FROM sent")}:
        db.execute("UPDATE OR IGNORE sent SET server = ? WHERE server = ?", (canonical(server), server))
    # The next id must be newer than all that were sent, or they would look superseded.
    db.execute("DROP TABLE entry1")
    db.execute("DROP TABLE sent1")
    newest = db.execute("SELECT max(entry_id) FROM sent").fetchone()[0] or 0
    if newest > (db.execute("SELECT max(id) FROM entry").fetchone()[0] or 0):
        db.execute("DELETE FROM sqlite_sequence WHERE name = 'entry'")
        db.execute("INSERT INTO sqlite_sequence VALUES ('entry', ?)", (newest,))


def of_commit_folder(store: Store, folder: Path) -> tuple[str, ...]:
    """Bring what waits in the folder into the outbox, oldest first; to be called under the send lock.

    A commit's folder goes when its row is there. What cannot be read now stays for the next time, and is
    returned.
    """
    found, left = [], []
    for name in _NAMES:
        for path in folder.glob(f"*/{name}"):
            try:
                found.append((*_read(path), path.parent))
            except OSError as error:
                left.append(f"{path.parent}: {error.strerror or error}")
    for commit, sha256, reason, place in sorted(found, key=lambda one: (one[0].taken_at, one[0].key)):
        try:
            _take(store, commit, sha256, reason)
        except DocumentError as error:
            left.append(str(error))
        else:
            shutil.rmtree(place, ignore_errors=True)
    with suppress(OSError):
        remove_patiently(folder / "lock.sqlite3")
        folder.rmdir()
    return tuple(left)


def _take(store: Store, commit: Commit, sha256: str, reason: str) -> None:
    if _is_there(store, commit):
        return
    entry = store.add(commit)
    if not reason and commit.file is not None and entry.sha256 != sha256:
        reason = "the copy that an older version kept was cut short; commit the document again"
    if reason:
        store.update(entry.id, state=State.HELD, reason=reason)


def _read(path: Path) -> tuple[Commit, str, str]:
    """The commit, its file's hash, and what a person has to know of damage. OSError where it cannot be read
    now."""
    text = path.read_text(encoding="utf-8", errors="replace")
    files = [file for file in path.parent.iterdir() if file.name not in _NAMES]
    copy = files[0] if len(files) == 1 else None
    try:
        data = json.loads(text)
        commit = _commit(path.parent, data, copy)
    except (SiloError, ValueError, KeyError, TypeError, AttributeError) as error:
        name = copy.name if copy is not None else path.parent.name
        damaged = Commit(
            path=name,
            label=name,
            taken_at=path.stat().st_mtime,
            key=path.parent.name,
            file=copy,
            request="{}",
        )
        return damaged, "", f"what an older version kept of this commit is damaged ({error}); commit it again"
    if data["file"] and copy is None:
        return commit, "", "the copy that an older version kept is gone; commit it again"
    return commit, str(data["sha256"]), ""


def _commit(folder: Path, data: Mapping[str, Any], copy: Path | None) -> Commit:
    snapshot = data["snapshot"]
    bom = snapshot.get("bom") if data["sync_bom"] else None
    # A row needs something to send; this one then says that the copy is gone.
    request = "{}" if bom is None and (copy is None or not data["file"]) else ""
    return Commit(
        key=folder.name,
        path=str(snapshot["path"]),
        label=str(snapshot["label"]),
        identity=str(snapshot["identity"] or ""),
        taken_at=float(data["taken_at"]),
        comment=str(data["comment"]),
        file=copy if data["file"] else None,
        extraction=from_plain(bom) if bom is not None else None,
        request=request,
        allow_missing=bool(data["allow_missing"]),
        remark=str(snapshot["problem"]),
    )


def _is_there(store: Store, commit: Commit) -> bool:
    """True where the outbox has this commit: handed over, and killed before the folder was removed."""
    for entry in store.entries():
        if entry.key == commit.key or (entry.file_left and entry.taken_at == commit.taken_at):
            return True
        request = store.bom(entry.id)[1]
        if request and f'"{commit.key}"' in request:
            return True
    return False
