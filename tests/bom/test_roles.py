# SPDX-License-Identifier: LGPL-2.1-or-later
"""One role for each object: cases that real files counted wrong, and the two laws over random documents."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from fakes import Doc, Obj
from hypothesis import given
from hypothesis import strategies as st

from silo.bom import choose_assembly, extract
from silo.bom.errors import InputError
from silo.bom.findings import FindingCode
from silo.bom.walk.arrays import draft_count
from silo.bom.walk.chains import chains
from silo.bom.walk.contents import ObjectRole
from silo.bom.walk.document import LinkProblem
from silo.bom.walk.roots import fates, silent_reader
from silo.inertia.geometry.freecad import NOTHING, StatedMaterial, Walk

UUID = "5d8d3a1e-6f0b-4c7a-9a54-2f1d7c0e4b36"
M4 = "ISO 4762 M4×16"
Counts = dict[str, int]


def bolt() -> Any:
    return Doc("/v/bolt.FCStd").body("Bolt")


def assembly3(doc: Doc) -> Obj:
    screws = [doc.screw(f"S{number}") for number in range(3)]
    parts = doc.group("Part::FeaturePython", "Parts", doc.link("L", bolt()), *screws)
    helpers = [doc.group("Part::FeaturePython", name) for name in ("Constraints", "Elements")]
    relations = doc.group("Part::FeaturePython", "Relations", doc.add("Part::FeaturePython", "R"))
    return doc.group("Part::FeaturePython", "Asm", *helpers, parts, relations, BuildShape="", Freeze=False)


def masters(doc: Doc) -> Obj:
    """A folder of masters that FreeCAD's window hid, each with it; one master lies beside it."""
    inside, outside = doc.screw("In", Visibility=False), doc.screw("Out")
    folder = doc.folder("Masters", inside, Visibility=False)
    shown = [doc.link("A", inside), doc.array("B", outside, 3)]
    return doc.assembly(folder, inside, *shown)


def shown_in_a_hidden_folder(doc: Doc) -> Obj:
    """A folder hides nothing: FreeCAD shows what is switched on itself, here twice by the link, and once."""
    screw, loose = doc.screw("In"), doc.screw("Loose", "30")
    compound = doc.add("Part::Compound", "Pair", Links=[screw])
    link = doc.link("A", compound, ElementCount=2)
    folder = doc.folder("Masters", compound, screw, link, Visibility=False)
    doc.folder("Bought", loose, Visibility=False)
    return doc.assembly(compound, screw, link, folder, doc.link("L", bolt()))


def hidden_masters_in_a_hidden_part(doc: Doc) -> Obj:
    """A part that is hidden does hide what lies in it."""
    screw = doc.screw("In")
    part = doc.part("Masters", screw, Visibility=False)
    return doc.assembly(part, doc.link("A", screw, ElementCount=2))


def visible_original(doc: Doc) -> Obj:
    screw = doc.screw("S")
    return doc.assembly(screw, doc.array("More", screw, 3))


def copy_on_change(doc: Doc) -> Obj:
    source, copy = doc.screw("Source"), doc.screw("Copy", "20")
    doc.link_group("CopyOnChangeGroup", copy, Visibility=False)
    changed = doc.link("L", copy, LinkCopyOnChange="Owned", LinkCopyOnChangeSource=source)
    return doc.assembly(changed, doc.link("K", bolt()))


def cuts(doc: Doc) -> Obj:
    """A tool in the assembly with its cut outside, and a tool at the root."""
    inner, outer = doc.screw("Inner"), doc.screw("Outer")
    doc.add("Part::Cut", "Cut", Base=doc.body("Plate"), Tool=inner)
    doc.add("Part::Cut", "Cut2", Base=doc.body("Plate2"), Tool=outer)
    return doc.assembly(inner, doc.screw("Bought"), doc.link("L", bolt()))


def spares(doc: Doc) -> Obj:
    doc.folder("Parts", doc.folder("Deeper", doc.screw("Spare")))
    doc.folder("Source_shapes", doc.screw("Unused", Visibility=False))
    return doc.part("Model", doc.link("L", bolt()), Type="Assembly")


