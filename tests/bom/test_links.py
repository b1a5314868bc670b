# SPDX-License-Identifier: LGPL-2.1-or-later
"""The walker's main rules: what a component is, how it is counted, how levels are put together."""

from __future__ import annotations

from typing import Any

import pytest
from fakes import BareAssembly, BareDocument, BareLink, BarePart, BareThing, Doc, ForwardingLink, edit

from silo.bom import FindingCode, extract, extract_bom_links
from silo.bom.entry import BomEntry


def bolt_in(path: str = "/v/bolt.FCStd", **properties: Any) -> Any:
    return Doc(path).body(**properties)


def counts(entries: list[BomEntry] | tuple[BomEntry, ...]) -> dict[tuple[str, str], int]:
    return {entry.key: entry.quantity for entry in entries}


# --- components -------------------------------------------------------------------------------------------


def test_a_component_is_target_file_and_target_object() -> None:
    """Two objects of one file are two components; three links to one object are one component."""
    shop, top = Doc("/v/shop.FCStd"), Doc("/v/top.FCStd")
    screw, insert = shop.body("Screw"), shop.body("Insert")
    asm = top.assembly(
        top.link("L1", screw), top.link("L2", insert), top.link("L3", screw), top.link("L4", screw)
    )
    assert counts(extract_bom_links(asm)) == {("/v/shop.FCStd", "Screw"): 3, ("/v/shop.FCStd", "Insert"): 1}


def test_a_link_has_the_label_of_its_part_not_its_own() -> None:
    """An entry names the part, whatever the instance is called."""
    top = Doc("/v/top.FCStd")
    (entry,) = extract_bom_links(top.assembly(top.link("L1", bolt_in(Label="M8 bolt"), Label="left front")))
    assert (entry.label, entry.document_label) == ("M8 bolt", "bolt")


def test_entries_come_in_the_order_of_the_group() -> None:
    """A person finds the lines where the tree has them."""
    top = Doc("/v/top.FCStd")
    asm = top.assembly(*(top.link(f"L{n}", bolt_in(f"/v/{n}.FCStd")) for n in "cab"))
    assert [entry.doc_path for entry in extract_bom_links(asm)] == ["/v/c.FCStd", "/v/a.FCStd", "/v/b.FCStd"]


def test_a_link_into_its_own_file_is_no_component() -> None:
    """In-document links are no components (spec §1): what they show are own parts, no items yet."""
    top = Doc("/v/top.FCStd")
    found = extract(top.assembly(top.link("L1", top.body("Layout")), top.link("L2", bolt_in())))
    assert counts(found.entries) == {("/v/bolt.FCStd", "Body"): 1}
    assert counts(found.assembly.own) == {("/v/top.FCStd", "Layout"): 1}


def test_one_document_by_two_objects_is_still_one_document() -> None:
    """A reader may make several objects of one file; their path decides."""
    asm_doc, other_view = Doc("/v/top.FCStd"), Doc("/v/top.FCStd")
    found = extract(asm_doc.assembly(asm_doc.link("L1", other_view.body())))
    assert found.entries == ()
    assert counts(found.assembly.own) == {("/v/top.FCStd", "Body"): 1}


def test_a_symlinked_folder_does_not_make_two_components() -> None:
    """FreeCAD opens a file by two paths as two documents; ``canonical`` makes them one."""
    top = Doc("/alias/top.FCStd")
    asm = top.assembly(
        top.link("L1", bolt_in("/real/bolt.FCStd")),
        top.link("L2", bolt_in("/alias/bolt.FCStd")),
        top.link("L3", Doc("/real/top.FCStd").body("Layout")),
    )
    found = extract(asm, canonical=lambda path: path.replace("/alias/", "/real/"))
    assert counts(found.entries) == {("/real/bolt.FCStd", "Body"): 2}
    assert found.assembly.doc_path == "/real/top.FCStd"
    assert counts(found.assembly.own) == {("/real/top.FCStd", "Layout"): 1}


