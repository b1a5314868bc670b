# SPDX-License-Identifier: LGPL-2.1-or-later
"""Curved faces of a STEP file that can be read in two ways, compared with their edges as the file has them.

Most programs write faces without seams, and edges that run through a sphere's pole. The kernel's reader then
may take the other part of the sphere: its own check finds the face valid, the mesh is cut from the same face,
and a part of 23 cm³ weighs 881 g. Only the file says which part is meant: the face lies to the left of its
edges.

The witness is an integral along the file's edges. On a sphere around c, the outward normal is (r - c)/R, so
that by Stokes ∬(r - c) dA = R/2 ∮(r - c)×dr, with the face to the left. The other part of the sphere has the
opposite value, a part too small or too large another one, and no parameters of the surface enter: seams and
poles do not matter. The belt between two equal rims has the value of the two caps beside it: zero. So the
area is asked as well: by Archimedes it is R ∮ z dφ around any axis, but for 2πR² for each pole in the face.

On the other surfaces that close on all sides (tori, turned curves, splines) ∬ n dA = ½ ∮ r×dr says the
same. Where this differs, or where it is zero on a surface that closes twice, points beside the edges decide:
those to their left are in the face, those to their right are not. Edges bound only one part of a cylinder or
a cone, whose other part has no end; there it is enough that faces lie along their edges, which is checked of
all solids.

A sphere is the same whatever its axis is. So a file whose faces differ is read again, with an axis for each
of them that keeps the poles away from its edges; what the kernel makes of that counts if the witness agrees.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepGProp import BRepGProp, BRepGProp_Domain, BRepGProp_Face, BRepGProp_Vinert
from OCP.Geom import Geom_BSplineCurve, Geom_Circle, Geom_Line
from OCP.GeomAbs import (
    GeomAbs_BezierSurface,
    GeomAbs_BSplineSurface,
    GeomAbs_Sphere,
    GeomAbs_SurfaceOfRevolution,
    GeomAbs_Torus,
)
from OCP.GeomAdaptor import GeomAdaptor_Curve
from OCP.GeomAPI import GeomAPI_ProjectPointOnCurve, GeomAPI_ProjectPointOnSurf
from OCP.gp import gp_Pnt, gp_Pnt2d, gp_Vec
from OCP.GProp import GProp_GProps
from OCP.IntTools import IntTools_FClass2d
from OCP.StepData import StepData_Factors
from OCP.StepToGeom import StepToGeom
from OCP.TopAbs import TopAbs_FORWARD, TopAbs_IN
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS

from silo.inertia.geometry import kernel as occt
from silo.inertia.geometry.kernel import xyz
from silo.inertia.geometry.measured import STATED
from silo.inertia.geometry.together import Floats

PIECES = 4
"""Stretches of one edge or of one span of a spline, with six points of Gauss in each: exact to 1e-8."""

MOST_SPANS = 100
"""Of one spline; one with more is sampled as if it had so many."""

SLIGHT = 2e-5
"""Of a sphere's radius cubed: edges of real files are apart from their face by less. Volumes take time."""

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)


