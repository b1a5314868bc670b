# SPDX-License-Identifier: LGPL-2.1-or-later
"""STEP files with every kind of body beside a cube, as text, and the list of what they were written from."""

from __future__ import annotations

import math
import random
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from OCP.gp import gp_Pnt
from step_writer import StepDocument

MM = {"MM": 1.0, "INCH": 25.4, "M": 1000.0}


@dataclass
class Bodies:
    """One product with a cube at the origin, and whatever is added; lengths are in the file's unit.

    items
        entities of the product's shape; ``volume`` [unit^3] of those that can be measured, ``lost`` how many
        cannot, and must be named in a warning.
    """

    unit: str = "MM"
    side: float = 10.0
    cube: bool = True
    items: list[int] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    volume: float = 0.0
    lost: int = 0
    first: int = 100_000
    shape: str = ""
    brep: int = 0
    faces: list[str] = field(default_factory=list)
    extra: str = ""

    def add(self, line: str) -> int:
        """One entity; returns its number."""
        self.lines.append(f"#{self.first + len(self.lines)} = {line};")
        return self.first + len(self.lines) - 1

    def item(self, line: str, volume: float | None) -> int:
        """One body of the product; ``volume`` None if no reader can measure it."""
        self.items.append(self.add(line))
        self.volume += volume or 0.0
        self.lost += volume is None
        return self.items[-1]

    def point(self, x: float, y: float = 0.0, z: float = 0.0) -> int:
        """A CARTESIAN_POINT."""
        return self.add(f"CARTESIAN_POINT('',({x!r},{y!r},{z!r}))")

    def axes(self, x: float, z: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> int:
        """An AXIS2_PLACEMENT_3D at x."""
        up = self.add(f"DIRECTION('',({z[0]},{z[1]},{z[2]}))")
        side = self.add(f"DIRECTION('',({z[2]},{z[0]},{z[1]}))")
        return self.add(f"AXIS2_PLACEMENT_3D('',#{self.point(x)},#{up},#{side})")

    def axis(self, x: float) -> int:
        """An AXIS1_PLACEMENT at x, along x."""
        along = self.add("DIRECTION('',(1.,0.,0.))")
        return self.add(f"AXIS1_PLACEMENT('',#{self.point(x)},#{along})")

    def operator(self, x: float, scale: float = 1.0) -> int:
        """A CARTESIAN_TRANSFORMATION_OPERATOR_3D that moves to x."""
        return self.add(f"CARTESIAN_TRANSFORMATION_OPERATOR_3D('','','',$,$,#{self.point(x)},{scale!r},$)")

    def area(self, x: float, radius: float) -> int:
        """A round CURVE_BOUNDED_SURFACE across z."""
        axes = self.axes(x)
        plane, circle = self.add(f"PLANE('',#{axes})"), self.add(f"CIRCLE('',#{axes},{radius!r})")
        segment = self.add(f"COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#{circle})")
        curve = self.add(f"OUTER_BOUNDARY_CURVE('',(#{segment}),.F.)")
        return self.add(f"CURVE_BOUNDED_SURFACE('',#{plane},(#{curve}),.F.)")

    def write(self, path: Path) -> Path:
        """Write the file."""
        text = path.read_text("ascii")
        lines = "\n".join([*self.lines, self.extra]) + "\n"
        text = text.replace("ENDSEC;\nEND-ISO", lines + "ENDSEC;\nEND-ISO")
        old = re.search(r"ADVANCED_BREP_SHAPE_REPRESENTATION\('',\((#\d+),#(\d+)\)", text)
        assert old is not None
        items = [old[1], *([f"#{old[2]}"] if self.cube else []), *(f"#{number}" for number in self.items)]
        new = f"ADVANCED_BREP_SHAPE_REPRESENTATION('',({','.join(items)})"
        path.write_text(text.replace(old[0], new), "ascii")
        return path


def begun(path: Path, unit: str = "MM", side: float = 10.0, name: str = "part") -> Bodies:
    """A file with one cube, so many units wide, to add bodies to."""
    document = StepDocument()
    length = side * MM[unit]
    document.part(BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 0), length, length, length).Shape(), name)
    text = document.write(path, unit).read_text("ascii")
    brep = re.search(r"#(\d+) = MANIFOLD_SOLID_BREP\('',#(\d+)\)", text)
    assert brep is not None
    shell = re.search(rf"#{brep[2]} = CLOSED_SHELL\('',\(([^)]*)\)\)", text)
    assert shell is not None
    faces = [face.strip() for face in shell[1].replace("\n", "").split(",")]
    return Bodies(unit, side, volume=side**3, brep=int(brep[1]), faces=faces)


