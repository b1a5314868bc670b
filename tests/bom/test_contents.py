# SPDX-License-Identifier: LGPL-2.1-or-later
"""What lies in one assembly: inline containers, groups, folders, arrays, and what is no component."""

from __future__ import annotations

from typing import Any

import pytest
from fakes import Doc, edit

from silo.bom import FindingCode, Severity, extract, extract_bom_links
from silo.bom.entry import Extraction
from silo.bom.findings import Finding
from silo.bom.walk.document import LinkProblem

BOLT = ("/v/bolt.FCStd", "Body")
PLATE = ("/v/plate.FCStd", "Body")


@pytest.fixture
def top() -> Doc:
    return Doc("/v/top.FCStd")


@pytest.fixture
def bolt() -> Any:
    return Doc("/v/bolt.FCStd").body()


@pytest.fixture
def plate() -> Any:
    return Doc("/v/plate.FCStd").body()


def counts(found: Extraction) -> dict[tuple[str, str], int]:
    return {entry.key: entry.quantity for entry in found.entries}


def own(found: Extraction) -> dict[str, int]:
    return {line.object_name: line.quantity for line in found.assembly.own}


def only(found: Extraction, code: FindingCode) -> Finding:
    (finding,) = found.findings_of(code)
    return finding


# --- inline parts and assemblies, groups, folders -----------------------------------------------------------


def test_thousands_of_nested_parts_are_no_trouble(top: Doc, bolt: Any) -> None:
    """The depth of a file is the file's affair, not Python's."""
    inner: Any = top.link("L1", bolt)
    for number in range(1500):
        inner = top.part(f"P{number}", inner)
    assert counts(extract(top.assembly(inner))) == {BOLT: 1}


@pytest.mark.parametrize("first", ["group", "member"])
def test_link_group_members_also_in_the_assembly_count_once(top: Doc, bolt: Any, first: str) -> None:
    """FreeCAD may list a member in the assembly's Group and in the group's ElementList, in any order."""
    link = top.link("L1", bolt)
    bundle = top.link_group("Bundle", link)
    members = (bundle, link) if first == "group" else (link, bundle)
    assert counts(extract(top.assembly(*members))) == {BOLT: 1}


def test_a_link_to_a_group_outside_the_assembly_counts_what_the_group_bundles(top: Doc, bolt: Any) -> None:
    """The group may lie beside the assembly and be shown only through the link."""
    bundle = top.link_group("Bundle", top.link("L1", bolt))
    assert counts(extract(top.assembly(top.array("Twice", bundle, 2)))) == {BOLT: 2}


def test_groups_of_links_to_groups_multiply(top: Doc, bolt: Any) -> None:
    """Twelve groups, each shown twice by the next: 2^12 bolts, without walking 4096 of them."""
    group = top.link_group("G0", top.link("L", bolt))
    for number in range(1, 13):
        group = top.link_group(f"G{number}", *(top.link(f"G{number}{side}", group) for side in "ab"))
    assert counts(extract(top.assembly(group))) == {BOLT: 4096}


def test_a_group_that_links_to_itself_ends_with_a_finding(top: Doc, bolt: Any) -> None:
    """FreeCAD says so on the console only; a walker needs its own guard."""
    bundle = top.link_group("Bundle")
    edit(bundle, ElementList=[top.link("Self", bundle), top.link("L1", bolt)])
    found = extract(top.assembly(bundle))
    assert only(found, FindingCode.CYCLE).blocks


def test_an_endless_row_of_groups_is_cut(top: Doc, bolt: Any) -> None:
    """Hundreds of groups that each link to the next are an attack; they are reported, and nothing crashes."""
    group = top.link_group("G", top.link("L", bolt))
    for number in range(500):
        group = top.link_group(f"G{number}", top.link(f"L{number}", group))
    assert only(extract(top.assembly(group)), FindingCode.TOO_DEEP).blocks


