# SPDX-License-Identifier: LGPL-2.1-or-later
"""Cases of standard parts, declared parts, and of everything that repeats them.

The fasteners have the properties that the Fasteners workbench gives them, and no add-on behind them.
"""

from __future__ import annotations

from typing import Any

import Draft
import FreeCAD as App
import Part
from freecad_cases.bench import ASSEMBLY, LOOSE, Bench, case
from freecad_cases.truth import UUID_1, UUID_2

OLD = {name: name[0].lower() + name[1:] for name in ("Type", "Diameter", "Length", "LengthCustom")}


def fastener(
    where: Any,
    name: str = "Screw",
    kind: str = "ISO4762",
    diameter: str = "M4",
    length: str | float | None = "16",
    *,
    old: bool = False,
    **more: Any,
) -> Any:
    """A fastener in a container, or in a document."""
    doc = getattr(where, "Document", where)
    obj = doc.addObject("Part::FeaturePython", name)
    values: dict[str, Any] = {"Type": kind, "Diameter": diameter, **more}
    if length is not None:
        values["Length"] = length
    for key, value in values.items():
        spelt = OLD.get(key, key) if old else key
        if isinstance(value, str):
            obj.addProperty("App::PropertyEnumeration", spelt, "Parameters")
            setattr(obj, spelt, ["Auto", value, "Custom"] if value not in ("Auto", "Custom") else [value])
        elif isinstance(value, bool):
            obj.addProperty("App::PropertyBool", spelt, "Parameters")
        else:
            obj.addProperty("App::PropertyLength", spelt, "Parameters")
        setattr(obj, spelt, value)
    obj.addProperty("App::PropertyBool", "invert" if old else "Invert", "Parameters")
    obj.Shape = Part.makeCylinder(2, 16)
    if where is not doc:
        where.addObject(obj)
    return obj


def flagged(obj: Any, name: str = "SiloBomExclude") -> Any:
    obj.addProperty("App::PropertyBool", name, "Silo")
    setattr(obj, name, True)
    return obj


def identified(obj: Any, identity: str) -> Any:
    obj.addProperty("App::PropertyString", "SiloItemId", "Silo")
    obj.SiloItemId = identity
    return obj


def into(top: Any, obj: Any) -> Any:
    if obj not in top.Group:
        top.addObject(obj)
    return obj


def ortho(base: Any, x: int, y: int, use_link: bool) -> Any:
    App.setActiveDocument(base.Document.Name)
    steps = (App.Vector(20, 0, 0), App.Vector(0, 20, 0), App.Vector(0, 0, 20))
    return Draft.make_ortho_array(base, *steps, x, y, 1, use_link=use_link)


# --- where they sit --------------------


@case()
def hardware_in_the_assembly(b: Bench) -> None:
    """Two screws, a left-handed one, a custom length that is a standard one, and a washer."""
    top = b.container()
    b.link(top, b.part("bolt.FCStd"))
    fastener(top, "Screw")
    fastener(top, "Screw001", Thread=True)
    fastener(top, "Screw002", length="Custom", LengthCustom=16.0)
    fastener(top, "Left", LeftHanded=True)
    fastener(top, "Washer", "ISO7089", "M3", None)


@case()
def hardware_in_both_spellings(b: Bench) -> None:
    top = b.container()
    fastener(top, "Old", old=True)
    fastener(top, "New")
    fastener(top, "Renamed", "ISO7380", "M5", "8", old=True)
    fastener(top, "Named", "ISO7380-1", "M5", "8")


@case()
def hardware_in_groups_and_parts(b: Bench) -> None:
    top = b.container()
    folder = top.newObject("App::DocumentObjectGroup", "Folder")
    folder.addObject(fastener(top, "InFolder"))
    part = top.newObject("App::Part", "Inner")
    fastener(part, "InPart")
    bundle = top.newObject("App::LinkGroup", "Bundle")
    bundle.ElementList = [fastener(top.Document, "InBundle")]


@case()
def hardware_linked_in_the_file(b: Bench) -> None:
    """One screw, two links to it, and two arrays."""
    top = b.container()
    screw = fastener(top)
    b.link(top, screw, "One")
    b.link(top, screw, "Two")
    b.link(top, screw, "Shown", count=3)
    b.link(top, screw, "Counted", count=4, show=False)