@dataclass(frozen=True, eq=False)
class Sphere:
    """A spherical face of the kernel, and what the file's edges say of it.

    entity, centre_entity
        the file's, of the face and of its sphere's centre.
    radius, in_file
        of the sphere [mm], and in the file's unit.
    loops
        along each bound, as the file has them, with the face to the left as seen from outside of the sphere:
        points and steps, (n, 3) each [mm].
    """

    face: Any
    entity: Any
    centre_entity: Any
    centre: Floats
    radius: float
    in_file: float
    loops: Sequence[tuple[Floats, Floats]]

    @property
    def size(self) -> float:
        """Return the extent that its differences are compared with."""
        return self.radius

    def by_edges(self) -> Floats:
        """Return ∬(r - c) dA [mm³] by the file's edges."""
        total = np.zeros(3)
        for points, steps in self.loops:
            total += np.cross(points - self.centre, steps).sum(axis=0)
        return self.radius / 2 * total

    def difference(self) -> float:
        """Return how far ∬(r - c) dA of the kernel's face is from that of the file's edges [mm³].

        A third of it is the volume that is in doubt.
        """
        by_edges, area = self.by_edges(), self.area_by_edges()
        plain = self._apart(by_edges, area)
        # The plain integral is good to a thousandth only.
        return plain if plain <= SLIGHT * self.radius**3 else self._apart(by_edges, area, 1e-8)

    def _apart(self, by_edges: Floats, area: float, *eps: float) -> float:
        system = GProp_GProps()
        BRepGProp.SurfaceProperties_s(self.face, system, *eps)
        of_face = system.Mass() * (np.array(xyz(system.CentreOfMass())) - self.centre)
        half = 2 * np.pi * self.radius**2
        areas = (system.Mass() - area + half / 2) % half - half / 2
        return max(float(np.linalg.norm(of_face - by_edges)), self.radius * float(abs(areas)))

    def area_by_edges(self) -> float:
        """Return the area [mm²] by the file's edges, but for some halves of the sphere."""
        axis = _DIRECTIONS[np.argmin(self._nearness(_DIRECTIONS))]
        return self.radius * sum(_turned(points - self.centre, steps, axis) for points, steps in self.loops)

    def _nearness(self, poles: Floats) -> Floats:
        """Return how near the edges come to each pole or its opposite: the cosine times the radius."""
        edges = np.concatenate([points for points, _ in self.loops] or [np.zeros((1, 3))]) - self.centre
        nearest: Floats = np.abs(edges @ poles.T).max(axis=0)
        return nearest

    def axes(self) -> list[tuple[Floats, Floats]]:
        """List axes of the sphere, the best first, and directions of its seam.

        A good axis has its poles far from all edges: then it is the middle of a cap, or beside the face. The
        seam is on the side away from the face.
        """
        if not self.loops:
            return []
        towards = self.by_edges()
        length = float(np.linalg.norm(towards))
        belt = length <= STATED * self.radius**3
        towards = _DIRECTIONS[np.argmin(self._nearness(_DIRECTIONS))] if belt else towards / length
        poles = np.concatenate([[towards], _DIRECTIONS])
        nearest = self._nearness(poles)
        nearest[0] *= 0.9  # of an even choice, the face's middle
        return [(pole, _across(pole, -towards)) for pole in poles[np.argsort(nearest)[[0, 8, 16]]]]


_turn = np.arange(100)
_height = 1 - (_turn + 0.5) / 100
_DIRECTIONS = np.column_stack(
    [*(np.sqrt(1 - _height**2) * f(_turn * 2.399963) for f in (np.cos, np.sin)), _height]
)
"""A hundred directions, evenly over half of a sphere: each stands for its opposite, too."""


def _turned(points: Floats, steps: Floats, axis: Floats) -> float:
    """Integrate -z dφ around an axis through the origin: the flux of e_ρ/ρ to the left of the edges."""
    height = points @ axis
    across = points - height[:, None] * axis
    turn = np.cross(axis, across) * steps
    return -float((height * turn.sum(axis=1) / (across**2).sum(axis=1)).sum())


def _across(axis: Floats, wanted: Floats) -> Floats:
    """Return the direction across ``axis`` that is nearest to ``wanted``."""
    for direction in (wanted, *np.eye(3)):
        across = direction - axis * float(axis @ direction)
        if np.linalg.norm(across) > 0.1:
            break
    unit: Floats = across / np.linalg.norm(across)
    return unit


