# SPDX-License-Identifier: LGPL-2.1-or-later
"""Volume, centre and tensor of a shape of the geometry kernel, with every doubt about them named.

Rules of this module, each found on real files:

* The integration is chosen for each solid (see below); the kernel's usual one is off in silence.
* Integrated with the solid moved to the origin: from afar the tensor is the difference of huge numbers.
* A negative volume is a reversed shell. Its sign is turned, and said.
* The tessellation is integrated as well, by other code. Where both disagree the geometry is bad.
* A solid that stands in a product fifty times (the pins of a connector) is measured once.

Which integration a solid gets: the kernel's plain one, its controlled one, or our own.

* Planes, cylinders, cones, spheres and tori between straight and round edges are exact by the plain
  integration. Everything else needs control: the plain one is off by more than 1e-4 on one real part in
  thirteen.
* The kernel's controlled integration looks at the volume only, so a tensor lags behind by up to four powers
  of ten. Of splines drawn along a line it may give any volume, with an estimated error of 1e-16 (FreeCAD's
  example of an engine block: -97 cm³ instead of 763). Our own controls all ten moments of every edge. It is
  slower, and so it is asked where the plain and the controlled integration differ.
* Where the kernel's and ours differ although both have converged, ours is asked how far it depends on the way
  that the volume is taken: less than both differ, and the kernel's is wrong; more than :data:`STATED`, and
  the faces do not meet at their edges, so no integration is right, and a warning says so.

What two solids have in common is found by the kernel's boolean operation, where their meshes come close at
all. Faces close if each edge is used twice, in opposite directions, after sewing what nearly meets.

Shapes are also read here in the kernel's own form: .brep and .brp files, the entries of FreeCAD documents,
and what helpers are sent to measure.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from OCP.BinTools import BinTools
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Curve2d, BRepAdaptor_Surface
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeSolid, BRepBuilderAPI_Sewing, BRepBuilderAPI_Transform
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp, BRepGProp_Domain, BRepGProp_Face, BRepGProp_Vinert
from OCP.BRepTools import BRepTools
from OCP.GeomAbs import (
    GeomAbs_BSplineCurve,
    GeomAbs_BSplineSurface,
    GeomAbs_Circle,
    GeomAbs_Cone,
    GeomAbs_Cylinder,
    GeomAbs_Ellipse,
    GeomAbs_Line,
    GeomAbs_Plane,
    GeomAbs_Sphere,
    GeomAbs_SurfaceOfExtrusion,
    GeomAbs_SurfaceOfRevolution,
    GeomAbs_Torus,
)
from OCP.gp import gp_Pnt, gp_Trsf, gp_Vec
from OCP.GProp import GProp_GProps
from OCP.ShapeAnalysis import ShapeAnalysis_Shell
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FORWARD, TopAbs_REVERSED, TopAbs_WIRE
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Compound, TopoDS_Shape

from silo.bom.errors import DocumentError
from silo.bom.message import message
from silo.inertia.assembly import Assembly, Instance, SolidProps
from silo.inertia.geometry import kernel as occt
from silo.inertia.geometry.exact import (
    Basis,
    Curve,
    Elementary,
    Face,
    Floats,
    Moments,
    Nurbs,
    SampledSurface,
    Surface,
    Turned,
    integrate,
)
from silo.inertia.geometry.formats import is_binary_brep
from silo.inertia.geometry.graph import in_metres
from silo.inertia.geometry.helpers import Helpers, Task
from silo.inertia.geometry.kernel import (
    MM,
    bounds,
    box,
    cross_check,
    tessellated,
    triangles,
    trsf_matrix,
    xyz,
)
from silo.inertia.geometry.measured import (
    CONVERGED,
    INVALID,
    MESH_TOLERANCE,
    NO_VOLUME,
    STATED,
    Measured,
    cavity_note,
    differing_note,
    drift_note,
    integration_notes,
    loose_notes,
    mesh_notes,
    open_note,
    shell_note,
)
from silo.inertia.geometry.options import ReadOptions, Report
from silo.inertia.geometry.reading import GeometryReading
from silo.inertia.geometry.together import (
    NOTHING,
    PICTURE_TRIANGLES,
    Body,
    Mesh,
    MeshCommon,
    enclosed,
    is_inside,
    joined,
    open_edges,
    simplified,
    together,
    welded,
)
from silo.inertia.notes import GeometryCode, Note
from silo.inertia.placements import place
from silo.platform.whole_files import remove_patiently

TENSOR_SHARE = 1e-4
"""Of the tolerance, for solids of planes, cylinders, cones, spheres and tori: they cost little at the finer
one, and a torus at 1e-8 has a tensor 1.1e-7 off, at 1e-12 1.6e-11."""

SUSPICIOUS = 1e-5
"""Plain and controlled integration differ by more: the controlled tensor may be off by as much."""

AGREE = 1e-6
"""The volumes of the kernel's integration and ours differ by less: then our tensor is the better one."""