def test_places_of_findings_are_in_the_same_spelling_as_entries() -> None:
    """Whether a finding lies in the assembly's own file is asked by path; so there is one spelling."""
    top = Doc("/alias/top.FCStd")
    found = extract(
        top.assembly(top.link("L1", None)), canonical=lambda path: path.replace("/alias/", "/real/")
    )
    (finding,) = found.findings_of(FindingCode.BROKEN_LINK)
    assert finding.where[0].doc_path == found.assembly.doc_path == "/real/top.FCStd"


def test_each_path_is_made_canonical_once() -> None:
    """``os.path.realpath`` asks the disk; a thousand links to one file ask once."""
    asked: list[str] = []
    top, bolt = Doc("/v/top.FCStd"), bolt_in()

    def canonical(path: str) -> str:
        asked.append(path)
        return path

    extract(top.assembly(*(top.link(f"L{n}", bolt) for n in range(50))), canonical=canonical)
    assert sorted(asked) == ["/v/bolt.FCStd", "/v/top.FCStd"]


# --- quantities -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("count", "quantity"), [(0, 1), (1, 1), (4, 4), (1000, 1000)])
@pytest.mark.parametrize("shown", [True, False])
def test_a_link_array_counts_its_elements_once(count: int, quantity: int, shown: bool) -> None:
    """``max(1, ElementCount)``, whether its elements are shown as objects or not."""
    top = Doc("/v/top.FCStd")
    (entry,) = extract_bom_links(top.assembly(top.array("Arr", bolt_in(), count, shown=shown)))
    assert entry.quantity == quantity


def test_link_elements_are_never_counted_again() -> None:
    """Some versions list an array's elements in the Group as well; the array has counted them."""
    top = Doc("/v/top.FCStd")
    array = top.array("Arr", bolt_in(), 4)
    assert counts(extract_bom_links(top.assembly(array, *array.ElementList))) == {
        ("/v/bolt.FCStd", "Body"): 4
    }


def test_the_element_count_of_the_target_is_not_the_links() -> None:
    """A live link shows its target's ``ElementCount`` where it has none itself; only its own counts."""
    top, lib = Doc("/v/top.FCStd"), Doc("/v/lib.FCStd")
    link = ForwardingLink(top, "L1", lib.body(ElementCount=7))
    del link.__dict__["ElementCount"]
    edit(link)
    assert link.ElementCount == 7
    (entry,) = extract_bom_links(top.assembly(link))
    assert entry.quantity == 1


def test_hidden_links_count() -> None:
    """A designer hides things to work; the machine still has them."""
    top = Doc("/v/top.FCStd")
    asm = top.assembly(top.link("L1", bolt_in(Visibility=False), Visibility=False))
    found = extract(asm)
    assert counts(found.entries) == {("/v/bolt.FCStd", "Body"): 1}
    (finding,) = found.findings
    assert finding.message == "Hidden in Assembly: 1 piece counts: L1."


def test_a_link_python_is_a_link() -> None:
    """``App::LinkPython`` is derived from ``App::Link``."""
    top = Doc("/v/top.FCStd")
    asm = top.assembly(top.add("App::LinkPython", "L1", LinkedObject=bolt_in()))
    assert counts(extract_bom_links(asm)) == {("/v/bolt.FCStd", "Body"): 1}


# --- consolidation ----------------------------------------------------------------------------------------


def test_two_individual_links_are_worth_consolidating() -> None:
    """Individual links where one array would do are marked, with their number."""
    top, bolt = Doc("/v/top.FCStd"), bolt_in()
    (entry,) = extract_bom_links(top.assembly(top.link("L1", bolt), top.link("L2", bolt)))
    assert (entry.consolidation_warning, entry.individual_links, entry.link_objects) == (True, 2, 2)
    assert (entry.quantity, entry.instances) == (2, ("L1", "L2"))


