# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where a preview is seen from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from silo.inertia.geometry.mesh import Floats
from silo.inertia.model import Assembly
from silo.inertia.preview.glb import scene_corners
from silo.inertia.preview.scene import LinkView, inertia_ellipsoid
from silo.inertia.preview.shading import ellipsoid

SMOOTH = 2
"""The picture is drawn this many times as large, and averaged."""


@dataclass(frozen=True, eq=False)
class Camera:
    """Parallel projection. ``axes`` rows: right, up, towards the viewer; ``scale`` pixels per m."""

    axes: Floats
    scale: float
    shift: Floats

    def pixels(self, points: Floats) -> Floats:
        """(n, 3): pixel x, pixel y (down), depth [m] growing away from the viewer."""
        seen = points @ self.axes.T
        return np.column_stack(
            [seen[:, 0] * self.scale + self.shift[0], -seen[:, 1] * self.scale + self.shift[1], -seen[:, 2]]
        )


def camera_for(assembly: Assembly, views: Sequence[LinkView], width: int, height: int) -> Camera:
    """The view from above and aside that holds everything; ``width`` and ``height`` in drawn pixels."""
    towards = np.array([0.62, -1.0, 0.62])
    towards /= np.linalg.norm(towards)
    right = np.cross([0.0, 0.0, 1.0], towards)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(towards, right), towards])
    points = [scene_corners(assembly, views)]
    for view in views:
        shape = inertia_ellipsoid(view.props) if view.props is not None else None
        if shape is not None:
            ball = ellipsoid(6, 8).vertices
            points.append(ball @ shape.placement[:3, :3].T + shape.centre)
    seen = np.concatenate(points) @ axes.T if any(map(len, points)) else np.zeros((1, 3))
    low, high = seen[:, :2].min(axis=0), seen[:, :2].max(axis=0)
    room = np.array([width * 0.86, height * 0.82])
    scale = float((room / np.maximum(high - low, 1e-9)).min())
    middle = (low + high) / 2
    return Camera(axes, scale, np.array([width / 2 - middle[0] * scale, height / 2 + middle[1] * scale]))
