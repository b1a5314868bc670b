# SPDX-License-Identifier: LGPL-2.1-or-later
"""Runs inside FreeCAD: writes an assembly that places parts in every way, and what FreeCAD says of each leaf.

``SILO_OUT`` names the folder; ``leaves.json`` in it has, for each leaf of ``top.FCStd``, its path of object
names, the object it ends in, its volume [mm^3], its centre of volume [mm] and its matrix, in the assembly's
axes.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import FreeCAD as App
from FreeCAD import Placement, Rotation, Vector

OUT = Path(os.environ["SILO_OUT"])
STEEL = {"Name": "Steel", "Density": "7900 kg/m^3"}


def placed(x: float, y: float, z: float, angle: float = 0.0) -> Placement:
    """A shift and a turn about a skew axis."""
    return Placement(Vector(x, y, z), Rotation(Vector(1, 2, 3), angle))


def save(doc: Any, name: str) -> Any:
    """Recompute, save, and keep it open for links."""
    path = OUT / name
    path.parent.mkdir(parents=True, exist_ok=True)
    doc.recompute()
    doc.saveAs(str(path))
    return doc


def bolt() -> Any:
    """A part file with a lone feature, which has a placement of its own."""
    doc = App.newDocument("bolt")
    shape = doc.addObject("Part::Cylinder", "Bolt")
    shape.Radius, shape.Height = 3, 20
    shape.Placement = placed(5, 0, 0, 30)
    return save(doc, "parts/bolt.FCStd")


def bracket() -> Any:
    """A part container: a cut, whose operands do not count, a hidden block, and a material object."""
    doc = App.newDocument("bracket")
    part = doc.addObject("App::Part", "Bracket")
    part.Placement = placed(0, 0, 50)
    base = doc.addObject("Part::Box", "Base")
    base.Length, base.Width, base.Height = 40, 20, 10
    tool = doc.addObject("Part::Cylinder", "Drill")
    tool.Radius, tool.Height = 4, 30
    tool.Placement = placed(10, 10, -5)
    cut = doc.addObject("Part::Cut", "Cut")
    cut.Base, cut.Tool = base, tool
    cut.Placement = placed(1, 2, 3, 15)
    spare = doc.addObject("Part::Box", "Spare")
    spare.Visibility = False
    for obj in (base, tool, cut, spare):
        part.addObject(obj)
    material = doc.addObject("App::MaterialObjectPython", "Steel")
    material.Material = STEEL
    part.Material = material
    base.Visibility = tool.Visibility = False
    return save(doc, "parts/bracket.FCStd")


def plate() -> Any:
    """A Body of PartDesign: its tip's shape counts, its features do not."""
    doc = App.newDocument("plate")
    body = doc.addObject("PartDesign::Body", "Body")
    block = doc.addObject("PartDesign::AdditiveBox", "Block")
    block.Length, block.Width, block.Height = 30, 30, 5
    body.addObject(block)
    body.Placement = placed(0, 7, 0)
    doc.Label = "plate"
    return save(doc, "parts/plate.FCStd")


def link(doc: Any, name: str, target: Any, place: Placement, parent: Any = None) -> Any:
    """An App::Link in ``parent``."""
    made = doc.addObject("App::Link", name)
    made.LinkedObject = target
    made.Placement = place
    if parent is not None:
        parent.addObject(made)
    return made


def assembly(doc: Any, name: str) -> Any:
    """FreeCAD's own assembly where it has one, an Assembly4 container elsewhere."""
    if App.Version()[0] != "0":
        return doc.addObject("Assembly::AssemblyObject", name)
    made = doc.addObject("App::Part", name)
    made.Type = "Assembly"
    return made


def sub(parts: dict[str, Any]) -> Any:
    """A sub-assembly: a plate, and two bolts one of which moves with its own placement."""
    doc = App.newDocument("sub")
    save(doc, "sub.FCStd")
    top = assembly(doc, "Sub")
    top.Placement = placed(0, 0, 900)
    link(doc, "Plate", parts["plate"].Body, placed(0, 0, 0), top)
    link(doc, "BoltA", parts["bolt"].Bolt, placed(3, 3, 5, 45), top)
    moved = link(doc, "BoltB", parts["bolt"].Bolt, placed(-3, 3, 5), top)
    moved.LinkTransform = True
    return save(doc, "sub.FCStd")


