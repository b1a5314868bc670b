# SPDX-License-Identifier: LGPL-2.1-or-later
"""Corpora: all cases as one FreeCAD built them, in a folder or packed into one archive.

One archive per FreeCAD keeps hundreds of small files, links between folders and names that not every file
system takes out of the repository's tree.
"""

from __future__ import annotations

import json
import os
import stat
import zipfile
from dataclasses import dataclass
from pathlib import Path

from freecad_cases.machines import FreeCAD
from freecad_cases.truth import TRUTH, Truth

BUILD = Path(__file__).with_name("build.py")
DATA = Path(__file__).resolve().parents[2] / "data"
ARCHIVES = DATA / "freecad"
_MANIFEST = "built.json"
# Zip cannot tell times before 1980; every entry has the same, so that equal content gives equal archives.
_TIME = (1980, 1, 1, 0, 0, 0)


@dataclass(frozen=True)
class Corpus:
    """The cases of one builder. ``built`` holds ``<style>/<case>``."""

    folder: Path
    version: tuple[int, ...]
    built: tuple[str, ...]

    def base(self, key: str) -> Path:
        """The folder of a case."""
        return self.folder / key

    def top(self, key: str) -> Path:
        """The file of a case that is read."""
        return self.base(key) / truth_of(key).top


def truth_of(key: str) -> Truth:
    return TRUTH[key.partition("/")[2]]


def load(folder: Path) -> Corpus:
    """A corpus from its folder."""
    told = json.loads((folder / _MANIFEST).read_text())
    # Links have been resolved in the answers, so the folder must be resolved likewise.
    return Corpus(folder.resolve(), tuple(told["freecad"]), tuple(told["built"]))


def build(freecad: FreeCAD, folder: Path) -> Corpus:
    """Have a FreeCAD build all the cases that it can."""
    folder.mkdir(parents=True)
    env = freecad.profile(folder.parent / f"profile-{freecad.short}")
    freecad.must_run(BUILD, {**env, "SILO_CASES_OUT": str(folder)}, cwd=folder)
    return load(folder)


def pack(folder: Path, archive: Path) -> None:
    """Pack a corpus; symlinks stay symlinks."""
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as out:
        for path in sorted(folder.rglob("*")):
            if not path.is_symlink() and path.is_dir():
                continue
            info = zipfile.ZipInfo(path.relative_to(folder).as_posix(), _TIME)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = (path.lstat().st_mode & 0xFFFF) << 16
            out.writestr(info, os.readlink(path) if path.is_symlink() else path.read_bytes())


def unpack(archive: Path, folder: Path) -> Corpus:
    """Unpack a corpus that :func:`pack` made."""
    with zipfile.ZipFile(archive) as packed:
        for info in packed.infolist():
            path = folder / info.filename
            path.parent.mkdir(parents=True, exist_ok=True)
            if stat.S_ISLNK(info.external_attr >> 16):
                path.symlink_to(packed.read(info).decode(), target_is_directory=True)
            else:
                path.write_bytes(packed.read(info))
    return load(folder)


def packed_keys(archive: Path) -> tuple[str, ...]:
    """What an archive holds, without unpacking it."""
    with zipfile.ZipFile(archive) as packed:
        return tuple(json.loads(packed.read(_MANIFEST))["built"])
