# SPDX-License-Identifier: LGPL-2.1-or-later
"""Bodies with a closed form, to 1e-9 in volume, centre and tensor (inertia-facts §9, 1, 2, 7, 15, 16, 18)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from OCP.BRep import BRep_Builder
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_GTransform,
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakeWire,
    BRepBuilderAPI_Transform,
)
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakePrism,
    BRepPrimAPI_MakeSphere,
    BRepPrimAPI_MakeTorus,
)
from OCP.BRepTools import BRepTools
from OCP.GeomAPI import GeomAPI_Interpolate
from OCP.gp import gp_Ax1, gp_Dir, gp_GTrsf, gp_Pnt, gp_Trsf, gp_Vec
from OCP.TopAbs import TopAbs_INTERNAL
from OCP.TopoDS import TopoDS_Compound

from silo.inertia.assembly import Assembly, Prototype
from silo.inertia.geometry import kernel as occt
from silo.inertia.geometry.kernel.solids import moments as moments_of
from silo.inertia.notes import GeometryCode
from silo.inertia.placements import place
from silo.inertia.rigid import MassProps, combine, combine_arrays

EXACT = 1e-9
MM = 1e-3
ROTATION = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])


def only(assembly: Assembly) -> Prototype:
    """The assembly's only prototype."""
    (prototype,) = assembly.prototypes.values()
    return prototype


def total(assembly: Assembly, density: float = 1.0) -> MassProps:
    """The whole assembly as one body of one density."""
    used = [assembly.prototypes[i.prototype] for i in assembly.instances]
    volumes, coms, units = place(
        [p.volume_m3 for p in used],
        [p.com_m for p in used],
        [p.inertia_unit for p in used],
        [i.transform for i in assembly.instances],
    )
    return combine_arrays(density * volumes, coms, density * units)


def assert_body(
    props: Any, volume_mm3: float, com_mm: tuple[float, float, float], inertia_mm5: Any, size_mm: float
) -> None:
    """Volume, centre (in sizes of the body) and tensor (in its largest element) to 1e-9."""
    assert props.volume_m3 == pytest.approx(volume_mm3 * MM**3, rel=EXACT)
    np.testing.assert_allclose(props.com_m, np.array(com_mm) * MM, rtol=0, atol=EXACT * size_mm * MM)
    wanted = np.array(inertia_mm5, dtype=float) * MM**5
    np.testing.assert_allclose(props.inertia_unit, wanted, rtol=0, atol=EXACT * wanted.max())


def box_tensor(x: float, y: float, z: float) -> Any:
    """(3, 3) of a box per unit density."""
    return x * y * z / 12 * np.diag([y * y + z * z, x * x + z * z, x * x + y * y])