def test_links_that_joints_hold_are_not_worth_consolidating() -> None:
    """FreeCAD's joints by a path or by the part itself, Assembly4's, Assembly3's: no array would do."""
    top, bolt = Doc("/v/top.FCStd"), bolt_in()
    links = [top.link(f"L{n}", bolt) for n in range(4)]
    group = top.add("Assembly::JointGroup", "Joints", Group=[])
    asm = top.assembly(*links, group)
    joints = [
        top.add("App::FeaturePython", "J1", Reference1=(asm, ["L0.Face1", "L0.Vertex1"]), Reference2=None),
        top.add("App::FeaturePython", "J2", Reference1=(links[1], ["Body.Edge1", "Body.Edge1"])),
    ]
    edit(group, Group=joints)
    (entry,) = extract_bom_links(asm)
    assert (entry.consolidation_warning, entry.individual_links) == (True, 4)  # two are free
    edit(group, Group=[*joints, top.add("App::FeaturePython", "Ground", ObjectToGround=links[2])])
    assert not extract_bom_links(asm)[0].consolidation_warning
    fourth = Doc("/v/fourth.FCStd")
    attached = [fourth.link(f"L{n}", bolt, AttachedTo="Plate#LCS") for n in range(2)]
    assert not extract_bom_links(fourth.assembly(*attached))[0].consolidation_warning
    assert extract_bom_links(fourth.assembly(*attached, fourth.array("A", bolt, 2), fourth.link("F", bolt)))[
        0
    ].consolidation_warning
    third = Doc("/v/third.FCStd")
    for constraints, worth in (([], True), ([third.add("Part::FeaturePython", "C")], False)):
        parts = [third.link(f"L{n}{worth}", bolt) for n in range(2)]
        groups = [
            third.add("Part::FeaturePython", f"G{n}{worth}", Group=found)
            for n, found in enumerate((constraints, [], parts))
        ]
        whole = third.add("Part::FeaturePython", f"A{worth}", Group=groups, BuildShape="None", Freeze=False)
        assert extract_bom_links(whole)[0].consolidation_warning is worth


def test_links_beside_an_array_are_worth_consolidating() -> None:
    """Both patterns for one part: the quantities add up, only the individual links are counted as such."""
    top, bolt = Doc("/v/top.FCStd"), bolt_in()
    links = [top.link(f"L{n}", bolt) for n in range(8)]
    (entry,) = extract_bom_links(top.assembly(*links, top.array("Arr", bolt, 4)))
    assert (entry.quantity, entry.consolidation_warning, entry.individual_links) == (12, True, 8)


def test_one_link_and_one_array_are_clean() -> None:
    """A single link object, array or not, needs no advice."""
    top = Doc("/v/top.FCStd")
    asm = top.assembly(top.link("L1", bolt_in("/v/a.FCStd")), top.array("A", bolt_in("/v/b.FCStd"), 6))
    assert [entry.consolidation_warning for entry in extract_bom_links(asm)] == [False, False]


def test_assembly_links_are_not_worth_consolidating() -> None:
    """An AssemblyLink cannot be an array; two of them are as it must be."""
    top, sub = Doc("/v/top.FCStd"), Doc("/v/sub.FCStd")
    inner = sub.assembly(sub.link("L1", bolt_in()))
    (entry,) = extract_bom_links(top.assembly(top.assembly_link("A1", inner), top.assembly_link("A2", inner)))
    assert (entry.quantity, entry.consolidation_warning, entry.individual_links) == (2, False, 0)


def test_a_group_shown_twice_is_no_pair_of_individual_links() -> None:
    """A link to a link group repeats the links in it; the one link to the part is still one."""
    top = Doc("/v/top.FCStd")
    bundle = top.link_group("Bundle", top.link("L1", bolt_in()))
    (entry,) = extract_bom_links(top.assembly(bundle, top.link("Again", bundle)))
    assert (entry.quantity, entry.consolidation_warning, entry.individual_links) == (2, False, 1)


# --- levels -----------------------------------------------------------------------------------------------


