# SPDX-License-Identifier: LGPL-2.1-or-later
"""Readings that are kept, by content: the same bytes, kernel and options give the same numbers.

The key holds the file's SHA-256, the reading options, the kernel's version and a fingerprint of our own
code that measures. The folder is bounded: what was not used for longest goes first. A split assembly also
keeps the hashes of the files it was completed from, and, if it lacked any, which files lay beside it: one
part file changed, added or removed, and the assembly is read again. Anything unexpected counts as "not
there".
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from silo.bom.errors import InputError
from silo.bom.walk.document import relative
from silo.checksums import content_hash
from silo.inertia.assembly import Assembly
from silo.inertia.geometry.options import ReadOptions
from silo.inertia.geometry.part_files import step_files
from silo.inertia.geometry.reading import GeometryReading
from silo.inertia.geometry.stored import FORMAT, load
from silo.platform.user_folders import cache_folder
from silo.platform.whole_files import remove_patiently, replacing

KERNELS = ("cadquery-ocp-novtk", "cadquery-ocp", "trimesh", "manifold3d", "numpy")

MAX_BYTES = 1_000_000_000
"""Of all that is kept; an assembly of a thousand parts with its picture takes some 20 MB."""


def default_folder() -> Path:
    """Return the folder in which readings are kept. Nothing is created."""
    return cache_folder() / "geometry"


def key_of(path: Path, options: Mapping[str, Any]) -> str:
    """Return the key under which the reading of a file is kept."""
    return hashlib.sha256("\n".join(key_parts(path, options)).encode("utf-8")).hexdigest()


def key_parts(path: Path, options: Mapping[str, Any]) -> list[str]:
    """List all on which a result depends. The file's name counts, since unnamed parts get it."""
    content, asked = content_hash(path), json.dumps(options, sort_keys=True)
    return [content, path.name, str(FORMAT), _versions(), measured_by(), asked]


@cache
def measured_by() -> str:
    """Return a fingerprint of the code that reads and measures, since another version's numbers may
    differ.
    """
    package = Path(__file__).resolve().parent
    values = (package.parent / f"{name}.py" for name in ("arrays", "assembly", "notes", "placements"))
    return fingerprint([*package.rglob("*.py"), *values])


def fingerprint(paths: Iterable[Path]) -> str:
    """Hash all these files with SHA-256."""
    digest = hashlib.sha256()
    for path in sorted(paths):
        digest.update(f"{path.name}\0{content_hash(path)}\n".encode())
    return digest.hexdigest()


def _versions() -> str:
    versions = []
    for name in KERNELS:
        try:
            versions.append(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            continue
    return ", ".join(versions)


@dataclass(frozen=True)
class Cache:
    """One folder of stored readings; ``max_bytes`` in all."""

    folder: Path
    max_bytes: int = MAX_BYTES

    def get(self, key: str, source: Path) -> Assembly | None:
        """Return the stored assembly of ``source``, under its present path; None if none is stored that is
        still valid.
        """
        path = self._path(key)
        if not path.is_file():
            return None
        try:
            assembly, extra = load(path)
        except InputError:
            return None
        if not _holds(extra, source):
            return None
        with suppress(OSError):
            os.utime(path)  # recently used readings stay
        return replace(assembly, source=str(source))

    def put(self, key: str, stored: Path) -> None:
        """Store the file ``stored``, atomically. If the cache cannot be written, that is no error."""
        target = self._path(key)
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            with replacing(target) as stream:
                stream.write(stored.read_bytes())
            self._make_room()
        except OSError:
            return

    def _make_room(self) -> None:
        """Delete the entries that were not used for longest, until the rest fits."""
        kept = []
        for path in self.folder.glob("*/*.npz"):
            with suppress(OSError):
                stat = path.stat()
                kept.append((stat.st_mtime_ns, stat.st_size, path))
        size = sum(count for _, count, _ in kept)
        for _, one, path in sorted(kept):
            if size <= self.max_bytes:
                return
            remove_patiently(path)
            size -= one

    def _path(self, key: str) -> Path:
        return self.folder / key[:2] / f"{key}.npz"


def provenance(reading: GeometryReading, options: ReadOptions) -> dict[str, Any]:
    """Return everything besides its own bytes on which a reading depends. It is kept with it, and
    :meth:`Cache.get` checks it.
    """
    folder = Path(reading.assembly.source).resolve().parent
    return {
        "others": {relative(str(path), str(folder)): content_hash(path) for path in reading.others},
        "beside": _beside(folder, options.sibling_depth) if reading.missing else None,
        "absent": sorted(relative(str(path), str(folder)) for path in reading.absent),
        "depth": options.sibling_depth,
    }


def _holds(extra: Mapping[str, Any], source: Path) -> bool:
    folder = source.resolve().parent
    others: Mapping[str, str] = extra.get("others", {})
    for name, digest in others.items():
        path = folder / name
        if not path.is_file() or content_hash(path) != digest:
            return False
    if any((folder / name).exists() for name in extra.get("absent", ())):
        return False
    beside = extra.get("beside")
    return beside is None or beside == _beside(folder, int(extra.get("depth", 0)))


def _beside(folder: Path, depth: int) -> dict[str, int]:
    """Map the STEP files in a folder and below it → time of writing. A new one may hold what is missing."""
    times = {}
    for path in step_files(folder, depth):
        with suppress(OSError):
            times[relative(str(path), str(folder))] = path.stat().st_mtime_ns
    return times


def changed_since(begin_ns: int, extra: Mapping[str, Any], source: Path) -> bool:
    """Return True if a file read beside ``source`` was written after ``begin_ns`` (:func:`time.time_ns`).

    The same counts for a file that was copied there: a copy may keep the old time of writing, but its entry
    in the folder is new.
    """
    folder = source.resolve().parent
    for name in extra.get("others", {}):
        try:
            stat = (folder / name).stat()
            if max(stat.st_mtime_ns, stat.st_ctime_ns) > begin_ns:
                return True
        except OSError:
            return True
    return False
