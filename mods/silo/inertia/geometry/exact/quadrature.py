# SPDX-License-Identifier: LGPL-2.1-or-later
"""Volume, centre and tensor of a solid from its exact faces, by our own integration. numpy only.

FreeCAD's own numbers come from an integration without error control (off by up to 7e-3 on real parts), and
its Python has no other. Here the surfaces are the exact ones, and every edge is refined until its share of
the result has converged. So a part weighs the same inside FreeCAD as it does with the geometry kernel's own
error-controlled integration.

The mathematics: a moment of degree k over a solid is 1/(k+3) of the flux ∮ f(r) (r·n) dA through its faces; a
face's flux is ∬ G(u, v) du dv over its trimmed domain; and that is, by Green, ∮ (∫ G du) dv along its edges.
The outer integral is adaptive (Gauss-Kronrod 7-15), the inner one Gauss between the surface's breaks.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Protocol

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
        """Points and both derivatives, (n, m, 3) each, for ``u`` (n, m) and ``v`` (n,).

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
    """The moments of the solid that ``faces`` enclose.

    centre, size
        of its box: integrated about the one, in units of the other, so that no digits are lost far away.
    volume
        a rough one, not 0; ``eps`` is relative to it.
    """
    # A shell without any volume would be refined for ever; below this, rounding is larger than the tolerance.
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
    """(n, n): values at the nodes → derivatives there, of the polynomial through them (barycentric)."""
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
        """The fluxes, and the estimated error of the first."""
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
        """All edges at once: most faces are simple, and then calls cost more than numbers."""
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
        """An edge's own breaks; a straight one also where it crosses a break of the surface."""
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
        """(n, 15) fluxes of n stretches of the edges ``owner``, by the finer rule and by the coarser."""
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
        """(n, 15) integrals over u, from the middle break to each end (n, 2).

        Where edges do not quite meet, by the file's tolerances, the error grows with the distance from there.
        """
        rows, low, high = _clipped(self.pieces, ends[:, 0])
        x, weight = _gauss(self.face.surface.order)
        result = np.zeros((len(ends), 15))
        step = max(CHUNK // len(x), 1)
        for start in range(0, len(rows), step):
            some = slice(start, start + step)
            half = (high[some] - low[some]) / 2
            u = ((high[some] + low[some]) / 2)[:, None] + half[:, None] * x
            density = self._density(u, ends[rows[some], 1])
            np.add.at(result, rows[some], (weight @ density) * half[:, None])
        return result

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
    """The finer rule's error, from how far the coarser one is off (the rule of thumb of QUADPACK)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(value > 0, difference / value, 0.0)
    doubt: Floats = np.where(ratio < 1e-3, value * np.minimum(ratio, (200 * ratio) ** 1.5), difference)
    return doubt


def _clipped(pieces: Floats, ends: Floats) -> tuple[NDArray[np.intp], Floats, Floats]:
    """Rows, starts and ends of the pieces from the middle one of ``pieces`` to each of ``ends``.

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
