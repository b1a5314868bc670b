# SPDX-License-Identifier: LGPL-2.1-or-later
"""Letters for pictures: strokes on a small grid, drawn smooth at any size.

A font file or a library for a legend of ten words would be larger than the whole preview. Letters with marks
lose them (é → e); what is not here is a box.
"""

from __future__ import annotations

import unicodedata
from functools import lru_cache
from itertools import pairwise

import numpy as np

from silo.inertia.geometry.mesh import Floats

# Each point is two digits: x 0..4, y 0..8, the base line at 2, small letters up to 6, capitals up to 8.
_STROKES = {
    "A": "02 28 42,14 34", "B": "02 08 38 47 46 35 05,35 44 43 32 02", "C": "47 38 18 07 03 12 32 43",
    "D": "02 08 28 37 46 44 33 22 02", "E": "48 08 02 42,05 35", "F": "48 08 02,05 35",
    "G": "47 38 18 07 03 12 32 43 45 25", "H": "08 02,48 42,05 45", "I": "18 38,28 22,12 32",
    "J": "38 33 22 12 03", "K": "08 02,48 04,15 42", "L": "08 02 42", "M": "02 08 25 48 42",
    "N": "02 08 42 48", "O": "18 07 03 12 32 43 47 38 18", "P": "02 08 38 47 46 35 05",
    "Q": "18 07 03 12 32 43 47 38 18,24 42", "R": "02 08 38 47 46 35 05,25 42",
    "S": "47 38 18 07 06 15 35 44 43 32 12 03", "T": "08 48,28 22", "U": "08 03 12 32 43 48",
    "V": "08 22 48", "W": "08 12 26 32 48", "X": "08 42,48 02", "Y": "08 25 48,25 22", "Z": "08 48 02 42",
    "0": "18 07 03 12 32 43 47 38 18,14 36", "1": "07 28 22,12 32", "2": "07 18 38 47 46 02 42",
    "3": "07 18 38 47 46 35 15,35 44 43 32 12 03", "4": "32 38 04 44", "5": "48 08 05 35 44 43 32 12 03",
    "6": "47 38 18 07 03 12 32 43 44 35 15 04", "7": "08 48 22",
    "8": "18 07 06 15 35 46 47 38 18,15 04 03 12 32 43 44 35", "9": "03 12 32 43 47 38 18 07 06 15 35 46",
    "a": "46 42,45 36 16 05 03 12 32 43", "b": "08 02,05 16 36 45 43 32 12 03",
    "c": "45 36 16 05 03 12 32 43", "d": "48 42,45 36 16 05 03 12 32 43",
    "e": "04 44 45 36 16 05 03 12 32 43",
    "f": "38 28 17 12,06 36", "g": "46 41 30 10 01,45 36 16 05 03 12 32 43", "h": "08 02,05 16 36 45 42",
    "i": "26 22,28 28", "j": "26 21 10 00,28 28", "k": "08 02,46 04,24 42", "l": "28 22",
    "m": "02 06,05 16 25 22,25 36 45 42", "n": "02 06,05 16 36 45 42", "o": "16 05 03 12 32 43 45 36 16",
    "p": "06 00,05 16 36 45 43 32 12 03", "q": "46 40,45 36 16 05 03 12 32 43", "r": "02 06,04 26 36",
    "s": "45 36 16 05 14 34 43 32 12 03", "t": "18 13 22 32,06 36", "u": "06 03 12 32 43,46 42",
    "v": "06 22 46", "w": "06 12 25 32 46", "x": "06 42,46 02", "y": "06 22,46 22 10 00", "z": "06 46 02 42",
    ".": "22 22", ",": "22 11", ":": "22 22,25 25", ";": "22 11,25 25", "-": "05 35", "_": "01 41",
    "+": "05 45,27 23", "/": "02 48", "\\": "08 42", "(": "38 27 23 32", ")": "18 27 23 12",
    "[": "38 18 12 32", "]": "18 38 32 12", "{": "38 28 26 15 24 22 32", "}": "18 28 26 35 24 22 12",
    "<": "47 05 43", ">": "07 45 03", "=": "04 44,06 46", "*": "05 45,17 33,37 13",
    "#": "12 18,32 38,04 44,06 46", "%": "02 48,07 08,42 43", "&": "42 07 18 27 04 03 12 22 44",
    "'": "28 26", '"': "18 16,38 36", "!": "28 24,22 22", "?": "07 18 38 47 46 25 24,22 22",
    "@": "44 35 24 33 44 46 38 18 06 04 12 32", "~": "05 16 34 45", "^": "06 28 46", "|": "28 20",
    "…": "02 02,22 22,42 42", "°": "17 28 37 26 17", "µ": "06 00,03 12 32 43,46 42", "±": "06 46,28 24,02 42",
    "×": "06 42,46 02", "²": "18 28 27 15 25", "³": "18 28 26 15,17 26", "·": "25 25", "→": "05 45,37 45 33",
    "–": "05 45", "—": "05 45",
}  # fmt: skip
ROWS = 1.8
_UNKNOWN = "02 08 48 42 02"
_SPACE = 2.4
_GAP = 1.7
_PEN = 0.42