def beside(doc: Doc) -> Obj:
    """What repeats the assembly's own screw beside it counts nothing; a visible loose screw does."""
    screw = doc.screw("S")
    doc.add("Part::FeaturePython", "Clone", Objects=[screw], Fuse=False)
    doc.add("Part::FeaturePython", "Array", Base=screw, Count=5)
    doc.link_group("Group", doc.link("InGroup", screw))
    doc.screw("Hidden", Visibility=False)
    doc.screw("Loose", "30")
    return doc.assembly(screw, doc.link("L", bolt()))


def own_bodies_and_loose_screws(doc: Doc) -> Obj:
    for number in range(4):
        doc.screw(f"S{number}")
    return doc.assembly(doc.body("Base"), doc.body("Lid"))


def one_file(doc: Doc) -> Obj:
    bodies = [doc.body(name, Visibility=False) for name in ("Wheel", "Axle", "Frame")]
    links = [doc.link(f"L{number}", bodies[number % 3]) for number in range(26)]
    return doc.assembly(*links)


def parts_at_the_root(doc: Doc) -> Any:
    for name in ("Left", "Right", "Middle"):
        doc.part(name, doc.body(f"{name}Body"))
    return choose_assembly(doc)


def linked_group(doc: Doc) -> Obj:
    """A link to a group or to an assembly shows its parts; a link to a part of geometry shows one part."""
    group = doc.link_group("Group", doc.body("A"), doc.body("B"))
    inner = doc.part("Inner", doc.body("C"), doc.body("D"), Type="Assembly")
    plain = doc.part("Plain", doc.body("E"), doc.body("F"))
    return doc.assembly(*(doc.link(f"L{one.Name}", one, ElementCount=2) for one in (group, inner, plain)))


def elements_of_an_array_beside(doc: Doc) -> Obj:
    """Elements that a group of the assembly shows: their hidden array beside it is no loose component."""
    array = doc.array("Split", bolt(), 3, Visibility=False)
    return doc.assembly(doc.link_group("Elements", *array.ElementList[:2]))


def left_out_beside(doc: Doc) -> Obj:
    """What a person took out is no part beside the assembly either."""
    doc.array("Out", bolt(), 2, SiloBomExclude=True)
    return doc.assembly(doc.link("L", bolt()))


def twice_at_the_root(doc: Doc) -> Any:
    """One body, shown by two groups: two pieces, so that the file is not that part."""
    body = doc.body("Body")
    doc.link_group("A", body)
    doc.link_group("B", body)
    return choose_assembly(doc)


def assembly_in_a_part(doc: Doc) -> Obj:
    """A part around an assembly is no part of geometry alone."""
    return doc.assembly(doc.part("Outer", doc.assembly(doc.body("A"), doc.body("B"), name="Inner")))


def own_identity_in_capitals(doc: Doc) -> Obj:
    """The assembly's own identity on a body declares nothing, however it is spelt."""
    return doc.assembly(doc.body("A", SiloUUID=UUID.upper()), doc.body("B"), SiloUUID=UUID)


def a_part_that_is_cut_away(doc: Doc) -> Obj:
    """What lies in a tool goes with it; so does a screw that is alone in its assembly."""
    tool = doc.part("Tool", doc.screw("Inside"))
    doc.add("Part::Cut", "Cut", Base=doc.body("Plate"), Tool=tool)
    return doc.assembly(tool, doc.link("L", bolt()))


def a_lone_screw_that_is_cut_away(doc: Doc) -> Obj:
    screw = doc.screw("Alone")
    doc.add("Part::Cut", "Cut", Base=doc.body("Plate"), Tool=screw)
    return doc.assembly(screw)


def all_hidden(doc: Doc) -> Obj:
    """Nothing else is shown, so what is hidden is meant."""
    return doc.assembly(doc.body("A", Visibility=False), doc.body("B", Visibility=False))


def imported_part(doc: Doc) -> Obj:
    """A2plus names a file, whose one part it is."""
    files = files_of_a2plus()
    doc.__dict__["imported"] = lambda file, _part: files[file]
    return doc.assembly(doc.add(PYTHON, "I", sourceFile="./alone.FCStd", a2p_Version="1"))


def lone_screw(doc: Doc) -> Any:
    """A file with one standard part is no part of its own."""
    doc.screw("S")
    return choose_assembly(doc)