@case()
def hardware_source_outside(b: Bench) -> None:
    """The screw lies beside the assembly and is only a source of links."""
    top = b.container()
    b.link(top, b.part("bolt.FCStd"))
    b.link(top, fastener(top.Document), "Row", count=3)


@case()
def hardware_in_draft_arrays(b: Bench) -> None:
    top = b.container()
    into(top, ortho(fastener(top, "First"), 2, 3, use_link=True))
    into(top, ortho(fastener(top, "Second", length="20"), 2, 2, use_link=False))


@case()
def hardware_cloned(b: Bench) -> None:
    top = b.container()
    screw = fastener(top)
    top.Document.recompute()
    into(top, Draft.make_clone(screw))


@case()
def hardware_in_a_fasteners_file(b: Bench) -> None:
    """Linked from a file of the project, and drawn in the assembly: one article."""
    store = b.document("fasteners.FCStd")
    screw, nut = fastener(store), fastener(store, "Nut", "ISO4032", "M4", None)
    top = b.container()
    b.link(top, screw, "Row", count=4)
    b.link(top, nut, "Nut1")
    fastener(top, "Own")


@case()
def hardware_in_a_part_file(b: Bench) -> None:
    """A part with two inserts in it is an assembly of its own."""
    doc = b.document("frame.FCStd")
    frame = doc.addObject("App::Part", "Frame")
    frame.addObject(b.box(doc, "Body"))
    for number in range(2):
        fastener(frame, f"Insert{number}", "IUTHeatInsert", "M3", 4.0, ExternalDiam=4.55)
    b.link(b.container(), frame, "Frames", count=3)


@case()
def hardware_beside_the_assembly(b: Bench) -> None:
    """As in old Assembly4 models: at the root of the document, and in a folder there."""
    top = b.container()
    b.link(top, b.part("bolt.FCStd"))
    fastener(top.Document, "Loose")
    folder = top.Document.addObject("App::DocumentObjectGroup", "Screws")
    folder.addObject(fastener(top.Document, "Sorted"))


@case()
def hardware_copied_as_geometry(b: Bench) -> None:
    """A plain copy has lost its properties and is geometry."""
    top = b.container()
    b.link(top, b.part("bolt.FCStd"))
    copy = top.newObject("Part::Feature", "Copy")
    copy.Label = "M3x8-Screw"
    copy.Shape = Part.makeCylinder(1.5, 8)


# --- what is no piece to buy --------------------


@case()
def hardware_used_up(b: Bench) -> None:
    """The tool of a cut, an operand of a fusion, a compound as tool; a compound of screws counts."""
    top = b.container()
    doc = top.Document

    def feature(kind: str, name: str, **links: Any) -> Any:
        obj = doc.addObject(kind, name)
        for key, value in links.items():
            setattr(obj, key, value)
        top.addObject(obj)
        return obj

    plates = [b.box(doc, f"Plate{number}") for number in range(3)]
    for plate in plates:
        top.addObject(plate)
    tool, operand = fastener(top, "Tool"), fastener(top, "Operand")
    feature("Part::Cut", "Cut", Base=plates[0], Tool=tool)
    feature("Part::MultiFuse", "Fusion", Shapes=[plates[1], operand])
    compound = feature("Part::Compound", "Cutters", Links=[fastener(top, "A"), fastener(top, "B")])
    feature("Part::Cut", "Pocket", Base=plates[2], Tool=compound)
    feature("Part::Compound", "Kit", Links=[fastener(top, "C"), fastener(top, "D")])


@case()
def hardware_tools(b: Bench) -> None:
    top = b.container()
    b.link(top, b.part("bolt.FCStd"))
    fastener(top, "Tap", "ScrewTap", "M6", 20.0)
    fastener(top, "Die", "ScrewDie", "M6", 20.0)


@case()
def hardware_excluded(b: Bench) -> None:
    top = b.container()
    fastener(top, "Kept")
    flagged(fastener(top, "Drawn"))


# --- parts that a person declares --------------------


@case()
def declared_part(b: Bench) -> None:
    """A box with an identity, and two links to it; the same without one is geometry."""
    top = b.container()
    doc = top.Document
    box = identified(b.box(doc, "Motor"), UUID_1)
    top.addObject(box)
    top.addObject(b.box(doc, "Jig"))
    b.link(top, box, "Second")
    b.link(top, box, "More", count=2)


