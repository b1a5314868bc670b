# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a saved view shows counts where it is seen; what is hidden beside it is named."""

from __future__ import annotations

from typing import Any

import pytest
from fakes import Doc

from silo.bom import FindingCode, extract
from silo.bom.entry import Extraction


def pieces(found: Extraction) -> dict[str, int]:
    """Lines by object, own parts with a star."""
    lines = {entry.standard or entry.object_name: entry.quantity for entry in found.entries}
    return lines | {f"*{line.object_name}": line.quantity for line in found.assembly.own}


def wrong(found: Extraction) -> list[str]:
    codes = (FindingCode.UNEXPLAINED, FindingCode.TWO_ROLES, FindingCode.NO_ROLE)
    return [finding.message for finding in found.findings_of(*codes)]


def named(found: Extraction) -> set[str]:
    return {place.obj for finding in found.findings for place in finding.where}


HIDDEN: dict[str, Any] = {"Visibility": False}


def bundle(doc: Doc, *members: Any, **more: Any) -> Any:
    return doc.add("Part::Compound", "Pair", Links=list(members), **more)


def test_visible_members_of_a_hidden_compound_that_a_cut_uses() -> None:
    """The cut has the compound's solids in it; the members are seen beside it all the same."""
    doc = Doc("/v/top.FCStd")
    block, screw = doc.add("Part::Box", "Block", **HIDDEN), doc.screw("Screw")
    near = [doc.body("Near"), screw]
    pair = bundle(doc, *near, **HIDDEN)
    cut = doc.add("Part::Cut", "Cut", Base=block, Tool=pair)
    found = extract(doc.assembly(block, *near, pair, cut, doc.link("L", Doc("/v/bolt.FCStd").body("Bolt"))))
    assert pieces(found) == {"*Near": 1, "ISO 4762 M4×16": 1, "*Cut": 1, "Bolt": 1}
    assert wrong(found) == []


def test_hidden_members_of_a_hidden_compound_that_a_cut_uses_are_used_up() -> None:
    doc = Doc("/v/top.FCStd")
    block, near, far = (doc.add("Part::Box", name, **HIDDEN) for name in ("Block", "Near", "Far"))
    pair = bundle(doc, near, far, **HIDDEN)
    found = extract(doc.assembly(block, near, far, pair, doc.add("Part::Cut", "Cut", Base=block, Tool=pair)))
    assert pieces(found) == {"*Cut": 1}
    assert wrong(found) == []


@pytest.mark.parametrize("by", ["compound", "array", "both"])
def test_a_visible_original_of_what_is_hidden(by: str) -> None:
    """The designer hid the compound or the array, and sees the one box."""
    doc = Doc("/v/top.FCStd")
    box = doc.body("Box")
    shows = doc.add("Part::FeaturePython", "Row", Base=box, Count=4, **HIDDEN) if by != "compound" else box
    whole = [shows] if by == "array" else [shows, bundle(doc, shows, **HIDDEN)]
    found = extract(doc.assembly(box, *(obj for obj in whole if obj is not box), doc.body("Other")))
    assert pieces(found) == {"*Box": 1, "*Other": 1}
    assert wrong(found) == []
    assert {obj.Name for obj in whole[-1:]} <= named(found)


def test_a_visible_original_of_a_hidden_array_that_is_said_to_count() -> None:
    doc = Doc("/v/top.FCStd")
    box = doc.body("Box")
    row = doc.add("Part::FeaturePython", "Row", Base=box, Count=4, SiloBomExclude=False, **HIDDEN)
    found = extract(doc.assembly(box, row, doc.body("Other")))
    assert pieces(found) == {"*Row": 4, "*Other": 1} or pieces(found) == {"*Box": 4, "*Other": 1}


def test_links_in_a_hidden_compound_count_once_with_it() -> None:
    """Links count whatever their eye icon shows, here through the compound."""
    doc, bolt = Doc("/v/top.FCStd"), Doc("/v/bolt.FCStd").body("Bolt")
    links = [doc.link("A", bolt), doc.link("B", bolt)]
    found = extract(doc.assembly(*links, bundle(doc, *links, **HIDDEN), doc.body("Other")))
    assert pieces(found) == {"Bolt": 2, "*Other": 1}
    assert wrong(found) == []


def test_a_visible_member_of_a_compound_that_lies_elsewhere_too() -> None:
    """A link shows the hidden compound in another place: two boxes are seen there, and one here."""
    doc = Doc("/v/top.FCStd")
    box, lid = doc.body("Box"), doc.body("Lid", **HIDDEN)
    pair = bundle(doc, box, lid, **HIDDEN)
    found = extract(doc.assembly(box, lid, pair, doc.link("L", pair)))
    assert sum(line.quantity for line in found.assembly.own) == 2
    assert wrong(found) == []


@pytest.mark.parametrize("has_view", [True, False])
def test_a_clone_of_a_body_and_its_visible_original(has_view: bool) -> None:
    """PartDesign's Clone takes the original as BaseFeature, and uses nothing up."""
    doc = Doc("/v/top.FCStd")
    body = doc.body("Body")
    clone = doc.body("Clone", Group=[doc.add("PartDesign::FeatureBase", "Base", BaseFeature=body)])
    found = extract(doc.assembly(body, clone, *([doc.body("Stored", **HIDDEN)] if has_view else [])))
    assert pieces(found) == {"*Body": 1, "*Clone": 1}
    assert wrong(found) == []
    assert ("Stored" in named(found)) is has_view


@pytest.mark.parametrize(("seen", "right"), [(True, {"*Foam": 1, "*Device": 1}), (False, {"*Foam": 1})])
def test_the_tool_of_a_cut(seen: bool, right: dict[str, int]) -> None:
    """A device that lies visibly in its foam is a piece; a hidden drill is used up."""
    doc = Doc("/v/top.FCStd")
    block, device = doc.add("Part::Box", "Block", **HIDDEN), doc.add("Part::Box", "Device", Visibility=seen)
    found = extract(
        doc.assembly(block, device, doc.add("Part::Cut", "Foam", Base=block, Tool=device, Label="Foam"))
    )
    assert pieces(found) == right
    assert wrong(found) == []
