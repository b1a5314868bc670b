# SPDX-License-Identifier: LGPL-2.1-or-later
"""Random products through STEP, FCStd, STL and 3MF: every result is right to 1e-6, or doubted in a warning.

A small seeded sample runs everywhere. The hunt:
``SILO_HUNT=20000 pytest tests/inertia/geometry/test_hunt.py``.
``SILO_HUNT_SEED`` starts another one.

Mutants by hand that tests kill: every shell or mesh taken as closed, no two bodies near each other, the sign
of a body or of a mesh ignored, cavities and bodies not kept apart, ``count_differs`` never said, the centre
of a sub-assembly compared to 1e-2 m, ``MAX_SPLITS`` 3.
"""

from __future__ import annotations

import os
import random
import zipfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from fcstd_writer import Doc, Raw
from OCP.BRep import BRep_Builder
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
from OCP.BRepTools import BRepTools
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf
from OCP.TopAbs import TopAbs_SHELL
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS_Compound, TopoDS_Shell, TopoDS_Solid
from product_hunt import Moments, Piece, Product, product, triangles
from step_writer import StepDocument, trsf_of

from silo.inertia.assembly import Assembly, Prototype
from silo.inertia.geometry import kernel as occt
from silo.inertia.notes import GeometryCode
from silo.inertia.push import DOUBTS

COUNT = int(os.environ.get("SILO_HUNT", "120"))
SEED = int(os.environ.get("SILO_HUNT_SEED", "13"))
PER_FILE = 10
SAID = {*DOUBTS, GeometryCode.COINCIDENT_SOLIDS, GeometryCode.NO_SOLID, GeometryCode.SHELL_VOLUME}
"""Warnings that say that the file is not what it should be."""


OPEN = {GeometryCode.OPEN_SHELL, GeometryCode.NOT_WATERTIGHT, GeometryCode.NO_SOLID}
"""One of them is said of every surface with a hole."""


def solid_of(one: Piece) -> Any:
    """A piece as a solid, a shell, or what is left of one."""
    x, y, z = one.size
    ax, ay, az = one.at
    if one.sides == 0:
        shape = BRepPrimAPI_MakeBox(gp_Pnt(ax - x / 2, ay - y / 2, az - z / 2), x, y, z).Shape()
    else:
        foot = gp_Ax2(gp_Pnt(ax, ay, az - z / 2), gp_Dir(0, 0, 1))
        shape = BRepPrimAPI_MakeCylinder(foot, x, z).Shape()
    faces = [face.Reversed() if one.turned else face for face in occt.faces_of(shape)]
    builder, shell, solid = BRep_Builder(), TopoDS_Shell(), TopoDS_Solid()
    builder.MakeShell(shell)
    for face in faces[one.missing :]:
        builder.Add(shell, face)
    if one.shell:
        return shell
    builder.MakeSolid(solid)
    builder.Add(solid, shell)
    return solid


def shape_of(found: Product, *, moved: bool, voids: bool = False) -> Any:
    """All pieces as one shape.

    moved
        where the product stands, else turned, scaled and mirrored only.
    voids
        the second piece is a cavity of the first one's solid, and no solid by itself.
    """
    builder, result = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(result)
    solids = [solid_of(one) for one in found.pieces]
    for solid in solids[2:] if voids else solids:
        builder.Add(result, solid)
    if voids:
        hollow = TopoDS_Solid()
        builder.MakeSolid(hollow)
        for solid in solids[:2]:
            builder.Add(hollow, TopExp_Explorer(solid, TopAbs_SHELL).Current())
        builder.Add(result, hollow)
    place = gp_Trsf()
    step = found.step if moved else np.zeros(3)
    place.SetValues(*(float(v) for v in np.column_stack([found.turn, step]).ravel()))
    return BRepBuilderAPI_Transform(result, place, True).Shape()


def through_step(dice: random.Random, folder: Path) -> Iterator[tuple[Product, Path, str]]:
    """Ten products of one file, placed in sub-assemblies or at the top."""
    document = StepDocument()
    top = document.assembly("top")
    made = [product(dice, prisms=False, exact=False) for _ in range(PER_FILE)]
    for number, found in enumerate(made):
        voids = found.kind in ("hollow", "core") and dice.random() < 0.5
        if found.kind in ("hollow", "core") and not voids:
            # The kernel turns each solid of a STEP file outwards, so that a cavity looks like a second body.
            found.doubt = None
        label = document.part(shape_of(found, moved=False, voids=voids), f"p{number}")
        parent = top
        if dice.random() < 0.5:
            parent = document.assembly(f"sub{number}")
            document.place(top, parent, trsf_of((0, 0, 0)), f"s{number}")
        document.place(parent, label, trsf_of(found.step), f"i{number}")
    path = document.write(folder / "hunt.step", dice.choice(["MM", "INCH", "M"]))
    for number, found in enumerate(made):
        yield found, path, f"p{number}"


