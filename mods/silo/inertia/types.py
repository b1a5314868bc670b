# SPDX-License-Identifier: LGPL-2.1-or-later
"""The mass properties of a link as plain floats, as a URDF has them (spec bom-inertia, Task 2)."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class InertialProperties:
    """Mass, centre of mass and inertia tensor of one rigid body, as URDF wants them (spec, Task 2).

    mass
        [kg]
    com
        (x, y, z) [m], in the link's frame.
    ixx, iyy, izz, ixy, ixz, iyz
        tensor elements [kg m^2] about the centre of mass, axes of the link's frame; the products are the
        elements themselves (-∫xy dm), so that they go into a URDF unchanged.
    """

    mass: float
    com: tuple[float, float, float]
    ixx: float
    iyy: float
    izz: float
    ixy: float = 0.0
    ixz: float = 0.0
    iyz: float = 0.0
