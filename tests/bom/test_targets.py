# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where links lead: chains, sub-objects, arrays on the way, AssemblyLinks, and links that lead nowhere."""

from __future__ import annotations

from typing import Any

import pytest
from fakes import Doc, edit

from silo.bom import FindingCode, Severity, extract
from silo.bom.walk.document import LinkProblem, located, split_sub_name
from silo.bom.walk.targets import resolve_target


@pytest.fixture
def top() -> Doc:
    return Doc("/v/top.FCStd")


@pytest.fixture
def lib() -> Doc:
    return Doc("/v/lib.FCStd")


@pytest.fixture
def bolt() -> Any:
    return Doc("/v/bolt.FCStd").body()


def end(link: Any) -> tuple[Any, int]:
    target = resolve_target(link)
    return target.obj, target.instances


# --- chains -----------------------------------------------------------------------------------------------


def test_a_chain_is_followed_to_its_end(top: Doc, lib: Doc, bolt: Any) -> None:
    """A link to a link to a link means the last one's part."""
    assert end(top.link("A", lib.link("B", lib.link("C", bolt)))) == (bolt, 1)


def test_arrays_on_the_way_multiply(top: Doc, lib: Doc, bolt: Any) -> None:
    """Two of a link that shows an array of three, which repeats an array of four."""
    assert end(top.array("A", lib.link("B", lib.array("C", lib.array("D", bolt, 4), 3)), 2)) == (bolt, 24)


def test_a_link_to_an_element_of_an_array_is_one(top: Doc, bolt: Any) -> None:
    """FreeCAD allows a link to a shown element; it stands for one instance."""
    array = top.array("Arr", bolt, 5)
    assert end(top.link("L", array.ElementList[2])) == (bolt, 1)


@pytest.mark.parametrize("sub", ["1.", "Arr_i1."])
def test_a_sub_name_of_an_array_is_one_of_its_elements(top: Doc, bolt: Any, sub: str) -> None:
    """By number (hidden elements) or by name (shown ones): one of them, not the whole array."""
    assert end(top.link("L", (top.array("Arr", bolt, 5), sub))) == (bolt, 1)


def test_an_element_of_an_array_of_a_link_array(top: Doc, lib: Doc, bolt: Any) -> None:
    """One element of the outer array shows the whole inner one."""
    assert end(top.link("L", (top.array("Arr", lib.array("Inner", bolt, 3), 5), "1."))) == (bolt, 3)


def test_only_the_named_element_of_an_array_reports_mirroring(top: Doc, bolt: Any) -> None:
    """One of two elements is mirrored; a link to the other is not."""
    array = top.array("Arr", bolt, 2, ScaleList=[(1.0, 1.0, 1.0), (-1.0, 1.0, 1.0)])
    assert [resolve_target(top.link(f"L{n}", (array, f"{n}."))).mirrored for n in (0, 1)] == [False, True]


def test_a_chain_that_never_ends_is_a_finding(top: Doc) -> None:
    """A link to itself, by hand in the file; no hang, no crash."""
    one, two = top.link("One", None), top.link("Two", None)
    edit(one, LinkedObject=two)
    edit(two, LinkedObject=one)
    found = extract(top.assembly(one))
    (finding,) = found.findings_of(FindingCode.CYCLE)
    assert finding.blocks


# --- sub-objects ------------------------------------------------------------------------------------------


def test_a_sub_object_is_the_part(top: Doc, lib: Doc) -> None:
    """``(Part, "Inner.")``: the component is the inner object, not the part around it."""
    inner = lib.body("Inner")
    part = lib.part("Part", inner, lib.body("Other"))
    assert end(top.link("L", (part, "Inner."))) == (inner, 1)


def test_a_path_through_several_containers(top: Doc, lib: Doc) -> None:
    """``(Part, "Sub.Bolt.")`` goes down step by step."""
    bolt = lib.body("Bolt")
    part = lib.part("Part", lib.part("Sub", bolt))
    assert end(top.link("L", (part, "Sub.Bolt."))) == (bolt, 1)


def test_each_container_on_a_path_moves_the_part(top: Doc, lib: Doc) -> None:
    """The first counts only if the link takes over its placement, those further inside always."""
    inner = lib.part("Inner", lib.body("Bolt"))
    array = lib.array("Arr", inner, 3)
    link = top.link("L", (lib.part("Part", lib.part("Sub", array)), "Sub.Arr.1.Bolt."))
    way = [(step.obj.Name, step.index, step.by_link) for step in resolve_target(link).way]
    assert way == [("L", None, False), ("Part", None, True), ("Sub", None, False), ("Arr", 1, False)]


