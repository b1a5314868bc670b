# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD documents: the shapes in FCStd files, placed as FreeCAD places them, measured as all others.

Also what a mass needs of objects in a file and a BOM does not: placements, shapes, materials. Sources:
FreeCAD ``src/App/PropertyGeo.cpp`` (PropertyPlacement, PropertyPlacementList),
``src/Mod/Part/App/PropertyTopoShape.cpp``. Lengths are mm here, as FreeCAD has them.
"""

from __future__ import annotations

import html
import os
import re
import struct
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from silo.bom.errors import DocumentError
from silo.bom.message import message
from silo.bom.walk.document import LinkProblem
from silo.budget import Budget
from silo.fcstd import Library
from silo.inertia.geometry.freecad import (
    NOTHING,
    Leaf,
    StatedMaterial,
    Walk,
    assembled,
    card_material,
    file_of,
    linked_material,
)
from silo.inertia.geometry.graph import Floats
from silo.inertia.geometry.helpers import WORTH_HELP, Helpers, Task
from silo.inertia.geometry.limits import MODEL
from silo.inertia.geometry.measured import Measured
from silo.inertia.geometry.options import ReadOptions, Report
from silo.inertia.geometry.reading import GeometryReading
from silo.inertia.placements import is_rigid
from silo.platform.whole_files import remove_patiently, scratch_folder


def read_freecad(
    path: Path, options: ReadOptions, report: Report, helpers: Helpers | None = None
) -> GeometryReading:
    """Read the assembly, part or loose bodies of an FCStd file, with the files to which it links.

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
            unpacked = Unpacked(entries, Path(folder))

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
    return GeometryReading(assembly, others=others, absent=tuple(Path(file) for file in sorted(walk.absent)))


class Unpacked:
    """The shapes of products as files of their own, each product's as long as it takes to measure it."""

    def __init__(self, entries: Entries, folder: Path) -> None:
        self._entries = entries
        self._folder = folder
        self._numbers = count()

    def size(self, leaves: Sequence[Leaf]) -> int:
        """Return the size of all shapes of these products, in bytes."""
        return sum(self._entries.size(ref.handle.path, ref.handle.entry) for e in leaves for ref in e.shapes)

    def files(self, leaf: Leaf) -> list[_File]:
        """Unpack each shape. Raises DocumentError."""
        unpacked = []
        for ref in leaf.shapes:
            path = self._folder / f"shape{next(self._numbers)}.brp"
            path.write_bytes(self._entries.read(ref.handle.path, ref.handle.entry))
            unpacked.append(_File(path, f"{ref.handle.path}: {ref.handle.entry}", ref.transform))
        return unpacked


@dataclass(frozen=True, eq=False)
class _File:
    """A shape of a product: where it lies, what messages call it, and (4, 4) [mm] to the product's axes."""

    path: Path
    named: str
    transform: Floats


def measured_files(files: Sequence[_File], eps: float, mesh_check: bool) -> Measured | str:
    """Measure a product from its shape files, in its own axes, and delete them. Returns a text if something
    is wrong.

    FreeCAD keeps an object's placement as the location of its stored shape; it is replaced by the placement
    of the walk, since a link may ignore it.
    """
    # Inside FreeCAD there is no such kernel, and FreeCAD's own draws what is stored.
    from silo.inertia.geometry.kernel.solids import load_shape, measure

    try:
        shapes = [located(load_shape(file.path, file.named), file.transform) for file in files]
        return measure(shapes, eps=eps, mesh_check=mesh_check)
    except DocumentError as error:
        return error.reason
    finally:
        for file in files:
            remove_patiently(file.path)


def located(shape: Any, matrix: np.ndarray) -> Any:
    """Give a shape this placement (4, 4) [mm] in place of its own. Raises DocumentError."""
    from OCP.gp import gp_Trsf
    from OCP.TopLoc import TopLoc_Location

    bare = shape.Located(TopLoc_Location())
    if np.array_equal(matrix, np.eye(4)):
        return bare
    if not is_rigid(matrix):
        raise DocumentError("", message("its placement scales it inside of its part, which is not supported"))
    step = gp_Trsf()
    step.SetValues(*(float(v) for v in matrix[:3].ravel()))
    return bare.Located(TopLoc_Location(step))


MAX_ENTRY_BYTES = 1_000_000_000

_PLACEMENT = re.compile(rb"<PropertyPlacement\s([^>]*)>")
_ATTRIBUTE = re.compile(rb"""(?<![A-Za-z0-9])([A-Za-z0-9]++)\s*+=\s*+["']([^"']*+)["']""")
_FILE = re.compile(rb"""<(?:Part|PlacementList|VectorList)\s[^<>]*?file\s*=\s*["']([^"']+)["']""")
_UUID = re.compile(rb"""<PropertyMaterial\s[^<>]*?uuid\s*=\s*["']([0-9A-Fa-f-]+)["']""")


@dataclass(frozen=True, slots=True)
class StoredShape:
    """Where a shape is kept: a file, and an entry in it."""

    path: str
    entry: str


