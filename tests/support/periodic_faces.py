# SPDX-License-Identifier: LGPL-2.1-or-later
"""STEP files of solids with one periodic face each, as text, and their volumes in closed form.

The faces have no seam edges, as CATIA, Pro/E and NX write them. No geometry kernel is used, so that the files
say what a file says, and not what the kernel would have made of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

X, Y, Z = np.eye(3)


@dataclass
class Writer:
    """One STEP file with one solid; lengths in mm."""

    lines: list[str] = field(default_factory=list)
    faces: list[int] = field(default_factory=list)

    def add(self, line: str) -> int:
        """One entity; returns its number."""
        self.lines.append(f"#{len(self.lines) + 1}={line};")
        return len(self.lines)

    def point(self, at: ArrayLike) -> int:
        """A CARTESIAN_POINT."""
        return self.add(f"CARTESIAN_POINT('',{_list(at)})")

    def vertex(self, at: ArrayLike) -> int:
        """A VERTEX_POINT."""
        return self.add(f"VERTEX_POINT('',#{self.point(at)})")

    def axes(self, at: ArrayLike, z: ArrayLike, x: ArrayLike) -> int:
        """An AXIS2_PLACEMENT_3D."""
        one = self.point(at)
        two = self.add(f"DIRECTION('',{_list(z)})")
        three = self.add(f"DIRECTION('',{_list(x)})")
        return self.add(f"AXIS2_PLACEMENT_3D('',#{one},#{two},#{three})")

    def circle(self, at: ArrayLike, z: ArrayLike, x: ArrayLike, radius: float) -> int:
        """A CIRCLE."""
        return self.add(f"CIRCLE('',#{self.axes(at, z, x)},{radius!r})")

    def line(self, at: Floats, to: Floats) -> int:
        """A LINE."""
        length = float(np.linalg.norm(to - at))
        direction = self.add(f"DIRECTION('',{_list((to - at) / length)})")
        vector = self.add(f"VECTOR('',#{direction},1.)")
        return self.add(f"LINE('',#{self.point(at)},#{vector})")

    def edge(self, curve: int, start: int, end: int) -> int:
        """An EDGE_CURVE along its curve."""
        return self.add(f"EDGE_CURVE('',#{start},#{end},#{curve},.T.)")

    def bound(self, *edges: tuple[int, bool], outer: bool = True) -> int:
        """A bound of edges, each forward or not."""
        oriented = [self.add(f"ORIENTED_EDGE('',*,*,#{e},.{'T' if f else 'F'}.)") for e, f in edges]
        loop = self.add(f"EDGE_LOOP('',({_refs(oriented)}))")
        return self.add(f"{'FACE_OUTER_BOUND' if outer else 'FACE_BOUND'}('',#{loop},.T.)")

    def face(self, surface: int, bounds: Sequence[int], same_sense: bool = True) -> int:
        """A face of the solid."""
        sense = "T" if same_sense else "F"
        self.faces.append(self.add(f"ADVANCED_FACE('',({_refs(bounds)}),#{surface},.{sense}.)"))
        return self.faces[-1]

    def plane(self, at: ArrayLike, z: ArrayLike, x: ArrayLike) -> int:
        """A PLANE."""
        return self.add(f"PLANE('',#{self.axes(at, z, x)})")

    def write(self, path: Path) -> Path:
        """Write the file, with a product around the solid."""
        Writer([*self.lines], self.faces)._finish(path)
        return path

    def _finish(self, path: Path) -> None:
        shell = self.add(f"CLOSED_SHELL('',({_refs(self.faces)}))")
        solid = self.add(f"MANIFOLD_SOLID_BREP('',#{shell})")
        place = self.axes((0, 0, 0), Z, X)
        length = self.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))")
        angle = self.add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")
        solid_angle = self.add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())")
        doubt = self.add(
            f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-5),#{length},'distance_accuracy_value','')"
        )
        context = self.add(
            "(GEOMETRIC_REPRESENTATION_CONTEXT(3)"
            f"GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#{doubt}))"
            f"GLOBAL_UNIT_ASSIGNED_CONTEXT((#{length},#{angle},#{solid_angle}))"
            "REPRESENTATION_CONTEXT('',''))"
        )
        shape = self.add(f"ADVANCED_BREP_SHAPE_REPRESENTATION('',(#{solid},#{place}),#{context})")
        application = self.add("APPLICATION_CONTEXT('automotive design')")
        about = self.add(f"PRODUCT_CONTEXT('',#{application},'mechanical')")
        product = self.add(f"PRODUCT('{path.stem}','{path.stem}','',(#{about}))")
        formation = self.add(f"PRODUCT_DEFINITION_FORMATION('','',#{product})")
        design = self.add(f"PRODUCT_DEFINITION_CONTEXT('part definition',#{application},'design')")
        definition = self.add(f"PRODUCT_DEFINITION('','',#{formation},#{design})")
        definition_shape = self.add(f"PRODUCT_DEFINITION_SHAPE('','',#{definition})")
        self.add(f"SHAPE_DEFINITION_REPRESENTATION(#{definition_shape},#{shape})")
        head = (
            "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\n"
            f"FILE_NAME('{path.stem}','2020-01-01T00:00:00',(''),(''),'','','');\n"
            "FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));\nENDSEC;\nDATA;\n"
        )
        path.write_text(head + "\n".join(self.lines) + "\nENDSEC;\nEND-ISO-10303-21;\n", "ascii")


def _list(values: ArrayLike) -> str:
    return "(" + ",".join(repr(float(v) + 0.0) for v in np.asarray(values, float)) + ")"


def _refs(numbers: Sequence[int]) -> str:
    return ",".join(f"#{n}" for n in numbers)


def turned(vector: Floats, axis: Floats, angle: float) -> Floats:
    """A vector turned around a unit axis (Rodrigues)."""
    cross, along = np.cross(axis, vector), axis * float(axis @ vector)
    turned_vector: Floats = vector * math.cos(angle) + cross * math.sin(angle) + along * (1 - math.cos(angle))
    return turned_vector


def spline_circle(
    w: Writer, at: Floats, x: Floats, y: Floats, radius: float, start: float, end: float
) -> int:
    """An arc as one cubic spline through many points: what CATIA writes for a section of two surfaces."""
    pieces = max(int((end - start) / 0.2), 2)
    t = np.linspace(start, end, pieces + 1)
    half = (t[1] - t[0]) / 3  # Hermite's tangents; an arc of 0.2 rad is off by 1e-8 of its radius
    points = at + radius * (np.cos(t)[:, None] * x + np.sin(t)[:, None] * y)
    slopes = radius * (-np.sin(t)[:, None] * x + np.cos(t)[:, None] * y)
    poles = [points[0]]
    for i in range(pieces):
        poles += [points[i] + half * slopes[i], points[i + 1] - half * slopes[i + 1], points[i + 1]]
    refs = _refs([w.point(pole) for pole in poles])
    inner = ",".join(["3"] * (pieces - 1))
    counts = f"4,{inner},4" if inner else "4,4"
    knots = ",".join(repr(float(v)) for v in t)
    return w.add(
        f"B_SPLINE_CURVE_WITH_KNOTS('',3,({refs}),.UNSPECIFIED.,.F.,.F.,({counts}),({knots}),.UNSPECIFIED.)"
    )


@dataclass(frozen=True)
class Case:
    """A file and its volume [mm^3]."""

    name: str
    writer: Writer
    volume: float


BALL = 30.0
CUTS = (0.0, 12.0, -18.0)


def balls() -> Iterator[Case]:
    """A ball cut by a plane: the sphere's axis along the cut's normal, in its plane, through its rim."""
    for height in CUTS:
        rim = math.asin(math.sqrt(1 - (height / BALL) ** 2))  # angle between the cut's normal and its rim
        poles = {
            "axis": Z,
            "down": -Z,
            "flat": X,
            "flat-turned": turned(X, Z, 0.7),
            "rim": turned(Z, Y, rim),
            "near-rim": turned(Z, Y, rim + 0.02),
            "tilted": turned(Z, Y, 0.5),
            "tilted-far": turned(Z, turned(Y, Z, 2.2), 2.4),
        }
        for how, pole in poles.items():
            for edges in ("circle", "arcs", "splines"):
                for seam in (0.0, 1.3):
                    if edges == "arcs" and seam:
                        continue
                    name = f"ball-{height:g}-{how}-{edges}-{seam:g}"
                    yield Case(name, _ball(height, pole, edges, seam), _cap(height))


def _cap(height: float) -> float:
    depth = BALL + height  # of the part below the cut
    return math.pi * depth**2 * (3 * BALL - depth) / 3


def _ball(height: float, pole: Floats, edges: str, seam: float) -> Writer:
    w = Writer()
    radius = math.sqrt(BALL**2 - height**2)
    across = np.cross(pole, Z if abs(pole @ Z) < 0.9 else X)
    across = turned(across / np.linalg.norm(across), pole, seam)
    sphere = w.add(f"SPHERICAL_SURFACE('',#{w.axes((0, 0, 0), pole, across)},{BALL!r})")
    at = height * Z
    rim = _ring(w, at, Z, X, radius, edges)
    # The ball below the cut: its outside is to the left of the rim if the rim is passed backwards.
    w.face(sphere, [w.bound(*[(e, False) for e in reversed(rim)])])
    w.face(w.plane(at, Z, X), [w.bound(*[(e, True) for e in rim])])
    return w


def _ring(w: Writer, at: Floats, z: Floats, x: Floats, radius: float, edges: str = "circle") -> list[int]:
    """A closed ring counter-clockwise around ``z``, of one edge, two arcs or two splines."""
    y = np.cross(z, x)
    if edges == "circle":
        start = w.vertex(at + radius * x)
        return [w.edge(w.circle(at, z, x, radius), start, start)]
    one, two = w.vertex(at + radius * x), w.vertex(at - radius * x)
    if edges == "arcs":
        circle = w.circle(at, z, x, radius)
        return [w.edge(circle, one, two), w.edge(circle, two, one)]
    first = spline_circle(w, at, x, y, radius, 0.0, math.pi)
    second = spline_circle(w, at, x, y, radius, math.pi, 2 * math.pi)
    return [w.edge(first, one, two), w.edge(second, two, one)]


RING, TUBE = 40.0, 10.0


def tori() -> Iterator[Case]:
    """A torus: sectors by two planes through its axis, slices by a plane across it."""
    for start, angle in (
        (0.0, math.pi), (0.0, 1.0), (-0.5, 1.0), (-0.01, 1.0), (2.0, 5.0), (1.0, 3.5), (-3.0, 6.2)
    ):  # fmt: skip
        for vertex in (0.0, 1.0, 3.1):
            name = f"torus-{start:g}-{angle:.2g}-{vertex:g}"
            yield Case(name, _sector(start, angle, vertex), math.pi * TUBE**2 * RING * angle)
    for height in (0.0, 4.0, -6.0):
        for flip in (1, -1):
            depth = height / TUBE
            part = math.acos(-depth) + depth * math.sqrt(1 - depth**2)  # of the tube below the cut
            volume = 2 * math.pi * RING * TUBE**2 * part
            yield Case(f"bowl-{height:g}-{flip}", _bowl(height, flip), volume)


def _tube(angle: float) -> tuple[Floats, Floats, Floats]:
    out = math.cos(angle) * X + math.sin(angle) * Y
    return RING * out, out, np.cross(Z, out)


def _sector(
    start: float, angle: float, vertex: float, torus: Callable[[Writer], int] | None = None
) -> Writer:
    w = Writer()
    surface = (torus or _plain_torus)(w)
    rings = []
    for u in (start, start + angle):
        at, out, along = _tube(u)
        x = turned(out, along, vertex)
        (ring,) = _ring(w, at, along, x, TUBE)
        rings.append((ring, at, along, out))
    # Counter-clockwise around the way along the tube, the tube ahead is on the left as seen from outside.
    (low, at0, along0, out0), (high, at1, along1, out1) = rings
    w.face(surface, [w.bound((low, True)), w.bound((high, False), outer=False)])
    w.face(w.plane(at0, -along0, out0), [w.bound((low, False))])
    w.face(w.plane(at1, along1, out1), [w.bound((high, True))])
    return w


def _bowl(height: float, flip: int) -> Writer:
    w = Writer()
    surface = w.add(f"TOROIDAL_SURFACE('',#{w.axes((0, 0, 0), flip * Z, X)},{RING!r},{TUBE!r})")
    wide = math.sqrt(TUBE**2 - height**2)
    at = height * Z
    (outer,) = _ring(w, at, Z, X, RING + wide)
    (inner,) = _ring(w, at, Z, X, RING - wide)
    w.face(surface, [w.bound((outer, False)), w.bound((inner, True), outer=False)])
    w.face(w.plane(at, Z, X), [w.bound((outer, True)), w.bound((inner, False), outer=False)])
    return w


def bites() -> Iterator[Case]:
    """A torus cut by a plane beside its axis: the cap, and what is left, with the seams in the cap or not."""
    for at in (46.0, 43.0):
        for seam in (0.0, 0.15, 1.5, 3.1):
            for cap in (True, False):
                rho = np.linspace(at, RING + TUBE, 200_001)
                slice_ = 4 * np.arccos(at / rho) * rho * np.sqrt(np.maximum(TUBE**2 - (rho - RING) ** 2, 0))
                part = float(((slice_[1:] + slice_[:-1]) / 2 * np.diff(rho)).sum())
                volume = part if cap else 2 * math.pi**2 * RING * TUBE**2 - part
                yield Case(f"bite-{at:g}-{seam:g}-{'cap' if cap else 'rest'}", _bite(at, seam, cap), volume)


def _bite(at: float, seam: float, cap: bool) -> Writer:
    w = Writer()
    place = w.axes((0, 0, 0), Z, turned(X, Z, seam))
    surface = w.add(f"TOROIDAL_SURFACE('',#{place},{RING!r},{TUBE!r})")
    most = math.acos((at - RING) / TUBE)

    def point(theta: float) -> Floats:
        v = most * math.sin(theta)
        width = (RING + TUBE * math.cos(v)) ** 2 - at**2
        return np.array([at, math.copysign(math.sqrt(max(width, 0.0)), math.cos(theta)), TUBE * math.sin(v)])

    pieces, step = 120, 1e-5
    thetas = np.linspace(0.2, 0.2 + 2 * math.pi, pieces + 1)
    points = [point(theta) for theta in thetas]
    slopes = [(point(theta + step) - point(theta - step)) / (2 * step) for theta in thetas]
    third = (thetas[1] - thetas[0]) / 3
    poles = [points[0]]
    for i in range(pieces):
        poles += [points[i] + third * slopes[i], points[i + 1] - third * slopes[i + 1], points[i + 1]]
    counts = ",".join(["4", *["3"] * (pieces - 1), "4"])
    knots = ",".join(repr(float(v)) for v in thetas)
    refs = _refs([w.point(pole) for pole in poles])
    curve = w.add(
        f"B_SPLINE_CURVE_WITH_KNOTS('',3,({refs}),.UNSPECIFIED.,.T.,.F.,({counts}),({knots}),.UNSPECIFIED.)"
    )
    start = w.vertex(points[0])
    edge = w.edge(curve, start, start)
    # The curve is counter-clockwise as seen from +x, where the cap is.
    w.face(surface, [w.bound((edge, cap))])
    w.face(w.plane((at, 0, 0), -X if cap else X, Y), [w.bound((edge, not cap))])
    return w


def belts() -> Iterator[Case]:
    """A ball between two planes: with equal rims, belt and caps have the same vector area."""
    for low, high in ((-12.0, 12.0), (-20.0, 5.0), (3.0, 21.0)):
        poles = {
            "axis": Z,
            "flat": X,
            "tilted": turned(Z, Y, 0.5),
            "rim": turned(Z, Y, math.acos(high / BALL)),
            "below-rim": turned(Z, Y, math.acos(high / BALL) + 0.1),
        }
        for how, pole in poles.items():
            for edges in ("circle", "arcs"):
                volume = _cap(high) - _cap(low)
                yield Case(f"belt-{low:g}-{high:g}-{how}-{edges}", _belt(low, high, pole, edges), volume)


def _belt(low: float, high: float, pole: Floats, edges: str) -> Writer:
    w = Writer()
    across = np.cross(pole, Z if abs(pole @ Z) < 0.9 else X)
    sphere = w.add(
        f"SPHERICAL_SURFACE('',#{w.axes((0, 0, 0), pole, across / np.linalg.norm(across))},{BALL!r})"
    )
    bottom, top = (_ring(w, h * Z, Z, X, math.sqrt(BALL**2 - h**2), edges) for h in (low, high))
    w.face(
        sphere,
        [w.bound(*[(e, True) for e in bottom]), w.bound(*[(e, False) for e in reversed(top)], outer=False)],
    )
    w.face(w.plane(low * Z, -Z, X), [w.bound(*[(e, False) for e in reversed(bottom)])])
    w.face(w.plane(high * Z, Z, X), [w.bound(*[(e, True) for e in top])])
    return w


def tyres() -> Iterator[Case]:
    """A torus cut by a cylinder around its axis: the outer part, with a wall inside, and the inner part."""
    for wall in (RING, 37.0, 44.0):
        height = math.sqrt(TUBE**2 - (wall - RING) ** 2)
        for outer in (True, False):
            for flip in (1, -1):
                for vertex in (0.0, 1.0):
                    rho = (
                        np.linspace(wall, RING + TUBE, 400_001)
                        if outer
                        else np.linspace(RING - TUBE, wall, 400_001)
                    )
                    high = np.sqrt(np.maximum(TUBE**2 - (rho - RING) ** 2, 0))
                    slices = 4 * math.pi * rho * high
                    volume = float(((slices[1:] + slices[:-1]) / 2 * np.diff(rho)).sum())
                    name = f"{'tyre' if outer else 'hub'}-{wall:g}-{flip}-{vertex:g}"
                    yield Case(name, _tyre(wall, height, outer, flip, vertex), volume)


def _tyre(wall: float, height: float, outer: bool, flip: int, vertex: float) -> Writer:
    w = Writer()
    surface = w.add(f"TOROIDAL_SURFACE('',#{w.axes((0, 0, 0), flip * Z, X)},{RING!r},{TUBE!r})")
    cylinder = w.add(f"CYLINDRICAL_SURFACE('',#{w.axes((0, 0, 0), Z, X)},{wall!r})")
    x = turned(X, Z, vertex)
    (low,) = _ring(w, -height * Z, Z, x, wall)
    (high,) = _ring(w, height * Z, Z, x, wall)
    # Around the axis, the outer part is to the left of the lower ring, as of the whole pipe.
    w.face(surface, [w.bound((low, outer)), w.bound((high, not outer), outer=False)])
    w.face(cylinder, [w.bound((low, not outer)), w.bound((high, outer), outer=False)], not outer)
    return w


PIPE, HIGH = 10.0, 30.0


def pipes() -> Iterator[Case]:
    """Cylinders, cones and turned curves: whole with two rings, and sectors beside or over a seam."""
    for kind in ("cylinder", "cone", "turned"):
        for flip in (1, -1):
            for vertex in (0.0, 1.0):
                yield Case(f"{kind}-whole-{flip}-{vertex:g}", *_pipe(kind, flip, vertex))
        for start, angle in ((0.0, 2.0), (-0.5, 1.0), (1.0, 4.5), (-3.0, 6.0)):
            yield Case(f"{kind}-sector-{start:g}-{angle:g}", *_wedge(kind, start, angle))


def _profile(kind: str) -> tuple[float, float, float]:
    """Radius at the bottom, at the top, and the volume of a full turn."""
    low, high = PIPE, PIPE if kind == "cylinder" else 4.0
    return low, high, math.pi * HIGH * (low**2 + low * high + high**2) / 3


def _lateral(w: Writer, kind: str, flip: int) -> int:
    low, high, _ = _profile(kind)
    if kind == "turned":
        line = w.line(np.array([low, 0, 0]), np.array([high, 0, HIGH]))
        one, two = w.point((0, 0, 0)), w.add(f"DIRECTION('',{_list(flip * Z)})")
        axis = w.add(f"AXIS1_PLACEMENT('',#{one},#{two})")
        return w.add(f"SURFACE_OF_REVOLUTION('',#{line},#{axis})")
    if kind == "cylinder":
        return w.add(f"CYLINDRICAL_SURFACE('',#{w.axes((0, 0, 0), flip * Z, X)},{low!r})")
    if flip > 0:  # a cone widens along its axis
        place, radius = w.axes((0, 0, HIGH), -Z, X), high
    else:
        place, radius = w.axes((0, 0, HIGH), -Z, -Y), high
    return w.add(f"CONICAL_SURFACE('',#{place},{radius!r},{math.atan((low - high) / HIGH)!r})")


def _outward(kind: str, flip: int) -> bool:
    """Whether the surface's own normal looks outside: of a turned curve, axis and curve decide."""
    return kind != "turned" or flip > 0


