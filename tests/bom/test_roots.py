# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which object of a document is the assembly, and links that lie in none."""

from __future__ import annotations

from typing import Any

import pytest
from fakes import BareDocument, Doc, edit

from silo.bom import FindingCode, choose_assembly, extract
from silo.bom.errors import InputError
from silo.bom.walk.links import file_bom
from silo.bom.walk.roots import find_assemblies

BOLT = ("/v/bolt.FCStd", "Body")


@pytest.fixture
def doc() -> Doc:
    return Doc("/v/top.FCStd")


@pytest.fixture
def bolt() -> Any:
    return Doc("/v/bolt.FCStd").body()


def test_freecads_own_assembly_comes_first(doc: Doc, bolt: Any) -> None:
    """Before an Assembly4 model, and before parts that hold links."""
    doc.part("Model", doc.link("L1", bolt), Type="Assembly")
    doc.part("Part", doc.link("L2", bolt))
    asm = doc.assembly(doc.link("L3", bolt))
    assert choose_assembly(doc) is asm
    assert [obj.Name for obj in find_assemblies(doc)] == ["Assembly", "Model", "Part"]


def test_an_assembly_inside_an_assembly_is_no_root(doc: Doc, bolt: Any) -> None:
    """Inline assemblies belong to the one that holds them."""
    inner = doc.assembly(doc.link("L1", bolt), name="Inner")
    outer = doc.assembly(inner, name="Outer")
    assert choose_assembly(doc) is outer


def test_an_assembly4_model_beside_its_spares(doc: Doc, bolt: Any) -> None:
    """The ``Parts`` folder beside the model holds spares and is no root."""
    doc.folder("Parts", doc.part("Spare", doc.link("S", bolt)))
    model = doc.part("Model", doc.link("L1", bolt), Type="Assembly")
    assert choose_assembly(doc) is model


def test_an_assembly_that_was_sorted_into_a_folder(doc: Doc, bolt: Any) -> None:
    """People put assemblies into folders as well."""
    asm = doc.assembly(doc.link("L1", bolt))
    doc.folder("Main", asm)
    assert choose_assembly(doc) is asm


def test_a_part_that_holds_links_is_an_assembly(doc: Doc, bolt: Any) -> None:
    """Before a part that holds only bodies, also where the links lie deeper."""
    doc.part("Plain", doc.body())
    part = doc.part("Holder", doc.part("Inner", doc.link("L1", bolt)))
    assert choose_assembly(doc) is part


def test_an_assembly3_container(doc: Doc, bolt: Any) -> None:
    """Known by its properties, also where the add-on is not installed."""
    parts = doc.group("Part::FeaturePython", "Parts", doc.link("P", bolt))
    empty = [doc.group("Part::FeaturePython", name) for name in ("Constraints", "Elements")]
    asm3 = doc.group("Part::FeaturePython", "Asm", *empty, parts, BuildShape="", Freeze=False)
    assert choose_assembly(doc) is asm3
    assert extract(asm3).findings == ()


def test_copies_of_an_assembly_link_are_no_roots_and_no_loose_links(doc: Doc, bolt: Any) -> None:
    """They belong to the AssemblyLink."""
    sub = Doc("/v/sub.FCStd")
    inner = sub.link("B", bolt)
    asm = doc.assembly(doc.assembly_link("AL", sub.assembly(inner), [doc.link("Copy", inner)]))
    assert choose_assembly(doc) is asm
    assert extract(asm).findings == ()


def test_several_assemblies_are_ambiguous_and_reported(doc: Doc, bolt: Any) -> None:
    """Nobody guesses; the message names them and says what to do."""
    for name in ("Left", "Right"):
        doc.assembly(doc.link(f"In{name}", bolt), name=name, Label=f"{name} arm")
    with pytest.raises(InputError, match=r"2 assemblies: Left .Left arm., Right .Right arm.*--assembly"):
        choose_assembly(doc)


