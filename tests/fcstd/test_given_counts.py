# SPDX-License-Identifier: LGPL-2.1-or-later
"""Small files that were counted wrong, with the right count; skipped where there are none."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

from silo.bom import choose_assembly, extract
from silo.bom.entry import BomEntry, Extraction, walk_entries
from silo.bom.findings import FindingCode
from silo.fcstd import Library
from silo.inertia.geometry.fcstd import read_freecad
from silo.inertia.geometry.options import ReadOptions

CASES = (Path(__file__).resolve().parents[3] / "shared").resolve() / "cases" / "counts"
pytestmark = pytest.mark.skipif(not CASES.is_dir(), reason="the given files are not beside this checkout")


def read(name: str, top: str = "top.FCStd") -> Extraction:
    with Library() as library:
        return extract(choose_assembly(library.open(CASES / name / top)))


def parts(found: Extraction) -> dict[str, int]:
    """The lines of the assembly itself by object, own parts with a star."""
    lines = {entry.object_name: entry.quantity for entry in found.entries if not entry.missing}
    return lines | {f"*{entry.object_name}": entry.quantity for entry in found.assembly.own}


def said(found: Extraction, code: FindingCode) -> str:
    return " ".join(finding.message for finding in found.findings_of(code))


def totals(found: Extraction) -> Mapping[str, int]:
    """Pieces by label over all levels."""
    total: dict[str, int] = {}

    def add(entries: tuple[BomEntry, ...], times: int) -> None:
        for entry in entries:
            total[entry.label] = total.get(entry.label, 0) + entry.quantity * times
            add((*entry.children, *entry.own), entry.quantity * times)

    add((*found.entries, *found.assembly.own), 1)
    return total


@pytest.mark.parametrize(
    ("name", "right"),
    [
        ("clone_body_gui", {"*Body": 1, "*Body001": 1}),
        ("clone_of_clone", {"*Leg": 1, "*LegC": 1, "*LegC001": 1, "*LegC002": 1}),
        ("cut_visible_tool", {"*Device": 1, "*Insert": 1}),
        ("cut_of_hidden_link", {"Box": 1}),
        ("fusion_of_links", {"Box": 2}),
        ("draft_array_partly_hidden", {"Box": 2}),
        ("draft_path_link", {"Box": 4}),
        ("hidden_body_only_variant", {"*Body": 1}),
    ],
)
def test_pieces(name: str, right: dict[str, int]) -> None:
    assert parts(read(name)) == right


@pytest.mark.parametrize("name", ["cut_of_hidden_link", "fusion_of_links"])
def test_modified_here(name: str) -> None:
    """The linked parts count; what was made of them is named, and is what is weighed."""
    found = read(name)
    assert found.findings_of(FindingCode.MODIFIED_HERE)
    weighed = read_freecad(CASES / name / "top.FCStd", ReadOptions(), lambda *_: None)
    assert len(weighed.assembly.instances) == 1


def test_a_hidden_body_is_named() -> None:
    assert "Body2" in said(read("hidden_body_only_variant"), FindingCode.HIDDEN)


def test_reference_link() -> None:
    """One display, one bracket; the display in the bracket only supports a binder."""
    found = read("ref_link_for_binder")
    assert {entry.object_name: entry.quantity for entry in walk_entries(found.entries)} == {
        "Part": 1,
        "Box": 1,
    }
    assert "Ref" in said(found, FindingCode.HIDDEN)


def test_deleted_copy() -> None:
    found = read("deleted-copy", "TopDel.FCStd")
    assert [(entry.missing, entry.quantity) for entry in found.entries] == [(True, 1)] * 3
    assert found.blocked


def test_the_contents_of_a_configured_copy() -> None:
    found = read("variant-sub", "Top.FCStd")
    assert [sum(child.quantity for child in entry.children) for entry in found.entries] == [2, 5]
    assert [entry.variant for entry in found.entries] == ["", "Cnt = 5"]
    weighed = read_freecad(CASES / "variant-sub" / "Top.FCStd", ReadOptions(), lambda *_: None)
    assert len(weighed.assembly.instances) == 7