def gearbox() -> Any:
    """The spec's example: two gearboxes of one housing and four gears, and twelve bolts."""
    box_doc, top = Doc("/v/gearbox.FCStd"), Doc("/v/top.FCStd")
    gear, housing = bolt_in("/v/gear.FCStd"), bolt_in("/v/housing.FCStd")
    box = box_doc.assembly(box_doc.link("H", housing), box_doc.array("G", gear, 4))
    links = [top.link(f"B{n}", bolt_in("/v/m8.FCStd")) for n in range(1)]
    return top.assembly(
        top.assembly_link("Left", box),
        top.assembly_link("Right", box),
        *links,
        top.array("Bolts", links[0].LinkedObject, 11),
    )


def test_levels_are_counted_from_the_top_and_quantities_are_per_one_parent() -> None:
    """Direct children have level 1, theirs level 2; nothing is multiplied (spec §3)."""
    box, bolts = extract_bom_links(gearbox())
    assert (box.level, box.quantity, box.is_assembly) == (1, 2, True)
    assert [(c.doc_path, c.level, c.quantity) for c in box.children] == [
        ("/v/housing.FCStd", 2, 1),
        ("/v/gear.FCStd", 2, 4),
    ]
    assert (bolts.quantity, bolts.is_assembly, bolts.children) == (12, False, ())


def test_the_level_can_start_elsewhere() -> None:
    """``extract_bom_links(assembly, level)`` as in the spec's listing."""
    box, bolts = extract_bom_links(gearbox(), 3)
    assert (box.level, box.children[0].level, bolts.level) == (3, 4, 3)
    assert extract(gearbox(), level=3).assembly.level == 2


def test_a_sub_assembly_at_two_depths_has_the_level_of_each() -> None:
    """One sub-assembly in the top and in another sub-assembly: each occurrence says where it is."""
    small_doc, large_doc, top = Doc("/v/small.FCStd"), Doc("/v/large.FCStd"), Doc("/v/top.FCStd")
    small = small_doc.assembly(small_doc.link("L1", bolt_in()))
    large = large_doc.assembly(large_doc.link("S", small))
    direct, deep = extract_bom_links(top.assembly(top.link("S", small), top.link("G", large)))
    assert (direct.level, direct.children[0].level) == (1, 2)
    assert (deep.children[0].level, deep.children[0].children[0].level) == (2, 3)


def test_the_head_is_the_assembly_itself() -> None:
    """An extraction names the assembly that was walked, one level above its children, without children."""
    head = extract(gearbox()).assembly
    assert (head.doc_path, head.object_name, head.level, head.quantity) == ("/v/top.FCStd", "Assembly", 0, 1)
    assert (head.is_assembly, head.children) == (True, ())


def test_a_link_to_an_assembly_is_walked_as_the_assembly() -> None:
    """Who selects an instance in the tree means the assembly that it shows."""
    top = Doc("/v/top.FCStd")
    inner = Doc("/v/sub.FCStd")
    asm = inner.assembly(inner.link("L1", bolt_in()))
    for link in (top.link("L", asm), top.assembly_link("A", asm)):
        found = extract(link)
        assert found.assembly.doc_path == "/v/sub.FCStd"
        assert counts(found.entries) == {("/v/bolt.FCStd", "Body"): 1}


def test_a_broken_link_as_the_assembly_is_no_empty_bom() -> None:
    """A top that cannot be found must not read as an assembly without components."""
    top = Doc("/v/top.FCStd")
    copies = [top.link("C1", bolt_in())]
    for link in (top.link("L", None), top.assembly_link("A", None, copies)):
        found = extract(link)
        assert found.entries == ()
        assert found.blocked
        assert not found.findings_of(FindingCode.EMPTY_BOM)


# --- cycles -----------------------------------------------------------------------------------------------


