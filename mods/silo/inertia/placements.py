# SPDX-License-Identifier: LGPL-2.1-or-later
"""Placements (4, 4): which are valid, which are rigid, and how they move geometry.

The geometry of N instances is moved in one numpy expression.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from silo.bom.errors import InputError
from silo.bom.message import message
from silo.inertia.arrays import Floats

RIGID_TOLERANCE = 1e-6
"""How far the columns of a placement may be from orthonormal (STEP files print about nine digits)."""

EYE3 = np.eye(3)


def place(
    volumes: ArrayLike, coms: ArrayLike, units: ArrayLike, placements: ArrayLike
) -> tuple[Floats, Floats, Floats]:
    """Move the geometry of N instances by their placements.

    volumes : (N,) [m^3]; coms : (N, 3) [m]; units : (N, 3, 3) [m^5], tensors per unit density about the coms
    placements : (N, 4, 4); rigid, mirrored, or any invertible affine map (then exact as well: the second
    moments S = tr(I)/2 - I of a body mapped by A become |det A| A S Aᵀ)

    Returns volumes, coms and units in the outer frame.
    """
    volume = np.asarray(volumes, float)
    matrix = np.asarray(placements, float)
    turn = matrix[:, :3, :3]
    unit = np.asarray(units, float)
    com = np.einsum("nij,nj->ni", turn, np.asarray(coms, float)) + matrix[:, :3, 3]
    moved = turn @ unit @ turn.transpose(0, 2, 1)
    scaled = ~rigid_mask(matrix)
    if scaled.any():
        stretch = np.abs(np.linalg.det(turn[scaled]))
        volume = volume.copy()
        volume[scaled] *= stretch
        moved[scaled] = _stretched(unit[scaled], turn[scaled], stretch)
    return volume, com, moved


def _stretched(unit: Floats, turn: Floats, stretch: Floats) -> Floats:
    trace = np.trace(unit, axis1=1, axis2=2)[:, None, None]
    second = trace / 2 * EYE3 - unit
    second = stretch[:, None, None] * (turn @ second @ turn.transpose(0, 2, 1))
    tensors: Floats = np.trace(second, axis1=1, axis2=2)[:, None, None] * EYE3 - second
    return tensors


def rigid_mask(placements: Floats, tolerance: float = RIGID_TOLERANCE) -> NDArray[np.bool_]:
    """Return (N,) bool: True for each of the (N, 4, 4) placements that neither scales nor shears (a mirror is
    rigid).
    """
    turn = placements[:, :3, :3]
    off = np.abs(turn.transpose(0, 2, 1) @ turn - EYE3)
    mask: NDArray[np.bool_] = off.max(axis=(1, 2)) <= tolerance
    return mask


def is_rigid(placement: Floats, tolerance: float = RIGID_TOLERANCE) -> bool:
    """Return True if a (4, 4) placement neither scales nor shears; a mirror is rigid."""
    return bool(rigid_mask(placement[None], tolerance)[0])


def as_placement(value: ArrayLike) -> Floats:
    """Check a (4, 4) placement: finite, last row 0 0 0 1, invertible. InputError otherwise."""
    try:
        matrix = np.asarray(value, float)
    except (TypeError, ValueError) as error:
        raise InputError(
            message("a placement is a 4 x 4 matrix of numbers ({error})", error=error)
        ) from error
    if matrix.shape != (4, 4):
        raise InputError(message("a placement is a 4 x 4 matrix, got the shape {shape}", shape=matrix.shape))
    if not np.isfinite(matrix).all() or not np.allclose(matrix[3], (0, 0, 0, 1), atol=1e-12):
        raise InputError(
            f"a placement needs finite numbers and the last row 0 0 0 1, got {matrix[3].tolist()}"
        )
    if abs(np.linalg.det(matrix[:3, :3])) < 1e-12:
        raise InputError(message("a placement must be invertible; this one flattens the part"))
    return matrix
