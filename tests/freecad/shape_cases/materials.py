# SPDX-License-Identifier: LGPL-2.1-or-later
"""Runs inside FreeCAD: one part file with every way of stating a material, and shapes of every kind.

``SILO_OUT`` names the folder; ``told.json`` in it has the density [kg/m^3] that FreeCAD's own library gives
for the material that was set (None where this FreeCAD has no materials on shapes), and the volume [mm^3] of
``Splines`` in closed form.
"""

from __future__ import annotations

import json
import math
import os
from itertools import pairwise
from pathlib import Path
from typing import Any

import FreeCAD as App
import Part
from FreeCAD import Placement, Rotation, Vector

OUT = Path(os.environ["SILO_OUT"])
STEEL_CARD = "92589471-a6cb-4bbc-b748-d425a17dea7d"


def material(doc: Any, name: str, **values: str) -> Any:
    made = doc.addObject("App::MaterialObjectPython", name)
    made.Material = {"Name": name, **values}
    return made


def part(doc: Any, whole: Any, name: str, shape: Any, material_object: Any = None) -> Any:
    """A part of its own, with one body; turned and shifted, so that both placements count."""
    holder = doc.addObject("App::Part", name)
    holder.Placement = Placement(Vector(10 * len(whole.Group), 3, 0), Rotation(Vector(1, 2, 3), 40))
    body = doc.addObject("Part::Feature", name + "Body")
    body.Shape = shape
    body.Placement = Placement(Vector(1, 2, 3), Rotation(Vector(0, 1, 0), 20))
    holder.addObject(body)
    if material_object is not None:
        holder.Material = material_object
    whole.addObject(holder)
    return body


def spline_solids() -> tuple[Any, float]:
    """A wavy outline along a straight line and round an axis, and the volume of both [mm^3].

    Both are y-moments of the outline's area: its depth times the area, its angle times the area's moment.
    """
    curve = Part.BSplineCurve()
    curve.interpolate([Vector(2, 0, 0), Vector(5, 0, 2), Vector(3, 0, 5), Vector(4, 0, 8), Vector(2, 0, 9)])
    close = Part.makeLine(Vector(2, 0, 9), Vector(2, 0, 0))
    face = Part.Face(Part.Wire([curve.toShape(), close]))
    extruded = face.extrude(Vector(1, 7, 0))
    revolved = face.revolve(Vector(0, -20, 0), Vector(1, 0, 0), 70)
    count = 100_000
    first, step = curve.FirstParameter, (curve.LastParameter - curve.FirstParameter) / count
    points = [curve.value(first + step * n) for n in range(count + 1)]
    strips = [((p.x + q.x) / 2 - 2, (p.z + q.z) / 2, q.z - p.z) for p, q in pairwise(points)]
    area = math.fsum(x * dz for x, _, dz in strips)
    moment = math.fsum(x * z * dz for x, z, dz in strips)
    return Part.makeCompound([extruded, revolved]), 7 * area + math.radians(70) * moment


def star() -> Any:
    """A closed spline drawn along a line; FreeCAD's own volume is 5 % off."""
    points = []
    for number in range(24):
        turn, radius = number * math.pi / 12, 25 if number % 2 else 40
        points.append(Vector(radius * math.cos(turn), radius * math.sin(turn), 0))
    curve = Part.BSplineCurve()
    curve.interpolate(points, True)
    return Part.Face(Part.Wire([curve.toShape()])).extrude(Vector(0, 0, 110))


def main() -> None:
    doc = App.newDocument("parts")
    whole = doc.addObject("App::Part", "Top")
    whole.Type = "Assembly"
    part(doc, whole, "Linked", Part.makeBox(10, 20, 30), material(doc, "Steel", Density="7900 kg/m^3"))
    part(doc, whole, "OtherUnit", Part.makeCylinder(3, 9), material(doc, "Brass", Density="8.5 g/cm^3"))
    part(doc, whole, "NoDensity", Part.makeSphere(4), material(doc, "Goo"))
    part(doc, whole, "Feather", Part.makeTorus(9, 2), material(doc, "Default", Density="1 kg/m^3"))
    part(doc, whole, "Untouched", Part.makeCone(4, 2, 6))
    splines, volume = spline_solids()
    part(doc, whole, "Splines", splines)
    part(doc, whole, "Star", star())
    block = Part.makeBox(9, 9, 9)
    part(doc, whole, "Rounded", block.makeFillet(2, block.Edges[:3]))
    part(doc, whole, "Hollow", Part.makeSphere(6).cut(Part.makeSphere(3)))
    part(doc, whole, "InsideOut", Part.makeBox(3, 4, 5).reversed())
    part(doc, whole, "Sheet", Part.makePlane(5, 5))
    part(doc, whole, "Curve", Part.makeCircle(5))
    faces = Part.makeBox(8, 8, 8, Vector(50, 0, 0)).Faces
    part(doc, whole, "Lidless", Part.makeCompound([Part.makeBox(9, 9, 9), Part.Shell(faces[1:])]))
    part(doc, whole, "LooseFaces", Part.makeCompound([Part.makeBox(9, 9, 9), *faces[1:]]))
    part(doc, whole, "ClosedFaces", Part.makeCompound([Part.makeBox(9, 9, 9), *faces]))
    part(doc, whole, "Labelled", Part.makeCompound([Part.makeBox(9, 9, 9), faces[0]]))
    part(doc, whole, "Emptied", Part.makeBox(7, 7, 7))
    doc.Emptied.addObject(doc.addObject("Part::Feature", "Nothing"))
    own = part(doc, whole, "OnShape", Part.makeBox(5, 5, 5))
    density = None
    if hasattr(own, "ShapeMaterial"):
        import Materials

        own.ShapeMaterial = Materials.MaterialManager().getMaterial(STEEL_CARD)
        density = own.ShapeMaterial.getPhysicalValue("Density").getValueAs("kg/m^3").Value
    doc.recompute()
    doc.saveAs(str(OUT / "parts.FCStd"))
    (OUT / "told.json").write_text(json.dumps({"density": density, "splines": volume}))


main()