CASES: list[tuple[Callable[[Doc], Any], Counts, Counts]] = [
    (assembly3, {"Bolt": 1, M4: 3}, {}),
    (masters, {M4: 4}, {}),
    (shown_in_a_hidden_folder, {M4: 3, "ISO 4762 M4×30": 1, "Bolt": 1}, {}),
    (hidden_masters_in_a_hidden_part, {M4: 2}, {}),
    (visible_original, {M4: 4}, {}),
    (copy_on_change, {"ISO 4762 M4×20": 1, "Bolt": 1}, {}),
    (cuts, {M4: 1, "Bolt": 1}, {}),
    (spares, {"Bolt": 1}, {}),
    (beside, {M4: 1, "Bolt": 1, "ISO 4762 M4×30": 1}, {}),
    (own_bodies_and_loose_screws, {M4: 4}, {"Base": 1, "Lid": 1}),
    (one_file, {}, {"Wheel": 9, "Axle": 9, "Frame": 8}),
    (linked_group, {}, {"A": 2, "B": 2, "C": 2, "D": 2, "Plain": 2}),
    (elements_of_an_array_beside, {"Bolt": 2}, {}),
    (left_out_beside, {"Bolt": 1}, {}),
    (parts_at_the_root, {}, {"Left": 1, "Right": 1, "Middle": 1}),
    (assembly_in_a_part, {}, {"A": 1, "B": 1}),
    (own_identity_in_capitals, {}, {"A": 1, "B": 1}),
    (twice_at_the_root, {}, {"Body": 2}),
    (lone_screw, {M4: 1}, {}),
    (all_hidden, {}, {"A": 1, "B": 1}),
    (imported_part, {"Alone": 1}, {}),
    (a_part_that_is_cut_away, {"Bolt": 1}, {}),
    (a_lone_screw_that_is_cut_away, {}, {}),
]


@pytest.mark.parametrize(("build", "counts", "own"), CASES, ids=[build.__name__ for build, _, _ in CASES])
def test_each_way_of_use_counts_once(build: Callable[[Doc], Any], counts: Counts, own: Counts) -> None:
    top = build(Doc("/v/top.FCStd"))
    found = extract(top)
    assert {entry.standard or entry.object_name: entry.quantity for entry in found.entries} == counts
    assert {entry.object_name: entry.quantity for entry in found.assembly.own} == own
    assert not found.blocked
    reported = found.findings_of(FindingCode.BESIDE_ASSEMBLY)
    assert bool(reported) is (build is beside)
    obeys_the_laws(top)


def test_a_registered_screw_in_a_folder_is_that_item() -> None:
    """The document's identity is the screw's, if only folders and sketches lie beside it."""
    other, top = Doc("/v/special.FCStd", meta={"SiloUUID": UUID}), Doc("/v/top.FCStd")
    screw = other.screw("Special")
    other.folder("F", screw)
    (entry,) = extract(top.assembly(top.link("L", screw))).entries
    assert (entry.key, entry.silo_uuid) == (("/v/special.FCStd", "Special"), UUID)


def obeys_the_laws(top: Any) -> None:
    """No object without a role, and none that contributes through another one than that of a component."""
    reader = silent_reader(counts_beside=True)
    contents = reader.contents(top)
    roles = fates(top, contents, reader)
    assert None not in roles.values()
    counted = {count.shown.obj.Name for count in (*contents.counts, *contents.own)}
    assert counted == {name for name, role in roles.items() if role is ObjectRole.COMPONENT}
    for count in (*contents.counts, *contents.own):
        pieces = 0
        for way in chains(count, contents.tree):
            times = 1
            for _, one in way:
                times *= one
            pieces += times
        assert pieces == count.quantity


def test_what_lies_beside_is_reported_together() -> None:
    """One finding, which names each array, clone, group and hidden screw."""
    (finding,) = extract(beside(Doc("/v/top.FCStd"))).findings_of(FindingCode.BESIDE_ASSEMBLY)
    assert [place.obj for place in finding.where] == ["Array", "Clone", "Group", "Hidden"]


KINDS = (
    *("link", "array", "element", "draft", "compound", "clone", "mirror", "cut", "fusion", "screw", "body"),
    *("foreign", "import", "changed", "assembly_link", "a2plus"),
)
HOLDERS = ("part", "folder", "link_group")
TOPS = ("assembly", "part", "assembly3", "model", "root", "several", "inner")
PYTHON = "Part::FeaturePython"


