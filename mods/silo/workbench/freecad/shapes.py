# SPDX-License-Identifier: LGPL-2.1-or-later
"""The geometry of an open FreeCAD document: its own shapes and placements, measured by our own integration.

No geometry kernel but FreeCAD's is needed, and none of its numbers is used: ``Shape.Volume`` and
``MatrixOfInertia`` come from an integration without error control, off by up to 7e-3 on real parts. They only
stand witness, as the tessellation does.

FreeCAD's faces as our integration takes them: exact surfaces, and edges in the surfaces' parameters.

Asks only the shapes' own methods, the same in FreeCAD 0.20, 1.0 and 1.1; imports nothing of FreeCAD.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np

from silo.bom.errors import DocumentError
from silo.bom.message import message
from silo.bom.walk.document import LinkProblem, own
from silo.inertia.assembly import Assembly, SolidProps
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
from silo.inertia.geometry.freecad import (
    NO_MATERIAL,
    NOTHING,
    Leaf,
    StatedMaterial,
    Walk,
    assembled,
    linked_material,
    one_by_one,
    told_material,
)
from silo.inertia.geometry.graph import in_metres
from silo.inertia.geometry.measured import (
    INVALID,
    NO_VOLUME,
    STATED,
    Measured,
    cavity_note,
    drift_note,
    integration_notes,
    loose_notes,
    shell_note,
)
from silo.inertia.geometry.options import ReadOptions, Report
from silo.inertia.geometry.together import Body, Mesh, mesh_volume, together
from silo.inertia.notes import GeometryCode, Note
from silo.inertia.placements import place
from silo.workbench.freecad import live

_ELEMENTARY = {
    "Plane": (Basis.LINEAR, Basis.LINEAR),
    "Cylinder": (Basis.CIRCULAR, Basis.LINEAR),
    "Cone": (Basis.CIRCULAR, Basis.LINEAR),
    "Sphere": (Basis.CIRCULAR, Basis.CIRCULAR),
    "Toroid": (Basis.CIRCULAR, Basis.CIRCULAR),
}
Value = Callable[[float, float], tuple[float, float, float]]
"""(u, v) → a point of the surface."""

SAME = 1e-9
"""How far, in sizes of the face, our form of a surface may be from FreeCAD's."""

_FITTED = ("Line2d", "Circle2d", "Ellipse2d")
_BACKWARDS = "Reversed"
_BOUNDARY = ("Forward", "Reversed")


def faces_of(shape: Any) -> Iterator[Any]:
    """Yield the faces as the solid has them (``Faces`` lists a face that is used twice only once)."""
    if shape.ShapeType == "Face":
        if shape.Orientation in _BOUNDARY:
            yield shape
        return
    for inner in shape.childShapes():
        if inner.ShapeType in ("Solid", "Shell", "Face"):
            yield from faces_of(inner)


def face_of(face: Any) -> Face:
    """Convert a FreeCAD face for the integration. ValueError if FreeCAD does not give enough of it."""
    wires = [wire for wire in face.childShapes() if wire.ShapeType == "Wire"]
    return Face(_surface(face), [_curve(face, edge) for wire in wires for edge in _edges(face, wire)])


def _edges(face: Any, wire: Any) -> Iterator[Any]:
    """Yield the edges with the face's own orientation in them, which distinguishes the two curves of a
    seam.
    """
    listed = [edge for edge in wire.childShapes() if edge.Orientation in _BOUNDARY]
    yield from listed
    for edge in listed:
        # FreeCAD >= 1.0 lists a seam once, though the face goes along it twice, up and down.
        if edge.isSeam(face) and sum(edge.isSame(other) for other in listed) == 1:
            yield edge.reversed()


