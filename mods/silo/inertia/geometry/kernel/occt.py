# SPDX-License-Identifier: LGPL-2.1-or-later
"""The one door to the geometry kernel: OpenCASCADE through OCP 8.

Importing this module imports the kernel (half a second and 200 MB): only the readers do, and they run in a
child process.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from silo.bom.errors import ConfigError

try:
    import OCP
except ModuleNotFoundError as error:  # pragma: no cover - the development environment always has it
    raise ConfigError(
        "STEP files and FreeCAD shapes need the geometry kernel, which is not installed: "
        'pip install "silo-mod[inertia]"'
    ) from error

if int(OCP.__version__.split(".")[0]) < 8:  # pragma: no cover - the development environment has a newer one
    raise ConfigError(
        f"the geometry kernel OCP {OCP.__version__} loses placements that scale or mirror; wanted version 8: "
        'pip install "silo-mod[inertia]"'
    )

try:
    from OCP.BRep import BRep_Tool
except ImportError as error:  # pragma: no cover - a machine without a desktop's libraries
    if "cannot open shared object file" not in str(error):
        raise
    raise ConfigError(
        f"the geometry kernel lacks a library of the system ({error}). "
        "On Debian and Ubuntu: apt-get install libgl1"
    ) from error

from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Curve2d, BRepAdaptor_Surface
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
from OCP.Message import Message
from OCP.TCollection import TCollection_AsciiString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Tool
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_SHAPE, TopAbs_SHELL, TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS

_ELEMENTARY = (GeomAbs_Plane, GeomAbs_Cylinder, GeomAbs_Cone, GeomAbs_Sphere, GeomAbs_Torus)


def quiet() -> None:
    """Take the kernel's printers away: it reports to standard output otherwise."""
    messenger = Message.DefaultMessenger_s()
    for printer in list(messenger.Printers()):
        messenger.RemovePrinter(printer)


def labels(fill: Callable[[Any], Any]) -> list[Any]:
    """The labels that ``fill`` puts into the kernel's sequence."""
    sequence = Sequence_TDF_Label()
    fill(sequence)
    return [sequence.Value(i) for i in range(1, sequence.Length() + 1)]


def entry(label: Any) -> str:
    """The label's address in its document, such as ``0:1:1:3``."""
    text = TCollection_AsciiString()
    TDF_Tool.Entry_s(label, text)
    return str(text.ToCString())


def name_of(label: Any) -> str:
    """The label's name, "" where it has none."""
    attribute = attribute_of(label, TDataStd_Name)
    return str(attribute.Get().ToExtString()) if attribute is not None else ""


def attribute_of(label: Any, kind: Any) -> Any | None:
    """The label's attribute of class ``kind``, or None.

    Asked with IsAttribute first: FindAttribute on a label without the attribute ends the process with a
    segmentation fault for some classes (seen in 7.9 and 8.0).
    """
    if not label.IsAttribute(kind.GetID_s()):
        return None
    attribute = kind()
    label.FindAttribute(kind.GetID_s(), attribute)
    return attribute


def solids_of(shape: Any) -> list[Any]:
    """All solids of a shape, placed."""
    return _explored(shape, TopAbs_SOLID)


def faces_of(shape: Any) -> list[Any]:
    """All faces of a shape, placed and oriented."""
    return [TopoDS.Face(face) for face in _explored(shape, TopAbs_FACE)]


def edges_of(shape: Any) -> list[Any]:
    """All edges of a face or a solid, each as often as it is used: a seam twice."""
    return [TopoDS.Edge(edge) for edge in _explored(shape, TopAbs_EDGE)]


def loose_shells_of(shape: Any) -> list[Any]:
    """The shells of a shape that stand in no solid, placed."""
    return _explored(shape, TopAbs_SHELL, TopAbs_SOLID)


def loose_faces_of(shape: Any) -> list[Any]:
    """The faces of a shape that stand in no shell, placed and oriented."""
    return [TopoDS.Face(face) for face in _explored(shape, TopAbs_FACE, TopAbs_SHELL)]


def has_edges(shape: Any) -> bool:
    """True where there is any edge, in a face or alone."""
    return not shape.IsNull() and TopExp_Explorer(shape, TopAbs_EDGE).More()


def has_surface(face: Any) -> bool:
    """False for a face that holds triangles only (tessellated STEP)."""
    return BRep_Tool.Surface_s(face) is not None


def is_elementary(face: Any) -> bool:
    """True for a plane, a cylinder, a cone, a sphere or a torus."""
    return BRepAdaptor_Surface(face, False).GetType() in _ELEMENTARY


def is_plain(solid: Any) -> bool:
    """True where all faces are elementary, and all edges straight or round in them: integrals are exact."""
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
    """True where all faces are planes and all edges straight: its triangles are the very solid."""
    planes = (BRepAdaptor_Surface(face, False).GetType() == GeomAbs_Plane for face in faces_of(solid))
    return all(planes) and all(BRepAdaptor_Curve(edge).GetType() == GeomAbs_Line for edge in edges_of(solid))


def _explored(shape: Any, kind: Any, outside: Any = TopAbs_SHAPE) -> list[Any]:
    if shape is None or shape.IsNull():
        return []
    explorer = TopExp_Explorer(shape, kind, outside)
    found = []
    while explorer.More():
        found.append(explorer.Current())
        explorer.Next()
    return found
