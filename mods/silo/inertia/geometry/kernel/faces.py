# SPDX-License-Identifier: LGPL-2.1-or-later
"""The geometry kernel's faces for our own integration, where the kernel's does not converge.

It fails, and says so, on splines drawn along a line: 3e-4 off on a wavy extrusion at every tolerance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from OCP.BRepAdaptor import BRepAdaptor_Curve2d, BRepAdaptor_Surface
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
    GeomAbs_Torus,
)
from OCP.gp import gp_Pnt, gp_Vec
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FORWARD, TopAbs_REVERSED, TopAbs_WIRE
from OCP.TopoDS import TopoDS, TopoDS_Iterator

from silo.inertia.geometry.exact.quadrature import Curve, Face, Floats, Moments, Surface, integrate
from silo.inertia.geometry.exact.surfaces import Asked, Basis, Elementary, Nurbs
from silo.inertia.geometry.kernel import occt
from silo.inertia.geometry.kernel.tessellate import box, xyz

_ELEMENTARY = {
    GeomAbs_Plane: (Basis.LINEAR, Basis.LINEAR),
    GeomAbs_Cylinder: (Basis.CIRCULAR, Basis.LINEAR),
    GeomAbs_Cone: (Basis.CIRCULAR, Basis.LINEAR),
    GeomAbs_Sphere: (Basis.CIRCULAR, Basis.CIRCULAR),
    GeomAbs_Torus: (Basis.CIRCULAR, Basis.CIRCULAR),
}
_ROUND = (GeomAbs_Circle, GeomAbs_Ellipse)
_as_edge = getattr(TopoDS, "Edge_s", None) or TopoDS.Edge


def moments(solid: Any, volume: float, eps: float) -> Moments:
    """The moments of a solid in mm; ``volume`` is a rough one, not 0."""
    centre, size = box(solid)
    faces = [_face(face) for face in occt.faces_of(solid)]
    return integrate(faces, centre=centre, size=max(size / 2, 1e-9), volume=volume, eps=eps)


def _face(face: Any) -> Face:
    return Face(_surface(face), [_curve(face, edge) for edge in _edges(face)])


def _edges(face: Any) -> Iterator[Any]:
    """With the face's own orientation in them; a seam twice, as it stands in the wire."""
    for wire in _inside(face):
        if wire.ShapeType() == TopAbs_WIRE:
            for edge in _inside(wire):
                if edge.ShapeType() == TopAbs_EDGE and edge.Orientation() in (
                    TopAbs_FORWARD,
                    TopAbs_REVERSED,
                ):
                    yield _as_edge(edge)


def _inside(shape: Any) -> Iterator[Any]:
    iterator = TopoDS_Iterator(shape, True, True)
    while iterator.More():
        yield iterator.Value()
        iterator.Next()


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
    """A line, circle or ellipse, from a few of its points."""
    coefficients = np.linalg.solve(basis.at(basis.samples), asked(basis.samples))
    return lambda t: basis.at(t) @ coefficients


def _surface(face: Any) -> Surface:
    adaptor = BRepAdaptor_Surface(face, True)
    kind = adaptor.GetType()
    u_range = (adaptor.FirstUParameter(), adaptor.LastUParameter())

    def value(u: float, v: float) -> tuple[float, float, float]:
        return xyz(adaptor.Value(u, v))

    if kind in _ELEMENTARY:
        return Elementary.sampled(*_ELEMENTARY[kind], value, u_range)
    if kind == GeomAbs_BSplineSurface:
        spline = adaptor.BSpline()
        if not spline.IsUPeriodic() and not spline.IsVPeriodic():
            return _nurbs(spline)
    breaks = np.linspace(*u_range, 5)
    if kind == GeomAbs_SurfaceOfExtrusion:
        breaks = np.union1d(breaks, _knots_within(adaptor.BasisCurve(), u_range))

    def ask(u: float, v: float) -> Any:
        point, du, dv = gp_Pnt(), gp_Vec(), gp_Vec()
        adaptor.D1(u, v, point, du, dv)
        return xyz(point), xyz(du), xyz(dv)

    return Asked(ask, breaks)


def _knots_within(curve: Any, u_range: tuple[float, float]) -> Floats:
    if curve.GetType() != GeomAbs_BSplineCurve:
        return np.zeros(0)
    spline = curve.BSpline()
    knots = np.array([spline.Knot(n) for n in range(1, spline.NbKnots() + 1)])
    inside: Floats = knots[(knots > u_range[0]) & (knots < u_range[1])]
    return inside


def _nurbs(spline: Any) -> Nurbs:
    rows, columns = range(1, spline.NbUPoles() + 1), range(1, spline.NbVPoles() + 1)
    weights = None
    if spline.IsURational() or spline.IsVRational():
        weights = np.array([[spline.Weight(i, j) for j in columns] for i in rows])
    u, v = range(1, spline.NbUKnots() + 1), range(1, spline.NbVKnots() + 1)
    return Nurbs(
        np.array([[xyz(spline.Pole(i, j)) for j in columns] for i in rows]),
        weights,
        np.repeat([spline.UKnot(n) for n in u], [spline.UMultiplicity(n) for n in u]),
        np.repeat([spline.VKnot(n) for n in v], [spline.VMultiplicity(n) for n in v]),
        spline.UDegree(),
        spline.VDegree(),
    )
