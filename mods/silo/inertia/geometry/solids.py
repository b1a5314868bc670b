# SPDX-License-Identifier: LGPL-2.1-or-later
"""Volume, centre and tensor of a shape of the geometry kernel, with every doubt about them named.

Rules of this module, each found on real files:

* ``VolumeProperties`` with a tolerance, never the overload without: that one is off by more than 1e-4 on one
  real part in thirteen, in silence.
* Integrated with the solid moved to the origin: from afar the tensor is the difference of huge numbers.
* A negative volume is a reversed shell. Its sign is turned, and said.
* The tessellation is integrated as well, by other code. Where both disagree the geometry is bad.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Tool
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.gp import gp_Trsf, gp_Vec
from OCP.GProp import GProp_GProps
from OCP.TopAbs import TopAbs_REVERSED
from OCP.TopLoc import TopLoc_Location

from silo.inertia.core import combine_arrays, place
from silo.inertia.geometry import occt
from silo.inertia.geometry.mesh import Floats, Mesh, is_inside, joined, mesh_solid, mesh_volume
from silo.inertia.model import GeometryCode, GeometryProblem, SolidProps

MM = 1e-3
"""The kernel counts in mm."""

MESH_TOLERANCE = 0.02
"""|V_mesh - V_brep| / V above this is bad geometry: all valid parts of 280 real ones stay below 0.7 %."""

CONVERGED = 1e-6
"""The integration's own error estimate above this says that it did not reach its tolerance."""

NEAR = 50.0
"""Distance from the origin, in sizes of the solid, up to where integrating from there costs no digits."""

FAR_AWAY = 1e4
"""Distance from the origin, in sizes of the solid, from where coordinates themselves lose digits."""

_LEVELS = ((0.005, 0.3), (0.002, 0.2), (0.001, 0.12))
"""Linear deflection (in diagonals of the box) and angle (rad): the first is enough for a picture and for most
parts; the finer ones make sure before a part is accused."""

_SUSPICIOUS = 0.008


@dataclass(frozen=True, eq=False)
class Measured:
    """What was found in one prototype; ``has_faces``, ``has_wires``: what there is without a solid."""

    solids: tuple[SolidProps, ...]
    problems: tuple[GeometryProblem, ...]
    mesh: Mesh | None
    has_faces: bool
    has_wires: bool = False

    @property
    def total(self) -> tuple[float, Floats, Floats]:
        """Volume [m^3], centre (3,) [m], tensor per unit density (3, 3) [m^5] about it, of all solids."""
        if not self.solids:
            return 0.0, np.zeros(3), np.zeros((3, 3))
        body = combine_arrays(
            [s.volume_m3 for s in self.solids],
            np.array([s.com_m for s in self.solids]),
            np.array([s.inertia_unit for s in self.solids]),
        )
        return body.mass, body.com, body.inertia


def measure(shapes: list[Any], *, eps: float, mesh_check: bool) -> Measured:
    """All solids of ``shapes``, in their common axes."""
    problems: list[GeometryProblem] = []
    found = [solid for shape in shapes for solid in occt.solids_of(shape)]
    pairs: list[tuple[SolidProps, Mesh | None]] = []
    for number, solid in enumerate(found, start=1):
        props, mesh = _solid(solid, eps, mesh_check, _noter(problems, number, len(found)))
        if props is not None:
            pairs.append((props, mesh))
    meshes = [mesh for _, mesh in pairs if mesh is not None]
    bare = [] if found else [shape for shape in shapes if occt.faces_of(shape)]
    if mesh_check and bare:
        meshes = [_tessellated(shape, *_LEVELS[0])[0] for shape in bare]
    solids = _without_cavities(pairs, problems)
    whole = joined(meshes) if meshes else None
    wires = any(occt.has_edges(shape) for shape in shapes)
    return Measured(solids, tuple(problems), whole, bool(found or bare), wires)


def _without_cavities(
    pairs: list[tuple[SolidProps, Mesh | None]], problems: list[GeometryProblem]
) -> tuple[SolidProps, ...]:
    """Reversed solids that lie inside the material of another one are cavities: taken off, and said."""
    solids = [props for props, _ in pairs]
    if len({s.reversed for s in solids}) < 2:
        return tuple(solids)
    hosts = [i for i, s in enumerate(solids) if not s.reversed]
    gone = set()
    for i, (props, mesh) in enumerate(pairs):
        host = next((h for h in hosts if props.reversed and _encloses(pairs[h][1], mesh)), None)
        if host is not None:
            solids[host] = _minus(solids[host], props)
            gone.add(i)
    taken, turned = len(gone), sum(s.reversed for s in solids) - len(gone)
    problems.append(
        GeometryProblem(
            GeometryCode.NEGATIVE_VOLUME,
            "some solids of this product are inside out and some are not: "
            f"{taken} taken as cavities of the solid around them, {turned} as bodies",
        )
    )
    return tuple(s for i, s in enumerate(solids) if i not in gone)


