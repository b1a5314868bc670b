# SPDX-License-Identifier: LGPL-2.1-or-later
"""The colours of a model, against the picture that FreeCAD itself takes."""

from __future__ import annotations

import numpy as np
import pytest
from drawn import drawn
from freecad_cases.machines import MOSTLY_ENDS
from gui_cases.window import Window
from PIL import Image

VERSIONS = MOSTLY_ENDS

pytestmark = [pytest.mark.freecad, pytest.mark.slow]

# Of 255, for a colour that is stored in 8 bits and made linear and back.
NEAR = 6
# A colour that covers less of a picture is the border of a body.
LEAST = 0.05
WHITE = np.array([255.0, 255.0, 255.0])


def shown(window: Window, name: str) -> list[np.ndarray]:
    """The colours in the pictures of an object, but the background."""
    found: list[np.ndarray] = []
    for side in range(6):
        pixels = np.asarray(Image.open(window.folder / f"{name}-{side}.png").convert("RGB")).reshape(-1, 3)
        colours, counts = np.unique(pixels, axis=0, return_counts=True)
        found += [one for one in colours[counts > LEAST * len(pixels)] if abs(one - WHITE).max() > NEAR]
    return found


def over_white(colour: np.ndarray) -> list[np.ndarray]:
    """How a colour looks before white: its front alone, and with its back behind it."""
    alpha = colour[3]
    return [255 * colour[:3] * a + WHITE * (1 - a) for a in {alpha, 1 - (1 - alpha) ** 2}]


def test_each_object_has_the_colours_that_freecad_shows(freecad: Window) -> None:
    """Of each face, of a body, of a link and its elements over their target, and what is clear."""
    told = freecad.run("colours.py")
    wanted = ["Plain", "Faces", "Clear", "Body", "Link", "Over", "OverClear", "OverFaces"]
    wanted += ["Row", "RowOver", "ShownRow", "ShownRowOver"]
    assert sorted(told["names"]) == sorted(wanted)
    mine: dict[str, list[np.ndarray]] = {}
    for one in drawn(freecad.vault / "Colours.FCStd")[0]:
        given = [one.colour] if isinstance(one.colour[0], float | int) else one.colour
        # A GLB has linear colours; the override of a link is as a screen shows it.
        power = np.array([1 / 2.2] * 3 + [1]) if given is one.colour else np.ones(4)
        mine.setdefault(one.path[0].partition(".")[0], []).extend(np.array(each) ** power for each in given)
    assert sorted(mine) == sorted(wanted)
    assert [len(mine[name]) for name in ("Plain", "Faces", "Over", "Row")] == [1, 6, 1, 2]
    off = {}
    for name in wanted:
        theirs = shown(freecad, name)
        looks = [over_white(colour) for colour in mine[name]]
        extra = [c for c in theirs if min(abs(c - one).max() for both in looks for one in both) > NEAR]
        lost = [both for both in looks if min(abs(c - one).max() for one in both for c in theirs) > NEAR]
        if extra or lost:
            off[name] = f"FreeCAD shows {extra}, the model has {lost}"
    assert off == {}