def test_an_empty_assembly_beside_a_full_one_is_not_meant(doc: Doc, bolt: Any) -> None:
    """Only one of them has components."""
    doc.assembly(name="Empty")
    full = doc.assembly(doc.link("L1", bolt), name="Full")
    assert choose_assembly(doc) is full


def test_an_assembly_by_name_and_by_label(doc: Doc, bolt: Any) -> None:
    """The name first, then the label where it is one object's only."""
    left = doc.assembly(doc.link("L1", bolt), name="Left", Label="Arm")
    right = doc.assembly(doc.link("L2", bolt), name="Arm", Label="Right arm")
    assert choose_assembly(doc, "Arm") is right
    assert choose_assembly(doc, "Left") is left
    assert choose_assembly(doc, "Right arm") is right


def test_groups_and_folders_can_be_named(doc: Doc, bolt: Any) -> None:
    """A STEP import's assembly is a link group; spares in a folder can be listed when asked for."""
    group = doc.link_group("Imported", doc.link("L1", bolt))
    folder = doc.folder("Parts", doc.link("L2", bolt))
    for container in (group, folder):
        found = extract(choose_assembly(doc, container.Name))
        assert [entry.key for entry in found.entries] == [BOLT]


def test_an_unknown_name_lists_the_known_ones(doc: Doc, bolt: Any) -> None:
    """Wanted, got, where."""
    doc.assembly(doc.link("L1", bolt), name="Left", Label="Left arm")
    with pytest.raises(InputError, match=r"no assembly named 'Top'; it has: Left .Left arm."):
        choose_assembly(doc, "Top")


def test_a_label_of_two_assemblies_is_ambiguous(doc: Doc) -> None:
    """It is not that there is none."""
    doc.assembly(name="A", Label="Arm")
    doc.assembly(name="B", Label="Arm")
    with pytest.raises(InputError, match="2 assemblies labelled 'Arm'"):
        choose_assembly(doc, "Arm")


# --- links in no container --------------------------------------------------------------------------------


def test_links_in_the_document_itself_count_with_a_finding(doc: Doc, bolt: Any) -> None:
    """No assembly, no part: the document is the container."""
    doc.link("L1", bolt)
    doc.array("L2", bolt, 3)
    doc.body("Local")
    found = extract(choose_assembly(doc))
    assert [(entry.key, entry.quantity) for entry in found.entries] == [(BOLT, 4)]
    assert {finding.code for finding in found.findings} == {
        FindingCode.NO_CONTAINER,
        FindingCode.LOCAL_GEOMETRY,
    }
    assert (found.assembly.doc_path, found.assembly.object_name) == ("/v/top.FCStd", "")


def test_loose_links_in_folders_and_groups_count_once(doc: Doc, bolt: Any) -> None:
    """A folder is no container; a link group is."""
    doc.folder("F", doc.link("L1", bolt))
    doc.link_group("G", doc.link("L2", bolt))
    assert [entry.quantity for entry in extract(choose_assembly(doc)).entries] == [2]


def test_loose_draft_arrays_and_changed_copies(doc: Doc, bolt: Any) -> None:
    """An array's original and FreeCAD's hidden copies are not counted beside them."""
    link = doc.link("L1", bolt)
    doc.add("Part::FeaturePython", "Array", Base=link, Count=3)
    copy = doc.body("Copy")
    doc.link_group("CopyOnChangeGroup", copy, doc.link("Inner", bolt))
    doc.link("V", copy, LinkCopyOnChange="Owned", LinkCopyOnChangeSource=bolt)
    assert [entry.quantity for entry in extract(choose_assembly(doc)).entries] == [4]


def test_a_document_with_nothing_is_an_empty_bom(doc: Doc) -> None:
    """The empty document is reported, and is no error."""
    found = extract(choose_assembly(doc))
    assert found.entries == ()
    assert FindingCode.EMPTY_BOM in [finding.code for finding in found.findings]