def _encloses(outer: Mesh | None, inner: Mesh | None) -> bool:
    return outer is not None and inner is not None and len(inner) > 0 and is_inside(inner, outer)


def _minus(body: SolidProps, cavity: SolidProps) -> SolidProps:
    rest = combine_arrays(
        [body.volume_m3, -cavity.volume_m3],
        np.array([body.com_m, cavity.com_m]),
        np.array([body.inertia_unit, -cavity.inertia_unit]),
    )
    return SolidProps(rest.mass, rest.com, rest.inertia, body.reversed)


Note = Callable[[GeometryCode, str], None]


def _noter(problems: list[GeometryProblem], number: int, count: int) -> Note:
    where = f"solid {number} of {count}: " if count > 1 else ""

    def note(code: GeometryCode, message: str) -> None:
        problems.append(GeometryProblem(code, where + message))

    return note


def _solid(solid: Any, eps: float, mesh_check: bool, note: Note) -> tuple[SolidProps | None, Mesh | None]:
    if not all(occt.has_surface(face) for face in occt.faces_of(solid)):
        return _triangulated_solid(solid, note)
    props = _integrated(solid, eps, note)
    if not BRepCheck_Analyzer(solid).IsValid():
        note(GeometryCode.INVALID_SHAPE, "the geometry kernel's own check finds this shape invalid")
    mesh = _cross_checked(solid, props, note) if mesh_check else None
    return props, mesh


def _integrated(solid: Any, eps: float, note: Note) -> SolidProps | None:
    # The kernel integrates in the axes of the bare geometry and applies the location afterwards. So do we,
    # but with our own algebra; only the bare geometry's distance from its origin can cost digits.
    location = trsf_matrix(solid.Location().Transformation())
    bare = solid.Located(TopLoc_Location())
    centre, size = _box(bare)
    distance = float(np.linalg.norm(centre))
    if distance > NEAR * size > 0:
        bare = _rebuilt(bare, -centre)
    else:
        centre = np.zeros(3)
    system = GProp_GProps()
    error = float(BRepGProp.VolumeProperties_s(bare, system, eps, False, False))
    volume = float(system.Mass())
    if not np.isfinite(volume) or volume == 0.0:
        note(GeometryCode.INVALID_SHAPE, "the solid has no volume that can be computed; it is left out")
        return None
    if error > CONVERGED:
        note(
            GeometryCode.NOT_CONVERGENT,
            f"the volume integration stopped at a relative error of {error:.1g}, wanted {eps:.1g}",
        )
    if distance > FAR_AWAY * size > 0:
        note(
            GeometryCode.BAKED,
            f"the geometry lies {distance * MM:.3g} m from its own origin, {distance / size:.0f} times its "
            "size; its coordinates have lost digits",
        )
    if volume < 0:
        note(
            GeometryCode.NEGATIVE_VOLUME,
            f"the solid is inside out (volume {volume * MM**3:.6g} m3); its sign was turned",
        )
    return _props(system, centre, location)


def _rebuilt(shape: Any, offset: Floats) -> Any:
    step = gp_Trsf()
    step.SetTranslation(gp_Vec(*offset))
    return BRepBuilderAPI_Transform(shape, step, True).Shape()


def _props(system: GProp_GProps, centre: Floats, location: Floats) -> SolidProps:
    volume = float(system.Mass())
    sign = -1.0 if volume < 0 else 1.0
    com, tensor = system.CentreOfMass(), system.MatrixOfInertia()
    inertia = np.array([[tensor.Value(i, j) for j in (1, 2, 3)] for i in (1, 2, 3)])
    volumes, coms, units = place(
        [sign * volume * MM**3],
        [(np.array(_xyz(com)) + centre) * MM],
        [sign * inertia * MM**5],
        [in_metres(location)],
    )
    return SolidProps(float(volumes[0]), coms[0], units[0], reversed=volume < 0)