def test_a_link_to_a_link_group_of_another_file_is_a_sub_assembly(top: Doc, bolt: Any) -> None:
    """A group in another file is a component like any target, and what it holds are its children."""
    kit = Doc("/v/kit.FCStd")
    (entry,) = extract_bom_links(top.assembly(top.link("L", kit.link_group("Kit", kit.array("B", bolt, 4)))))
    assert (entry.key, entry.quantity, entry.is_assembly) == (("/v/kit.FCStd", "Kit"), 1, True)
    assert [(child.key, child.quantity) for child in entry.children] == [(BOLT, 4)]


@pytest.mark.parametrize("flattened", [True, False])
def test_a_folder_hides_nothing_and_doubles_nothing(top: Doc, bolt: Any, flattened: bool) -> None:
    """FreeCAD lists a folder's content in the assembly's Group as well; with and without, it counts once."""
    link = top.link("L1", bolt)
    folder = top.folder("Fasteners", link)
    asm = top.assembly(folder, link) if flattened else top.assembly(folder)
    assert counts(extract(asm)) == {BOLT: 1}


def test_containers_that_hold_each_other_end(top: Doc, bolt: Any) -> None:
    """A damaged file may have parts in a ring; each object is looked at once."""
    one, two = top.part("One"), top.part("Two", top.link("L1", bolt))
    edit(one, Group=[two])
    edit(two, Group=[*two.Group, one])
    assert counts(extract(top.assembly(one))) == {BOLT: 1}


# --- Assembly3, Assembly4 ---------------------------------------------------------------------------------


def test_assembly3_counts_its_parts_group_only(top: Doc, bolt: Any, plate: Any) -> None:
    """An Assembly3 Group is [constraints, elements, parts]; element links are references, no components."""
    constraints = top.group("Part::FeaturePython", "Constraints", top.link("C1", (bolt, "Face1")))
    elements = top.group("Part::FeaturePython", "Elements", top.link("E1", plate))
    parts = top.group("Part::FeaturePython", "Parts", top.link("P1", bolt), top.link("P2", plate))
    asm3 = top.group("Part::FeaturePython", "Asm", constraints, elements, parts, BuildShape="", Freeze=False)
    found = extract(asm3)
    assert counts(found) == {BOLT: 1, PLATE: 1}
    assert found.assembly.is_assembly


def test_assembly3_as_a_component(top: Doc, bolt: Any) -> None:
    """A link to an Assembly3 container is a sub-assembly with its parts."""
    lib = Doc("/v/a3.FCStd")
    parts = lib.group("Part::FeaturePython", "Parts", lib.link("P1", bolt))
    empty = [lib.group("Part::FeaturePython", name) for name in ("Constraints", "Elements")]
    asm3 = lib.group("Part::FeaturePython", "Asm", *empty, parts, BuildShape="", Freeze=False)
    (entry,) = extract_bom_links(top.assembly(top.link("L", asm3)))
    assert entry.is_assembly
    assert [child.key for child in entry.children] == [BOLT]


def test_assembly4_model(top: Doc, bolt: Any) -> None:
    """An Assembly4 model is an ``App::Part`` of Type "Assembly" with helper folders among its links."""
    model = top.part(
        "Model",
        top.add("PartDesign::CoordinateSystem", "LCS_Origin"),
        top.folder("Constraints", top.add("App::FeaturePython", "Variables")),
        top.link("L1", bolt, AssemblyType="Part::Link", AttachedTo="Parent Assembly#LCS_Origin"),
        Type="Assembly",
    )
    found = extract(model)
    assert counts(found) == {BOLT: 1}
    assert found.findings == ()


# --- plain links to assemblies ----------------------------------------------------------------------------


@pytest.mark.parametrize("type_id", ["Assembly::AssemblyObject", "App::Part"])
def test_a_plain_link_to_an_assembly_is_a_sub_assembly(top: Doc, bolt: Any, type_id: str) -> None:
    """Not only an AssemblyLink makes a sub-assembly (facts §1.4); arrays of them multiply."""
    sub = Doc("/v/sub.FCStd")
    inner = sub.group(type_id, "Asm", sub.link("L1", bolt))
    (entry,) = extract_bom_links(top.assembly(top.link("S1", inner), top.array("S2", inner, 2)))
    assert (entry.quantity, entry.is_assembly) == (3, True)
    assert [(child.key, child.quantity) for child in entry.children] == [(BOLT, 1)]