def ring(*names: str) -> list[Any]:
    """Assemblies of which each holds the next, and the last the first; each also holds a bolt of its own."""
    docs = [Doc(f"/v/{name}.FCStd") for name in names]
    assemblies = [doc.assembly() for doc in docs]
    for doc, asm, following in zip(docs, assemblies, [*assemblies[1:], assemblies[0]], strict=True):
        edit(asm, Group=[doc.link("Next", following), doc.link("Own", bolt_in(f"/v/bolt-{doc.Label}.FCStd"))])
    return assemblies


def test_an_assembly_that_contains_itself_is_a_cycle_and_its_parts_still_count() -> None:
    """The ring is cut where it closes, the finding names it, and the BOM is blocked."""
    a, _ = ring("a", "b")
    found = extract(a)
    assert counts(found.entries) == {("/v/b.FCStd", "Assembly"): 1, ("/v/bolt-a.FCStd", "Body"): 1}
    assert counts(found.entries[0].children) == {("/v/bolt-b.FCStd", "Body"): 1}
    (finding,) = found.findings_of(FindingCode.CYCLE)
    assert finding.blocks
    assert "/v/a.FCStd#Assembly → /v/b.FCStd#Assembly → /v/a.FCStd#Assembly" in finding.message
    assert [str(place) for place in finding.where] == ["/v/b.FCStd#Next"]


def test_one_ring_is_one_finding_wherever_it_is_entered() -> None:
    """A ring below two sub-assemblies is reported once, with each link that closes it."""
    b, c = ring("b", "c")
    top = Doc("/v/top.FCStd")
    found = extract(top.assembly(top.link("L1", b), top.link("L2", c)))
    (finding,) = found.findings_of(FindingCode.CYCLE)
    assert [str(place) for place in finding.where] == ["/v/b.FCStd#Next", "/v/c.FCStd#Next"]


def test_no_component_stands_below_itself_however_the_ring_is_entered() -> None:
    """Two ways into one ring: what was walked on the first must not be reused where it closes the second."""
    docs = {name: Doc(f"/v/{name}.FCStd") for name in ("top", "one", "two", "three")}
    asm = {name: doc.assembly() for name, doc in docs.items()}
    for name, held in {
        "top": ("one", "two"),
        "one": ("three",),
        "two": ("three",),
        "three": ("two",),
    }.items():
        edit(asm[name], Group=[docs[name].link(f"To_{target}", asm[target]) for target in held])
    found = extract(asm["top"])

    def paths(entries: Any, above: tuple[str, ...] = ()) -> set[tuple[str, ...]]:
        names = {(*above, entry.document_label): entry.children for entry in entries}
        return set(names).union(*(paths(children, path) for path, children in names.items()))

    assert paths(found.entries) == {
        ("one",),
        ("one", "three"),
        ("one", "three", "two"),
        ("two",),
        ("two", "three"),
    }
    (finding,) = found.findings_of(FindingCode.CYCLE)
    assert [str(place) for place in finding.where] == ["/v/three.FCStd#To_two", "/v/two.FCStd#To_three"]


def test_two_documents_that_use_each_other_are_no_cycle() -> None:
    """A links a part of B and B links a part of A: documents form a ring, objects do not."""
    a, b = Doc("/v/a.FCStd"), Doc("/v/b.FCStd")
    part_a = a.body("PartOfA")
    sub = b.assembly(b.link("L", part_a))
    found = extract(a.assembly(a.link("S", sub)))
    assert counts(found.entries) == {("/v/b.FCStd", "Assembly"): 1}
    assert counts(found.entries[0].children) == {("/v/a.FCStd", "PartOfA"): 1}
    assert found.findings == ()


# --- objects with nothing but what the spec's listing touches -----------------------------------------------


