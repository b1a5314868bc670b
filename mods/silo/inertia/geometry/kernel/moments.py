# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which integration a solid gets: the kernel's plain one, its controlled one, or our own.

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
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from OCP.BRepAdaptor import BRepAdaptor_Curve2d, BRepAdaptor_Surface
from OCP.BRepGProp import BRepGProp
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
from OCP.gp import gp_Pnt, gp_Vec
from OCP.GProp import GProp_GProps
from OCP.Standard import Standard_Failure
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FORWARD, TopAbs_REVERSED, TopAbs_WIRE
from OCP.TopoDS import TopoDS, TopoDS_Iterator

from silo.inertia.geometry.exact.quadrature import Curve, Face, Floats, Moments, Surface, integrate
from silo.inertia.geometry.exact.surfaces import Asked, Basis, Elementary, Nurbs, Turned
from silo.inertia.geometry.kernel import occt
from silo.inertia.geometry.kernel.tessellate import box, xyz
from silo.inertia.geometry.measured import (
    CONVERGED,
    MESH_TOLERANCE,
    STATED,
    Notes,
    differing_note,
    drift_note,
)

TENSOR_SHARE = 1e-4
"""Of the tolerance, for solids of planes, cylinders, cones, spheres and tori: they cost little at the finer
one, and a torus at 1e-8 has a tensor 1.1e-7 off, at 1e-12 1.6e-11."""

SUSPICIOUS = 1e-5
"""Plain and controlled integration differ by more: the controlled tensor may be off by as much."""

AGREE = 1e-6
"""The volumes of the kernel's integration and ours differ by less: then our tensor is the better one."""

PLAIN_ERROR = 1e-12
"""Of the plain integration of a plain solid, relative to its volume."""


def solid_moments(solid: Any, eps: float, notes: Notes) -> Moments:
    """Volume, centre and tensor of a solid near its own origin, in mm; ``eps`` is relative to the volume."""
    plain = _usual(solid)
    if occt.is_plain(solid):
        return plain
    elementary = all(occt.is_elementary(face) for face in occt.faces_of(solid))
    kernel = by_kernel(solid, eps * TENSOR_SHARE if elementary else eps)
    if not np.isfinite(kernel.volume) or kernel.volume == 0.0:
        return kernel
    if kernel.error <= CONVERGED and _difference(plain, kernel) <= SUSPICIOUS:
        return kernel
    try:
        ours = moments(solid, abs(kernel.volume), eps)
    except (Standard_Failure, ValueError, RuntimeError, ArithmeticError):
        return kernel
    # An open or torn shell has no volume that both could agree on; then the doubt stays the kernel's.
    # Where faces close, it is the kernel that may be that far off: closed splines drawn along a line.
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
    """The kernel's integration with a tolerance, relative to the volume."""
    system = GProp_GProps()
    error = float(BRepGProp.VolumeProperties_s(solid, system, eps, False, False))
    return _taken(system, error)


def _usual(solid: Any) -> Moments:
    """The kernel's integration without any control."""
    system = GProp_GProps()
    BRepGProp.VolumeProperties_s(solid, system)
    return _taken(system, PLAIN_ERROR)


def _taken(system: Any, error: float) -> Moments:
    tensor = system.MatrixOfInertia()
    inertia = np.array([[tensor.Value(i, j) for j in (1, 2, 3)] for i in (1, 2, 3)])
    return Moments(float(system.Mass()), np.array(xyz(system.CentreOfMass())), inertia, error)


def _difference(one: Moments, other: Moments) -> float:
    """Of volumes and tensors, relative to the latter."""
    tensor = float(np.abs(one.inertia - other.inertia).max() / max(np.abs(other.inertia).max(), 1e-300))
    return max(abs(one.volume / other.volume - 1), tensor)


_ELEMENTARY = {
    GeomAbs_Plane: (Basis.LINEAR, Basis.LINEAR),
    GeomAbs_Cylinder: (Basis.CIRCULAR, Basis.LINEAR),
    GeomAbs_Cone: (Basis.CIRCULAR, Basis.LINEAR),
    GeomAbs_Sphere: (Basis.CIRCULAR, Basis.CIRCULAR),
    GeomAbs_Torus: (Basis.CIRCULAR, Basis.CIRCULAR),
}
_ROUND = (GeomAbs_Circle, GeomAbs_Ellipse)


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
                    yield TopoDS.Edge(edge)


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
    """The quickest form of the face's surface that is the same surface."""
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

    if kind in _ELEMENTARY:
        return Elementary.sampled(*_ELEMENTARY[kind], value, u_range)
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
    return Asked(ask, np.linspace(*u_range, 5))


_Range = tuple[float, float]


def _drawn(curve: Any, along: Floats, u_range: _Range, v_range: _Range) -> Nurbs:
    periodic = curve.IsPeriodic()
    if periodic:
        curve.SetNotPeriodic()
    rows = range(1, curve.NbPoles() + 1)
    poles = np.array([xyz(curve.Pole(i)) for i in rows])
    weights = np.array([curve.Weight(i) for i in rows]) if curve.IsRational() else None
    knots = _repeated(curve.NbKnots(), curve.Knot, curve.Multiplicity)
    surface = Nurbs.drawn((poles, weights, knots, curve.Degree()), along, v_range)
    return surface.unrolled(u_range if periodic else None)


def _nurbs(spline: Any, u_range: _Range, v_range: _Range) -> Nurbs:
    u_periodic, v_periodic = spline.IsUPeriodic(), spline.IsVPeriodic()
    if u_periodic:
        spline.SetUNotPeriodic()
    if v_periodic:
        spline.SetVNotPeriodic()
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
