# SPDX-License-Identifier: LGPL-2.1-or-later
"""The frames of links: which frame a link's numbers are in, and how far two frames are apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from silo.bom.message import message
from silo.inertia.arrays import Floats


class FrameChoice(StrEnum):
    """Which frame a run gives its numbers in."""

    ASSEMBLY = "assembly"  # that of the whole file
    OWN = "own"  # each sub-assembly's own, as placed in the file
    URDF = "urdf"  # the link's frame by the joints of a URDF, at position zero


@dataclass(frozen=True, eq=False)
class LinkFrame:
    """A frame: (4, 4) placement in the assembly's frame [m], in words, and whether the map chose it."""

    placement: Floats
    description: str
    chosen: bool = False

    def inverse(self) -> Floats:
        """Return the matrix (4, 4) from the assembly's frame to this one."""
        turn = self.placement[:3, :3].T
        matrix = np.eye(4)
        matrix[:3, :3] = turn
        matrix[:3, 3] = -turn @ self.placement[:3, 3]
        return matrix


def apart(left: Floats, right: Floats) -> tuple[float, float]:
    """Return the distance of two placements' origins [m] and the angle between their axes [rad]."""
    turn = left[:3, :3].T @ right[:3, :3]
    cosine = np.clip((np.trace(turn) - 1) / 2, -1.0, 1.0)
    return float(np.linalg.norm(left[:3, 3] - right[:3, 3])), float(np.arccos(cosine))


ASSEMBLY_FRAME = LinkFrame(np.eye(4), message("assembly frame"))


def origin_frame(xyz: Sequence[float], rpy: Sequence[float]) -> Floats:
    """Return the placement (4, 4) of a URDF origin.

    ``xyz`` in m, ``rpy`` in rad about fixed axes (R = Rz(y) Ry(p) Rx(r)).
    """
    (sr, sp, sy), (cr, cp, cy) = np.sin(rpy), np.cos(rpy)
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    matrix[:3, 3] = xyz
    return matrix


MOST_RAD = 6.3
"""[rad] Larger angles are taken for degrees."""
