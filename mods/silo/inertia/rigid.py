# SPDX-License-Identifier: LGPL-2.1-or-later
"""Rigid bodies: mass, centre of mass and inertia tensor, moved, summed and checked.

SI: kg, m, kg m^2. A tensor is about the body's own centre of mass, in the axes of the frame at hand.
Off-diagonal elements are tensor elements (-∫xy dm), never "products of inertia" with the sign turned.
N bodies are summed in one numpy expression.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from silo.bom.errors import InputError
from silo.bom.message import message
from silo.inertia.arrays import Floats, freeze
from silo.inertia.placements import EYE3, as_placement, is_rigid
from silo.inertia.types import InertialProperties

CHECK_TOLERANCE = 1e-9
"""Relative to the largest principal moment: what counts as rounding when a tensor is checked."""


class TensorProblem(StrEnum):
    """Why no rigid body can have these mass properties."""

    NOT_FINITE = "not_finite"  # a value is NaN or infinite
    NOT_SYMMETRIC = "not_symmetric"
    ZERO_MASS = "zero_mass"  # physics engines refuse a moving link without mass
    NEGATIVE_MASS = "negative_mass"
    ZERO_INERTIA = "zero_inertia"  # a point mass: refused by MuJoCo on a moving link
    NOT_POSITIVE_DEFINITE = "not_positive_definite"
    TRIANGLE_INEQUALITY = "triangle_inequality"  # a principal moment exceeds the sum of the two others


_TENSOR_WORDS = {
    TensorProblem.NOT_FINITE: message("has a value that is not finite"),
    TensorProblem.NOT_SYMMETRIC: message("is not symmetric"),
    TensorProblem.ZERO_MASS: message("has no mass"),
    TensorProblem.NEGATIVE_MASS: message("has a negative mass"),
    TensorProblem.ZERO_INERTIA: message("has no inertia (a point mass); MuJoCo refuses it on a moving link"),
    TensorProblem.NOT_POSITIVE_DEFINITE: message("has a principal moment that is not above zero"),
    TensorProblem.TRIANGLE_INEQUALITY: message("has a principal moment above the sum of the two others"),
}


def tensor_words(problems: Iterable[TensorProblem]) -> str:
    """Say why no rigid body has a tensor, as the end of a sentence."""
    return ", ".join(_TENSOR_WORDS[problem] for problem in problems)


@dataclass(frozen=True, eq=False, repr=False)
class MassProps:
    """Mass properties of one rigid body in one frame; what a report has for each link.

    mass : float [kg]
    com : (3,) float [m], in the frame
    inertia : (3, 3) float [kg m^2], about ``com``, axes of the frame
    frame : which frame, in words; "" if not stated. Bodies of two named frames cannot be added.

    ``center_mass``, ``moment_inertia`` and the principal ones are the same under the names that trimesh has.
    """

    mass: float
    com: Floats
    inertia: Floats
    frame: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "mass", float(self.mass))
        freeze(self, com=(3,), inertia=(3, 3))

    def __reduce__(self) -> tuple[Any, ...]:
        # By the constructor, so that copies are read-only as well.
        return type(self), (self.mass, self.com, self.inertia, self.frame)

    def _values(self) -> tuple[Any, ...]:
        return self.mass, *self.com, *self.inertia.flat, self.frame

    def __eq__(self, other: object) -> bool:
        """Compare to the last bit, in one frame; ``np.allclose`` compares with a tolerance."""
        return self._values() == other._values() if isinstance(other, MassProps) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._values())

    @classmethod
    def nothing(cls) -> MassProps:
        """Return a body without mass, the neutral element of :func:`combine`."""
        return cls(0.0, np.zeros(3), np.zeros((3, 3)))

    @property
    def center_mass(self) -> Floats:
        """Return the centre of mass (3,) [m]."""
        return self.com

    @property
    def moment_inertia(self) -> Floats:
        """Return the tensor (3, 3) [kg m^2] about the centre of mass.

        Off-diagonals are tensor elements (-∫xy dm).
        """
        return self.inertia

    @property
    def principal_inertia_components(self) -> Floats:
        """Return the principal moments (3,) [kg m^2], ascending."""
        return self.principal()[0]

    @property
    def principal_inertia_vectors(self) -> Floats:
        """Return (3, 3): in each row the unit axis of a principal moment, right-handed."""
        return self.principal()[1].T

    def __add__(self, other: object) -> MassProps:
        """Combine both into one rigid body. InputError if their frames are known to differ."""
        if not isinstance(other, MassProps):
            return NotImplemented
        if self.frame and other.frame and self.frame != other.frame:
            raise InputError(
                message(
                    "these bodies are given in two frames ({frame}; {other_frame}) and cannot be added; "
                    "bring one into the other's frame with transformed(T), or ask for all in the "
                    "assembly's frame",
                    frame=self.frame,
                    other_frame=other.frame,
                )
            )
        return replace(combine((self, other)), frame=self.frame or other.frame)

    def __radd__(self, other: object) -> MassProps:
        # sum() begins with 0.
        return self if other == 0 else NotImplemented

    def __repr__(self) -> str:
        centre = ", ".join(f"{v:.6g}" for v in self.com)
        finite = np.isfinite(self.inertia).all()
        moments = ", ".join(f"{v:.6g}" for v in self.principal()[0]) if finite else message("not finite")
        where = f", frame={self.frame!r}" if self.frame else ""
        return f"MassProps(mass={self.mass:.6g} kg, com=[{centre}] m, principal=[{moments}] kg m²{where})"

    def transformed(self, placement: ArrayLike, frame: str = "") -> MassProps:
        """Move the body by ``placement`` ((4, 4), rigid or mirrored); ``frame`` names the new frame.

        A placement that scales is refused (InputError), since a mass does not show what scaling does to it.
        Scaled *geometry* is handled exactly, by :func:`place`.
        """
        matrix = as_placement(placement)
        if not is_rigid(matrix):
            raise InputError(
                message(
                    "a body with a mass can be moved, turned and mirrored, but not scaled; the "
                    "placement's axes have the lengths {tolist}",
                    tolist=np.linalg.norm(matrix[:3, :3], axis=0).tolist(),
                )
            )
        turn = matrix[:3, :3]
        return MassProps(self.mass, turn @ self.com + matrix[:3, 3], turn @ self.inertia @ turn.T, frame)

    def principal(self) -> tuple[Floats, Floats]:
        """Return the principal moments ((3,) [kg m^2], ascending) and axes ((3, 3), columns,
        right-handed).
        """
        moments, axes = np.linalg.eigh((self.inertia + self.inertia.T) / 2)
        if np.linalg.det(axes) < 0:
            axes = axes * np.array([1.0, 1.0, -1.0])
        return moments, axes

    def check(self, tolerance: float = CHECK_TOLERANCE) -> tuple[TensorProblem, ...]:
        """Find everything that keeps this from being a rigid body; () if nothing does.

        It checks the eigenvalues, not the diagonal: diag(.02, .02, .02) with ixy = .015 looks right, but is
        not. ``tolerance`` is relative to the largest principal moment; a flat plate (a + b = c) is fine.
        """
        if not (np.isfinite(self.mass) and np.isfinite(self.com).all() and np.isfinite(self.inertia).all()):
            return (TensorProblem.NOT_FINITE,)
        problems: list[TensorProblem] = []
        scale = float(np.abs(self.inertia).max())
        if np.abs(self.inertia - self.inertia.T).max() > tolerance * scale:
            problems.append(TensorProblem.NOT_SYMMETRIC)
        if self.mass <= 0:
            problems.append(TensorProblem.ZERO_MASS if self.mass == 0 else TensorProblem.NEGATIVE_MASS)
        if scale == 0:
            return (*problems, TensorProblem.ZERO_INERTIA)
        low, mid, high = self.principal()[0]
        if low <= 0:
            problems.append(TensorProblem.NOT_POSITIVE_DEFINITE)
        if low + mid < high * (1 - tolerance):
            problems.append(TensorProblem.TRIANGLE_INEQUALITY)
        return tuple(problems)

    def to_inertial(self) -> InertialProperties:
        """Convert to the spec's plain type, with an exactly symmetric tensor."""
        x, y, z = self.com.tolist()
        (ixx, ixy, ixz), (_, iyy, iyz), (_, _, izz) = ((self.inertia + self.inertia.T) / 2).tolist()
        return InertialProperties(self.mass, (x, y, z), ixx, iyy, izz, ixy, ixz, iyz)


