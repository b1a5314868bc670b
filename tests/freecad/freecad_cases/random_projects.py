# SPDX-License-Identifier: LGPL-2.1-or-later
"""Random projects, built by the FreeCAD that runs this, with the truth from its own geometry::

    SILO_RANDOM='{"out": "folder", "seeds": [1, 2, 3]}' freecadcmd -c 'import runpy; runpy.run_path(…)'

Every part and every article has a volume of its own, so the shape that FreeCAD makes of an assembly
(``Part.getShape``) shows how often each is shown. Nothing of the code under test is used here.
"""

from __future__ import annotations

import json
import os
import random
from collections import Counter
from pathlib import Path
from typing import Any

import Draft
import FreeCAD as App
import Part

NEW = tuple(int(part) for part in App.Version()[:2]) >= (1, 0)
SIZES = ("8", "12", "16")
LINKED_FROM_OUTSIDE = ("Inner", "Array", "Compound", "Screw", "Clone", "Mirror")


class Project:
    """One project in a folder: parts, sub-assemblies, and ``top.FCStd``."""

    def __init__(self, folder: Path, seed: int) -> None:
        self.folder, self.random = folder, random.Random(seed)
        folder.mkdir(parents=True)
        self.assemblies: list[Any] = []
        self.inner: list[Any] = []  # what lies in assemblies and may be linked from other files

    def document(self, name: str) -> Any:
        doc = App.newDocument(name)
        doc.saveAs(str(self.folder / f"{name}.FCStd"))
        return doc

    def build(self) -> None:
        self.parts = []
        for number in range(3):
            box = self.document(f"part{number}").addObject("Part::Box", f"Part{number}")
            box.Length, box.Width, box.Height = 1, 1, number + 1
            self.parts.append(box)
        for number in range(self.random.randint(0, 2)):
            self.assemblies.append(self.assembly(f"sub{number}"))
            self.assemblies[-1].Document.save()  # imports are read from files
        self.assembly("top")
        for doc in App.listDocuments().values():
            doc.recompute()
        for doc in App.listDocuments().values():
            for link in doc.findObjects("Assembly::AssemblyLink") if NEW else ():
                show_as_the_assembly_does(link)
            doc.save()
        if self.random.random() < 0.3:  # saved once more, changed and not recomputed
            top = App.getDocument("top")
            top.getObject("Root").addObject(self.fastener(top))
            top.save()

    def assembly(self, name: str) -> Any:
        doc = self.document(name)
        App.setActiveDocument(doc.Name)
        if NEW and self.random.random() < 0.5:
            root = doc.addObject("Assembly::AssemblyObject", "Root")
        else:
            root = doc.addObject("App::Part", "Root")
            root.Type = "Assembly"
        self.link(doc, root, self.random.choice(self.parts))
        for obj in self.items(doc, root, depth=2):
            put(root, obj)
        if self.random.random() < 0.2:
            self.link(doc, doc.addObject("App::Part", "Beside"), self.parts[0])
        if self.random.random() < 0.03:  # nobody can know which is meant
            second = doc.addObject("App::Part", "Second")
            second.Type = "Assembly"
            self.link(doc, second, self.parts[0])
        doc.recompute()
        self.inner += [
            obj for obj in doc.Objects if obj.Visibility and obj.Name.startswith(LINKED_FROM_OUTSIDE)
        ]
        return root

    def items(self, doc: Any, root: Any, depth: int) -> list[Any]:
        made: list[Any] = []
        kinds = [self.linked, self.fastener, self.fastener, self.array_of_links, self.imported]
        seeing = [self.inside, self.again, self.draft, self.copy, self.elements]
        kinds += [*seeing, self.compound, self.cut] if depth else []
        for _ in range(self.random.randint(1, 4)):
            make = self.random.choice(kinds)
            obj = make(doc, root, depth, made) if make in seeing else make(doc)
            made += obj if isinstance(obj, list) else [obj] if obj is not None else []
        return made

    def place(self, obj: Any) -> Any:
        """Nothing lies where something else does: FreeCAD shows two equal solids in one place as one."""
        obj.Placement = self.somewhere()
        return obj

    def somewhere(self) -> Any:
        return App.Placement(App.Vector(*(self.random.uniform(-500, 500) for _ in range(3))), App.Rotation())

    # --- what an item may be ------------------------------------------------------------------------------

    def link(self, doc: Any, where: Any, target: Any, count: int = 0) -> Any:
        link = doc.addObject("App::Link", "Link")
        link.LinkedObject = target
        if count:
            link.ShowElement = self.random.random() < 0.5
            link.ElementCount = count
            places = [self.somewhere() for _ in range(count)]
            if link.ShowElement:
                for element, place in zip(link.ElementList, places, strict=True):
                    element.Placement = place
            else:
                link.PlacementList = places
        self.place(link)
        if where is not None:
            where.addObject(link)
        return link

    def linked(self, doc: Any) -> Any:
        others = [obj for obj in self.inner if obj.Document is not doc]
        target = self.random.choice(
            [*self.parts, *self.assemblies, *(others and [self.random.choice(others)])]
        )
        is_assembly = NEW and target.isDerivedFrom("Assembly::AssemblyObject")
        # An AssemblyLink leaves out what lies in link groups.
        if is_assembly and not target.Document.findObjects("App::LinkGroup") and self.random.random() < 0.5:
            link = doc.addObject("Assembly::AssemblyLink", "SubLink")
            link.LinkedObject = target
            return self.place(link)
        return self.link(doc, None, target)

    def array_of_links(self, doc: Any) -> Any:
        return self.link(doc, None, self.random.choice(self.parts), self.random.randint(1, 3))

    def fastener(self, doc: Any) -> Any:
        obj = doc.addObject("Part::FeaturePython", "Screw")
        size = self.random.randrange(len(SIZES))
        for name, value in (("Type", "ISO4762"), ("Diameter", "M4"), ("Length", SIZES[size])):
            obj.addProperty("App::PropertyEnumeration", name)
            setattr(obj, name, [value])
        obj.Shape = Part.makeBox(1, 1, 10 + size)
        return self.place(obj)

    def imported(self, doc: Any) -> Any:
        """What A2plus makes: a copy of the shape, and the file that it came from."""
        whole = [one for one in self.assemblies if not (NEW and has_assembly_links(one))]
        source = self.random.choice([*self.parts, *whole])
        obj = doc.addObject("Part::FeaturePython", "Import")
        file = Path(source.Document.FileName)
        path = str(file) if self.random.random() < 0.5 else f"./{file.name}"
        for name, kind, value in (
            ("a2p_Version", "App::PropertyString", "V0.4.60"),
            ("sourceFile", "App::PropertyFile", path),
            ("timeLastImport", "App::PropertyFloat", 1.0),
            ("subassemblyImport", "App::PropertyBool", source in whole),
        ):
            obj.addProperty(kind, name, "importPart")
            setattr(obj, name, value)
        obj.Shape = Part.getShape(source)
        return self.place(obj)

    def inside(self, doc: Any, root: Any, depth: int, _made: list[Any]) -> Any:
        kind = self.random.choice(["App::Part", "App::LinkGroup", "App::DocumentObjectGroup"])
        inner = self.items(doc, root, depth - 1)
        container = doc.addObject(kind, "Inner")
        if kind == "App::DocumentObjectGroup":
            # A container lists what lies in its folders as well; its shape would have that twice.
            container.Visibility = False
        else:
            self.place(container)
        if kind == "App::LinkGroup":
            # A link group shows also what is hidden elsewhere: the operands of a cut, the base of an array.
            inner = [obj for obj in inner if obj.Visibility or obj.isDerivedFrom("App::DocumentObjectGroup")]
            container.ElementList = inner
            if self.random.random() < 0.3:
                other = self.place(doc.addObject(kind, "Other"))
                other.ElementList = inner[:1]
                return [container, other]
        else:
            for obj in inner:
                put(container, obj)
        return container

    def again(self, doc: Any, _root: Any, _depth: int, made: list[Any]) -> Any:
        shown = [obj for obj in made if obj.Visibility and not obj.isDerivedFrom("App::DocumentObjectGroup")]
        target = self.random.choice(shown) if shown else None
        return self.link(doc, None, target, self.random.randint(0, 3)) if target is not None else None

    def draft(self, doc: Any, _root: Any, _depth: int, made: list[Any]) -> Any:
        use_link = self.random.random() < 0.6
        kinds = ("App::Link", "Part::FeaturePython", *(["App::Part"] if use_link else []))
        fitting = [obj for obj in made if obj.TypeId in kinds and obj.Visibility and not is_shown(obj)]
        if not fitting:
            return None
        base = self.random.choice(fitting)
        doc.recompute()
        kind = self.random.random()
        if kind < 0.5:
            steps = (App.Vector(9, 0, 0), App.Vector(0, 9, 0), App.Vector(0, 0, 9))
            array = Draft.make_ortho_array(base, *steps, 2, self.random.randint(1, 2), 1, use_link=use_link)
        elif kind < 0.8:
            array = Draft.make_polar_array(base, 3, 360, App.Vector(20, 0, 0), use_link=use_link)
        else:
            array = Draft.make_circular_array(base, 30, 25, 2, 1, use_link=use_link)
        base.Visibility = False  # as FreeCAD's window does
        return array

    def copy(self, doc: Any, _root: Any, _depth: int, made: list[Any]) -> Any:
        fitting = [obj for obj in made if obj.Name.startswith("Screw") and obj.Visibility]
        if not fitting:
            return None
        doc.recompute()
        if self.random.random() < 0.5:
            return self.place(Draft.make_clone(self.random.choice(fitting)))
        mirror = doc.addObject("Part::Mirroring", "Mirror")
        mirror.Source, mirror.Base = self.random.choice(fitting), self.somewhere().Base
        return mirror

    def elements(self, doc: Any, _root: Any, _depth: int, _made: list[Any]) -> Any:
        """Elements of an array, one by one in a group."""
        array = doc.addObject("App::Link", "Split")
        array.LinkedObject, array.ShowElement, array.ElementCount = self.random.choice(self.parts), True, 3
        for element in array.ElementList:
            self.place(element)
        group = self.place(doc.addObject("App::LinkGroup", "Elements"))
        group.ElementList = array.ElementList[: self.random.randint(1, 3)]
        array.Visibility = False
        return group

    def compound(self, doc: Any) -> Any:
        compound = doc.addObject("Part::Compound", "Compound")
        compound.Links = [self.fastener(doc) for _ in range(2)]
        for obj in compound.Links:
            obj.Visibility = False
        return [compound, *compound.Links]

    def cut(self, doc: Any) -> Any:
        base, tool = doc.addObject("Part::Box", "Plate"), self.fastener(doc)
        base.Length, base.Width, base.Height = 50, 50, 2
        cut = doc.addObject("Part::Cut", "Cut")
        cut.Base, cut.Tool = base, tool
        base.Visibility = tool.Visibility = False
        return [cut, base, tool]


