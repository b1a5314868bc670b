# SPDX-License-Identifier: LGPL-2.1-or-later
"""Writes ``arm.step``: a small robot arm with named products, placed instances, one bought servo in 3 joints.

    python examples/arm/make_arm.py [OUT.step]

Lengths are in mm, as in the file. The arm stands at joint position zero: upright, so that the link frames of
``arm.urdf`` are translations of the assembly's frame. Needs the extra ``inertia`` (the OCP kernel).
"""

from __future__ import annotations

import math
import re
import sys
from pathlib import Path

from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
from OCP.gp import gp_Ax1, gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
from OCP.Message import Message
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_StepModelType
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Shape
from OCP.XCAFDoc import XCAFDoc_DocumentTool

Vector = tuple[float, float, float]

SHOULDER, ELBOW, WRIST = 120.0, 420.0, 690.0
"""Heights of the joints [mm]; ``arm.urdf`` has the same in m."""


def box(size: Vector, at: Vector) -> TopoDS_Shape:
    """A box with one corner at ``at``."""
    return BRepPrimAPI_MakeBox(gp_Pnt(*at), *size).Shape()


def cylinder(radius: float, height: float, at: Vector, along: Vector = (0, 0, 1)) -> TopoDS_Shape:
    """A cylinder whose axis begins at ``at``."""
    return BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(*at), gp_Dir(*along)), radius, height).Shape()


def cut(shape: TopoDS_Shape, *tools: TopoDS_Shape) -> TopoDS_Shape:
    """``shape`` without ``tools``."""
    for tool in tools:
        shape = BRepAlgoAPI_Cut(shape, tool).Shape()
    return shape


def fuse(shape: TopoDS_Shape, *others: TopoDS_Shape) -> TopoDS_Shape:
    """All as one solid."""
    for other in others:
        shape = BRepAlgoAPI_Fuse(shape, other).Shape()
    return shape


def parts() -> dict[str, TopoDS_Shape]:
    """The products, each in its own axes."""
    corners = [(x, y) for x in (-65.0, 65.0) for y in (-65.0, 65.0)]
    side = fuse(box((4, 50, 300), (-2, -25, 0)), *(cylinder(25, 4, (-2, 0, z), (1, 0, 0)) for z in (0, 300)))
    return {
        "Base plate": cut(
            box((160, 160, 10), (-80, -80, 0)), *(cylinder(3.3, 10, (x, y, 0)) for x, y in corners)
        ),
        "Column": cut(cylinder(45, 80, (0, 0, 0)), cylinder(35, 80, (0, 0, 0))),
        "Servo case": box((34, 46, 50), (-17, -23, -25)),
        "Servo horn": cylinder(11, 6, (0, 0, 0), (1, 0, 0)),
        "Side plate": cut(side, *(cylinder(11, 4, (-2, 0, z), (1, 0, 0)) for z in (0, 300))),
        "Spacer": cut(cylinder(6, 46, (-23, 0, 0), (1, 0, 0)), cylinder(2.1, 46, (-23, 0, 0), (1, 0, 0))),
        "Hex bolt M4x16": fuse(cylinder(2, 16, (0, 0, 0)), cylinder(3.5, 2.8, (0, 0, -2.8))),
        "Tube": cut(cylinder(20, 250, (0, 0, 0)), cylinder(18, 250, (0, 0, 0))),
        "Clamp": cut(box((60, 60, 30), (-30, -30, 0)), cylinder(20, 30, (0, 0, 0))),
        "Cable duct": cut(box((14, 12, 200), (-7, -6, 0)), box((10, 8, 200), (-5, -4, 0))),
        "Driver board": box((60, 40, 4), (-30, -20, 0)),
        "Camera": fuse(box((30, 24, 24), (-15, -12, -12)), cylinder(9, 12, (15, 0, 0), (1, 0, 0))),
        "Palm": box((50, 90, 20), (-25, -45, 0)),
        "Finger": cut(box((20, 12, 70), (-10, 0, 0)), box((20, 6, 20), (-10, 6, 50))),
    }


def placed(at: Vector, turn: tuple[Vector, float] | None = None) -> TopLoc_Location:
    """A placement: turned about an axis through the origin by so many degrees, then moved."""
    move, rotate = gp_Trsf(), gp_Trsf()
    move.SetTranslation(gp_Vec(*at))
    if turn is not None:
        axis, degrees = turn
        rotate.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(*axis)), math.radians(degrees))
    return TopLoc_Location(move.Multiplied(rotate))


