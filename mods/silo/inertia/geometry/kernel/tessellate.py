# SPDX-License-Identifier: LGPL-2.1-or-later
"""Triangles of the geometry kernel's shapes, and what they say against the kernel's own volume."""

from __future__ import annotations

from typing import Any

import numpy as np
from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Tool
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.TopAbs import TopAbs_REVERSED
from OCP.TopLoc import TopLoc_Location

from silo.inertia.geometry.kernel import occt
from silo.inertia.geometry.mesh import Floats, Mesh, joined, mesh_volume

MM = 1e-3
"""The kernel counts in mm."""


Level = tuple[float, float]
"""How fine a mesh is: linear deflection in diagonals of the box, and angle [rad]."""

PICTURE: Level = (0.005, 0.3)
COARSE: Level = (0.01, 0.5)
FINE: Level = (0.001, 0.12)

CLOSE = 0.01
"""A relative deviation of the volume below this is agreement: chords cut about that much off a cylinder."""

FINE_ENOUGH = 30_000
"""Triangles from where a finer mesh takes seconds, and chords are no excuse any more."""


def cross_check(
    solid: Any, volume_m3: float | None, *, small: bool = False
) -> tuple[Mesh, float | None, int]:
    """Compare meshes of a solid with ``volume_m3`` (> 0; None: nothing to compare), as few as are needed.

    ``small``: the solid is hardly seen in its product's picture, so a coarse mesh of it is tried first.

    The mesher fails now and then where the geometry does not: a face without triangles at one fineness is
    there at another, and thin curved wires lose several per cent to chords. So one closed mesh that agrees
    clears a solid, and so does what two closed ones converge to, their chord error going with the square of
    the angle. Bad geometry is as wrong at every fineness.

    Returns a mesh for the picture, the relative deviation of the best closed mesh (None where none is
    closed), and how many faces have no triangles in the picture's mesh.
    """
    tried: list[tuple[int, bool, Mesh]] = []
    closed: list[tuple[float, float]] = []
    deviation: float | None = None
    for level in (COARSE, PICTURE, FINE) if small else (PICTURE, COARSE, FINE):
        if level is FINE and max(len(mesh) for *_, mesh in tried) > FINE_ENOUGH:
            break
        mesh, missing = tessellated(solid, level)
        tried.append((missing, level is not PICTURE, mesh))
        if volume_m3 is not None and not missing:
            volume = abs(mesh_volume(mesh))
            limits = [volume + (volume - v) * level[1] ** 2 / (a**2 - level[1] ** 2) for a, v in closed]
            closed.append((level[1], volume))
            off = min(abs(v / volume_m3 - 1) for v in (volume, *limits))
            deviation = off if deviation is None else min(off, deviation)
        if not missing and (deviation is None or deviation < CLOSE):
            break
    missing, _, picture = min(tried, key=lambda t: t[:2])
    return picture, deviation, missing


def tessellated(shape: Any, level: Level = PICTURE) -> tuple[Mesh, int]:
    """The triangles of a shape in m, and how many of its faces could not be meshed."""
    size = box(shape)[1]
    BRepTools.Clean_s(shape)
    BRepMesh_IncrementalMesh(shape, max(level[0] * size, 1e-7), False, level[1], False)
    return triangles(shape)


def triangles(shape: Any) -> tuple[Mesh, int]:
    """The triangles that lie on a shape's faces already, in m, and how many faces have none."""
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
    points = np.array([xyz(node(i)) for i in range(1, triangulation.NbNodes() + 1)])
    faces = np.array([triangle(i).Get() for i in range(1, triangulation.NbTriangles() + 1)]) - 1
    if not located.IsIdentity():
        matrix = trsf_matrix(located.Transformation())
        points = points @ matrix[:3, :3].T + matrix[:3, 3]
    return Mesh(points * MM, faces[:, ::-1] if backwards else faces)


def box(shape: Any) -> tuple[Floats, float]:
    """Middle (3,) and diagonal [mm] of the shape's box."""
    low, high = bounds(shape)
    return (low + high) / 2, float(np.linalg.norm(high - low))


def bounds(shape: Any) -> tuple[Floats, Floats]:
    """Lowest and highest corner [mm] of the shape's box; zeros where it is empty."""
    found = Bnd_Box()
    BRepBndLib.Add_s(shape, found)
    if found.IsVoid():
        return np.zeros(3), np.zeros(3)
    return np.array(xyz(found.CornerMin())), np.array(xyz(found.CornerMax()))


def xyz(point: Any) -> tuple[float, float, float]:
    """A kernel point or vector as numbers."""
    return point.X(), point.Y(), point.Z()


def trsf_matrix(trsf: Any) -> Floats:
    """A kernel transformation as (4, 4), lengths in mm as the kernel has them."""
    value = trsf.Value
    rows = [[value(i, j) for j in (1, 2, 3, 4)] for i in (1, 2, 3)]
    return np.array([*rows, [0.0, 0.0, 0.0, 1.0]])