def test_bare_objects_are_walked_as_the_listing_says() -> None:
    """No Name, no TypeId, no PropertiesList, parts without isDerivedFrom: what is absent counts as unset."""
    bolt = BarePart(BareDocument("/v/bolt.FCStd", "u-bolt"))
    plain = BarePart(BareDocument("/v/plain.FCStd"))
    top = BareDocument("/v/top.FCStd")
    asm = BareAssembly(
        top,
        BareLink(bolt),
        BareLink(bolt, count=4),
        BareLink(plain, count=0),
        BareThing(),
        BareLink(BarePart(top)),
    )
    entries = extract_bom_links(asm)
    assert [(e.doc_path, e.silo_uuid, e.quantity, e.level) for e in entries] == [
        ("/v/bolt.FCStd", "u-bolt", 5, 1),
        ("/v/plain.FCStd", None, 1, 1),
    ]
    assert [e.consolidation_warning for e in entries] == [True, False]


def test_bare_sub_assemblies_are_walked_by_their_group() -> None:
    """A target with a Group is an assembly, though it cannot say so."""
    bolt = BarePart(BareDocument("/v/bolt.FCStd", "u-bolt"))
    sub = BareAssembly(BareDocument("/v/sub.FCStd", "u-sub"), BareLink(bolt, count=3))
    (entry,) = extract_bom_links(BareAssembly(BareDocument("/v/top.FCStd"), BareLink(sub), BareLink(sub)))
    assert (entry.quantity, entry.silo_uuid, entry.is_assembly) == (2, "u-sub", True)
    assert [(c.doc_path, c.quantity, c.level) for c in entry.children] == [("/v/bolt.FCStd", 3, 2)]


def test_two_nameless_parts_of_one_file_stay_apart() -> None:
    """Without names the objects themselves tell which is which: never the file alone."""
    shop = BareDocument("/v/shop.FCStd")
    screw, nut = BarePart(shop), BarePart(shop)
    asm = BareAssembly(BareDocument("/v/top.FCStd"), BareLink(screw), BareLink(nut), BareLink(screw))
    assert sorted(entry.quantity for entry in extract_bom_links(asm)) == [1, 2]


def test_a_bare_broken_link_blocks_the_assembly_it_lies_in() -> None:
    """A link that knows nothing, not even its document, still is reported where it is missing."""
    found = extract(BareAssembly(BareDocument("/v/top.FCStd"), BareLink(None)))
    (finding,) = found.findings_of(FindingCode.BROKEN_LINK)
    assert found.blocked
    assert finding.where[0].doc_path == "/v/top.FCStd"


def test_a_bare_cycle_ends() -> None:
    """Also nameless assemblies cannot contain themselves."""
    asm = BareAssembly(BareDocument("/v/a.FCStd"))
    asm.Group.append(BareLink(BareAssembly(BareDocument("/v/b.FCStd"), BareLink(asm))))
    assert extract(asm).findings_of(FindingCode.CYCLE)


# --- live links forward attributes --------------------------------------------------------------------------


def test_forwarded_attributes_say_nothing_about_the_link() -> None:
    """A live link shows its target's Group, Suppressed, ScaleVector and so on as if they were its own."""
    top, lib = Doc("/v/top.FCStd"), Doc("/v/lib.FCStd")
    body = lib.body(
        "Body",
        Suppressed=True,
        SiloUUID="u-body",
        ScaleVector=(-1.0, 1.0, 1.0),
        Count=9,
        Base=None,
        Group=[lib.body("Feature")],
    )
    link = ForwardingLink(top, "L1", body)
    assert link.Suppressed is True
    found = extract(top.assembly(link))
    assert counts(found.entries) == {("/v/lib.FCStd", "Body"): 1}
    assert found.entries[0].silo_uuid == "u-body"
    assert found.findings == ()


def test_a_forwarding_link_to_an_assembly_is_one_sub_assembly() -> None:
    """Its members are found in the assembly, not a second time in the link."""
    top, sub = Doc("/v/top.FCStd"), Doc("/v/sub.FCStd")
    inner = sub.assembly(ForwardingLink(sub, "B", bolt_in()), Type="Assembly")
    (entry,) = extract_bom_links(top.assembly(ForwardingLink(top, "S", inner)))
    assert (entry.quantity, len(entry.children)) == (1, 1)
