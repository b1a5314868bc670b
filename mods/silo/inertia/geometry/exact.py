# SPDX-License-Identifier: LGPL-2.1-or-later
"""Volume, centre and tensor of a solid from its exact faces, by our own integration. numpy only, no I/O.

FreeCAD's own numbers come from an integration without error control (off by up to 7e-3 on real parts), and
its Python has no other. Here the surfaces are the exact ones, and every edge is refined until its share of
the result has converged. So a part weighs the same inside FreeCAD as it does with the geometry kernel's own
error-controlled integration.

The mathematics: a moment of degree k over a solid is 1/(k+3) of the flux ∮ f(r) (r·n) dA through its faces;
a face's flux is ∬ G(u, v) du dv over its trimmed domain; and that is, by Green, ∮ (∫ G du) dv along its
edges. The outer integral is adaptive (Gauss-Kronrod 7-15), the inner one Gauss between the surface's
breaks. Surfaces are evaluated by the thousand points; lengths are as given.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cache, cached_property
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

MAX_SPLITS = 14
"""Halvings of one stretch of an edge, after which its remaining error is reported and not removed."""

MAX_DOUBLINGS = 5
"""Doublings of the inner pieces on a surface whose breaks are not known."""

CHUNK = 100_000
"""Points of a surface that are evaluated at once: some ten MB."""


THIN = 1e-7
"""Share of its box that a solid fills at least, for the tolerance: a metre of thread is above that."""

FLAT = 1e-13
"""Relative: an edge that climbs less than this in v goes along it."""


class Surface(Protocol):
    """A parametric surface.

    exact
        True: between ``u_breaks`` the inner integrals are exact with ``order`` points.
    """

    @property
    def u_breaks(self) -> Floats: ...

    @property
    def v_breaks(self) -> Floats: ...

    @property
    def order(self) -> int: ...

    @property
    def exact(self) -> bool: ...

    def at(self, u: Floats, v: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the points and both derivatives, (n, m, 3) each, for ``u`` (n, m) and ``v`` (n,).

        A row of ``u`` never goes across one of ``u_breaks``.
        """
        ...


@dataclass(frozen=True, eq=False)
class Curve:
    """One edge in a face's parameters: ``at(t)`` (n,) → (n, 2), over ``breaks`` (ascending, both ends).

    ``sign``: -1 where the face goes along it backwards. ``line``: (u, v) is linear in t.
    """

    at: Callable[[Floats], Floats]
    breaks: Floats
    sign: float = 1.0
    line: bool = False


@dataclass(frozen=True, eq=False)
class Face:
    """One trimmed face. The solid's inside is behind it where its edges go counter-clockwise in (u, v)."""

    surface: Surface
    edges: Sequence[Curve]


@dataclass(frozen=True, eq=False)
class Moments:
    """What was integrated, in the faces' own unit of length.

    volume : signed
    com : (3,)
    inertia : (3, 3), per unit density about ``com``; signed as the volume
    error : estimated, relative to the volume
    drift : relative; how far the volume depends on the way that it is taken, from another point (half the
        box's diagonal away) or along one axis only. For a surface that closes it does not
    """

    volume: float
    com: Floats
    inertia: Floats
    error: float
    drift: float = 0.0


def integrate(faces: Iterable[Face], *, centre: Floats, size: float, volume: float, eps: float) -> Moments:
    """Integrate the moments of the solid that ``faces`` enclose.

    centre, size
        of its box; the integration is about the centre, in units of the size, so that no digits are lost far
        from the origin.
    volume
        an estimate, not 0; ``eps`` is relative to it.
    """
    # A shell without any volume would be refined forever; below this, rounding is larger than the tolerance.
    tolerance = eps * max(abs(volume) / size**3, THIN)
    total, error = np.zeros(15), 0.0
    for face in faces:
        flux, doubt = _Flux(face, centre, size, tolerance).run()
        total += flux
        error += doubt
    return _moments(total, error, centre, size)


