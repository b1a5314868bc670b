# SPDX-License-Identifier: LGPL-2.1-or-later
"""From the path that a link records to a file on disk.

FreeCAD records paths relative to the folder of the owning file as it was opened, always with ``/``, and joins
them as text: ``..`` takes one name away, symlinks are not followed first (``src/App/PropertyLinks.cpp``,
observed with FreeCAD 0.20 and 1.0). We do the same, and try the folder where the owning file really lies
after that; FreeCAD 1.1 goes from there alone. Only if both ways lead to a file do the versions differ.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from silo.bom.findings import FindingCode
from silo.bom.message import message
from silo.platform.device_names import is_device_name
from silo.platform.spelling import Spelling, Spelt, folded

_URL = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+://")
_STREAM = re.compile(r"\.fcstd:", re.I)
_LONGEST, _DEEPEST = 4096, 128
_FOLDER_AT_MOST = 50_000


class FoundFile(NamedTuple):
    """A file. ``opened`` is the path as FreeCAD would open it, ``real`` has no symlinks in it."""

    opened: str
    real: str
    respelt: bool = False

    def is_straight(self, recorded: str, folder: str) -> bool:
        """Return True if the path itself leads to the file, so that the link finds it as long as it stays
        there.
        """
        return self.real == os.path.normpath(os.path.join(folder, recorded))


class NotFound(NamedTuple):
    """Why there is no file to open."""

    code: FindingCode
    detail: str = ""


@dataclass
class Locator:
    """Finds linked files, all below ``root`` where one is given; remembers folders for one session.

    remembers_files
        a file that was found is not looked for again.
    """

    root: str | None = None
    remembers_files: bool = False
    _files: dict[tuple[str, tuple[str, ...]], FoundFile] = field(default_factory=dict)
    _spelling: Spelling = field(default_factory=Spelling)
    _listings: dict[str, dict[str, list[str]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.root is not None:
            self.root = self._spelling.real(self.root)

    def real(self, path: str) -> str:
        """Return the one path of a file, without symlinks and spelt as its folders list it."""
        return self._spelling.look(path).path

    def inside(self, real_path: str) -> bool:
        """Return True if the file at a path without symlinks may be read."""
        root = self.root
        return root is None or real_path == root or real_path.startswith(os.path.join(root, ""))

    def find(self, recorded: str, folders: tuple[str, ...]) -> FoundFile | NotFound:
        """Find the file to which a link in a document in (one of) these folders leads."""
        if not self.remembers_files:
            return self._find(recorded, folders)
        found: FoundFile | NotFound | None = self._files.get((recorded, folders))
        if found is None:
            found = self._find(recorded, folders)
            if isinstance(found, FoundFile):
                self._files[recorded, folders] = found
        return found

    def learn(self, folders: tuple[str, ...], locations: Mapping[str, FoundFile]) -> None:
        """Remember where the paths of a document's links lead, as another session has just found."""
        for recorded, location in locations.items():
            self._files.setdefault((recorded, folders), location)

    def _find(self, recorded: str, folders: tuple[str, ...]) -> FoundFile | NotFound:
        if "://" in recorded and _URL.match(recorded):
            return NotFound(FindingCode.MISSING_FILE, message("it is a web address; only files are read"))
        if (refused := refusal(recorded)) is not None:
            return refused
        outside = False
        for path in _candidates(recorded, folders):
            spelt = self._spelling.look(path)
            if not self.inside(spelt.path):
                outside = True
            elif spelt.there:
                return FoundFile(path, spelt.path, respelt=_respelt_by_disk(recorded, spelt))
        if outside:
            return NotFound(FindingCode.OUTSIDE_ROOT)
        if recorded.count("/") > _DEEPEST:
            return NotFound(FindingCode.MISSING_FILE)
        return self._respelt(recorded, folders)

    def lies_straight(self, path: str) -> bool:
        """Return True if what is there has exactly this path: no folder is a symlink, and names are spelt as
        listed.
        """
        return self._spelling.is_plain(path)

    def _respelt(self, recorded: str, folders: tuple[str, ...]) -> FoundFile | NotFound:
        """Find the file that Windows or macOS would open (``part.FCStd`` for ``Part.FCStd``), if only one
        fits.
        """
        for path in _candidates(recorded, folders):
            matches = list(self._spellings(path))
            if len(matches) > 1:
                names = ", ".join(sorted(os.path.basename(match) for match in matches[:4]))
                return NotFound(
                    FindingCode.MISSING_FILE,
                    message(
                        "several files differ from it in case or Unicode form only: {names}", names=names
                    ),
                )
            if matches and self.inside(real := self.real(matches[0])):
                return FoundFile(matches[0], real, respelt=True)
        return NotFound(FindingCode.MISSING_FILE)

    def _spellings(self, path: str) -> Iterator[str]:
        folder, name = os.path.split(path)
        if not name or folder == path:
            return
        if os.path.isdir(folder):
            parents = [folder]
        else:
            parents = [p for p in self._spellings(folder) if os.path.isdir(p)][:2]
        for parent in parents:
            if self.inside(os.path.realpath(parent)):
                for match in self._listing(parent).get(folded(name), ()):
                    yield os.path.join(parent, match)

    def _listing(self, folder: str) -> dict[str, list[str]]:
        listing = self._listings.get(folder)
        if listing is None:
            listing = self._listings[folder] = {}
            try:
                with os.scandir(folder) as entries:
                    for _, item in zip(range(_FOLDER_AT_MOST), entries, strict=False):
                        listing.setdefault(folded(item.name), []).append(item.name)
            except OSError:
                pass  # a folder that cannot be listed shows nothing
        return listing


def refusal(recorded: str) -> NotFound | None:
    """Return why a recorded path is not even looked for; None if it may be.

    The rules are those of Windows, on which even a look can do harm. They are the same on every platform, so
    that a project reads the same everywhere.
    """
    if "\0" in recorded or len(recorded) > _LONGEST:
        return NotFound(FindingCode.MISSING_FILE, message("its path cannot be one"))
    path = recorded.replace("\\", "/")
    if path.startswith("//"):
        # The mere look would send the user's credentials to that host; //./ and //?/ name devices.
        return NotFound(
            FindingCode.OUTSIDE_ROOT, message("it is on the network or a device, by an absolute path")
        )
    for name in path.split("/"):
        if is_device_name(name):
            return NotFound(
                FindingCode.MISSING_FILE, message("{name} is a device on Windows, not a file", name=name)
            )
        if _STREAM.search(name):
            return NotFound(
                FindingCode.MISSING_FILE, message("{name} names a stream within a file", name=name)
            )
    return None


def _respelt_by_disk(recorded: str, spelt: Spelt) -> bool:
    """Return True if a disk that ignores case found a name of the link under another spelling.

    The user's spelling of the folders above does not concern the link.
    """
    if spelt.path == spelt.plain:
        return False
    own = len([name for name in recorded.replace("\\", "/").split("/") if name not in ("", ".", "..")])
    plain, listed = (Path(path).parts[-own:] for path in (spelt.plain, spelt.path))
    return plain != listed


def _candidates(recorded: str, folders: tuple[str, ...]) -> Iterator[str]:
    spellings = (recorded, recorded.replace("\\", "/")) if "\\" in recorded else (recorded,)
    for spelling in spellings:
        for folder in folders:
            yield os.path.normpath(os.path.join(folder, spelling))
