# SPDX-License-Identifier: LGPL-2.1-or-later
"""Do faces close? Each edge is used twice, in opposite directions, after sewing what nearly meets."""

from __future__ import annotations

from typing import Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Curve2d, BRepAdaptor_Surface
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeSolid, BRepBuilderAPI_Sewing
from OCP.BRepGProp import BRepGProp, BRepGProp_Domain, BRepGProp_Face, BRepGProp_Vinert
from OCP.gp import gp_Pnt, gp_Vec
from OCP.GProp import GProp_GProps
from OCP.ShapeAnalysis import ShapeAnalysis_Shell
from OCP.Standard import Standard_Failure
from OCP.TopoDS import TopoDS

from silo.inertia.geometry.kernel import occt
from silo.inertia.geometry.kernel.tessellate import box, triangles, xyz
from silo.inertia.geometry.measured import CONVERGED, STATED
from silo.inertia.geometry.mesh import Floats, open_edges, welded

MEETING = 1e-4
"""Share of a shape's size; edges that are closer are one. Real files have gaps of 5 µm in parts of 100 mm."""

MOST_FACES = 20_000
"""Loose faces of one product that are sewn."""


def open_edges_of(solid: Any) -> int | None:
    """How many edges of a solid are open, 0 where only its faces disagree; None where its faces close."""
    if _is_closed(solid):
        return None
    middle, size = box(solid)
    sewing = _sewn(occt.faces_of(solid), MEETING * size)
    edges = sewing.NbFreeEdges() + sewing.NbMultipleEdges() if sewing is not None else 0
    if sewing is not None and not edges:
        # Closed all the same; but faces that disagreed on what is outside were turned for it.
        sewn = abs(_flux(sewing.SewedShape(), middle))
        if abs(sewn - abs(_flux(solid, middle))) <= CONVERGED * sewn:
            return None
    return edges


def beside_edges(solid: Any, volume: float) -> float:
    """How much of ``volume`` [mm^3] may lie between faces and their own edges, relative; 0 where they meet.

    A file may say that a face lies where its edges are not. The kernel then widens the edges' tolerances
    until both agree, and finds the shape valid. So only wide edges are looked at.
    """
    least = STATED * abs(volume) / max(box(solid)[1], 1e-9) ** 2
    beside = 0.0
    for face in occt.faces_of(solid):
        edges = occt.edges_of(face)
        if all(BRep_Tool.Tolerance_s(edge) < least for edge in edges):
            continue
        found = np.array([_gap_and_length(edge, face) for edge in edges])
        if found[:, 0].max() >= least:
            system = GProp_GProps()
            BRepGProp.SurfaceProperties_s(face, system)
            beside += abs(system.Mass()) * float(found.prod(axis=1).sum() / max(found[:, 1].sum(), 1e-300))
    return beside / abs(volume)


def _gap_and_length(edge: Any, face: Any) -> tuple[float, float]:
    """Mean distance [mm] of an edge's curve in the face from its curve in space, and its rough length.

    Distance across the curve: points that lag behind along it open no gap.
    """
    if BRep_Tool.Degenerated_s(edge):
        return 0.0, 0.0
    try:
        surface, flat = BRepAdaptor_Surface(face, False), BRepAdaptor_Curve2d(edge, face)
        curve = BRepAdaptor_Curve(edge)
    except (Standard_Failure, RuntimeError):  # a curve of it is missing, and the kernel's check says so
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


def closed_shells(shapes: list[Any]) -> list[Any]:
    """The surfaces of ``shapes`` that stand in no solid and close, as solids."""
    closed: list[Any] = []
    loose: list[Any] = []
    for shape in shapes:
        for shell in occt.loose_shells_of(shape):
            if _is_closed(shell):
                closed.append(_solid(shell))
            else:
                loose += [face for face in occt.faces_of(shell) if occt.has_surface(face)]
        loose += occt.loose_faces_of(shape)
    if 1 < len(loose) <= MOST_FACES:
        size = max(box(shape)[1] for shape in shapes)
        sewing = _sewn(loose, MEETING * size)
        if sewing is not None:
            closed += [_solid(s) for s in occt.loose_shells_of(sewing.SewedShape()) if _is_closed(s)]
    return closed


def _is_closed(shape: Any) -> bool:
    """By the edges that its faces share; a sphere's pole and a cylinder's seam are no open edges.

    Faces that hold triangles only (tessellated STEP) have no edges; their triangles do.
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
    try:
        sewing.Perform()
    except (Standard_Failure, RuntimeError):
        return None
    return sewing


def _solid(shell: Any) -> Any:
    return BRepBuilderAPI_MakeSolid(TopoDS.Shell(shell)).Solid()


def _flux(shape: Any, point: Floats) -> float:
    """The volume [mm^3] as it is seen from ``point`` ((3,) [mm]), by the kernel's usual integration.

    The kernel's own sum for a shape is taken from a point of its own choice.
    """
    seen = gp_Pnt(*point.tolist())
    found = (BRepGProp_Vinert(BRepGProp_Face(f), BRepGProp_Domain(f), seen) for f in occt.faces_of(shape))
    return float(sum(one.Mass() for one in found))