def _moments(total: Floats, error: float, centre: Floats, size: float) -> Moments:
    volume, first, second = total[0] / 3, total[1:4] / 4, _symmetric(total[4:10] / 5)
    if volume == 0.0 or not np.isfinite(total).all():
        return Moments(0.0, centre.copy(), np.zeros((3, 3)), np.inf)
    com = first / volume
    about = second - volume * np.outer(com, com)
    inertia = (np.trace(about) * np.eye(3) - about) * size**5
    along = np.array([total[13], total[14], total[0] - total[13] - total[14]])
    from_elsewhere, spread = np.linalg.norm(total[10:13]) / 3, np.abs(along - volume).max()
    drift = float(max(from_elsewhere, spread) / abs(volume))
    return Moments(float(volume) * size**3, centre + com * size, inertia, abs(error / (3 * volume)), drift)


def _symmetric(six: Floats) -> Floats:
    xx, yy, zz, xy, xz, yz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


# Kronrod's 15 nodes on [-1, 1] and their weights; those of odd index are Gauss's 7.
_HALF_NODES = (
    0.991455371120812639206854697526329,
    0.949107912342758524526189684047851,
    0.864864423359769072789712788640926,
    0.741531185599394439863864773280788,
    0.586087235467691130294144691693013,
    0.405845151377397166906606412076961,
    0.207784955007898467600689403773245,
)
_HALF_WEIGHTS = (
    0.022935322010529224963732008058970,
    0.063092092629978553290700663189204,
    0.104790010322250183839876322541518,
    0.140653259715525918745189590510238,
    0.169004726639267902826583426598550,
    0.190350578064785409913256402421014,
    0.204432940075298892414161999234649,
)
_MIDDLE_WEIGHT = 0.209482141084727828012999174891714
_NODES = np.array([*(-x for x in _HALF_NODES), 0.0, *reversed(_HALF_NODES)])
_WEIGHTS = np.array([*_HALF_WEIGHTS, _MIDDLE_WEIGHT, *reversed(_HALF_WEIGHTS)])
_GAUSS = np.zeros(15)
_GAUSS[1::2] = np.polynomial.legendre.leggauss(7)[1]


def _differentiation(nodes: Floats) -> Floats:
    """Return (n, n): values at the nodes → derivatives there, of the polynomial through them
    (barycentric).
    """
    gaps = nodes[:, None] - nodes[None, :]
    np.fill_diagonal(gaps, 1.0)
    weights = 1.0 / gaps.prod(axis=1)
    matrix: Floats = weights[None, :] / weights[:, None] / gaps
    np.fill_diagonal(matrix, 0.0)
    np.fill_diagonal(matrix, -matrix.sum(axis=1))
    return matrix


_DERIVE = _differentiation(_NODES)


@cache
def _gauss(order: int) -> tuple[Floats, Floats]:
    x, weight = np.polynomial.legendre.leggauss(order)
    return x, weight