def _pipe(kind: str, flip: int, vertex: float) -> tuple[Writer, float]:
    w = Writer()
    low, high, volume = _profile(kind)
    surface = _lateral(w, kind, flip)
    x = turned(X, Z, vertex)
    (bottom,) = _ring(w, 0 * Z, Z, x, low)
    (top,) = _ring(w, HIGH * Z, Z, x, high)
    w.face(surface, [w.bound((bottom, True)), w.bound((top, False), outer=False)], _outward(kind, flip))
    w.face(w.plane((0, 0, 0), -Z, X), [w.bound((bottom, False))])
    w.face(w.plane((0, 0, HIGH), Z, X), [w.bound((top, True))])
    return w, volume


def _wedge(kind: str, start: float, angle: float) -> tuple[Writer, float]:
    w = Writer()
    low, high, volume = _profile(kind)
    surface = _lateral(w, kind, 1)
    out0, out1 = turned(X, Z, start), turned(X, Z, start + angle)
    corners = {
        (side, level): (w.vertex(p), p)
        for side, out in ((0, out0), (1, out1))
        for level, p in ((0, low * out), (1, high * out + HIGH * Z))
    }
    axis = [(w.vertex(p), p) for p in (0 * Z, HIGH * Z)]

    def straight(one: tuple[int, Floats], two: tuple[int, Floats]) -> int:
        return w.edge(w.line(one[1], two[1]), one[0], two[0])

    arcs = [
        w.edge(w.circle(level * HIGH * Z, Z, X, radius), corners[0, level][0], corners[1, level][0])
        for level, radius in ((0, low), (1, high))
    ]
    sides = [straight(corners[side, 0], corners[side, 1]) for side in (0, 1)]
    spokes = {
        (side, level): straight(axis[level], corners[side, level]) for side in (0, 1) for level in (0, 1)
    }
    middle = straight(axis[0], axis[1])
    w.face(surface, [w.bound((arcs[0], True), (sides[1], True), (arcs[1], False), (sides[0], False))])
    w.face(
        w.plane((0, 0, 0), -Z, X), [w.bound((spokes[1, 0], True), (arcs[0], False), (spokes[0, 0], False))]
    )
    w.face(
        w.plane((0, 0, HIGH), Z, X), [w.bound((spokes[0, 1], True), (arcs[1], True), (spokes[1, 1], False))]
    )
    for side, out, normal in ((0, out0, np.cross(out0, Z)), (1, out1, np.cross(Z, out1))):
        loop = [(spokes[side, 0], True), (sides[side], True), (spokes[side, 1], False), (middle, False)]
        if side:
            loop = [(e, not f) for e, f in reversed(loop)]
        w.face(w.plane((0, 0, 0), normal, out), [w.bound(*loop)])
    return w, volume * angle / (2 * math.pi)


