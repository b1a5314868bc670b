# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD documents: the shapes in FCStd files, placed as FreeCAD places them, measured as all others."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from silo.bom.errors import DocumentError, InputError
from silo.fcstd import Library
from silo.inertia.core import is_rigid
from silo.inertia.geometry.brep import load_shape, no_solid
from silo.inertia.geometry.checks import name_problems, scaled_problems
from silo.inertia.geometry.freecad_places import Entries
from silo.inertia.geometry.freecad_walk import Leaf, Walk, top_object
from silo.inertia.geometry.graph import Child, unfold
from silo.inertia.geometry.options import Reading, ReadOptions, Report
from silo.inertia.geometry.solids import Measured, measure
from silo.inertia.model import Assembly, GeometryCode, GeometryProblem, Prototype


def read_freecad(path: Path, options: ReadOptions, report: Report) -> Reading:
    """The assembly, part or loose bodies of an FCStd file, with what it links to. Raises DocumentError."""
    report("reading", 0, 0)
    entries = Entries()
    try:
        with Library(options.root) as library:
            document = library.open(path)
            folder = os.path.dirname(document.FileName).replace("\\", "/")
            walk = Walk(entries, base=folder)
            top = walk.product(top_object(document, options.object_name))
            return _reading(path, walk, top, options, report)
    finally:
        entries.close()


def _reading(path: Path, walk: Walk, top: str, options: ReadOptions, report: Report) -> Reading:
    node = walk.nodes[top]
    try:
        unfolded = unfold(walk.nodes, [Child(node.name, top)], options.max_instances)
    except InputError as error:
        raise DocumentError(str(path), str(error)) from error
    used = list(dict.fromkeys(instance.prototype for instance in unfolded.instances))
    prototypes = {}
    with tempfile.TemporaryDirectory(prefix="silo-freecad-") as folder:
        for number, key in enumerate(used, start=1):
            report("measuring", number, len(used))
            prototypes[key] = _prototype(walk, key, options, Path(folder))
    problems = [GeometryProblem(code, message) for code, listed in walk.notes.items() for message in listed]
    problems += scaled_problems(unfolded.instances)
    assembly = Assembly(
        name=node.name,
        prototypes=prototypes,
        instances=tuple(unfolded.instances),
        problems=tuple(problems),
        source=str(path),
        unit="mm",
        frames=unfolded.frames,
    )
    others = tuple(Path(file) for file in sorted(walk.documents) if Path(file) != path.resolve())
    return Reading(assembly, others=others, absent=tuple(Path(file) for file in sorted(walk.absent)))


def _prototype(walk: Walk, key: str, options: ReadOptions, folder: Path) -> Prototype:
    node, leaf = walk.nodes[key], walk.leaves[key]
    problems = name_problems(node.name, unnamed=False)
    measured = Measured((), (), None, False)
    try:
        shapes = _shapes(walk.entries, leaf, folder)
        measured = measure(shapes, eps=options.eps, mesh_check=options.mesh_check)
    except DocumentError as error:
        problems.append(GeometryProblem(GeometryCode.NO_GEOMETRY, error.reason))
    problems += measured.problems
    if leaf.broken:
        problems.append(GeometryProblem(GeometryCode.NO_GEOMETRY, leaf.broken))
    elif not measured.solids:
        problems.append(no_solid(measured))
    if leaf.material.problem:
        problems.append(GeometryProblem("material", leaf.material.problem))
    volume, com, inertia = measured.total
    return Prototype(
        key=key,
        name=node.name,
        solids=measured.solids,
        volume_m3=volume,
        com_m=com,
        inertia_unit=inertia,
        has_solid=bool(measured.solids),
        problems=tuple(problems),
        step_density=leaf.material.density,
        step_material=leaf.material.name,
        mesh=measured.mesh,
    )


def _shapes(entries: Entries, leaf: Leaf, folder: Path) -> list[Any]:
    """The shapes of one product in its axes.

    FreeCAD keeps an object's placement as the location of its stored shape; that one is taken off, and the
    walk's own put in its place, since a link may leave it out.
    """
    found = []
    for ref in leaf.shapes:
        file = folder / "shape.brp"
        file.write_bytes(entries.read(ref.path, ref.entry))
        if file.stat().st_size == 0:
            continue
        shape = load_shape(file, f"{ref.path}: {ref.entry}")
        found.append(_located(shape, ref.transform))
    return found


def _located(shape: Any, matrix: np.ndarray) -> Any:
    from OCP.gp import gp_Trsf
    from OCP.TopLoc import TopLoc_Location

    bare = shape.Located(TopLoc_Location())
    if np.array_equal(matrix, np.eye(4)):
        return bare
    if not is_rigid(matrix):
        raise DocumentError("", "its placement scales it inside of its part, which is not supported")
    step = gp_Trsf()
    step.SetValues(*(float(v) for v in matrix[:3].ravel()))
    return bare.Located(TopLoc_Location(step))
