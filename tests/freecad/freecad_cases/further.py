# SPDX-License-Identifier: LGPL-2.1-or-later
"""Further cases of counting: links into other assemblies, other add-ons' containers, links that are none."""

from __future__ import annotations

from freecad_cases.bench import ASM4, ASSEMBLY, LOOSE, Bench, case


@case()
def self_reference(b: Bench) -> None:
    """A link to the very assembly that holds it; FreeCAD complains and saves it anyway."""
    bolt, top = b.part("bolt.FCStd"), b.container()
    b.link(top, bolt)
    b.link(top, top, "Self")


@case(ASSEMBLY)
def link_to_assembly_link(b: Bench) -> None:
    sub = b.sub_assembly(b.part("bolt.FCStd"), b.part("plate.FCStd", "Plate"))
    middle = b.container("middle.FCStd", "Middle")
    instance = b.assembly_link(middle, sub, "Sub1")
    middle.Document.recompute()
    b.link(b.container(), instance)


@case()
def link_to_array_element(b: Bench) -> None:
    bolt, middle = b.part("bolt.FCStd"), b.document("middle.FCStd")
    row = b.link(middle, bolt, "Row", count=3)
    b.link(b.container(), row.ElementList[1])


@case()
def link_into_sub_assembly(b: Bench) -> None:
    sub = b.sub_assembly(b.part("bolt.FCStd"), b.part("plate.FCStd", "Plate"))
    sub.Document.recompute()
    b.link(b.container(), (sub, "Bolt1."))


@case()
def link_beside_the_assembly(b: Bench) -> None:
    bolt, spare, top = b.part("bolt.FCStd"), b.part("spare.FCStd", "Spare"), b.container()
    b.link(top, bolt)
    b.link(top.Document, spare, "Loose")


@case()
def link_to_a_sheet(b: Bench) -> None:
    bolt, data, top = b.part("bolt.FCStd"), b.document("data.FCStd"), b.container()
    b.link(top, bolt)
    b.link(top, data.addObject("Spreadsheet::Sheet", "Sheet"), "SheetLink")


@case()
def a2plus_part(b: Bench) -> None:
    """A2plus copies the shape of a part into the assembly; there is no link that could be counted."""
    bolt, top = b.part("bolt.FCStd"), b.container()
    b.link(top, bolt)
    imported = top.newObject("Part::FeaturePython", "Imported")
    for name in ("sourceFile", "sourcePart", "a2p_Version"):
        imported.addProperty("App::PropertyString", name, "importPart")
    imported.sourceFile = "bolt.FCStd"


@case(LOOSE)
def assembly3_container(b: Bench) -> None:
    """Constraints, elements, parts: only the last group holds components."""
    bolt, doc = b.part("bolt.FCStd"), b.document("top.FCStd")
    bolt.Document.recompute()
    top = doc.addObject("Part::FeaturePython", "Top")
    top.addProperty("App::PropertyEnumeration", "BuildShape", "Assembly")
    top.addProperty("App::PropertyBool", "Freeze", "Assembly")
    top.addProperty("App::PropertyLinkList", "Group", "Assembly")
    groups = [
        doc.addObject("App::DocumentObjectGroup", name) for name in ("Constraints", "Elements", "Parts")
    ]
    b.link(groups[1], (bolt, "Face1"), "Element")
    b.link(groups[2], bolt, "One")
    b.link(groups[2], bolt, "Two")
    top.Group = groups


@case(ASM4)
def two_models_in_one_file(b: Bench) -> None:
    """Nobody says which of two assemblies is meant: an error that names both, not a guess."""
    bolt, top = b.part("bolt.FCStd"), b.container()
    b.link(top, bolt)
    b.link(b.add_container(top.Document, "Second"), bolt)
