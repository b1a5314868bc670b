# SPDX-License-Identifier: LGPL-2.1-or-later
"""Real assemblies of public projects: instance counts equal those that FreeCAD itself gave."""

from __future__ import annotations

import json
import os
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from public_projects import ASSEMBLIES

from silo.bom.entry import walk_entries
from silo.bom.findings import FindingCode
from silo.bom.view.flat_list import flat_lines
from silo.bom.walk.links import extract
from silo.bom.walk.roots import choose_assembly
from silo.fcstd import Library

TRUTHS = sorted(ASSEMBLIES.glob("*/truth/*.json"))


def test_the_data_is_there() -> None:
    """Without the data nothing below runs; that must be seen."""
    if not TRUTHS:
        pytest.skip(f"no assemblies with ground truth in {ASSEMBLIES}")
    assert len(TRUTHS) == 7


# Standard parts of the real assemblies, looked up in FreeCAD by hand: top file → designation → pieces.
HARDWARE = {
    "Asm4_Example2/asm_V4.FCStd": {"ISO 4762 M6×20": 8},
    "Asm4_Example2/Bielle/asm_Bielle.fcstd": {"ISO 4762 M6×20": 2},
    "SubAssemblies/BatteryTray/BatteryTrayAssembly.FCStd": {
        "ISO 4762 M3×6": 8,
        "IUT heat insert M3×3 ⌀4.55": 8,
    },
    "assemblies/assembly.FCStd": {"ISO 7045 M2.5×30": 8, "ISO 4032 M2.5": 8, "ISO 7045 M2.5×3": 4},
}


def expected(truth: dict[str, Any], folder: Path) -> Counter[tuple[str, str]]:
    """The counts that are reached through links to other documents, missing ones too."""
    found: Counter[tuple[str, str]] = Counter()
    for root in truth["roots"]:
        for item in root["instance_counts"]:
            if item["external"]:
                found[os.path.realpath(folder / item["file"]), item["object"]] += item["external"]
    return found


@pytest.mark.parametrize("path", TRUTHS, ids=[path.stem for path in TRUTHS])
def test_counts_equal_the_ground_truth(path: Path) -> None:
    """Every component of every level, as often as in FreeCAD; what is missing is counted and reported."""
    truth, folder = json.loads(path.read_text()), path.parent.parent
    with Library() as library:
        found = extract(choose_assembly(library.open(folder / truth["top"])))
    flat = flat_lines(found.entries)
    counted = {(entry.doc_path, entry.object_name): count for entry, count in flat}
    wanted = expected(truth, folder)
    assert {key: count for key, count in counted.items() if key in wanted} == wanted
    assert {entry.standard: n for entry, n in flat if entry.standard} == HARDWARE.get(truth["top"], {})
    assert all(entry.standard or entry.key in wanted for entry, _ in flat)
    missing = [f.message for f in found.findings if f.code is FindingCode.MISSING_FILE]
    assert len(missing) == len(truth["missing_files"])
    lost = {os.path.relpath(entry.doc_path, folder) for entry in walk_entries(found.entries) if entry.missing}
    assert lost == {os.path.normpath(file) for file in truth["missing_files"]}
    for file in truth["missing_files"]:
        assert any(os.path.basename(file) in message for message in missing)


@pytest.mark.parametrize("path", TRUTHS, ids=[path.stem for path in TRUTHS])
def test_links_have_the_targets_that_freecad_gave_them(path: Path) -> None:
    """Link by link: target file, target object, type and label."""
    truth, folder = json.loads(path.read_text()), path.parent.parent
    with Library() as library:
        for record in truth["links"]:
            link = library.open(folder / record["doc"]).getObject(record["name"])
            assert link is not None
            assert (link.TypeId, link.Label) == (record["type"], record["label"])
            target = link.LinkedObject
            if record.get("target_type") is None:
                assert target is None
                continue
            target = target[0] if isinstance(target, tuple) else target
            where = os.path.relpath(target.Document.FileName, os.path.realpath(folder))
            assert where.replace(os.sep, "/") == record["target_file"]
            assert (target.Name, target.Label) == (record["target_name"], record["target_label"])
            assert target.TypeId == record["target_type"]


@pytest.mark.parametrize("path", TRUTHS, ids=[path.stem for path in TRUTHS])
def test_documents_say_what_freecad_said(path: Path) -> None:
    """Label, writer and number of objects of every document that was loaded in full."""
    truth, folder = json.loads(path.read_text()), path.parent.parent
    with Library() as library:
        for record in truth["documents"]:
            document = library.open(folder / record["file"])
            assert document.Label == record["label"]
            assert document.ProgramVersion == record["written_by"]
            if not record["partial"]:
                assert len(document.Objects) == record["objects"]
            assert not document._xml.is_careful
