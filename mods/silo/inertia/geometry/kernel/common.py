# SPDX-License-Identifier: LGPL-2.1-or-later
"""What two solids have in common, by the kernel's boolean operation, where their meshes come close at all."""

from __future__ import annotations

import time

import numpy as np
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common
from OCP.Standard import Standard_Failure

from silo.inertia.geometry.kernel import occt
from silo.inertia.geometry.kernel.moments import by_kernel
from silo.inertia.geometry.kernel.tessellate import MM
from silo.inertia.geometry.mesh import Floats, Mesh, is_inside
from silo.inertia.geometry.together import NOTHING, Body, MeshCommon
from silo.inertia.model import SolidProps

EPS = 1e-8

MOST_FACES = 1500
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

    def __call__(self, one: Body, other: Body) -> SolidProps | None:
        """The moments of what both have in common; None where that cannot be found out."""
        if one.mesh is not None and other.mesh is not None:
            known = _by_distance(one, other, one.mesh, other.mesh)
            if known is not None:
                return known
            if one.exact and other.exact:
                exact = self._meshes(one, other)
                if exact is not None:
                    return exact
        faces = len(occt.faces_of(one.shape)) + len(occt.faces_of(other.shape))
        if faces <= MOST_FACES and self._spent < SECONDS:
            begin = time.process_time()
            found = _common(one, other)
            self._spent += time.process_time() - begin
            if found is not None:
                return found
        near = self._meshes(one, other)
        least = min(one.props.volume_m3, other.props.volume_m3)
        return None if near is None or 0 < near.volume_m3 <= CHORDS * least else near


def _by_distance(one: Body, other: Body, mesh: Mesh, small: Mesh) -> SolidProps | None:
    """Nothing, or all of the smaller body, where the surfaces do not come near each other; else None."""
    margin = 0.02 * max(float(np.linalg.norm(mesh.extents)), float(np.linalg.norm(small.extents)))
    low, high = np.maximum(one.low, other.low) - margin, np.minimum(one.high, other.high) + margin
    here, there = _within(mesh, low, high), _within(small, low, high)
    if here.any() and there.any():
        return None
    if is_inside(small, mesh):
        return other.props
    return one.props if is_inside(mesh, small) else NOTHING


def _within(mesh: Mesh, low: Floats, high: Floats) -> np.ndarray:
    """(n,) bool: triangles whose boxes reach into the box."""
    corners = mesh.vertices[mesh.faces]
    inside: np.ndarray = ((corners.min(axis=1) <= high) & (corners.max(axis=1) >= low)).all(axis=1)
    return inside


def _common(one: Body, other: Body) -> SolidProps | None:
    try:
        operation = BRepAlgoAPI_Common(one.shape, other.shape)
        if not operation.IsDone():
            return None
        solids = occt.solids_of(operation.Shape())
    except (Standard_Failure, RuntimeError):
        return None
    if not solids:
        return NOTHING
    found = by_kernel(operation.Shape(), EPS)
    least = min(one.props.volume_m3, other.props.volume_m3)
    volume = found.volume * MM**3
    if not np.isfinite(volume) or not 0 <= volume <= (1 + 1e-5) * least:
        return None
    return SolidProps(volume, found.com * MM, found.inertia * MM**5)