def _triangulated_solid(solid: Any, note: Note) -> tuple[SolidProps | None, Mesh | None]:
    """A solid whose faces are triangles without surfaces (AP242 tessellated): its polyhedron is exact."""
    mesh, missing = _triangles(solid)
    if missing or not len(mesh) or mesh_volume(mesh) == 0.0:
        note(
            GeometryCode.INVALID_SHAPE,
            "the solid mixes triangles and surfaces, or has neither; it is left out",
        )
        return None, mesh if len(mesh) else None
    props = mesh_solid(mesh)
    note(GeometryCode.READER, "the solid is given as triangles; its volume is that of the triangles")
    if props.reversed:
        note(GeometryCode.NEGATIVE_VOLUME, "the solid's triangles look inwards; its sign was turned")
    return props, mesh


def _cross_checked(solid: Any, props: SolidProps | None, note: Note) -> Mesh:
    """The solid's mesh for the picture; a note where its volume is not the solid's."""
    picture: Mesh | None = None
    for level in _LEVELS:
        mesh, missing = _tessellated(solid, *level)
        if picture is None and (not missing or level is _LEVELS[-1]):
            picture = mesh
        deviation = _deviation(mesh, props) if props is not None else 0.0
        if not missing and deviation < _SUSPICIOUS:
            break
    if deviation > MESH_TOLERANCE:
        note(
            GeometryCode.MESH_MISMATCH,
            f"its surface mesh encloses a volume that differs by {deviation:.1%}: the geometry is bad, "
            "and so may be its mass",
        )
    elif missing:
        note(GeometryCode.MESH_MISMATCH, f"{missing} of its faces cannot be meshed; the check is incomplete")
    return picture if picture is not None else mesh


def _deviation(mesh: Mesh, props: SolidProps) -> float:
    return abs(abs(mesh_volume(mesh)) - props.volume_m3) / props.volume_m3


def _tessellated(shape: Any, linear: float, angle: float) -> tuple[Mesh, int]:
    from OCP.BRepTools import BRepTools

    size = _box(shape)[1]
    BRepTools.Clean_s(shape)
    BRepMesh_IncrementalMesh(shape, max(linear * size, 1e-7), False, angle, False)
    return _triangles(shape)


def _triangles(shape: Any) -> tuple[Mesh, int]:
    """The triangles that lie on a shape's faces, and how many faces have none."""
    parts: list[Mesh] = []
    missing = 0
    for face in occt.faces_of(shape):
        located = TopLoc_Location()
        triangulation = BRep_Tool.Triangulation_s(face, located)
        if triangulation is None:
            missing += 1
            continue
        parts.append(_face_mesh(triangulation, located, face.Orientation() == TopAbs_REVERSED))
    return joined(parts), missing


def _face_mesh(triangulation: Any, located: Any, backwards: bool) -> Mesh:
    node, triangle = triangulation.Node, triangulation.Triangle
    points = np.array([_xyz(node(i)) for i in range(1, triangulation.NbNodes() + 1)])
    faces = np.array([triangle(i).Get() for i in range(1, triangulation.NbTriangles() + 1)]) - 1
    if not located.IsIdentity():
        matrix = trsf_matrix(located.Transformation())
        points = points @ matrix[:3, :3].T + matrix[:3, 3]
    return Mesh(points * MM, faces[:, ::-1] if backwards else faces)


def _xyz(point: Any) -> tuple[float, float, float]:
    return point.X(), point.Y(), point.Z()


def _box(shape: Any) -> tuple[Floats, float]:
    """Middle (3,) and diagonal [mm] of the shape's box."""
    box = Bnd_Box()
    BRepBndLib.Add_s(shape, box)
    if box.IsVoid():
        return np.zeros(3), 0.0
    low, high = np.array(_xyz(box.CornerMin())), np.array(_xyz(box.CornerMax()))
    return (low + high) / 2, float(np.linalg.norm(high - low))


def trsf_matrix(trsf: Any) -> Floats:
    """A kernel transformation as (4, 4), lengths in mm as the kernel has them."""
    matrix = np.eye(4)
    value = trsf.Value
    for i in range(3):
        for j in range(4):
            matrix[i, j] = value(i + 1, j + 1)
    return matrix


def in_metres(matrix: Floats) -> Floats:
    """The same (4, 4) placement(s), the translation in m instead of mm."""
    result = matrix.copy()
    result[..., :3, 3] *= MM
    return result
