# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files without an assembly: the BOM and the masses count the same pieces, and a part says that it is one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from fcstd_writer import Doc, locals_

from silo.bom import choose_assembly, extract
from silo.bom.entry import BomEntry, Extraction
from silo.bom.findings import FindingCode
from silo.bom.items.naming import own_part_name
from silo.fcstd import Library
from silo.inertia.geometry.fcstd import read_freecad
from silo.inertia.geometry.options import ReadOptions

HIDDEN = {"Visibility": False}


def bodies(*names: str, **more: Any) -> Doc:
    doc = Doc("plates")
    for name in names:
        doc.add("PartDesign::Body", name, **more)
    return doc


CASES: dict[str, tuple[Doc, int]] = {
    "one body": (bodies("Body"), 1),
    "seven bodies": (bodies(*(f"Body{number}" for number in range(7))), 7),
    "a body and a hidden one": (bodies("Body").add("PartDesign::Body", "Body001", **HIDDEN), 1),
    "a part of two bodies": (
        bodies("Body", "Body001").add("App::Part", "Part", Group=locals_("Body", "Body001")),
        1,
    ),
    "two parts": (
        bodies("Body", "Body001")
        .add("App::Part", "Part", Group=locals_("Body"))
        .add("App::Part", "Part001", Group=locals_("Body001")),
        2,
    ),
    "a part and a body": (bodies("Body", "Body001").add("App::Part", "Part", Group=locals_("Body")), 2),
    "bodies in a folder": (
        bodies("Body", "Body001").add("App::DocumentObjectGroup", "Group", Group=locals_("Body", "Body001")),
        2,
    ),
    "a body and six links to it": (bodies("Body").link("Link", "", "Body", ElementCount=6), 7),
}


def read(path: Path) -> Extraction:
    with Library() as library:
        return extract(choose_assembly(library.open(path)))


@pytest.mark.parametrize("case", CASES)
def test_the_bom_and_the_masses_count_the_same_pieces(case: str, tmp_path: Path) -> None:
    doc, pieces = CASES[case]
    path = doc.save(tmp_path / "plates.FCStd")
    found = read(path)
    own = sum(line.quantity for line in found.assembly.own)
    weighed = read_freecad(path, ReadOptions(), lambda *_: None)
    assert (own or 1, len(weighed.assembly.instances)) == (pieces, pieces)
    is_part = bool(found.findings_of(FindingCode.ONE_PART))
    assert is_part is not bool(own)
    assert not found.findings_of(FindingCode.EMPTY_BOM)


def test_a_part_names_what_it_is_made_of(tmp_path: Path) -> None:
    found = read(CASES["a part of two bodies"][0].save(tmp_path / "plates.FCStd"))
    (finding,) = found.findings_of(FindingCode.ONE_PART)
    assert finding.message.startswith("plates is one part and no assembly")
    assert {place.obj for place in finding.where} == {"Body", "Body001"}


@pytest.mark.parametrize(
    ("label", "right"), [("Body001", "plates: Body001"), ("Assembly", "plates: Assembly"), ("Lid", "Lid")]
)
def test_an_own_part_with_a_generic_label_is_named_by_its_file_and_label(label: str, right: str) -> None:
    """Six bodies are six different lines."""
    entry = BomEntry("/v/plates.FCStd", object_name="Body001", label=label, document_label="plates")
    assert own_part_name(entry) == right
