# SPDX-License-Identifier: LGPL-2.1-or-later
"""Commits that were taken and have not reached the outbox: the first thing a commit does is to lie here.

The outbox (:mod:`silo.api.outbox`) holds requests with part numbers, and only the server knows those. So a
commit waits here, with identities as the documents have them, until the server has answered once; this may
be days later and after a crash. Each commit has a folder with a copy of its document; it counts from the
moment its JSON file is there, whole.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import sqlite3
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from uuid import uuid4

from silo.bom.errors import InputError
from silo.durable import replacing
from silo.folders import data_folder
from silo.workbench.commit.snapshot import Snapshot, from_json, to_json

_COMMIT = "commit.json"
_UNREADABLE = "commit.unreadable"
_ORPHAN_AGE = 3600.0


@dataclass(frozen=True)
class Commit:
    """A commit that waits.

    key
        names it for ever; it is the BOM's ``sync_id`` too, so that sending it twice does no harm.
    file, sha256
        the copy of the document; None and "" where only the BOM is to be synced.
    taken_at
        seconds since 1970, UTC.
    allow_missing
        sync the BOM although links are broken.
    """

    key: str
    snapshot: Snapshot
    taken_at: float
    comment: str = ""
    file: Path | None = None
    sha256: str = ""
    sync_bom: bool = True
    allow_missing: bool = False


def new_key() -> str:
    """A name for a commit."""
    return str(uuid4())


class Spool:
    """The folder of commits. Each method may be called from any thread, and beside other FreeCADs.

    folder
        made where it is missing, readable by its owner only.
    """

    def __init__(self, folder: Path | None = None, clock: Callable[[], float] = time.time) -> None:
        self.folder = folder or data_folder() / "commits"
        self._clock = clock

    def hold(self, path: str, key: str) -> Path | None:
        """Keep a file's present content by a second name for it, which takes no time; None where it cannot.

        FreeCAD writes a new file at each save and renames it, so the old content lives on under this name.
        """
        try:
            held = self._folder(key) / os.path.basename(path)
            os.link(path, held)
        except (OSError, InputError):
            return None
        return held

    def add(self, commit: Commit) -> Commit:
        """Put a commit aside, with a copy of its file; on disk when it returns."""
        folder = self._folder(commit.key)
        file = commit.file
        if file is not None:
            file = self._own(file, folder)
            commit = replace(commit, file=file, sha256=_sha256(file))
        data = {
            "key": commit.key,
            "taken_at": commit.taken_at,
            "comment": commit.comment,
            "file": file.name if file is not None else None,
            "sha256": commit.sha256,
            "sync_bom": commit.sync_bom,
            "allow_missing": commit.allow_missing,
            "snapshot": to_json(commit.snapshot),
        }
        _write(folder / _COMMIT, data)
        return commit

    def waiting(self) -> tuple[Commit, ...]:
        """All commits, oldest first. One that cannot be read is set aside: not lost, and not in the way."""
        found = []
        for path in self.folder.glob(f"*/{_COMMIT}"):
            try:
                found.append(_read(path))
            except FileNotFoundError:
                continue
            except (OSError, ValueError, KeyError, TypeError, InputError):
                path.replace(path.with_name(_UNREADABLE))
        return tuple(sorted(found, key=lambda commit: (commit.taken_at, commit.key)))

    def remove(self, commit: Commit) -> None:
        """Forget a commit: it is in the outbox, or a person discarded it."""
        folder = self.folder / commit.key
        # The JSON file first: without it the rest is only rubbish, which is swept up later.
        (folder / _COMMIT).unlink(missing_ok=True)
        shutil.rmtree(folder, ignore_errors=True)

    @contextmanager
    def forwarding(self) -> Iterator[bool]:
        """True for the one process that may hand commits over now; the system ends it with the process."""
        self._prepare()
        try:
            with closing(
                sqlite3.connect(self.folder / "lock.sqlite3", timeout=0, isolation_level=None)
            ) as db:
                try:
                    db.execute("BEGIN EXCLUSIVE")
                except sqlite3.OperationalError:
                    yield False
                    return
                yield True
        except sqlite3.Error as error:
            raise InputError(f"{self.folder}: cannot be locked for sending ({error})") from error

    def sweep(self) -> None:
        """Remove what a crash left: copies whose commit never came to be."""
        for folder in self.folder.glob("*/"):
            try:
                old = self._clock() - folder.stat().st_mtime > _ORPHAN_AGE
                if old and not (folder / _COMMIT).exists() and not (folder / _UNREADABLE).exists():
                    shutil.rmtree(folder, ignore_errors=True)
            except OSError:
                continue

    def _folder(self, key: str) -> Path:
        self._prepare()
        folder = self.folder / key
        folder.mkdir(mode=0o700, exist_ok=True)
        return folder

    def _prepare(self) -> None:
        try:
            self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(
                f"{self.folder}: commits cannot be kept there ({error.strerror or error}); nothing was sent. "
                "Make room or mend its permissions, then commit again"
            ) from error

    def _own(self, file: Path, folder: Path) -> Path:
        """A copy in the commit's folder. What is held there under a second name is not one yet.

        Not every program that changes a file writes a new one.
        """
        if file.parent != folder:
            return self._copy(file, folder / file.name)
        if file.exists() and file.stat().st_nlink > 1:
            self._copy(file, folder / f"{file.name}.own").replace(file)
        return file

    def _copy(self, file: Path, target: Path) -> Path:
        try:
            shutil.copyfile(file, target)
        except OSError as error:
            raise InputError(
                f"{file}: cannot be kept for sending ({error.strerror or error}); commit it again"
            ) from error
        return target


def _sha256(path: Path) -> str:
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error}); commit it again") from error


def _write(path: Path, data: dict[str, Any]) -> None:
    try:
        with replacing(path) as file:
            file.write(json.dumps(data).encode())
    except OSError as error:
        raise InputError(
            f"{path}: the commit cannot be kept ({error.strerror or error}); make room and commit again"
        ) from error


def _read(path: Path) -> Commit:
    data = json.loads(path.read_text(encoding="utf-8"))
    file = path.parent / os.path.basename(data["file"]) if data["file"] else None
    if file is not None and not file.is_file():
        raise InputError(f"{file}: the copy is gone")
    return Commit(
        key=path.parent.name,
        snapshot=from_json(data["snapshot"]),
        taken_at=float(data["taken_at"]),
        comment=str(data["comment"]),
        file=file,
        sha256=str(data["sha256"]),
        sync_bom=bool(data["sync_bom"]),
        allow_missing=bool(data["allow_missing"]),
    )