def _tessellated(made: Bodies, x: float) -> None:
    """A tetrahedron of one unit's size, of triangles, in a representation of its own."""
    corners = ((0, 0, 0), (3, 0, 0), (0, 3, 0), (0, 0, 3))
    rows = ",".join(f"({x + a!r},{float(b)!r},{float(c)!r})" for a, b, c in corners)
    points = made.add(f"COORDINATES_LIST('',4,({rows}))")
    triangles = "((1,3,2),(1,2,4),(1,4,3),(2,3,4))"
    face = made.add(f"TRIANGULATED_FACE('',#{points},4,((0.,0.,1.)),$,(1,2,3,4),{triangles})")
    made.item(f"TESSELLATED_SOLID('t',(#{face}),$)", 4.5)


def _boolean(made: Bodies, x: float) -> None:
    block = made.add(f"BLOCK('',#{made.axes(x)},4.,4.,4.)")
    ball = made.add(f"SPHERE('',2.,#{made.point(x)})")
    tree = made.add(f"BOOLEAN_RESULT('',.DIFFERENCE.,#{block},#{ball})")
    made.item(f"CSG_SOLID('c',#{tree})", 64 - math.pi * 4 / 3)


def _union(made: Bodies, x: float) -> None:
    block = made.add(f"BLOCK('',#{made.axes(x)},2.,2.,2.)")
    other = made.add(f"SOLID_REPLICA('',#{made.brep},#{made.operator(x + 30)})")
    tree = made.add(f"BOOLEAN_RESULT('',.UNION.,#{block},#{other})")
    made.item(f"CSG_SOLID('u',#{tree})", 8 + made.side**3)


def _extruded(made: Bodies, x: float) -> None:
    up = made.add("DIRECTION('',(0.,0.,1.))")
    made.item(f"EXTRUDED_AREA_SOLID('e',#{made.area(x, 2.0)},#{up},3.)", 12 * math.pi)


def _holed(made: Bodies, x: float) -> None:
    """The cube again, moved: as a body of five of its faces. They are shared, so only their number is."""
    shell = made.add(f"CLOSED_SHELL('',({','.join(made.faces[1:])}))")
    made.item(f"MANIFOLD_SOLID_BREP('lid off',#{shell})", None)


def _half(made: Bodies, x: float) -> None:
    plane = made.add(f"PLANE('',#{made.axes(x)})")
    half, block = (
        made.add(f"HALF_SPACE_SOLID('',#{plane},.T.)"),
        made.add(f"BLOCK('',#{made.axes(x)},4.,4.,4.)"),
    )
    tree = made.add(f"BOOLEAN_RESULT('',.INTERSECTION.,#{block},#{half})")
    made.item(f"CSG_SOLID('h',#{tree})", None)


