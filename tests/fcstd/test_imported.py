# SPDX-License-Identifier: LGPL-2.1-or-later
"""What A2plus imported: one part of several in a file, and sketches, which are no parts."""

from __future__ import annotations

from pathlib import Path

from fcstd_writer import Doc, locals_

from silo.bom import choose_assembly, extract
from silo.bom.entry import Extraction
from silo.fcstd import Library


def read(path: Path) -> Extraction:
    with Library() as library:
        return extract(choose_assembly(library.open(path)))


def imported(doc: Doc, name: str, part: str = "", kind: str = "a2pPart") -> None:
    marks = {"sourceFile": "./parts.FCStd", "a2p_Version": "V0.4", "objectType": kind}
    doc.add("Part::FeaturePython", name, sourcePart=part, **marks)


def two_parts(folder: Path) -> None:
    doc = Doc(label="parts")
    doc.add("PartDesign::Pad", "Pad").add("PartDesign::Body", "Body", Label="Left", Group=locals_("Pad"))
    doc.add("Part::Box", "Box", Label="Right").add("Part::Box", "One", Label="Twin")
    doc.add("Part::Box", "Two", Label="Twin").save(folder / "parts.FCStd")


def test_an_import_of_one_part_is_that_part(tmp_path: Path) -> None:
    """By its label; of a feature it is the body. A label of several parts names none: that is the file."""
    two_parts(tmp_path)
    top = Doc(label="top")
    for name, part in (("A", "Left"), ("B", "Pad"), ("C", "Right"), ("D", "Twin"), ("E", "")):
        imported(top, name, part)
    found = read(top.save(tmp_path / "top.FCStd"))
    assert {entry.object_name: entry.quantity for entry in found.entries} == {"Body": 2, "Box": 1, "": 2}


def test_an_imported_sketch_is_no_part(tmp_path: Path) -> None:
    two_parts(tmp_path)
    top = Doc(label="top")
    imported(top, "A", "Left")
    imported(top, "S", "Left", kind="a2pSketch")
    found = read(top.save(tmp_path / "top.FCStd"))
    assert {entry.object_name: entry.quantity for entry in found.entries} == {"Body": 1}