PLAIN_ERROR = 1e-12
"""Of the plain integration of a plain solid, relative to its volume."""


def solid_moments(solid: Any, eps: float, notes: list[Note]) -> Moments:
    """Measure the volume, centre and tensor of a solid near its own origin, in mm.

    ``eps`` is relative to the volume.
    """
    plain = _usual(solid)
    if occt.is_plain(solid):
        return plain
    elementary = all(occt.is_elementary(face) for face in occt.faces_of(solid))
    kernel = by_kernel(solid, eps * TENSOR_SHARE if elementary else eps)
    if not np.isfinite(kernel.volume) or kernel.volume == 0.0:
        return kernel
    if kernel.error <= CONVERGED and _difference(plain, kernel) <= SUSPICIOUS:
        return kernel
    ours = None
    with occt.Attempt():
        ours = moments(solid, abs(kernel.volume), eps)
    if ours is None:
        return kernel
    # The two cannot agree on the volume of an open or torn shell; then the kernel's doubt stays.
    # If the faces close, the kernel may be that far off: for closed splines drawn along a line.
    apart = abs(ours.volume - kernel.volume) / abs(kernel.volume)
    if ours.error > CONVERGED or (apart > MESH_TOLERANCE and ours.drift > STATED):
        return ours if ours.error < kernel.error and apart <= MESH_TOLERANCE else kernel
    # Ours depends less on its own formula than it differs from the kernel's: then the kernel's is wrong.
    better = kernel.error > CONVERGED or apart <= AGREE or ours.drift < apart
    if (note := drift_note(ours.drift)) is not None:
        notes.append(note)
    elif not better and (difference := _difference(kernel, ours)) > STATED:
        notes.append(differing_note(difference))
    return ours if better else kernel


def by_kernel(solid: Any, eps: float) -> Moments:
    """Let the kernel integrate a solid with the tolerance ``eps``, relative to the volume."""
    system = GProp_GProps()
    error = float(BRepGProp.VolumeProperties_s(solid, system, eps, False, False))
    return _moments_of(system, error)


def _usual(solid: Any) -> Moments:
    """Let the kernel integrate a solid without any tolerance."""
    system = GProp_GProps()
    BRepGProp.VolumeProperties_s(solid, system)
    return _moments_of(system, PLAIN_ERROR)


def _moments_of(system: Any, error: float) -> Moments:
    tensor = system.MatrixOfInertia()
    inertia = np.array([[tensor.Value(i, j) for j in (1, 2, 3)] for i in (1, 2, 3)])
    return Moments(float(system.Mass()), np.array(xyz(system.CentreOfMass())), inertia, error)


def _difference(own: Moments, other: Moments) -> float:
    """Return the larger relative difference of volumes and of tensors."""
    tensor = float(np.abs(own.inertia - other.inertia).max() / max(np.abs(other.inertia).max(), 1e-300))
    return max(abs(own.volume / other.volume - 1), tensor)


_ELEMENTARY_KINDS = {
    GeomAbs_Plane: (Basis.LINEAR, Basis.LINEAR),
    GeomAbs_Cylinder: (Basis.CIRCULAR, Basis.LINEAR),
    GeomAbs_Cone: (Basis.CIRCULAR, Basis.LINEAR),
    GeomAbs_Sphere: (Basis.CIRCULAR, Basis.CIRCULAR),
    GeomAbs_Torus: (Basis.CIRCULAR, Basis.CIRCULAR),
}
_ROUND = (GeomAbs_Circle, GeomAbs_Ellipse)