KINDS: dict[str, Callable[[Bodies, float], object]] = {
    "BLOCK": lambda m, x: m.item(f"BLOCK('b',#{m.axes(x)},1.,2.,3.)", 6.0),
    "tilted BLOCK": lambda m, x: m.item(f"BLOCK('b',#{m.axes(x, (0.6, 0.0, 0.8))},1.,2.,3.)", 6.0),
    "WEDGE": lambda m, x: m.item(f"RIGHT_ANGULAR_WEDGE('w',#{m.axes(x)},4.,2.,3.,1.)", 15.0),
    "CYLINDER": lambda m, x: m.item(f"RIGHT_CIRCULAR_CYLINDER('c',#{m.axis(x)},3.,2.)", 12 * math.pi),
    "CONE": lambda m, x: m.item(f"RIGHT_CIRCULAR_CONE('c',#{m.axis(x)},3.,0.,{math.pi / 4!r})", 9 * math.pi),
    "SPHERE": lambda m, x: m.item(f"SPHERE('s',3.,#{m.point(x)})", 36 * math.pi),
    "TORUS": lambda m, x: m.item(f"TORUS('t',#{m.axis(x)},3.,1.)", 6 * math.pi**2),
    "ELLIPSOID": lambda m, x: m.item(f"ELLIPSOID('e',#{m.axes(x)},3.,1.,2.)", None),
    "CSG_SOLID": lambda m, x: m.item(f"CSG_SOLID('c',#{m.add(f'SPHERE($,3.,#{m.point(x)})')})", 36 * math.pi),
    "difference": _boolean,
    "union": _union,
    "half space": _half,
    "SOLID_REPLICA": lambda m, x: m.item(f"SOLID_REPLICA('r',#{m.brep},#{m.operator(x)})", m.side**3),
    "scaled SOLID_REPLICA": lambda m, x: m.item(
        f"SOLID_REPLICA('r',#{m.brep},#{m.operator(x, 0.5)})", m.side**3 / 8
    ),
    "EXTRUDED_AREA_SOLID": _extruded,
    "SWEPT_DISK_SOLID": lambda m, x: m.item(f"SWEPT_DISK_SOLID('d',#{m.point(x)},1.,$,0.,1.)", None),
    "TESSELLATED_SOLID": _tessellated,
    "TESSELLATED_SOLID without faces": lambda m, x: m.item("TESSELLATED_SOLID('n',(),$)", None),
    "MANIFOLD_SOLID_BREP with a hole": _holed,
    "MANIFOLD_SOLID_BREP without a shell": lambda m, x: m.item("MANIFOLD_SOLID_BREP('m',$)", None),
    "BREP of two kinds": lambda m, x: m.item(
        "( BREP_WITH_VOIDS(()) FACETED_BREP() GEOMETRIC_REPRESENTATION_ITEM() MANIFOLD_SOLID_BREP($) "
        "REPRESENTATION_ITEM('x') SOLID_MODEL() )",
        None,
    ),
    "BLOCK without height": lambda m, x: m.item(f"BLOCK('b',#{m.axes(x)},1.,2.,0.)", None),
    "TORUS of a negative radius": lambda m, x: m.item(f"TORUS('t',#{m.axis(x)},3.,-1.)", None),
    "SHELLED_SOLID": lambda m, x: m.item(f"SHELLED_SOLID('s',#{m.brep},(),1.)", None),
    "SOLID_WITH_CIRCULAR_POCKET": lambda m, x: m.item(f"SOLID_WITH_CIRCULAR_POCKET('s',$,#{m.brep})", None),
    "BLOCK_VOLUME": lambda m, x: m.item(f"BLOCK_VOLUME('v',#{m.axes(x)},1.,2.,3.)", None),
    "HALF_SPACE_SOLID": lambda m, x: m.item(f"HALF_SPACE_SOLID('h',#{m.brep},.T.)", None),
}
"""Each adds one body of some 5 units around x."""


def some(path: Path, dice: random.Random, unit: str) -> Bodies:
    """A file with up to four bodies of random kinds beside its cube, or without it."""
    made = begun(path, unit, dice.choice([2.0, 10.0]))
    for number, kind in enumerate(dice.sample(sorted(KINDS), dice.randrange(5))):
        KINDS[kind](made, 100.0 * (number + 1))
    if made.items and dice.random() < 0.2:
        made.cube = False
        made.volume -= made.side**3
    made.write(path)
    return made