def test_a_path_through_links(top: Doc, lib: Doc, bolt: Any) -> None:
    """A step may be a link to another file; the way continues in its target."""
    sub = Doc("/v/sub.FCStd")
    part = sub.part("Sub", sub.link("B", bolt))
    outer = lib.part("Part", lib.link("S", part))
    assert end(top.link("L", (outer, "S.B."))) == (bolt, 1)


def test_a_path_through_an_assembly_link(top: Doc, lib: Doc, bolt: Any) -> None:
    """``(AssemblyLink, "L.")`` names a member of the assembly it stands for (measured in 1.0 and 1.1)."""
    asm = lib.assembly(lib.link("L", bolt))
    link = top.assembly_link("AL", asm)
    assert end(top.link("X", (link, "L."))) == (bolt, 1)


def test_a_path_through_an_array_element(top: Doc, lib: Doc) -> None:
    """``"0.Bolt."``: the bolt in the first of several."""
    bolt = lib.body("Bolt")
    array = lib.array("Arr", lib.part("Part", bolt), 3)
    assert end(top.link("L", (array, "0.Bolt."))) == (bolt, 1)


def test_a_sub_object_that_is_an_array_counts_as_one(top: Doc, lib: Doc, bolt: Any) -> None:
    """``(Part, "Arr.")`` shows the whole array."""
    part = lib.part("Part", lib.array("Arr", bolt, 4))
    assert end(top.link("L", (part, "Arr."))) == (bolt, 4)


def test_a_sub_object_by_label(top: Doc, lib: Doc) -> None:
    """``"$Label."`` finds by label, as FreeCAD lets a person write it."""
    inner = lib.body("Body001", Label="Left half")
    part = lib.part("Part", lib.body("Body"), inner)
    assert end(top.link("L", (part, "$Left half."))) == (inner, 1)


def test_a_member_of_a_link_group(top: Doc, lib: Doc, bolt: Any) -> None:
    """Groups list their members in ElementList."""
    assert end(top.link("L", (lib.link_group("G", lib.link("M", bolt)), "M."))) == (bolt, 1)


def test_a_feature_that_no_group_lists(top: Doc, lib: Doc) -> None:
    """Operands of a boolean are in no Group; the document knows them."""
    lib_base = lib.add("Part::Box", "Base")
    cut = lib.add("Part::Cut", "Cut")
    assert end(top.link("L", (cut, "Base."))) == (lib_base, 1)


def test_a_sub_name_without_its_dot(top: Doc, lib: Doc) -> None:
    """Scripts forget the dot behind an object's name; geometry names are never taken for objects."""
    inner = lib.body("Inner")
    part = lib.part("Part", inner, lib.body("Face1"))
    assert end(top.link("L1", (part, "Inner"))) == (inner, 1)
    assert resolve_target(top.link("L2", (part, "Face1"))).element == "Face1"


@pytest.mark.parametrize(
    "sub",
    ["Face1", "Edge12", "Inner.Vertex3", "?Face1", ";g1;SKT;:H1234,E.Edge3", ["Face1", "Face2"], ("Face1",)],
)
def test_geometry_at_the_end_makes_it_a_reference(top: Doc, lib: Doc, sub: Any) -> None:
    """Faces, edges, mapped and missing names: a reference to geometry, no component."""
    part = lib.part("Part", lib.body("Inner"))
    assert resolve_target(top.link("L", (part, sub))).element


@pytest.mark.parametrize("sub", ["", [], ()])
def test_an_empty_sub_name_is_the_object_itself(top: Doc, bolt: Any, sub: Any) -> None:
    """Nothing after the object: the object."""
    target = resolve_target(top.link("L", (bolt, sub)))
    assert (target.obj, target.element) == (bolt, "")


def test_a_missing_sub_object_is_reported_with_its_file(top: Doc, lib: Doc) -> None:
    """What is missing, in which file, and what uses it."""
    found = extract(top.assembly(top.link("L", (lib.part("Part"), "Gone."))))
    (finding,) = found.findings_of(FindingCode.MISSING_OBJECT)
    assert finding.blocks
    assert all(word in finding.message for word in ("/v/lib.FCStd", "Gone", "L"))