def parallel_axis(masses: Floats, offsets: Floats) -> Floats:
    """Return the tensor (3, 3) [kg m^2] of point masses ((N,) [kg]) at ``offsets`` ((N, 3) [m]) about the
    origin.
    """
    second = np.einsum("n,ni,nj->ij", masses, offsets, offsets)
    tensor: Floats = np.trace(second) * EYE3 - second
    return tensor


def combine(bodies: Sequence[MassProps]) -> MassProps:
    """Combine all bodies into one rigid body, in their common frame."""
    if not bodies:
        return MassProps.nothing()
    return combine_arrays(
        np.array([b.mass for b in bodies]),
        np.array([b.com for b in bodies]),
        np.array([b.inertia for b in bodies]),
    )


def combine_arrays(masses: ArrayLike, coms: ArrayLike, inertias: ArrayLike) -> MassProps:
    """Do what :func:`combine` does, from (N,) [kg], (N, 3) [m], (N, 3, 3) [kg m^2].

    Without any mass there is no centre, and the origin is returned.
    """
    mass = np.asarray(masses, float)
    com = np.asarray(coms, float)
    total = float(mass.sum())
    if total == 0:
        return MassProps(total, np.zeros(3), np.asarray(inertias, float).sum(axis=0).reshape(3, 3))
    centre = (mass[:, None] * com).sum(axis=0) / total
    tensor = np.asarray(inertias, float).sum(axis=0) + parallel_axis(mass, com - centre)
    return MassProps(total, centre, (tensor + tensor.T) / 2)