def wound() -> Iterator[Case]:
    """A torus as a closed rational B-spline surface: sectors beside and over its seam."""
    for start, angle in ((0.0, math.pi), (0.3, 1.0), (-0.5, 1.0), (2.0, 5.0), (-3.0, 6.2)):
        for vertex in (0.0, 1.0):
            volume = math.pi * TUBE**2 * RING * angle
            yield Case(
                f"wound-{start:g}-{angle:.2g}-{vertex:g}",
                _sector(start, angle, vertex, _spline_torus),
                volume,
            )


_SQUARE = ((1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0))
_WEIGHTS = [1.0, math.sqrt(0.5)] * 4 + [1.0]


def _spline_torus(w: Writer) -> int:
    rows, weights = [], []
    for (cu, su), wu in zip(_SQUARE, _WEIGHTS, strict=True):
        row = []
        for cv, sv in _SQUARE:
            out = RING + TUBE * cv
            row.append(w.point((out * cu, out * su, TUBE * sv)))
        rows.append(f"({_refs(row)})")
        weights.append("(" + ",".join(repr(wu * wv) for wv in _WEIGHTS) + ")")
    knots = "(3,2,2,2,3),(3,2,2,2,3),(0.,1.,2.,3.,4.),(0.,1.,2.,3.,4.),.UNSPECIFIED."
    return w.add(
        f"(BOUNDED_SURFACE()B_SPLINE_SURFACE(2,2,({','.join(rows)}),.UNSPECIFIED.,.T.,.T.,.F.)"
        f"B_SPLINE_SURFACE_WITH_KNOTS({knots})GEOMETRIC_REPRESENTATION_ITEM()"
        f"RATIONAL_B_SPLINE_SURFACE(({','.join(weights)}))REPRESENTATION_ITEM('')SURFACE())"
    )


def _plain_torus(w: Writer) -> int:
    return w.add(f"TOROIDAL_SURFACE('',#{w.axes((0, 0, 0), Z, X)},{RING!r},{TUBE!r})")


def cases() -> Iterator[Case]:
    """All of them."""
    yield from balls()
    yield from tori()
    yield from bites()
    yield from pipes()
    yield from belts()
    yield from tyres()
    yield from wound()
