# SPDX-License-Identifier: LGPL-2.1-or-later
"""Write the gearbox example: real FCStd files of a small machine, made by FreeCAD 1.0 or newer.

::

    ASM-001  Top Assembly                     TopAssembly.FCStd
      PRT-100  Base Plate           x 1       parts/BasePlate.FCStd
      ASM-200  Gearbox Sub-Assy     x 2       Gearbox.FCStd               two AssemblyLinks
        PRT-201  Housing            x 1       parts/Housing.FCStd
        PRT-202  Gear               x 4       parts/Gear.FCStd            one link array
        PRT-203  Shaft              x 1       parts/Shaft.FCStd
      PRT-300  Cover                x 1       parts/Cover.FCStd
      F01-001  M8x20 Bolt           x 12      parts/M8x20Bolt.FCStd       8 single links, an array of 4
      (no number)  Motor Mount      x 1       parts/MotorMount.FCStd
      "Layout reference": a link inside the document, construction geometry and no component

Run it with a screen (colours and thumbnails are then stored as well), real or virtual::

    xvfb-run -a freecad examples/gearbox/generate.py

or without::

    freecadcmd -c 'import runpy; runpy.run_path("examples/gearbox/generate.py", run_name="__main__")'

``SILO_EXAMPLE_OUT`` names another folder than the script's own. The files carry no Silo identity:
``silo-mod register`` gives it to them.
"""

from __future__ import annotations

import math
import os
import sys
import traceback
from pathlib import Path
from typing import Any

import FreeCAD as App
import Part

MODULE_MM = 2.0
SUN_TEETH = PLANET_TEETH = 16
RING_TEETH = SUN_TEETH + 2 * PLANET_TEETH
ORBIT_MM = MODULE_MM * (SUN_TEETH + PLANET_TEETH) / 2
FLANGE_HOLE_MM = 56.0
GEARBOX_X_MM = (-75.0, 75.0)
PLATE_TOP_MM, HOUSING_HEIGHT_MM, COVER_MM = 12.0, 46.0, 6.0

STEEL, ALUMINIUM, DARK, BRASS, BLUE = (
    (0.62, 0.64, 0.67),
    (0.82, 0.83, 0.85),
    (0.20, 0.21, 0.23),
    (0.80, 0.62, 0.25),
    (0.20, 0.42, 0.66),
)
STEEL_CARD, ALUMINIUM_CARD = "Steel-1C45", "Aluminum-6061-T6"

Vector = App.Vector
UP = Vector(0, 0, 1)


# --- shapes ---------------------------------------------------------------------------------------------


