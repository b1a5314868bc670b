# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which integration a solid gets: the kernel's plain one, its controlled one, or our own.

* Planes, cylinders, cones, spheres and tori between straight and round edges are exact by the plain
  integration. Everything else needs control: the plain one is off by more than 1e-4 on one real part in
  thirteen.
* The kernel's controlled integration looks at the volume only, so a tensor lags behind by up to four powers
  of ten, and where it gives up (splines drawn along a line) it says so. Our own controls all ten moments of
  every edge. It is slower, and so it is asked where the plain and the controlled integration differ.
* Where the kernel's and ours differ although both have converged, ours is asked how far it depends on the way
  that the volume is taken: less than both differ, and the kernel's is wrong; more than :data:`STATED`, and
  the faces do not meet at their edges, so no integration is right, and a warning says so.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps
from OCP.Standard import Standard_Failure

from silo.inertia.geometry.exact.quadrature import Moments
from silo.inertia.geometry.kernel import occt
from silo.inertia.geometry.kernel.faces import moments
from silo.inertia.geometry.kernel.tessellate import xyz
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
    apart = abs(ours.volume - kernel.volume) / abs(kernel.volume)
    if apart > MESH_TOLERANCE or ours.error > CONVERGED:
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
