# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is written on a preview: names and masses, axes, a ruler."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from silo.inertia.geometry.mesh import Floats
from silo.inertia.model import Assembly
from silo.inertia.preview.camera import SMOOTH, Camera
from silo.inertia.preview.lettering import fitted, text_mask
from silo.inertia.preview.scene import Colour, LinkView
from silo.inertia.wording import counted

_INK: Colour = (0.13, 0.15, 0.18)
_FAINT: Colour = (0.45, 0.48, 0.52)


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


def draw_axes(page: Floats, camera: Camera, height: int) -> None:
    """The directions x, y and z, in the lower left corner."""
    origin = np.array([58.0, height - 58.0])
    for axis, (name, colour) in enumerate(
        (("x", (0.80, 0.20, 0.20)), ("y", (0.20, 0.60, 0.25)), ("z", (0.20, 0.35, 0.80)))
    ):
        direction = camera.axes[:2, axis] * np.array([1.0, -1.0])
        tip = origin + 36 * direction
        _line(page, origin, tip, colour, 1.6)
        x, y = origin + 47 * direction + np.array([-4.0, 4.0])
        _write(page, name, float(x), float(y), 8, colour)


def draw_ruler(page: Floats, camera: Camera, stage: int, height: int) -> None:
    """A bar of a round length, so that the picture has a size."""
    per_pixel = SMOOTH / camera.scale
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


def draw_legend(
    page: Floats, assembly: Assembly, views: Sequence[LinkView], colours: Sequence[Colour], stage: int
) -> None:
    """Names, masses and numbers of parts, right of ``stage``."""
    height, width = page.shape[:2]
    left, y = stage + 28.0, 52.0
    room = width - left - 20
    _write(page, fitted(assembly.name, 15, room), left, y, 15)
    total = sum(view.props.mass for view in views if view.props is not None)
    y += 28
    links = counted(len([view for view in views if view.name]), "link")
    weighed = any(view.props is not None for view in views)
    _write(page, f"{links}, {mass_words(total)}" if weighed else links, left, y, 9.5, _FAINT)
    y += 40
    for number, (view, colour) in enumerate(zip(views, colours, strict=True)):
        if y > height - 125 and number < len(views) - 1:
            _write(page, f"and {len(views) - number} more", left, y, 9.5, _FAINT)
            break
        _swatch(page, left, y - 11, colour)
        _write(page, fitted(view.name or "in no link", 11, room - 30), left + 30, y, 11)
        said = counted(len(view.instances), "part")
        if weighed:
            said = f"{mass_words(view.props.mass) if view.props is not None else 'no mass'}, {said}"
        _write(page, fitted(said, 9, room - 30), left + 30, y + 19, 9, _FAINT)
        y += 48
    if weighed:
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
