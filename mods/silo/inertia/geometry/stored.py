# SPDX-License-Identifier: LGPL-2.1-or-later
"""An assembly in one file: numbers as npz arrays, words as JSON, and nothing in it can be executed.

The same form goes from the reading process to its parent and into the cache.
"""

from __future__ import annotations

import json
import zipfile
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from silo.bom.errors import InputError
from silo.bom.message import message
from silo.inertia.assembly import Assembly, Instance, Prototype
from silo.inertia.geometry.together import Mesh
from silo.inertia.notes import Note

FORMAT = 2
"""Raise it when the form, or the meaning of a number in it, changes."""


def save(assembly: Assembly, path: Path, extra: dict[str, Any] | None = None) -> None:
    """Write ``assembly`` to ``path``; ``extra`` is kept with it (JSON values)."""
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
    """Read the assembly in ``path``, and what was kept with it. InputError if the file is not one of ours."""
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as arrays:
            return _assembly_in(arrays)
    except (OSError, ValueError, KeyError, IndexError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(
            message(
                "{path}: is not stored geometry of format {format}: {error}",
                path=path,
                format=FORMAT,
                error=error,
            )
        ) from error


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
        raise InputError(
            message(
                "wanted stored geometry of format {format}, got {header}",
                format=FORMAT,
                header=repr(header.get("format")),
            )
        )
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