def is_shown(obj: Any) -> bool:
    """True where another object shows it already; the base of an array is hidden, which those would see."""
    return bool(obj.InList)


def has_assembly_links(root: Any) -> bool:
    """True for an assembly with what is set to what it shows only in the end."""
    return bool(root.Document.findObjects("Assembly::AssemblyLink"))


def show_as_the_assembly_does(link: Any) -> None:
    """An AssemblyLink shows its copies also of what its assembly hides: operands, and originals of arrays."""
    for copy in link.Group:
        copy.Visibility = copy.LinkedObject.Visibility


def put(container: Any, obj: Any) -> None:
    if obj not in container.Group and not any(obj in group_of(parent) for parent in obj.InList):
        container.addObject(obj)


def group_of(obj: Any) -> list[Any]:
    return list(getattr(obj, "Group", ())) if "Group" in obj.PropertiesList else []


def shown(path: Path) -> dict[str, int]:
    """Volume in mm³ → how many solids of it the assembly shows."""
    doc = App.openDocument(str(path))
    shape = Part.getShape(doc.getObject("Root"))
    return dict(Counter(str(round(solid.Volume)) for solid in solids(shape) if solid.Volume < 1000))


def solids(shape: Any) -> list[Any]:
    """Every solid; ``shape.Solids`` has those only once that lie in one place."""
    if shape.isNull():
        return []
    if shape.ShapeType == "Solid":
        return [shape]
    return [solid for part in shape.SubShapes for solid in solids(part)]


def close_all() -> None:
    for name in list(App.listDocuments()):
        if name in App.listDocuments():
            App.closeDocument(name)


def main() -> None:
    job = json.loads(os.environ["SILO_RANDOM"])
    App.ParamGet("User parameter:BaseApp/Preferences/Document").SetBool("CreateBackupFiles", False)
    out = Path(job["out"])
    with open(out / "truth.jsonl", "a") as truth:
        for seed in job["seeds"]:
            project = Project(out / str(seed), seed)
            project.build()
            close_all()
            truth.write(json.dumps([seed, shown(project.folder / "top.FCStd")]) + "\n")
            truth.flush()
            close_all()


if __name__ == "__main__":
    main()
