# SPDX-License-Identifier: LGPL-2.1-or-later
"""Shapes in the geometry kernel's own form: .brep and .brp files, and the entries of FreeCAD documents."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from OCP.BinTools import BinTools
from OCP.BRep import BRep_Builder
from OCP.BRepTools import BRepTools
from OCP.TopoDS import TopoDS_Shape

from silo.bom.errors import DocumentError
from silo.inertia.geometry.kernel.solids import measure
from silo.inertia.geometry.measured import no_solid
from silo.inertia.geometry.options import Reading, ReadOptions, Report
from silo.inertia.model import Assembly, Instance, Prototype


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
    volume, com, inertia = measured.total
    problems = measured.problems if measured.solids else (*measured.problems, no_solid(measured))
    part = Prototype(
        key="shape",
        name=path.stem,
        solids=measured.solids,
        volume_m3=volume,
        com_m=com,
        inertia_unit=inertia,
        has_solid=bool(measured.solids),
        problems=problems,
        mesh=measured.mesh,
    )
    instance = Instance((path.stem,), (path.stem,), "shape", np.eye(4))
    return Reading(Assembly(path.stem, {"shape": part}, (instance,), source=str(path), unit="mm"))
