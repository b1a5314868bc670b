# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where FreeCAD shows occurrences: ``SILO_ASKED`` has file → [root, paths, whole], ``SILO_OUT`` gets answers.

An answer is the least, the most and the mean of the corners of what stands at a path [mm], from the root. Of
paths in ``whole``, by number, it also has the box of the surfaces [mm], and the volume [mm³] if all is solid.
"""

from __future__ import annotations

import json
import os
from typing import Any

import FreeCAD as App
import Part


def corners(shape: Any) -> list[list[float]]:
    points = sorted({tuple(round(one, 6) for one in vertex.Point) for vertex in shape.Vertexes})
    axes = list(zip(*points, strict=True))
    return [[min(one) for one in axes], [max(one) for one in axes], [sum(one) / len(one) for one in axes]]


def measured(shape: Any) -> list[Any]:
    inner = App.BoundBox()
    for vertex in shape.Vertexes:
        inner.add(vertex.Point)
    outer = App.BoundBox(inner)
    for face in shape.Faces:
        if not inner.isInside(face.BoundBox):
            outer.add(face.optimalBoundingBox(False, False))
    in_solids = sum(len(solid.Faces) for solid in shape.Solids)
    low, high = ([getattr(outer, axis + side) for axis in "XYZ"] for side in ("Min", "Max"))
    volume = sum(solid.Volume for solid in shape.Solids)
    return [low, high, volume if shape.Faces and in_solids == len(shape.Faces) else None]


def placed(root: Any, path: list[str], whole: bool) -> Any:
    try:
        shape = Part.getShape(root, "".join(f"{one}." for one in path), transform=False)
    except Exception as error:  # noqa: BLE001 - an answer too
        return str(error)
    if shape is None or not shape.Vertexes:
        return "nothing"
    return [corners(shape), measured(shape) if whole else None]


answers: dict[str, Any] = {}
with open(os.environ["SILO_ASKED"]) as asked:
    for file, (root, paths, whole) in json.load(asked).items():
        doc = App.openDocument(file)
        top = doc.getObject(root)
        answers[file] = [placed(top, path, number in whole) for number, path in enumerate(paths)]
        for name in list(App.listDocuments()):
            if name in App.listDocuments():
                App.closeDocument(name)
with open(os.environ["SILO_OUT"], "w") as out:
    json.dump(answers, out)