def test_a_sub_object_behind_a_broken_link_is_the_links_fault(top: Doc, lib: Doc) -> None:
    """The file behind a step is missing: that is what is reported, not a missing object."""
    step = lib.link("S", None, LinkProblem=LinkProblem(FindingCode.MISSING_FILE, "sub/sub.FCStd", "Sub"))
    found = extract(top.assembly(top.link("L", (lib.part("Part", step), "S.B."))))
    (finding,) = found.findings_of(FindingCode.MISSING_FILE)
    assert "/v/sub/sub.FCStd" in finding.message


def test_a_tuple_without_an_object_is_broken_as_any(top: Doc) -> None:
    """A reader may know the sub-name of a target that it could not load."""
    problem = LinkProblem(FindingCode.MISSING_FILE, "gone.FCStd", "Part")
    found = extract(top.assembly(top.link("L", (None, "Face1"), LinkProblem=problem)))
    assert found.findings_of(FindingCode.MISSING_FILE)


def test_sub_names_that_lead_through_each_other_end(top: Doc) -> None:
    """Two links whose targets lie inside each other: told as a cycle."""
    one, two = top.link("One", None), top.link("Two", None)
    edit(one, LinkedObject=(two, "X."))
    edit(two, LinkedObject=(one, "Y."))
    assert extract(top.assembly(one)).findings_of(FindingCode.CYCLE)


def test_sub_names_that_branch_without_end_end(top: Doc) -> None:
    """Each step asks twice as much as the one before: bounded work, and a finding."""
    inner = top.body("B")
    link = top.link("L0", top.part("P0", inner))
    for number in range(1, 60):
        part = top.part(f"P{number}", top.link(f"M{number}", (link, "B.")))
        link = top.link(f"L{number}", (part, f"M{number}.B."))
    assert extract(top.assembly(link)).findings


@pytest.mark.parametrize(
    ("sub", "split"),
    [
        ("", ([], "")),
        ("Face1", ([], "Face1")),
        ("Inner.", (["Inner"], "")),
        ("Sub.Bolt.", (["Sub", "Bolt"], "")),
        ("Sub.Bolt.Edge2", (["Sub", "Bolt"], "Edge2")),
        ("Inner.;g1;SKT.F.Face3", (["Inner"], ";g1;SKT.F.Face3")),
        (("Inner.Face1", "Inner.Face2"), (["Inner"], "Face1")),
    ],
)
def test_sub_names_are_split_as_freecad_writes_them(sub: Any, split: tuple[list[str], str]) -> None:
    """Objects end in a dot; mapped geometry names have dots of their own."""
    assert split_sub_name(sub) == split


# --- AssemblyLinks ----------------------------------------------------------------------------------------


def test_an_assembly_link_is_one_instance_of_its_assembly(top: Doc, lib: Doc, bolt: Any) -> None:
    """What it stands for is walked, its own copies are not (facts §1.4)."""
    inner = lib.link("B", bolt)
    asm = lib.assembly(inner)
    link = top.assembly_link("AL", asm, [top.link("B", inner)])
    found = extract(top.assembly(link))
    (entry,) = found.entries
    assert (entry.key, entry.quantity) == (("/v/lib.FCStd", "Assembly"), 1)
    assert [(c.key, c.quantity) for c in entry.children] == [(("/v/bolt.FCStd", "Body"), 1)]
    assert found.findings == ()


def test_an_assembly_link_of_an_assembly_link_is_the_real_assembly(top: Doc, lib: Doc, bolt: Any) -> None:
    """Nested ones point at the AssemblyLink of the middle document; the chain ends at the assembly."""
    inner_doc = Doc("/v/inner.FCStd")
    real = inner_doc.assembly(inner_doc.link("B", bolt))
    middle = lib.assembly_link("Mid", real)
    found = extract(top.assembly(top.assembly_link("AL", middle)))
    assert [entry.key for entry in found.entries] == [("/v/inner.FCStd", "Assembly")]


def test_rigid_or_flexible_makes_no_difference(top: Doc, lib: Doc, bolt: Any) -> None:
    """A flexible sub-assembly has joints of its own; the BOM is the same."""
    asm = lib.assembly(lib.link("B", bolt))
    joints = top.group("Assembly::JointGroup", "Joints")
    flexible = top.assembly_link("AL2", asm, [joints], Rigid=False)
    (entry,) = extract(top.assembly(top.assembly_link("AL1", asm), flexible)).entries
    assert entry.quantity == 2