def cylinder(radius: float, height: float, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Any:
    return Part.makeCylinder(radius, height, Vector(x, y, z), UP)


def plate(x0: float, x1: float, width: float, thickness: float, corner: float) -> Any:
    """A flat plate on z = 0, symmetric in y, with rounded corners."""
    box = Part.makeBox(x1 - x0, width, thickness, Vector(x0, -width / 2, 0))
    upright = [e for e in box.Edges if abs(e.tangentAt(e.FirstParameter).z) > 0.99]
    return box.makeFillet(corner, upright)


def toothed(teeth: int, height: float, root: float, tip: float) -> Any:
    """A prism with straight-flanked teeth, one of them on the x axis. ``root`` > ``tip``: a ring's bore."""
    pitch = MODULE_MM * teeth / 2
    step = 2 * math.pi / teeth
    # Half widths of a tooth as a part of the step; less than a quarter at the pitch circle is the backlash.
    flank = ((root, 0.36), (pitch, 0.235), (tip, 0.13))
    points = []
    for k in range(teeth):
        for radius, part in (*flank, *((r, -p) for r, p in reversed(flank))):
            angle = step * (k - part)
            points.append(Vector(radius * math.cos(angle), radius * math.sin(angle), 0))
    wire = Part.makePolygon([*points, points[0]])
    return Part.Face(wire).extrude(Vector(0, 0, height))


def base_plate() -> Any:
    solid = plate(-160, 245, 160, PLATE_TOP_MM, 14)
    for x, y in flange_holes():
        solid = solid.cut(cylinder(3.4, 40, x, y, -5))
    return solid


def housing() -> Any:
    solid = plate(-66, 66, 132, 10, 10).fuse(cylinder(63, HOUSING_HEIGHT_MM))
    solid = solid.cut(cylinder(46, HOUSING_HEIGHT_MM, z=36))
    pitch = MODULE_MM * RING_TEETH / 2
    bore = toothed(RING_TEETH, HOUSING_HEIGHT_MM, pitch + 2.4, pitch - 1.9)
    bore.translate(Vector(0, 0, 8))
    solid = solid.cut(bore).cut(cylinder(12, 30, z=-5))
    for sx in (-1, 1):
        for sy in (-1, 1):
            solid = solid.cut(cylinder(4.5, 30, sx * FLANGE_HOLE_MM, sy * FLANGE_HOLE_MM, -5))
    for y in (-57, 57):
        solid = solid.cut(cylinder(3.4, 18, 0, y, HOUSING_HEIGHT_MM - 16))
    return solid.removeSplitter()


def gear() -> Any:
    pitch = MODULE_MM * PLANET_TEETH / 2
    solid = toothed(PLANET_TEETH, 22, pitch - 2.4, pitch + 1.9).cut(cylinder(5, 40, z=-5))
    for top in (-1, 19):
        solid = solid.cut(cylinder(11, 4, z=top).cut(cylinder(7.5, 4, z=top)))
    return solid


def shaft() -> Any:
    pitch = MODULE_MM * SUN_TEETH / 2
    solid = toothed(SUN_TEETH, 22, pitch - 2.4, pitch + 1.9)
    solid.translate(Vector(0, 0, 12))
    solid = solid.fuse(cylinder(10, 96, z=-6)).cut(Part.makeBox(5, 6, 24, Vector(7, -3, 64)))
    chamfer = Part.makeCone(12, 8.5, 3.5, Vector(0, 0, 87), UP)
    return solid.cut(cylinder(14, 3.5, z=87).cut(chamfer))


def cover() -> Any:
    solid = plate(-138, 138, 128, COVER_MM, 62)
    for x in GEARBOX_X_MM:
        solid = solid.cut(cylinder(42, 20, x, 0, -5))
        for y in (-57, 57):
            solid = solid.cut(cylinder(4.5, 20, x, y, -5))
    return solid


def bolt() -> Any:
    """M8 x 20, ISO 4762 head; the thread is a plain shank. Head rests on z = 0, shank points down."""
    head = cylinder(6.5, 8)
    head = head.makeFillet(0.8, [e for e in head.Edges if e.BoundBox.ZMin > 7])
    corners = [
        Vector(3.46 * math.cos(math.pi / 3 * k), 3.46 * math.sin(math.pi / 3 * k), 4) for k in range(7)
    ]
    socket = Part.Face(Part.makePolygon(corners)).extrude(Vector(0, 0, 6))
    return head.fuse(cylinder(4, 20, z=-20)).cut(socket).removeSplitter()


def motor_mount() -> Any:
    foot = Part.makeBox(46, 110, 8, Vector(0, -55, 0))
    wall = Part.makeBox(8, 110, 96, Vector(0, -55, 0))
    solid = foot.fuse(wall)
    for y in (-55, 47):
        rib = Part.Face(
            Part.makePolygon([Vector(8, y, 8), Vector(42, y, 8), Vector(8, y, 70), Vector(8, y, 8)])
        )
        solid = solid.fuse(rib.extrude(Vector(0, 8, 0)))
    solid = solid.cut(Part.makeCylinder(19.1, 30, Vector(-5, 0, 56), Vector(1, 0, 0)))
    for y in (-23.6, 23.6):
        for z in (32.4, 79.6):
            solid = solid.cut(Part.makeCylinder(2.6, 30, Vector(-5, y, z), Vector(1, 0, 0)))
    return solid.removeSplitter()


def flange_holes() -> list[tuple[float, float]]:
    return [
        (x + sx * FLANGE_HOLE_MM, sy * FLANGE_HOLE_MM)
        for x in GEARBOX_X_MM
        for sx in (-1, 1)
        for sy in (-1, 1)
    ]


# --- documents ------------------------------------------------------------------------------------------


def at(x: float = 0.0, y: float = 0.0, z: float = 0.0, turn_deg: float = 0.0) -> Any:
    return App.Placement(Vector(x, y, z), App.Rotation(UP, turn_deg))


def new_document(path: Path, label: str) -> Any:
    doc = App.newDocument(path.stem)
    doc.saveAs(str(path))  # links across documents need files
    doc.Label = label
    return doc


def finish(doc: Any) -> None:
    doc.recompute()
    if App.GuiUp:
        import FreeCADGui as Gui

        App.setActiveDocument(doc.Name)
        view = Gui.getDocument(doc.Name).ActiveView
        view.setAnimationEnabled(False)
        view.viewIsometric()
        view.fitAll()
        Gui.updateGui()
    doc.save()


def write_part(path: Path, label: str, shape: Any, colour: tuple[float, ...], card: str) -> Any:
    """One part in one file. Returns the object to link to."""
    doc = new_document(path, label)
    part = doc.addObject("Part::Feature", path.stem)
    part.Shape, part.Label = shape, label
    if not shape.isValid() or len(shape.Solids) != 1:
        raise RuntimeError(f"{path.name}: expected one valid solid, got {len(shape.Solids)}")
    set_material(part, card)
    if App.GuiUp:
        part.ViewObject.ShapeColor = colour
        part.ViewObject.DisplayMode = "Flat Lines" if shape.Volume > 1e5 else "Shaded"
    finish(doc)
    return part


def set_material(part: Any, card: str) -> None:
    """FreeCAD's own material card, where this FreeCAD has one of that name."""
    import Materials

    cards = Materials.MaterialManager().Materials.values()
    found = next((material for material in cards if material.Name == card), None)
    if found is not None:
        part.ShapeMaterial = found


def add_link(assembly: Any, target: Any, name: str, *places: Any) -> Any:
    """A plain link for one place, a link array for several."""
    link = assembly.newObject("App::Link", name)
    link.LinkedObject = target
    link.Label = name
    if len(places) == 1:
        link.Placement = places[0]
    else:
        link.ElementCount = len(places)
        for element, place in zip(link.ElementList, places, strict=True):
            element.Placement = place
    return link


def new_assembly(doc: Any, name: str, label: str) -> Any:
    assembly = doc.addObject("Assembly::AssemblyObject", name)
    assembly.Label = label
    assembly.newObject("Assembly::JointGroup", "Joints")
    return assembly


def ground(assembly: Any, link: Any) -> None:
    """Fix the first part, as the Assembly workbench does; a joint is no component."""
    import JointObject

    joints = next(o for o in assembly.Group if o.isDerivedFrom("Assembly::JointGroup"))
    JointObject.GroundedJoint(joints.newObject("App::FeaturePython", "GroundedJoint"), link)


def write_gearbox(out: Path, parts: dict[str, Any]) -> Any:
    doc = new_document(out / "Gearbox.FCStd", "Gearbox Sub-Assy")
    assembly = new_assembly(doc, "Gearbox", "Gearbox Sub-Assy")
    ground(assembly, add_link(assembly, parts["Housing"], "Housing", at()))
    add_link(assembly, parts["Shaft"], "Shaft", at())
    half_tooth = 180 / PLANET_TEETH
    quarters = [math.pi / 2 * k for k in range(4)]
    planets = [at(ORBIT_MM * math.cos(a), ORBIT_MM * math.sin(a), 12, half_tooth) for a in quarters]
    add_link(assembly, parts["Gear"], "Gear", *planets)
    finish(doc)
    return assembly


def write_top(out: Path, parts: dict[str, Any], gearbox: Any) -> None:
    doc = new_document(out / "TopAssembly.FCStd", "Top Assembly")
    assembly = new_assembly(doc, "TopAssembly", "Top Assembly")
    ground(assembly, add_link(assembly, parts["BasePlate"], "BasePlate", at()))
    for number, x in enumerate(GEARBOX_X_MM, 1):
        instance = assembly.newObject("Assembly::AssemblyLink", f"Gearbox{number}")
        instance.LinkedObject = gearbox
        instance.Label = f"Gearbox {number}"
        instance.Placement = at(x, 0, PLATE_TOP_MM)
    cover_base = PLATE_TOP_MM + HOUSING_HEIGHT_MM
    add_link(assembly, parts["Cover"], "Cover", at(0, 0, cover_base))
    for number, (x, y) in enumerate(flange_holes(), 1):
        add_link(assembly, parts["M8x20Bolt"], f"FlangeBolt{number}", at(x, y, PLATE_TOP_MM + 10))
    cover_bolts = [at(x, y, cover_base + COVER_MM) for x in GEARBOX_X_MM for y in (-57, 57)]
    add_link(assembly, parts["M8x20Bolt"], "CoverBolts", *cover_bolts)
    add_link(assembly, parts["MotorMount"], "MotorMount", at(190, 0, PLATE_TOP_MM))
    add_layout(doc, assembly)
    finish(doc)


def add_layout(doc: Any, assembly: Any) -> None:
    """Construction geometry of the layout, and a link to it inside the document: neither is a component."""
    layout = assembly.newObject("Sketcher::SketchObject", "Layout")
    layout.Label = "Shaft axes"
    for x in GEARBOX_X_MM:
        layout.addGeometry(Part.Circle(Vector(x, 0, 0), UP, ORBIT_MM), True)
    reference = add_link(assembly, layout, "LayoutReference", at(0, 0, PLATE_TOP_MM))
    reference.Label = "Layout reference"
    if App.GuiUp:
        layout.ViewObject.Visibility = False
        reference.ViewObject.Visibility = False


def generate(out: Path) -> None:
    (out / "parts").mkdir(parents=True, exist_ok=True)
    shapes = (
        ("BasePlate", "Base Plate", base_plate(), ALUMINIUM, ALUMINIUM_CARD),
        ("Housing", "Housing", housing(), BLUE, ALUMINIUM_CARD),
        ("Gear", "Gear", gear(), BRASS, STEEL_CARD),
        ("Shaft", "Shaft", shaft(), STEEL, STEEL_CARD),
        ("Cover", "Cover", cover(), ALUMINIUM, ALUMINIUM_CARD),
        ("M8x20Bolt", "M8x20 Bolt", bolt(), DARK, STEEL_CARD),
        ("MotorMount", "Motor Mount", motor_mount(), STEEL, STEEL_CARD),
    )
    parts = {
        name: write_part(out / "parts" / f"{name}.FCStd", label, shape, colour, card)
        for name, label, shape, colour, card in shapes
    }
    write_top(out, parts, write_gearbox(out, parts))


def prepare_preferences() -> None:
    """Keep thumbnails, and no backup files beside the new ones; only for this run's profile."""
    document = App.ParamGet("User parameter:BaseApp/Preferences/Document")
    document.SetBool("SaveThumbnail", True)
    document.SetInt("ThumbnailSize", 256)
    document.SetBool("CreateBackupFiles", False)


def main() -> int:
    out = Path(os.environ.get("SILO_EXAMPLE_OUT") or Path(__file__).parent).resolve()
    try:
        prepare_preferences()
        generate(out)
    except Exception:  # noqa: BLE001  (a script that raises would leave FreeCAD's window open)
        traceback.print_exc()
        return 1
    return 0


if App.GuiUp:
    from PySide import QtCore

    # The window must have been drawn once before a view can be pictured; os._exit, for a
    # finished script would leave the window open.
    QtCore.QTimer.singleShot(500, lambda: os._exit(main()))
elif __name__ == "__main__":
    sys.exit(main())
