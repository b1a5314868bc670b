# SPDX-License-Identifier: LGPL-2.1-or-later
"""Triangles into pixels: a depth buffer in numpy, without a graphics card or a window system.

Each triangle is cut into its rows, each row into its pixels, for many triangles in one array expression; so
the cost is that of the pixels covered, whether they are a few large triangles or thousands of small ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from silo.inertia.geometry.mesh import Floats, Indices

_BATCH = 2_000_000
"""Rows or pixels looked at in one expression; bounds the memory at some 300 MB."""


@dataclass(eq=False)
class Canvas:
    """What is seen at each pixel: depth (small is near), surface normal, and the number of the thing."""

    depth: NDArray[np.float32]
    normal: NDArray[np.float32]
    thing: NDArray[np.int32]

    @classmethod
    def empty(cls, width: int, height: int) -> Canvas:
        """Nothing but background: thing -1, depth infinite."""
        return cls(
            np.full((height, width), np.inf, dtype=np.float32),
            np.zeros((height, width, 3), dtype=np.float32),
            np.full((height, width), -1, dtype=np.int32),
        )

    def draw(self, points: Floats, normals: Floats, faces: Indices, thing: int) -> None:
        """One body. ``points`` (n, 3): pixel x, pixel y, depth; ``normals`` (n, 3) in the viewer's axes."""
        corners = points[faces]
        height, width = self.depth.shape
        first = np.clip(np.ceil(corners[:, :, 1].min(axis=1) - 0.5), 0, height).astype(np.int64)
        last = np.clip(np.ceil(corners[:, :, 1].max(axis=1) - 0.5), 0, height).astype(np.int64)
        beside = (corners[:, :, 0].max(axis=1) < 0) | (corners[:, :, 0].min(axis=1) > width)
        rows = np.where(beside, 0, last - first)
        body = _Body.of(corners, normals[faces], thing)
        for part in _batches(rows):
            triangle = np.repeat(part, rows[part])
            y = _counted(rows[part]) + np.repeat(first[part], rows[part])
            self._rows(body, corners, triangle, y)

    def _rows(self, body: _Body, corners: Floats, triangle: Indices, y: Indices) -> None:
        """Rows ``y`` of triangles: the pixels between the two edges that each row crosses."""
        left, right = _spans(corners[triangle, :, :2], y + 0.5)
        width = self.depth.shape[1]
        first = np.clip(np.ceil(left - 0.5), 0, width).astype(np.int64)
        last = np.clip(np.ceil(right - 0.5), 0, width).astype(np.int64)
        counts = np.maximum(last - first, 0)
        for part in _batches(counts):
            x = _counted(counts[part]) + np.repeat(first[part], counts[part])
            self._pixels(body, np.repeat(triangle[part], counts[part]), x, np.repeat(y[part], counts[part]))

    def _pixels(self, body: _Body, triangle: Indices, x: Indices, y: Indices) -> None:
        """Pixels ``x``, ``y`` of one triangle each: keep those that are nearer than what is there."""
        place = y * self.depth.shape[1] + x
        depth = _at(body.depth, triangle, x, y)
        flat = self.depth.reshape(-1)
        np.minimum.at(flat, place, depth)
        won = depth <= flat[place]
        triangle, x, y, place = triangle[won], x[won], y[won], place[won]
        normal = self.normal.reshape(-1, 3)
        for axis in range(3):
            normal[place, axis] = _at(body.normal[:, axis], triangle, x, y)
        self.thing.reshape(-1)[place] = body.thing


@dataclass(frozen=True, eq=False)
class _Body:
    """For each triangle, what is linear over it: value = plane · (1, x, y). ``normal`` (n, 3, 3)."""

    depth: NDArray[np.float32]
    normal: NDArray[np.float32]
    thing: int

    @classmethod
    def of(cls, corners: Floats, normals: Floats, thing: int) -> _Body:
        """From (n, 3, 3) corners in pixels and depth, and the normals at them."""
        values = np.concatenate([corners[:, :, 2:], normals], axis=2)
        a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        area = ab[:, 0] * ac[:, 1] - ac[:, 0] * ab[:, 1]
        area = np.where(np.abs(area) > 1e-12, area, np.inf)
        up, down = values[:, 1] - values[:, 0], values[:, 2] - values[:, 0]
        slope_x = (up * ac[:, 1:2] - down * ab[:, 1:2]) / area[:, None]
        slope_y = (down * ab[:, 0:1] - up * ac[:, 0:1]) / area[:, None]
        # The plane is taken at pixel centres.
        base = values[:, 0] + slope_x * (0.5 - a[:, 0:1]) + slope_y * (0.5 - a[:, 1:2])
        plane = np.stack([base, slope_x, slope_y], axis=2).astype(np.float32)
        return cls(plane[:, 0], plane[:, 1:], thing)


def _at(plane: NDArray[np.float32], triangle: Indices, x: Indices, y: Indices) -> NDArray[np.float32]:
    found = plane[triangle]
    result: NDArray[np.float32] = found[:, 0] + found[:, 1] * x + found[:, 2] * y
    return result.astype(np.float32)


def _batches(counts: Indices) -> list[Indices]:
    """The indices of non-zero ``counts`` in groups whose sums stay near the batch size."""
    index = np.flatnonzero(counts)
    if not len(index):
        return []
    group = np.cumsum(counts[index]) // _BATCH
    cuts = np.flatnonzero(np.diff(group)) + 1
    return list(np.split(index, cuts))


def _counted(counts: Indices) -> Indices:
    """0..n-1 for each of the counts, in a row."""
    ends = np.cumsum(counts)
    result: Indices = np.arange(int(ends[-1])) - np.repeat(ends - counts, counts)
    return result


def _spans(corners: Floats, y: NDArray[Any]) -> tuple[Floats, Floats]:
    """Where the line at ``y`` (n,) enters and leaves each triangle (n, 3, 2); empty: enters at +inf."""
    left, right = np.full(len(y), np.inf), np.full(len(y), -np.inf)
    for i in range(3):
        p, q = corners[:, i], corners[:, (i + 1) % 3]
        crosses = (p[:, 1] <= y) != (q[:, 1] <= y)
        rise = np.where(crosses, q[:, 1] - p[:, 1], 1.0)
        x = p[:, 0] + (y - p[:, 1]) * (q[:, 0] - p[:, 0]) / rise
        left = np.where(crosses, np.minimum(left, x), left)
        right = np.where(crosses, np.maximum(right, x), right)
    missed = left > right
    return np.where(missed, 1e9, left), np.where(missed, -1e9, right)