def moments(solid: Any, volume: float, eps: float) -> Moments:
    """Integrate the moments of a solid in mm; ``volume`` is an estimate, not 0."""
    centre, size = box(solid)
    faces = [_face(face) for face in occt.faces_of(solid)]
    return integrate(faces, centre=centre, size=max(size / 2, 1e-9), volume=volume, eps=eps)


def _face(face: Any) -> Face:
    return Face(_surface(face), [_curve(face, edge) for edge in _edges(face)])


def _edges(face: Any) -> Iterator[Any]:
    """Yield the edges with the face's own orientation; a seam twice, as the wire has it."""
    for wire in occt.inside(face):
        if wire.ShapeType() == TopAbs_WIRE:
            for edge in occt.inside(wire):
                if edge.ShapeType() == TopAbs_EDGE and edge.Orientation() in (
                    TopAbs_FORWARD,
                    TopAbs_REVERSED,
                ):
                    yield TopoDS.Edge(edge)


def _curve(face: Any, edge: Any) -> Curve:
    adaptor = BRepAdaptor_Curve2d(edge, face)
    kind = adaptor.GetType()
    first, last = adaptor.FirstParameter(), adaptor.LastParameter()
    sign = -1.0 if edge.Orientation() == TopAbs_REVERSED else 1.0

    def asked(t: Floats) -> Floats:
        points = [adaptor.Value(x) for x in t.tolist()]
        return np.array([(p.X(), p.Y()) for p in points]).reshape(-1, 2)

    ends = np.array([first, last])
    if kind == GeomAbs_Line:
        return Curve(_fitted(asked, Basis.LINEAR), ends, sign, line=True)
    if kind in _ROUND:
        return Curve(_fitted(asked, Basis.CIRCULAR), np.linspace(first, last, 5), sign)
    if kind == GeomAbs_BSplineCurve:
        spline = adaptor.BSpline()
        knots = np.array([spline.Knot(n) for n in range(1, spline.NbKnots() + 1)])
        return Curve(asked, np.union1d(ends, knots[(knots > first) & (knots < last)]), sign)
    return Curve(asked, np.linspace(first, last, 5), sign)


def _fitted(asked: Callable[[Floats], Floats], basis: Basis) -> Callable[[Floats], Floats]:
    """Find the line, circle or ellipse through a few of its points."""
    coefficients = np.linalg.solve(basis.at(basis.samples), asked(basis.samples))
    return lambda t: basis.at(t) @ coefficients


def _surface(face: Any) -> Surface:
    """Find the form of the face's surface that is the same surface and quickest to evaluate."""
    adaptor = BRepAdaptor_Surface(face, True)
    kind = adaptor.GetType()
    u_range = (adaptor.FirstUParameter(), adaptor.LastUParameter())
    v_range = (adaptor.FirstVParameter(), adaptor.LastVParameter())

    def value(u: float, v: float) -> tuple[float, float, float]:
        return xyz(adaptor.Value(u, v))

    def ask(u: float, v: float) -> Any:
        point, du, dv = gp_Pnt(), gp_Vec(), gp_Vec()
        adaptor.D1(u, v, point, du, dv)
        return xyz(point), xyz(du), xyz(dv)

    if kind in _ELEMENTARY_KINDS:
        return Elementary.sampled(*_ELEMENTARY_KINDS[kind], value, u_range)
    if kind == GeomAbs_BSplineSurface:
        return _nurbs(adaptor.BSpline().Copy(), u_range, v_range)
    if kind == GeomAbs_SurfaceOfRevolution:
        return Turned(ask, u_range)
    if kind == GeomAbs_SurfaceOfExtrusion:
        basis = adaptor.BasisCurve()
        if basis.GetType() in _ROUND:
            return Elementary.sampled(Basis.CIRCULAR, Basis.LINEAR, value, u_range)
        if basis.GetType() == GeomAbs_BSplineCurve:
            along = np.array(xyz(adaptor.Direction()))
            return _drawn(basis.BSpline().Copy(), along, u_range, v_range)
    return SampledSurface(ask, np.linspace(*u_range, 5))