def _curve(face: Any, edge: Any) -> Curve:
    curve_on_surface = face.curveOnSurface(edge)
    if curve_on_surface is None:
        raise ValueError(message("an edge has no curve on its face"))
    curve, first, last = curve_on_surface
    kind = type(curve).__name__
    sign = -1.0 if edge.Orientation == _BACKWARDS else 1.0
    line = kind == "Line2d"
    at = _fitted(curve, Basis.LINEAR if line else Basis.CIRCULAR) if kind in _FITTED else _sampled(curve)
    return Curve(at, _breaks(curve, kind, first, last), sign, line)


def _fitted(curve: Any, basis: Basis) -> Callable[[Floats], Floats]:
    """Find the line, circle or ellipse through a few of its points."""
    points = _sampled(curve)(basis.samples)
    coefficients = np.linalg.solve(basis.at(basis.samples), points)
    return lambda t: basis.at(t) @ coefficients


def _sampled(curve: Any) -> Callable[[Floats], Floats]:
    value = curve.value

    def at(t: Floats) -> Floats:
        points = [value(x) for x in t.tolist()]
        return np.array([(p.x, p.y) for p in points]).reshape(-1, 2)

    return at


def _breaks(curve: Any, kind: str, first: float, last: float) -> Floats:
    ends = np.array([first, last])
    if kind == "Line2d":
        return ends
    if hasattr(curve, "getKnots"):
        knots = np.array(curve.getKnots())
        return np.union1d(ends, knots[(knots > first) & (knots < last)])
    return np.linspace(first, last, max(2, math.ceil((last - first) / (math.pi / 2)) + 1))


def _surface(face: Any) -> Surface:
    """Find the form of the face's surface that is the same surface and quickest to evaluate."""
    surface = face.Surface
    kind = type(surface).__name__
    value = _values(face)
    u_low, u_high, v_low, v_high = face.ParameterRange
    corners = [(u_low, v_low), (u_high, v_high), (0.7 * u_low + 0.3 * u_high, 0.6 * v_low + 0.4 * v_high)]
    size = max(face.BoundBox.DiagonalLength, 1e-9)
    for form in _forms(surface, kind, face, value):
        if all(_same(form, value, u, v, size) for u, v in corners):
            return form
    return SampledSurface(_asker(face), np.linspace(u_low, u_high, 5))


def _forms(surface: Any, kind: str, face: Any, value: Value) -> Iterator[Surface]:
    u_range, v_range = tuple(face.ParameterRange[:2]), tuple(face.ParameterRange[2:])
    if kind in _ELEMENTARY:
        yield Elementary.sampled(*_ELEMENTARY[kind], value, u_range)
    elif kind in ("BSplineSurface", "BezierSurface"):
        if kind == "BezierSurface":
            surface = surface.toBSpline()
        if surface.NbUPoles == surface.NbVPoles == 2:
            yield Elementary.sampled(Basis.LINEAR, Basis.LINEAR, value, u_range)
        yield _nurbs(surface, u_range, v_range)
    elif kind in ("SurfaceOfExtrusion", "SurfaceOfRevolution"):
        curve = surface.BasisCurve
        extruded = kind == "SurfaceOfExtrusion"
        if extruded and type(curve).__name__ in ("BSplineCurve", "BezierCurve"):
            yield _extruded(curve, face, value)
        along = Basis.LINEAR if type(curve).__name__ in ("Line", "LineSegment") else Basis.CIRCULAR
        bases = (along, Basis.LINEAR) if extruded else (Basis.CIRCULAR, along)
        yield Elementary.sampled(*bases, value, u_range)
        if not extruded:
            yield Turned(_asker(face), u_range)


def _same(form: Surface, value: Value, u: float, v: float, size: float) -> bool:
    ours = form.at(np.array([[u]]), np.array([v]))[0][0, 0]
    return bool(np.abs(ours - value(u, v)).max() <= SAME * size)


def _values(face: Any) -> Value:
    value = face.valueAt

    def at(u: float, v: float) -> tuple[float, float, float]:
        point = value(u, v)
        return point.x, point.y, point.z

    return at


