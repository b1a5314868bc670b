# SPDX-License-Identifier: LGPL-2.1-or-later
"""Parametric surfaces that numpy evaluates by the thousand points. Lengths as given, no I/O."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from silo.inertia.geometry.exact.quadrature import Floats

NO_BREAKS: Floats = np.zeros(0)
"""Of a surface that is smooth, or whose breaks are not known."""

Ask: TypeAlias = Callable[[float, float], tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]]
"""(u, v) → a point of a surface, and its derivatives in u and in v."""


class Basis(Enum):
    """The functions of one parameter that an elementary surface is made of."""

    LINEAR = "linear"  # 1, t
    CIRCULAR = "circular"  # 1, cos t, sin t

    @property
    def samples(self) -> Floats:
        """Parameters at which values determine the coefficients."""
        return np.array([0.0, 1.0]) if self is Basis.LINEAR else np.array([0.0, 2.0, 4.0])

    def at(self, t: Floats) -> Floats:
        """(…, k) values of the functions."""
        if self is Basis.LINEAR:
            return np.stack([np.ones_like(t), t], axis=-1)
        return np.stack([np.ones_like(t), np.cos(t), np.sin(t)], axis=-1)

    def slope(self, t: Floats) -> Floats:
        """(…, k) their derivatives."""
        if self is Basis.LINEAR:
            return np.stack([np.zeros_like(t), np.ones_like(t)], axis=-1)
        return np.stack([np.zeros_like(t), -np.sin(t), np.cos(t)], axis=-1)


@dataclass(frozen=True, eq=False)
class Elementary:
    """A plane, cylinder, cone, sphere or torus: products of both parameters' functions.

    coefficients : (3, ku, kv)
    """

    in_u: Basis
    in_v: Basis
    coefficients: Floats
    u_range: tuple[float, float]
    exact: bool = True
    v_breaks = NO_BREAKS

    @classmethod
    def sampled(
        cls,
        in_u: Basis,
        in_v: Basis,
        value: Callable[[float, float], tuple[float, float, float]],
        u_range: tuple[float, float],
    ) -> Elementary:
        """From a few of its points: whatever its axes are, also where they are left-handed."""
        points = np.array([[value(float(u), float(v)) for v in in_v.samples] for u in in_u.samples])
        from_u = np.linalg.inv(in_u.at(in_u.samples))
        from_v = np.linalg.inv(in_v.at(in_v.samples))
        return cls(in_u, in_v, np.einsum("iu,uvc,jv->cij", from_u, points, from_v), u_range)

    @property
    def u_breaks(self) -> Floats:
        """The range in quarter turns, in which twelve points are exact to the last digit."""
        return np.array(self.u_range) if self.in_u is Basis.LINEAR else _quarters(*self.u_range)

    @property
    def order(self) -> int:
        """Points per piece."""
        return 4 if self.in_u is Basis.LINEAR else 12

    def at(self, u: Floats, v: Floats) -> tuple[Floats, Floats, Floats]:
        """See :class:`silo.inertia.geometry.exact.quadrature.Surface`."""
        a, da, b, db = self.in_u.at(u), self.in_u.slope(u), self.in_v.at(v), self.in_v.slope(v)
        across, sloped = (
            np.einsum("cij,nj->nic", self.coefficients, b),
            np.einsum("cij,nj->nic", self.coefficients, db),
        )
        return a @ across, da @ across, a @ sloped


def _quarters(low: float, high: float) -> Floats:
    return np.linspace(low, high, max(int(np.ceil((high - low) / (np.pi / 2) - 1e-9)), 1) + 1)


@dataclass(frozen=True, eq=False)
class Nurbs:
    """A B-spline surface, not periodic (see :meth:`unrolled`).

    poles : (nu, nv, 3); weights : (nu, nv) or None
    u_knots, v_knots : with repetitions, as many as poles + degree + 1
    """

    poles: Floats
    weights: Floats | None
    u_knots: Floats
    v_knots: Floats
    u_degree: int
    v_degree: int

    @classmethod
    def drawn(
        cls,
        curve: tuple[Floats, Floats | None, Floats, int],
        along: Floats,
        v_range: tuple[float, float],
    ) -> Nurbs:
        """A spline drawn along a line.

        curve
            poles (n, 3), weights (n,) or None, knots with repetitions and degree, at v = 0.
        along
            (3,) for each unit of v.
        """
        poles, weights, knots, degree = curve
        both = np.stack([poles + along * v for v in v_range], axis=1)
        twice = np.stack([weights, weights], axis=1) if weights is not None else None
        return cls(both, twice, knots, np.repeat(v_range, 2).astype(np.float64), degree, 1)

    def unrolled(
        self, u_range: tuple[float, float] | None = None, v_range: tuple[float, float] | None = None
    ) -> Nurbs:
        """One turn of a periodic surface, repeated until it covers the ranges (None: not periodic there)."""
        result = self
        if u_range is not None:
            turns, knots = _turns(self.u_knots, self.u_degree, u_range)
            result = replace(result, poles=np.tile(self.poles, (turns, 1, 1)), u_knots=knots)
            if self.weights is not None:
                result = replace(result, weights=np.tile(self.weights, (turns, 1)))
        if v_range is not None:
            turns, knots = _turns(self.v_knots, self.v_degree, v_range)
            poles = np.tile(result.poles, (1, turns, 1))
            weights = np.tile(result.weights, (1, turns)) if result.weights is not None else None
            result = replace(result, poles=poles, weights=weights, v_knots=knots)
        return result

    @property
    def exact(self) -> bool:
        """Polynomials are; quotients of them only nearly."""
        return self.weights is None

    @property
    def u_breaks(self) -> Floats:
        """Where two polynomials meet."""
        return np.unique(self.u_knots[self.u_degree : len(self.u_knots) - self.u_degree])

    @property
    def v_breaks(self) -> Floats:
        """Where two polynomials meet, the ends left out."""
        return np.unique(self.v_knots[self.v_degree : len(self.v_knots) - self.v_degree])[1:-1]

    @property
    def order(self) -> int:
        """Enough for second moments of a flux: degree 5p - 1 in u."""
        return max(5 * self.u_degree // 2 + 1, 8)

    @cached_property
    def _homogeneous(self) -> Floats:
        weights = np.ones(self.poles.shape[:2]) if self.weights is None else self.weights
        return np.concatenate([self.poles * weights[..., None], weights[..., None]], axis=2)

    def at(self, u: Floats, v: Floats) -> tuple[Floats, Floats, Floats]:
        """See :class:`silo.inertia.geometry.exact.quadrature.Surface`."""
        first, b, db = basis_functions(v[:, None], v, self.v_knots, self.v_degree)
        columns = first[:, None] + np.arange(self.v_degree + 1)
        first, a, da = basis_functions(u, u.mean(axis=1), self.u_knots, self.u_degree)
        rows = first[:, None] + np.arange(self.u_degree + 1)
        # (n, p + 1, q + 1, 4): the poles around each row; of them (n, p + 1, 4), one curve in u for each.
        poles = self._homogeneous[rows[:, :, None], columns[:, None, :]]
        across = (b[:, None] @ poles)[:, :, 0]
        sloped = (db[:, None] @ poles)[:, :, 0]
        point, du, dv = a @ across, da @ across, a @ sloped
        if self.weights is None:
            return point[..., :3], du[..., :3], dv[..., :3]
        w = point[..., 3:]
        value = point[..., :3] / w
        return value, (du[..., :3] - value * du[..., 3:]) / w, (dv[..., :3] - value * dv[..., 3:]) / w


def _turns(knots: Floats, degree: int, ends: tuple[float, float]) -> tuple[int, Floats]:
    """How many turns cover ``ends``, and their knots; those of one are clamped."""
    low, period = knots[0], knots[-1] - knots[0]
    first = int(np.floor((ends[0] - low) / period + 1e-6))
    last = max(int(np.ceil((ends[1] - low) / period - 1e-6)), first + 1)
    later = [knots[degree + 1 :] + period * turn for turn in range(first, last)]
    return last - first, np.concatenate([knots[: degree + 1] + period * first, *later])


def basis_functions(
    t: Floats, where: Floats, knots: Floats, degree: int
) -> tuple[NDArray[np.intp], Floats, Floats]:
    """B-splines at ``t`` (n, m), each row between the knots around ``where`` (n,).

    Returns the first pole that counts (n,), and values and derivatives (n, m, degree + 1) of the functions
    that are not 0. Cox and de Boor's recursion; outside of the knots the last piece continues.
    """
    span = np.clip(np.searchsorted(knots, where, side="right") - 1, degree, len(knots) - degree - 2)
    values = np.ones((*t.shape, 1))
    slopes = np.zeros((*t.shape, 1))
    for p in range(1, degree + 1):
        # values has the p functions of degree p - 1 that begin at span - p + 1.
        index = span[:, None] + np.arange(-p + 1, 1)
        left, right = knots[index][:, None], knots[index + p][:, None]
        gap = right - left
        gap[gap == 0.0] = np.inf
        if p == degree:
            slopes = np.zeros((*t.shape, p + 1))
            slopes[..., 1:] += p * values / gap
            slopes[..., :-1] -= p * values / gap
        new = np.zeros((*t.shape, p + 1))
        new[..., 1:] += (t[..., None] - left) / gap * values
        new[..., :-1] += (right - t[..., None]) / gap * values
        values = new
    return span - degree, values, slopes


@dataclass(frozen=True, eq=False)
class Turned:
    """Any curve turned round an axis: what it is at three angles says all, so few points are asked.

    ask(u, v)
        as for :class:`Asked`; u is the angle.
    """

    ask: Ask
    u_range: tuple[float, float]
    order: int = 12
    exact: bool = True
    v_breaks = NO_BREAKS

    @property
    def u_breaks(self) -> Floats:
        """The range in quarter turns."""
        return _quarters(*self.u_range)

    def at(self, u: Floats, v: Floats) -> tuple[Floats, Floats, Floats]:
        """See :class:`silo.inertia.geometry.exact.quadrature.Surface`."""
        basis = Basis.CIRCULAR
        unique, place = np.unique(v, return_inverse=True)
        asked = [[self.ask(float(a), float(y))[::2] for a in basis.samples] for y in unique]
        # (n, 2, 3 functions of u, 3): the point and its slope in v.
        samples = np.array(asked, dtype=np.float64).reshape(-1, 3, 2, 3).swapaxes(1, 2)
        curves = (np.linalg.inv(basis.at(basis.samples)) @ samples)[place.reshape(-1)]
        a, da = basis.at(u), basis.slope(u)
        return a @ curves[:, 0], da @ curves[:, 0], a @ curves[:, 1]


@dataclass(frozen=True, eq=False)
class Asked:
    """Any other surface: asked point by point, which is slow and always right.

    ask(u, v)
        point, derivative in u, derivative in v, three numbers each.
    """

    ask: Ask
    u_breaks: Floats
    order: int = 10
    exact: bool = False
    v_breaks = NO_BREAKS

    def at(self, u: Floats, v: Floats) -> tuple[Floats, Floats, Floats]:
        """See :class:`silo.inertia.geometry.exact.quadrature.Surface`."""
        rows = [[self.ask(float(x), float(y)) for x in row] for row, y in zip(u, v, strict=True)]
        found = np.array(rows, dtype=np.float64).reshape(*u.shape, 3, 3)
        return found[..., 0, :], found[..., 1, :], found[..., 2, :]
