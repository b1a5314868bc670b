# SPDX-License-Identifier: LGPL-2.1-or-later
"""Projects as people build them, with each add-on's ways of use, made by the FreeCAD that runs this::

    SILO_OUT=folder freecadcmd -c 'import runpy; runpy.run_path(…)'

One folder for each project, with ``top.FCStd``. No add-on is needed: its objects are known by properties.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import Draft
import FreeCAD as App
import Part

sys.path.insert(0, str(Path(__file__).parent))

from wrong_counts import document, finish, hidden, link, screw

PYTHON = "Part::FeaturePython"


def box(doc: Any, name: str, size: float = 5) -> Any:
    made = doc.addObject("Part::Box", name)
    made.Length = size
    return made


def put(container: Any, *members: Any) -> Any:
    for one in members:
        container.addObject(one)
    return container


def assembly(doc: Any, *members: Any, name: str = "Top") -> Any:
    """FreeCAD's own where there is one, else Assembly4's."""
    if App.Version()[0] != "0":
        return put(doc.addObject("Assembly::AssemblyObject", name), *members)
    made = doc.addObject("App::Part", name)
    made.Type = "Assembly"
    return put(made, *members)


def group(doc: Any, name: str, *members: Any, visible: bool = False) -> Any:
    """A group of Assembly3: it is always switched off, and its list says which of its members are shown."""
    made = doc.addObject(PYTHON, name)
    made.addProperty("App::PropertyLinkList", "Group")
    made.addProperty("App::PropertyBoolList", "VisibilityList")
    made.Group, made.VisibilityList = list(members), [visible] * len(members)
    made.Visibility = False
    return made


def assembly3(doc: Any, parts: list[Any], *more: Any, name: str = "Top") -> Any:
    """Its three groups, and others behind them."""
    element = doc.addObject(PYTHON, "_Element")
    element.addProperty("App::PropertyXLink", "LinkedObject")
    element.LinkedObject = parts[0]
    element.Shape = Part.makeBox(1, 1, 1).Faces[0]
    constraint = doc.addObject("App::FeaturePython", "Constraint")
    made = doc.addObject(PYTHON, name)
    for kind, what in (("Enumeration", "BuildShape"), ("Bool", "Freeze"), ("LinkList", "Group")):
        made.addProperty(f"App::Property{kind}", what)
    groups = [group(doc, "Constraints", constraint), group(doc, "Elements", *hidden(element))]
    made.Group = [*groups, group(doc, "Parts", *parts, visible=True), *more]
    return made


def imported(doc: Any, name: str, source: Any, file: str) -> Any:
    """What A2plus makes: a copy of the shape, and the file that it came from."""
    made = doc.addObject(PYTHON, name)
    for what, value in (("sourceFile", file), ("a2p_Version", "V0.4.60")):
        made.addProperty("App::PropertyString", what, "importPart")
        setattr(made, what, value)
    made.Shape = Part.getShape(source)
    return made


def telescope(folder: Path) -> None:
    """Assembly3 in one file: fasteners and a part below ``Parts``, a part with screws of its own beside."""
    doc = document(folder, "top")
    clamp = put(doc.addObject("App::Part", "Clamp"), box(doc, "ClampBox"))
    assembly3(doc, [screw(doc, "Bolt"), clamp, screw(doc, "Washer", "20")])
    put(doc.addObject("App::Part", "Plate"), box(doc, "PlateBox"), screw(doc, "A"), screw(doc, "B"))


def printer(folder: Path) -> None:
    """Assembly3 with a group of relations, and an assembly of another file in it twice."""
    part = box(document(folder, "part"), "Box")
    inner = document(folder, "carriage")
    carriage = assembly3(inner, [link(inner, part, "Wheel", 4), screw(inner, "Axle")])
    doc = document(folder, "top")
    relation = doc.addObject(PYTHON, "Relation")
    relations = group(doc, "Relations", relation)
    parts = [
        *(link(doc, carriage, name) for name in ("Left", "Right")),
        screw(doc, "Bolt"),
        screw(doc, "Nut"),
    ]
    assembly3(doc, parts, relations)


def changed_on_copy(folder: Path) -> None:
    """Screws by links that change their source: the copies are other articles, the source is none."""
    doc = document(folder, "top")
    source, part = screw(doc, "Source"), box(document(folder, "part"), "Box")
    copies = [screw(doc, f"Copy{size}", size, visible=False) for size in ("20", "30", "30")]
    kept = doc.addObject("App::LinkGroup", "CopyOnChangeGroup")
    kept.ElementList, kept.Visibility = copies, False
    links = []
    for copy in copies:
        made = link(doc, copy, f"L{copy.Name}")
        made.LinkCopyOnChangeSource = source
        made.LinkCopyOnChange = "Owned"
        links.append(made)
    assembly(doc, *links, link(doc, part, "Part"))
    hidden(source)


def masters(folder: Path) -> None:
    """A folder of masters that are switched off, in the assembly; one lies beside it."""
    doc = document(folder, "top")
    one, two, three = screw(doc, "One"), screw(doc, "Two", "20"), screw(doc, "Three", "30")
    folders = put(doc.addObject("App::DocumentObjectGroup", "Masters"), one, two)
    shown = [link(doc, one, "A", 3), link(doc, two, "B"), link(doc, two, "C"), link(doc, three, "D", 2)]
    assembly(doc, folders, *shown, link(doc, box(document(folder, "part"), "Box"), "Part"))
    hidden(one, two, three)


def model(folder: Path) -> None:
    """Assembly4: attached links in the model, spares in ``Parts``, masters in ``Source_shapes``."""
    part = box(document(folder, "part"), "Box")
    doc = document(folder, "top")
    made = doc.addObject("App::Part", "Model")
    made.Type = "Assembly"
    for number in range(3):
        attached = link(doc, part, f"Link{number}")
        attached.addProperty("App::PropertyString", "AttachedTo", "Assembly")
        attached.AttachedTo = "Parent Assembly#LCS_Origin"
        put(made, attached)
    source = screw(doc, "Source", visible=False)
    put(made, link(doc, source, "Screws", 4))
    spare = put(doc.addObject("App::DocumentObjectGroup", "Deeper"), screw(doc, "Spare", "20"))
    put(doc.addObject("App::DocumentObjectGroup", "Parts"), spare)
    put(
        doc.addObject("App::DocumentObjectGroup", "Source_shapes"),
        source,
        *hidden(screw(doc, "Unused", "30")),
    )


def beside(folder: Path) -> None:
    """What shows the assembly's screw once more beside it; a loose screw that is switched on, and one not."""
    doc = document(folder, "top")
    inside = screw(doc, "Inside")
    assembly(doc, inside, link(doc, box(document(folder, "part"), "Box"), "Part"))
    doc.recompute()
    App.setActiveDocument(doc.Name)  # where Draft puts what it makes
    Draft.make_clone(inside)
    steps = [App.Vector(*step) for step in ((9, 0, 0), (0, 9, 0), (0, 0, 9))]
    Draft.make_ortho_array(inside, *steps, 2, 2, 1)
    doc.addObject("App::LinkGroup", "Group").ElementList = [link(doc, inside, "InGroup")]
    mirror = doc.addObject("Part::Mirroring", "Mirror")
    mirror.Source = inside
    screw(doc, "Loose", "20")
    screw(doc, "Stored", "30", visible=False)
    inside.Visibility = True


