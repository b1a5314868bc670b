# SPDX-License-Identifier: LGPL-2.1-or-later
"""Documents made to harm whoever shows them: thousands of links, markup, terminal codes, broken files."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pytest
from freecad_cases.machines import NEWEST
from gui_cases import hostile_vault
from gui_cases.window import Window

VERSIONS = NEWEST

pytestmark = [pytest.mark.freecad, pytest.mark.slow]

# What the window shows is bounded much earlier; the benchmark has ten thousand.
LINKS = 1000
WINDOWS = ("commit", "pane", "preview", "pane_after", "register")


@dataclass
class Told:
    """What the script inside told, and the FreeCAD that it ran in."""

    window: Window
    said: dict[str, Any]


@pytest.fixture(name="hostile", scope="module")
def _hostile(freecad: Window) -> Told:
    with freecad.server.client() as client:
        hostile_vault.write(freecad.vault, client, LINKS)
    return Told(freecad, freecad.run("hostile.py"))


@pytest.mark.parametrize("name", WINDOWS)
def test_text_is_shown_as_text(hostile: Told, name: str) -> None:
    """No label and no tool tip draws markup, and none holds what steers a terminal or turns text around."""
    seen = hostile.said[name]
    assert seen["drawn_as_markup"] == []
    assert seen["tips_with_markup"] == []
    assert seen["hidden"] == []


@pytest.mark.parametrize("name", [name for name in WINDOWS if name != "commit"])
def test_the_markup_can_be_read(hostile: Told, name: str) -> None:
    """It is not taken out: a person sees what the file holds."""
    assert hostile.said[name]["literal"]


@pytest.mark.parametrize("name", WINDOWS)
def test_windows_stay_small(hostile: Told, name: str) -> None:
    """However many links there are, there are only so many widgets, cells and letters."""
    seen = hostile.said[name]
    assert seen["parts"] < 400
    assert seen["texts"] < 20_000
    assert seen["longest"] <= 500


def test_what_is_broken_holds_the_bom_back(hostile: Told) -> None:
    """With some of the reasons, the number of the others, and the way to register what has no number."""
    (box,) = hostile.said["held_back"]
    assert "The file is in Silo. The BOM waits until these are mended:" in box
    assert "no<b>where</b>/ Gone0.FCStd is missing" in box
    assert "more lines; the preview shows all" in box
    assert "components have no Silo part number [Register Parts…]" in box


def test_with_consent_it_is_synced(hostile: Told) -> None:
    """The lines that have a number arrive, once each."""
    added = f"+{hostile_vault.REGISTERED} added"
    assert [box.splitlines()[1] for box in hostile.said["synced"]].count(added) == 1
    with hostile.window.server.client() as client:
        (top,) = (item for item in client.search_items("Top") if item.item_type == "assembly")
        assert len(client.get_bom(top.part_number)) == hostile_vault.REGISTERED


def test_show_selects_what_it_counts(hostile: Told) -> None:
    """In the pane the links to a missing file, in the preview the instances of a line."""
    shown = hostile.said["shown"]
    assert sorted(shown) == sorted(f"L{number}" for number in range(17, LINKS, 357))
    assert hostile.said["selected"] == len(shown)


def test_the_report_view_is_short_and_harmless(hostile: Told) -> None:
    """Consolidation warnings of two syncs, and two errors."""
    lines = hostile.said["report"]
    assert len(lines) < 60
    assert not [line for line in lines if not line.isprintable()]
    assert any("<b>live</b>" in line for line in lines)


def test_the_terminal_gets_no_codes_from_us(hostile: Told) -> None:
    """FreeCAD writes to the terminal what the report view shows."""
    log = (hostile.window.folder / "freecad.log").read_text(errors="replace")
    assert not [line for line in log.split("\n") if "Silo" in line and not line.isprintable()]
