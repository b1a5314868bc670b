# SPDX-License-Identifier: LGPL-2.1-or-later
"""Shapes in the geometry kernel's own form: .brep and .brp files, the entries of FreeCAD documents, and what
helpers are sent to measure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from OCP.BinTools import BinTools
from OCP.BRep import BRep_Builder
from OCP.BRepTools import BRepTools
from OCP.TopoDS import TopoDS_Compound, TopoDS_Iterator, TopoDS_Shape

from silo.bom.errors import DocumentError
from silo.durable import remove_patiently
from silo.inertia.geometry.helpers import Helpers
from silo.inertia.geometry.kernel.solids import measure
from silo.inertia.geometry.measured import Measured
from silo.inertia.geometry.options import Reading, ReadOptions, Report
from silo.inertia.model import Assembly, Instance


def load_shape(path: Path, named: str) -> Any:
    """The shape in a file, text or binary. ``named`` is what a DocumentError calls it."""
    shape = TopoDS_Shape()
    with path.open("rb") as stream:
        head = stream.read(64).lstrip()
    if head.startswith(b"Open CASCADE Topology"):
        done = BinTools.Read_s(shape, str(path))
    else:
        done = BRepTools.Read_s(shape, str(path), BRep_Builder())
    if done is False or shape.IsNull():
        raise DocumentError(named, "holds no shape that the geometry kernel can read")
    return shape


def read_brep(path: Path, options: ReadOptions, report: Report) -> Reading:
    """One part from a .brep file, in mm as the kernel writes them. Raises DocumentError."""
    report("reading", 0, 0)
    shape = load_shape(path, str(path))
    report("measuring", 1, 1)
    measured = measure([shape], eps=options.eps, mesh_check=options.mesh_check)
    part = measured.prototype("shape", path.stem)
    instance = Instance((path.stem,), (path.stem,), "shape", np.eye(4))
    return Reading(Assembly(path.stem, {"shape": part}, (instance,), source=str(path), unit="mm"))


def measure_all(
    products: Sequence[list[Any]],
    *,
    options: ReadOptions,
    helpers: Helpers,
    done: Callable[[int, int], Any],
) -> list[Measured]:
    """The shapes of each product measured, here and by the helpers that run."""
    numbers = count()

    def stored(shapes: list[Any]) -> tuple[Callable[..., Measured], tuple[Any, ...]]:
        path = helpers.folder() / f"{next(numbers)}.bin"
        _store(shapes, path)
        return _measure_stored, (path, options.eps, options.mesh_check)

    def here(shapes: list[Any]) -> Measured:
        return measure(shapes, eps=options.eps, mesh_check=options.mesh_check)

    return helpers.all(products, here, stored, done)


def _measure_stored(path: Path, eps: float, mesh_check: bool) -> Measured:
    shapes = []
    stored = TopoDS_Iterator(load_shape(path, str(path)), True, True)
    while stored.More():
        shapes.append(stored.Value())
        stored.Next()
    remove_patiently(path)
    return measure(shapes, eps=eps, mesh_check=mesh_check)


def _store(shapes: list[Any], path: Path) -> None:
    """Bit by bit: what is read from there is measured to the same numbers."""
    builder, whole = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(whole)
    for shape in shapes:
        builder.Add(whole, shape)
    if not BinTools.Write_s(whole, str(path)):
        raise DocumentError(str(path), "cannot be written")