def test_a_part_without_links_is_a_part(top: Doc) -> None:
    """An ``App::Part`` with a body in it is a part; an empty assembly says that it is one."""
    doc = Doc("/v/part.FCStd")
    part, empty = doc.part("Part", doc.body()), Doc("/v/empty.FCStd").assembly()
    entries = extract_bom_links(top.assembly(top.link("L1", part), top.link("L2", empty)))
    assert [entry.is_assembly for entry in entries] == [False, True]


def test_an_assembly_whose_links_are_all_broken_still_is_one(top: Doc) -> None:
    """What it holds is unknown, not nothing; it is not taken for a part."""
    doc = Doc("/v/sub.FCStd")
    (entry,) = extract_bom_links(top.assembly(top.link("L1", doc.part("Sub", doc.link("X", None)))))
    assert entry.is_assembly


# --- suppressed, excluded, mirrored, variants ---------------------------------------------------------------


def test_suppressed_joints_are_not_worth_a_word(top: Doc, bolt: Any) -> None:
    """In FreeCAD 1.1 joints are suppressed too; they are no components either way."""
    joint = top.add("App::FeaturePython", "Fixed", JointType="Fixed", Suppressed=True)
    assert extract(top.assembly(joint, top.link("L1", bolt))).findings == ()


@pytest.mark.parametrize("marked", ["link", "target", "hop"])
def test_excluded_components_do_not_count_and_are_reported(
    top: Doc, bolt: Any, plate: Any, marked: str
) -> None:
    """``SiloBomExclude`` on the link, on its target, or on a link between the two."""
    hop = Doc("/v/mid.FCStd").link("Hop", bolt, SiloBomExclude=marked == "hop")
    edit(bolt, SiloBomExclude=marked == "target")
    found = extract(top.assembly(top.link("L1", hop, SiloBomExclude=marked == "link"), top.link("L2", plate)))
    assert counts(found) == {PLATE: 1}
    assert only(found, FindingCode.EXCLUDED).where[0].obj == "L1"


def test_exclude_is_not_guessed(top: Doc, bolt: Any) -> None:
    """Only true excludes; false, unset and odd values do not."""
    links = [top.link(f"L{n}", bolt, SiloBomExclude=value) for n, value in enumerate((False, None, "", "no"))]
    assert counts(extract(top.assembly(*links))) == {BOLT: 4}


@pytest.mark.parametrize("mark", ["Suppressed", "SiloBomExclude"])
@pytest.mark.parametrize("kind", ["part", "folder", "link_group"])
@pytest.mark.parametrize("container_first", [True, False])
def test_what_lies_in_something_left_out_is_left_out(
    top: Doc, bolt: Any, plate: Any, mark: str, kind: str, container_first: bool
) -> None:
    """Also where FreeCAD lists the members in the assembly's own Group as well, in any order."""
    link = top.link("L1", bolt)
    container = getattr(top, kind)("C", link, **{mark: True})
    members = [container, link] if container_first else [link, container]
    found = extract(top.assembly(*members, top.link("L2", plate)))
    assert counts(found) == {PLATE: 1}
    assert [finding.where[0].obj for finding in found.findings] == ["C"]


@pytest.mark.parametrize("outer_first", [True, False])
def test_what_goes_with_its_container_needs_no_word_of_its_own(
    top: Doc, bolt: Any, outer_first: bool
) -> None:
    """A suppressed link in a suppressed folder in another one, all in the assembly's Group: one finding."""
    link = top.link("L1", bolt, Suppressed=True)
    inner = top.folder("Inner", link, Suppressed=True)
    members = [top.folder("Outer", inner, Suppressed=True), inner, link]
    found = extract(top.assembly(*(members if outer_first else reversed(members))))
    assert [finding.where[0].obj for finding in found.findings_of(FindingCode.SUPPRESSED)] == ["Outer"]


