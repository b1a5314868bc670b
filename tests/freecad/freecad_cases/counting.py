# SPDX-License-Identifier: LGPL-2.1-or-later
"""Cases of counting: links, arrays, chains, containers."""

from __future__ import annotations

import FreeCAD as App
from freecad_cases.bench import ASM4, ASSEMBLY, LOOSE, Bench, case


@case()
def plain_link(b: Bench) -> None:
    bolt = b.part("bolt.FCStd")
    b.link(b.container(), bolt)


@case()
def same_part_three_times(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    for number in range(3):
        b.link(top, bolt, f"Bolt{number}")


@case()
def array_shown_one_hidden(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    b.link(top, bolt, "Row", count=4).ElementList[1].Visibility = False


@case()
def array_counted_one_hidden(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    row = b.link(top, bolt, "Row", count=4, show=False)
    row.setElementVisible("1", False)


@case()
def array_one_deleted(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    row = b.link(top, bolt, "Row", count=4)
    top.Document.removeObject(row.ElementList[2].Name)


@case()
def array_of_one(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    b.link(top, bolt, "Row", count=1)


@case()
def links_and_array(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    b.link(top, bolt, "One")
    b.link(top, bolt, "Two")
    b.link(top, bolt, "Row", count=3)


@case()
def link_chain(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    b.link(top, b.link(top, bolt, "First"), "Second")


@case()
def chain_across_files(b: Bench) -> None:
    bolt, middle = b.part("bolt.FCStd"), b.document("middle.FCStd")
    b.link(b.container(), b.link(middle, bolt, "Middle"))


@case()
def link_to_array(b: Bench) -> None:
    bolt, middle = b.part("bolt.FCStd"), b.document("middle.FCStd")
    b.link(b.container(), b.link(middle, bolt, "Row", count=3))


@case()
def array_of_array(b: Bench) -> None:
    bolt, middle = b.part("bolt.FCStd"), b.document("middle.FCStd")
    b.link(b.container(), b.link(middle, bolt, "Row", count=3, show=False), "Rows", count=2)


@case()
def sub_object_link(b: Bench) -> None:
    doc = b.document("frame.FCStd")
    frame = doc.addObject("App::Part", "Frame")
    frame.newObject("Part::Box", "Inner")
    frame.newObject("Part::Box", "Other")
    b.link(b.container(), (frame, "Inner."))


@case()
def sub_element_link(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    bolt.Document.recompute()
    b.link(top, bolt)
    b.link(top, (bolt, "Face1"), "Reference")


@case()
def link_in_folder(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    folder = top.newObject("App::DocumentObjectGroup", "Folder")
    inner = folder.newObject("App::DocumentObjectGroup", "Inner")
    b.link(folder, bolt, "One")
    b.link(inner, bolt, "Two")


@case()
def inline_part(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    weldment = top.newObject("App::Part", "Weldment")
    b.link(weldment, bolt, "One")
    b.link(weldment, bolt, "Two")
    b.link(top, bolt, "Three")


@case(ASSEMBLY)
def inline_assembly(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    inner = top.newObject("Assembly::AssemblyObject", "Inner")
    b.link(inner, bolt, "One")
    b.link(inner, bolt, "Two")
    b.link(top, bolt, "Three")


@case()
def link_group(b: Bench) -> None:
    bolt, plate, top = b.part("bolt.FCStd"), b.part("plate.FCStd", "Plate"), b.container()
    both = b.link(top, bolt, "InBoth")
    only = b.link(top.Document, plate, "OnlyInGroup")
    top.newObject("App::LinkGroup", "Bundle").ElementList = [both, only]


@case()
def link_to_group_in_file(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    group = top.newObject("App::LinkGroup", "Bundle")
    group.ElementList = [b.link(top.Document, bolt, "Inner")]
    b.link(top, group, "Again")


@case()
def link_to_group_elsewhere(b: Bench) -> None:
    bolt, kit = b.part("bolt.FCStd"), b.document("kit.FCStd")
    group = kit.addObject("App::LinkGroup", "Bundle")
    group.ElementList = [b.link(kit, bolt, "One"), b.link(kit, bolt, "Two")]
    b.link(b.container(), group)


@case()
def link_to_assembly(b: Bench) -> None:
    sub = b.sub_assembly(b.part("bolt.FCStd"), b.part("plate.FCStd", "Plate"))
    b.link(b.container(), sub)


@case()
def same_part_on_two_levels(b: Bench) -> None:
    bolt = b.part("bolt.FCStd")
    sub = b.sub_assembly(bolt, b.part("plate.FCStd", "Plate"))
    top = b.container()
    b.link(top, bolt, "Row", count=3)
    b.link(top, sub, "SubLink", count=2)


@case(ASSEMBLY)
def assembly_link_rigid(b: Bench) -> None:
    sub = b.sub_assembly(b.part("bolt.FCStd"), b.part("plate.FCStd", "Plate"))
    top = b.container()
    b.assembly_link(top, sub, "Sub1")
    b.assembly_link(top, sub, "Sub2")


@case(ASSEMBLY)
def assembly_link_flexible(b: Bench) -> None:
    sub = b.sub_assembly(b.part("bolt.FCStd"), b.part("plate.FCStd", "Plate"))
    sub.newObject("Assembly::JointGroup", "Joints")
    link = b.assembly_link(b.container(), sub, "Sub1")
    link.Document.recompute()
    link.Rigid = False


@case(ASSEMBLY)
def assembly_link_nested(b: Bench) -> None:
    bolt = b.part("bolt.FCStd")
    sub = b.sub_assembly(bolt, b.part("plate.FCStd", "Plate"))
    middle = b.container("middle.FCStd", "Middle")
    b.assembly_link(middle, sub, "Sub1")
    b.assembly_link(middle, sub, "Sub2")
    b.link(middle, bolt, "Extra")
    middle.Document.recompute()
    b.assembly_link(b.container(), middle, "MiddleLink")


@case(ASSEMBLY)
def assembly_link_with_array(b: Bench) -> None:
    """In FreeCAD 1.1 the copies of an array bring elements of their own along."""
    bolt = b.part("bolt.FCStd")
    sub = b.container("sub.FCStd", "Sub")
    b.link(sub, bolt, "Row", count=4)
    b.assembly_link(b.container(), sub, "SubLink")


@case(ASSEMBLY)
def assembly_link_stale(b: Bench) -> None:
    bolt, washer = b.part("bolt.FCStd"), b.part("washer.FCStd", "Washer")
    sub = b.sub_assembly(bolt, b.part("plate.FCStd", "Plate"))
    b.assembly_link(b.container(), sub, "SubLink")
    del bolt, washer, sub
    changed = b.reopen("sub.FCStd")
    changed.removeObject("Bolt2")
    washer_doc = App.openDocument(str(b.folder / "washer.FCStd"))
    b.link(changed.getObject("Sub"), washer_doc.getObject("Washer"), "Washer")


@case(ASSEMBLY)
def assembly_link_never_recomputed(b: Bench) -> None:
    sub = b.sub_assembly(b.part("bolt.FCStd"), b.part("plate.FCStd", "Plate"))
    b.save()
    top = b.container()
    b.assembly_link(top, sub, "SubLink")
    top.Document.save()
    b.close()


@case(ASM4, since=(1, 0))
def assembly_below_a_part(b: Bench) -> None:
    """FreeCAD 0.20 opens the top document, but not the assembly that it links to."""
    bolt = b.part("bolt.FCStd")
    sub = b.container("sub.FCStd", "Sub", style=ASSEMBLY)
    b.link(sub, bolt, "Row", count=2)
    top = b.container()
    b.link(top, sub, "SubLink")
    b.link(top, bolt, "Bolt")


@case(ASSEMBLY)
def joints_and_sheets(b: Bench) -> None:
    import JointObject

    bolt, top = b.part("bolt.FCStd"), b.container()
    joints = top.newObject("Assembly::JointGroup", "Joints")
    one, two = b.link(top, bolt, "One"), b.link(top, bolt, "Two")
    JointObject.GroundedJoint(joints.newObject("App::FeaturePython", "Ground"), one)
    joint = joints.newObject("App::FeaturePython", "Joint")
    JointObject.Joint(joint, 0)
    sheets = top.newObject("Assembly::BomGroup", "Sheets")
    sheets.newObject("Assembly::BomObject", "Sheet")
    views = top.newObject("Assembly::ViewGroup", "Views")
    assert {two, views} <= set(top.Group)


@case()
def sheets_sketches_datums(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    b.link(top, bolt)
    top.newObject("Spreadsheet::Sheet", "Sheet")
    top.newObject("Sketcher::SketchObject", "Sketch")
    top.newObject("PartDesign::Plane", "Plane")
    top.newObject("PartDesign::CoordinateSystem", "Axes")
    top.newObject("App::Annotation", "Text")
    if App.Version()[0] != "0":
        top.newObject("App::VarSet", "Variables")


@case()
def copy_on_change(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    bolt.addProperty("App::PropertyLength", "Size", "Variant")
    bolt.setPropertyStatus("Size", "CopyOnChange")
    bolt.Size = 5
    bolt.setExpression("Length", "Size")
    b.save()
    link = b.link(top, bolt, "Variant")
    link.LinkCopyOnChange = "Enabled"
    link.Size = 20
    top.Document.recompute()
    assert link.LinkCopyOnChange == "Owned", link.LinkCopyOnChange
    assert link.LinkedObject.Document is top.Document


@case()
def draft_link_array(b: Bench) -> None:
    import Draft

    bolt, top = b.part("bolt.FCStd"), b.container()
    link = b.link(top, bolt, "Original")
    array = Draft.make_ortho_array(
        link, App.Vector(20, 0, 0), App.Vector(0, 20, 0), App.Vector(0, 0, 20), 2, 3, 1, use_link=True
    )
    if array not in top.Group:
        top.addObject(array)
    top.Document.recompute()
    assert array.Count == 6


@case()
def boolean_operands(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    b.link(top, bolt)
    cut = top.newObject("Part::Cut", "Cut")
    cut.Base = top.newObject("Part::Box", "Block")
    cut.Tool = top.newObject("Part::Cylinder", "Hole")


@case()
def hidden_link(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    b.link(top, bolt, "Seen")
    b.link(top, bolt, "Hidden").Visibility = False


@case()
def mirrored_link(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    b.link(top, bolt, "Plain")
    b.link(top, bolt, "Mirrored").ScaleVector = App.Vector(-1, 1, 1)


@case()
def mirrored_array_element(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    row = b.link(top, bolt, "Row", count=2, show=False)
    row.ScaleList = [App.Vector(1, 1, 1), App.Vector(1, -1, 1)]


@case()
def excluded_link(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    b.link(top, bolt, "Counted")
    left_out = b.link(top, bolt, "LeftOut")
    left_out.addProperty("App::PropertyBool", "SiloBomExclude", "Silo")
    left_out.SiloBomExclude = True


@case()
def excluded_part(b: Bench) -> None:
    bolt, jig, top = b.part("bolt.FCStd"), b.part("jig.FCStd", "Jig"), b.container()
    jig.addProperty("App::PropertyBool", "SiloBomExclude", "Silo")
    jig.SiloBomExclude = True
    b.link(top, bolt)
    b.link(top, jig, "Fixture")


@case(since=(1, 0))
def suppressed_link(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    b.link(top, bolt, "On")
    off = b.link(top, bolt, "Off")
    off.addExtension("App::SuppressibleExtensionPython")
    off.Suppressed = True


@case()
def suppressed_by_property(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    b.link(top, bolt, "On")
    off = b.link(top, bolt, "Off")
    off.addProperty("App::PropertyBool", "Suppressed", "Silo")
    off.Suppressed = True


@case()
def in_document_link(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    b.link(top, bolt)
    layout = b.box(top.Document, "Layout")
    b.link(top, layout, "Reference")


@case()
def unset_link(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    b.link(top, bolt)
    b.link(top, None, "Empty")


@case(LOOSE)
def loose_links(b: Bench) -> None:
    bolt, doc = b.part("bolt.FCStd"), b.document("top.FCStd")
    b.link(doc, bolt, "One")
    b.link(doc, bolt, "Two")


@case(ASM4)
def spares_beside_the_model(b: Bench) -> None:
    bolt, spare, top = b.part("bolt.FCStd"), b.part("spare.FCStd", "Spare"), b.container()
    b.link(top, bolt)
    parts = top.Document.addObject("App::DocumentObjectGroup", "Parts")
    b.link(parts, spare, "SpareLink")


@case()
def body_as_part(b: Bench) -> None:
    doc = b.document("body.FCStd")
    body = doc.addObject("PartDesign::Body", "Body")
    b.link(b.container(), body)


@case()
def empty_assembly(b: Bench) -> None:
    b.container()


@case()
def link_python(b: Bench) -> None:
    bolt, top = b.part("bolt.FCStd"), b.container()
    b.link(top, bolt, kind="App::LinkPython")


@case()
def deep_mix(b: Bench) -> None:
    """Folder in part in folder, a group in it, arrays of links of arrays."""
    bolt, middle, top = b.part("bolt.FCStd"), b.document("middle.FCStd"), b.container()
    pair = b.link(middle, bolt, "Pair", count=2)
    folder = top.newObject("App::DocumentObjectGroup", "Folder")
    inline = folder.newObject("App::Part", "Inline")
    inner = inline.newObject("App::DocumentObjectGroup", "InnerFolder")
    group = inner.newObject("App::LinkGroup", "Bundle")
    group.ElementList = [
        b.link(inner, pair, "Pairs", count=3, show=False),
        b.link(top.Document, bolt, "Single"),
    ]
