# SPDX-License-Identifier: LGPL-2.1-or-later
"""A preview as a picture: the links from above and aside, drawn in software.

Bodies are shaded and outlined as in a technical illustration. Ellipsoids shine through them, for they mostly
lie inside; the mark of a centre of mass is the usual quartered disc, and always on top.
"""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from silo.bom.errors import InputError
from silo.inertia.geometry.mesh import Floats, simplified
from silo.inertia.model import Assembly
from silo.inertia.output.files import write_whole
from silo.inertia.preview.camera import SMOOTH, Camera, camera_for
from silo.inertia.preview.glb import write_glb
from silo.inertia.preview.legend import draw_axes, draw_legend, draw_ruler
from silo.inertia.preview.raster import Canvas
from silo.inertia.preview.scene import (
    UNCLAIMED,
    Colour,
    LinkView,
    colour_of,
    inertia_ellipsoid,
    meshes_of,
    views_of,
)
from silo.inertia.preview.shading import Shaded, shaded
from silo.inertia.report import InertiaReport

_LEGEND = 0.27
"""Share of the width that the legend has."""


def write_picture(
    assembly: Assembly, views: Sequence[LinkView], *, width: int = 1400, height: int = 900
) -> bytes:
    """A PNG of the links, with a legend of names and masses."""
    stage = round(width * (1 - _LEGEND))
    camera = camera_for(assembly, views, stage * SMOOTH, height * SMOOTH)
    colours = [UNCLAIMED if v.props is None and not v.name else colour_of(n) for n, v in enumerate(views)]
    canvas, owner = _bodies(assembly, views, camera, stage * SMOOTH, height * SMOOTH)
    image = _shaded_image(canvas, owner, colours)
    page = np.ones((height, width, 3))
    page[:, :stage] = image.reshape(height, SMOOTH, stage, SMOOTH, 3).mean(axis=(1, 3))
    depth = canvas.depth[::SMOOTH, ::SMOOTH].astype(np.float64)
    # Many ellipsoids over each other would hide the parts; then their rims alone must show them.
    fill = min(1.0, 5 / max(len(views), 1))
    for view, colour in zip(views, colours, strict=True):
        _blend_ellipsoid(page, depth, camera, view, colour, fill)
    page[:, stage:] = (0.965, 0.97, 0.975)
    for view in views:
        _mark_centre(page, camera, view)
    picture = Image.fromarray((np.clip(page, 0, 1) * 255 + 0.5).astype(np.uint8))
    draw = ImageDraw.Draw(picture)
    draw_axes(draw, camera, height)
    draw_ruler(draw, camera, stage, height)
    draw_legend(draw, assembly, views, colours, stage)
    data = BytesIO()
    picture.save(data, "PNG")
    return data.getvalue()


def _bodies(
    assembly: Assembly, views: Sequence[LinkView], camera: Camera, width: int, height: int
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
    page: Floats, depth: Floats, camera: Camera, view: LinkView, colour: Colour, fill: float
) -> None:
    """An ellipsoid over the finished picture, ray by ray: a parallel ray meets a quadric in closed form."""
    shape = inertia_ellipsoid(view.props) if view.props is not None else None
    if shape is None or shape.radii.max() * camera.scale < 1:
        return
    scale = camera.scale / SMOOTH
    turn = camera.axes @ shape.axes
    radii = np.maximum(shape.radii, shape.radii.max() * 1e-3)
    quadric = (turn / radii**2) @ turn.T
    x0, y0, z0 = camera.pixels(shape.centre[None])[0] / np.array([SMOOTH, SMOOTH, 1.0])
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


def _mark_centre(page: Floats, camera: Camera, view: LinkView) -> None:
    if view.props is None or view.props.mass <= 0:
        return
    x, y, _ = camera.pixels(view.props.com[None])[0] / SMOOTH
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


def write_preview(report: InertiaReport, assembly: Assembly, path: Path) -> None:
    """Draw the links of a report with their centres of mass and ellipsoids: ``.glb`` or ``.png`` by suffix.

    Raises InputError for another suffix and where the file cannot be written.
    """
    write_whole(path, preview_bytes(assembly, views_of(report, assembly), path.suffix))


def preview_bytes(assembly: Assembly, views: Sequence[LinkView], suffix: str) -> bytes:
    """The preview as ``.glb`` or ``.png``. InputError for another suffix."""
    if suffix.lower() == ".glb":
        return write_glb(assembly, views)
    if suffix.lower() == ".png":
        return write_picture(assembly, views)
    raise InputError(f"a preview is a .glb or a .png file, got '{suffix}'")