def test_a_link_to_an_excluded_group_brings_nothing(top: Doc, bolt: Any) -> None:
    """The target's own mark counts for groups as well."""
    bundle = top.link_group("Bundle", top.link("L1", bolt), SiloBomExclude=True)
    found = extract(top.assembly(top.link("Again", bundle)))
    assert counts(found) == {}
    assert found.findings_of(FindingCode.EXCLUDED)


@pytest.mark.parametrize(
    ("scale", "mirrored"),
    [
        ({"ScaleVector": (-1.0, 1.0, 1.0)}, True),
        ({"ScaleVector": (-1.0, -1.0, 1.0)}, False),
        ({"ScaleVector": (-1.0, -1.0, -1.0), "Scale": -1.0}, True),
        ({"ScaleVector": (2.0, 2.0, 2.0), "Scale": 2.0}, False),
        ({"Scale": -1.0}, True),
        ({"ElementCount": 2, "ScaleList": [(1.0, 1.0, 1.0), (1.0, -1.0, 1.0)]}, True),
        ({"ElementCount": 2, "ScaleList": [(1.0, 1.0, 1.0), (1.0, 1.0, 1.0)]}, False),
    ],
)
def test_mirrored_components_count_under_their_source_and_are_reported(
    top: Doc, bolt: Any, scale: dict[str, Any], mirrored: bool
) -> None:
    """An odd number of negative axes makes the other hand of a part."""
    found = extract(top.assembly(top.link("L1", bolt, **scale)))
    assert counts(found) == {BOLT: scale.get("ElementCount", 1)}
    assert bool(found.findings_of(FindingCode.MIRRORED)) is mirrored


def test_mirrored_twice_is_not_mirrored(top: Doc, bolt: Any) -> None:
    """A mirrored link to a mirrored link shows the original hand."""
    hop = Doc("/v/mid.FCStd").link("Hop", bolt, ScaleVector=(-1.0, 1.0, 1.0))
    found = extract(top.assembly(top.link("L1", hop, ScaleVector=(1.0, -1.0, 1.0))))
    assert not found.findings_of(FindingCode.MIRRORED)


def test_a_mirrored_bundle_is_reported(top: Doc, bolt: Any) -> None:
    """A mirrored link to a link group mirrors all that is in it."""
    bundle = top.link_group("Bundle", top.link("L1", bolt))
    found = extract(top.assembly(bundle, top.link("Other", bundle, ScaleVector=(-1.0, 1.0, 1.0))))
    assert counts(found) == {BOLT: 2}
    assert only(found, FindingCode.MIRRORED).where[0].obj == "Other"


def test_a_variant_counts_under_its_source_and_is_reported(top: Doc, bolt: Any) -> None:
    """A copy-on-change link shows a local copy; the part is the source."""
    copy = top.body("BoltCopy")
    hidden = top.link_group("CopyOnChangeGroup", copy)
    link = top.link("L1", copy, LinkCopyOnChange="Owned", LinkCopyOnChangeSource=bolt)
    found = extract(top.assembly(link, top.link("L2", bolt), hidden))
    assert counts(found) == {BOLT: 2}
    assert only(found, FindingCode.VARIANT).where[0].obj == "L1"
    assert len(found.findings) == 1


def test_a_source_that_is_shown_itself_is_no_variant(top: Doc, bolt: Any) -> None:
    """FreeCAD may note the source before anything was changed."""
    link = top.link("L1", bolt, LinkCopyOnChange="Enabled", LinkCopyOnChangeSource=bolt)
    assert extract(top.assembly(link)).findings == ()


def test_a_variant_that_lost_its_source_is_broken(top: Doc) -> None:
    """A local copy whose original is gone must not read as construction geometry."""
    link = top.link("L1", top.body("Copy"), LinkCopyOnChange="Owned")
    found = extract(top.assembly(link))
    assert found.blocked
    assert "original" in only(found, FindingCode.BROKEN_LINK).message


# --- Draft arrays -----------------------------------------------------------------------------------------


def draft(top: Doc, name: str, base: Any, count: int, **properties: Any) -> Any:
    return top.add("Part::FeaturePython", name, Base=base, Count=count, **properties)