def _asker(face: Any) -> Callable[[float, float], Any]:
    value, slopes = face.valueAt, face.derivative1At

    def ask(u: float, v: float) -> Any:
        du, dv = slopes(u, v)
        return tuple(value(u, v)), tuple(du), tuple(dv)

    return ask


def _extruded(curve: Any, face: Any, value: Value) -> Nurbs:
    """Make the surface of a spline that is drawn along a straight line: of degree 1 in that direction."""
    if type(curve).__name__ == "BezierCurve":
        curve = curve.toBSpline()
    curve, periodic = curve.copy(), curve.isPeriodic()
    if periodic:
        curve.setNotPeriodic()
    u_low, u_high, v_low, v_high = face.ParameterRange
    along = np.subtract(value(u_low, v_high), value(u_low, v_low)) / (v_high - v_low)
    poles = np.array([tuple(pole) for pole in curve.getPoles()], dtype=np.float64)
    weights = np.array(curve.getWeights(), dtype=np.float64) if curve.isRational() else None
    knots = np.array(curve.KnotSequence, dtype=np.float64)
    drawn = Nurbs.drawn((poles, weights, knots, curve.Degree), along, (v_low, v_high))
    return drawn.unrolled((u_low, u_high) if periodic else None)


def _nurbs(surface: Any, u_range: tuple[float, float], v_range: tuple[float, float]) -> Nurbs:
    surface = surface.copy()
    u_periodic, v_periodic = surface.isUPeriodic(), surface.isVPeriodic()
    if u_periodic:
        surface.setUNotPeriodic()
    if v_periodic:
        surface.setVNotPeriodic()
    weights = None
    if surface.isURational() or surface.isVRational():
        weights = np.array(surface.getWeights(), dtype=np.float64)
    nurbs = Nurbs(
        np.array([[tuple(pole) for pole in row] for row in surface.getPoles()], dtype=np.float64),
        weights,
        np.array(surface.UKnotSequence, dtype=np.float64),
        np.array(surface.VKnotSequence, dtype=np.float64),
        surface.UDegree,
        surface.VDegree,
    )
    return nurbs.unrolled(u_range if u_periodic else None, v_range if v_periodic else None)


MM = 1e-3

AGREE = 0.02
"""Where our integration and FreeCAD's differ by more, relative to the volume, the mesh decides."""


def read_live(document: Any, options: ReadOptions, report: Report) -> Assembly:
    """Read the geometry of an open document as it is in this session, saved or not.

    ``report`` is called for every product and every face; what it raises (CancelledError) ends the reading.
    Raises DocumentError, as the reader of files does, and InputError for too many or too deeply nested parts.
    """
    source = document.FileName or document.Label
    report("reading", 0, 0)
    if lost := live.lost_assemblies(document):
        raise DocumentError(
            source, message("this FreeCAD is too old to load its assemblies ({lost})", lost=", ".join(lost))
        )
    cached = live.cached_document(document)
    walk = Walk(LiveFacts(), os.path.dirname(cached.FileName).replace("\\", "/"), options.hardware)
    top = walk.top(cached, options.object_name)

    def measured(leaf: Leaf) -> Measured:
        return measure(leaf, options.eps, report)

    return assembled(walk, top, source, options, one_by_one(measured), report)


def measure(leaf: Leaf, eps: float, report: Report) -> Measured:
    """Measure all solids of a leaf whose handles are FreeCAD's shapes, in its axes."""
    return _Product(eps, report).measured(leaf)