def test_a_broken_assembly_link_blocks(top: Doc, lib: Doc, bolt: Any) -> None:
    """Its copies may still be shown; they are not taken for the assembly."""
    found = extract(top.assembly(top.assembly_link("AL", None, [top.link("B", lib.link("X", bolt))])))
    assert found.entries == ()
    assert found.blocked


# --- broken links -----------------------------------------------------------------------------------------


def broken(top: Doc, name: str, code: FindingCode, file: str = "", obj: str = "", detail: str = "") -> Any:
    return top.link(name, None, LinkProblem=LinkProblem(code, file, obj, detail))


BROKEN = [
    FindingCode.MISSING_FILE,
    FindingCode.MISSING_OBJECT,
    FindingCode.UNREADABLE_FILE,
    FindingCode.LFS_POINTER,
    FindingCode.OUTSIDE_ROOT,
    FindingCode.BROKEN_LINK,
    FindingCode.LOST_ASSEMBLY,
]


@pytest.mark.parametrize("code", BROKEN)
def test_each_kind_of_broken_link_is_its_own_finding(top: Doc, code: FindingCode) -> None:
    """It names what is missing and what uses it, once per file, and it blocks the sync."""
    links = [broken(top, f"L{n}", code, "parts/b.FCStd", "Box") for n in range(3)]
    (finding,) = extract(top.assembly(*links)).findings
    assert finding.code is code
    assert finding.blocks
    assert "/v/parts/b.FCStd" in finding.message
    assert all(f"L{n}" in finding.message for n in range(3))
    assert [place.obj for place in finding.where] == ["L0", "L1", "L2"]


def test_one_file_is_one_finding_however_its_path_is_written(top: Doc) -> None:
    """The top and a sub-assembly in another folder record two paths to the one file that is missing."""
    sub = Doc("/v/subs/sub.FCStd")
    inner = sub.assembly(broken(sub, "InSub", FindingCode.MISSING_FILE, "../parts/b.FCStd", "Box"))
    asm = top.assembly(
        broken(top, "InTop", FindingCode.MISSING_FILE, "parts/b.FCStd", "Box"), top.link("S", inner)
    )
    (finding,) = extract(asm).findings
    assert [str(place) for place in finding.where] == ["/v/subs/sub.FCStd#InSub", "/v/top.FCStd#InTop"]


def test_two_files_of_one_name_are_two_findings(top: Doc) -> None:
    """``b.FCStd`` beside the top is not ``b.FCStd`` beside the sub-assembly."""
    sub = Doc("/v/subs/sub.FCStd")
    inner = sub.assembly(broken(sub, "InSub", FindingCode.MISSING_FILE, "b.FCStd", "Box"))
    asm = top.assembly(broken(top, "InTop", FindingCode.MISSING_FILE, "b.FCStd", "Box"), top.link("S", inner))
    assert len(extract(asm).findings_of(FindingCode.MISSING_FILE)) == 2


def test_two_missing_objects_of_one_file_are_two_findings(top: Doc) -> None:
    """Each object that is gone is named."""
    links = [broken(top, f"L{obj}", FindingCode.MISSING_OBJECT, "b.FCStd", obj) for obj in ("Nut", "Bolt")]
    assert len(extract(top.assembly(*links)).findings) == 2


def test_a_missing_object_of_the_own_file_names_that_file(top: Doc) -> None:
    """An empty path means the document that holds the link."""
    (finding,) = extract(top.assembly(broken(top, "L", FindingCode.MISSING_OBJECT, "", "Gone"))).findings
    assert "/v/top.FCStd no longer holds the object Gone" in finding.message


def test_a_chain_that_breaks_far_away_names_the_far_file_and_the_near_link(top: Doc) -> None:
    """The file is missing beside the middle document; what uses it is the link in the assembly."""
    mid = Doc("/elsewhere/mid.FCStd")
    link = top.link("L", broken(mid, "Hop", FindingCode.MISSING_FILE, "b.FCStd", "Box"))
    (finding,) = extract(top.assembly(link)).findings
    assert "/elsewhere/b.FCStd" in finding.message
    assert [str(place) for place in finding.where] == ["/v/top.FCStd#L"]


def test_a_link_without_any_knowledge_is_broken_not_skipped(top: Doc) -> None:
    """``LinkedObject`` None and nobody to ask: it must not read as removed."""
    found = extract(top.assembly(top.link("L1", None), top.link("L2", None)))
    assert found.blocked
    assert len(found.findings_of(FindingCode.BROKEN_LINK)) == 2