@pytest.mark.parametrize("array_first", [True, False])
def test_a_draft_array_of_a_link_counts_its_elements(top: Doc, bolt: Any, array_first: bool) -> None:
    """Count × the link; the original is the array's first element and is not counted beside it."""
    link = top.link("L1", bolt)
    array = draft(top, "Array", link, 6)
    found = extract(top.assembly(*((array, link) if array_first else (link, array))))
    assert counts(found) == {BOLT: 6}
    assert only(found, FindingCode.DRAFT_ARRAY).where[0].obj == "Array"
    assert found.entries[0].instances == ("Array",)


def test_two_draft_arrays_of_one_link_add_up(top: Doc, bolt: Any) -> None:
    """Each array shows its own elements."""
    link = top.link("L1", bolt)
    assert counts(extract(top.assembly(link, draft(top, "A", link, 2), draft(top, "B", link, 3)))) == {
        BOLT: 5
    }


def test_a_draft_array_of_an_inline_part_repeats_what_it_holds(top: Doc, bolt: Any, plate: Any) -> None:
    """The part is the first element; its content is not counted beside the array."""
    inner = top.part("Inner", top.link("L1", bolt), top.array("L2", plate, 2))
    assert counts(extract(top.assembly(inner, draft(top, "A", inner, 3)))) == {BOLT: 3, PLATE: 6}


def test_draft_arrays_in_a_ring_end(top: Doc) -> None:
    """Two arrays of each other hold nothing, and are reported."""
    one, two = draft(top, "One", None, 2), draft(top, "Two", None, 2)
    edit(one, Base=two)
    edit(two, Base=one)
    assert extract(top.assembly(draft(top, "Three", one, 2))).findings_of(FindingCode.CYCLE)


def test_a_draft_array_of_something_left_out_brings_nothing(top: Doc, bolt: Any, plate: Any) -> None:
    """Its original is suppressed, so there is nothing to repeat."""
    link = top.link("L1", bolt, Suppressed=True)
    found = extract(top.assembly(link, draft(top, "A", link, 2), top.link("L2", plate)))
    assert counts(found) == {PLATE: 1}


def test_a_suppressed_draft_array_leaves_its_original(top: Doc, bolt: Any) -> None:
    """Without the array, the link is a component like any other."""
    link = top.link("L1", bolt)
    assert counts(extract(top.assembly(link, draft(top, "A", link, 6, Suppressed=True)))) == {BOLT: 1}


def test_a_draft_array_of_a_body_shows_so_many_of_it(top: Doc, bolt: Any) -> None:
    """A pattern of a body that is modelled here is no component, but so many own parts."""
    body = top.body("Rib")
    found = extract(top.assembly(body, draft(top, "Ribs", body, 5), top.link("L1", bolt)))
    assert counts(found) == {BOLT: 1}
    assert own(found) == {"Rib": 5}
    assert "Rib" in only(found, FindingCode.LOCAL_GEOMETRY).message


# --- what is no component ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("type_id", "properties"),
    [
        ("Assembly::JointGroup", {}),
        ("App::FeaturePython", {"JointType": "Fixed"}),
        ("App::FeaturePython", {"ObjectToGround": None}),
        ("Assembly::BomGroup", {}),
        ("Assembly::BomObject", {}),
        ("Assembly::ViewGroup", {}),
        ("Assembly::SimulationGroup", {}),
        ("Spreadsheet::Sheet", {}),
        ("App::VarSet", {}),
        ("Sketcher::SketchObject", {}),
        ("PartDesign::Plane", {}),
        ("PartDesign::CoordinateSystem", {}),
        ("PartDesign::SubShapeBinder", {}),
        ("App::Origin", {}),
        ("App::Line", {}),
        ("App::TextDocument", {}),
    ],
)
def test_helpers_are_no_components_and_need_no_word(
    top: Doc, bolt: Any, type_id: str, properties: dict[str, Any]
) -> None:
    """Joints, sheets, datums and their groups stand in ``Group`` (flattened, even) and mean nothing here."""
    helper = top.add(type_id, "Helper", **properties)
    found = extract(top.assembly(helper, top.link("L1", bolt)))
    assert counts(found) == {BOLT: 1}
    assert found.findings == ()


