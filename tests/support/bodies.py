# SPDX-License-Identifier: LGPL-2.1-or-later
"""Bodies with closed-form properties, as prototypes; for tests, benchmarks, and stand-ins without a CAD file.

All are centred at the origin of their own axes. Formulae: any mechanics table, for example
https://en.wikipedia.org/wiki/List_of_moments_of_inertia (divided by the mass, times the volume).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from silo.inertia.arrays import Floats
from silo.inertia.assembly import Prototype


def body(name: str, volume: float, second: Sequence[float], **more: Any) -> Prototype:
    """A body of ``volume`` [m^3] with principal moments ``second`` [m^2 per unit mass]."""
    unit = np.diag(np.asarray(second, float)) * volume
    more.setdefault("key", name)
    return Prototype(name=name, volume_m3=volume, inertia_unit=unit, **more)


def box(name: str, x: float, y: float, z: float, **more: Any) -> Prototype:
    """A box with edges x, y, z [m]."""
    return body(name, x * y * z, ((y * y + z * z) / 12, (x * x + z * z) / 12, (x * x + y * y) / 12), **more)


def cylinder(name: str, radius: float, height: float, **more: Any) -> Prototype:
    """A cylinder along z [m]."""
    across = (3 * radius**2 + height**2) / 12
    return body(name, math.pi * radius**2 * height, (across, across, radius**2 / 2), **more)


def shape_only(name: str, **more: Any) -> Prototype:
    """A product without a solid: surfaces, wires, or a file that was not found."""
    more.setdefault("key", name)
    return Prototype(name=name, has_solid=False, **more)


def placement(xyz: ArrayLike = (0, 0, 0), turn: ArrayLike | None = None) -> Floats:
    """(4, 4) placement from a position [m] and an optional (3, 3) matrix."""
    result = np.eye(4)
    result[:3, 3] = np.asarray(xyz, float)
    if turn is not None:
        result[:3, :3] = np.asarray(turn, float)
    return result