def one_file(folder: Path) -> None:
    """The first assembly that a person makes: bodies, and links to them, in one file."""
    doc = document(folder, "top")
    bodies = [put(doc.addObject("App::Part", f"Part{n}"), box(doc, f"Box{n}", n + 1)) for n in range(3)]
    links = [link(doc, bodies[number % 3], f"L{number}") for number in range(8)]
    assembly(doc, *links, link(doc, bodies[0], "Row", 4))
    hidden(*bodies)


def at_the_root(folder: Path) -> None:
    """No container at all: links, screws, a body and a part lie in the document itself."""
    part = box(document(folder, "part"), "Box")
    doc = document(folder, "top")
    link(doc, part, "One")
    link(doc, part, "Row", 3)
    screw(doc, "A")
    screw(doc, "B")
    box(doc, "Base")
    put(doc.addObject("App::Part", "Lid"), box(doc, "LidBox", 3))


def imports(folder: Path) -> None:
    """A2plus: parts by a full and by a relative path, a sub-assembly, and a part from a STEP file."""
    part, other = box(document(folder, "part"), "Box"), box(document(folder, "other"), "Other", 3)
    sub = document(folder, "sub")
    pair = [imported(sub, f"Sub{n}", part, "./part.FCStd") for n in range(2)]
    doc = document(folder, "top")
    imported(doc, "A", part, str(folder / "part.FCStd"))
    imported(doc, "B", part, "./part.FCStd")
    imported(doc, "C", other, "./other.FCStd")
    both = doc.addObject(PYTHON, "Pair")
    for what, value in (("sourceFile", "./sub.FCStd"), ("a2p_Version", "V0.4.60")):
        both.addProperty("App::PropertyString", what, "importPart")
        setattr(both, what, value)
    both.Shape = Part.makeCompound([one.Shape for one in pair])
    imported(doc, "Board", other, "")
    constraint = doc.addObject("App::FeaturePython", "planeCoincident")
    constraint.addProperty("App::PropertyString", "Object1")


def cut_away(folder: Path) -> None:
    """Cut tools: at the root, in the assembly with the cut outside, and in it with the cut in it."""
    doc = document(folder, "top")
    tools = [screw(doc, name) for name in ("Root", "Outside", "Inside")]
    cuts = []
    for number, tool in enumerate(tools):
        cut = doc.addObject("Part::Cut", f"Cut{number}")
        cut.Base, cut.Tool = box(doc, f"Plate{number}", 40), tool
        cuts.append((cut, cut.Base))
        hidden(cut.Base, tool)
    bought = screw(doc, "Bought", "20")
    part = link(doc, box(document(folder, "part"), "Box"), "Part")
    made = assembly(doc, *tools[1:], *cuts[2], bought, part)
    made.removeObject(cuts[1][0])  # FreeCAD takes along what uses an object, and people take it out again


PROJECTS = (
    *(telescope, printer, changed_on_copy, masters, model, beside),
    *(one_file, at_the_root, imports, cut_away),
)


def main() -> None:
    for build in PROJECTS:
        folder = Path(os.environ["SILO_OUT"]) / build.__name__
        folder.mkdir(parents=True)
        build(folder)
        finish(folder)


if __name__ == "__main__":
    main()