def test_a_document_of_one_part_is_that_part(doc: Doc) -> None:
    """A part's file asked for its BOM: its BOM is empty."""
    part = doc.part("Part", doc.body())
    assert choose_assembly(doc) is part


def test_a_bare_document_is_an_empty_root() -> None:
    """Without ``Objects`` there is nothing to find."""
    found = extract(choose_assembly(BareDocument("/v/top.FCStd")))
    assert (found.entries, found.assembly.object_name) == ((), "")


def test_links_beside_the_assembly_are_reported(doc: Doc, bolt: Any) -> None:
    """A component that was dragged out of the assembly still shows, but does not count: a warning."""
    asm = doc.assembly(doc.link("L1", bolt))
    doc.link("Dragged", bolt)
    found = extract(asm)
    assert [entry.quantity for entry in found.entries] == [1]
    (finding,) = found.findings_of(FindingCode.BESIDE_ASSEMBLY)
    assert [place.obj for place in finding.where] == ["Dragged"]
    assert not finding.blocks


def test_sources_and_spares_beside_the_assembly_need_no_word(doc: Doc, bolt: Any) -> None:
    """What another link or array shows, what lies in folders, what is no component or left out on purpose."""
    source, pattern = doc.link("Source", bolt), doc.link("Pattern", bolt)
    array = doc.add("Part::FeaturePython", "Array", Base=pattern, Count=2)
    asm = doc.assembly(doc.link("L1", source), array)
    doc.folder("Parts", doc.link("Spare", bolt))
    doc.link("Sheet", Doc("/v/master.FCStd").add("Spreadsheet::Sheet", "Sheet"))
    doc.link("Face", (bolt, "Face1"))
    doc.link("Layout", doc.body("Local"))
    doc.link("Off", bolt, SiloBomExclude=True)
    doc.link("Unset", None)
    assert not extract(asm).findings_of(FindingCode.BESIDE_ASSEMBLY)


# --- damaged documents --------------------------------------------------------------------------------------


def test_parts_that_hold_each_other_are_no_endless_search(doc: Doc) -> None:
    """A ring of parts in a damaged file: nobody is the root, and nothing hangs."""
    one, two = doc.part("One"), doc.part("Two")
    edit(one, Group=[two])
    edit(two, Group=[one])
    own_ring = doc.part("Self")
    edit(own_ring, Group=[own_ring])
    assert extract(choose_assembly(doc)).entries == ()


def test_thousands_of_nested_parts_are_searched(doc: Doc, bolt: Any) -> None:
    """The search for links goes as deep as the file does."""
    inner: Any = doc.link("L1", bolt)
    for number in range(1500):
        inner = doc.part(f"P{number}", inner)
    assert choose_assembly(doc) is inner


def test_the_likeliest_assembly_comes_first_whatever_the_order() -> None:
    """An assembly, a part that is called one, a part with other files' components, a bare part."""
    doc, far = Doc("/v/top.FCStd"), Doc("/v/bolt.FCStd").body()
    bare = doc.part("Bare", doc.body("Own"))
    far_part = doc.part("Far", doc.link("L", far))
    named = doc.part("Named", Type="Assembly")
    real = doc.assembly(name="Real")
    assert [obj.Name for obj in find_assemblies(doc)] == [real.Name, named.Name, far_part.Name, bare.Name]


def test_an_assembly_that_lost_its_last_component_has_an_empty_bom(doc: Doc) -> None:
    """So that the lines of the server are marked; a part that never had one has no BOM that could do so."""
    doc.assembly()
    _, extraction = file_bom(doc)
    assert extraction is not None
    assert extraction.entries == ()
    model = Doc("/v/model.FCStd")
    model.part("Model", Type="Assembly")
    assert file_bom(model)[1] is not None
    part = Doc("/v/part.FCStd")
    part.part("Part", part.body())
    assert file_bom(part)[1] is None