@dataclass(frozen=True, eq=False)
class Patch:
    """A face of the kernel's on another surface that closes, and the file's edges of it.

    loops
        as of :class:`Sphere`, with the face to the left as seen from where the surface's own normal points.
    blind
        the edges of the other part of the surface may have the same vector area.
    """

    face: Any
    loops: Sequence[tuple[Floats, Floats]]
    size: float
    blind: bool

    def difference(self) -> float:
        """Return how far ∬ n dA of the kernel's face is from that of the file's edges, times the face's size
        [mm³]; 0 if points beside the edges say that the face is right. A third of it is in doubt.
        """
        by_edges = sum(
            (np.cross(points - self.loops[0][0][0], steps).sum(axis=0) / 2 for points, steps in self.loops),
            np.zeros(3),
        )
        length, apart = float(np.linalg.norm(by_edges)), 0.0
        if length > SUSPICIOUS * self.size**2:  # the vector area of the other part is the opposite
            apart = abs(self._area_along(by_edges / length) - length)
            if apart <= SUSPICIOUS * self.size**2:
                return 0.0
        elif not self.blind:
            return 0.0
        if not self._on_the_wrong_side():
            return 0.0
        system = GProp_GProps()
        BRepGProp.SurfaceProperties_s(self.face, system)
        return max(apart, float(system.Mass())) * self.size

    def _area_along(self, way: Floats) -> float:
        """Integrate the surface's normal over the kernel's face [mm²], along a direction: from two cones."""
        whole = BRepGProp_Face(self.face)
        middle = self.loops[0][0][0]

        def cone(tip: Floats) -> float:
            domain = BRepGProp_Domain(self.face)  # can be used once
            return float(BRepGProp_Vinert(whole, domain, gp_Pnt(*tip.tolist())).Mass())

        return 3 * (cone(middle) - cone(middle + self.size * way)) / self.size

    def _on_the_wrong_side(self) -> bool:
        """Return True if points to the left of most edges are outside of the face, and those to the right
        inside."""
        wrong = 0
        for points, steps in self.loops:
            middle = len(points) // 2
            along = steps[middle] / np.linalg.norm(steps[middle])
            reach = REACH * min(self.size, float(np.linalg.norm(points[-1] - points[0]) or self.size))
            left, right = (self._holds(points[middle], along, reach * side) for side in (1, -1))
            wrong += (right and not left) - (left and not right)
        return wrong > 0

    def _holds(self, point: Floats, along: Floats, reach: float) -> bool:
        """Return True if the point of the surface that is ``reach`` to the left of an edge is in the face."""
        surface = BRep_Tool.Surface_s(self.face)
        u, v = GeomAPI_ProjectPointOnSurf(gp_Pnt(*point.tolist()), surface).LowerDistanceParameters()
        place, du, dv = gp_Pnt(), gp_Vec(), gp_Vec()
        surface.D1(u, v, place, du, dv)
        slopes = np.array([xyz(du), xyz(dv)])
        normal = np.cross(*slopes)
        aside = np.cross(normal / np.linalg.norm(normal), along) * reach
        step, *_ = np.linalg.lstsq(slopes.T, aside, rcond=None)
        where = gp_Pnt2d(u + float(step[0]), v + float(step[1]))
        return bool(IntTools_FClass2d(self.face, 1e-9).Perform(where, True) == TopAbs_IN)


WORTH_A_WARNING = 1e-3
"""Of a volume: edges of a real file are that far from their own sphere."""

SUSPICIOUS = 0.01
"""Of the square of a face's size: vector areas that differ by more are looked at."""

REACH = 1e-3
"""Of an edge's length: how far beside it points are asked."""


@dataclass(frozen=True, eq=False)
class Doubt:
    """What is wrong with the curved faces of one product: ``volume`` [mm³] as read, and how much is in
    doubt. ``others``: how many faces besides those of spheres."""

    spheres: tuple[Sphere, ...]
    volume: float
    doubt: float
    others: int = 0

    @property
    def faces(self) -> int:
        """Return the number of faces in doubt."""
        return len(self.spheres) + self.others

    @property
    def counts(self) -> bool:
        """Return True if so much is in doubt that it is worth a warning."""
        return self.doubt > WORTH_A_WARNING * self.volume


def misread(shapes: list[Any], transfer: Any, unit_mm: float | None) -> Doubt | None:
    """Find the curved faces in ``shapes`` that differ from their edges; None if all are right.

    transfer
        the reader's, which knows from which entity a face was made.
    unit_mm
        of the lengths in the file; without one only spheres are looked at, whose radii tell it.
    """
    wrong: list[Sphere] = []
    others, total, doubt = 0, 0.0, 0.0
    for shape in shapes:
        for solid in occt.solids_of(shape):
            apart = [
                (found, difference)
                for face in occt.faces_of(solid)
                for found in _witnessed(face, transfer, unit_mm)
                if (difference := _difference(found)) > SLIGHT * found.size**3
            ]
            if not apart:
                continue
            volume = abs(volume_of(solid))
            apart = [(found, difference) for found, difference in apart if difference > 3 * STATED * volume]
            spheres = [found for found, _ in apart if isinstance(found, Sphere)]
            wrong += spheres
            others += len(apart) - len(spheres)
            doubt += sum(difference for _, difference in apart) / 3
            total += volume if apart else 0.0
    return Doubt(tuple(wrong), total, doubt, others) if wrong or others else None


