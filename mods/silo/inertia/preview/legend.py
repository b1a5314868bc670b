# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is written on a preview: names and masses, axes, a ruler."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator, Sequence
from functools import cache
from importlib import resources
from io import BytesIO
from itertools import groupby

import numpy as np
from PIL import ImageDraw, ImageFont

from silo.inertia.model import Assembly
from silo.inertia.preview.camera import SMOOTH, Camera
from silo.inertia.preview.scene import Colour, LinkView
from silo.inertia.wording import counted

Font = ImageFont.FreeTypeFont

_OURS = tuple(
    f"m-plus-1p-{part}-400-normal.woff2" for part in ("latin", "latin-ext", "greek", "cyrillic", "japanese")
)
_SYSTEM = (
    "DejaVuSans.ttf", "NotoSansCJK-Regular.ttc", "NotoSans-Regular.ttf", "NanumGothic.ttf", "malgun.ttf",
    "msyh.ttc", "AppleSDGothicNeo.ttc", "Arial Unicode.ttf",
)  # fmt: skip
_CAPITAL = 0.74
"""Height of a capital letter, in sizes of the font."""

_NOWHERE = "\U0010ffff"
"""A character that no font has: its picture is what a font shows for one that it lacks."""


def write(draw: ImageDraw.ImageDraw, text: str, x: float, y: float, size: float, colour: Colour) -> None:
    """Text from ``x`` on, with its base line at ``y``; ``size``: height of a capital letter in pixels."""
    fill = tuple(round(255 * c) for c in colour)
    for font, run in _runs(text, _points(size)):
        draw.text((x, y), run, font=font, fill=fill, anchor="ls")
        x += font.getlength(run)


def width_of(text: str, size: float) -> float:
    """[pixels]"""
    return sum(font.getlength(run) for font, run in _runs(text, _points(size)))


def fitted(text: str, size: float, room: float) -> str:
    """The text, cut with "…" where it is wider than ``room`` pixels."""
    text = unicodedata.normalize("NFC", text)
    if width_of(text, size) <= room:
        return text
    fitting = text[: int(room)]  # no letter is narrower than a pixel
    while fitting and width_of(fitting + "…", size) > room:
        fitting = fitting[:-1]
    return fitting + "…"


def _points(size: float) -> int:
    return max(1, round(size / _CAPITAL))


def _runs(text: str, points: int) -> Iterator[tuple[Font, str]]:
    """Stretches of text that one font has. A letter that none has is a box, or "?" without one."""
    unknown = "□" if _font_for("□") is not None else "?"
    spaced = (" " if c.isspace() else c for c in unicodedata.normalize("NFC", text))
    letters = (c if _font_for(c) is not None else unknown for c in spaced if c.isprintable())
    for number, run in groupby(letters, key=_font_for):
        yield _font(number or 0, points), "".join(run)


@cache
def _font_for(letter: str) -> int | None:
    """Number of the first font that has this letter."""
    for number in range(len(_OURS) + len(_SYSTEM)):
        try:
            font = _font(number, 24)
        except OSError:
            continue
        if letter == " " or bytes(font.getmask(letter)) != _missing(number):
            return number
    return None


@cache
def _missing(number: int) -> bytes:
    return bytes(_font(number, 24).getmask(_NOWHERE))


@cache
def _font(number: int, points: int) -> Font:
    """Raises OSError where the system has no such font."""
    if number >= len(_OURS):
        return ImageFont.truetype(_SYSTEM[number - len(_OURS)], points)
    return ImageFont.truetype(BytesIO(_bytes(_OURS[number])), points)


@cache
def _bytes(name: str) -> bytes:
    return (resources.files("silo.inertia.preview") / "fonts" / name).read_bytes()


_INK: Colour = (0.13, 0.15, 0.18)
_FAINT: Colour = (0.45, 0.48, 0.52)


def draw_axes(draw: ImageDraw.ImageDraw, camera: Camera, height: int) -> None:
    """The directions x, y and z, in the lower left corner."""
    origin = np.array([58.0, height - 58.0])
    for axis, (name, colour) in enumerate(
        (("x", (0.80, 0.20, 0.20)), ("y", (0.20, 0.60, 0.25)), ("z", (0.20, 0.35, 0.80)))
    ):
        direction = camera.axes[:2, axis] * np.array([1.0, -1.0])
        tip = origin + 36 * direction
        draw.line([*origin, *tip], fill=_rgb(colour), width=3)
        x, y = origin + 47 * direction + np.array([-4.0, 4.0])
        write(draw, name, float(x), float(y), 8, colour)


def draw_ruler(draw: ImageDraw.ImageDraw, camera: Camera, stage: int, height: int) -> None:
    """A bar of a round length, so that the picture has a size."""
    per_pixel = SMOOTH / camera.scale
    length = 10.0 ** np.floor(np.log10(stage * 0.2 * per_pixel))
    length *= next(f for f in (5, 2, 1) if length * f <= stage * 0.2 * per_pixel)
    right, y = stage - 40.0, height - 40.0
    left = right - length / per_pixel
    for line in ((left, y, right, y), (left, y - 5, left, y + 5), (right, y - 5, right, y + 5)):
        draw.line(line, fill=_rgb(_INK), width=2)
    words = f"{length * 1e3:g} mm" if length < 1 else f"{length:g} m"
    write(draw, words, left, y - 10, 9, _INK)


def draw_legend(
    draw: ImageDraw.ImageDraw,
    assembly: Assembly,
    views: Sequence[LinkView],
    colours: Sequence[Colour],
    stage: int,
) -> None:
    """Names, masses and numbers of parts, right of ``stage``."""
    width, height = draw.im.size
    left, y = stage + 28.0, 52.0
    room = width - left - 20
    write(draw, fitted(assembly.name, 15, room), left, y, 15, _INK)
    total = sum(view.props.mass for view in views if view.props is not None)
    y += 28
    links = counted(len([view for view in views if view.name]), "link")
    weighed = any(view.props is not None for view in views)
    write(draw, f"{links}, {mass_words(total)}" if weighed else links, left, y, 9.5, _FAINT)
    y += 40
    for number, (view, colour) in enumerate(zip(views, colours, strict=True)):
        if y > height - 125 and number < len(views) - 1:
            write(draw, f"and {len(views) - number} more", left, y, 9.5, _FAINT)
            break
        draw.rectangle((left, y - 13, left + 17, y + 3), fill=_rgb(colour))
        write(draw, fitted(view.name or "in no link", 11, room - 30), left + 30, y, 11, _INK)
        said = counted(len(view.instances), "part")
        if weighed:
            said = f"{mass_words(view.props.mass) if view.props is not None else 'no mass'}, {said}"
        write(draw, fitted(said, 9, room - 30), left + 30, y + 19, 9, _FAINT)
        y += 48
    if weighed:
        write(draw, "disc: centre of mass", left, height - 52, 8.5, _FAINT)
        write(draw, "ellipsoid: equal mass and inertia", left, height - 33, 8.5, _FAINT)


def _rgb(colour: Colour) -> tuple[int, ...]:
    return tuple(round(255 * c) for c in colour)


def mass_words(mass: float) -> str:
    """A mass with a unit that suits it: ``12.3 g``, ``1.234 kg``."""
    if 0 < mass < 1:
        return f"{mass * 1e3:.4g} g"
    return f"{mass:.4g} kg"