_Range = tuple[float, float]


def _drawn(curve: Any, along: Floats, u_range: _Range, v_range: _Range) -> Nurbs:
    periodic = curve.IsPeriodic()
    if periodic:
        turn = curve.FirstParameter(), curve.LastParameter()
        curve.SetNotPeriodic()
        curve.Segment(*turn)  # with knots of a full order at both ends: the turn's own
    rows = range(1, curve.NbPoles() + 1)
    poles = np.array([xyz(curve.Pole(i)) for i in rows])
    weights = np.array([curve.Weight(i) for i in rows]) if curve.IsRational() else None
    knots = _repeated(curve.NbKnots(), curve.Knot, curve.Multiplicity)
    surface = Nurbs.drawn((poles, weights, knots, curve.Degree()), along, v_range)
    return surface.unrolled(u_range if periodic else None)


def _nurbs(spline: Any, u_range: _Range, v_range: _Range) -> Nurbs:
    u_periodic, v_periodic = spline.IsUPeriodic(), spline.IsVPeriodic()
    u_first, u_last, v_first, v_last = spline.Bounds()
    if u_periodic:
        spline.SetUNotPeriodic()
    if v_periodic:
        spline.SetVNotPeriodic()
    if u_periodic or v_periodic:  # with knots of a full order at both ends: the turn's own
        spline.Segment(u_first, u_last, v_first, v_last)
    rows, columns = range(1, spline.NbUPoles() + 1), range(1, spline.NbVPoles() + 1)
    weights = None
    if spline.IsURational() or spline.IsVRational():
        weights = np.array([[spline.Weight(i, j) for j in columns] for i in rows])
    surface = Nurbs(
        np.array([[xyz(spline.Pole(i, j)) for j in columns] for i in rows]),
        weights,
        _repeated(spline.NbUKnots(), spline.UKnot, spline.UMultiplicity),
        _repeated(spline.NbVKnots(), spline.VKnot, spline.VMultiplicity),
        spline.UDegree(),
        spline.VDegree(),
    )
    return surface.unrolled(u_range if u_periodic else None, v_range if v_periodic else None)


def _repeated(count: int, knot: Callable[[int], float], multiplicity: Callable[[int], int]) -> Floats:
    numbers = range(1, count + 1)
    return np.repeat([knot(n) for n in numbers], [multiplicity(n) for n in numbers])


EPS = 1e-8

MOST_FACES_COMMON = 1500
"""Faces of both solids together; with more, a boolean operation takes too long, and meshes are compared."""

SECONDS = 3.0
"""For the boolean operations of one product; after that meshes are compared."""

CHORDS = 0.02
"""Share of the smaller solid; chords may be why near meshes have less than this in common."""


class KernelCommon:
    """Compares the solids of one product, within :data:`SECONDS`."""

    def __init__(self) -> None:
        self._meshes = MeshCommon()
        self._spent = 0.0

    def __call__(self, body: Body, other: Body) -> SolidProps | None:
        """Return the moments of what both have in common; None if they cannot be found."""
        if body.mesh is not None and other.mesh is not None:
            solid_props = _by_distance(body, other, body.mesh, other.mesh)
            if solid_props is not None:
                return solid_props
            if body.exact and other.exact:
                exact = self._meshes(body, other)
                if exact is not None:
                    return exact
        faces = len(occt.faces_of(body.shape)) + len(occt.faces_of(other.shape))
        if faces <= MOST_FACES_COMMON and self._spent < SECONDS:
            begin = time.process_time()
            props = _common(body, other)
            self._spent += time.process_time() - begin
            if props is not None:
                return props
        near = self._meshes(body, other)
        least = min(body.props.volume_m3, other.props.volume_m3)
        return None if near is None or 0 < near.volume_m3 <= CHORDS * least else near


def _by_distance(body: Body, other: Body, mesh: Mesh, small: Mesh) -> SolidProps | None:
    """Return nothing, or the whole smaller body, if the surfaces do not come near each other; otherwise
    None.
    """
    margin = 0.02 * max(float(np.linalg.norm(mesh.extents)), float(np.linalg.norm(small.extents)))
    low, high = np.maximum(body.low, other.low) - margin, np.minimum(body.high, other.high) + margin
    here, there = _within(mesh, low, high), _within(small, low, high)
    if here.any() and there.any():
        return None
    if is_inside(small, mesh):
        return other.props
    return body.props if is_inside(mesh, small) else NOTHING