def through_fcstd(dice: random.Random, folder: Path) -> Iterator[tuple[Product, Path, str]]:
    """A document with one object, its shape stored as FreeCAD stores it."""
    found = product(dice, prisms=False, exact=False)
    stored = folder / "shape.brp"
    assert BRepTools.Write_s(shape_of(found, moved=True), str(stored))
    doc = Doc("hunt")
    doc.entries["Body.Shape.brp"] = stored.read_bytes()
    shape = Raw("Part::PropertyPartShape", '<Part ElementMap="0.4" file="Body.Shape.brp"/>')
    place = '<PropertyPlacement Px="0" Py="0" Pz="0" Q0="0" Q1="0" Q2="0" Q3="1"/>'
    doc.add("Part::Feature", "Body", Shape=shape, Placement=Raw("App::PropertyPlacement", place))
    yield found, doc.save(folder / "hunt.FCStd"), ""


def through_stl(dice: random.Random, folder: Path) -> Iterator[tuple[Product, Path, str]]:
    """32-bit coordinates: the products stand on a grid."""
    found = product(dice, prisms=True, exact=True)
    vertices, faces = triangles(found)
    path = folder / "hunt.stl"
    trimesh.Trimesh(vertices, faces, process=False).export(path)
    yield found, path, ""


def through_3mf(dice: random.Random, folder: Path) -> Iterator[tuple[Product, Path, str]]:
    """Text with all digits, anywhere and any way round."""
    found = product(dice, prisms=True, exact=False)
    vertices, faces = triangles(found)
    rows = "".join(f'<vertex x="{x!r}" y="{y!r}" z="{z!r}"/>' for x, y, z in vertices.tolist())
    rows = f"<vertices>{rows}</vertices><triangles>" + "".join(
        f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in faces.tolist()
    )
    text = (
        '<model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>'
        f'<object id="1" name="p" type="model"><mesh>{rows}</triangles></mesh></object></resources>'
        '<build><item objectid="1"/></build></model>'
    )
    path = folder / "hunt.3mf"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("3D/3dmodel.model", text)
    yield found, path, ""


WAYS = {"step": through_step, "fcstd": through_fcstd, "stl": through_stl, "3mf": through_3mf}


def as_measured(assembly: Assembly, part: Prototype) -> Moments:
    """What was read, in mm, about the origin, where its only instance stands."""
    volume, centre = part.volume_m3 * 1e9, part.com_m * 1e3
    about = part.inertia_unit * 1e15
    second = np.trace(about) / 2 * np.eye(3) - about + volume * np.outer(centre, centre)
    (instance,) = (i for i in assembly.instances if i.prototype == part.key)
    return Moments(volume, volume * centre, second).mapped(
        instance.transform[:3, :3], instance.transform[:3, 3] * 1e3
    )


def wrong_by(found: Moments, truth: Moments) -> float:
    """The largest relative error of volume, centre (of the size) and tensor about the centre."""
    size = abs(truth.volume) ** (1 / 3)
    if not found.volume:
        return 1.0
    centre, true_centre = found.first / found.volume, truth.first / truth.volume
    about = found.second - found.volume * np.outer(centre, centre)
    true_about = truth.second - truth.volume * np.outer(true_centre, true_centre)
    return max(
        abs(found.volume / truth.volume - 1),
        float(np.abs(centre - true_centre).max()) / size,
        float(np.abs(about - true_about).max() / np.trace(true_about)),
    )


def complaint(found: Product, assembly: Assembly, part: Prototype) -> str:
    """What is wrong with the result; empty where it is right, or doubted as it should be."""
    codes = {str(problem.code) for problem in part.problems}
    error = wrong_by(as_measured(assembly, part), found.placed)
    said = codes & SAID
    if error > 1e-6 and not said:
        return f"off by {error:.2g} in silence"
    if found.doubt is False and (error > 1e-6 or said):
        return f"off by {error:.2g}, doubted as {sorted(said)}, and nothing was wrong with it"
    if found.kind == "opened" and not codes & OPEN:
        return f"is open, and only {sorted(codes)} was said"
    if found.doubt is True and not said:
        return "nothing was said of it"
    return ""


@pytest.mark.parametrize("way", WAYS)
def test_every_result_is_right_or_doubted(way: str, tmp_path: Path, read_in: Any) -> None:
    """The sample of ``SILO_HUNT`` products, a quarter of them in each format."""
    dice = random.Random(f"{SEED} {way}")
    complaints: list[str] = []
    kinds: Counter[str] = Counter()
    while kinds.total() < COUNT // len(WAYS):
        known: dict[Path, Assembly] = {}
        for found, path, name in WAYS[way](dice, tmp_path):
            if path not in known:
                known[path] = read_in(path)
            assembly = known[path]
            (part,) = (p for p in assembly.prototypes.values() if name in ("", p.name))
            kinds[found.kind] += 1
            if words := complaint(found, assembly, part):
                complaints.append(f"{found.kind} {kinds.total()}: {words}; {found.pieces}")
    assert not complaints, f"{len(complaints)} of {kinds.total()}: " + "\n".join(complaints[:10])