def test_links_in_groups_of_joints_and_views_do_not_count(top: Doc, bolt: Any) -> None:
    """An exploded view refers to components that are counted elsewhere."""
    view = top.group("Assembly::ViewGroup", "Views", top.link("InView", bolt))
    assert counts(extract(top.assembly(view, top.link("L1", bolt)))) == {BOLT: 1}


@pytest.mark.parametrize(
    ("type_id", "words"),
    [
        ("Spreadsheet::Sheet", "a spreadsheet"),
        ("App::VarSet", "a set of variables"),
        ("Sketcher::SketchObject", "a sketch"),
        ("PartDesign::Plane", "a datum"),
        ("App::LocalCoordinateSystem", "a coordinate system"),
        ("Assembly::JointGroup", "a group of joints or views"),
    ],
)
def test_links_to_helpers_of_other_files_are_no_components(
    top: Doc, bolt: Any, type_id: str, words: str
) -> None:
    """FreeCAD lets a link point at a sheet or a sketch of another file; that is no part, and is reported."""
    helper = Doc("/v/master.FCStd").add(type_id, "Helper")
    found = extract(top.assembly(top.link("L1", helper), top.link("L2", bolt)))
    assert counts(found) == {BOLT: 1}
    finding = only(found, FindingCode.NO_COMPONENT)
    assert words in finding.message
    assert finding.severity is Severity.INFO


def test_a_link_to_a_joint_is_no_component(top: Doc) -> None:
    """A joint is an ``App::FeaturePython`` that its properties give away."""
    joint = Doc("/v/sub.FCStd").add("App::FeaturePython", "Fixed", JointType="Fixed")
    assert extract(top.assembly(top.link("L1", joint))).findings_of(FindingCode.NO_COMPONENT)


@pytest.mark.parametrize("type_id", ["PartDesign::SubShapeBinder", "Part::FeaturePython", "Mesh::Feature"])
def test_a_link_to_any_shape_of_another_file_is_a_component(top: Doc, type_id: str) -> None:
    """What has a shape may be a part; it is not lost for its type."""
    shape = Doc("/v/shape.FCStd").add(type_id, "Shape")
    assert counts(extract(top.assembly(top.link("L1", shape)))) == {("/v/shape.FCStd", "Shape"): 1}


def test_a_reference_to_a_face_is_no_component(top: Doc, bolt: Any) -> None:
    """A link with a sub-element is a reference (Assembly3 elements, constraints)."""
    found = extract(top.assembly(top.link("L1", (bolt, "Face1")), top.link("L2", bolt)))
    assert counts(found) == {BOLT: 1}
    assert "Face1" in only(found, FindingCode.SUB_ELEMENT_LINK).message


def test_own_parts_are_lines_and_one_finding(top: Doc, bolt: Any) -> None:
    """What is modelled in the assembly's file is listed with its count; what a cut uses up is not."""
    base, tool = top.add("Part::Box", "Base"), top.add("Part::Box", "Tool")
    cut = top.add("Part::Cut", "Cut", Base=base, Tool=tool)
    found = extract(top.assembly(base, tool, cut, top.link("L1", bolt)))
    assert own(found) == {"Cut": 1}
    assert all(line.silo_uuid is None for line in found.assembly.own)
    finding = only(found, FindingCode.LOCAL_GEOMETRY)
    assert finding.severity is Severity.WARNING
    assert "1 own part is no item" in finding.message


def test_local_geometry_of_parts_is_not_reported(top: Doc) -> None:
    """That a part consists of a body is what a part is."""
    doc = Doc("/v/part.FCStd")
    assert extract(top.assembly(top.link("L1", doc.part("Part", doc.body())))).findings == ()