def _within(mesh: Mesh, low: Floats, high: Floats) -> np.ndarray:
    """Return (n,) bool: True for triangles whose boxes reach into the box."""
    corners = mesh.vertices[mesh.faces]
    inside: np.ndarray = ((corners.min(axis=1) <= high) & (corners.max(axis=1) >= low)).all(axis=1)
    return inside


def _common(body: Body, other: Body) -> SolidProps | None:
    with occt.Attempt():
        operation = BRepAlgoAPI_Common(body.shape, other.shape)
        if not operation.IsDone():
            return None
        if not occt.solids_of(operation.Shape()):
            return NOTHING
        common_part = by_kernel(operation.Shape(), EPS)
        least = min(body.props.volume_m3, other.props.volume_m3)
        volume = common_part.volume * MM**3
        if 0 <= volume <= (1 + 1e-5) * least:  # NaN is not
            return SolidProps(volume, common_part.com * MM, common_part.inertia * MM**5)
    return None


MEETING = 1e-4
"""Share of a shape's size; edges that are closer are one. Real files have gaps of 5 µm in parts of 100 mm."""

MOST_FACES_LOOSE = 20_000
"""Loose faces of one product that are sewn."""


def open_edges_of(solid: Any) -> int | None:
    """Count the open edges of a solid; 0 if only its faces disagree, None if it is closed."""
    if _is_closed(solid):
        return None
    middle, size = box(solid)
    sewing = _sewn(occt.faces_of(solid), MEETING * size)
    edges = sewing.NbFreeEdges() + sewing.NbMultipleEdges() if sewing is not None else 0
    if sewing is not None and not edges:
        # It is closed; but faces that disagreed on what is outside were turned over.
        sewn = abs(_flux(sewing.SewedShape(), middle))
        if abs(sewn - abs(_flux(solid, middle))) <= CONVERGED * sewn:
            return None
    return edges


def beside_edges(solid: Any, volume: float) -> float:
    """Estimate how much of ``volume`` [mm^3] lies between faces and their own edges, relative; 0 if they
    meet.

    In a file, a face may be at another place than its edges. The kernel then widens the edges' tolerances
    until both agree, and finds the shape valid. So only wide edges are checked.
    """
    least = STATED * abs(volume) / max(box(solid)[1], 1e-9) ** 2
    beside = 0.0
    for face in occt.faces_of(solid):
        edges = occt.edges_of(face)
        if all(BRep_Tool.Tolerance_s(edge) < least for edge in edges):
            continue
        gaps = np.array([_gap_and_length(edge, face) for edge in edges])
        if gaps[:, 0].max() >= least:
            system = GProp_GProps()
            BRepGProp.SurfaceProperties_s(face, system)
            beside += abs(system.Mass()) * float(gaps.prod(axis=1).sum() / max(gaps[:, 1].sum(), 1e-300))
    return beside / abs(volume)


def _gap_and_length(edge: Any, face: Any) -> tuple[float, float]:
    """Return the mean distance [mm] between an edge's curve in the face and in space, and its approximate
    length.

    It is the distance across the curve: points that are only shifted along it make no gap.
    """
    if BRep_Tool.Degenerated_s(edge):
        return 0.0, 0.0
    flat = None
    with occt.Attempt():
        surface, curve = BRepAdaptor_Surface(face, False), BRepAdaptor_Curve(edge)
        flat = BRepAdaptor_Curve2d(edge, face)
    if flat is None:  # a curve of it is missing, and the kernel's check says so
        return 0.0, 0.0
    rows = []
    for t in np.linspace(curve.FirstParameter(), curve.LastParameter(), 9).tolist():
        point, slope, uv = gp_Pnt(), gp_Vec(), flat.Value(t)
        curve.D1(t, point, slope)
        rows.append((xyz(point), xyz(slope), xyz(surface.Value(uv.X(), uv.Y()))))
    there, slopes, here = np.array(rows).swapaxes(0, 1)
    along = slopes / np.maximum(np.linalg.norm(slopes, axis=1, keepdims=True), 1e-300)
    gaps = np.linalg.norm(np.cross(here - there, along), axis=1)
    return float(gaps.mean()), float(np.linalg.norm(np.diff(there, axis=0), axis=1).sum())


