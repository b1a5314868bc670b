# SPDX-License-Identifier: LGPL-2.1-or-later
"""The outbox on disk: a row for each commit (:mod:`silo.outbox.database`), beside it the copies of their
files.

The rules of this module:

* a row is there before any file of it, and gone before they are: a file whose row is gone may be removed at
  once, and nothing else may;
* a copy has its name only when it is whole and on disk, and its row the copy's hash;
* several processes may share the file; who sends holds the send lock, which ends with its process;
* a disk error leaves things as they are. Damage is a hash that differs or a BOM that cannot be parsed.

Standard library only: the first commit of a session must not wait for imports.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import sqlite3
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import fields
from pathlib import Path
from typing import Any

from silo.api.address import canonical
from silo.bom.errors import ConflictError, DocumentError, InputError
from silo.bom.report import to_plain
from silo.durable import remove_patiently, replacing, stamp_of
from silo.files import content_hash, seen_as
from silo.folders import data_folder
from silo.outbox.database import Origins, OutboxError
from silo.outbox.entry import ASKED, SAME_PART, Commit, Entry, State

_BLOCK = 1 << 20
# A second name that no row has is one for which a commit may just be coming.
_HELD_AGE = 3600.0

# All but what may be large.
_COLUMNS = ", ".join(one.name for one in fields(Entry) if one.name != "superseded")
_SELECT = f"""SELECT {_COLUMNS}, EXISTS (
    SELECT 1 FROM sent s WHERE s.server = e.server AND s.item IN (e.identity, e.part_number) AND s.item <> ''
    AND s.entry_id > e.id AND (s.kind = 'file' AND e.file_left OR s.kind = 'bom' AND e.bom_left)
) AS superseded FROM entry e"""  # noqa: S608

# What of a commit goes into its row as it is.
_AS_GIVEN = (
    *("key", "path", "label", "identity", "part_number", "taken_at", "comment", "allow_missing", "remark"),
    *("sha256", "request", "origin", "on_top_of"),
)


class _WrittenError(OSError):
    """The file has another content by now."""


class Store(Origins):
    """Rows and copies. Any thread may call the methods, and other processes share the file.

    path
        the database; in the user's data folder unless given.
    """

    def __init__(self, path: Path | None = None, *, clock: Callable[[], float] = time.time) -> None:
        super().__init__(path or data_folder() / "outbox.sqlite3", clock)
        self._held = self.path.parent / f"{self.path.stem}-held"
        self._coming: set[str] = set()

    # -- a commit comes in ------------------------------------------------------------------------------

    def hold(self, path: str, key: str) -> Path | None:
        """Keep a file's present content by a second name, which takes no time; None where it cannot.

        FreeCAD writes a new file at each save and renames it, so the old content lives on under this name.
        """
        held = self._held / key / os.path.basename(path)
        try:
            held.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            os.link(path, held)
        except OSError:
            return None
        if stamp_of(held) != stamp_of(path):
            # Some network disks give each name of a file a number of its own: a later look at the second name
            # would take it for another file.
            with suppress(OSError):
                remove_patiently(held)
            return None
        return held

    def stage(self, commit: Commit, server: str = "") -> None:
        """Put a commit's row on disk, which takes no time; the caller then calls :meth:`finish`."""
        if commit.file is None and commit.extraction is None and not commit.request:
            raise InputError(f"{commit.path or commit.part_number}: neither a file nor a BOM to keep")
        row = {name: getattr(commit, name) for name in _AS_GIVEN} | {
            "server": canonical(server) if server else "",
            "state": State.KEEPING if commit.file is not None else State.WAITING,
            "stamp": json.dumps(commit.stamp) if commit.stamp else "",
            "file_left": commit.file is not None,
            "file_name": os.path.basename(commit.path) or (commit.file.name if commit.file else ""),
            "copy": f"{commit.key}{commit.file.suffix[:20]}" if commit.file is not None else "",
            "bom_left": bool(commit.extraction is not None or commit.request),
            "extraction": json.dumps(to_plain(commit.extraction)) if commit.extraction is not None else "",
        }
        if commit.file is not None:
            self._coming.add(commit.key)
        try:
            with self.transaction() as db:
                db.execute(f"INSERT INTO entry ({', '.join(row)}) VALUES (:{', :'.join(row)})", row)  # noqa: S608
        except BaseException:
            self._coming.discard(commit.key)
            raise

    def is_coming(self, key: str) -> bool:
        """True where this program staged a commit and is about to copy its file: nobody else does it then."""
        return key in self._coming

    def finish(self, key: str, source: Path | None = None, origin: str = "") -> str:
        """Make the copy of a staged commit's file, from its second name rather than from ``source``.

        Where the disk does not take it, a commit with a second name stays and is tried again later. One
        without is forgotten, and DocumentError says so. With an OutboxError the commit stays. A file that
        was written since the commit is not sent.

        ``origin`` replaces that of the commit: the commit before it may have been copied only now. Returns
        the file's SHA-256, "" where there is no copy of it.
        """
        try:
            self._finish(key, source, origin)
        finally:
            self._coming.discard(key)
        entry = self.by_key(key)
        return entry.sha256 if entry is not None else ""

    def _finish(self, key: str, source: Path | None, origin: str) -> None:
        entry = self.by_key(key)
        if entry is None or not entry.file_left or entry.sha256:
            return
        held, copy = next(iter((self._held / key).glob("*")), None), self.copies / entry.copy
        # A copy that has its name is whole: only its row was not written any more.
        content = copy if copy.exists() else held or source
        if content is None:
            text = "its file was not copied in time; commit it again, then discard this"
            self.update(entry.id, state=State.HELD, reason=text)
            return
        try:
            sha256, size = self._copied(content, copy, entry.stamp)
        except _WrittenError as error:
            if held is not None:
                told = f"{entry.path or entry.file_name}: {error}; commit it again, then discard this"
                self.update(entry.id, state=State.HELD, reason=told)
                return
            raise self._lost(entry, content, str(error)) from error
        except OSError as error:
            told = f"cannot be copied for sending ({error.strerror or error})"
            if held is not None or content is copy:
                self.update(entry.id, reason=f"{entry.path or entry.file_name}: {told}; it is tried again")
                return
            raise self._lost(entry, content, told) from error
        known = {"origin": origin} if origin and entry.origin else {}
        place = _place(copy, entry.path)
        self.update(entry.id, state=State.WAITING, sha256=sha256, size=size, reason="", **place, **known)
        shutil.rmtree(self._held / key, ignore_errors=True)

    def _lost(self, entry: Entry, content: Path, reason: str) -> DocumentError:
        with suppress(OutboxError):  # a row that stays has no file: the next sending holds it and says so
            self.discard(entry.id)
        return DocumentError(str(content), f"{reason}; nothing was kept, commit it again")

    def add(self, commit: Commit, server: str = "") -> Entry:
        """Both at once: on disk with its copy when it returns."""
        self.stage(commit, server)
        self.finish(commit.key, commit.file)
        entry = self.by_key(commit.key)
        if entry is None:
            raise InputError(f"{commit.path}: discarded while it was kept")
        return entry

    # -- what a person decides --------------------------------------------------------------------------

    def retry(self, entry_id: int, server: str | None = None) -> None:
        """Let an entry go again with the next sending; ``server`` sends it there instead (the server moved).

        For a file of another name than the item's this is a person's word that it is the same part. Raises
        :class:`ConflictError` where something newer of the same item has arrived since.
        """
        entry = self._known(entry_id)
        if entry.superseded:
            raise ConflictError(
                f"{entry.part_number or entry.label}: a newer commit of it was sent since, and this one "
                "would undo it. Discard it"
            )
        ready = State.WAITING if entry.sha256 or not entry.file_left else State.KEEPING
        changed: dict[str, Any] = {"state": ready, "reason": "", "next_attempt": 0.0}
        changed["renamed"] = SAME_PART if entry.renamed == ASKED else entry.renamed
        if entry.newer:
            changed |= {"on_top_of": seen(entry.newer), "newer": ""}
            changed["comment"] = on_top(entry.comment, entry.newer)
        if server is not None and canonical(server) != entry.server:
            # What was seen of the old server says nothing of the new one.
            changed |= {"server": canonical(server), "base_revision": None, "on_top_of": ""}
            changed |= {"revision": None, "comment": entry.comment}
        if self.bom(entry_id)[0]:
            # What was refused is made anew: the missing part may have its number now.
            changed["request"] = ""
        self.update(entry_id, **changed)

    def discard(self, entry_id: int, *, keep: bool = False) -> None:
        """Forget an entry and its copy; the document itself is not touched.

        ``keep``: the copy is kept aside first.
        """
        entry = self._known(entry_id)
        if keep and entry.file_left:
            self.save_copy(entry_id, self.aside(entry.file_name))
        with self.transaction() as db:
            db.execute("DELETE FROM entry WHERE id = ?", (entry_id,))
        self._drop_files(entry)

    def save_copy(self, entry_id: int, target: Path) -> None:
        """Write an entry's file somewhere else, as it is, also where it is damaged."""
        entry = self._known(entry_id)
        held = next(iter((self._held / entry.key).glob("*")), None)
        try:
            with open(held or self.copies / entry.copy, "rb") as read, replacing(target, mode=0o644) as out:
                shutil.copyfileobj(read, out, _BLOCK)
        except OSError as error:
            raise DocumentError(str(target), f"cannot be written ({error.strerror or error})") from error

    # -- reading and changing ---------------------------------------------------------------------------

    def entries(self) -> tuple[Entry, ...]:
        """All entries, oldest first."""
        with self._open() as db:
            return tuple(_entry(row) for row in db.execute(f"{_SELECT} ORDER BY e.id"))

    def entry(self, entry_id: int) -> Entry | None:
        """One entry, None where it is gone."""
        return self._one("e.id = ?", entry_id)

    def by_key(self, key: str) -> Entry | None:
        """The entry of a commit, None where it is gone."""
        return self._one("e.key = ?", key)

    def next_due(self, server: str, after: int) -> Entry | None:
        """The oldest entry for a server that is newer than ``after`` and no person has to look at."""
        where = "e.state <> 'held' AND e.server IN ('', ?) AND e.id > ? ORDER BY e.id LIMIT 1"
        return self._one(where, canonical(server), after)

    def bom(self, entry_id: int) -> tuple[str, str]:
        """Extraction and merge request of an entry, as JSON; "" where there is none."""
        with self._open() as db:
            row = db.execute("SELECT extraction, request FROM entry WHERE id = ?", (entry_id,)).fetchone()
        return (str(row[0]), str(row[1])) if row else ("", "")

    def update(self, entry_id: int, **values: Any) -> None:
        """Set columns of an entry."""
        columns = ", ".join(f"{name} = :{name}" for name in values)
        with self.transaction() as db:
            db.execute(f"UPDATE entry SET {columns} WHERE id = :id", {**values, "id": entry_id})  # noqa: S608

    def arrived(
        self,
        entry: Entry,
        kind: str,
        revision: int | None = None,
        *,
        base: int | None = None,
        note: bool = True,
    ) -> None:
        """The server has its file or its BOM. An entry of which nothing is left is gone, with its copy; until
        then a server that is restored from a backup may need the copy once more.

        base
            the revision that the file was made from. A BOM of that one which a person still has to look at
            may be sent although its file is no longer the newest: all that is newer comes from here.
        note
            False: it was not sent, and makes nothing older out of date.
        """
        left = entry.bom_left if kind == "file" else entry.file_left
        with self.transaction() as db:
            if left:
                changes = "file_left = 0, revision = ?" if kind == "file" else "bom_left = 0, revision = ?"
                number = revision if kind == "file" else entry.revision
                db.execute(f"UPDATE entry SET {changes} WHERE id = ?", (number, entry.id))  # noqa: S608
            else:
                db.execute("DELETE FROM entry WHERE id = ?", (entry.id,))
            if base is not None:
                db.execute(
                    "UPDATE entry SET revision = ? WHERE server = ? AND identity = ? AND revision = ?"
                    " AND NOT file_left",
                    (revision, entry.server, entry.identity, base),
                )
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
        """The copy, after its hash was looked at. InputError where it is damaged, OSError where it cannot
        be read."""
        path = self.copies / entry.copy
        if content_hash(path) != entry.sha256:
            raise InputError(
                f"{entry.path or entry.file_name}: the copy kept for sending is damaged, so it was not sent. "
                "Commit the document again, then discard this"
            )
        return path

    def sweep(self) -> None:
        """Remove files whose row is gone, second names without a commit, and what was kept aside long ago."""
        self._make_ready()
        self.forget_aside()
        with suppress(OSError):
            # Files first, then rows: a file's row was there before it.
            files = [*self.copies.iterdir()]
            held = [*self._held.iterdir()] if self._held.is_dir() else []
            keys = {entry.key for entry in self.entries()}
            for file in files:
                if _key_of(file.name) not in keys:
                    with suppress(OSError):
                        remove_patiently(file)
            for folder in held:
                if folder.name not in keys and self.clock() - folder.stat().st_mtime > _HELD_AGE:
                    shutil.rmtree(folder, ignore_errors=True)

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
                raise _WrittenError("it was written again since the commit")
        return digest.hexdigest(), size

    def _drop_files(self, entry: Entry) -> None:
        """Remove what the row had; what cannot be removed now is swept up later."""
        with suppress(OSError):
            for name in os.listdir(self.copies):
                if _key_of(name) == entry.key:
                    remove_patiently(self.copies / name)
        shutil.rmtree(self._held / entry.key, ignore_errors=True)

    def _one(self, where: str, *values: Any) -> Entry | None:
        with self._open() as db:
            row = db.execute(f"{_SELECT} WHERE {where}", values).fetchone()
        return _entry(row) if row else None

    def _known(self, entry_id: int) -> Entry:
        entry = self.entry(entry_id)
        if entry is None:
            raise InputError(f"the outbox has no entry {entry_id}; it was sent or discarded meanwhile")
        return entry