PI = math.pi
# Shape, volume [mm³], height of the centre [mm], and tensor by volume [mm²].
BODIES = {
    "box": (
        BRepPrimAPI_MakeBox(gp_Pnt(-5, -10, 0), 10, 20, 30), 6000, 15,
        [(20**2 + 30**2) / 12, (10**2 + 30**2) / 12, (10**2 + 20**2) / 12],
    ),
    "cylinder": (
        BRepPrimAPI_MakeCylinder(7, 25), PI * 7**2 * 25, 12.5,
        [(3 * 7**2 + 25**2) / 12, (3 * 7**2 + 25**2) / 12, 7**2 / 2],
    ),
    "sphere": (BRepPrimAPI_MakeSphere(11), 4 / 3 * PI * 11**3, 0, [0.4 * 11**2] * 3),
    "torus": (
        BRepPrimAPI_MakeTorus(30, 8), 2 * PI**2 * 30 * 8**2, 0,
        [30**2 / 2 + 5 / 8 * 8**2, 30**2 / 2 + 5 / 8 * 8**2, 30**2 + 3 / 4 * 8**2],
    ),
    "cone": (
        BRepPrimAPI_MakeCone(12, 0, 30), PI * 12**2 * 30 / 3, 7.5,
        [3 / 80 * (4 * 12**2 + 30**2), 3 / 80 * (4 * 12**2 + 30**2), 3 / 10 * 12**2],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BODIES)
def test_a_body_is_exact(name: str, step_part: Any, read_in: Any) -> None:
    shape, volume, height, moments = BODIES[name]
    part = only(read_in(step_part(shape.Shape())))
    assert_body(part, volume, (0, 0, height), volume * np.diag(moments), 30)


def test_a_cylinder_cut_at_a_slant_is_exact(step_part: Any, read_in: Any) -> None:
    """At the tolerance for volumes the kernel's tensor of it is 5e-8 off."""
    angle, r, h = 0.6, 3.0, 10.0
    turn, lift = gp_Trsf(), gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(1, 0, 0)), angle)
    lift.SetTranslation(gp_Vec(0, 0, h))
    slab = BRepPrimAPI_MakeBox(gp_Pnt(-50, -50, 0), 100, 100, 100).Shape()
    slab = BRepBuilderAPI_Transform(slab, lift.Multiplied(turn), True).Shape()
    part = only(read_in(step_part(BRepAlgoAPI_Cut(BRepPrimAPI_MakeCylinder(r, 20).Shape(), slab).Shape())))
    slope, disc, second = math.tan(angle), math.pi * r**2, math.pi * r**4 / 4
    volume = disc * h  # its height is h + slope * y
    com = np.array([0, slope * second, (h**2 * disc + slope**2 * second) / 2]) / volume
    squares = np.diag([h * second, h * second, (h**3 * disc + 3 * h * slope**2 * second) / 3])
    squares[1, 2] = squares[2, 1] = h * slope * second
    about = squares - volume * np.outer(com, com)
    assert_body(part, volume, tuple(com), np.trace(about) * np.eye(3) - about, 20)


def test_an_edge_inside_a_face_changes_nothing(box: Any) -> None:
    """Imprints and construction lines: they belong to no boundary."""
    (solid,) = occt.solids_of(box(10, 20, 30))
    wire = BRepTools.OuterWire_s(occt.faces_of(solid)[0])
    wire.Free(True)
    line = BRepBuilderAPI_MakeEdge(gp_Pnt(0, 5, 5), gp_Pnt(0, 6, 9)).Edge()
    BRep_Builder().Add(wire, line.Oriented(TopAbs_INTERNAL))
    found = moments_of(solid, 6000.0, 1e-8)
    assert found.volume == pytest.approx(6000, rel=1e-12)
    np.testing.assert_allclose(found.com, [5, 10, 15], rtol=1e-12)


def test_a_squashed_torus_is_exact(step_part: Any, read_in: Any) -> None:
    """A spline surface: the kernel's controlled tensor is 6e-5 off, with an estimated error of 2e-11."""
    squash = gp_GTrsf()
    for axis, factor in enumerate((20.0, 1.0, 2.0), start=1):
        squash.SetValue(axis, axis, factor)
    shape = BRepBuilderAPI_GTransform(BRepPrimAPI_MakeTorus(10, 1).Shape(), squash, True).Shape()
    part = only(read_in(step_part(shape)))
    volume = 2 * math.pi**2 * 10 * 40
    # Means of the squares of the coordinates; a torus has R²/2 + 3r²/8 across and r²/4 along its axis.
    x, y, z = 400 * (50 + 3 / 8), 50 + 3 / 8, 4 / 4
    assert_body(part, volume, (0, 0, 0), volume * np.diag([y + z, x + z, x + y]), 400)
    assert part.problems == ()


