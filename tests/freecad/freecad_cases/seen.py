# SPDX-License-Identifier: LGPL-2.1-or-later
"""Small assemblies whose count follows from what is seen, built by the FreeCAD that runs this::

    SILO_OUT=folder freecadcmd -c 'import runpy; runpy.run_path(…)'

``right.json`` says what each has to count, own parts with a star.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import Draft
import FreeCAD as App

CASES: dict[str, tuple[Callable[[Scene], None], dict[str, int]]] = {}
Build = Callable[["Scene"], None]


class Scene:
    """One assembly in a folder, beside the part that it links to."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True)
        self.folder = folder
        plate = self.document("plate")
        self.plate = plate.addObject("Part::Box", "Plate")
        self.plate.setPropertyStatus("Height", "CopyOnChange")
        plate.recompute()
        plate.save()
        self.doc = self.document("top")
        App.setActiveDocument(self.doc.Name)
        self.root = self.doc.addObject("App::Part", "Root")
        self.root.Type = "Assembly"

    def document(self, name: str) -> Any:
        doc = App.newDocument(name)
        doc.saveAs(str(self.folder / f"{name}.FCStd"))
        return doc

    def add(self, kind: str, name: str, *, seen: bool = True, at: float = 0.0, **values: Any) -> Any:
        obj = self.doc.addObject(kind, name)
        for key, value in values.items():
            setattr(obj, key, value)
        obj.Visibility = seen
        if at:
            obj.Placement.Base = App.Vector(at, 0, 0)
        self.root.addObject(obj)
        return obj

    def box(self, name: str, **more: Any) -> Any:
        return self.add("Part::Box", name, **more)

    def link(self, name: str, **more: Any) -> Any:
        return self.add("App::Link", name, LinkedObject=self.plate, **more)

    def body(self, name: str, **more: Any) -> Any:
        body = self.add("PartDesign::Body", name, **more)
        body.addObject(self.doc.addObject("PartDesign::AdditiveBox", f"{name}Box"))
        return body

    def clone(self, name: str, original: Any, **more: Any) -> Any:
        clone = self.add("PartDesign::Body", name, **more)
        feature = self.doc.addObject("PartDesign::FeatureBase", f"{name}Base")
        clone.addObject(feature)
        feature.BaseFeature = original
        clone.Tip = feature
        return clone


def case(**right: int) -> Callable[[Build], Build]:
    """Note a case; ``own_X`` is an own part X."""

    def noted(build: Build) -> Build:
        CASES[build.__name__] = (build, {name.replace("own_", "*"): number for name, number in right.items()})
        return build

    return noted


@case(own_Lid=1, own_LidB=1, own_LidC=1)
def two_clones_of_one_body(scene: Scene) -> None:
    lid = scene.body("Lid")
    scene.clone("LidB", lid, at=30)
    scene.clone("LidC", lid, at=60)
    scene.box("Stored", seen=False)


@case(own_LidC=1)
def a_clone_of_a_hidden_clone(scene: Scene) -> None:
    hidden = scene.clone("LidB", scene.body("Lid", seen=False), seen=False)
    scene.clone("LidC", hidden, at=60)


@case(own_Foam=1, own_Meter=1, own_Probe=1)
def a_foam_cut_by_two_visible_devices(scene: Scene) -> None:
    both = [scene.box("Meter", Length=2), scene.box("Probe", Width=2)]
    first = scene.add("Part::Cut", "First", seen=False, Base=scene.box("Block", seen=False), Tool=both[0])
    scene.add("Part::Cut", "Foam", Base=first, Tool=both[1])


@case(Plate=1)
def a_linked_plate_with_two_holes(scene: Scene) -> None:
    link = scene.link("Link", seen=False)
    drills = [scene.box(f"Drill{number}", seen=False, Length=number) for number in (1, 2)]
    first = scene.add("Part::Cut", "First", seen=False, Base=link, Tool=drills[0])
    scene.add("Part::Cut", "Drilled", Base=first, Tool=drills[1])


