# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD's material cards: both formats, their traps, and a real installation where there is one."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
import trimesh

from silo.inertia.bom.parser import BOMParser
from silo.inertia.calculation import calculate
from silo.inertia.geometry import read
from silo.inertia.geometry.options import ReadOptions
from silo.inertia.materials.cards import card_folders, cards_in, materials_of
from silo.inertia.materials.files import package_rows
from silo.inertia.materials.table import MaterialTable
from silo.inertia.output.json import report_json
from silo.inertia.output.markdown import report_markdown
from silo.inertia.task import Task

INI = """; (c) somebody
[General]
Name = Steel-Generic
Description = generic
[Mechanical]
Density = 7900 kg/m^3
"""
YAML = """---
General:
  UUID: "68b152b2-fd5e-4f10-8db0-1a2df3fe0fda"
  Name: "Aluminum 6061-T6"
Models:
  LinearElastic:
    UUID: '7b561d1d-fb9b-44f6-9da9-56a4f74d7536'
    Density: "2700 kg/m^3"
"""
HEIR = """---
General:
  UUID: "11111111-fd5e-4f10-8db0-1a2df3fe0fda"
  Name: "Aluminum heir"
Inherits:
  Aluminum:
    UUID: "68b152b2-fd5e-4f10-8db0-1a2df3fe0fda"
"""


def cards(tmp_path: Path, **texts: str) -> dict[str, float]:
    for name, text in texts.items():
        (tmp_path / f"{name}.FCMat").write_text(text, "utf-8")
    return {card.name: card.density for card in materials_of(cards_in([tmp_path]))}


def test_both_formats_and_inheritance(tmp_path: Path) -> None:
    """INI of 0.20, YAML of 1.0, and a card that inherits its density."""
    found = cards(tmp_path, a=INI, b=YAML, c=HEIR)
    assert found == {"Steel-Generic": 7900, "Aluminum 6061-T6": 2700, "Aluminum heir": 2700}


@pytest.mark.parametrize("density", ["1 kg/m^3", "0 kg/m^3", "1.204 kg/m^3", "x,000 kg/m^3"])
def test_cards_that_are_no_material(tmp_path: Path, density: str) -> None:
    """FreeCAD 1.0's "Default" (1 kg/m^3) and "None" (0), air, and 0.20's unreadable graphite."""
    assert cards(tmp_path, a=YAML.replace("2700 kg/m^3", density)) == {}


def test_an_id_belongs_to_the_first_card_that_has_it(tmp_path: Path) -> None:
    """The table and the ids in FCStd files are read from the same cards, by the same rules."""
    heir, again = HEIR, YAML.replace("2700", "7000").replace("6061-T6", "copied")
    assert cards(tmp_path, a=YAML, b=again, c=heir)["Aluminum heir"] == 2700
    assert [card.uuid[:8] for card in cards_in([tmp_path])] == ["68b152b2", "68b152b2", "11111111"]


def test_a_ring_of_inheritance_ends(tmp_path: Path) -> None:
    """Two cards that inherit from each other have no density, and the reader returns."""
    other = (
        HEIR.replace("68b152b2", "22222222", 1)
        .replace("11111111", "68b152b2")
        .replace("22222222", "11111111")
    )
    assert cards(tmp_path, a=HEIR, b=other) == {}


def test_folders_by_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """FREECAD_MATERIALS comes first; folders that do not exist are left out."""
    monkeypatch.setenv("FREECAD_MATERIALS", f"{tmp_path}:{tmp_path}/none")
    assert card_folders()[0] == tmp_path
    assert tmp_path / "none" not in card_folders()


@pytest.mark.freecad
def test_a_real_freecad() -> None:
    """An installed FreeCAD's cards: steel is there, and nothing has the density of a gas."""
    roots = [*Path.home().glob(".cache/silo-mod/freecad/*/usr/share/freecad/Mod/Material"), *card_folders()]
    if not roots:
        missing = "no FreeCAD with material cards on this machine"
        pytest.fail(missing) if os.environ.get("SILO_REQUIRE_FREECAD") == "1" else pytest.skip(missing)
    for root in roots:
        found = {card.name: card.density for card in materials_of(cards_in([root]))}
        assert len(found) > 100
        assert found["Steel-Generic"] == pytest.approx(7900)
        assert "Default" not in found
        assert min(found.values()) > 5


@pytest.mark.parametrize("with_card", [True, False])
def test_a_report_says_which_card_a_material_took(tmp_path: Path, with_card: bool) -> None:
    """The same BOM weighs less on a machine without FreeCAD, so a reader must see what it rests on."""
    card = tmp_path / "Unobtainium.FCMat"
    card.write_text(INI.replace("Steel-Generic", "Unobtainium").replace("7900", "5000"), "utf-8")
    found = materials_of(cards_in([tmp_path])) if with_card else []
    trimesh.creation.box((0.1, 0.1, 0.1)).export(tmp_path / "block.stl")
    bom = tmp_path / "bom.csv"
    bom.write_text("Name,Material\nblock,Unobtainium\n", "utf-8")
    options = ReadOptions(isolate=False, cache=False, mesh_unit="m")
    task = Task(MaterialTable((package_rows(),), lambda: found))
    report = calculate(read(tmp_path / "block.stl", options=options), BOMParser().parse(bom), task)
    (part,) = next(iter(report.links.values())).parts
    assert part.total_mass == pytest.approx(5.0 if with_card else 1.0)
    text = report_markdown(report)
    assert ("Unobtainium → FreeCAD card Unobtainium.FCMat" in text) is with_card
    assert ("FreeCAD card Unobtainium.FCMat" in report_json(report)) is with_card
    assert ("unknown_material" in text) is not with_card