def closed_shells(shapes: list[Any]) -> tuple[list[Any], list[Any]]:
    """Divide the surfaces of ``shapes`` in no solid into closed ones, made into solids, and the others."""
    closed: list[Any] = []
    left: list[Any] = []
    for shape in shapes:
        for shell in occt.loose_shells_of(shape):
            (closed if _is_closed(shell) else left).append(shell)
        left += occt.loose_faces_of(shape)
    loose = [face for shape in left for face in occt.faces_of(shape) if occt.has_surface(face)]
    if 1 < len(loose) <= MOST_FACES_LOOSE:
        size = max(box(shape)[1] for shape in shapes)
        sewing = _sewn(loose, MEETING * size)
        if sewing is not None:
            left = [other for other in left if not all(map(occt.has_surface, occt.faces_of(other)))]
            sewn = sewing.SewedShape()
            for shell in occt.loose_shells_of(sewn):
                (closed if _is_closed(shell) else left).append(shell)
            left += occt.loose_faces_of(sewn)
    return [BRepBuilderAPI_MakeSolid(TopoDS.Shell(shell)).Solid() for shell in closed], left


def _is_closed(shape: Any) -> bool:
    """Judge by the edges that its faces share; a sphere's pole and a cylinder's seam are no open edges.

    Faces with nothing but triangles (tessellated STEP) have no edges; their triangles have.
    """
    if not all(occt.has_surface(face) for face in occt.faces_of(shape)):
        mesh, missing = triangles(shape)
        return not missing and not open_edges(welded(mesh.vertices, mesh.faces))
    check = ShapeAnalysis_Shell()
    check.CheckOrientedShells(shape, True, True)
    return not check.HasFreeEdges() and not check.HasBadEdges()


def _sewn(faces: list[Any], tolerance: float) -> Any:
    sewing = BRepBuilderAPI_Sewing(max(tolerance, 1e-6))
    for face in faces:
        sewing.Add(face)
    with occt.Attempt():
        sewing.Perform()
        return sewing
    return None


def _flux(shape: Any, point: Floats) -> float:
    """Integrate the volume [mm^3] as it is seen from ``point`` ((3,) [mm]), with the kernel's usual rule.

    The kernel's own sum for a shape is taken from a point of its own choice.
    """
    seen = gp_Pnt(*point.tolist())
    vinerts = (BRepGProp_Vinert(BRepGProp_Face(f), BRepGProp_Domain(f), seen) for f in occt.faces_of(shape))
    return float(sum(vinert.Mass() for vinert in vinerts))


SMALL = 0.1
"""Size of a solid in sizes of its product, below which its picture may be coarse."""

MANY_FACES = 60
"""A solid with more is full of small faces, whose picture may be coarse; meshing it is the most work."""

NEAR = 50.0
"""Distance from the origin, in sizes of the solid, up to where integrating from there costs no digits."""


