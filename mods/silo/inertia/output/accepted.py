# SPDX-License-Identifier: LGPL-2.1-or-later
"""Mass properties that a simulator accepts: settled to the printed digits, and checked after rounding.

Most consumers check nothing: PyBullet silently sets a bad inertia to zero, pinocchio computes NaN. So what no
rigid body can have is refused here, and noise in the last digits is cleared before anything is printed.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from silo.bom.errors import InputError
from silo.bom.message import message
from silo.inertia.arrays import Floats
from silo.inertia.digits import number
from silo.inertia.report import LinkResult
from silo.inertia.rigid import CHECK_TOLERANCE, MassProps, TensorProblem, tensor_words

_MARGIN = 1e-14
"""Relative; above what printing fifteen digits may change, far below what matters."""

_NOISE = 1e-14
"""Relative: an element below this is the rest of a sum that cancelled."""


def settled(props: MassProps) -> MassProps:
    """Round ``props`` to the digits that are printed, symmetric, with principal moments that keep a + b >= c.

    A flat plate has a + b = c, and rounding may push c above by some 1e-16: MuJoCo refuses that. All moments
    are then raised by the missing amount, which is below 1e-9 of the largest one; a larger amount is no
    rounding, and stays for the check to find.
    """
    tensor = _printed(_quiet((props.inertia + props.inertia.T) / 2))
    for _ in range(4):
        low, mid, high = np.linalg.eigvalsh(tensor)
        missing = float(high - low - mid)
        if missing <= -_MARGIN / 2 * high or missing > CHECK_TOLERANCE * high:
            break
        tensor = _printed(tensor + (max(missing, 0.0) + _MARGIN * high) * np.eye(3))
    reach = np.abs(props.com).max() + np.sqrt(np.abs(tensor).max() / props.mass if props.mass > 0 else 0)
    return MassProps(float(number(props.mass)), _printed(_quiet(props.com, reach)), tensor)


def _quiet(values: Floats, size: float | None = None) -> Floats:
    """Write zero for rounding noise against ``size``: 1e-18 m beside 0.3 m is no position."""
    size = float(np.abs(values).max()) if size is None else size
    quiet: Floats = np.where(np.abs(values) <= _NOISE * size, 0.0, values)
    return quiet


def _printed(values: Floats) -> Floats:
    return np.array([float(number(value)) for value in values.flat]).reshape(values.shape)


def writable(links: Iterable[LinkResult]) -> dict[str, MassProps]:
    """Return link → properties that a simulator accepts. Links without mass are left out.

    Raises InputError with every link whose tensor no rigid body can have; then nothing may be written.
    """
    fit: dict[str, MassProps] = {}
    bad: list[str] = []
    for link in links:
        props = settled(link.props)
        problems = props.check()
        if TensorProblem.ZERO_MASS in problems:
            continue
        if problems:
            bad.append(f"{link.name} {tensor_words(problems)}")
        fit[link.name] = props
    if bad:
        raise InputError(
            message("not written, because no rigid body can have these inertias: ") + "; ".join(bad)
        )
    return fit