@case()
def declared_container(b: Bench) -> None:
    """An inline part with an identity is a component, and what it holds is in it."""
    top = b.container()
    bolt = b.part("bolt.FCStd")
    inner = identified(top.newObject("App::Part", "Module"), UUID_2)
    b.link(inner, bolt, "Bolts", count=2)
    fastener(inner)


# --- one rule of repetition --------------------


@case()
def array_over_an_inline_part(b: Bench) -> None:
    """The part itself, four elements, and a Draft array of another part."""
    top, bolt = b.container(), b.part("bolt.FCStd")
    first = top.newObject("App::Part", "First")
    b.link(first, bolt, "Bolt1")
    b.link(top, first, "Row", count=4)
    second = top.newObject("App::Part", "Second")
    b.link(second, bolt, "Bolts", count=2)
    into(top, ortho(second, 5, 1, use_link=True))


@case()
def draft_arrays_without_links(b: Bench) -> None:
    top = b.container()
    parts = [b.part(f"{name}.FCStd", name.title()) for name in ("bolt", "plate", "washer")]
    links = [b.link(top, part, f"Base{number}") for number, part in enumerate(parts)]
    top.Document.recompute()
    into(top, ortho(links[0], 2, 3, use_link=False))
    App.setActiveDocument(top.Document.Name)
    into(top, Draft.make_polar_array(links[1], 5, 360, App.Vector(30, 0, 0), use_link=False))
    circular = Draft.make_circular_array(links[2], 50, 60, 3, 1, use_link=False)
    into(top, circular)


@case()
def link_to_a_draft_array_elsewhere(b: Bench) -> None:
    kit = b.document("kit.FCStd")
    array = ortho(b.link(kit, b.part("bolt.FCStd"), "Original"), 2, 3, use_link=True)
    array.Label = "Bolts"
    b.link(b.container(), array, "Kits", count=2)


@case()
def link_in_two_link_groups(b: Bench) -> None:
    """FreeCAD shows it in both."""
    top = b.container()
    link = b.link(top.Document, b.part("bolt.FCStd"), "Bolt")
    for name in ("One", "Two"):
        top.newObject("App::LinkGroup", name).ElementList = [link]


@case()
def array_elements_in_a_link_group(b: Bench) -> None:
    """Elements of an array that lies outside the assembly."""
    top = b.container()
    row = b.link(top.Document, b.part("bolt.FCStd"), "Row", count=3)
    top.newObject("App::LinkGroup", "Bundle").ElementList = list(row.ElementList)


@case()
def container_beside_the_assembly(b: Bench) -> None:
    top, bolt = b.container(), b.part("bolt.FCStd")
    b.link(top, bolt)
    b.link(top.Document.addObject("App::Part", "Spare"), bolt, "Lost")


@case(LOOSE)
def loose_parts_beside_a_part_of_references(b: Bench) -> None:
    """The part holds only a link to construction geometry, so it is not the assembly."""
    doc = b.document("top.FCStd")
    part = doc.addObject("App::Part", "Layout")
    b.link(part, b.box(doc, "Skeleton"), "Reference")
    bolt = b.part("bolt.FCStd")
    b.link(doc, bolt, "One")
    b.link(doc, bolt, "Row", count=3)


@case()
def mirrored_element_shown(b: Bench) -> None:
    top = b.container()
    row = b.link(top, b.part("bolt.FCStd"), "Row", count=3)
    row.ElementList[1].ScaleVector = App.Vector(-1, 1, 1)


@case()
def excluded_element(b: Bench) -> None:
    top = b.container()
    row = b.link(top, b.part("bolt.FCStd"), "Row", count=4)
    flagged(row.ElementList[2])


@case(ASSEMBLY, since=(1, 0), before=(1, 1))
def own_part_in_a_flexible_assembly_link(b: Bench) -> None:
    """A link of one's own among the copies; FreeCAD 1.1 removes it when it recomputes."""
    bolt, plate, washer = (b.part(f"{n}.FCStd", n.title()) for n in ("bolt", "plate", "washer"))
    sub = b.sub_assembly(bolt, plate)
    top = b.container()
    link = b.assembly_link(top, sub, "SubLink")
    link.Rigid = False
    b.save()
    b.link(link, washer, "Own")