def measure(shapes: list[Any], *, eps: float, mesh_check: bool) -> Measured:
    """Measure all solids of ``shapes``, in their common axes.

    Closed shells count as solids, with a note.
    """
    problems: list[Note] = []
    bodies: list[Body] = []
    bares: dict[tuple[int, Any], _MeasuredSolid] = {}
    solids = [solid for shape in shapes for solid in occt.solids_of(shape)]
    shells, left = closed_shells(shapes)
    if shells:
        problems.append(shell_note(len(shells), len(solids)))
    measured_bodies = [*solids, *shells]
    picture = _Picture.of(shapes, len(measured_bodies)) if mesh_check else None
    for number, solid in enumerate(measured_bodies, start=1):
        # The kernel's shared body of equal solids; kept in _Bare, so that its id stays its own.
        body = solid.TShape()
        key = (id(body), solid.Orientation())
        if key not in bares:
            bares[key] = _measured(solid.Located(TopLoc_Location()), body, eps, picture)
            where = (
                message("solid {number} of {count}: ", number=number, count=len(measured_bodies))
                if len(measured_bodies) > 1
                else ""
            )
            problems += [replace(note, message=where + note.message) for note in bares[key].notes]
        bodies += _placed(bares[key], solid)
    settled = together(bodies, KernelCommon(), problems)
    if settled.mixed:
        problems.append(cavity_note(settled))
    if settled.solids and left:
        problems += loose_notes([tessellated(surface)[0] for surface in left], bodies, settled.solids)
    meshes = [body.mesh for body in bodies if body.mesh is not None]
    bare = [] if measured_bodies else [shape for shape in shapes if occt.faces_of(shape)]
    if mesh_check and bare:
        meshes = [tessellated(shape)[0] for shape in bare]
    whole = simplified(joined(meshes), PICTURE_TRIANGLES) if meshes else None
    wires = any(occt.has_edges(shape) for shape in shapes)
    return Measured(settled.solids, tuple(problems), whole, bool(measured_bodies or bare), wires)


@dataclass(frozen=True, slots=True)
class _Picture:
    """What a product's picture asks of one solid's mesh: the product's size [mm], and triangles at most."""

    size: float
    triangles: int

    @classmethod
    def of(cls, shapes: list[Any], solids: int) -> _Picture:
        """Allow each solid four times its share, since most need less."""
        share = 4 * PICTURE_TRIANGLES // max(solids, 1)
        return cls(max((box(shape)[1] for shape in shapes), default=0.0), max(share, 500))


@dataclass(frozen=True, eq=False)
class _MeasuredSolid:
    """One solid in the axes of its bare geometry; ``props`` None if it has no volume.

    flat
        its mesh is the very solid.
    """

    body: Any
    props: SolidProps | None
    mesh: Mesh | None
    notes: list[Note]
    flat: bool = False


def _measured(solid: Any, body: Any, eps: float, picture: _Picture | None) -> _MeasuredSolid:
    notes: list[Note] = []
    if not all(occt.has_surface(face) for face in occt.faces_of(solid)):
        return _MeasuredSolid(body, *_triangulated_solid(solid, notes), notes)
    props = _integrated(solid, eps, notes)
    if not BRepCheck_Analyzer(solid).IsValid():
        notes.append(INVALID)
    mesh = _checked_mesh(solid, props, picture, notes) if picture is not None else None
    if props is not None and (edges := open_edges_of(solid)) is not None:
        notes.append(open_note(edges))
    elif props is not None and not any(note.code == GeometryCode.NOT_CONVERGENT for note in notes):
        note = drift_note(beside_edges(solid, props.volume_m3 / MM**3))
        notes += [note] if note is not None else []
    flat = mesh is not None and props is not None and occt.is_flat(solid)
    return _MeasuredSolid(body, props, mesh, notes, flat)


def _placed(bare: _MeasuredSolid, solid: Any) -> list[Body]:
    """Move a measured solid to its place, by our own calculation; [] if it has no volume."""
    if bare.props is None:
        return []
    props, mesh = bare.props, bare.mesh
    location = trsf_matrix(solid.Location().Transformation())
    if not np.array_equal(location, np.eye(4)):
        matrix = in_metres(location)
        volumes, coms, units = place([props.volume_m3], [props.com_m], [props.inertia_unit], [matrix])
        mesh = mesh.moved(matrix) if mesh is not None else None
        props = SolidProps(float(volumes[0]), coms[0], units[0], props.reversed)
    low, high = bounds(solid)
    shape = solid.Reversed() if props.reversed else solid
    return [Body(props, low * MM, high * MM, mesh, shape, bare.flat)]


def _integrated(solid: Any, eps: float, notes: list[Note]) -> SolidProps | None:
    centre, size = box(solid)
    distance = float(np.linalg.norm(centre))
    if distance > NEAR * size > 0:
        solid = _rebuilt(solid, -centre)
    else:
        centre = np.zeros(3)
    solid_result = solid_moments(solid, eps, notes)
    if not np.isfinite(solid_result.volume) or solid_result.volume == 0.0:
        notes.append(NO_VOLUME)
        return None
    size_m, distance_m = size * MM, distance * MM
    volume_m3 = solid_result.volume * MM**3
    notes += integration_notes(volume_m3, solid_result.error, eps, distance_m=distance_m, size_m=size_m)
    sign = -1.0 if solid_result.volume < 0 else 1.0
    com = (solid_result.com + centre) * MM
    return SolidProps(sign * volume_m3, com, sign * solid_result.inertia * MM**5, reversed=sign < 0)