def test_what_a2plus_imported_is_the_part_in_its_file(top: Doc, bolt: Any) -> None:
    """A2plus embeds shapes and links nothing; ``sourceFile`` says what each part is."""
    problem = LinkProblem(FindingCode.MISSING_FILE, "./gone.FCStd")
    top.__dict__["imported"] = lambda file, _part: problem if "gone" in file else bolt

    def part(name: str, file: str) -> Any:
        return top.add("Part::FeaturePython", name, sourceFile=file, a2p_Version="0.4")

    parts = [part("A", "./bolt.FCStd"), part("B", ".\\bolt.FCStd"), part("C", "./gone.FCStd"), part("D", "")]
    found = extract(top.assembly(*parts, top.link("L1", bolt)))
    assert counts(found) == {BOLT: 3, ("/v/gone.FCStd", ""): 1}
    assert own(found) == {"D": 1}
    assert [place.obj for place in only(found, FindingCode.FOREIGN_COMPONENT).where] == ["D"]
    assert only(found, FindingCode.MISSING_FILE).blocks


def test_an_in_document_link_to_something_with_components_counts_them(top: Doc, bolt: Any) -> None:
    """One rule of repetition: FreeCAD shows what the part holds once more, and so it counts."""
    spare = top.part("Spare", top.folder("F", top.link("L1", bolt)))
    found = extract(top.assembly(top.link("Shown", spare), top.link("L2", bolt)))
    assert counts(found) == {BOLT: 2}
    assert not found.findings_of(FindingCode.IN_DOCUMENT_LINK)


def test_a_chain_through_the_own_file_ends_in_the_other(top: Doc, bolt: Any) -> None:
    """Where a link ends decides, not its first hop."""
    source = top.link("Source", bolt)
    assert counts(extract(top.assembly(top.link("L1", source)))) == {BOLT: 1}


def test_a_chain_through_another_file_back_home_shows_an_own_part(top: Doc) -> None:
    """The end lies in the assembly's own file."""
    there = Doc("/v/mid.FCStd").link("There", top.body("Layout"))
    found = extract(top.assembly(top.link("L1", there)))
    assert (found.entries, own(found)) == ((), {"Layout": 1})


@pytest.mark.parametrize(
    ("code", "file", "lines"),
    [
        (FindingCode.MISSING_FILE, "parts/gone.FCStd", {("/v/parts/gone.FCStd", "Body"): 8}),
        (FindingCode.LFS_POINTER, "gone.FCStd", {("/v/gone.FCStd", "Body"): 8}),
        (FindingCode.UNSET_LINK, "", {}),
        (FindingCode.BROKEN_LINK, "", {}),
    ],
)
def test_a_missing_component_is_counted_like_any_other(
    code: FindingCode, file: str, lines: dict[tuple[str, str], int]
) -> None:
    """Its arrays multiply, its group counts; only a link that records no file has no line."""
    top = Doc("/v/top.FCStd")
    lost = top.link("Lost", None, ElementCount=3, LinkProblem=LinkProblem(code, file, "Body"))
    again = top.link("Again", None, LinkProblem=LinkProblem(code, file, "Body"))
    array = top.add("Part::FeaturePython", "Array", Base=lost, Count=2)
    group = top.link_group("Group", again)
    twin = top.link("Twin", group)
    found = extract(top.assembly(array, lost, group, twin))
    assert {entry.key: entry.quantity for entry in found.entries} == lines
    assert all(entry.missing and not entry.consolidation_warning for entry in found.entries)
    assert found.blocked == (code is not FindingCode.UNSET_LINK)


@pytest.mark.parametrize(
    ("values", "proposed"),
    [(("", "20"), "20"), (("5a", "20"), "5a"), ((30, None), "30"), ((True, 0), ""), ((None, " 7 "), "7")],
)
def test_a_link_may_propose_a_find_number(
    top: Doc, bolt: Any, values: tuple[Any, Any], proposed: str
) -> None:
    """``SiloFindNumber``, a text or a whole number; of several links of a part the first that has it."""
    links = [top.link(f"L{n}", bolt, SiloFindNumber=value) for n, value in enumerate(values)]
    (entry,) = extract(top.assembly(*links)).entries
    assert (entry.quantity, entry.find_number) == (2, proposed)
