# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files of FreeCAD 1.2, written by hand from what its source says: no build of it is at hand."""

from __future__ import annotations

from pathlib import Path

import pytest
from fcstd_writer import Doc, XLink, locals_, part

from silo.bom.entry import Extraction
from silo.bom.findings import FindingCode
from silo.bom.walk.links import extract
from silo.bom.walk.roots import choose_assembly
from silo.fcstd import open_document

ARRAYS = ["Linear", "Polar", "Circular", "Path", "Point"]


def read(folder: Path, doc: Doc) -> Extraction:
    part(name="Bolt").save(folder / "bolt.FCStd")
    return extract(choose_assembly(open_document(doc.save(folder / "top.FCStd"))))


def array(kind: str, *, suppressed: int = 0, program: str = "1.2R1 (Git)") -> Doc:
    """A pattern of four bolts, with its elements."""
    doc = Doc("top", program=program)
    names = [f"Row_i{number}" for number in range(4)]
    bolt = XLink("bolt.FCStd", "Bolt")
    for number, name in enumerate(names):
        doc.add("App::LinkElement", name, LinkedObject=bolt, Suppressed=number < suppressed)
    doc.add(kind, "Row", LinkedObject=bolt, ElementCount=4, ElementList=locals_(*names))
    return doc.add("Assembly::AssemblyObject", "Top", Group=locals_("Row"))


@pytest.mark.parametrize("kind", ARRAYS)
def test_hand_made_link_arrays_of_1_2_count_their_elements(tmp_path: Path, kind: str) -> None:
    """They derive from App::Link; nothing but the note of a newer FreeCAD is said."""
    found = read(tmp_path, array(f"Part::LinkArray{kind}"))
    assert [(entry.object_name, entry.quantity) for entry in found.entries] == [("Bolt", 4)]
    assert {finding.code for finding in found.findings} == {FindingCode.NEWER_FREECAD}


@pytest.mark.parametrize("kind", ["App::Link", "Part::LinkArrayLinear"])
def test_hand_made_suppressed_elements_of_1_2_do_not_count(tmp_path: Path, kind: str) -> None:
    """FreeCAD leaves them out of its component counts, in plain link arrays too."""
    found = read(tmp_path, array(kind, suppressed=3, program="1.1R1 (Git)"))
    assert [entry.quantity for entry in found.entries] == [1]
    told = found.findings_of(FindingCode.SUPPRESSED)
    assert sorted(finding.where[0].obj for finding in told) == ["Row_i0", "Row_i1", "Row_i2"]


def test_an_array_with_all_its_elements_suppressed_brings_nothing(tmp_path: Path) -> None:
    """No line of quantity 0."""
    assert read(tmp_path, array("App::Link", suppressed=4)).entries == ()


def test_an_unknown_type_that_looks_like_a_link_is_read_as_one(tmp_path: Path) -> None:
    """With a word, so that somebody looks at the quantity."""
    found = read(tmp_path, array("Part::LinkSpiral", program="1.1R1 (Git)"))
    assert [entry.quantity for entry in found.entries] == [4]
    assert [finding.code for finding in found.findings] == [FindingCode.UNKNOWN_LINK_TYPE]


def test_a_draft_array_saved_with_count_0_has_the_numbers_of_its_pattern(tmp_path: Path) -> None:
    """125 pieces must not read as 1."""
    doc = Doc("top").link("Base", "bolt.FCStd", "Bolt")
    numbers = {"NumberX": 5, "NumberY": 5, "NumberZ": 5, "ArrayType": "ortho"}
    doc.add("Part::FeaturePython", "Array", Base=XLink("", "Base"), Count=0, **numbers)
    doc.add("App::Part", "Top", Type="Assembly", Group=locals_("Base", "Array"))
    assert [entry.quantity for entry in read(tmp_path, doc).entries] == [125]
