# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is asked of the geometry kernel everywhere: labels, parts of shapes, triangles, placements.

Importing this module imports the kernel (half a second and 200 MB): only the readers do, and they run in a
child process.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from silo.bom.errors import ConfigError
from silo.bom.message import message
from silo.inertia.geometry.together import Box, Floats, Mesh, exact_box, joined, mesh_volume

try:
    import OCP
    import OCP.BRep  # whose libraries are loaded here
except ImportError as error:
    if "cannot open shared object file" in str(error):
        raise ConfigError(
            message(
                "the geometry kernel lacks a library of the system ({error}). On Debian and "
                "Ubuntu: apt-get install libgl1",
                error=error,
            )
        ) from error
    if not isinstance(error, ModuleNotFoundError):  # as where a limit of memory leaves no room for it
        raise
    raise ConfigError(
        message(
            "STEP files and FreeCAD shapes need the geometry kernel, which is not installed: "
            'pip install "silo-mod[inertia]"'
        )
    ) from error

if int(OCP.__version__.split(".")[0]) < 8:
    raise ConfigError(
        message(
            "the geometry kernel OCP {version} loses placements that scale or mirror; wanted "
            'version 8: pip install "silo-mod[inertia]"',
            version=OCP.__version__,
        )
    )

from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Curve2d, BRepAdaptor_Surface
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.collections import Sequence_TDF_Label
from OCP.GeomAbs import (
    GeomAbs_Circle,
    GeomAbs_Cone,
    GeomAbs_Cylinder,
    GeomAbs_Line,
    GeomAbs_Plane,
    GeomAbs_Sphere,
    GeomAbs_Torus,
)
from OCP.IMeshTools import IMeshTools_Parameters
from OCP.Message import Message
from OCP.TCollection import TCollection_AsciiString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Tool
from OCP.TopAbs import (
    TopAbs_EDGE,
    TopAbs_FACE,
    TopAbs_REVERSED,
    TopAbs_SHAPE,
    TopAbs_SHELL,
    TopAbs_SOLID,
    TopAbs_VERTEX,
)
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Iterator

_ELEMENTARY = (GeomAbs_Plane, GeomAbs_Cylinder, GeomAbs_Cone, GeomAbs_Sphere, GeomAbs_Torus)


class Attempt:
    """Suppresses an error of the kernel, or of numbers that it gave.

    In Python the kernel's classes of errors have no base in common, not even ``Standard_Failure``.
    """

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> bool:
        ours = isinstance(error, ArithmeticError | RuntimeError | ValueError)
        return ours or type(error).__module__.startswith("OCP.")


def quiet() -> None:
    """Switch the kernel's printers off, which write to standard output."""
    messenger = Message.DefaultMessenger_s()
    for printer in list(messenger.Printers()):
        messenger.RemovePrinter(printer)


def labels(fill: Callable[[Any], Any]) -> list[Any]:
    """Return the labels that ``fill`` puts into the kernel's sequence."""
    sequence = Sequence_TDF_Label()
    fill(sequence)
    return [sequence.Value(i) for i in range(1, sequence.Length() + 1)]


def entry(label: Any) -> str:
    """Return the label's address in its document, such as ``0:1:1:3``."""
    text = TCollection_AsciiString()
    TDF_Tool.Entry_s(label, text)
    return str(text.ToCString())


def name_of(label: Any) -> str:
    """Return the label's name; "" if it has none."""
    attribute = attribute_of(label, TDataStd_Name)
    return str(attribute.Get().ToExtString()) if attribute is not None else ""


def attribute_of(label: Any, kind: Any) -> Any | None:
    """Return the label's attribute of class ``kind``; None if it has none.

    Asked with IsAttribute first: FindAttribute on a label without the attribute ends the process with a
    segmentation fault for some classes (seen in 7.9 and 8.0).
    """
    if not label.IsAttribute(kind.GetID_s()):
        return None
    attribute = kind()
    label.FindAttribute(kind.GetID_s(), attribute)
    return attribute


def solids_of(shape: Any) -> list[Any]:
    """Return all solids of a shape, placed."""
    return _explored(shape, TopAbs_SOLID)


def faces_of(shape: Any) -> list[Any]:
    """Return all faces of a shape, placed and oriented."""
    return [TopoDS.Face(face) for face in _explored(shape, TopAbs_FACE)]


def edges_of(shape: Any) -> list[Any]:
    """Return all edges of a face or a solid, each as often as it is used; a seam twice."""
    return [TopoDS.Edge(edge) for edge in _explored(shape, TopAbs_EDGE)]


def loose_shells_of(shape: Any) -> list[Any]:
    """Return the shells of a shape that belong to no solid, placed."""
    return _explored(shape, TopAbs_SHELL, TopAbs_SOLID)