@pytest.mark.parametrize("corners", [8, 36])
def test_a_closed_spline_drawn_along_a_line_is_exact(corners: int, step_part: Any, read_in: Any) -> None:
    """A star: the kernel's controlled integration is 6 % off, and then 99 %, with an error of 1e-15."""
    array = pytest.importorskip("OCP.collections")
    turns = np.arange(corners) * 2 * math.pi / corners
    radii = np.where(np.arange(corners) % 2, 25, 40)
    x, y = 50 + radii * np.cos(turns), radii * np.sin(turns)
    points = array.HArray1_gp_Pnt(1, len(turns))
    for number, at in enumerate(zip(x.tolist(), y.tolist(), strict=True), start=1):
        points.SetValue(number, gp_Pnt(*at, 0))
    through = GeomAPI_Interpolate(points, True, 1e-9)
    through.Perform()
    curve = through.Curve()
    edge = BRepBuilderAPI_MakeEdge(curve).Edge()
    face = BRepBuilderAPI_MakeFace(BRepBuilderAPI_MakeWire(edge).Wire(), True).Face()
    part = only(read_in(step_part(BRepPrimAPI_MakePrism(face, gp_Vec(0, 0, 110)).Shape())))
    found = map(curve.Value, np.linspace(curve.FirstParameter(), curve.LastParameter(), 20_001).tolist())
    (x0, y0), (x1, y1) = (polygon := np.array([(p.X(), p.Y()) for p in found]))[:-1].T, polygon[1:].T
    area = abs(float((x0 * y1 - x1 * y0).sum())) / 2
    assert part.volume_m3 == pytest.approx(110 * area * MM**3, rel=1e-6)
    assert part.com_m[2] == pytest.approx(0.055, rel=1e-9)
    assert part.problems == ()


def test_a_turned_box_has_a_turned_tensor(box: Any, trsf: Any, step_part: Any, read_in: Any) -> None:
    """Geometry turned by R has the tensor R I Rᵀ, off-diagonal signs included."""
    turned = BRepBuilderAPI_Transform(box(10, 20, 30, (-5, -10, -15)), trsf((3, 4, 5), ROTATION), True)
    part = only(read_in(step_part(turned.Shape())))
    assert_body(part, 6000, (3, 4, 5), ROTATION @ box_tensor(10, 20, 30) @ ROTATION.T, 30)
    assert abs(part.inertia_unit[0, 1]) > 1e-2 * part.inertia_unit.max()


def test_an_off_axis_assembly_is_exact(box: Any, trsf: Any, step: Any, read_document: Any) -> None:
    """Three placed bodies, one of them nested and turned, against the closed form by the parallel axis."""
    document = step()
    cube, rod = (
        document.part(box(20, 20, 20, (-10, -10, -10)), "cube"),
        document.part(BRepPrimAPI_MakeCylinder(5, 60).Shape(), "rod"),
    )
    inner, outer = document.assembly("inner"), document.assembly("outer")
    document.place(inner, rod, trsf((0, 0, -30), np.eye(3)), "rod")
    document.place(outer, inner, trsf((40, -70, 25), ROTATION), "inner")
    document.place(outer, cube, trsf((100, 0, 0)), "cube_1")
    document.place(outer, cube, trsf((-15, 200, 7), ROTATION.T), "cube_2")
    found = total(read_document(document), density=2700.0)

    cube_volume, rod_volume = 8e-6, math.pi * 0.005**2 * 0.06
    cube_tensor = np.eye(3) * cube_volume * 0.02**2 / 6
    across, along = rod_volume * (3 * 0.005**2 + 0.06**2) / 12, rod_volume * 0.005**2 / 2
    bodies = [
        MassProps(2700 * cube_volume, np.array([0.1, 0, 0]), 2700 * cube_tensor),
        MassProps(2700 * cube_volume, np.array([-0.015, 0.2, 0.007]), 2700 * cube_tensor),
        MassProps(
            2700 * rod_volume,
            np.array([0.04, -0.07, 0.025]),
            2700 * ROTATION @ np.diag([across, across, along]) @ ROTATION.T,
        ),
    ]
    wanted = combine(bodies)
    assert found.mass == pytest.approx(wanted.mass, rel=EXACT)
    np.testing.assert_allclose(found.com, wanted.com, atol=EXACT * 0.3)
    np.testing.assert_allclose(found.inertia, wanted.inertia, atol=EXACT * wanted.inertia.max())


@pytest.mark.parametrize("unit", ["M", "INCH", "CM", "FT"])
def test_the_file_s_unit_does_not_change_the_part(unit: str, box: Any, step_part: Any, read_in: Any) -> None:
    """The same box written in metres, inches, centimetres and feet is the same box."""
    assembly = read_in(step_part(box(10, 20, 30), unit=unit))
    assert_body(only(assembly), 6000, (5, 10, 15), box_tensor(10, 20, 30), 30)
    assert assembly.unit == {"M": "m", "INCH": "inch", "CM": "cm", "FT": "foot"}[unit]


