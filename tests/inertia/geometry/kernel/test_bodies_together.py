# SPDX-License-Identifier: LGPL-2.1-or-later
"""Solids of one product: copies, overlaps, cavities, shells; right, or said to be in doubt."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from OCP.BRep import BRep_Builder
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_Copy,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakePolygon,
    BRepBuilderAPI_Transform,
)
from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakePrism, BRepPrimAPI_MakeSphere
from OCP.BRepTools import BRepTools
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Compound, TopoDS_Shell, TopoDS_Solid

from silo.inertia.assembly import Prototype
from silo.inertia.geometry import kernel as occt
from silo.inertia.geometry.kernel.solids import measure
from silo.inertia.geometry.together import combined, mesh_volume
from silo.inertia.notes import GeometryCode

Read = Callable[..., Any]
COPY, OVER = GeometryCode.COINCIDENT_SOLIDS, GeometryCode.OVERLAPPING_SOLIDS


def cylinder(radius: float, height: float, at: tuple[float, float, float] = (0, 0, 0)) -> Any:
    """Upright, its foot at ``at`` [mm]."""
    return BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(*at), gp_Dir(0, 0, 1)), radius, height).Shape()


def sphere(radius: float, at: tuple[float, float, float] = (0, 0, 0)) -> Any:
    """Around ``at`` [mm]."""
    return BRepPrimAPI_MakeSphere(gp_Pnt(*at), radius).Shape()


def compound(*shapes: Any) -> Any:
    """Several shapes as one."""
    builder, result = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(result)
    for shape in shapes:
        builder.Add(result, shape)
    return result


def moved(shape: Any, *by: float) -> Any:
    """A copy somewhere else, with geometry of its own."""
    step = gp_Trsf()
    step.SetTranslation(gp_Vec(*by))
    return BRepBuilderAPI_Transform(shape, step, True).Shape()


def shell_of(faces: list[Any], solid: bool) -> Any:
    """Faces as a shell, or as what claims to be a solid."""
    builder, shell = BRep_Builder(), TopoDS_Shell()
    builder.MakeShell(shell)
    for face in faces:
        builder.Add(shell, face)
    if not solid:
        return shell
    result = TopoDS_Solid()
    builder.MakeSolid(result)
    builder.Add(result, shell)
    return result


@pytest.fixture(name="part")
def _part(tmp_path: Path, read_in: Read) -> Callable[..., Prototype]:
    """``part(shape, …)``: the shapes as one product, written as BREP and read."""

    def part(*shapes: Any) -> Prototype:
        path = tmp_path / "part.brep"
        assert BRepTools.Write_s(compound(*shapes), str(path))
        (found,) = read_in(path).prototypes.values()
        assert isinstance(found, Prototype)
        return found

    return part


def codes(part: Prototype) -> list[str]:
    """What is said of it, each once."""
    return sorted({str(problem.code) for problem in part.problems})


def test_a_cube_twice_is_a_cube(part: Callable[..., Prototype], box: Any) -> None:
    """The same solid twice, and an equal one with faces of its own."""
    cube = box(20, 20, 20)
    for other in (cube, box(20, 20, 20), moved(box(20, 20, 20, (5, 0, 0)), -5, 0, 0)):
        found = part(cube, other)
        assert found.volume_m3 * 1e9 == pytest.approx(8000)
        assert codes(found) == [COPY]


def test_three_copies_count_once(part: Callable[..., Prototype]) -> None:
    """And so do curved ones."""
    found = part(*(cylinder(5, 20) for _ in range(3)))
    assert found.volume_m3 * 1e9 == pytest.approx(np.pi * 500)
    assert codes(found) == [COPY]
    assert found.problems[0].message.startswith("2 solids lie exactly")


@pytest.mark.parametrize("at", [(10, 0, 0), (10, 10, 10), (19.9, 0, 0), (-10, 5, 0)])
def test_cubes_that_overlap(part: Callable[..., Prototype], box: Any, at: Any) -> None:
    """What they share is counted once, and the volume is in doubt."""
    found = part(box(20, 20, 20), box(20, 20, 20, at))
    shared = np.prod([20 - abs(x) for x in at])
    assert found.volume_m3 * 1e9 == pytest.approx(16000 - shared)
    assert codes(found) == [OVER]


@pytest.mark.parametrize(
    ("one", "other", "shared"),
    [
        (cylinder(5, 20), cylinder(5, 20, (0, 0, 15)), np.pi * 125),
        (cylinder(5, 20), cylinder(3, 20, (0, 0, 10)), np.pi * 90),
        (sphere(5), sphere(5, (9.9, 0, 0)), np.pi * 2 * 0.05**2 * (15 - 0.05) / 3),
    ],
    ids=["along", "stepped", "barely"],
)
def test_curved_solids_that_overlap(
    part: Callable[..., Prototype], one: Any, other: Any, shared: float
) -> None:
    """Also by less than the chords of a mesh."""
    alone = part(one).volume_m3 + part(other).volume_m3
    found = part(one, other)
    assert codes(found) == [OVER]
    assert (alone - found.volume_m3) * 1e9 == pytest.approx(shared, rel=1e-4)


def test_a_solid_inside_a_solid(part: Callable[..., Prototype], box: Any) -> None:
    """It adds nothing to the space that is filled already."""
    for inner in (box(10, 10, 10, (5, 5, 5)), box(10, 10, 10), sphere(5, (10, 10, 10))):
        found = part(box(20, 20, 20), inner)
        assert found.volume_m3 * 1e9 == pytest.approx(8000)
        assert codes(found) == [OVER]


@pytest.mark.parametrize(
    "other",
    [
        cylinder(5, 20, (10, 0, 0)),
        cylinder(5, 20, (0, 0, 20)),
        sphere(5, (10, 0, 10)),
        cylinder(2, 9, (5, 5, 0)),
    ],
    ids=["line", "face", "point", "near"],
)
def test_solids_that_touch_are_two(part: Callable[..., Prototype], other: Any) -> None:
    """In a line, a face or a point; their boxes may well overlap."""
    one = cylinder(5, 20)
    found = part(one, other)
    assert codes(found) == []
    assert found.volume_m3 == pytest.approx(part(one).volume_m3 + part(other).volume_m3)


def test_a_pin_in_its_hole_is_no_overlap(part: Callable[..., Prototype], box: Any) -> None:
    """A part with a fitting one in it: the most usual product of two solids."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut

    pin = cylinder(4, 20, (10, 10, 0))
    found = part(BRepAlgoAPI_Cut(box(20, 20, 20), pin).Shape(), pin)
    assert codes(found) == []
    assert found.volume_m3 * 1e9 == pytest.approx(8000)