def files_of_a2plus() -> dict[str, Any]:
    """What A2plus's files hold: a part, an assembly, several things, one thing; and a file that is lost."""
    several, alone = Doc("/v/several.FCStd"), Doc("/v/alone.FCStd")
    several.link("L", bolt())
    several.screw("S")
    alone.body("Alone")
    sub = Doc("/v/sub.FCStd")
    sub.assembly(sub.screw("S"), sub.link("L", bolt()), name="Sub")
    tops = {
        name: choose_assembly(doc) for name, doc in (("several", several), ("alone", alone), ("sub", sub))
    }
    gone = LinkProblem(FindingCode.MISSING_FILE, "./gone.FCStd")
    return {f"./{name}.FCStd": found for name, found in {**tops, "bolt": bolt(), "gone": gone}.items()}


A2PLUS = ("several", "alone", "sub", "bolt", "gone")


def made_of(draw: st.DrawFn, doc: Doc, name: str, near: Any, far: Any, **more: Any) -> Obj:
    """One object of any kind, which may show or consume one that is there already."""
    kind = draw(st.sampled_from(KINDS))
    if kind == "link":
        return doc.link(name, draw(st.sampled_from((near, far))), **more)
    if kind == "array":
        return doc.array(name, near, draw(st.integers(1, 3)), **more)
    if kind == "element":
        return doc.add("App::LinkElement", name, LinkedObject=near, **more)
    if kind == "draft":
        return doc.add(PYTHON, name, Base=near, Count=draw(st.integers(1, 3)), **more)
    if kind == "compound":
        return doc.add("Part::Compound", name, Links=[near], **more)
    if kind == "clone":
        return doc.add(PYTHON, name, Objects=[near], Fuse=False, **more)
    if kind == "mirror":
        return doc.add("Part::Mirroring", name, Source=near, **more)
    if kind == "cut":
        return doc.add("Part::Cut", name, Base=near, Tool=doc.body(f"{name}T"), **more)
    if kind == "fusion":
        return doc.add("Part::MultiFuse", name, Shapes=[near, doc.screw(f"{name}T")], **more)
    if kind == "screw":
        return doc.screw(name, **more)
    if kind == "foreign":
        return doc.add(PYTHON, name, sourceFile="", a2p_Version="1", **more)
    if kind == "a2plus":
        file = draw(st.sampled_from(A2PLUS))
        return doc.add(PYTHON, name, sourceFile=f".\\{file}.FCStd", a2p_Version="1", **more)
    if kind == "changed":  # copy on change: the source may lie anywhere
        copy = doc.screw(f"{name}C", "20")
        doc.link_group(f"CopyOnChangeGroup{name}", copy, Visibility=False)
        return doc.link(name, copy, LinkCopyOnChange="Owned", LinkCopyOnChangeSource=near, **more)
    if kind == "assembly_link":
        sub = Doc(f"/v/{name}.FCStd").assembly(Doc(f"/v/{name}P.FCStd").body(), name="Sub")
        return doc.assembly_link(name, sub, [doc.link(f"{name}C", sub)], **more)
    return doc.body(name, **more)


def top_of(draw: st.DrawFn, doc: Doc, members: list[Any]) -> Any:
    """What is asked for: an assembly of any add-on, the document itself, or one of two assemblies."""
    kind = draw(st.sampled_from(TOPS))
    if kind == "assembly3":
        groups = [doc.group(PYTHON, name) for name in ("Constraints", "Elements")]
        groups.append(doc.group(PYTHON, "Inside", *members))
        if draw(st.booleans()):
            relation = doc.add(PYTHON, "Relation", Group=members[:1])
            groups.append(doc.group(PYTHON, "Relations", relation))
        return doc.group(PYTHON, "Asm", *groups, BuildShape="", Freeze=False)
    if kind == "model":
        doc.folder("Parts", doc.screw("Spare"))
        return doc.part("Model", *members, Type="Assembly")
    if kind == "root":
        try:
            return choose_assembly(doc)
        except InputError:
            kind = "assembly"
    if kind == "several":
        doc.assembly(*members[:2], name="Other")
    top = doc.part("Top", *members) if kind == "part" else doc.assembly(*members)
    if kind == "inner":
        doc.part("Outer", top, doc.body("Neighbour"), doc.link("Neighbours", bolt()))
    return top


