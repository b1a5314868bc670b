# SPDX-License-Identifier: LGPL-2.1-or-later
"""A project folder: the file that marks its root and remembers its files."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from silo.bom.errors import DocumentError
from silo.folder_lock import folder_lock
from silo.platform import one_path, read_memory, replacing

PROJECT_FILE = ".silo-project.json"
_PATIENCE_S = 10.0


@dataclass(frozen=True)
class ProjectEntry:
    """What a project remembers of a file, by its path relative to the root, with ``/``.

    document
        the UUID of the file in Silo: that of its item, or its own.
    sha256
        the content that is in Silo or on its way there; "" before the first commit.
    uid
        FreeCAD's UUID of the document. A copy has it too, so it shows a new name only if the old one is gone.
    """

    document: str
    sha256: str = ""
    uid: str = ""


@dataclass(frozen=True)
class Project:
    """A project folder. The file :data:`PROJECT_FILE` marks its root and remembers its files; who shares or
    copies the folder shares that too."""

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

    def files(self) -> dict[str, ProjectEntry]:
        """Read what is remembered of each file, by its place."""
        files_noted = read_memory(Path(self.root, PROJECT_FILE)).get("files")
        names = {values.name for values in fields(ProjectEntry)}
        return {
            str(place): ProjectEntry(**{key: str(value) for key, value in values.items() if key in names})
            for place, values in (files_noted.items() if isinstance(files_noted, dict) else ())
            if isinstance(values, dict) and values.get("document")
        }

    def note(self, noted: Mapping[str, ProjectEntry | None]) -> None:
        """Remember these files; None forgets one. Raises DocumentError if the folder cannot be written."""
        try:
            with folder_lock(self.root, f"{PROJECT_FILE}.lock", "written", _PATIENCE_S):
                files = {place: asdict(kept) for place, kept in self.files().items() if place not in noted}
                files |= {place: asdict(kept) for place, kept in noted.items() if kept is not None}
                with replacing(Path(self.root, PROJECT_FILE), mode=0o644) as out:
                    out.write(json.dumps({"files": files}, indent=1, sort_keys=True).encode())
        except OSError as error:
            raise DocumentError(
                os.path.join(self.root, PROJECT_FILE), f"cannot be written ({error.strerror or error})"
            ) from error