def _rebuilt(shape: Any, offset: Floats) -> Any:
    step = gp_Trsf()
    step.SetTranslation(gp_Vec(*offset))
    return BRepBuilderAPI_Transform(shape, step, True).Shape()


def _triangulated_solid(solid: Any, notes: list[Note]) -> tuple[SolidProps | None, Mesh | None]:
    """Measure a solid whose faces are triangles without surfaces (AP242 tessellated), as a mesh file is
    measured.
    """
    mesh, missing = triangles(solid)
    if missing or not len(mesh):
        text = message("the solid mixes triangles and surfaces, or has neither; it is left out")
        notes.append(Note(GeometryCode.INVALID_SHAPE, text))
        return None, mesh if len(mesh) else None
    props = enclosed(mesh := welded(mesh.vertices, mesh.faces), notes)
    if props.volume_m3 == 0.0:
        notes.append(NO_VOLUME)
        return None, mesh
    notes.append(Note(GeometryCode.READER, message("the solid is given as triangles, and measured as such")))
    return props, mesh


def _checked_mesh(solid: Any, props: SolidProps | None, picture: _Picture, notes: list[Note]) -> Mesh:
    small = box(solid)[1] < SMALL * picture.size
    coarse = small or len(occt.faces_of(solid)) > MANY_FACES
    volume = props.volume_m3 if props is not None else None
    mesh, deviation, missing = cross_check(solid, volume, small=coarse)
    notes += mesh_notes(deviation, missing)
    return simplified(mesh, picture.triangles)


def load_shape(path: Path, named: str) -> Any:
    """Read the shape in a file, text or binary. A DocumentError calls the file ``named``."""
    shape = TopoDS_Shape()
    if is_binary_brep(path):
        done = BinTools.Read_s(shape, str(path))
    else:
        done = BRepTools.Read_s(shape, str(path), BRep_Builder())
    if done is False or shape.IsNull():
        raise DocumentError(named, message("holds no shape that the geometry kernel can read"))
    return shape


def read_brep(path: Path, options: ReadOptions, report: Report) -> GeometryReading:
    """Read a .brep file as one part, in mm as the kernel writes them. Raises DocumentError."""
    report("reading", 0, 0)
    shape = load_shape(path, str(path))
    report("measuring", 1, 1)
    measured = measure([shape], eps=options.eps, mesh_check=options.mesh_check)
    part = measured.prototype("shape", path.stem)
    instance = Instance((path.stem,), (path.stem,), "shape", np.eye(4))
    return GeometryReading(Assembly(path.stem, {"shape": part}, (instance,), source=str(path), unit="mm"))


def measure_all(
    products: Sequence[list[Any]],
    *,
    options: ReadOptions,
    helpers: Helpers,
    done: Callable[[int, int], Any],
) -> list[Measured]:
    """Measure the shapes of each product, here and in the running helpers.

    All are measured from their stored form, whose placements differ from the kernel's own in the last bit:
    the numbers must not depend on the process that measures.
    """
    numbers = count()

    def stored(shapes: list[Any]) -> Task[Measured]:
        path = helpers.folder() / f"{next(numbers)}.bin"
        _store(shapes, path)
        return _measure_stored, (path, options.eps, options.mesh_check)

    return helpers.all(products, stored, done)


def _measure_stored(path: Path, eps: float, mesh_check: bool) -> Measured:
    shapes = list(occt.inside(load_shape(path, str(path))))
    remove_patiently(path)
    return measure(shapes, eps=eps, mesh_check=mesh_check)


def _store(shapes: list[Any], path: Path) -> None:
    builder, whole = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(whole)
    for shape in shapes:
        builder.Add(whole, shape)
    if not BinTools.Write_s(whole, str(path)):
        raise DocumentError(str(path), message("cannot be written"))