def pinwheel(mirrored: bool) -> Any:
    """Four arms round a square of 2 mm, area 12 mm², 5 mm high."""
    corners = np.array([(1, -1), (1, 0), (3, 0), (3, 1)])
    turns = [np.array([[c, -s], [s, c]]) for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))]
    outline = BRepBuilderAPI_MakePolygon()
    for x, y in np.concatenate([corners @ turn.T for turn in turns]).tolist():
        outline.Add(gp_Pnt(-x if mirrored else x, y, 0))
    outline.Close()
    face = BRepBuilderAPI_MakeFace(outline.Wire()).Face()
    return BRepPrimAPI_MakePrism(face, gp_Vec(0, 0, 5)).Shape()


def test_a_mirror_image_is_no_copy(part: Callable[..., Prototype]) -> None:
    """Volume, centre, tensor and box are equal; the arms are others, and the square is there once."""
    found = part(pinwheel(False), pinwheel(True))
    assert found.volume_m3 * 1e9 == pytest.approx(5 * 20)
    assert codes(found) == [OVER]


def test_the_mesh_of_a_mirrored_solid_is_not_inside_out(box: Any) -> None:
    """A mirror in the solid's own location turns its triangles over."""
    mirror = gp_Trsf()
    mirror.SetMirror(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)))
    found = measure([box(1, 2, 3).Located(TopLoc_Location(mirror), False)], eps=1e-8, mesh_check=True)
    assert found.mesh is not None
    assert mesh_volume(found.mesh) == pytest.approx(6e-9)
    assert combined(found.solids).volume_m3 == pytest.approx(6e-9)


def test_nearly_equal_bodies_are_no_copy(part: Callable[..., Prototype], box: Any) -> None:
    """A cube, and one at its place that is 1e-4 longer: they overlap, and the longer one is what there is."""
    found = part(box(20, 20, 20), box(20, 20, 20.002))
    assert codes(found) == [OVER]
    assert found.volume_m3 == pytest.approx(400 * 20.002e-9)


def test_a_face_that_looks_inwards_is_an_open_shell(box: Any) -> None:
    """Faces that share no edges close when they are sewn; sewing turns the one that looks the wrong way."""
    builder, shell, solid = BRep_Builder(), TopoDS_Shell(), TopoDS_Solid()
    builder.MakeShell(shell)
    first, *others = (BRepBuilderAPI_Copy(face).Shape() for face in occt.faces_of(box(10, 20, 30)))
    for face in (first.Reversed(), *others):
        builder.Add(shell, face)
    builder.MakeSolid(solid)
    builder.Add(solid, shell)
    found = measure([solid], eps=1e-8, mesh_check=False)
    assert GeometryCode.OPEN_SHELL in [problem.code for problem in found.problems]


