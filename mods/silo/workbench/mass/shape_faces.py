# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD's faces as our integration takes them: exact surfaces, and edges in the surfaces' parameters.

Asks only the shapes' own methods, the same in FreeCAD 0.20, 1.0 and 1.1; imports nothing of FreeCAD.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from silo.inertia.geometry.exact.quadrature import Curve, Face, Floats, Surface
from silo.inertia.geometry.exact.surfaces import Asked, Basis, Elementary, Nurbs, Turned

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
    """The faces, each as the solid has it (``Faces`` would list a face that is used twice only once)."""
    if shape.ShapeType == "Face":
        if shape.Orientation in _BOUNDARY:
            yield shape
        return
    for inner in shape.childShapes():
        if inner.ShapeType in ("Solid", "Shell", "Face"):
            yield from faces_of(inner)


def face_of(face: Any) -> Face:
    """A FreeCAD face as the integration takes it. ValueError where FreeCAD does not give enough of it."""
    wires = [wire for wire in face.childShapes() if wire.ShapeType == "Wire"]
    return Face(_surface(face), [_curve(face, edge) for wire in wires for edge in _edges(face, wire)])


def _edges(face: Any, wire: Any) -> Iterator[Any]:
    """The edges, with the face's own orientation in them, which distinguishes the two curves of a seam."""
    listed = [edge for edge in wire.childShapes() if edge.Orientation in _BOUNDARY]
    yield from listed
    for edge in listed:
        # FreeCAD >= 1.0 lists a seam once, though the face goes along it twice, up and down.
        if edge.isSeam(face) and sum(edge.isSame(other) for other in listed) == 1:
            yield edge.reversed()


def _curve(face: Any, edge: Any) -> Curve:
    found = face.curveOnSurface(edge)
    if found is None:
        raise ValueError("an edge has no curve on its face")
    curve, first, last = found
    kind = type(curve).__name__
    sign = -1.0 if edge.Orientation == _BACKWARDS else 1.0
    line = kind == "Line2d"
    at = _fitted(curve, Basis.LINEAR if line else Basis.CIRCULAR) if kind in _FITTED else _asked(curve)
    return Curve(at, _breaks(curve, kind, first, last), sign, line)


def _fitted(curve: Any, basis: Basis) -> Callable[[Floats], Floats]:
    """A line, circle or ellipse, from a few of its points."""
    points = _asked(curve)(basis.samples)
    coefficients = np.linalg.solve(basis.at(basis.samples), points)
    return lambda t: basis.at(t) @ coefficients


def _asked(curve: Any) -> Callable[[Floats], Floats]:
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
    """The quickest form of the face's surface that is the same surface."""
    surface = face.Surface
    kind = type(surface).__name__
    value = _values(face)
    u_low, u_high, v_low, v_high = face.ParameterRange
    corners = [(u_low, v_low), (u_high, v_high), (0.7 * u_low + 0.3 * u_high, 0.6 * v_low + 0.4 * v_high)]
    size = max(face.BoundBox.DiagonalLength, 1e-9)
    for form in _forms(surface, kind, face, value):
        if all(_same(form, value, u, v, size) for u, v in corners):
            return form
    return Asked(_asker(face), np.linspace(u_low, u_high, 5))


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
    """A spline drawn along a straight line: a spline surface of degree 1 in that direction."""
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
    found = Nurbs(
        np.array([[tuple(pole) for pole in row] for row in surface.getPoles()], dtype=np.float64),
        weights,
        np.array(surface.UKnotSequence, dtype=np.float64),
        np.array(surface.VKnotSequence, dtype=np.float64),
        surface.UDegree,
        surface.VDegree,
    )
    return found.unrolled(u_range if u_periodic else None, v_range if v_periodic else None)