def loose_faces_of(shape: Any) -> list[Any]:
    """Return the faces of a shape that belong to no shell, placed and oriented."""
    return [TopoDS.Face(face) for face in _explored(shape, TopAbs_FACE, TopAbs_SHELL)]


def has_edges(shape: Any) -> bool:
    """Return True if there is any edge, in a face or alone."""
    return not shape.IsNull() and TopExp_Explorer(shape, TopAbs_EDGE).More()


def has_surface(face: Any) -> bool:
    """Return True if a face has more than triangles (unlike those of tessellated STEP)."""
    return BRep_Tool.Surface_s(face) is not None


def is_elementary(face: Any) -> bool:
    """Return True if it is a plane, a cylinder, a cone, a sphere or a torus."""
    return BRepAdaptor_Surface(face, False).GetType() in _ELEMENTARY


def is_plain(solid: Any) -> bool:
    """Return True if all faces are elementary, and all edges straight or round in them.

    Its integrals are then exact.
    """
    for face in faces_of(solid):
        surface = BRepAdaptor_Surface(face, False).GetType()
        if surface not in _ELEMENTARY:
            return False
        for edge in edges_of(face):
            kind = BRepAdaptor_Curve2d(edge, face).GetType()
            if kind != GeomAbs_Line and not (kind == GeomAbs_Circle and surface == GeomAbs_Plane):
                return False
    return True


def is_flat(solid: Any) -> bool:
    """Return True if all faces are planes and all edges straight: then its triangles are exactly the
    solid.
    """
    planes = (BRepAdaptor_Surface(face, False).GetType() == GeomAbs_Plane for face in faces_of(solid))
    return all(planes) and all(BRepAdaptor_Curve(edge).GetType() == GeomAbs_Line for edge in edges_of(solid))


def inside(shape: Any) -> Iterator[Any]:
    """Yield the direct parts of a shape, placed and oriented.

    The kernel's iterator does not keep the shape that it reads alive, but this frame does.
    """
    iterator = TopoDS_Iterator(shape, True, True)
    while iterator.More():
        yield iterator.Value()
        iterator.Next()


def _explored(shape: Any, kind: Any, outside: Any = TopAbs_SHAPE) -> list[Any]:
    if shape is None or shape.IsNull():
        return []
    explorer = TopExp_Explorer(shape, kind, outside)
    shapes = []
    while explorer.More():
        shapes.append(explorer.Current())
        explorer.Next()
    return shapes


MM = 1e-3
"""The kernel counts in mm."""


Level = tuple[float, float]
"""How fine a mesh is: linear deflection in diagonals of the box, and angle [rad]."""

PICTURE: Level = (0.005, 0.3)
COARSE: Level = (0.01, 0.5)
FINE: Level = (0.001, 0.12)

CLOSE = 0.01
"""A relative deviation of the volume below this is agreement: chords cut about that much off a cylinder."""

FINE_ENOUGH = 30_000
"""Triangles from where a finer mesh takes seconds, and chords are no excuse any more."""


def cross_check(
    solid: Any, volume_m3: float | None, *, small: bool = False
) -> tuple[Mesh, float | None, int]:
    """Compare meshes of a solid with ``volume_m3`` (> 0; None: nothing to compare), as few meshes as needed.

    ``small``: the solid is hardly visible in its product's picture, so a coarse mesh is tried first.

    The mesher sometimes fails although the geometry is good: a face without triangles at one fineness has
    some at another, and thin curved wires lose several per cent to chords. So one closed mesh that agrees
    proves a solid right, and so does the limit of two closed meshes, whose chord error goes with the square
    of the angle. Bad geometry is equally wrong at every fineness.

    Returns a mesh for the picture, the relative deviation of the best closed mesh (None if none is
    closed), and how many faces have no triangles in the picture's mesh.
    """
    tried: list[tuple[int, bool, Mesh]] = []
    closed: list[tuple[float, float]] = []
    deviation: float | None = None
    for level in (COARSE, PICTURE, FINE) if small else (PICTURE, COARSE, FINE):
        if level is FINE and max(len(mesh) for *_, mesh in tried) > FINE_ENOUGH:
            break
        mesh, missing = tessellated(solid, level)
        tried.append((missing, level is not PICTURE, mesh))
        if volume_m3 is not None and not missing:
            volume = abs(mesh_volume(mesh))
            limits = [volume + (volume - v) * level[1] ** 2 / (a**2 - level[1] ** 2) for a, v in closed]
            closed.append((level[1], volume))
            off = min(abs(v / volume_m3 - 1) for v in (volume, *limits))
            deviation = off if deviation is None else min(off, deviation)
        if not missing and (deviation is None or deviation < CLOSE):
            break
    missing, _, picture = min(tried, key=lambda t: t[:2])
    return picture, deviation, missing


