# SPDX-License-Identifier: LGPL-2.1-or-later
"""Counts that are wrong on purpose: what the witness says of each, in the FreeCAD that runs this.

Builds assemblies, breaks one routine of the count at a time, and writes what the witness says::

    SILO_OUT=answers.json freecadcmd -c 'import runpy; runpy.run_path(…)'
"""

from __future__ import annotations

import json
import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import Draft
import FreeCAD as App
import Part

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "mods"))

from silo.bom.walk import arrays, facts, joints, kinds, links, operands, roles, roots, targets, tree
from silo.workbench.freecad import host, live, witness


def document(folder: Path, name: str) -> Any:
    doc = App.newDocument(name)
    doc.saveAs(str(folder / f"{name}.FCStd"))
    return doc


def screw(doc: Any, name: str, length: str = "16", *, visible: bool = True) -> Any:
    obj = doc.addObject("Part::FeaturePython", name)
    for attribute, value in (("Type", "ISO4762"), ("Diameter", "M4"), ("Length", length)):
        obj.addProperty("App::PropertyEnumeration", attribute)
        setattr(obj, attribute, [value])
    obj.Shape = Part.makeBox(1, 1, 10)
    obj.Visibility = visible
    return obj


def link(doc: Any, target: Any, name: str, count: int = 0) -> Any:
    made = doc.addObject("App::Link", name)
    made.LinkedObject, made.ElementCount = target, count
    return made


def hidden(*objects: Any) -> list[Any]:
    for obj in objects:
        obj.Visibility = False
    return list(objects)


def with_everything(folder: Path) -> str:
    """Arrays, a compound, a hidden master, a cut and marks in a part; screws beside it."""
    part = document(folder, "part").addObject("Part::Box", "Box")
    doc = document(folder, "top")
    top = doc.addObject("App::Part", "Top")
    top.Type = "Assembly"
    base, master, inner = screw(doc, "Base"), screw(doc, "Master", "20"), screw(doc, "Inner", "25")
    doc.recompute()
    array = Draft.make_ortho_array(
        base, App.Vector(9, 0, 0), App.Vector(0, 9, 0), App.Vector(0, 0, 9), 2, 2, 1
    )
    compound = doc.addObject("Part::Compound", "Pair")
    compound.Links = [inner]
    plate, tool = doc.addObject("Part::Box", "Plate"), screw(doc, "Tool", "30")
    cut = doc.addObject("Part::Cut", "Cut")
    cut.Base, cut.Tool = plate, tool
    out = link(doc, part, "Fixture")
    out.addProperty("App::PropertyBool", "SiloBomExclude")
    out.SiloBomExclude = True
    hidden(base, master, inner, plate, tool)
    row = link(doc, part, "Row", 3)
    quiet = link(doc, part, "Quiet")
    hidden(quiet)
    for obj in (
        base,
        array,
        inner,
        compound,
        plate,
        tool,
        cut,
        out,
        master,
        link(doc, master, "Copy"),
        row,
        quiet,
    ):
        top.addObject(obj)
    screw(doc, "Loose", "40")
    screw(doc, "Stored", "50", visible=False)
    return finish(folder)


def assembly3(folder: Path) -> str:
    """With a fourth group, as FreeCAD shows it without the add-on."""
    part = document(folder, "part").addObject("Part::Box", "Box")
    doc = document(folder, "top")
    top = doc.addObject("Part::FeaturePython", "Top")
    for kind, name in (("Enumeration", "BuildShape"), ("Bool", "Freeze"), ("LinkList", "Group")):
        top.addProperty(f"App::Property{kind}", name)
    groups = []
    for name in ("Constraints", "Elements", "Parts", "Relations"):
        group = doc.addObject("Part::FeaturePython", name)
        group.addProperty("App::PropertyLinkList", "Group")
        groups.append(group)
    groups[1].Group = [link(doc, (part, "Face1"), "Element")]
    groups[2].Group = [link(doc, part, "One"), link(doc, part, "Two"), screw(doc, "Screw")]
    top.Group = groups
    return finish(folder)


def finish(folder: Path) -> str:
    for doc in App.listDocuments().values():
        doc.recompute()
        doc.save()
    host.close_all()
    return str(folder / "top.FCStd")


def one_more(function: Any) -> Any:
    return lambda *args, **kwargs: (function(*args, **kwargs) or 0) + 1


def without_beside(function: Any) -> Any:
    return lambda *args, **kwargs: function(*args, **{**kwargs, "counts_beside": False})


def always(answer: Any) -> Any:
    return lambda _old: lambda *_args: answer


# A fault: where a routine is broken, its name, and what makes the broken one of the right one.
EITHER = {
    "an array counts one more": ((targets,), "array_count", one_more),
    "all counts twice": ((tree.Tree,), "times", lambda old: lambda one, name: 2 * old(one, name)),
    "links are construction": ((facts,), "no_component", always("a joint")),
}
FAULTS: dict[Any, dict[str, Any]] = {
    with_everything: {
        **EITHER,
        "a Draft array counts one more": ((roles,), "draft_count", one_more),
        "hidden sources count": ((tree.Tree,), "visible", always(True)),
        "operands count": ((operands.Consumers,), "of", always(None)),
        "excluded ones count": ((roles, arrays, tree, targets), "left_out_by", always("")),
        "hidden screws beside count": ((roots,), "is_switched_on", always(True)),
        "screws beside do not count": ((links,), "silent_reader", without_beside),
    },
    assembly3: {
        **EITHER,
        "its last group counts": (
            (kinds, joints, tree),
            "members",
            lambda _old: lambda one: one.Group[-1].Group,
        ),
    },
}
LINES: dict[str, Any] = {
    "a line has one more": lambda lines: (replace(lines[0], quantity=lines[0].quantity + 1), *lines[1:]),
    "a line is lost": lambda lines: lines[1:],
    "a line is there twice": lambda lines: (lines[0], *lines),
}


def said(path: str, change: Any = lambda lines: lines) -> list[dict[str, Any]]:
    found = live.read_checked(path)
    told = [one.as_dict() for one in witness.accounts(replace(found, entries=change(found.entries)))]
    host.close_all()
    return told


def main() -> None:
    answers = {}
    by_mark = arrays.left_out_by
    # FreeCAD's own view asks the right routine, whatever is broken.
    host.Pieces._left_out_by = property(lambda _pieces: by_mark, lambda _pieces, _other: None)
    for build, faults in FAULTS.items():
        folder = Path(os.environ["SILO_OUT"]).parent / build.__name__
        folder.mkdir()
        path = build(folder)
        answers[f"{build.__name__}: nothing"] = said(path)
        for fault, change in LINES.items():
            answers[f"{build.__name__}: {fault}"] = said(path, change)
        for fault, (places, name, broken) in faults.items():
            kept = [(place, getattr(place, name)) for place in places if hasattr(place, name)]
            for place, right in kept:
                setattr(place, name, broken(right))
            answers[f"{build.__name__}: {fault}"] = said(path)
            for place, right in kept:
                setattr(place, name, right)
    Path(os.environ["SILO_OUT"]).write_text(json.dumps(answers))


if __name__ == "__main__":
    main()