@case(Plate=3)
def a_weldment_of_three_links(scene: Scene) -> None:
    links = [scene.link(f"Link{number}", seen=False, at=5.0 * number) for number in range(3)]
    scene.add("Part::MultiFuse", "Welded", Shapes=links)


@case(Plate=3)
def an_expanded_array_of_four_without_one(scene: Scene) -> None:
    base = scene.link("Base")
    scene.doc.recompute()
    steps = (App.Vector(20, 0, 0), App.Vector(0, 20, 0), App.Vector(0, 0, 20))
    array = Draft.make_ortho_array(base, *steps, 4, 1, 1, use_link=True)
    scene.root.addObject(array)
    base.Visibility = False
    array.ExpandArray = True
    scene.doc.recompute()
    array.ElementList[2].addProperty("App::PropertyBool", "SiloBomExclude", "Silo")
    array.ElementList[2].SiloBomExclude = True


@case(Plate=3)
def an_array_along_an_edge_of_a_wire(scene: Scene) -> None:
    base = scene.link("Base")
    wire = Draft.make_wire([App.Vector(0, 0, 0), App.Vector(90, 0, 0), App.Vector(90, 90, 0)])
    scene.root.addObject(wire)
    scene.doc.recompute()
    array = Draft.make_path_array(base, wire, 3, use_link=True)
    scene.root.addObject(array)
    base.Visibility = False


@case(own_Case=1)
def a_case_with_two_hidden_terminals(scene: Scene) -> None:
    scene.body("Case")
    scene.body("Plus", seen=False)
    scene.body("Minus", seen=False)


@case(Plate=1)
def a_hidden_link_that_gives_a_sketch_its_edges(scene: Scene) -> None:
    scene.link("Real", at=50)
    reference = scene.link("Ref", seen=False)
    scene.add("PartDesign::SubShapeBinder", "Binder", Support=[(reference, ("Edge1", "Edge2"))])


@case(Plate=1, Plate_30=2)
def two_copies_with_equal_values(scene: Scene) -> None:
    for number, height in enumerate((10, 30, 30)):
        link = scene.link(f"Link{number}", at=20.0 * number)
        link.LinkCopyOnChange = "Enabled"
        if height != 10:
            link.Height = height
        scene.doc.recompute()


@case(Plate=1, Plate_30=1, Plate_40_item=2)
def copies_of_which_some_have_a_number(scene: Scene) -> None:
    """The part has an identity, which its copies take along; one of two equal links has another."""
    scene.plate.addProperty("App::PropertyString", "SiloItemId", "Silo")
    scene.plate.SiloItemId = "00000000-0000-4000-8000-00000000000a"
    scene.plate.Document.save()
    for number, height in enumerate((10, 30, 40, 40)):
        link = scene.link(f"Link{number}", at=20.0 * number)
        link.LinkCopyOnChange = "Enabled"
        if height != 10:
            link.Height = height
        scene.doc.recompute()
    link.addProperty("App::PropertyString", "SiloItemId", "Silo")
    link.SiloItemId = "00000000-0000-4000-8000-00000000000b"


@case(missing_Link=1, Plate=1)
def a_deleted_copy(scene: Scene) -> None:
    scene.link("Whole", at=50)
    link = scene.link("Link")
    link.LinkCopyOnChange = "Enabled"
    link.Height = 30
    scene.doc.recompute()
    scene.doc.removeObject(link.LinkedObject.Name)


def main() -> None:
    App.ParamGet("User parameter:BaseApp/Preferences/Document").SetBool("CreateBackupFiles", False)
    out = Path(os.environ["SILO_OUT"])
    for name, (build, _) in CASES.items():
        scene = Scene(out / name)
        build(scene)
        scene.doc.recompute()
        scene.doc.save()
        for document in list(App.listDocuments()):
            if document in App.listDocuments():
                App.closeDocument(document)
    (out / "right.json").write_text(json.dumps({name: right for name, (_, right) in CASES.items()}))


if __name__ == "__main__":
    main()