def top(parts: dict[str, Any], below: Any) -> Any:
    """Every way of placing."""
    doc = App.newDocument("top")
    save(doc, "top.FCStd")
    whole = assembly(doc, "Top")
    whole.Placement = placed(1000, 0, 0, 10)
    bolt_of, bracket_of = parts["bolt"].Bolt, parts["bracket"].Bracket
    link(doc, "Plain", bolt_of, placed(0, 100, 0, 20), whole)
    link(doc, "WithTransform", bolt_of, placed(0, 200, 0, 20), whole).LinkTransform = True
    link(doc, "Part", bracket_of, placed(300, 0, 0, 60), whole)
    chain = link(doc, "First", bolt_of, placed(9, 9, 9), None)
    link(doc, "Chain", chain, placed(0, 300, 0, 70), whole)
    hidden = link(doc, "Row", bolt_of, placed(0, 400, 0, 5), whole)
    hidden.ShowElement = False
    hidden.ElementCount = 3
    hidden.PlacementList = [placed(10 * n, 0, 0, 30 * n) for n in range(3)]
    shown = link(doc, "Shown", bolt_of, placed(0, 500, 0, 5), whole)
    shown.ElementCount = 2
    for n, element in enumerate(shown.ElementList):
        element.Placement = placed(0, 15 * n, 4, 25 * n)
    mirrored = link(doc, "Mirrored", bracket_of, placed(0, 600, 0, 33), whole)
    mirrored.ScaleVector = Vector(-1, 1, 1)
    scaled = link(doc, "Scaled", parts["plate"].Body, placed(0, 700, 0, 33), whole)
    scaled.ScaleVector = Vector(2, 1, 1)
    link(doc, "SubByLink", below.getObject("Sub"), placed(0, 0, 300, 12), whole)
    inline = doc.addObject("App::Part", "Inline")
    inline.Placement = placed(-200, 0, 0, 50)
    whole.addObject(inline)
    link(doc, "InInline", bolt_of, placed(1, 2, 3, 4), inline)
    local = doc.addObject("Part::Sphere", "Knob")
    local.Radius = 6
    local.Placement = placed(-300, 0, 0)
    whole.addObject(local)
    group = doc.addObject("App::LinkGroup", "Bundle")
    member = link(doc, "Member", bolt_of, placed(0, 0, 12, 3), None)
    group.ElementList = [member]
    group.Placement = placed(-400, 0, 0, 80)
    whole.addObject(group)
    inner = link(doc, "SubObject", None, placed(500, 0, 0, 25), whole)
    inner.LinkedObject = (bracket_of, "Cut.")
    draft_arrays(doc, whole, bolt_of)
    if App.Version()[0] != "0":
        instance = doc.addObject("Assembly::AssemblyLink", "Instance")
        instance.LinkedObject = below.getObject("Sub")
        instance.Placement = placed(0, 0, -300, 40)
        whole.addObject(instance)
        flexible = doc.addObject("Assembly::AssemblyLink", "Flexible")
        flexible.LinkedObject = below.getObject("Sub")
        flexible.Rigid = False
        flexible.Placement = placed(0, 0, -600, 40)
        whole.addObject(flexible)
        doc.recompute()
        for n, copy in enumerate(flexible.Group):
            if copy.isDerivedFrom("App::Link"):
                copy.Placement = placed(7 * n, -5, 3, 11 * n)
    return save(doc, "top.FCStd")


def draft_arrays(doc: Any, whole: Any, bolt_of: Any) -> None:
    """One array of links, whose elements are links' elements, and one array that is a shape of its own."""
    import Draft

    first = link(doc, "ArrayBase", bolt_of, placed(0, -500, 0, 35), None)
    of_links = Draft.make_ortho_array(first, v_x=Vector(30, 0, 0), n_x=2, n_y=2, n_z=1, use_link=True)
    of_links.Label = of_links.Label
    cube = doc.addObject("Part::Box", "ArrayCube")
    cube.Placement = placed(0, -700, 0)
    copies = Draft.make_ortho_array(cube, v_x=Vector(30, 0, 0), n_x=3, n_y=1, n_z=1, use_link=False)
    for obj in (first, of_links, cube, copies):
        whole.addObject(obj)
    doc.recompute()


def leaves(whole: Any) -> list[dict[str, Any]]:
    """Every shape that the assembly shows or hides, where FreeCAD itself puts it."""
    found: list[dict[str, Any]] = []

    def follow(path: str, depth: int) -> None:
        obj = whole.getSubObject(path, retType=1)
        end = obj.getLinkedObject(True)
        many = obj.isDerivedFrom("App::Link") and obj.ElementCount > 0
        if many or end.isDerivedFrom("App::Part") or end.isDerivedFrom("App::LinkGroup"):
            for inner in obj.getSubObjects() if depth < 9 else ():
                follow(path + inner, depth + 1)
        elif end.isDerivedFrom("Part::Feature"):
            solids = whole.getSubObject(path).Solids
            volume = sum(s.Volume for s in solids)
            if volume:
                centre = [sum(s.Volume * s.CenterOfMass[i] for s in solids) / volume for i in range(3)]
                matrix = list(whole.getSubObject(path, retType=4).A)
                found.append(
                    {"path": path, "object": end.Name, "volume": volume, "centre": centre, "matrix": matrix}
                )

    # In the assembly's own axes: without its own placement.
    whole.Placement = Placement()
    for name in whole.getSubObjects():
        follow(name, 0)
    return found


def main() -> None:
    """Build, save, look."""
    parts = {"bolt": bolt(), "bracket": bracket(), "plate": plate()}
    doc = top(parts, sub(parts))
    (OUT / "leaves.json").write_text(json.dumps(leaves(doc.getObject("Top")), indent=1))


main()
