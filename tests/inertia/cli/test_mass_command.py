# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod mass`` on the example gearbox: shapes and materials of FreeCAD files, and back to Silo."""

from __future__ import annotations

import shutil
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from server_testing import sqlite_database

from silo.api.client import SiloClient
from silo_server.run import running_server

Run = Callable[..., Any]
GEARBOX = Path(__file__).parents[3] / "examples" / "gearbox"

# The ids that FreeCAD 1.x writes into files for these materials.
CARDS = {
    "Aluminum 6061-T6": ("68b152b2-fd5e-4f10-8db0-1a2df3fe0fda", 2700),
    "1C45": ("958b7a5c-4764-4a2f-a450-2153a41fb5ec", 7800),
}


@pytest.fixture
def gearbox(tmp_path: Path) -> Path:
    """The top file of a copy of the example."""
    folder = tmp_path / "gearbox"
    shutil.copytree(GEARBOX, folder, ignore=shutil.ignore_patterns("*.py", "__pycache__"))
    return folder / "TopAssembly.FCStd"


@pytest.fixture
def cards(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A material library as an installed FreeCAD has it."""
    folder = tmp_path / "cards"
    folder.mkdir()
    for name, (uuid, density) in CARDS.items():
        general = f'---\nGeneral:\n  UUID: "{uuid}"\n  Name: "{name}"\n'
        text = f'{general}Models:\n  Solid:\n    Density: "{density} kg/m^3"\n'
        (folder / f"{name}.FCMat").write_text(text, "utf-8")
    monkeypatch.setenv("FREECAD_MATERIALS", str(folder))
    return folder


def by_name(data: Any) -> dict[str, Any]:
    (link,) = data["links"]
    return {part["name"]: part for part in link["parts"]}


def test_masses_of_a_freecad_assembly(run: Run, gearbox: Path, cards: Path) -> None:
    """Each part its material's density times its volume, each as often as the BOM counts it."""
    data = run("mass", gearbox, "--json").json()
    parts = by_name(data)
    counted = {name: part["quantity"] for name, part in parts.items() if part["volume"] > 0}
    assert counted == {
        "Base Plate": 1, "Housing": 2, "Shaft": 2, "Gear": 8, "Cover": 1, "M8x20 Bolt": 12, "Motor Mount": 1,
    }  # fmt: skip
    for part in parts.values():
        if part["volume"] > 0:
            assert part["mass"] == pytest.approx(part["volume"] * part["density"])
            assert part["density"] == (2700 if part["material_name"] == "Aluminum 6061-T6" else 7800)
    assert data["total"]["mass"] == pytest.approx(sum(part["total_mass"] for part in parts.values()))


def test_without_a_material_library_parts_are_zero_and_named(run: Run, gearbox: Path) -> None:
    """Nothing is guessed; --default-density is the user's word."""
    data = run("mass", gearbox, "--json").json()
    assert data["total"]["mass"] == 0
    assert {w["code"] for w in data["warnings"]} >= {"no_mass_no_material", "material"}
    assert not any(w["code"] == "zero_mass_link" for w in data["warnings"])
    guessed = run("mass", gearbox, "--json", "--default-density", "1000").json()
    assert guessed["total"]["mass"] > 1
    (words,) = {w["message"] for w in guessed["warnings"] if w["code"] == "no_bom"}
    assert words.startswith("The document assigns no material with a density; the default density (1000")


def test_a_bom_outranks_the_document(run: Run, gearbox: Path, cards: Path, tmp_path: Path) -> None:
    """Weighed masses from a BOM go before densities."""
    bom = tmp_path / "bom.csv"
    bom.write_text("Name,Quantity,Material,Mass\nM8x20 Bolt,12,,0.0163 kg\n", "utf-8")
    parts = by_name(run("mass", gearbox, "--bom", bom, "--json").json())
    assert parts["M8x20 Bolt"]["mass"] == 0.0163
    assert parts["M8x20 Bolt"]["source"] == "bom_mass"
    assert parts["Gear"]["source"] == "step_density"


def test_push_uses_the_identities_in_the_files(
    run: Run, gearbox: Path, cards: Path, silo: SiloClient
) -> None:
    """Registered parts get their masses by identity, and the assembly's roll-up is our total."""
    assert run("register", gearbox, "--yes").code == 0
    ran = run("mass", gearbox, "--push", "--json")
    assert ran.code == 0, ran.err
    parts = by_name(ran.json())
    found = {item.name: item for item in silo.search_items("", limit=100)}
    assert found["Gear"].properties["mass_kg"] == pytest.approx(parts["Gear"]["mass"])
    assert found["Gear"].properties["volume_m3"] == pytest.approx(parts["Gear"]["volume"])
    assert "had these numbers already" in run("mass", gearbox, "--push", "--json").err


@pytest.fixture(name="silo")
def _silo(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[SiloClient]:
    token = "silo_" + "c1" * 20
    with running_server(sqlite_database(tmp_path / "silo.db"), token=token) as server:
        monkeypatch.setenv("SILO_API_URL", server.base_url)
        monkeypatch.setenv("SILO_API_TOKEN", token)
        with SiloClient(server.base_url, token) as client:
            yield client


def test_a_document_without_parts_is_reported(run: Run, tmp_path: Path) -> None:
    """Sketches and sheets only: no mass, said in plain words and not as a pattern of a link map."""
    (tmp_path / "Document.xml").write_text(
        '<Document SchemaVersion="4" ProgramVersion="1.0" FileVersion="1"><Properties Count="0"/>'
        '<Objects Count="0"/><ObjectData Count="0"/></Document>', "utf-8",
    )  # fmt: skip
    with zipfile.ZipFile(tmp_path / "empty.FCStd", "w") as file:
        file.write(tmp_path / "Document.xml", "Document.xml")
    ran = run("mass", tmp_path / "empty.FCStd", "--json")
    assert ran.code == 0, ran.err
    data = ran.json()
    assert data["total"]["mass"] == 0
    (warning,) = data["warnings"]
    assert warning["code"] == "no_geometry"
    assert "nothing to weigh" in warning["message"]


def test_mistakes_are_one_plain_sentence(run: Run, tmp_path: Path) -> None:
    """A file that is not there, and a density of nothing."""
    for words, message in (
        ([tmp_path / "none.FCStd"], "none.FCStd"),
        (["x.FCStd", "--default-density", "-1"], "25 to 23000"),
    ):
        ran = run("mass", *words)
        assert ran.code == 2
        assert message in ran.err
        assert len(ran.err.strip().splitlines()) == 1


def test_what_cannot_be_read_is_no_success(run: Run, gearbox: Path) -> None:
    """A linked file that is gone or damaged ends with 1, also without --strict; with all files there, 0."""
    assert run("mass", gearbox, "--default-density", "1000").code == 0
    gear = next(gearbox.parent.rglob("Gear.FCStd"))
    for content in (b"no FreeCAD file", None):
        gear.write_bytes(content) if content else gear.unlink()
        ran = run("mass", gearbox, "--default-density", "1000", "--json")
        assert (ran.code, "in no mass: 1 warning (not_read)" in ran.err) == (1, True)
        assert "not_read" in [warning["code"] for warning in ran.json()["warnings"]]
    codes = {warning["code"] for warning in ran.json()["warnings"]}
    assert (
        run(
            "mass", gearbox, "--default-density", "1000", "--strict", *(f"--allow={code}" for code in codes)
        ).code
        == 0
    )
