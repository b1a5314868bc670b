# SPDX-License-Identifier: LGPL-2.1-or-later
"""Arrays of 64-bit floats: their type, and the read-only copies that frozen values keep."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from silo.bom.errors import InputError
from silo.bom.message import message

Floats = NDArray[np.float64]


def freeze(owner: object, **shapes: tuple[int, ...]) -> None:
    """Turn fields into read-only arrays of these shapes. InputError if they do not fit."""
    for name, shape in shapes.items():
        array = np.array(getattr(owner, name), dtype=np.float64)
        if array.shape != shape:
            raise InputError(
                message(
                    "{name}: wanted an array of shape {wanted}, got {got}",
                    name=name,
                    wanted=shape,
                    got=array.shape,
                )
            )
        array.flags.writeable = False
        object.__setattr__(owner, name, array)
