# SPDX-License-Identifier: LGPL-2.1-or-later
"""What was read is kept, by content: the same bytes, kernel and options give the same numbers.

The key holds the file's SHA-256, the reading options, the kernel's version and ours. A split assembly also
keeps the hashes of the files it was completed from, and the names of those it lacked: one part file changed,
added or removed, and the assembly is read anew. Anything unexpected counts as "not there".
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from silo.bom.errors import InputError
from silo.bom.report import relative
from silo.durable import replacing
from silo.folders import cache_folder
from silo.inertia.geometry import store
from silo.inertia.geometry.labels import file_key
from silo.inertia.geometry.options import Reading, ReadOptions
from silo.inertia.geometry.step.folder import step_files
from silo.inertia.model import Assembly

KERNELS = ("cadquery-ocp-novtk", "cadquery-ocp", "trimesh")


def default_folder() -> Path:
    """Where readings are kept. Nothing is created."""
    return cache_folder() / "geometry"


def content_hash(path: Path) -> str:
    """SHA-256 of a file's bytes."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def key_of(path: Path, options: Mapping[str, Any]) -> str:
    """The key of one reading of one file. Its name counts: unnamed parts are called after it."""
    parts = [
        content_hash(path),
        path.name,
        str(store.FORMAT),
        _versions(),
        json.dumps(options, sort_keys=True),
    ]
    return hashlib.sha256("\n".join(parts).encode("utf-8")).hexdigest()


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
    """One folder of stored readings."""

    folder: Path

    def get(self, key: str, source: Path) -> Assembly | None:
        """The stored assembly of ``source`` (as given this time); None where there is none that holds."""
        path = self._path(key)
        if not path.is_file():
            return None
        try:
            assembly, extra = store.load(path)
        except InputError:
            return None
        return replace(assembly, source=str(source)) if _holds(extra, source) else None

    def put(self, key: str, stored: Path) -> None:
        """Take the stored file ``stored`` in, atomically. A cache that cannot be written is no error."""
        target = self._path(key)
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            with replacing(target) as stream:
                stream.write(stored.read_bytes())
        except OSError:
            return

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