def test_a_part_baked_a_hundred_metres_away_keeps_its_tensor(
    box: Any, step_part: Any, read_in: Any, codes_of: Any
) -> None:
    """A 1 mm cube modelled 126 m from its origin: tensor as at home, and a word that digits were lost."""
    part = only(read_in(step_part(box(1, 1, 1, (1e5, 7e4, -3e4)))))
    assert part.volume_m3 == pytest.approx(1e-9, rel=EXACT)
    np.testing.assert_allclose(part.com_m, [100.0005, 70.0005, -29.9995], atol=1e-12)
    np.testing.assert_allclose(part.inertia_unit, np.eye(3) / 6 * 1e-15, atol=1e-9 * 1e-15 / 6)
    assert GeometryCode.BAKED in codes_of(part)


def test_a_flat_plate_keeps_a_plus_b_at_least_c(box: Any, step_part: Any, read_in: Any) -> None:
    """A plate 1000 x 500 x 0.01 mm: the tensor still belongs to a body (a + b >= c on its eigenvalues)."""
    part = only(read_in(step_part(box(1000, 500, 0.01))))
    a, b, c = np.linalg.eigvalsh(part.inertia_unit)
    assert a + b >= c * (1 - 1e-12)
    assert MassProps(part.volume_m3, part.com_m, part.inertia_unit).check() == ()


def test_a_void_is_empty(box: Any, step_part: Any, read_in: Any) -> None:
    """A closed cavity inside of a box is taken off in volume and tensor."""
    hollow = BRepAlgoAPI_Cut(box(20, 20, 20), box(10, 10, 10, (5, 5, 5))).Shape()
    part = only(read_in(step_part(hollow)))
    assert_body(part, 7000, (10, 10, 10), box_tensor(20, 20, 20) - box_tensor(10, 10, 10), 20)


def test_crossed_cylinders_are_exact(step_part: Any, trsf: Any, read_in: Any) -> None:
    """Two crossed cylinders have exactly 16/3 r³ in common (Steinmetz), though trimmed by free curves."""
    one = BRepPrimAPI_MakeCylinder(10, 60).Shape()
    quarter = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    other = BRepBuilderAPI_Transform(one, trsf((0, 30, 30), quarter), True).Shape()
    fused = BRepAlgoAPI_Fuse(one, other).Shape()
    part = only(read_in(step_part(fused)))
    assert part.volume_m3 == pytest.approx((2 * math.pi * 100 * 60 - 16 / 3 * 1000) * 1e-9, rel=1e-8)


def test_the_box_of_bodies_is_that_of_their_surfaces() -> None:
    """A turned torus, a ball inside, an edge outside, nested; what is empty adds nothing."""

    def together(*parts: Any) -> Any:
        builder, whole = BRep_Builder(), TopoDS_Compound()
        builder.MakeCompound(whole)
        for part in parts:
            builder.Add(whole, part)
        return whole

    turn = gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(1, 0, 0)), math.radians(30))
    torus = BRepBuilderAPI_Transform(BRepPrimAPI_MakeTorus(20, 5).Shape(), turn).Shape()
    ball, edge = (
        BRepPrimAPI_MakeSphere(4).Shape(),
        BRepBuilderAPI_MakeEdge(gp_Pnt(0, 0, 0), gp_Pnt(0, 0, 40)).Shape(),
    )
    rise = 20 * math.sin(math.radians(30)) + 5
    wanted = [
        [-25, -(20 * math.cos(math.radians(30)) + 5), -rise],
        [25, 20 * math.cos(math.radians(30)) + 5, 40],
    ]
    for shapes in ([together(together(torus, ball), together(), edge)], [edge, together(), torus, ball]):
        np.testing.assert_allclose(occt.exact_bounds(shapes), wanted, atol=1e-5)
    np.testing.assert_allclose(occt.exact_bounds([together()]), np.zeros((2, 3)))
    np.testing.assert_allclose(occt.exact_bounds([]), np.zeros((2, 3)))
