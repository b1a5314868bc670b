# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD's window: objects of many colours, and a picture of each from six sides.

The light is the base colour of each face: what a person chose, without shades.
"""

from __future__ import annotations

from typing import Any

from inside import FOLDER, VAULT, App, Gui, QtWidgets, run, tell

RED, GREEN, BLUE = (0.9, 0.1, 0.1), (0.1, 0.7, 0.2), (0.1, 0.2, 0.8)
SIDES = (RED, GREEN, BLUE, (0.9, 0.8, 0.1), (0.7, 0.1, 0.7), (0.1, 0.7, 0.8))
PIXELS = 120
# Elements that are objects, or entries of lists; "Over": with another colour over all of them.
ROWS = ("Row", "RowOver", "ShownRow", "ShownRowOver")


def box(doc: Any, name: str, kind: str = "Part::Box") -> Any:
    made = doc.addObject(kind, name)
    made.Length = made.Width = made.Height = 10
    return made


def material(colour: tuple[float, ...], clear: float = 0.0) -> Any:
    made = App.Material()
    made.DiffuseColor, made.Transparency = colour, clear
    return made


def link(doc: Any, name: str, target: Any, count: int = 0, shown: bool = True) -> Any:
    made = doc.addObject("App::Link", name)
    made.LinkedObject = target
    if count:
        made.ShowElement = shown
        made.ElementCount = count
        made.PlacementList = [App.Placement(App.Vector(12 * n, 0, 0), App.Rotation()) for n in range(count)]
    return made


def build() -> Any:
    """One object for each way in which FreeCAD keeps a colour."""
    doc = App.newDocument("Colours")
    top = doc.addObject("App::Part", "Assembly")
    top.Type = "Assembly"
    plain, faces, clear = (box(doc, name) for name in ("Plain", "Faces", "Clear"))
    body = doc.addObject("PartDesign::Body", "Body")
    body.addObject(box(doc, "Base", "PartDesign::AdditiveBox"))
    links = [link(doc, name, plain) for name in ("Link", "Over", "OverClear")]
    links += [link(doc, "OverFaces", faces)]
    rows = [link(doc, name, plain, 2, shown=name.startswith("Shown")) for name in ROWS]
    for made in (plain, faces, clear, body, *links, *rows):
        top.addObject(made)
    doc.recompute()
    plain.ViewObject.ShapeColor = GREEN
    faces.ViewObject.DiffuseColor = list(SIDES)
    clear.ViewObject.ShapeColor, clear.ViewObject.Transparency = BLUE, 60
    body.ViewObject.ShapeColor = SIDES[3]
    _link, over, over_clear, over_faces = (made.ViewObject for made in links)
    looks = material(RED), material(RED, 0.5), material(BLUE)
    for view, look in zip((over, over_clear, over_faces), looks, strict=True):
        view.OverrideMaterial, view.ShapeMaterial = True, look
    for row in rows:
        if row.ShowElement:
            first = row.ElementList[0].ViewObject
            first.OverrideMaterial, first.ShapeMaterial = True, material(SIDES[4])
        else:
            row.ViewObject.OverrideMaterialList = [True, False]
            row.ViewObject.MaterialList = [material(SIDES[4]), material(BLUE)]
        if row.Name.endswith("Over"):
            row.ViewObject.OverrideMaterial, row.ViewObject.ShapeMaterial = True, material(RED)
    plain.Visibility = True  # an array without elements hides what it shows
    doc.recompute()
    doc.saveAs(str(VAULT / "Colours.FCStd"))
    return doc


def photograph(doc: Any, name: str) -> None:
    """Save what FreeCAD shows of one object."""
    from pivy import coin

    for obj in doc.getObject("Assembly").Group:
        obj.Visibility = obj.Name == name
    QtWidgets.QApplication.processEvents()
    view = Gui.ActiveDocument.ActiveView
    camera, graph = view.getCameraNode(), view.getSceneGraph()
    turns = [coin.SbRotation(coin.SbVec3f(1, 0, 0), 1.570796 * n) for n in range(4)]
    turns += [coin.SbRotation(coin.SbVec3f(0, 1, 0), 1.570796 * n) for n in (1, 3)]
    for number, turn in enumerate(turns):
        camera.orientation = turn
        camera.viewAll(graph, coin.SbViewportRegion(PIXELS, PIXELS))
        view.saveImage(str(FOLDER / f"{name}-{number}.png"), PIXELS, PIXELS, "White")


def story() -> None:
    from pivy import coin

    doc = build()
    names = [obj.Name for obj in doc.getObject("Assembly").Group if hasattr(obj.ViewObject, "DisplayMode")]
    names = [name for name in names if "Origin" not in name]
    for obj in doc.Objects:
        if "Shaded" in getattr(obj.ViewObject, "listDisplayModes", list)():
            obj.ViewObject.DisplayMode = "Shaded"  # without edges
    view = Gui.ActiveDocument.ActiveView
    view.setCameraType("Orthographic")
    flat = coin.SoLightModel()
    flat.model = coin.SoLightModel.BASE_COLOR
    flat.setOverride(True)
    view.getSceneGraph().insertChild(flat, 0)
    for name in names:
        photograph(doc, name)
    tell(names=names)


run(story, ready=lambda: True)
