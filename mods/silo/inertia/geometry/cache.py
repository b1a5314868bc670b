# SPDX-License-Identifier: LGPL-2.1-or-later
"""What was read is kept, by content: the same bytes, kernel and options give the same numbers.

The key holds the file's SHA-256, the reading options, the kernel's version and a fingerprint of our own code
that measures. The folder is bounded: what was not used for longest goes first. A split assembly also keeps
the hashes of the files it was completed from, and the names of those it lacked: one part file changed, added
or removed, and the assembly is read anew. Anything unexpected counts as "not there".
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

from silo.bom.document import relative
from silo.bom.errors import InputError
from silo.durable import remove_patiently, replacing
from silo.files import content_hash
from silo.folders import cache_folder
from silo.inertia.geometry import store
from silo.inertia.geometry.labels import file_key, step_files
from silo.inertia.geometry.options import Reading, ReadOptions
from silo.inertia.model import Assembly

KERNELS = ("cadquery-ocp-novtk", "cadquery-ocp", "trimesh", "manifold3d", "numpy")

MAX_BYTES = 1_000_000_000
"""Of all that is kept; an assembly of a thousand parts with its picture takes some 20 MB."""


def default_folder() -> Path:
    """Where readings are kept. Nothing is created."""
    return cache_folder() / "geometry"


def key_of(path: Path, options: Mapping[str, Any]) -> str:
    """The key of one reading of one file."""
    return hashlib.sha256("\n".join(key_parts(path, options)).encode("utf-8")).hexdigest()


def key_parts(path: Path, options: Mapping[str, Any]) -> list[str]:
    """All that a result depends on. The file's name counts: unnamed parts are called after it."""
    content, asked = content_hash(path), json.dumps(options, sort_keys=True)
    return [content, path.name, str(store.FORMAT), _versions(), measured_by(), asked]


@cache
def measured_by() -> str:
    """A fingerprint of the code that reads and measures: another version's numbers are not ours."""
    package = Path(__file__).resolve().parent
    return fingerprint([*package.rglob("*.py"), package.parent / "core.py", package.parent / "model.py"])


def fingerprint(paths: Iterable[Path]) -> str:
    """SHA-256 of all these files."""
    digest = hashlib.sha256()
    for path in sorted(paths):
        digest.update(f"{path.name}\0{content_hash(path)}\n".encode())
    return digest.hexdigest()


def _versions() -> str:
    found = []
    for name in KERNELS:
        try:
            found.append(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            continue
    return ", ".join(found)


@dataclass(frozen=True)
class Cache:
    """One folder of stored readings; ``max_bytes`` in all."""

    folder: Path
    max_bytes: int = MAX_BYTES

    def get(self, key: str, source: Path) -> Assembly | None:
        """The stored assembly of ``source`` (as given this time); None where there is none that holds."""
        path = self._path(key)
        if not path.is_file():
            return None
        try:
            assembly, extra = store.load(path)
        except InputError:
            return None
        if not _holds(extra, source):
            return None
        with suppress(OSError):
            os.utime(path)  # what is used stays
        return replace(assembly, source=str(source))

    def put(self, key: str, stored: Path) -> None:
        """Take the stored file ``stored`` in, atomically. A cache that cannot be written is no error."""
        target = self._path(key)
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            with replacing(target) as stream:
                stream.write(stored.read_bytes())
            self._make_room()
        except OSError:
            return

    def _make_room(self) -> None:
        """Take out what was not used for longest, until the rest fits."""
        kept = []
        for path in self.folder.glob("*/*.npz"):
            with suppress(OSError):
                stat = path.stat()
                kept.append((stat.st_mtime_ns, stat.st_size, path))
        size = sum(one for _, one, _ in kept)
        for _, one, path in sorted(kept):
            if size <= self.max_bytes:
                return
            remove_patiently(path)
            size -= one

    def _path(self, key: str) -> Path:
        return self.folder / key[:2] / f"{key}.npz"


def provenance(reading: Reading, options: ReadOptions) -> dict[str, Any]:
    """What a reading depended on besides its own bytes; kept with it, checked by :meth:`Cache.get`."""
    folder = Path(reading.assembly.source).resolve().parent
    return {
        "others": {relative(str(path), str(folder)): content_hash(path) for path in reading.others},
        "missing": sorted({file_key(name) for name in reading.missing}),
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
    missing = set(extra.get("missing", ()))
    return not missing or not any(
        file_key(path.stem) in missing for path in step_files(folder, int(extra.get("depth", 0)))
    )


def changed_since(begin_ns: int, extra: Mapping[str, Any], source: Path) -> bool:
    """True where a file read beside ``source`` was written after ``begin_ns`` (:func:`time.time_ns`).

    Or put there: a copy may have an old time of writing, but not an old place in its folder.
    """
    folder = source.resolve().parent
    for name in extra.get("others", {}):
        try:
            found = (folder / name).stat()
            if max(found.st_mtime_ns, found.st_ctime_ns) > begin_ns:
                return True
        except OSError:
            return True
    return False
