# SPDX-License-Identifier: LGPL-2.1-or-later
"""Text on pictures, through Pillow.

The font is M PLUS 1p (fonts/, from npm's ``@fontsource/m-plus-1p``): Latin, Greek, Cyrillic, Japanese and
most Chinese characters. What it lacks is looked for in fonts of the system, by their usual names.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator
from functools import cache
from importlib import resources
from io import BytesIO
from itertools import groupby

from PIL import ImageDraw, ImageFont

from silo.inertia.preview.scene import Colour

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
    """Stretches of text that one font has. A letter that none has is shown as a box."""
    spaced = (" " if c.isspace() else c for c in unicodedata.normalize("NFC", text))
    letters = (c if _font_for(c) is not None else "□" for c in spaced if c.isprintable())
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