class LiveFacts:
    """The facts of :class:`silo.inertia.geometry.freecad.ShapeSource` from FreeCAD itself."""

    def __init__(self) -> None:
        self._inspect = live.LinkInspector()

    def placement(self, obj: Any, name: str = "Placement") -> Floats:
        """Return (4, 4) [mm] of an object's own placement; the identity if it has none."""
        value = own(obj, name)
        return np.eye(4) if value is None else matrix_of(value)

    def places(self, obj: Any) -> list[Floats]:
        """Return (4, 4) [mm] for each placement in the object's own ``PlacementList``."""
        return [matrix_of(place) for place in own(obj, "PlacementList") or ()]

    def shape(self, obj: Any) -> Any:
        """Return FreeCAD's shape of the object; None if it has none, or an empty one."""
        return obj.Shape if "Shape" in obj.PropertiesList and not obj.Shape.isNull() else None

    def material(self, obj: Any) -> StatedMaterial:
        """Return the material object to which it links, or its ``ShapeMaterial`` (FreeCAD >= 1.0)."""
        linked = linked_material(obj)
        if linked is not None:
            return linked
        card = _stored(obj, "ShapeMaterial")
        if card is None or not card.UUID or card.UUID == NO_MATERIAL:
            return NOTHING
        return told_material(card.Name, _density(card))

    def problem(self, link: Any) -> LinkProblem | None:
        """Return why a link has no target."""
        return self._inspect(link)


def _stored(obj: Any, name: str) -> Any:
    """Return a property's value that has no tie to its object; None if the object has no such property.

    ``obj.ShapeMaterial.getPhysicalValue(…)`` marks the document as edited and touches all links to the object
    (measured in FreeCAD 1.0 and 1.1): FreeCAD takes every call of a value that was read as an attribute for a
    change of it. A value that was read by name has no owner.
    """
    # A document without an assembly stands for itself, and has none of these.
    if name not in getattr(obj, "PropertiesList", ()):
        return None
    return getattr(obj, "real", obj).getPropertyByName(name)


def matrix_of(placement: Any) -> Floats:
    """Return a FreeCAD placement as (4, 4)."""
    return np.array(placement.toMatrix().A, dtype=np.float64).reshape(4, 4)


def _density(card: Any) -> float | None:
    try:
        return float(card.getPhysicalValue("Density").getValueAs("kg/m^3").Value)
    except (AttributeError, KeyError, LookupError, TypeError, ValueError, RuntimeError):
        return None


@dataclass(frozen=True, eq=False)
class _Solid:
    """One measured solid where FreeCAD has it; ``props`` None where it has no volume."""

    shape: Any
    props: SolidProps | None