def _witnessed(face: Any, transfer: Any, unit_mm: float | None) -> Iterator[Sphere | Patch]:
    yield from spheres_of(face, transfer)
    yield from patches_of(face, transfer, unit_mm)


def _difference(found: Sphere | Patch) -> float:
    with occt.Attempt():  # edges that are no curves are noticed elsewhere
        return found.difference()
    return 0.0


def volume_of(shape: Any) -> float:
    """Integrate the volume [mm³] in the kernel's usual way."""
    system = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, system)
    return float(system.Mass())


def spheres_of(face: Any, transfer: Any) -> Iterator[Sphere]:
    """Yield the sphere of a face, if it is one and the file's entity of it can be read."""
    if BRepAdaptor_Surface(face, False).GetType() != GeomAbs_Sphere:
        return
    bare = TopoDS.Face(face.Located(TopLoc_Location()))
    with occt.Attempt():
        entity = transfer.EntityFromShapeResult(bare, 1)
        if entity is None or not hasattr(entity, "SameSense"):
            return
        sphere = BRepAdaptor_Surface(bare, False).Sphere()
        surface = entity.FaceGeometry()
        factors = StepData_Factors()
        per_file_unit = sphere.Radius() / surface.Radius()
        factors.InitializeFactors(per_file_unit, 1.0, 1.0)
        yield Sphere(
            bare,
            entity,
            surface.Position().Location(),
            np.array(xyz(sphere.Location())),
            sphere.Radius(),
            surface.Radius(),
            list(_loops(entity, bool(entity.SameSense()), factors)),
        )


_CLOSING = (GeomAbs_Torus, GeomAbs_SurfaceOfRevolution, GeomAbs_BSplineSurface, GeomAbs_BezierSurface)


def patches_of(face: Any, transfer: Any, unit_mm: float | None) -> Iterator[Patch]:
    """Yield the face's patch, if its surface turns or closes and the file's entity of it can be read."""
    kind = BRepAdaptor_Surface(face, False).GetType()
    if not unit_mm or kind not in _CLOSING:
        return
    bare = TopoDS.Face(face.Located(TopLoc_Location()).Oriented(TopAbs_FORWARD))
    with occt.Attempt():
        whole = BRepAdaptor_Surface(bare, False)
        closed = whole.IsUClosed(), whole.IsVClosed()
        if not any(closed) or not (all(closed) or _ends_in_points(whole, closed[0])):
            return
        entity = transfer.EntityFromShapeResult(bare, 1)
        if entity is None or not hasattr(entity, "SameSense"):
            return
        factors = StepData_Factors()
        factors.InitializeFactors(unit_mm, 1.0, 1.0)
        loops = list(_loops(entity, bool(entity.SameSense()), factors))
        if loops:
            yield Patch(bare, loops, occt.box(bare)[1], all(closed))


def _ends_in_points(surface: Any, around_u: bool) -> bool:
    """Return True if both ends of a surface that closes one way are points, as a sphere's poles are."""
    u = surface.FirstUParameter(), surface.LastUParameter()
    v = surface.FirstVParameter(), surface.LastVParameter()
    around, ends = (u, v) if around_u else (v, u)
    for end in ends:
        if abs(end) > ENDLESS:
            return False
        ways = [(around[0] * (1 - t) + around[1] * t, end) for t in (0.0, 0.3, 0.6)]
        first, *others = (surface.Value(*(way if around_u else way[::-1])) for way in ways)
        if any(first.Distance(other) > 1e-6 for other in others):
            return False
    return True


ENDLESS = 1e50
"""A parameter beyond this is the kernel's way to say that a surface has no end."""


def _loops(entity: Any, outward: bool, factors: Any) -> Iterator[tuple[Floats, Floats]]:
    for number in range(1, entity.NbBounds() + 1):
        bound = entity.BoundsValue(number)
        loop = bound.Bound()
        if not hasattr(loop, "EdgeListValue"):  # a pole: a bound of one vertex has no length
            continue
        sign = 1.0 if bool(bound.Orientation()) == outward else -1.0
        for position in range(1, loop.NbEdgeList() + 1):
            oriented = loop.EdgeListValue(position)
            points, steps = _along(oriented.EdgeElement(), factors)
            yield points, steps * (sign if oriented.Orientation() else -sign)