class Writer:
    """An XCAF document: products, and sub-assemblies of placed components."""

    def __init__(self) -> None:
        self.document = TDocStd_Document(TCollection_ExtendedString("BinXCAF"))
        self.shapes = XCAFDoc_DocumentTool.ShapeTool_s(self.document.Main())

    def name(self, label: TDF_Label, text: str) -> TDF_Label:
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(text))
        return label

    def product(self, name: str, shape: TopoDS_Shape) -> TDF_Label:
        return self.name(self.shapes.AddShape(shape, False), name)

    def assembly(self, name: str, *components: tuple[str, TDF_Label, TopLoc_Location]) -> TDF_Label:
        label = self.name(self.shapes.NewShape(), name)
        for instance, product, location in components:
            self.name(self.shapes.AddComponent(label, product, location), instance)
        return label

    def write(self, path: Path) -> None:
        self.shapes.UpdateAssemblies()
        writer = STEPCAFControl_Writer()
        writer.SetNameMode(True)
        # The kernel reports each step in colours; a generator has nothing to say but errors.
        Message.DefaultMessenger_s().ChangePrinters().Clear()
        writer.Transfer(self.document, STEPControl_StepModelType.STEPControl_AsIs)
        writer.Write(str(path))
        # The same arm gives the same file: no date of today, no name of this machine.
        text = path.read_text("utf-8")
        header = "FILE_NAME('arm.step','2026-01-29T00:00:00',(''),(''),'silo-mod example','make_arm.py','');"
        path.write_text(re.sub(r"FILE_NAME\(.*?\);", header, text, count=1, flags=re.DOTALL), "utf-8")


def build(out: Path) -> None:
    """The arm: base, upper arm, forearm, gripper."""
    w = Writer()
    p = {name: w.product(name, shape) for name, shape in parts().items()}
    servo = w.assembly(
        "Servo",
        ("case", p["Servo case"], placed((0, 0, 0))),
        ("horn left", p["Servo horn"], placed((17, 0, 0))),
        ("horn right", p["Servo horn"], placed((-17, 0, 0), ((0, 0, 1), 180))),
    )
    bolt, spacer = p["Hex bolt M4x16"], p["Spacer"]
    base = w.assembly(
        "Base",
        ("plate", p["Base plate"], placed((0, 0, 0))),
        ("column", p["Column"], placed((0, 0, 10))),
        ("servo", servo, placed((0, 0, SHOULDER))),
        ("driver board", p["Driver board"], placed((0, 62, 40), ((1, 0, 0), 90))),
        *(
            (f"bolt {n}", bolt, placed((40 * math.cos(a), 40 * math.sin(a), 92.8 - 16), ((1, 0, 0), 180)))
            for n, a in enumerate((0.0, math.pi / 2, math.pi, 3 * math.pi / 2), start=1)
        ),
    )
    length = ELBOW - SHOULDER
    upper = w.assembly(
        "Upper arm",
        ("side left", p["Side plate"], placed((25, 0, 0))),
        ("side right", p["Side plate"], placed((-25, 0, 0))),
        ("spacer 1", spacer, placed((0, 0, 80))),
        ("spacer 2", spacer, placed((0, 0, 150))),
        ("spacer 3", spacer, placed((0, 0, 220))),
        *(
            (f"bolt {2 * n + k}", bolt, placed((x, 0, z), ((0, 1, 0), angle)))
            for n, z in enumerate((80.0, 150.0, 220.0))
            for k, x, angle in ((1, 27.0, -90.0), (2, -27.0, 90.0))
        ),
        ("cable duct", p["Cable duct"], placed((0, -32, 50))),
        ("servo", servo, placed((0, 0, length))),
    )
    forearm = w.assembly(
        "Forearm",
        ("clamp 1", p["Clamp"], placed((0, 0, 30))),
        ("tube", p["Tube"], placed((0, 0, 20))),
        ("clamp 2", p["Clamp"], placed((0, 0, 220))),
        ("servo", servo, placed((0, 0, WRIST - ELBOW + 25))),
    )
    gripper = w.assembly(
        "Gripper",
        ("palm", p["Palm"], placed((0, 0, 50))),
        ("camera", p["Camera"], placed((42, 0, 62), ((0, 1, 0), 35))),
        ("finger left", p["Finger"], placed((0, 25, 70))),
        ("finger right", p["Finger"], placed((0, -25, 70), ((0, 0, 1), 180))),
    )
    w.assembly(
        "Arm",
        ("base_link", base, placed((0, 0, 0))),
        ("upper_arm", upper, placed((0, 0, SHOULDER))),
        ("forearm", forearm, placed((0, 0, ELBOW))),
        ("gripper", gripper, placed((0, 0, WRIST))),
    )
    w.write(out)


if __name__ == "__main__":
    build(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_name("arm.step"))