@dataclass(eq=False)
class _Product:
    """Measures the shapes of one product."""

    eps: float
    report: Report
    known: list[_Solid] = field(default_factory=list)
    problems: list[Note] = field(default_factory=list)

    def measured(self, leaf: Leaf) -> Measured:
        """Measure all solids of a leaf, in its axes."""
        shapes = [(ref.handle, ref.transform) for ref in leaf.shapes]
        # FreeCAD keeps an object's placement as the location of its shape; the walk's own takes its place.
        placed = [(shape, t @ np.linalg.inv(matrix_of(shape.Placement))) for shape, t in shapes]
        solids = [(solid, matrix) for shape, matrix in placed for solid in shape.Solids]
        shells: list[tuple[Any, Floats]] = []
        loose: list[Mesh] = []
        for shape, matrix in placed:
            closed, others = _surfaces(shape)
            shells += [(solid, matrix) for solid in closed]
            loose += [_meshed(surface).moved(matrix).moved(np.diag([MM, MM, MM, 1.0])) for surface in others]
        if shells:
            self.problems.append(shell_note(len(shells), len(solids)))
        solids += shells
        bodies: list[Body] = []
        for number, (solid, matrix) in enumerate(solids, start=1):
            where = (
                message("solid {number} of {count}: ", number=number, count=len(solids))
                if len(solids) > 1
                else ""
            )
            known, moved = self._find(solid, where)
            if known.props is not None:
                bodies.append(_placed(known, matrix @ moved, solid, matrix))
        faces = any(shape.Faces for shape, _ in shapes)
        settled = together(bodies, _common, self.problems)
        if settled.mixed:
            self.problems.append(cavity_note(settled))
        self.problems += loose_notes(loose, bodies, settled.solids)
        wires = any(shape.Edges for shape, _ in shapes)
        return Measured(settled.solids, tuple(self.problems), None, faces, wires)

    def _find(self, solid: Any, where: str) -> tuple[_Solid, Floats]:
        """Find an equal solid that was measured before, or measure this one; returns it, and (4, 4) [mm] from
        it to this one.
        """
        here = matrix_of(solid.Placement)
        for body in self.known:
            if solid.isPartner(body.shape) and solid.Orientation == body.shape.Orientation:
                return body, here @ np.linalg.inv(matrix_of(body.shape.Placement))
        notes: list[Note] = []
        measured_solid = self._measure(solid, notes)
        self.problems += [replace(note, message=where + note.message) for note in notes]
        self.known.append(measured_solid)
        return measured_solid, np.eye(4)

    def _measure(self, solid: Any, notes: list[Note]) -> _Solid:
        box = solid.BoundBox
        centre, size = np.array(tuple(box.Center)), max(box.DiagonalLength, 1e-9)
        body = _weighed(solid, self._integrated(solid, centre, size / 2), notes)
        if not np.isfinite(body.volume) or body.volume == 0.0:
            notes.append(NO_VOLUME)
            return _Solid(solid, None)
        # The centre's distance is that from the origin of the shape's own coordinates.
        away = float(np.linalg.norm(np.linalg.inv(matrix_of(solid.Placement)) @ np.r_[centre, 1.0])) * MM
        notes += integration_notes(
            body.volume * MM**3, body.error, self.eps, distance_m=away, size_m=size * MM
        )
        if (note := drift_note(body.drift)) is not None:
            notes.append(note)
        if not solid.isValid():
            notes.append(INVALID)
        sign = -1.0 if body.volume < 0 else 1.0
        props = SolidProps(
            sign * body.volume * MM**3, body.com * MM, sign * body.inertia * MM**5, reversed=body.volume < 0
        )
        return _Solid(solid, props)

    def _integrated(self, solid: Any, centre: Floats, radius: float) -> Moments:
        """Integrate the solid ourselves; the result is not finite if FreeCAD does not give the complete
        geometry.
        """
        faces = list(faces_of(solid))

        def told() -> Any:
            for number, face in enumerate(faces, start=1):
                self.report(message("measuring faces"), number, len(faces))
                yield face_of(face)

        rough = abs(solid.Volume) or radius**3
        try:
            return integrate(told(), centre=centre, size=radius, volume=rough, eps=self.eps)
        except (ValueError, RuntimeError, AttributeError, np.linalg.LinAlgError):
            return Moments(np.nan, centre, np.zeros((3, 3)), np.inf)


def _weighed(solid: Any, ours: Moments, notes: list[Note]) -> Moments:
    """Return our moments; or FreeCAD's, if we have none, or if a mesh is nearer to FreeCAD's."""
    volume = float(solid.Volume)
    if abs(ours.volume - volume) <= AGREE * abs(volume):
        return ours
    if not np.isfinite(ours.volume) or not _nearer_to_mesh(solid, ours.volume, volume):
        notes.append(
            Note(
                GeometryCode.NOT_CONVERGENT,
                message(
                    "measured by FreeCAD's own integration, which has no error control: on real "
                    "parts it was off by up to 0.7 %"
                ),
            )
        )
        tensor = np.array(solid.MatrixOfInertia.A, dtype=np.float64).reshape(4, 4)[:3, :3]
        return Moments(volume, np.array(tuple(solid.CenterOfMass)), tensor, 0.0)
    if ours.drift > STATED:  # if the faces close, FreeCAD is wrong
        apart = abs(volume / ours.volume - 1)
        text = message(
            "FreeCAD's own volume differs by {apart}; the geometry may be bad", apart=f"{apart:.1%}"
        )
        notes.append(Note(GeometryCode.NOT_CONVERGENT, text))
    return ours