def test_a_live_link_is_asked_by_the_callers_function(top: Doc) -> None:
    """For live objects, ``inspect`` finds out why there is no target."""
    asked = []

    def inspect(obj: Any) -> LinkProblem | None:
        asked.append(obj.Name)
        return LinkProblem(FindingCode.MISSING_FILE, "parts/b.FCStd", "Box") if obj.Name == "L1" else None

    found = extract(top.assembly(top.link("L1", None)), inspect=inspect)
    assert asked == ["Assembly", "L1"]
    assert found.findings_of(FindingCode.MISSING_FILE)


def test_a_live_component_of_a_damaged_file_is_a_missing_line(top: Doc, bolt: Any) -> None:
    """FreeCAD opens what it finds of a damaged file; the caller's function looks at the file itself."""

    def inspect(obj: Any) -> LinkProblem | None:
        damaged = LinkProblem(FindingCode.UNREADABLE_FILE, *key, "it is cut short")
        return damaged if obj is bolt else None

    key = (bolt.Document.FileName, bolt.Name)

    found = extract(top.assembly(top.link("L1", bolt), top.link("L2", bolt, ElementCount=3)), inspect=inspect)
    assert [(entry.key, entry.quantity, entry.missing) for entry in found.entries] == [(key, 4, True)]
    (finding,) = found.findings
    assert (finding.code, finding.severity) == (FindingCode.UNREADABLE_FILE, Severity.ERROR)
    assert "it is cut short" in finding.message


def test_a_damaged_live_assembly_is_not_read(top: Doc, bolt: Any) -> None:
    """What FreeCAD opened of it may be a part of it only."""
    assembly = top.assembly(top.link("L1", bolt))

    def inspect(obj: Any) -> LinkProblem | None:
        damaged = LinkProblem(FindingCode.UNREADABLE_FILE, top.FileName, obj.Name, "it is cut short")
        return damaged if obj is assembly else None

    found = extract(assembly, inspect=inspect)
    assert (found.entries, found.blocked) == ((), True)
    assert found.findings_of(FindingCode.UNREADABLE_FILE)


def test_the_reason_is_reported(top: Doc) -> None:
    """What the reader found out stands in the message."""
    link = broken(top, "L", FindingCode.UNREADABLE_FILE, "b.FCStd", "Box", "it is not a zip file")
    (finding,) = extract(top.assembly(link)).findings
    assert "it is not a zip file" in finding.message


def test_many_users_do_not_make_a_message_endless(top: Doc) -> None:
    """A thousand links to a missing file: some names and a number, all places."""
    links = [broken(top, f"L{n:04}", FindingCode.MISSING_FILE, "b.FCStd", "Box") for n in range(1000)]
    (finding,) = extract(top.assembly(*links)).findings
    assert len(finding.message) < 200
    assert "992 more" in finding.message
    assert len(finding.where) == 1000


@pytest.mark.parametrize(
    ("recorded", "owner", "path"),
    [
        ("b.FCStd", "/v/top.FCStd", "/v/b.FCStd"),
        ("../b.FCStd", "/v/sub/top.FCStd", "/v/b.FCStd"),
        ("./x/./b.FCStd", "/v/top.FCStd", "/v/x/b.FCStd"),
        ("/abs/b.FCStd", "/v/top.FCStd", "/abs/b.FCStd"),
        ("C:/parts/b.FCStd", "/v/top.FCStd", "C:/parts/b.FCStd"),
        ("https://silo/b.FCStd", "/v/top.FCStd", "https://silo/b.FCStd"),
        ("b.FCStd", "", "b.FCStd"),
    ],
)
def test_recorded_paths_are_located_as_text(recorded: str, owner: str, path: str) -> None:
    """Relative to the folder of the owning file (facts §3.3); what stands for itself stays."""
    assert located(recorded, owner) == path


def test_a_long_path_through_many_links_is_no_loop(top: Doc, bolt: Any) -> None:
    """Twenty links one after another, each followed and left again; only links within links are bounded."""
    container = Doc("/v/innermost.FCStd")
    shown = container.part("P", container.link("B", bolt))
    for number in range(20):
        doc = Doc(f"/v/{number}.FCStd")
        shown = doc.part("P", doc.link("S", shown))
    assert end(top.link("L", (shown, "S." * 20 + "B."))) == (bolt, 1)
