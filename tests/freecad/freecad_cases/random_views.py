# SPDX-License-Identifier: LGPL-2.1-or-later
"""Random assemblies as a designer leaves them, built by the FreeCAD that runs this: with hidden objects,
clones, cuts with visible tools, features over links, references, configured copies, excluded elements::

    SILO_RANDOM='{"out": "folder", "seeds": [1, 2, 3]}' freecadcmd -c 'import runpy; runpy.run_path(…)'

Each object has a volume of its own. What is right follows from the sentences of docs/counting.md, said here
once more for each scene; what is seen follows from FreeCAD's own shape. The code under test is not used.
"""

from __future__ import annotations

import json
import os
import random
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import Draft
import FreeCAD as App
import Part

NUMBER = "00000000-0000-4000-8000-00000000000b"


class View:
    """One assembly with its parts.

    right
        line → pieces, own parts with a star; ``weighs``: volume → pieces that are weighed.
    named, left_out
        objects that a finding has to name; those of them that are seen and excluded.
    """

    def __init__(self, folder: Path, seed: int) -> None:
        self.folder, self.random = folder, random.Random(seed)
        folder.mkdir(parents=True)
        self.right: Counter[str] = Counter()
        self.weighs: list[tuple[Any, int]] = []
        self.named: list[str] = []
        self.left_out: list[Any] = []
        self.number = 0
        self.is_numbered = False

    def build(self) -> None:
        self.parts = [self.part(number) for number in range(3)]
        self.doc = doc = self.document("top")
        App.setActiveDocument(doc.Name)
        root = doc.addObject("App::Part", "Root")
        root.Type = "Assembly"
        self.count(self.link(), 1)
        self.put(root, [doc.getObject("Link1"), self.stored()])
        holder = root
        for _ in range(self.random.randint(2, 6)):
            if self.random.random() < 0.25:
                holder = doc.addObject("App::Part", self.name("Group"))
                root.addObject(holder)
                self.put(holder, [self.counted_link()])
            scene: Callable[[], list[Any]] = self.random.choice(
                [
                    *(self.own_box, self.plain_link, self.elements, self.clone, self.cut, self.cut_of_link),
                    *(self.sweep, self.reference, self.configured, self.draft_array, self.compound),
                    *(self.weldment, self.measured, self.pad_on_a_face),
                ]
            )
            self.put(holder, scene())
        doc.recompute()
        doc.save()

    def document(self, name: str) -> Any:
        doc = App.newDocument(name)
        doc.saveAs(str(self.folder / f"{name}.FCStd"))
        return doc

    def part(self, number: int) -> Any:
        doc = self.document(f"part{number}")
        part = self.box(doc, f"Part{number}")
        if number == 2:  # a link may change its height
            part.Height = 3
            part.setPropertyStatus("Height", "CopyOnChange")
        doc.recompute()
        doc.save()
        return part

    # --- what scenes are made of ---

    def name(self, stem: str) -> str:
        self.number += 1
        return f"{stem}{self.number}"

    def somewhere(self) -> Any:
        return App.Placement(App.Vector(*(self.random.uniform(-900, 900) for _ in range(3))), App.Rotation())

    def box(self, doc: Any, name: str) -> Any:
        box = doc.addObject("Part::Box", name)
        box.Length, box.Width, box.Height = 2, 2, self.random.uniform(3, 9)
        box.Placement = self.somewhere()
        return box

    def body(self, name: str) -> Any:
        body = self.doc.addObject("PartDesign::Body", name)
        inner = self.doc.addObject("PartDesign::AdditiveBox", f"{name}Box")
        inner.Length, inner.Width, inner.Height = 2, 2, self.random.uniform(3, 9)
        body.addObject(inner)
        body.Placement = self.somewhere()
        return body

    def link(self, target: Any = None) -> Any:
        link = self.doc.addObject("App::Link", self.name("Link"))
        link.LinkedObject = target or self.random.choice(self.parts[:2])
        link.Placement = self.somewhere()
        return link

    def counted_link(self) -> Any:
        link = self.link()
        self.count(link, 1)
        return link

    def stored(self) -> Any:
        """What makes the file one with a view, whatever the scenes hide."""
        box = self.box(self.doc, "Stored")
        box.Visibility = False
        self.named.append(box.Name)
        return box

    def put(self, holder: Any, objects: list[Any]) -> None:
        for obj in objects:
            holder.addObject(obj)

    def count(self, obj: Any, pieces: int, *, weighed: bool = True) -> None:
        if not pieces:
            return
        target = obj.LinkedObject if obj.isDerivedFrom("App::Link") else None
        self.right[target.Name if target is not None else f"*{obj.Name}"] += pieces
        if weighed:
            self.weighs.append((obj, pieces))

    def hide(self, obj: Any, chance: float = 0.5) -> bool:
        obj.Visibility = self.random.random() >= chance
        return not obj.Visibility

    def own(self, obj: Any, *, hidden_is_named: bool = True) -> None:
        """A body counts if it is seen."""
        if obj.Visibility:
            self.count(obj, 1)
        elif hidden_is_named:
            self.named.append(obj.Name)

    def mark(self, obj: Any, is_left_out: bool) -> None:
        obj.addProperty("App::PropertyBool", "SiloBomExclude", "Silo")
        obj.SiloBomExclude = is_left_out

    # --- scenes ---

    def own_box(self) -> list[Any]:
        box = self.box(self.doc, self.name("Box"))
        self.hide(box)
        answer = self.random.choice([None, None, True, False])
        if answer is None:
            self.own(box)
        else:
            self.mark(box, answer)
            self.count(box, 0 if answer else 1)
            if answer and box.Visibility:
                self.named.append(box.Name)
                self.left_out.append(box)
        return [box]

    def plain_link(self) -> list[Any]:
        link = self.link()
        if self.hide(link):
            self.named.append(link.Name)
        self.count(link, 1)
        return [link]

    def elements(self) -> list[Any]:
        """A link array of three; one of its elements is left out."""
        link = self.link()
        link.ShowElement, link.ElementCount = True, 3
        for element in link.ElementList:
            element.Placement = self.somewhere()
        if is_less := self.random.random() < 0.5:
            self.mark(link.ElementList[1], True)
        self.count(link, 3 - is_less)
        return [link]

    def clone(self) -> list[Any]:
        """PartDesign's Clone, or Draft's."""
        original = self.body(self.name("Body"))
        self.hide(original)
        if self.random.random() < 0.5:
            clone = self.doc.addObject("PartDesign::Body", self.name("Clone"))
            feature = self.doc.addObject("PartDesign::FeatureBase", self.name("Base"))
            clone.addObject(feature)
            feature.BaseFeature = original
            clone.Tip = feature
            clone.Placement = self.somewhere()
            self.hide(clone, 0.3)
            self.own(original, hidden_is_named=False)
            self.own(clone)
        else:
            self.doc.recompute()
            clone = Draft.make_clone(original)
            clone.Placement = self.somewhere()
            clone.Visibility = True
            self.count(original, 1 + original.Visibility)
        return [original, clone]

    def cut(self) -> list[Any]:
        """A foam and the device that cut its place, each seen or not."""
        foam, device = self.box(self.doc, self.name("Foam")), self.box(self.doc, self.name("Device"))
        device.Length, device.Placement = 1, foam.Placement
        cut = self.doc.addObject("Part::Cut", self.name("Cut"))
        cut.Base, cut.Tool = foam, device
        for obj in (foam, device):
            self.hide(obj, 0.7)
        self.hide(cut, 0.2)
        for obj in (foam, device):
            self.own(obj, hidden_is_named=False)
        self.own(cut)
        return [foam, device, cut]

    def cut_of_link(self) -> list[Any]:
        """A linked part that is drilled here: it counts, and its new shape is weighed."""
        link, drill = self.link(), self.box(self.doc, self.name("Drill"))
        drill.Length, drill.Placement = 1, link.Placement
        drill.Visibility = False
        cut = self.doc.addObject("Part::Cut", self.name("Drilled"))
        cut.Base, cut.Tool = link, drill
        link.Visibility = False
        self.count(link, 1, weighed=False)
        self.weighs.append((cut, 1))
        self.named.append(cut.Name)
        return [link, drill, cut]

    def sweep(self) -> list[Any]:
        """A sweep along an edge of a body uses the edge, not the body."""
        box = self.box(self.doc, self.name("Spine"))
        circle = self.doc.addObject("Part::Circle", self.name("Circle"))
        circle.Radius = self.random.uniform(0.1, 0.4)
        circle.Placement = box.Placement
        sweep = self.doc.addObject("Part::Sweep", self.name("Sweep"))
        sweep.Sections, sweep.Spine, sweep.Solid = [circle], (box, ["Edge1"]), True
        circle.Visibility = False
        self.hide(box, 0.3)
        self.own(box)
        self.own(sweep)
        return [box, circle, sweep]

    def reference(self) -> list[Any]:
        """A link that supports a binder; a hidden one is only a reference."""
        link = self.link()
        binder = self.doc.addObject("PartDesign::SubShapeBinder", self.name("Binder"))
        binder.Support = [(link, ("Face1",))]
        if self.hide(link):
            self.named.append(link.Name)
        else:
            self.count(link, 1)
        return [link, binder]

    def configured(self) -> list[Any]:
        """A link with values of its own shows a copy."""
        link = self.link(self.parts[2])
        link.LinkCopyOnChange = "Enabled"
        tall = self.random.choice([3, 4, 5])
        if tall != 3:
            link.Height = tall
        self.doc.recompute()
        if tall == 4:  # these have an item of their own, which one of their links says
            link.addProperty("App::PropertyString", "SiloItemId", "Silo")
            link.SiloItemId = "" if self.is_numbered else NUMBER
            self.is_numbered = True
        number = " (own number)" if tall == 4 else ""
        self.right["Part2" if tall == 3 else f"Part2, Height = {tall} mm{number}"] += 1
        self.weighs.append((link, 1))
        return [link]

    def weldment(self) -> list[Any]:
        """Two linked parts that are joined here: they count, and what is weighed is their union."""
        links = [self.link(), self.link()]
        welded = self.doc.addObject("Part::MultiFuse", self.name("Welded"))
        welded.Shapes = links
        for link in links:
            link.Visibility = False
            self.count(link, 1, weighed=False)
        self.weighs.append((welded, 1))
        self.named.append(welded.Name)
        return [*links, welded]

    def measured(self) -> list[Any]:
        """A link from which an expression takes a size; a hidden one is only a reference."""
        link, box = self.link(), self.box(self.doc, self.name("Sized"))
        box.setExpression("Height", f"{link.Name}.Placement.Base.x / 1000 + 4")
        if self.hide(link):
            self.named.append(link.Name)
        else:
            self.count(link, 1)
        self.own(box)
        return [link, box]

    def pad_on_a_face(self) -> list[Any]:
        """A body that grows from the face of another uses that face, not the body."""
        base, other = (
            self.body(self.name("Ground")),
            self.doc.addObject("PartDesign::Body", self.name("Tower")),
        )
        self.doc.recompute()
        binder = self.doc.addObject("PartDesign::SubShapeBinder", self.name("Face"))
        other.addObject(binder)
        binder.Support = [(base, ("Face6",))]
        pad = self.doc.addObject("PartDesign::Pad", self.name("Pad"))
        other.addObject(pad)
        pad.Profile, pad.Length = binder, self.random.uniform(3, 9)
        self.hide(base, 0.3)
        self.own(base)
        self.own(other)
        return [base, other]

    def draft_array(self) -> list[Any]:
        """Three of a box or of a link; the original is hidden, and an element may be left out."""
        base = self.link() if self.random.random() < 0.5 else self.box(self.doc, self.name("Base"))
        self.doc.recompute()
        steps = (App.Vector(20, 0, 0), App.Vector(0, 20, 0), App.Vector(0, 0, 20))
        array = Draft.make_ortho_array(base, *steps, 3, 1, 1, use_link=True)
        base.Visibility = False
        less = 0
        if self.random.random() < 0.5:
            array.ExpandArray = True
            self.doc.recompute()
            if array.ElementList and self.random.random() < 0.5:
                self.mark(array.ElementList[1], True)
                less = 1
        self.count(base, 3 - less)
        return [base, array]

    def compound(self) -> list[Any]:
        """Two boxes in a compound, all seen or not; a visible member of a hidden compound is a piece."""
        boxes = [self.box(self.doc, self.name("Member")) for _ in range(2)]
        pair = self.doc.addObject("Part::Compound", self.name("Pair"))
        pair.Links = boxes
        self.hide(pair, 0.4)
        for box in boxes:
            self.hide(box, 0.6)
            if box.Visibility and pair.Visibility:
                self.named.append(box.Name)
            elif box.Visibility:
                self.count(box, 1)
        self.own(pair)
        return [*boxes, pair]


