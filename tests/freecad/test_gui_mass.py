# SPDX-License-Identifier: LGPL-2.1-or-later
"""The mass of an assembly in FreeCAD's window: the table, the clipboard, progress and cancel."""

from __future__ import annotations

from typing import Any

import pytest
from freecad_cases.machines import NEWEST
from gui_cases.window import Window

VERSIONS = NEWEST

pytestmark = [pytest.mark.freecad, pytest.mark.slow]


@pytest.fixture(name="told", scope="module")
def _told(freecad: Window) -> dict[str, Any]:
    return freecad.run("mass.py")


def test_the_table(told: dict[str, Any]) -> None:
    """The heaviest first, markup as text, what has no material named; nothing has to be saved before."""
    assert told["title"] == "Mass of Machine"
    first, second = told["rows"]
    assert first == ["<b>Shaft</b>", "2", "47.4 g", "94.8 g", "6", "Stuff (7900 kg/m³)", ""]
    assert second[:5] == ["Cover", "1", "–", "–", "0.7854"]
    assert second[6] == "no material with a density"
    assert told["texts"][0] == "94.8 g in 3 pieces, centre of mass at 5.00, 10.00, 45.00 mm"
    assert told["texts"][1] == "1 part has no mass; it is missing from the sum."
    assert told["empty"] == ["No part of this assembly has a material with a density."]


def test_the_clipboard_is_for_a_spreadsheet(told: dict[str, Any]) -> None:
    """Tabs between cells, plain numbers in kg."""
    head, first, _ = told["copied"].splitlines()
    assert head.split("\t")[2:4] == ["Mass of one, kg", "Mass, kg"]
    assert first.split("\t")[:4] == ["<b>Shaft</b>", "2", "0.0474", "0.0948"]


def test_a_long_one_lets_the_window_live_and_can_be_cancelled(told: dict[str, Any]) -> None:
    """Four plates with 144 holes each; the window's own timer runs meanwhile."""
    volume = (160 * 160 * 5 - 144 * 3.141592653589793 * 9 * 5) / 1000
    assert {float(row[4]) for row in told["heavy"]} == {float(f"{volume:.5g}")}
    assert told["ticks"] > 5
    assert told["cancelled"]
    assert not told["after_cancel"]
