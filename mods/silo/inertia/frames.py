# SPDX-License-Identifier: LGPL-2.1-or-later
"""Frames that a link's numbers may be given in.

The default is the assembly's own frame, for every link. A URDF wants each link's inertia in that link's
frame, which its joints define; ``silo.inertia.output.urdf`` computes those frames at joint position zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from silo.inertia.core import Floats


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
        """(4, 4): assembly's frame → this frame."""
        turn = self.placement[:3, :3].T
        result = np.eye(4)
        result[:3, :3] = turn
        result[:3, 3] = -turn @ self.placement[:3, 3]
        return result


def apart(left: Floats, right: Floats) -> tuple[float, float]:
    """Distance of two placements' origins [m] and the angle between their axes [rad]."""
    turn = left[:3, :3].T @ right[:3, :3]
    cosine = np.clip((np.trace(turn) - 1) / 2, -1.0, 1.0)
    return float(np.linalg.norm(left[:3, 3] - right[:3, 3])), float(np.arccos(cosine))


ASSEMBLY_FRAME = LinkFrame(np.eye(4), "assembly frame")


def origin_frame(xyz: Sequence[float], rpy: Sequence[float]) -> Floats:
    """(4, 4) placement of a URDF origin: xyz [m], rpy [rad] about fixed axes (R = Rz(y) Ry(p) Rx(r))."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(rpy), np.cos(rpy)
    result = np.eye(4)
    result[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    result[:3, 3] = xyz
    return result
