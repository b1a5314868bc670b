# SPDX-License-Identifier: LGPL-2.1-or-later
"""Standard parts and declared parts in an assembly, and what repeats them."""

from __future__ import annotations

from typing import Any

import pytest
from fakes import Doc
from hypothesis import given
from hypothesis import strategies as st

from silo.bom import choose_assembly, extract
from silo.bom.entry import Extraction
from silo.bom.findings import FindingCode
from silo.bom.walk.standard import designated, standard_uuid

M4 = "ISO 4762 M4×16"


def articles(found: Extraction) -> dict[str | None, int]:
    return {entry.standard: entry.quantity for entry in found.entries}


def test_one_article_has_the_identity_of_its_designation() -> None:
    """And says where it first occurs; no file is stamped for it."""
    top = Doc("/v/top.FCStd", meta={"SiloUUID": "the assembly"})
    (entry,) = extract(top.assembly(top.screw("A"), top.screw("B"))).entries
    assert (entry.silo_uuid, entry.is_standard) == (standard_uuid(M4), True)
    assert (entry.doc_path, entry.object_name, entry.quantity) == ("/v/top.FCStd", "A", 2)


def test_a_registered_fastener_is_an_item_of_its_own() -> None:
    """Who registered that very object meant that item."""
    top = Doc("/v/top.FCStd")
    found = extract(top.assembly(top.screw("A", SiloItemId="mine"), top.screw("B")))
    assert {entry.silo_uuid: entry.quantity for entry in found.entries} == {"mine": 1, standard_uuid(M4): 1}


def test_without_hardware_nothing_of_it_counts() -> None:
    """Neither in the assembly nor linked, and that is said."""
    top, store = Doc("/v/top.FCStd"), Doc("/v/store.FCStd")
    asm = top.assembly(top.screw("A"), top.link("L", store.screw("S")), top.link("B", store.body("Bolt")))
    found = extract(asm, hardware=False)
    assert [entry.object_name for entry in found.entries] == ["Bolt"]
    assert found.findings_of(FindingCode.NO_HARDWARE)


def test_the_only_part_of_a_file_is_that_file() -> None:
    """A registered body does not contain itself."""
    doc = Doc("/v/part.FCStd")
    doc.body(SiloItemId="me")
    doc.body("Tool")
    assert extract(choose_assembly(doc)).entries == ()


def test_the_assemblys_own_identity_on_an_object_declares_nothing() -> None:
    """Or an item would contain itself."""
    doc = Doc("/v/part.FCStd", meta={"SiloUUID": "Me"})
    assert extract(doc.part("Part", doc.body(SiloItemId="me"))).entries == ()


def test_an_empty_assembly_beside_components_blocks() -> None:
    """It may be the wrong one, and a sync would mark every line unreferenced."""
    doc = Doc("/v/top.FCStd")
    doc.assembly()
    doc.part("Holder", doc.link("L", Doc("/v/bolt.FCStd").body()))
    found = extract(choose_assembly(doc))
    (finding,) = found.findings_of(FindingCode.BESIDE_ASSEMBLY)
    assert found.blocked
    assert finding.blocks


REPEATS = st.lists(st.tuples(st.sampled_from("ladcg"), st.integers(1, 4)), max_size=5)


@given(st.lists(REPEATS, min_size=1, max_size=4))
def test_any_nesting_of_repetitions_is_their_product(chains: list[list[tuple[str, int]]]) -> None:
    """Links, arrays, Draft arrays, compounds and groups over a screw, against the plain product."""
    top = Doc("/v/top.FCStd")
    members, wanted = [], 0
    for number, chain in enumerate(chains):
        obj, pieces = top.screw(f"S{number}"), 1
        for step, (how, times) in enumerate(chain):
            name = f"N{number}x{step}"
            if how == "l":
                obj = top.link(name, obj)
            elif how == "a":
                obj, pieces = top.array(name, obj, times), pieces * times
            elif how == "d":
                obj = top.add("Part::FeaturePython", name, Base=obj, Count=times)
                pieces *= times
            elif how == "c":
                obj = top.add("Part::Compound", name, Links=[obj])
            else:
                obj = top.link_group(name, obj)
        members.append(obj)
        wanted += pieces
    assert articles(extract(top.assembly(*members))) == {M4: wanted}


def test_a_mirror_image_shows_its_source_once_more() -> None:
    """Its Base is the point that the plane goes through, not what it shows."""
    top = Doc("/v/top.FCStd")
    screw = top.screw("A")
    found = extract(top.assembly(screw, top.add("Part::Mirroring", "Mirror", Source=screw)))
    assert articles(found) == {M4: 2}


@pytest.mark.parametrize("container", ["link_group", "part"])
def test_what_lies_in_a_folder_of_a_container_counts_once(container: str) -> None:
    """A part lists what lies in its folders, a link group does not: it is not beside the assembly."""
    top = Doc("/v/top.FCStd")
    inner = top.folder("Inner", top.screw("A"), top.folder("Deeper", top.screw("B")))
    holder = getattr(top, container)("Holder", inner)
    found = extract(choose_assembly(_in_a_file(top, holder)))
    assert articles(found)[M4] == 2
    assert found.findings_of(FindingCode.COUNTED_BESIDE, FindingCode.NO_CONTAINER) == ()


def _in_a_file(top: Doc, holder: Any) -> Doc:
    top.assembly(holder, top.link("L", Doc("/v/bolt.FCStd").body()))
    return top


@pytest.mark.parametrize("operand", ["Tool", "Base"])
def test_an_array_that_a_cut_consumes_is_no_pieces_to_buy(operand: str) -> None:
    """As the single screw is not."""
    top = Doc("/v/top.FCStd")
    array = top.add("Part::FeaturePython", "Array", Base=top.screw("S"), Count=6)
    other = "Base" if operand == "Tool" else "Tool"
    cut = top.add("Part::Cut", "Cut", **{operand: array, other: top.body("Plate")})
    assert articles(extract(top.assembly(array, cut, top.screw("Bought")))) == {M4: 1}


def test_a_boolean_in_a_body_consumes_what_it_holds() -> None:
    """It lies in the Body, which keeps its features to itself; the screw lies in the assembly."""
    top = Doc("/v/top.FCStd")
    screw = top.screw("S")
    boolean = top.add("PartDesign::Boolean", "Boolean", Group=[screw])
    body = top.body("Plate", Group=[boolean])
    assert articles(extract(top.assembly(body, screw, top.screw("Bought")))) == {M4: 1}


def test_fragments_consume_their_objects() -> None:
    """As Part's tools of Python make them: fragments, slices."""
    top = Doc("/v/top.FCStd")
    screw = top.screw("S")
    made = {"Objects": [screw, top.body("Plate")], "Mode": "Standard", "Tolerance": 0.0}
    fragments = top.add("Part::FeaturePython", "Fragments", **made)
    assert articles(extract(top.assembly(screw, fragments, top.screw("Bought")))) == {M4: 1}


def test_a_thread_of_one_start_is_an_ordinary_one() -> None:
    """Rods have the property whether they have several starts or one."""
    rod = {"Diameter": "M8", "Length": 100.0, "Pitch": 1.25}
    assert designated("ThreadedRod", {**rod, "NumStarts": 1}) == designated("ThreadedRod", rod)
    assert designated("ThreadedRod", {**rod, "NumStarts": 2}).endswith(" 2 starts")