@dataclass(eq=False)
class _Flux:
    """The ten fluxes through one face: of 1, x, y, z, xx, yy, zz, xy, xz, yz times (r·n).

    Behind them its normal n (3), and the fluxes of x and of y alone.
    """

    face: Face
    centre: Floats
    size: float
    tolerance: float
    pieces: Floats = field(init=False)

    def __post_init__(self) -> None:
        breaks = np.asarray(self.face.surface.u_breaks, dtype=np.float64)
        self.pieces = breaks if len(breaks) > 2 else np.array([breaks[0], breaks.mean(), breaks[-1]])

    def run(self) -> tuple[Floats, float]:
        """Integrate the fluxes, and estimate the error of the first."""
        flux, error = self._around()
        if self.face.surface.exact:
            return flux, error
        for _ in range(MAX_DOUBLINGS):
            self.pieces = np.union1d(self.pieces, (self.pieces[1:] + self.pieces[:-1]) / 2)
            before = flux
            flux, error = self._around()
            change = float(np.abs(flux - before)[:10].max())
            if change <= self.tolerance:
                break
        return flux, error + change

    def _around(self) -> tuple[Floats, float]:
        """Integrate along all edges at once: most faces are simple, so that calls cost more than numbers."""
        stretches = [self._stretches(edge) for edge in self.face.edges]
        low = np.concatenate([s[:-1] for s in stretches]) if stretches else np.zeros(0)
        high = np.concatenate([s[1:] for s in stretches]) if stretches else np.zeros(0)
        owner = np.repeat(np.arange(len(stretches)), [len(s) - 1 for s in stretches])
        total, error = np.zeros(15), 0.0
        for split in range(MAX_SPLITS + 1):
            if not len(low):
                break
            fine, coarse = self._stretch(owner, low, high)
            doubts = _doubt(np.abs(fine - coarse)[:, :10].max(axis=1), np.abs(fine)[:, :10].max(axis=1))
            done = (doubts <= self.tolerance) | (split == MAX_SPLITS)
            total += fine[done].sum(axis=0)
            error += float(doubts[done].sum())
            low, high, owner = low[~done], high[~done], np.r_[owner[~done], owner[~done]]
            middle = (low + high) / 2
            low, high = np.r_[low, middle], np.r_[middle, high]
        return total, error

    def _stretches(self, edge: Curve) -> Floats:
        """Return an edge's own breaks; for a straight edge also where it crosses a break of the surface."""
        breaks = edge.breaks
        if not edge.line:
            return breaks
        (_, start), (_, end) = edge.at(breaks[[0, -1]])
        if abs(end - start) <= FLAT * max(abs(start), abs(end), 1.0):
            return breaks[:1]
        if len(self.face.surface.v_breaks) == 0:
            return breaks
        across = (self.face.surface.v_breaks - start) / (end - start)
        inside = across[(across > 1e-9) & (across < 1 - 1e-9)]
        return np.union1d(breaks, breaks[0] + inside * (breaks[-1] - breaks[0]))

    def _stretch(self, owner: NDArray[np.intp], low: Floats, high: Floats) -> tuple[Floats, Floats]:
        """Integrate (n, 15) fluxes of n stretches of the edges ``owner``, by the finer and by the coarser
        rule.
        """
        half = (high - low) / 2
        t = ((high + low) / 2)[:, None] + half[:, None] * _NODES
        points = np.empty((len(low), 15, 2))
        signs = np.empty(len(low))
        for number in np.unique(owner):
            mine, edge = owner == number, self.face.edges[number]
            points[mine] = edge.at(t[mine].ravel()).reshape(-1, 15, 2)
            signs[mine] = edge.sign
        slopes = points[:, :, 1] @ _DERIVE.T
        slopes[np.abs(slopes) < FLAT * max(float(np.abs(points[:, :, 1]).max()), 1.0)] = 0.0
        inner = np.zeros((len(low), 15, 15))
        moving = slopes != 0.0
        if moving.any():
            inner[moving] = self._inner(points[moving])
        values = inner * (slopes * signs[:, None])[:, :, None]
        return np.einsum("j,njk->nk", _WEIGHTS, values), np.einsum("j,njk->nk", _GAUSS, values)

    def _inner(self, ends: Floats) -> Floats:
        """Integrate (n, 15) over u, from the middle break to each end (n, 2).

        If edges do not quite meet, within the file's tolerances, the error grows with the distance from
        there.
        """
        rows, low, high = _clipped(self.pieces, ends[:, 0])
        x, weight = _gauss(self.face.surface.order)
        integrals = np.zeros((len(ends), 15))
        step = max(CHUNK // len(x), 1)
        for start in range(0, len(rows), step):
            chunk = slice(start, start + step)
            half = (high[chunk] - low[chunk]) / 2
            u = ((high[chunk] + low[chunk]) / 2)[:, None] + half[:, None] * x
            density = self._density(u, ends[rows[chunk], 1])
            np.add.at(integrals, rows[chunk], (weight @ density) * half[:, None])
        return integrals

    def _density(self, u: Floats, v: Floats) -> Floats:
        point, du, dv = self.face.surface.at(u, v)
        x, y, z = np.moveaxis((point - self.centre) / self.size, 2, 0)
        (ux, uy, uz), (vx, vy, vz) = np.moveaxis(du / self.size, 2, 0), np.moveaxis(dv / self.size, 2, 0)
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        along_x, along_y = x * nx, y * ny
        flux = along_x + along_y + z * nz
        fx, fy, fz = flux * x, flux * y, flux * z
        second = (fx * x, fy * y, fz * z, fx * y, fx * z, fy * z)
        return np.stack([flux, fx, fy, fz, *second, nx, ny, nz, along_x, along_y], axis=2)


def _doubt(difference: Floats, value: Floats) -> Floats:
    """Estimate the finer rule's error from its difference to the coarser one (the rule of thumb of
    QUADPACK).
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(value > 0, difference / value, 0.0)
    doubt: Floats = np.where(ratio < 1e-3, value * np.minimum(ratio, (200 * ratio) ** 1.5), difference)
    return doubt


def _clipped(pieces: Floats, ends: Floats) -> tuple[NDArray[np.intp], Floats, Floats]:
    """Return the rows, starts and ends of the pieces from the middle one of ``pieces`` to each of ``ends``.

    Pieces to the left of the middle run backwards; the outermost never end.
    """
    middle = len(pieces) // 2
    near = np.r_[pieces[1 : middle + 1], pieces[middle:-1]]
    far = np.r_[-np.inf, pieces[1:middle], pieces[middle + 1 : -1], np.inf]
    right = np.arange(len(near)) >= middle
    stop = np.where(right, np.minimum(far, ends[:, None]), np.maximum(far, ends[:, None]))
    start = np.broadcast_to(near, stop.shape)
    rows, columns = np.nonzero(np.where(right, stop > start, stop < start))
    return rows, start[rows, columns], stop[rows, columns]


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
        """Return the parameters at which values determine the coefficients."""
        return np.array([0.0, 1.0]) if self is Basis.LINEAR else np.array([0.0, 2.0, 4.0])

    def at(self, t: Floats) -> Floats:
        """Return the values (…, k) of the functions."""
        if self is Basis.LINEAR:
            return np.stack([np.ones_like(t), t], axis=-1)
        return np.stack([np.ones_like(t), np.cos(t), np.sin(t)], axis=-1)

    def slope(self, t: Floats) -> Floats:
        """Return the derivatives (…, k) of the functions."""
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
        """Fit the surface to a few of its points, for any axes, also left-handed ones."""
        points = np.array([[value(float(u), float(v)) for v in in_v.samples] for u in in_u.samples])
        from_u = np.linalg.inv(in_u.at(in_u.samples))
        from_v = np.linalg.inv(in_v.at(in_v.samples))
        return cls(in_u, in_v, np.einsum("iu,uvc,jv->cij", from_u, points, from_v), u_range)

    @property
    def u_breaks(self) -> Floats:
        """Divide the range into quarter turns, in which twelve points are exact to the last digit."""
        return np.array(self.u_range) if self.in_u is Basis.LINEAR else _quarters(*self.u_range)

    @property
    def order(self) -> int:
        """Return the number of points for each piece."""
        return 4 if self.in_u is Basis.LINEAR else 12

    def at(self, u: Floats, v: Floats) -> tuple[Floats, Floats, Floats]:
        """See :class:`silo.inertia.geometry.exact.Surface`."""
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
        """Make the surface of a spline that is drawn along a line.

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
        """Repeat one turn of a periodic surface until it covers the ranges; None: not periodic in that
        direction.
        """
        poles, weights, knots, times = self.poles, self.weights, [self.u_knots, self.v_knots], [1, 1]
        for axis, ends in enumerate((u_range, v_range)):
            if ends is not None:
                times[axis], knots[axis] = _turns(knots[axis], (self.u_degree, self.v_degree)[axis], ends)
        if weights is not None:
            weights = np.tile(weights, times)
        return replace(
            self, poles=np.tile(poles, (*times, 1)), weights=weights, u_knots=knots[0], v_knots=knots[1]
        )

    @property
    def exact(self) -> bool:
        """Return True if the surface is polynomial; the integration of a quotient of polynomials is only
        almost exact.
        """
        return self.weights is None

    @property
    def u_breaks(self) -> Floats:
        """Return the parameters at which two polynomials meet."""
        return np.unique(self.u_knots[self.u_degree : len(self.u_knots) - self.u_degree])

    @property
    def v_breaks(self) -> Floats:
        """Return the parameters at which two polynomials meet, without the ends."""
        return np.unique(self.v_knots[self.v_degree : len(self.v_knots) - self.v_degree])[1:-1]

    @property
    def order(self) -> int:
        """Return the number of points that is enough for second moments of a flux: degree 5p - 1 in u."""
        return max(5 * self.u_degree // 2 + 1, 8)

    @cached_property
    def _homogeneous(self) -> Floats:
        weights = np.ones(self.poles.shape[:2]) if self.weights is None else self.weights
        return np.concatenate([self.poles * weights[..., None], weights[..., None]], axis=2)

    def at(self, u: Floats, v: Floats) -> tuple[Floats, Floats, Floats]:
        """See :class:`silo.inertia.geometry.exact.Surface`."""
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
    """Count the turns that cover ``ends``, and return their knots; those of a single turn are clamped."""
    low, period = knots[0], knots[-1] - knots[0]
    first = int(np.floor((ends[0] - low) / period + 1e-6))
    last = max(int(np.ceil((ends[1] - low) / period - 1e-6)), first + 1)
    later = [knots[degree + 1 :] + period * turn for turn in range(first, last)]
    return last - first, np.concatenate([knots[: degree + 1] + period * first, *later])


def basis_functions(
    t: Floats, where: Floats, knots: Floats, degree: int
) -> tuple[NDArray[np.intp], Floats, Floats]:
    """Evaluate the B-splines at ``t`` (n, m), each row between the knots around ``where`` (n,).

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
        as for :class:`SampledSurface`; u is the angle.
    """

    ask: Ask
    u_range: tuple[float, float]
    order: int = 12
    exact: bool = True
    v_breaks = NO_BREAKS

    @property
    def u_breaks(self) -> Floats:
        """Divide the range into quarter turns."""
        return _quarters(*self.u_range)

    def at(self, u: Floats, v: Floats) -> tuple[Floats, Floats, Floats]:
        """See :class:`silo.inertia.geometry.exact.Surface`."""
        basis = Basis.CIRCULAR
        unique, place = np.unique(v, return_inverse=True)
        asked = [[self.ask(float(a), float(y))[::2] for a in basis.samples] for y in unique]
        # (n, 2, 3 functions of u, 3): the point and its slope in v.
        samples = np.array(asked, dtype=np.float64).reshape(-1, 3, 2, 3).swapaxes(1, 2)
        curves = (np.linalg.inv(basis.at(basis.samples)) @ samples)[place.reshape(-1)]
        a, da = basis.at(u), basis.slope(u)
        return a @ curves[:, 0], da @ curves[:, 0], a @ curves[:, 1]


@dataclass(frozen=True, eq=False)
class SampledSurface:
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
        """See :class:`silo.inertia.geometry.exact.Surface`."""
        rows = [[self.ask(float(x), float(y)) for x in row] for row, y in zip(u, v, strict=True)]
        points = np.array(rows, dtype=np.float64).reshape(*u.shape, 3, 3)
        return points[..., 0, :], points[..., 1, :], points[..., 2, :]
