# SPDX-License-Identifier: LGPL-2.1-or-later
"""The integrations of a shape: the kernel's with a tolerance, and our own where that one gives up."""

from __future__ import annotations

from typing import Any

import numpy as np
from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps
from OCP.Standard import Standard_Failure

from silo.inertia.geometry.exact.quadrature import Moments
from silo.inertia.geometry.kernel.faces import moments
from silo.inertia.geometry.kernel.tessellate import xyz
from silo.inertia.geometry.measured import CONVERGED, MESH_TOLERANCE


def by_kernel(solid: Any, eps: float) -> Moments:
    system = GProp_GProps()
    error = float(BRepGProp.VolumeProperties_s(solid, system, eps, False, False))
    tensor = system.MatrixOfInertia()
    inertia = np.array([[tensor.Value(i, j) for j in (1, 2, 3)] for i in (1, 2, 3)])
    return Moments(float(system.Mass()), np.array(xyz(system.CentreOfMass())), inertia, error)


def converged(solid: Any, kernel: Moments, eps: float) -> Moments:
    """The kernel's integration, or our own where that one gave up and ours did not."""
    if kernel.error <= CONVERGED or not np.isfinite(kernel.volume) or kernel.volume == 0.0:
        return kernel
    try:
        ours = moments(solid, abs(kernel.volume), eps)
    except (Standard_Failure, ValueError, RuntimeError, ArithmeticError):
        return kernel
    # An open or torn shell has no volume that both could agree on; then the doubt stays the kernel's.
    close = abs(ours.volume - kernel.volume) <= MESH_TOLERANCE * abs(kernel.volume)
    return ours if close and ours.error < kernel.error else kernel