def test_equal_moments_are_no_copy(part: Callable[..., Prototype], box: Any) -> None:
    """A cube and the same turned by 45 degrees have equal volumes, centres and tensors."""
    turn = gp_Trsf()
    turn.SetRotation(gp_Ax2(gp_Pnt(10, 10, 10), gp_Dir(0, 0, 1)).Axis(), np.pi / 4)
    cube = box(20, 20, 20)
    found = part(cube, BRepBuilderAPI_Transform(cube, turn, True).Shape())
    assert codes(found) == [OVER]
    # The common octagon has 2 (√2 - 1) of the square's area.
    assert found.volume_m3 * 1e9 == pytest.approx(8000 * (2 - 2 * (np.sqrt(2) - 1)))


def test_a_body_in_a_cavity_of_a_body(part: Callable[..., Prototype], box: Any) -> None:
    """A ball in its housing, three deep, beside a larger block: each solid has what is its own."""
    solids = [box(30, 30, 30, (50, 0, 0)), *nested(box, 20, 10, 4)]
    found = measure(solids, eps=1e-8, mesh_check=True)
    assert sorted(solid.volume_m3 * 1e9 for solid in found.solids) == pytest.approx([64, 7000, 27000])
    assert OVER not in codes(found)


def nested(box: Any, *sizes: float) -> list[Any]:
    """Cubes around one middle, every second one inside out."""
    cubes = [box(size, size, size, (-size / 2, -size / 2, -size / 2)) for size in sizes]
    return [cube.Reversed() if number % 2 else cube for number, cube in enumerate(cubes)]


@pytest.mark.parametrize("turned", [(False, True), (True, False)])
def test_a_cavity_whichever_is_inside_out(
    part: Callable[..., Prototype], box: Any, turned: tuple[bool, bool]
) -> None:
    """Mirrored housings have both shells turned; the hole stays a hole."""
    outer, inner = box(20, 20, 20), box(10, 10, 10, (5, 5, 5))
    found = part(*(s.Reversed() if t else s for s, t in zip((outer, inner), turned, strict=True)))
    assert found.volume_m3 * 1e9 == pytest.approx(7000)
    assert codes(found) == [GeometryCode.NEGATIVE_VOLUME]


@pytest.mark.parametrize("missing", [1, 2, 3])
def test_an_open_shell_is_no_solid(part: Callable[..., Prototype], box: Any, missing: int) -> None:
    """Faces are missing, also two opposite ones, of which the volume from any point is the same."""
    faces = occt.faces_of(box(20, 20, 20))
    kept = [face for n, face in enumerate(faces) if n not in ((4, 5) if missing == 2 else range(missing))]
    assert GeometryCode.OPEN_SHELL in codes(part(shell_of(kept, solid=True)))


def test_faces_that_nearly_meet_are_closed(part: Callable[..., Prototype], box: Any) -> None:
    """Every face with edges of its own, one of them a hundredth of a micrometre away."""
    faces = [moved(face, 0, 0, 1e-5 * (n == 0)) for n, face in enumerate(occt.faces_of(box(20, 20, 20)))]
    found = part(shell_of(faces, solid=True))
    assert GeometryCode.OPEN_SHELL not in codes(found)
    assert found.volume_m3 * 1e9 == pytest.approx(8000)


@pytest.mark.parametrize("own_edges", [False, True])
def test_a_closed_shell_has_a_volume(part: Callable[..., Prototype], box: Any, own_edges: bool) -> None:
    """Surface models that close weigh what is inside, with a word; open ones nothing."""
    faces = occt.faces_of(box(20, 20, 20))
    faces = [moved(face, 0, 0, 0) for face in faces] if own_edges else faces
    found = part(shell_of(faces, solid=False))
    assert found.has_solid
    assert found.volume_m3 * 1e9 == pytest.approx(8000)
    assert GeometryCode.SHELL_VOLUME in codes(found)
    opened = part(shell_of(faces[1:], solid=False))
    assert not opened.has_solid
    assert codes(opened) == [GeometryCode.NO_SOLID]


def test_loose_faces_that_close_have_a_volume(part: Callable[..., Prototype]) -> None:
    """A cylinder's three faces, without any shell."""
    found = part(*(moved(face, 0, 0, 0) for face in occt.faces_of(cylinder(5, 20))))
    assert found.volume_m3 * 1e9 == pytest.approx(np.pi * 500)
    assert GeometryCode.SHELL_VOLUME in codes(found)


def test_a_shell_beside_its_own_solid_counts_once(part: Callable[..., Prototype], box: Any) -> None:
    """Exporters leave the surfaces beside the solid that was made of them."""
    found = part(box(20, 20, 20), shell_of(occt.faces_of(box(20, 20, 20)), solid=False))
    assert found.volume_m3 * 1e9 == pytest.approx(8000)
    assert {COPY, GeometryCode.SHELL_VOLUME} <= set(codes(found))
