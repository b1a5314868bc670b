# SPDX-License-Identifier: LGPL-2.1-or-later
"""A project folder, and the record of each of its files: which revision the bytes on disk come from.

There is one record of a file. Pull writes it when a revision arrives here, the queue when a commit has
arrived in Silo; a commit that waits changes no record. Window, command line, queue and pull read it.

The records lie in the project's folder (:data:`PROJECT_FILE`), so that each user who shares or copies
the folder has the files and what they come from. Where that cannot be written, and for a file of no project,
they are the user's own (:data:`OWN_RECORDS` in the user's data folder).
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from silo.bom.errors import DocumentError
from silo.bom.message import message
from silo.bom.system_refusals import why_refused
from silo.folder_lock import folder_lock
from silo.platform.memory_file import read_memory
from silo.platform.spelling import one_path
from silo.platform.user_folders import data_folder
from silo.platform.whole_files import replacing

PROJECT_FILE = ".silo-project.json"
OWN_RECORDS = "records.json"
_PATIENCE_S = 10.0


@dataclass(frozen=True)
class FileRecord:
    """The record of one file.

    document
        the UUID of the file in Silo: that of its item, or its own; "" where only its content is known.
    sha256
        the content that arrived with the revision; "" before the first one.
    uid
        FreeCAD's UUID of the document. A copy has it too, so it shows a new name only if the old one is gone.
    revision, server, created
        the revision, the server that has it (:func:`silo.api.address.canonical`), and the time of the
        revision by the server's clock, in ISO form; a server that was set back has older ones only.
    since
        when the record was written here, in seconds since 1970: what was committed later is made from it.
    item
        True if the document is that of an item; a file that no longer has the identity is another document.
    former
        the document that the file was before, until the first revision of this one has arrived.
    """

    document: str
    sha256: str = ""
    uid: str = ""
    revision: int = 0
    server: str = ""
    created: str = ""
    since: float = 0.0
    item: bool = False
    former: str = ""

    @classmethod
    def of(cls, values: object) -> FileRecord | None:
        """Read what :meth:`as_dict` wrote; None for anything else. Other keys are passed over."""
        if not isinstance(values, dict) or not (values.get("document") or values.get("sha256")):
            return None
        known: dict[str, Any] = {"document": ""}
        for name in (one.name for one in fields(cls) if one.name in values):
            kind: type[Any] = type(getattr(cls, name, ""))
            with suppress(TypeError, ValueError):
                known[name] = kind(values[name])
        return cls(**known)

    def as_dict(self) -> dict[str, Any]:
        """Return the values that say something, for JSON."""
        return {name: value for name, value in asdict(self).items() if value or name == "document"}

    def is_of(self, document: str) -> bool:
        """Return True if the record is that of this document."""
        return bool(self.document) and self.document.lower() == document.lower()


@dataclass(frozen=True)
class Project:
    """A project folder. The file :data:`PROJECT_FILE` marks its root and has the records of its files."""

    root: str

    @classmethod
    def of(cls, path: Path | str) -> Project | None:
        """Find the project of a file or folder; None if no folder above it is a project."""
        folder = one_path(os.fspath(path))
        while True:
            if os.path.isfile(os.path.join(folder, PROJECT_FILE)):
                return cls(folder)
            above = os.path.dirname(folder)
            if above == folder:
                return None
            folder = above

    def place(self, path: str) -> str | None:
        """Return the path of a file relative to the root, with ``/``; None if it is outside."""
        real = one_path(path)
        inside = real.startswith(os.path.join(self.root, ""))
        return os.path.relpath(real, self.root).replace(os.sep, "/") if inside else None

    def path(self, place: str) -> str:
        """Return the path of a file in the project."""
        return os.path.join(self.root, *place.split("/"))

    def records(self) -> dict[str, FileRecord]:
        """Read the record of each file, by its place; the newer one where the user has an own one too."""
        found = _records(read_memory(Path(self.root, PROJECT_FILE)).get("files"))
        inside = os.path.join(self.root, "")
        for path, own in _own_records().items():
            if path.startswith(inside):
                place = os.path.relpath(path, self.root).replace(os.sep, "/")
                if place not in found or found[place].since < own.since:
                    found[place] = own
        return found

    def note(self, noted: Mapping[str, FileRecord | None]) -> None:
        """Write the records of these files; None forgets one.

        Records of a folder that cannot be written are the user's own. Raises DocumentError if the user's data
        folder cannot be written either.
        """
        path = Path(self.root, PROJECT_FILE)
        try:
            with folder_lock(self.root, f"{PROJECT_FILE}.lock", "written", _PATIENCE_S):
                files = _records(read_memory(path).get("files"))
                files = {place: record for place, record in files.items() if place not in noted}
                files |= {place: record for place, record in noted.items() if record is not None}
                _write(path, files, mode=0o644)
        except OSError:
            _note_own({self.path(place): record for place, record in noted.items()})


def record_of(path: str) -> FileRecord | None:
    """Return the record of a file; None if there is none."""
    real = one_path(path)
    if (project := Project.of(os.path.dirname(real))) is not None:
        return project.records().get(project.place(real) or "")
    return _own_records().get(real)


def write_record(path: str, record: FileRecord | None) -> None:
    """Write the record of a file; None forgets it. Raises DocumentError."""
    real = one_path(path)
    if (project := Project.of(os.path.dirname(real))) is not None:
        project.note({project.place(real) or "": record})
    else:
        _note_own({real: record})


def now() -> float:
    """Return the time for :attr:`FileRecord.since`."""
    return time.time()


def _records(values: object) -> dict[str, FileRecord]:
    several = values.items() if isinstance(values, dict) else ()
    read = ((str(place), FileRecord.of(one)) for place, one in several)
    return {place: record for place, record in read if record is not None}


def _write(path: Path, records: Mapping[str, FileRecord], mode: int) -> None:
    files = {place: record.as_dict() for place, record in records.items()}
    with replacing(path, mode=mode) as out:
        out.write(json.dumps({"files": files}, indent=1, sort_keys=True).encode())


def _own_path() -> Path:
    return data_folder() / OWN_RECORDS


def _own_records() -> dict[str, FileRecord]:
    return _records(read_memory(_own_path()).get("files"))


def _note_own(noted: Mapping[str, FileRecord | None]) -> None:
    path = _own_path()
    if not noted and not path.exists():
        return
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with folder_lock(str(path.parent), f"{OWN_RECORDS}.lock", "written", _PATIENCE_S):
            files = {place: record for place, record in _own_records().items() if place not in noted}
            files |= {place: record for place, record in noted.items() if record is not None}
            _write(path, files, mode=0o600)
    except OSError as error:
        raise DocumentError(
            str(path), message("cannot be written ({error})", error=why_refused(error))
        ) from error