@st.composite
def documents(draw: st.DrawFn) -> Any:
    """A document with every kind, in any container or in none, that shows and consumes any other."""
    doc = Doc("/v/top.FCStd")
    far, made = bolt(), list[Any]()
    files = files_of_a2plus()
    doc.__dict__["imported"] = lambda file, _part: files[file]
    members = list[Any]()
    for number in range(draw(st.integers(1, 9))):
        more = {"Visibility": draw(st.booleans())}
        if mark := draw(st.sampled_from(("", "", "", "Suppressed", "SiloBomExclude"))):
            more[mark] = True
        near = draw(st.sampled_from(made)) if made else far
        obj = made_of(draw, doc, f"N{number}", near, far, **more)
        made.append(obj)
        where = draw(st.sampled_from(("in", "in", "beside", *HOLDERS)))
        if where in HOLDERS:
            inside = [obj, *([near] if draw(st.booleans()) and near is not far else [])]
            holder = getattr(doc, where)(f"N{number}H", *dict.fromkeys(inside), **more)
            members.append(holder)
            made.append(holder)
        elif where == "in":
            members.append(obj)
    return top_of(draw, doc, list(dict.fromkeys(members)))


@given(documents())
def test_the_two_laws_hold_for_any_document(top: Any) -> None:
    """And no finding of a law is met."""
    found = extract(top)
    assert found.findings_of(FindingCode.NO_ROLE, FindingCode.TWO_ROLES) == ()
    if not found.blocked:
        obeys_the_laws(top)


class Unplaced:
    """Facts for a mass of fakes: all stands at the origin, and every array says where its instances are."""

    def placement(self, obj: Any, name: str = "Placement") -> Any:
        return np.eye(4)

    def places(self, obj: Any) -> list[Any]:
        return [np.eye(4)] * (draft_count(obj) or getattr(obj, "ElementCount", 0))

    def shape(self, obj: Any) -> Any:
        return object()

    def material(self, obj: Any) -> StatedMaterial:
        return NOTHING

    def problem(self, link: Any) -> None:
        return None


@given(documents())
def test_the_mass_has_the_pieces_of_the_bom(top: Any) -> None:
    """One product for each line, as often as the line says; own parts too."""
    found = extract(top)
    if found.blocked:
        return
    walk = Walk(Unplaced())
    key = walk.product(top)
    weighed = Counter(child.product for child in walk.nodes[key].children)
    reader = silent_reader(counts_beside=True)
    contents, counted = reader.contents(top), Counter[str]()
    for count in (*contents.counts, *contents.own):
        counted[walk.product(count.target)] += count.quantity
    if key in walk.leaves:  # a part of bodies weighs as one piece
        assert not contents.counts
    else:
        assert weighed == +counted


def test_a_compound_of_bodies_that_another_file_links_to_is_one_piece() -> None:
    """It is a product made of its own shape, and does not contain itself."""
    doc = Doc("/v/plates.FCStd")
    walk = Walk(Unplaced())
    assert walk.product(doc.add("Part::Compound", "C", Links=[doc.body("A"), doc.body("B")])) in walk.leaves
    assert not walk.problems()


def test_the_members_of_a_compound_are_left_out_with_it() -> None:
    """And are no sources, which somebody may look for."""
    doc = Doc("/v/top.FCStd")
    screw = doc.screw("S")
    both = doc.add("Part::Compound", "Pair", Links=[screw], SiloBomExclude=True)
    reader = silent_reader()
    top = doc.assembly(screw, both, doc.link("L", bolt()))
    assert fates(top, reader.contents(top), reader)["S"] is ObjectRole.LEFT_OUT


def test_a_screw_that_no_assembly_gets_is_reported() -> None:
    """Of two assemblies none gets it, also where it lies in a plain folder; one for later is a spare."""
    doc = Doc("/v/top.FCStd")
    first = doc.assembly(doc.link("L", bolt()), name="First")
    doc.assembly(doc.link("K", bolt()), name="Second")
    doc.folder("Bought", doc.screw("Loose"), doc.screw("Stored", Visibility=False))
    doc.folder("Parts", doc.screw("Spare"))
    (finding,) = extract(first).findings_of(FindingCode.BESIDE_ASSEMBLY)
    assert [place.obj for place in finding.where] == ["Loose"]
