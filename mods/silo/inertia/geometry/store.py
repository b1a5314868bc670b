# SPDX-License-Identifier: LGPL-2.1-or-later
"""An assembly as one file and back: numbers as npz arrays, words as JSON. Nothing in it can be executed.

The same form goes from the reading process to its parent and into the cache.
"""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from silo.bom.errors import InputError
from silo.inertia.geometry.mesh import Mesh
from silo.inertia.model import Assembly, GeometryProblem, Instance, Prototype, SolidProps

FORMAT = 1
"""Raise it when the form, or the meaning of a number in it, changes."""


def save(assembly: Assembly, path: Path, extra: dict[str, Any] | None = None) -> None:
    """Write ``assembly`` to ``path``; ``extra`` is kept beside it (JSON values)."""
    prototypes = list(assembly.prototypes.values())
    solids = [solid for prototype in prototypes for solid in prototype.solids]
    words = _Words()
    header = {
        "format": FORMAT,
        "name": assembly.name,
        "source": assembly.source,
        "unit": assembly.unit,
        "problems": _problems_out(assembly.problems),
        "prototypes": [_prototype_out(p) for p in prototypes],
        "paths": [words.row(i.path) for i in assembly.instances],
        "products": [words.row(i.product_path) for i in assembly.instances],
        "frames": [words.row(path) for path in assembly.frames],
        "words": words.words,
        "extra": extra or {},
    }
    position = {p.key: n for n, p in enumerate(prototypes)}
    arrays: dict[str, NDArray[Any]] = {
        "header": np.frombuffer(json.dumps(header).encode("utf-8"), dtype=np.uint8),
        "proto": _rows([np.r_[p.volume_m3, p.com_m, p.inertia_unit.ravel()] for p in prototypes], 13),
        "solids": _rows(
            [np.r_[s.volume_m3, s.com_m, s.inertia_unit.ravel(), float(s.reversed)] for s in solids], 14
        ),
        "solid_counts": np.array([len(p.solids) for p in prototypes], dtype=np.int64),
        "instance_prototype": np.array([position[i.prototype] for i in assembly.instances], dtype=np.int64),
        "transforms": _rows([i.transform.ravel() for i in assembly.instances], 16),
        "frames": _rows([np.asarray(f).ravel() for f in assembly.frames.values()], 16),
    }
    for number, prototype in enumerate(prototypes):
        if isinstance(prototype.mesh, Mesh):
            arrays[f"vertices_{number}"] = prototype.mesh.vertices.astype(np.float32)
            arrays[f"faces_{number}"] = prototype.mesh.faces.astype(np.int32)
    with path.open("wb") as stream:
        np.savez(stream, **arrays)  # type: ignore[arg-type]


def load(path: Path) -> tuple[Assembly, dict[str, Any]]:
    """The assembly in ``path`` and what was kept beside it. InputError where the file is not one of ours."""
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as arrays:
            return _assembly_in(arrays)
    except (OSError, ValueError, KeyError, IndexError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(f"{path}: is no stored geometry of format {FORMAT}: {error}") from error


class _Words:
    """Names repeat by the thousand; each is written once."""

    def __init__(self) -> None:
        self.words: list[str] = []
        self._known: dict[str, int] = {}

    def row(self, names: tuple[str, ...]) -> list[int]:
        for name in names:
            if name not in self._known:
                self._known[name] = len(self.words)
                self.words.append(name)
        return [self._known[name] for name in names]


def _rows(rows: list[NDArray[np.float64]], width: int) -> NDArray[np.float64]:
    return np.array(rows, dtype=np.float64).reshape(-1, width)


def _problems_out(problems: tuple[GeometryProblem, ...]) -> list[list[str]]:
    return [[str(p.code), p.message] for p in problems]


def _problems_in(rows: list[list[str]]) -> tuple[GeometryProblem, ...]:
    return tuple(GeometryProblem(str(code), str(message)) for code, message in rows)


def _prototype_out(prototype: Prototype) -> dict[str, Any]:
    return {
        "key": prototype.key,
        "name": prototype.name,
        "has_solid": prototype.has_solid,
        "problems": _problems_out(prototype.problems),
        "step_density": prototype.step_density,
        "step_material": prototype.step_material,
        "stated_volume_m3": prototype.stated_volume_m3,
        "part_number": prototype.part_number,
    }


def _assembly_in(arrays: Any) -> tuple[Assembly, dict[str, Any]]:
    header = json.loads(bytes(arrays["header"]).decode("utf-8"))
    if header.get("format") != FORMAT:
        raise InputError(f"wanted stored geometry of format {FORMAT}, got {header.get('format')!r}")
    words: list[str] = header["words"]
    prototypes = _prototypes_in(header["prototypes"], arrays)
    keys = list(prototypes)

    def name(row: list[int]) -> tuple[str, ...]:
        return tuple(words[n] for n in row)

    transforms = arrays["transforms"].reshape(-1, 4, 4)
    instances = tuple(
        Instance(name(path), name(products), keys[number], transform)
        for path, products, number, transform in zip(
            header["paths"],
            header["products"],
            arrays["instance_prototype"].tolist(),
            transforms,
            strict=True,
        )
    )
    frames = arrays["frames"].reshape(-1, 4, 4)
    assembly = Assembly(
        name=header["name"],
        prototypes=prototypes,
        instances=instances,
        problems=_problems_in(header["problems"]),
        source=header["source"],
        unit=header["unit"],
        frames={name(row): frame for row, frame in zip(header["frames"], frames, strict=True)},
    )
    return assembly, header["extra"]


def _prototypes_in(rows: list[dict[str, Any]], arrays: Any) -> dict[str, Prototype]:
    numbers, solids = arrays["proto"], arrays["solids"]
    counts = arrays["solid_counts"].tolist()
    ends = np.cumsum(counts).tolist()
    result = {}
    for n, row in enumerate(rows):
        mesh = None
        if f"faces_{n}" in arrays.files:
            mesh = Mesh(arrays[f"vertices_{n}"], arrays[f"faces_{n}"])
        result[row["key"]] = Prototype(
            **{**row, "problems": _problems_in(row["problems"])},
            solids=tuple(
                SolidProps(float(s[0]), s[1:4], s[4:13].reshape(3, 3), bool(s[13]))
                for s in solids[ends[n] - counts[n] : ends[n]]
            ),
            volume_m3=float(numbers[n, 0]),
            com_m=numbers[n, 1:4],
            inertia_unit=numbers[n, 4:13].reshape(3, 3),
            mesh=mesh,
        )
    return result
