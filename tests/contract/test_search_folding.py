# SPDX-License-Identifier: LGPL-2.1-or-later
"""What people type for one thing finds it, in items, look-alikes and tables alike."""

from __future__ import annotations

import itertools
import uuid
from urllib.parse import quote

import pytest
from hunting import BOTH
from server_testing import Api

from silo.bom.text import name_key
from silo_server.services.search import fits

# Ways to write one thing.
SAME = [
    ("Screw M3x6", "Screw M3X6", "Screw M3×6", "Screw M3 x 6", "screw m3 × 6"),
    ("Shim 2,5", "Shim 2.5"),
    ("Screw ISO4762", "Screw ISO 4762", "screw iso-4762"),
    ("Tube Ø12", "Tube ⌀12", "Tube ø 12", "Tube ∅12"),
    ("Ventil Größe 3", "ventil GRÖSSE 3", "Ventil Grosse 3"),
]


@BOTH
@pytest.mark.parametrize("ways", SAME, ids=[ways[0] for ways in SAME])
def test_they_find_each_other(api: Api, ways: tuple[str, ...]) -> None:
    """Each way in a name or a description is found by each other way, typed whole."""
    mark = "q" + uuid.uuid4().hex[:10]
    for number, way in enumerate(ways):
        api.item(f"{mark}-A{number}", name=f"{way} {mark}", description="none")
        api.item(f"{mark}-B{number}", name=mark, description=f"of a {way}")
    for typed in ways:
        found = api.get(f"/api/items/search?limit=100&q={quote(f'{typed} {mark}')}")
        numbers = {item["part_number"].removeprefix(mark) for item in found}
        assert numbers == {f"-{kind}{number}" for kind in "AB" for number in range(len(ways))}, typed


@BOTH
@pytest.mark.parametrize("ways", SAME[:4], ids=[ways[0] for ways in SAME[:4]])
def test_they_look_alike(api: Api, ways: tuple[str, ...]) -> None:
    """A component of one of these names may be an item of another."""
    mark = "q" + uuid.uuid4().hex[:10]
    numbers = {api.item(name=f"{mark} {way}") for way in ways}
    wanted = [{"name": f"{mark} {way}.FCStd"} for way in ways]
    said = api.good("POST", "/api/items/look-alikes", {"wanted": wanted})["look_alikes"]
    assert [{like["part_number"] for like in likes} for likes in said] == [numbers] * len(ways)


@pytest.mark.parametrize("ways", SAME, ids=[ways[0] for ways in SAME])
def test_tables_are_filtered_alike(ways: tuple[str, ...]) -> None:
    """Trees, BOMs and lists on pages."""
    for typed, written in itertools.product(ways, ways):
        assert fits(typed)("x", written, None), (typed, written)


def test_what_differs_stays_apart() -> None:
    """Only how a size is written is folded, and not the size."""
    names = ["M3x6", "M3x60", "M36", "M3 6", "2.5", "25", "ISO 4762", "ISO 4763", "Box 6", "Bo x6"]
    assert len({name_key(name) for name in names}) == len(names)
    assert not fits("M3x6")("M3x5")
