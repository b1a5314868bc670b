# SPDX-License-Identifier: LGPL-2.1-or-later
"""A preview as a picture: the links from above and aside, drawn in software.

Bodies are shaded and outlined as in a technical illustration. Ellipsoids shine through them, for they mostly
lie inside; the mark of a centre of mass is the usual quartered disc, and always on top.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from silo.inertia.geometry.glb import scene_corners
from silo.inertia.geometry.lettering import fitted, text_mask
from silo.inertia.geometry.mesh import Floats, simplified
from silo.inertia.geometry.png import write_png
from silo.inertia.geometry.raster import Canvas
from silo.inertia.geometry.scene import (
    UNCLAIMED,
    Colour,
    LinkView,
    colour_of,
    inertia_ellipsoid,
    meshes_of,
)
from silo.inertia.geometry.shading import Shaded, ellipsoid, shaded
from silo.inertia.model import Assembly
from silo.inertia.wording import counted

_SMOOTH = 2
"""The picture is drawn this many times as large, and averaged."""

_INK: Colour = (0.13, 0.15, 0.18)
_FAINT: Colour = (0.45, 0.48, 0.52)
_LEGEND = 0.27
"""Share of the width that the legend has."""


@dataclass(frozen=True, eq=False)
class _Camera:
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


def write_picture(
    assembly: Assembly, views: Sequence[LinkView], *, width: int = 1400, height: int = 900
) -> bytes:
    """A PNG of the links, with a legend of names and masses."""
    stage = round(width * (1 - _LEGEND))
    camera = _camera(assembly, views, stage * _SMOOTH, height * _SMOOTH)
    colours = [UNCLAIMED if v.props is None and not v.name else colour_of(n) for n, v in enumerate(views)]
    canvas, owner = _bodies(assembly, views, camera, stage * _SMOOTH, height * _SMOOTH)
    image = _shaded_image(canvas, owner, colours)
    page = np.ones((height, width, 3))
    page[:, :stage] = image.reshape(height, _SMOOTH, stage, _SMOOTH, 3).mean(axis=(1, 3))
    depth = canvas.depth[::_SMOOTH, ::_SMOOTH].astype(np.float64)
    # Many ellipsoids over each other would hide the parts; then their rims alone must tell.
    fill = min(1.0, 5 / max(len(views), 1))
    for view, colour in zip(views, colours, strict=True):
        _blend_ellipsoid(page, depth, camera, view, colour, fill)
    page[:, stage:] = (0.965, 0.97, 0.975)
    for view in views:
        _mark_centre(page, camera, view)
    _axes(page, camera, height)
    _ruler(page, camera, stage, height)
    _legend(page, assembly, views, colours, stage)
    return write_png((np.clip(page, 0, 1) * 255 + 0.5).astype(np.uint8))


def _camera(assembly: Assembly, views: Sequence[LinkView], width: int, height: int) -> _Camera:
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
    return _Camera(axes, scale, np.array([width / 2 - middle[0] * scale, height / 2 + middle[1] * scale]))


def _bodies(
    assembly: Assembly, views: Sequence[LinkView], camera: _Camera, width: int, height: int
) -> tuple[Canvas, NDArray[np.int32]]:
    """What is seen where, and the link number of each thing drawn."""
    canvas = Canvas.empty(width, height)
    shapes: dict[tuple[str, int], Shaded] = {}
    meshes = meshes_of(assembly, views)
    owner: list[int] = []
    for number, view in enumerate(views):
        for instance in view.instances:
            mesh = meshes.get(instance.prototype)
            if mesh is None:
                continue
            # A part of forty pixels needs no ten thousand triangles.
            detail = _detail(float(np.linalg.norm(mesh.extents)) * camera.scale)
            key = (instance.prototype, detail)
            if key not in shapes:
                shapes[key] = shaded(simplified(mesh, detail))
            shape = shapes[key]
            turn = instance.transform[:3, :3]
            points = camera.pixels(shape.vertices @ turn.T + instance.transform[:3, 3])
            normals = shape.normals @ np.linalg.inv(turn) @ camera.axes.T
            canvas.draw(points, normals, shape.faces, len(owner))
            owner.append(number)
    return canvas, np.array(owner, dtype=np.int32)


def _detail(pixels: float) -> int:
    for limit, triangles in ((30, 100), (80, 600), (250, 4_000), (800, 40_000)):
        if pixels < limit:
            return triangles
    return 1_000_000


def _shaded_image(canvas: Canvas, owner: NDArray[np.int32], colours: Sequence[Colour]) -> Floats:
    height, width = canvas.depth.shape
    there = canvas.thing >= 0
    image: Floats = np.empty((height, width, 3))
    image[...] = np.linspace(1.0, 0.93, height)[:, None, None] * np.array([0.985, 0.99, 1.0])
    if not there.any():
        return image
    normal = _facing(canvas.normal[there].astype(np.float64))
    tint = np.array(colours)[owner[canvas.thing[there]]]
    image[there] = _lit(normal, tint)
    image *= _outlines(canvas)[..., None]
    return image


def _facing(normal: Floats) -> Floats:
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = normal / np.where(length > 0, length, 1.0)
    result: Floats = normal * np.where(normal[:, 2:] < 0, -1.0, 1.0)
    return result


def _lit(normal: Floats, tint: Floats) -> Floats:
    key = np.array([-0.45, 0.75, 0.55])
    fill = np.array([0.8, 0.1, 0.5])
    light = 0.42 + 0.5 * np.clip(normal @ (key / np.linalg.norm(key)), 0, 1)
    light += 0.16 * np.clip(normal @ (fill / np.linalg.norm(fill)), 0, 1)
    half = key / np.linalg.norm(key) + np.array([0.0, 0.0, 1.0])
    shine = 0.18 * np.clip(normal @ (half / np.linalg.norm(half)), 0, 1) ** 24
    result: Floats = np.clip(tint * light[:, None] + shine[:, None], 0, 1)
    return result


def _outlines(canvas: Canvas) -> Floats:
    """1 where nothing is, less on the outlines of bodies and on their edges."""
    depth = np.where(np.isfinite(canvas.depth), canvas.depth, 0.0)
    span = float(np.ptp(depth[canvas.thing >= 0])) or 1.0
    result = np.ones(canvas.depth.shape)
    for axis in (0, 1):
        here = tuple(slice(None, -1) if a == axis else slice(None) for a in (0, 1))
        there = tuple(slice(1, None) if a == axis else slice(None) for a in (0, 1))
        outline = canvas.thing[here] != canvas.thing[there]
        outline |= np.abs(depth[here] - depth[there]) > 0.04 * span
        dots = np.einsum("ijk,ijk->ij", canvas.normal[here], canvas.normal[there])
        crease = (dots < 0.8) & (canvas.thing[here] >= 0) & ~outline
        for where, shade in ((outline, 0.30), (crease, 0.62)):
            for side in (here, there):
                view = result[side]
                view[where] = np.minimum(view[where], shade)
    return result


def _blend_ellipsoid(
    page: Floats, depth: Floats, camera: _Camera, view: LinkView, colour: Colour, fill: float
) -> None:
    """An ellipsoid over the finished picture, ray by ray: a parallel ray meets a quadric in closed form."""
    shape = inertia_ellipsoid(view.props) if view.props is not None else None
    if shape is None or shape.radii.max() * camera.scale < 1:
        return
    scale = camera.scale / _SMOOTH
    turn = camera.axes @ shape.axes
    radii = np.maximum(shape.radii, shape.radii.max() * 1e-3)
    quadric = (turn / radii**2) @ turn.T
    x0, y0, z0 = camera.pixels(shape.centre[None])[0] / np.array([_SMOOTH, _SMOOTH, 1.0])
    half = np.sqrt(np.einsum("ij,ij->i", turn * radii, turn * radii))[:2] * scale + 1
    height, width = depth.shape
    left, right = max(0, int(x0 - half[0])), min(width, int(x0 + half[0]) + 1)
    top, bottom = max(0, int(y0 - half[1])), min(height, int(y0 + half[1]) + 1)
    if left >= right or top >= bottom:
        return
    x, y = np.meshgrid(
        (np.arange(left, right) + 0.5 - x0) / scale, -(np.arange(top, bottom) + 0.5 - y0) / scale
    )
    slope = quadric[0, 2] * x + quadric[1, 2] * y
    rest = quadric[0, 0] * x * x + 2 * quadric[0, 1] * x * y + quadric[1, 1] * y * y - 1
    inside = slope * slope - quadric[2, 2] * rest
    where = inside > 0
    z = (np.sqrt(inside[where]) - slope[where]) / quadric[2, 2]
    point = np.column_stack([x[where], y[where], z])
    facing = point @ quadric
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    behind = z0 - z > depth[top:bottom, left:right][where]
    rim = (1 - np.clip(facing[:, 2], 0, 1)) ** 2.5
    alpha = np.where(behind, 0.14, 0.26) * fill + rim * np.where(behind, 0.55, 0.7) * fill**0.5
    alpha = np.clip(alpha, 0, 1)[:, None]
    paint = _lit(facing, np.broadcast_to(np.array(colour) * 0.72, facing.shape))
    window = page[top:bottom, left:right]
    window[where] = window[where] * (1 - alpha) + paint * alpha


def _mark_centre(page: Floats, camera: _Camera, view: LinkView) -> None:
    if view.props is None or view.props.mass <= 0:
        return
    x, y, _ = camera.pixels(view.props.com[None])[0] / _SMOOTH
    radius = 9.0
    height, width = page.shape[:2]
    left, top = max(0, int(x - radius - 2)), max(0, int(y - radius - 2))
    right, bottom = min(width, int(x + radius + 3)), min(height, int(y + radius + 3))
    if left >= right or top >= bottom:
        return
    px, py = np.meshgrid(np.arange(left, right) + 0.5 - x, np.arange(top, bottom) + 0.5 - y)
    distance = np.hypot(px, py)
    # Two quarters dark, two light; smoothed across the quarters' borders.
    mix = np.clip(np.sign(px * py) * np.minimum(np.abs(px), np.abs(py)) + 0.5, 0, 1)
    ring = np.clip(distance - (radius - 2.2) + 0.5, 0, 1)
    tone = (1 - mix) * (1 - ring) * 0.98 + 0.02
    alpha = np.clip(radius - distance + 0.5, 0, 1)
    window = page[top:bottom, left:right]
    window[...] = window * (1 - alpha[..., None]) + tone[..., None] * alpha[..., None]


def _write(page: Floats, text: str, x: float, y: float, size: float, colour: Colour = _INK) -> None:
    """Text with its base line at ``y``. What lies outside of the page is not drawn."""
    mask = text_mask(text, size)
    top, left = round(y - size * 1.25), round(x)
    height, width = page.shape[:2]
    rows = slice(max(0, top), min(height, top + mask.shape[0]))
    columns = slice(max(0, left), min(width, left + mask.shape[1]))
    if rows.start >= rows.stop or columns.start >= columns.stop:
        return
    ink = mask[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left, None]
    page[rows, columns] = page[rows, columns] * (1 - ink) + np.array(colour) * ink


def _line(page: Floats, start: Floats, end: Floats, colour: Colour, pen: float = 1.2) -> None:
    low = np.floor(np.minimum(start, end) - pen - 1).astype(int)
    high = np.ceil(np.maximum(start, end) + pen + 1).astype(int)
    left, top = np.maximum(low, 0)
    right, bottom = np.minimum(high, [page.shape[1], page.shape[0]])
    if left >= right or top >= bottom:
        return
    pixel = np.stack(np.meshgrid(np.arange(left, right) + 0.5, np.arange(top, bottom) + 0.5), axis=-1)
    along = end - start
    part = np.clip(((pixel - start) @ along) / max(float(along @ along), 1e-9), 0, 1)
    distance = np.linalg.norm(pixel - start - part[..., None] * along, axis=-1)
    ink = np.clip(pen - distance + 0.5, 0, 1)[..., None]
    window = page[top:bottom, left:right]
    window[...] = window * (1 - ink) + np.array(colour) * ink


def _axes(page: Floats, camera: _Camera, height: int) -> None:
    origin = np.array([58.0, height - 58.0])
    for axis, (name, colour) in enumerate(
        (("x", (0.80, 0.20, 0.20)), ("y", (0.20, 0.60, 0.25)), ("z", (0.20, 0.35, 0.80)))
    ):
        direction = camera.axes[:2, axis] * np.array([1.0, -1.0])
        tip = origin + 36 * direction
        _line(page, origin, tip, colour, 1.6)
        x, y = origin + 47 * direction + np.array([-4.0, 4.0])
        _write(page, name, float(x), float(y), 8, colour)


def _ruler(page: Floats, camera: _Camera, stage: int, height: int) -> None:
    """A bar of a round length, so that the picture has a size."""
    per_pixel = _SMOOTH / camera.scale
    length = 10.0 ** np.floor(np.log10(stage * 0.2 * per_pixel))
    length *= next(f for f in (5, 2, 1) if length * f <= stage * 0.2 * per_pixel)
    right, y = stage - 40.0, height - 40.0
    left = right - length / per_pixel
    for start, end in (
        ((left, y), (right, y)),
        ((left, y - 5), (left, y + 5)),
        ((right, y - 5), (right, y + 5)),
    ):
        _line(page, np.array(start), np.array(end), _INK, 0.9)
    words = f"{length * 1e3:g} mm" if length < 1 else f"{length:g} m"
    _write(page, words, left, y - 10, 9)


def _legend(
    page: Floats, assembly: Assembly, views: Sequence[LinkView], colours: Sequence[Colour], stage: int
) -> None:
    height, width = page.shape[:2]
    left, y = stage + 28.0, 52.0
    room = width - left - 20
    _write(page, fitted(assembly.name, 15, room), left, y, 15)
    total = sum(view.props.mass for view in views if view.props is not None)
    y += 28
    links = counted(len([view for view in views if view.name]), "link")
    _write(page, f"{links}, {mass_words(total)}", left, y, 9.5, _FAINT)
    y += 40
    for number, (view, colour) in enumerate(zip(views, colours, strict=True)):
        if y > height - 125 and number < len(views) - 1:
            _write(page, f"and {len(views) - number} more", left, y, 9.5, _FAINT)
            break
        _swatch(page, left, y - 11, colour)
        _write(page, fitted(view.name or "in no link", 11, room - 30), left + 30, y, 11)
        said = mass_words(view.props.mass) if view.props is not None else "no mass"
        said = f"{said}, {len(view.instances)} {'part' if len(view.instances) == 1 else 'parts'}"
        _write(page, fitted(said, 9, room - 30), left + 30, y + 19, 9, _FAINT)
        y += 48
    _write(page, "disc: centre of mass", left, height - 52, 8.5, _FAINT)
    _write(page, "ellipsoid: equal mass and inertia", left, height - 33, 8.5, _FAINT)


def _swatch(page: Floats, left: float, top: float, colour: Colour) -> None:
    rows, columns = slice(round(top), round(top) + 16), slice(round(left), round(left) + 18)
    page[rows, columns] = colour


def mass_words(mass: float) -> str:
    """A mass with a unit that suits it: ``12.3 g``, ``1.234 kg``."""
    if 0 < mass < 1:
        return f"{mass * 1e3:.4g} g"
    return f"{mass:.4g} kg"