def _nearer_to_mesh(solid: Any, ours: float, theirs: float) -> bool:
    """Return True if our volume [mm^3] is nearer to that of FreeCAD's tessellation than FreeCAD's own."""
    enclosed = abs(mesh_volume(_meshed(solid)))
    return abs(abs(ours) - enclosed) < abs(abs(theirs) - enclosed)


def _meshed(shape: Any) -> Mesh:
    """Let FreeCAD mesh a shape, in mm."""
    points, facets = shape.tessellate(max(0.005 * float(shape.BoundBox.DiagonalLength), 1e-6))
    return Mesh(np.array([(p.x, p.y, p.z) for p in points]), np.array(facets, dtype=np.int64))


def _placed(solid_placed: _Solid, moved: Floats, solid: Any, matrix: Floats) -> Body:
    """Move a measured solid by ``moved``; ``solid`` moved by ``matrix`` ((4, 4) [mm]) is at the same
    place.
    """
    assert solid_placed.props is not None
    props, metres = solid_placed.props, in_metres(moved)
    volumes, coms, units = place([props.volume_m3], [props.com_m], [props.inertia_unit], [metres])
    there = SolidProps(float(volumes[0]), coms[0], units[0], props.reversed)
    box = solid.BoundBox
    ends = ((box.XMin, box.XMax), (box.YMin, box.YMax), (box.ZMin, box.ZMax))
    corners = np.array([(*corner, 1.0) for corner in product(*ends)]) @ matrix.T
    corners = corners[:, :3] * MM
    return Body(there, corners.min(axis=0), corners.max(axis=0), None, (solid, matrix))


def _surfaces(shape: Any) -> tuple[list[Any], list[Any]]:
    """Divide the surfaces of a shape in no solid into closed ones, made into solids, and the others."""
    inside = {shell.hashCode() for solid in shape.Solids for shell in solid.Shells}
    loose = [shell for shell in shape.Shells if shell.hashCode() not in inside]
    face_codes = {face.hashCode() for shell in shape.Shells for face in shell.Faces}
    faces = [face for face in shape.Faces if face.hashCode() not in face_codes]
    if not loose and not faces:
        return [], []
    import Part

    if faces:
        sewn = Part.makeCompound(faces)
        sewn.sewShape()
        loose += sewn.Shells or sewn.Faces
    closed = [surface.ShapeType == "Shell" and surface.isClosed() for surface in loose]
    return (
        [Part.Solid(surface) for surface, is_closed in zip(loose, closed, strict=True) if is_closed],
        [surface for surface, is_closed in zip(loose, closed, strict=True) if not is_closed],
    )


def _common(body: Body, other: Body) -> SolidProps | None:
    """Find what two solids have in common by FreeCAD's boolean operation; None if that fails."""
    try:
        both = _shape(body).common(_shape(other))
        least = min(body.props.volume_m3, other.props.volume_m3)
        volume = float(both.Volume) * MM**3 if both.Solids else 0.0
        if not 0 <= volume <= (1 + 1e-5) * least:
            return None
        if volume == 0.0:
            return SolidProps(0.0, np.zeros(3), np.zeros((3, 3)))
        tensor = np.array(both.MatrixOfInertia.A, dtype=np.float64).reshape(4, 4)[:3, :3]
        return SolidProps(volume, np.array(tuple(both.CenterOfMass)) * MM, tensor * MM**5)
    except (ValueError, RuntimeError, AttributeError):
        return None


def _shape(body: Body) -> Any:
    solid, matrix = body.shape
    moved = solid.copy()
    # FreeCAD's own classes, without importing FreeCAD here.
    placement, matrix_class = type(solid.Placement), type(solid.Placement.toMatrix())
    moved.Placement = placement(matrix_class(*matrix.ravel().tolist())).multiply(solid.Placement)
    if body.props.reversed:
        moved.reverse()
    return moved
