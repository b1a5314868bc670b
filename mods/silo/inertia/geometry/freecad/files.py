# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD documents: the shapes in FCStd files, placed as FreeCAD places them, measured as all others."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from silo.bom.errors import DocumentError
from silo.fcstd import Library
from silo.inertia.core import is_rigid
from silo.inertia.geometry.freecad.assembly import assembled
from silo.inertia.geometry.freecad.facts import StoredFacts
from silo.inertia.geometry.freecad.members import top_object
from silo.inertia.geometry.freecad.places import Entries
from silo.inertia.geometry.freecad.walk import Leaf, Walk
from silo.inertia.geometry.kernel.brep import load_shape
from silo.inertia.geometry.kernel.solids import measure
from silo.inertia.geometry.measured import Measured
from silo.inertia.geometry.options import Reading, ReadOptions, Report


def read_freecad(path: Path, options: ReadOptions, report: Report) -> Reading:
    """The assembly, part or loose bodies of an FCStd file, with what it links to. Raises DocumentError."""
    report("reading", 0, 0)
    entries = Entries()
    try:
        with Library(options.root) as library, tempfile.TemporaryDirectory(prefix="silo-freecad-") as folder:
            document = library.open(path)
            base = os.path.dirname(document.FileName).replace("\\", "/")
            walk = Walk(StoredFacts(entries), base)
            top = walk.product(top_object(document, options.object_name))

            def measured(leaf: Leaf) -> Measured:
                shapes = _shapes(entries, leaf, Path(folder))
                return measure(shapes, eps=options.eps, mesh_check=options.mesh_check)

            assembly = assembled(walk, top, str(path), options, measured, report)
    finally:
        entries.close()
    others = tuple(Path(file) for file in sorted(walk.documents) if Path(file) != path.resolve())
    return Reading(assembly, others=others, absent=tuple(Path(file) for file in sorted(walk.absent)))


def _shapes(entries: Entries, leaf: Leaf, folder: Path) -> list[Any]:
    """The shapes of one product in its axes.

    FreeCAD keeps an object's placement as the location of its stored shape; that one is taken off, and the
    walk's own put in its place, since a link may leave it out.
    """
    found = []
    for ref in leaf.shapes:
        file = folder / "shape.brp"
        file.write_bytes(entries.read(ref.handle.path, ref.handle.entry))
        if file.stat().st_size == 0:
            continue
        shape = load_shape(file, f"{ref.handle.path}: {ref.handle.entry}")
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