def volume(shape: Any) -> str:
    return f"{shape.Volume:.3f}"


def solids(shape: Any) -> list[Any]:
    """Every solid; ``shape.Solids`` has those only once that lie in one place."""
    if shape.isNull():
        return []
    if shape.ShapeType == "Solid":
        return [shape]
    return [solid for part in shape.SubShapes for solid in solids(part)]


def truth(view: View) -> dict[str, Any]:
    doc = view.doc
    weighed: Counter[str] = Counter()
    for obj, pieces in view.weighs:
        single = obj.LinkedObject if obj.isDerivedFrom("App::Link") else obj
        for solid in solids(Part.getShape(single)):
            weighed[volume(solid)] += pieces
    seen = Counter(volume(solid) for solid in solids(Part.getShape(doc.getObject("Root"))))
    for box in view.left_out:
        seen -= Counter([volume(box.Shape)])
    return {"right": view.right, "weighs": weighed, "seen": seen, "named": view.named}


def main() -> None:
    job = json.loads(os.environ["SILO_RANDOM"])
    App.ParamGet("User parameter:BaseApp/Preferences/Document").SetBool("CreateBackupFiles", False)
    out = Path(job["out"])
    with open(out / "truth.jsonl", "a") as file:
        for seed in job["seeds"]:
            view = View(out / str(seed), seed)
            view.build()
            file.write(json.dumps([seed, truth(view)]) + "\n")
            file.flush()
            for name in list(App.listDocuments()):
                if name in App.listDocuments():
                    App.closeDocument(name)


if __name__ == "__main__":
    main()