def text_mask(text: str, height: float, pen: float = _PEN) -> Floats:
    """How much ink each pixel has, (rows, columns) 0..1; ``height`` of a capital letter in pixels.

    The first row is the top of the line, ROWS capitals high; the base line lies 1.25 capitals below it.
    """
    unit = height / 6
    parts = [_glyph(letter, round(height, 2), pen) for letter in _plain(text)]
    rows = round(height * ROWS)
    width = sum(part.shape[1] for part in parts) + max(1, round(unit))
    mask = np.zeros((rows, max(width, 1)))
    left = 0
    for part in parts:
        mask[:, left : left + part.shape[1]] = part
        left += part.shape[1]
    return mask


def fitted(text: str, height: float, room: float) -> str:
    """The text, cut with "…" where it is wider than ``room`` pixels."""
    text = unicodedata.normalize("NFC", text)
    dots = _glyph("…", round(height, 2), _PEN).shape[1]
    width, fitting = round(height / 6), 0
    for count, letter in enumerate(_plain(text), start=1):
        width += _glyph(letter, round(height, 2), _PEN).shape[1]
        if width > room:
            return text[:fitting] + "…"
        if width + dots <= room:
            fitting = count
    return text


def _plain(text: str) -> str:
    known = []
    for letter in unicodedata.normalize("NFC", text):
        if letter in _STROKES or letter.isspace():
            known.append(" " if letter.isspace() else letter)
        else:
            known.append(unicodedata.normalize("NFKD", letter)[0])
    return "".join(known)


@lru_cache(maxsize=2048)
def _glyph(letter: str, height: float, pen: float) -> Floats:
    unit = height / 6
    rows = round(height * ROWS)
    if letter == " ":
        return np.zeros((rows, round(_SPACE * unit)))
    strokes = [
        np.array([(int(point[0]), int(point[1])) for point in stroke.split()], dtype=float)
        for stroke in _STROKES.get(letter, _UNKNOWN).split(",")
    ]
    every = np.concatenate(strokes)
    low, high = every[:, 0].min(), every[:, 0].max()
    width = max(1, round((high - low + _GAP) * unit))
    x = (np.arange(width) + 0.5) / unit + low - _GAP / 2
    y = 2 + (height * 1.25 - np.arange(rows) - 0.5) / unit
    pixels = np.stack(np.meshgrid(x, y), axis=-1)
    distance = np.full((rows, width), np.inf)
    for stroke in strokes:
        for start, end in pairwise(stroke):
            distance = np.minimum(distance, _to_segment(pixels, start, end))
    ink: Floats = np.clip((pen - distance) * unit + 0.5, 0, 1)
    return ink


def _to_segment(pixels: Floats, start: Floats, end: Floats) -> Floats:
    along = end - start
    length = float(along @ along)
    part = np.clip(((pixels - start) @ along) / length, 0, 1) if length else np.zeros(pixels.shape[:2])
    result: Floats = np.linalg.norm(pixels - start - part[..., None] * along, axis=-1)
    return result
