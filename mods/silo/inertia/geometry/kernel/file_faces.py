# SPDX-License-Identifier: LGPL-2.1-or-later
"""Spherical faces of a STEP file, compared with their edges as the file has them.

Most programs write faces without seams, and edges that run through a sphere's pole. The kernel's reader then
may take the other part of the sphere: its own check finds the face valid, the mesh is cut from the same face,
and a part of 23 cm³ weighs 881 g. Only the file says which part is meant: the face lies to the left of its
edges.

The witness is an integral along the file's edges. On a sphere around c, the outward normal is (r - c)/R, so
that by Stokes ∬(r - c) dA = R/2 ∮(r - c)×dr, with the face to the left. The other part of the sphere has the
opposite value, a part too small or too large another one, and no parameters of the surface enter: seams and
poles do not matter.

A sphere is the same whatever its axis is. So a file whose faces differ is read again, with an axis for each
of them that keeps the poles away from its edges; what the kernel makes of that counts if the witness agrees.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepGProp import BRepGProp
from OCP.Geom import Geom_BSplineCurve
from OCP.GeomAbs import GeomAbs_Sphere
from OCP.GeomAdaptor import GeomAdaptor_Curve
from OCP.GeomAPI import GeomAPI_ProjectPointOnCurve
from OCP.gp import gp_Pnt, gp_Vec
from OCP.GProp import GProp_GProps
from OCP.StepData import StepData_Factors
from OCP.StepToGeom import StepToGeom
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
        system = GProp_GProps()
        BRepGProp.SurfaceProperties_s(self.face, system)
        of_face = system.Mass() * (np.array(xyz(system.CentreOfMass())) - self.centre)
        return float(np.linalg.norm(of_face - self.by_edges()))

    def axes(self) -> list[tuple[Floats, Floats]]:
        """List axes of the sphere, the best first, and directions of its seam.

        A good axis has its poles far from all edges: then it is the middle of a cap, or beside the face. The
        seam is on the side away from the face.
        """
        towards = self.by_edges()
        length = float(np.linalg.norm(towards))
        if length <= STATED * self.radius**3:  # the whole sphere, or a band around it
            return []
        towards = towards / length
        edges = np.concatenate([points for points, _ in self.loops]) - self.centre
        poles = np.concatenate([[towards], _DIRECTIONS])
        nearest = np.abs(edges @ poles.T).max(axis=0)  # the cosine times the radius
        nearest[0] *= 0.9  # of an even choice, the face's middle
        return [(pole, _across(pole, -towards)) for pole in poles[np.argsort(nearest)[[0, 8, 16]]]]


_turn = np.arange(100)
_height = 1 - (_turn + 0.5) / 100
_DIRECTIONS = np.column_stack(
    [*(np.sqrt(1 - _height**2) * f(_turn * 2.399963) for f in (np.cos, np.sin)), _height]
)
"""A hundred directions, evenly over half of a sphere: each stands for its opposite, too."""


def _across(axis: Floats, wanted: Floats) -> Floats:
    """Return the direction across ``axis`` that is nearest to ``wanted``."""
    for direction in (wanted, *np.eye(3)):
        across = direction - axis * float(axis @ direction)
        if np.linalg.norm(across) > 0.1:
            break
    unit: Floats = across / np.linalg.norm(across)
    return unit


@dataclass(frozen=True, eq=False)
class Doubt:
    """What is wrong with the spherical faces of one product: ``volume`` [mm³] as read, and how much is in
    doubt."""

    spheres: tuple[Sphere, ...]
    volume: float
    doubt: float


def misread(shapes: list[Any], transfer: Any) -> Doubt | None:
    """Find the spherical faces in ``shapes`` that differ from their edges; None if all are right.

    transfer
        the reader's, which knows from which entity a face was made.
    """
    wrong: list[Sphere] = []
    total, doubt = 0.0, 0.0
    for shape in shapes:
        for solid in occt.solids_of(shape):
            apart = [
                (sphere, difference)
                for face in occt.faces_of(solid)
                for sphere in spheres_of(face, transfer)
                if (difference := sphere.difference()) > SLIGHT * sphere.radius**3
            ]
            if not apart:
                continue
            volume = abs(volume_of(solid))
            apart = [(sphere, difference) for sphere, difference in apart if difference > 3 * STATED * volume]
            wrong += [sphere for sphere, _ in apart]
            doubt += sum(difference for _, difference in apart) / 3
            total += volume if apart else 0.0
    return Doubt(tuple(wrong), total, doubt) if wrong else None


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


def _range(curve: Any, start: Any, end: Any) -> tuple[float, float]:
    """Return the parameters between which a curve runs from one point to the other, along itself."""
    adaptor = GeomAdaptor_Curve(curve)
    first, last = adaptor.FirstParameter(), adaptor.LastParameter()
    low = GeomAPI_ProjectPointOnCurve(start, curve).LowerDistanceParameter()
    high = GeomAPI_ProjectPointOnCurve(end, curve).LowerDistanceParameter()
    span = 1e-9 * max(abs(last - first), 1e-9)
    if adaptor.IsPeriodic():
        turn = (high - low) % adaptor.Period()
        return low, low + (turn if span < turn < adaptor.Period() - span else adaptor.Period())
    if adaptor.IsClosed() and high <= low + span:
        return (low if low < last - span else first), last
    return low, high