def on_top(comment: str, newer: Mapping[str, Any]) -> str:
    """The comment of a revision that a person sends on top of a colleague's, which says so."""
    who = f" by {newer['created_by']}" if newer.get("created_by") else ""
    note = f"(on top of revision {newer['revision_number']}{who}, which is not in it)"
    return f"{comment} {note}".strip()


def seen(newer: Mapping[str, Any]) -> str:
    """What names a colleague's revision that a person saw."""
    return seen_as(newer["revision_number"], newer.get("file_checksum"))


def _place(copy: Path, path: str) -> dict[str, str]:
    """Where the file is and what it links to; nothing where it is no FreeCAD file."""
    if not path:
        return {}
    from silo.fcstd.linked import place_of

    try:
        place = place_of(copy, path)
    except InputError:
        return {}
    return {"place": place.path, "links": json.dumps(place.as_dicts())}


_FLAGS = ("file_left", "bom_left", "allow_missing", "superseded")


def _entry(row: sqlite3.Row) -> Entry:
    values = dict(row)
    values["state"] = State(values["state"])
    values["newer"] = json.loads(values["newer"]) if values["newer"] else {}
    return Entry(**values | {name: bool(values[name]) for name in _FLAGS})


def _key_of(copy: str) -> str:
    """Whose copy it is; one that is being made, or was cut off, has a point before its name."""
    return copy.lstrip(".").split(".")[0]