def _along(edge: Any, factors: Any) -> tuple[Floats, Floats]:
    """Return points of an edge, and at each the step from its start to its end that the point stands for."""
    geometry = edge.EdgeGeometry()
    if hasattr(geometry, "Curve3d"):
        geometry = geometry.Curve3d()
    curve = StepToGeom.MakeCurve_s(geometry, factors)
    start, end = (
        StepToGeom.MakeCartesianPoint_s(vertex.VertexGeometry(), factors).Pnt()
        for vertex in (edge.EdgeStart(), edge.EdgeEnd())
    )
    forward = bool(edge.SameSense())
    if isinstance(curve, Geom_Line):
        ends = np.array([xyz(start), xyz(end)])
        return ends.mean(axis=0, keepdims=True), np.diff(ends, axis=0)
    if isinstance(curve, Geom_Circle):
        return _around(curve.Circ(), *((start, end) if forward else (end, start)), forward)
    low, high = _range(curve, start, end) if forward else _range(curve, end, start)
    pieces = PIECES
    if isinstance(curve, Geom_BSplineCurve):
        pieces = max(PIECES, min(curve.NbKnots() - 1, MOST_SPANS))
    breaks = np.linspace(low, high, pieces + 1)
    half = np.diff(breaks) / 2
    parameters = (breaks[:-1] + half)[:, None] + half[:, None] * _NODES
    weights = (half[:, None] * _WEIGHTS).ravel()
    rows = []
    for parameter in parameters.ravel().tolist():
        point, slope = gp_Pnt(), gp_Vec()
        curve.D1(parameter, point, slope)
        rows.append((xyz(point), xyz(slope)))
    points, slopes = np.array(rows).swapaxes(0, 1)
    return points, slopes * (weights if forward else -weights)[:, None]


def _around(circle: Any, start: Any, end: Any, forward: bool) -> tuple[Floats, Floats]:
    """Do as :func:`_along` along a circle, from ``start`` counter-clockwise to ``end``."""
    place = circle.Position()
    centre = np.array(xyz(place.Location()))
    x, y = (circle.Radius() * np.array(xyz(way)) for way in (place.XDirection(), place.YDirection()))
    low, high = (
        float(np.arctan2((np.array(xyz(point)) - centre) @ y, (np.array(xyz(point)) - centre) @ x))
        for point in (start, end)
    )
    turn = (high - low) % (2 * np.pi)
    full = start.Distance(end) <= ROUNDING * circle.Radius() and not ROUNDING < turn < 2 * np.pi - ROUNDING
    half = (2 * np.pi if full else turn) / PIECES / 2
    middles = low + half * (2 * np.arange(PIECES) + 1)
    angles = (middles[:, None] + half * _NODES).ravel()[:, None]
    slopes = (y * np.cos(angles) - x * np.sin(angles)) * np.tile(half * _WEIGHTS, PIECES)[:, None]
    return centre + x * np.cos(angles) + y * np.sin(angles), slopes if forward else -slopes


ROUNDING = 1e-9
"""Relative: ends of a circle that are apart by less are one."""


def _range(curve: Any, start: Any, end: Any) -> tuple[float, float]:
    """Return the parameters between which a curve runs from one point to the other, along itself."""
    adaptor = GeomAdaptor_Curve(curve)
    first, last = adaptor.FirstParameter(), adaptor.LastParameter()
    if isinstance(curve, Geom_BSplineCurve) and not adaptor.IsClosed():
        ends = curve.StartPoint().Distance(start), curve.EndPoint().Distance(end)
        if max(ends) <= 1e-7:
            return first, last
    low = GeomAPI_ProjectPointOnCurve(start, curve).LowerDistanceParameter()
    high = GeomAPI_ProjectPointOnCurve(end, curve).LowerDistanceParameter()
    span = 1e-9 * max(abs(last - first), 1e-9)
    if adaptor.IsPeriodic():
        turn = (high - low) % adaptor.Period()
        return low, low + (turn if span < turn < adaptor.Period() - span else adaptor.Period())
    if adaptor.IsClosed() and high <= low + span:
        return (low if low < last - span else first), last
    return low, high
