# SPDX-License-Identifier: LGPL-2.1-or-later
"""What was read is kept, by content: the same bytes, kernel and options give the same numbers.

The key holds the file's SHA-256, the reading options, the kernel's version and a fingerprint of our own code
that measures. The folder is bounded: what was not used for longest goes first. A split assembly also keeps
the hashes of the files it was completed from, and the names of those it lacked: one part file changed, added
or removed, and the assembly is read anew. Anything unexpected counts as "not there".

An assembly is one file: numbers as npz arrays, words as JSON, and nothing in it can be executed. The same
form goes from the reading process to its parent and into the cache.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import os
import zipfile
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from silo.bom.document import relative
from silo.bom.errors import InputError
from silo.files import content_hash
from silo.inertia.geometry.graph import Reading, ReadOptions, file_key, step_files
from silo.inertia.geometry.together import Mesh
from silo.inertia.model import Assembly, Instance, Note, Prototype
from silo.platform import cache_folder, remove_patiently, replacing

FORMAT = 2
"""Raise it when the form, or the meaning of a number in it, changes."""


def save(assembly: Assembly, path: Path, extra: dict[str, Any] | None = None) -> None:
    """Write ``assembly`` to ``path``; ``extra`` is kept beside it (JSON values)."""
    prototypes = list(assembly.prototypes.values())
    number = {prototype.key: n for n, prototype in enumerate(prototypes)}
    header = {
        "format": FORMAT,
        "name": assembly.name,
        "source": assembly.source,
        "unit": assembly.unit,
        "problems": _problems_out(assembly.problems),
        "prototypes": [_prototype_out(p) for p in prototypes],
        "instances": [(i.path, i.product_path, number[i.prototype]) for i in assembly.instances],
        "frames": list(assembly.frames),
        "extra": extra or {},
    }
    arrays: dict[str, NDArray[Any]] = {
        "header": np.frombuffer(json.dumps(header).encode("utf-8"), dtype=np.uint8),
        "transforms": np.array([i.transform for i in assembly.instances]),
        "frames": np.array(list(assembly.frames.values())),
    }
    for n, prototype in enumerate(prototypes):
        if isinstance(prototype.mesh, Mesh):
            arrays[f"vertices_{n}"] = prototype.mesh.vertices.astype(np.float32)
            arrays[f"faces_{n}"] = prototype.mesh.faces.astype(np.int32)
    with path.open("wb") as stream:
        np.savez(stream, **arrays)  # type: ignore[arg-type]


def load(path: Path) -> tuple[Assembly, dict[str, Any]]:
    """Return the assembly in ``path`` and what was kept beside it.

    InputError if the file is not one of ours.
    """
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as arrays:
            return _assembly_in(arrays)
    except (OSError, ValueError, KeyError, IndexError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(f"{path}: is no stored geometry of format {FORMAT}: {error}") from error


def _problems_out(problems: tuple[Note, ...]) -> list[list[str]]:
    return [[str(p.code), p.message] for p in problems]


def _problems_in(rows: list[list[str]]) -> tuple[Note, ...]:
    return tuple(Note(str(code), str(message)) for code, message in rows)


def _prototype_out(prototype: Prototype) -> dict[str, Any]:
    values = {f.name: getattr(prototype, f.name) for f in fields(prototype) if f.name != "mesh"}
    values["problems"] = _problems_out(prototype.problems)
    return {name: v.tolist() if isinstance(v, np.ndarray) else v for name, v in values.items()}


def _assembly_in(arrays: Any) -> tuple[Assembly, dict[str, Any]]:
    header = json.loads(bytes(arrays["header"]).decode("utf-8"))
    if header.get("format") != FORMAT:
        raise InputError(f"wanted stored geometry of format {FORMAT}, got {header.get('format')!r}")
    prototypes = [_prototype_in(n, row, arrays) for n, row in enumerate(header["prototypes"])]
    instances = tuple(
        Instance(tuple(path), tuple(products), prototypes[n].key, transform)
        for (path, products, n), transform in zip(header["instances"], arrays["transforms"], strict=True)
    )
    assembly = Assembly(
        name=header["name"],
        prototypes={prototype.key: prototype for prototype in prototypes},
        instances=instances,
        problems=_problems_in(header["problems"]),
        source=header["source"],
        unit=header["unit"],
        frames={tuple(path): f for path, f in zip(header["frames"], arrays["frames"], strict=True)},
    )
    return assembly, header["extra"]


def _prototype_in(number: int, row: dict[str, Any], arrays: Any) -> Prototype:
    mesh = None
    if f"faces_{number}" in arrays.files:
        mesh = Mesh(arrays[f"vertices_{number}"], arrays[f"faces_{number}"])
    return Prototype(**{**row, "problems": _problems_in(row["problems"])}, mesh=mesh)


KERNELS = ("cadquery-ocp-novtk", "cadquery-ocp", "trimesh", "manifold3d", "numpy")

MAX_BYTES = 1_000_000_000
"""Of all that is kept; an assembly of a thousand parts with its picture takes some 20 MB."""


def default_folder() -> Path:
    """Return where readings are kept. Nothing is created."""
    return cache_folder() / "geometry"


def key_of(path: Path, options: Mapping[str, Any]) -> str:
    """Return the key of one reading of one file."""
    return hashlib.sha256("\n".join(key_parts(path, options)).encode("utf-8")).hexdigest()


def key_parts(path: Path, options: Mapping[str, Any]) -> list[str]:
    """Return all that a result depends on. The file's name counts: unnamed parts are called after it."""
    content, asked = content_hash(path), json.dumps(options, sort_keys=True)
    return [content, path.name, str(FORMAT), _versions(), measured_by(), asked]


@cache
def measured_by() -> str:
    """Return a fingerprint of the code that reads and measures: another version's numbers are not ours."""
    package = Path(__file__).resolve().parent
    return fingerprint([*package.rglob("*.py"), package.parent / "core.py", package.parent / "model.py"])


def fingerprint(paths: Iterable[Path]) -> str:
    """Return SHA-256 of all these files."""
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
        """Return the stored assembly of ``source`` (as given this time); None if there is none that holds."""
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
    """Return what a reading depends on besides its own bytes; kept with it, checked by :meth:`Cache.get`."""
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
    """Report whether a file read beside ``source`` was written after ``begin_ns`` (:func:`time.time_ns`).

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
