# SPDX-License-Identifier: LGPL-2.1-or-later
"""The gearbox example is the assembly of the specification's §3, as files and in FreeCAD."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest
from freecad_cases import answers, machines
from freecad_cases.machines import REPOSITORY

from silo.bom.entry import Extraction
from silo.bom.walk.links import extract
from silo.bom.walk.roots import choose_assembly
from silo.fcstd import Library
from silo.freecads.run import run_freecad

EXAMPLE = REPOSITORY / "examples" / "gearbox"
TOP = EXAMPLE / "TopAssembly.FCStd"
FILES = sorted(EXAMPLE.rglob("*.FCStd"))

GEARBOX = {
    "parts/Housing.FCStd#Housing": 1,
    "parts/Gear.FCStd#Gear": 4,
    "parts/Shaft.FCStd#Shaft": 1,
}
WANTED = {
    "parts/BasePlate.FCStd#BasePlate": 1,
    "Gearbox.FCStd#Gearbox": (2, GEARBOX),
    "parts/Cover.FCStd#Cover": 1,
    "parts/M8x20Bolt.FCStd#M8x20Bolt": 12,
    "parts/MotorMount.FCStd#MotorMount": 1,
}


def is_the_example(found: Extraction) -> None:
    assert answers.bom_of(found.entries, str(EXAMPLE)) == WANTED
    assert answers.findings_of(found.findings, str(EXAMPLE)) == {
        "in_document_link": ("TopAssembly.FCStd#LayoutReference",)
    }


def test_the_files_hold_the_assembly_of_the_specification() -> None:
    """Two gearboxes with four gears each, twelve bolts, and one construction link that is reported."""
    with Library() as library:
        is_the_example(extract(choose_assembly(library.open(TOP))))


@pytest.mark.freecad
@pytest.mark.parametrize("version", ["1.0", "1.1"])
def test_freecad_shows_the_same(version: str, tmp_path: Path) -> None:
    """The live objects in every FreeCAD that has assemblies."""
    freecad = machines.need(version)
    ((_, found),) = run_freecad(
        [str(TOP)], command=freecad.command, env=freecad.profile(tmp_path / "profile")
    )
    assert isinstance(found, Extraction), found
    is_the_example(found)


@pytest.mark.parametrize("path", FILES, ids=[path.stem for path in FILES])
def test_each_file_has_a_picture_and_no_identity(path: Path) -> None:
    """People see what they open; the demo registers the parts itself."""
    with zipfile.ZipFile(path) as file:
        assert file.read("thumbnails/Thumbnail.png").startswith(b"\x89PNG")
    with Library() as library:
        document = library.open(path)
        assert "SiloUUID" not in document.Meta
        assert all("Silo" not in name for obj in document.Objects for name in obj.PropertiesList)