def tessellated(shape: Any, level: Level = PICTURE) -> tuple[Mesh, int]:
    """Mesh a shape. Returns its triangles [m], and how many of its faces could not be meshed."""
    mesh_faces(shape, level)
    return triangles(shape)


def mesh_faces(shape: Any, level: Level, least: float = 0.1) -> None:
    """Mesh the faces of a shape; no edge is divided below ``least`` of their distance to it."""
    BRepTools.Clean_s(shape)
    wanted = IMeshTools_Parameters()
    wanted.Deflection, wanted.Angle = max(level[0] * box(shape)[1], 1e-7), level[1]
    wanted.MinSize = max(least * wanted.Deflection, 1e-7)
    BRepMesh_IncrementalMesh(shape, wanted)


def triangles(shape: Any) -> tuple[Mesh, int]:
    """Collect the existing triangles [m] of a shape's faces, and count the faces without any."""
    parts = list(face_meshes(shape))
    meshes = [part for part in parts if part is not None]
    return joined(meshes), len(parts) - len(meshes)


def face_meshes(shape: Any) -> Iterator[Mesh | None]:
    """Yield the existing triangles [m] of each face; None for a face that has none."""
    meshes: dict[Any, tuple[Floats, Any]] = {}  # a face may stand in many places
    place, matrix = TopLoc_Location(), np.eye(4)  # of the last face: those of a body follow each other
    for face in faces_of(shape):
        located = TopLoc_Location()
        triangulation = BRep_Tool.Triangulation_s(face, located)
        if triangulation is None:
            yield None
            continue
        if (key := face.TShape()) not in meshes:
            node, triangle = triangulation.Node, triangulation.Triangle
            meshes[key] = (
                np.array([xyz(node(i)) for i in range(1, triangulation.NbNodes() + 1)]),
                np.array([triangle(i).Get() for i in range(1, triangulation.NbTriangles() + 1)]) - 1,
            )
        points, faces = meshes[key]
        if not located.IsIdentity():
            if not located.IsEqual(place):
                place, matrix = located, trsf_matrix(located.Transformation())
            points = points @ matrix[:3, :3].T + matrix[:3, 3]
        yield Mesh(points * MM, faces[:, ::-1] if face.Orientation() == TopAbs_REVERSED else faces)


def box(shape: Any) -> tuple[Floats, float]:
    """Return the middle (3,) and the diagonal [mm] of the shape's box."""
    low, high = bounds(shape)
    return (low + high) / 2, float(np.linalg.norm(high - low))


def bounds(shape: Any) -> Box:
    """Return the lowest and highest corner [mm] of the shape's box; zeros if it is empty."""
    return _corners(_boxed(shape, BRepBndLib.Add_s))


def exact_bounds(shapes: Sequence[Any]) -> Box:
    """Return the corners [mm] of the box around the surfaces of shapes; zeros if they are empty."""
    while len(shapes) == 1 and shapes[0].ShapeType() not in _BARE:
        shapes = list(inside(shapes[0]))
    about = [(shape, _boxed(shape, BRepBndLib.Add_s)) for shape in shapes]
    parts = [(shape, _corners(found)) for shape, found in about if not found.IsVoid()]

    def exact(number: int) -> Box:
        part = parts[number][0]
        if part.ShapeType() not in _BARE:
            return exact_bounds([part])
        return _corners(_boxed(part, BRepBndLib.AddOptimal_s, False, False))

    return exact_box([corners for _, corners in parts], exact)


_BARE = (TopAbs_FACE, TopAbs_EDGE, TopAbs_VERTEX)


def _boxed(shape: Any, add: Callable[..., object], *how: bool) -> Any:
    bnd_box = Bnd_Box()
    add(shape, bnd_box, *how)
    if how:
        bnd_box.SetGap(0.0)
    return bnd_box


def _corners(corners: Any) -> Box:
    if corners.IsVoid():
        return np.zeros(3), np.zeros(3)
    return np.array(xyz(corners.CornerMin())), np.array(xyz(corners.CornerMax()))


def xyz(point: Any) -> tuple[float, float, float]:
    """Return the coordinates of a kernel point or vector."""
    return point.X(), point.Y(), point.Z()


def trsf_matrix(trsf: Any) -> Floats:
    """Return a kernel transformation as (4, 4), with lengths in mm as the kernel has them."""
    value = trsf.Value
    rows = [[value(i, j) for j in (1, 2, 3, 4)] for i in (1, 2, 3)]
    return np.array([*rows, [0.0, 0.0, 0.0, 1.0]])
