# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD documents: the shapes in FCStd files, placed as FreeCAD places them, measured as all others."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from silo.bom.errors import DocumentError
from silo.fcstd import Library
from silo.inertia.core import is_rigid
from silo.inertia.geometry.freecad.places import Entries, StoredFacts
from silo.inertia.geometry.freecad.walk import Leaf, Walk, assembled
from silo.inertia.geometry.graph import Floats, Reading, ReadOptions, Report
from silo.inertia.geometry.helpers import WORTH_HELP, Helpers, Task
from silo.inertia.geometry.kernel.solids import load_shape, measure
from silo.inertia.geometry.measured import Measured
from silo.platform import remove_patiently, scratch_folder


def read_freecad(path: Path, options: ReadOptions, report: Report, helpers: Helpers | None = None) -> Reading:
    """Return the assembly, part or loose bodies of an FCStd file, with what it links to.

    Raises DocumentError.
    """
    report("reading", 0, 0)
    helpers = helpers or Helpers()
    entries = Entries()
    try:
        with (
            Library(options.root) as library,
            scratch_folder("silo-freecad-") as folder,
        ):
            document = library.open(path)
            base = os.path.dirname(document.FileName).replace("\\", "/")
            walk = Walk(StoredFacts(entries), base, options.hardware)
            top = walk.top(document, options.object_name)
            unpacked = _Unpacked(entries, Path(folder))

            def measured(leaves: Sequence[Leaf], done: Callable[[int, int], Any]) -> list[Measured | str]:
                if len(leaves) > 1 and unpacked.size(leaves) >= WORTH_HELP and helpers.start():
                    helpers.load_kernel()

                def task(leaf: Leaf) -> Task[Measured | str]:
                    try:
                        return measured_files, (unpacked.files(leaf), options.eps, options.mesh_check)
                    except DocumentError as error:
                        return str, (error.reason,)

                return helpers.all(leaves, task, done)

            assembly = assembled(walk, top, str(path), options, measured, report)
    finally:
        entries.close()
    others = tuple(Path(file) for file in sorted(walk.documents) if Path(file) != path.resolve())
    return Reading(assembly, others=others, absent=tuple(Path(file) for file in sorted(walk.absent)))


class _Unpacked:
    """The shapes of products as files of their own, each product's as long as it takes to measure it."""

    def __init__(self, entries: Entries, folder: Path) -> None:
        self._entries = entries
        self._folder = folder
        self._numbers = count()

    def size(self, leaves: Sequence[Leaf]) -> int:
        """Return the size of all their shapes, in bytes."""
        return sum(self._entries.size(ref.handle.path, ref.handle.entry) for e in leaves for ref in e.shapes)

    def files(self, leaf: Leaf) -> list[_File]:
        """Yield a value for each shape that is not empty. Raises DocumentError."""
        found = []
        for ref in leaf.shapes:
            data = self._entries.read(ref.handle.path, ref.handle.entry)
            if data:
                path = self._folder / f"shape{next(self._numbers)}.brp"
                path.write_bytes(data)
                found.append(_File(path, f"{ref.handle.path}: {ref.handle.entry}", ref.transform))
        return found


@dataclass(frozen=True, eq=False)
class _File:
    """A shape of a product: where it lies, what messages call it, and (4, 4) [mm] to the product's axes."""

    path: Path
    named: str
    transform: Floats


def measured_files(files: Sequence[_File], eps: float, mesh_check: bool) -> Measured | str:
    """Return a product, measured from its shapes in its axes, or what is wrong; the files are taken away.

    FreeCAD keeps an object's placement as the location of its stored shape; that one is taken off, and the
    walk's own put in its place, since a link may leave it out.
    """
    try:
        shapes = [_located(load_shape(file.path, file.named), file.transform) for file in files]
        return measure(shapes, eps=eps, mesh_check=mesh_check)
    except DocumentError as error:
        return error.reason
    finally:
        for file in files:
            remove_patiently(file.path)


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
