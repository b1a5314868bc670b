# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is repeated, and what of it is left out: each case was once a way to lose or to double pieces."""

from __future__ import annotations

from typing import Any

import pytest
from fakes import Doc, Obj

from silo.bom import extract
from silo.bom.findings import FindingCode
from silo.bom.walk.arrays import array_count, draft_count
from silo.bom.walk.document import LinkProblem
from silo.bom.walk.roots import choose_assembly

ITEM = "11111111-2222-4333-8444-555555555555"


@pytest.fixture
def top() -> Doc:
    return Doc("/v/top.FCStd")


@pytest.fixture
def bolt() -> Any:
    return Doc("/v/bolt.FCStd").body("Bolt")


def draft(top: Doc, base: Any, count: int, **properties: Any) -> Obj:
    return top.add("Part::FeaturePython", "Array", Base=base, Count=count, ExpandArray=False, **properties)


def counts(assembly: Any) -> dict[str, int]:
    return {entry.standard or entry.object_name: entry.quantity for entry in extract(assembly).entries}


def test_one_link_in_several_link_groups_is_shown_by_each(top: Doc, bolt: Any) -> None:
    """FreeCAD shows it once per group, groups in groups included."""
    link = top.link("L", bolt)
    inner = top.link_group("G3", link)
    assembly = top.assembly(
        top.link_group("G1", link), top.link_group("G2", inner, top.link_group("G4", link))
    )
    assert counts(assembly) == {"Bolt": 3}


def test_a_declared_body_is_counted_through_its_draft_array(top: Doc) -> None:
    """The original lies in the assembly beside the array that shows it."""
    body = top.body("Foot", SiloItemId=ITEM)
    assert counts(top.assembly(body, draft(top, body, 4))) == {"Foot": 4}


def test_hardware_beside_that_shows_a_member_counts_it_once(top: Doc) -> None:
    """A compound beside the assembly is made of a screw in it."""
    screw = top.screw("S")
    top.add("Part::Compound", "Beside", Links=[screw])
    assert counts(top.assembly(screw, top.screw("Other", "30"))) == {"ISO 4762 M4×16": 1, "ISO 4762 M4×30": 1}


@pytest.mark.parametrize(
    "left_out",
    [
        lambda doc, bolt: draft(doc, doc.link("L", bolt), 3, Suppressed=True),
        lambda doc, bolt: doc.link("L", bolt, ElementCount=2, ElementList=_all_suppressed(doc, 2)),
        lambda doc, _bolt: doc.link("L", Doc("/v/x.FCStd").body("X", SiloBomExclude=True)),
    ],
    ids=["draft array", "every element", "excluded part"],
)
def test_an_assembly_whose_components_are_all_left_out_is_one_all_the_same(bolt: Any, left_out: Any) -> None:
    """It is an empty BOM of its own, no part of the assembly that uses it."""
    below = Doc("/v/sub.FCStd")
    sub = below.part("Sub", left_out(below, bolt))
    upper = Doc("/v/top.FCStd")
    (entry,) = extract(upper.assembly(upper.link("L", sub))).entries
    assert (entry.object_name, entry.is_assembly, entry.children) == ("Sub", True, ())


def _all_suppressed(doc: Doc, count: int) -> list[Any]:
    return [doc.add("App::LinkElement", f"L_i{number}", Suppressed=True) for number in range(count)]


def test_a_broken_array_with_no_element_left_is_no_line(top: Doc) -> None:
    """Nothing of it is shown; the missing file is reported."""
    problem = LinkProblem(FindingCode.MISSING_FILE, "gone.FCStd", "Body")
    none = _all_suppressed(top, 2)
    array = top.link("L", None, ElementCount=2, ElementList=none, LinkProblem=problem)
    found = extract(top.assembly(array))
    assert found.entries == ()
    assert found.findings_of(FindingCode.MISSING_FILE)


def test_a_feature_that_consumes_a_compound_consumes_its_hardware_only(top: Doc, bolt: Any) -> None:
    """A linked part in it is a component whatever it is used for."""
    bundle = top.add("Part::Compound", "Bundle", Links=[top.screw("S"), top.link("L", bolt)])
    cut = top.add("Part::Cut", "Cut", Base=top.body("Plate"), Tool=bundle)
    assert counts(top.assembly(bundle, cut)) == {"Bolt": 1}


def test_a_member_of_a_consumed_compound_is_used_up_with_it(top: Doc, bolt: Any) -> None:
    """The compound counts no screw, so no finding says that it does; the linked part counts there."""
    screw, link = top.screw("S"), top.link("L", bolt)
    bundle = top.add("Part::Compound", "Bundle", Links=[screw, link])
    cut = top.add("Part::Cut", "Cut", Base=top.body("Plate"), Tool=bundle)
    found = extract(top.assembly(screw, link, bundle, cut))
    assert {entry.object_name: entry.quantity for entry in found.entries} == {"Bolt": 1}
    used_up = {place.obj for note in found.findings_of(FindingCode.CONSUMED) for place in note.where}
    twice = {place.obj for note in found.findings_of(FindingCode.COINCIDENT) for place in note.where}
    assert (used_up, twice) == ({"S", "Bundle"}, {"L"})


def test_a_left_out_source_is_left_out_of_what_shows_it(top: Doc) -> None:
    """The source lies outside of the assembly, so only the compound leads to it."""
    bundle = top.add("Part::Compound", "B", Links=[top.screw("S", Suppressed=True), top.screw("T", "30")])
    assert counts(top.assembly(bundle)) == {"ISO 4762 M4×30": 1}


@pytest.mark.parametrize("visible", [True, False])
def test_a_file_that_shows_its_declared_part_again_is_an_assembly(visible: bool) -> None:
    """The only part of a file is that file; two of it are not. A visible original counts like its links."""
    doc = Doc("/v/top.FCStd")
    body = doc.body("Foot", SiloItemId=ITEM, Visibility=visible)
    doc.link("Again", body, ElementCount=2)
    assert counts(choose_assembly(doc)) == {"Foot": 2 + visible}


def test_elements_of_an_array_are_left_out_one_by_one(top: Doc, bolt: Any) -> None:
    """Down to none."""
    one, other = top.add("App::LinkElement", "i0", Suppressed=True), top.add("App::LinkElement", "i1")
    assert array_count(top.link("A", bolt, ElementCount=2, ElementList=[one, other])) == 1
    assert array_count(top.link("B", bolt, ElementCount=1, ElementList=[one])) == 0


@pytest.mark.parametrize(
    ("pattern", "count"),
    [
        ({"ArrayType": "ortho", "NumberX": 2, "NumberY": 0, "NumberZ": 3}, 6),
        ({"ArrayType": "ortho", "NumberX": 0, "NumberY": 4, "NumberZ": 1}, 1),
        ({"ArrayType": "polar", "NumberPolar": 0}, 1),
        ({"ArrayType": "polar", "NumberPolar": 5}, 5),
        (
            {
                "ArrayType": "circular", "NumberCircles": 2, "Symmetry": 4, "RadialDistance": 50.0,
                "TangentialDistance": 30.0,
            },
            9,
        ),
        ({"ArrayType": "spiral"}, None),
        ({"ArrayType": "ortho", "NumberX": 2}, None),
    ],
    ids=str,
)  # fmt: skip
def test_draft_arrays_without_a_count_say_it_by_their_pattern(
    top: Doc, bolt: Any, pattern: dict[str, Any], count: int | None
) -> None:
    """As Draft draws them: its original is there in any case, and of rings only whole symmetries."""
    assert draft_count(draft(top, bolt, 0, **pattern)) == count