def placed(numbers: Floats) -> Floats:
    """Make (4, 4) from x y z and the quaternion x y z w, in FreeCAD's order; the identity if it is none."""
    x, y, z, w = numbers[3:7]
    norm = x * x + y * y + z * z + w * w
    matrix = np.eye(4)
    if not np.isfinite(numbers).all() or norm < 1e-12:
        return matrix
    s = 2.0 / norm
    matrix[:3, :3] = [
        [1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
        [s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)],
        [s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)],
    ]
    matrix[:3, 3] = numbers[:3]
    return matrix


def _piece(obj: Any, name: str) -> bytes:
    table = getattr(obj, "properties", None)
    if table is None or name not in table.names:
        return b""
    piece: bytes = table.piece(name)
    return piece


def _name(match: re.Match[bytes]) -> str:
    return html.unescape(match[1].decode("utf-8", errors="replace"))


class StoredFacts:
    """The facts from FCStd files; see :class:`silo.inertia.geometry.freecad.ShapeSource`."""

    def __init__(self, entries: Entries) -> None:
        self._entries = entries

    def placement(self, obj: Any, name: str = "Placement") -> Floats:
        """Return (4, 4) [mm] of the object's own placement; the identity if it has none, or none of
        numbers.
        """
        match = _PLACEMENT.search(_piece(obj, name))
        if match is None:
            return np.eye(4)
        values = {key.decode(): value for key, value in _ATTRIBUTE.findall(match[1])}
        try:
            names = ("Px", "Py", "Pz", "Q0", "Q1", "Q2", "Q3")
            return placed(np.array([float(values[key]) for key in names]))
        except (KeyError, ValueError):
            return np.eye(4)

    def places(self, obj: Any) -> list[Floats]:
        """Read the placements in the object's ``PlacementList``. DocumentError if they are damaged."""
        match = _FILE.search(_piece(obj, "PlacementList"))
        data = self._entries.read(obj.Document.FileName, _name(match)) if match is not None else b""
        if len(data) < 4:
            return []
        (count,) = struct.unpack_from("<I", data)
        for form, width in (("<f8", 56), ("<f4", 28)):
            if len(data) == 4 + count * width:
                rows = np.frombuffer(data, dtype=form, offset=4).reshape(-1, 7).astype(np.float64)
                return [placed(row) for row in rows]
        raise DocumentError(
            obj.Document.FileName,
            message("the placements of {name} are damaged (their length is wrong)", name=obj.Name),
        )

    def shape(self, obj: Any) -> StoredShape | None:
        """Return the entry that holds the object's shape; None if it has none, or an empty one."""
        match = _FILE.search(_piece(obj, "Shape"))
        if match is None or self._entries.size(file_of(obj), _name(match)) == 0:
            return None
        return StoredShape(file_of(obj), _name(match))

    def material(self, obj: Any) -> StatedMaterial:
        """Return the material that is linked to the object, or its ``ShapeMaterial`` (FreeCAD >= 1.0)."""
        if (linked := linked_material(obj)) is not None:
            return linked
        match = _UUID.search(_piece(obj, "ShapeMaterial"))
        return card_material(match[1].decode("ascii").lower()) if match is not None else NOTHING

    def problem(self, link: Any) -> LinkProblem | None:
        """Return the problem that the reader of files noted for the link."""
        problem = getattr(link, "LinkProblem", None)
        return problem if isinstance(problem, LinkProblem) else None


class Entries:
    """Side entries of FCStd files. Files stay open until :meth:`close`."""

    def __init__(self, budget: Budget = MODEL) -> None:
        self._open: dict[str, zipfile.ZipFile] = {}
        self._account = budget.account(message("the shapes"))

    def _info(self, path: str, name: str) -> tuple[zipfile.ZipFile, zipfile.ZipInfo]:
        if path not in self._open:
            self._open[path] = zipfile.ZipFile(path)
        return self._open[path], self._open[path].getinfo(name)

    def read(self, path: str, name: str) -> bytes:
        """Unpack one entry. Raises DocumentError."""
        try:
            archive, info = self._info(path, name)
            if info.file_size > MAX_ENTRY_BYTES:
                raise DocumentError(
                    path,
                    message(
                        "its {name} would unpack to {file_size} GB",
                        name=name,
                        file_size=f"{info.file_size / 1000000000.0:.1f}",
                    ),
                )
            self._account.take_bytes(info.file_size)  # zipfile unpacks no more than that
            return archive.read(info)
        except KeyError as error:
            raise DocumentError(path, message("its {name} is missing", name=name)) from error
        except (OSError, zipfile.BadZipFile, NotImplementedError, RuntimeError) as error:
            raise DocumentError(
                path, message("its {name} cannot be unpacked: {error}", name=name, error=error)
            ) from error

    def size(self, path: str, name: str) -> int:
        """Return how many bytes :meth:`read` returns; 1 if it raises."""
        try:
            return self._info(path, name)[1].file_size
        except (KeyError, OSError, zipfile.BadZipFile):
            return 1

    def close(self) -> None:
        """Close all files."""
        for archive in self._open.values():
            archive.close()
        self._open.clear()
