# SPDX-License-Identifier: LGPL-2.1-or-later
"""Products, instances and names in STEP files (inertia-facts §9, cases 4, 5, 8, 9 and 14)."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fcstd_writer import Doc, Raw
from OCP.BRep import BRep_Builder
from OCP.BRepAdaptor import BRepAdaptor_Curve2d
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_GTransform,
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakeWire,
)
from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakeTorus
from OCP.BRepTools import BRepTools
from OCP.Geom2d import Geom2d_BezierCurve
from OCP.Geom2dConvert import Geom2dConvert
from OCP.gp import gp_Ax2, gp_Dir, gp_GTrsf, gp_Pln, gp_Pnt, gp_Pnt2d, gp_Trsf
from OCP.STEPControl import STEPControl_Reader
from OCP.TopoDS import TopoDS_Compound, TopoDS_Shell, TopoDS_Solid

from silo.bom.errors import DocumentError
from silo.inertia.assembly import Prototype
from silo.inertia.geometry import kernel as occt
from silo.inertia.geometry.graph import Child, Node
from silo.inertia.geometry.kernel.solids import beside_edges, solid_moments
from silo.inertia.geometry.part21 import ProductFacts, Products
from silo.inertia.geometry.step import StatedInStep, StepFile, against_stated, stated_totals
from silo.inertia.notes import GeometryCode, Note
from silo.inertia.placements import place


def compound(*shapes: Any) -> Any:
    """Several shapes as one."""
    builder, result = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(result)
    for shape in shapes:
        builder.Add(result, shape)
    return result


def wire() -> Any:
    """A wire without a face."""
    edge = BRepBuilderAPI_MakeEdge(gp_Pnt(0, 0, 50), gp_Pnt(30, 0, 50)).Edge()
    return BRepBuilderAPI_MakeWire(edge).Wire()


def face() -> Any:
    """A surface without a solid."""
    return BRepBuilderAPI_MakeFace(gp_Pln(gp_Pnt(0, 0, 40), gp_Dir(0, 0, 1)), 0, 10, 0, 10).Face()


def test_a_product_is_kept_once_however_often_it_is_placed(
    box: Any, trsf: Any, step: Any, read_document: Any
) -> None:
    """Two uses of a sub-assembly of three uses of a part: one prototype, six instances, paths in full."""
    document = step()
    bolt = document.part(box(1, 1, 5), "bolt")
    sub, top = document.assembly("sub"), document.assembly("top")
    for n in (1, 2, 3):
        document.place(sub, bolt, trsf((10 * n, 0, 0)), f"bolt:{n}")
    document.place(top, sub, trsf((0, 0, 0)), "sub:1")
    document.place(top, sub, trsf((0, 500, 0)), "sub:2")
    assembly = read_document(document)
    assert [p.name for p in assembly.prototypes.values()] == ["bolt"]
    assert [i.name for i in assembly.instances] == [f"sub:{s}/bolt:{n}" for s in (1, 2) for n in (1, 2, 3)]
    assert assembly.instances[0].product_path == ("sub", "bolt")
    assert assembly.name == "top"
    np.testing.assert_allclose(assembly.instances[4].transform[:3, 3], [0.02, 0.5, 0.0])
    np.testing.assert_allclose(assembly.frames[("sub:2",)][:3, 3], [0.0, 0.5, 0.0])


def test_repeated_instance_names_become_unique_paths(
    box: Any, trsf: Any, step: Any, read_document: Any
) -> None:
    """Onshape calls each use like its product: the second and third are marked ``<2>``, ``<3>``."""
    document = step()
    part, top = document.part(box(1, 1, 1), "Part 1"), document.assembly("top")
    for n in range(3):
        document.place(top, part, trsf((n, 0, 0)), "Part 1")
    assembly = read_document(document)
    assert [i.name for i in assembly.instances] == ["Part 1", "Part 1<2>", "Part 1<3>"]


def test_different_products_with_one_name_stay_different(box: Any, step: Any, read_document: Any) -> None:
    """Names are not unique in real exports: three products "Part 1" are three prototypes."""
    document = step()
    top = document.assembly("top")
    for size in (1, 2, 3):
        document.place(top, document.part(box(size, size, size), "Part 1"), name="Part 1")
    assembly = read_document(document)
    assert [p.name for p in assembly.prototypes.values()] == ["Part 1"] * 3
    assert sorted(p.volume_m3 * 1e9 for p in assembly.prototypes.values()) == pytest.approx([1, 8, 27])


def test_instance_names_are_kept_beside_product_names(box: Any, step: Any, read_document: Any) -> None:
    """An instance that is called otherwise than its product keeps both names."""
    document = step()
    top = document.assembly("top")
    document.place(top, document.part(box(1, 2, 3), "42-0815"), name="left hinge")
    (instance,) = read_document(document).instances
    assert (instance.path, instance.product_path) == (("left hinge",), ("42-0815",))


def test_solid_and_wire_of_one_product_are_one_product(box: Any, step: Any, read_document: Any) -> None:
    """The kernel makes leaves 'SOLID' and 'COMPOUND' of a mixed product; it is one product anyway."""
    document = step()
    top = document.assembly("top")
    document.place(top, document.part(compound(box(10, 10, 10), wire()), "mixed"), name="mixed_1")
    document.place(top, document.part(box(1, 1, 1), "plain"), name="plain_1")
    assembly = read_document(document)
    assert sorted(p.name for p in assembly.prototypes.values()) == ["mixed", "plain"]
    assert {i.path[0] for i in assembly.instances} == {"mixed_1", "plain_1"}
    mixed = next(p for p in assembly.prototypes.values() if p.name == "mixed")
    assert mixed.volume_m3 == pytest.approx(1e-6)


def test_a_product_of_surfaces_has_no_volume_and_says_so(
    box: Any, step: Any, read_document: Any, codes_of: Any
) -> None:
    """A surface product before a solid one: no name moves to its neighbour, and the surface is reported."""
    document = step()
    top = document.assembly("top")
    document.place(top, document.part(face(), "label"), name="label")
    document.place(top, document.part(box(2, 2, 2), "block"), name="block")
    by_name = {p.name: p for p in read_document(document).prototypes.values()}
    assert by_name["block"].volume_m3 == pytest.approx(8e-9)
    assert not by_name["label"].has_solid
    assert codes_of(by_name["label"]) == [GeometryCode.NO_SOLID]
    assert len(by_name["label"].mesh) > 0


def test_lost_characters_are_kept_and_marked(box: Any, step_part: Any, read_in: Any, codes_of: Any) -> None:
    """A name that the exporter damaged stays as it is, and is marked for the matching."""
    (part,) = read_in(step_part(box(1, 1, 1), "Pe?a 3")).prototypes.values()
    assert part.name == "Pe?a 3"
    assert GeometryCode.NAME in codes_of(part)


def test_names_beyond_ascii_survive(box: Any, step: Any, read_document: Any, codes_of: Any) -> None:
    """What the file encodes rightly is read rightly, and not marked."""
    document = step()
    document.part(box(1, 1, 1), "Peça Ø5 – 漢字")
    (part,) = read_document(document).prototypes.values()
    assert part.name == "Peça Ø5 – 漢字"
    assert codes_of(part) == []


def test_the_part_number_is_the_product_s_id(box: Any, step_part: Any, read_in: Any) -> None:
    """PRODUCT(id, name): the kernel gives the name only, the text has both."""
    path = step_part(box(1, 1, 1), "bracket")
    text = path.read_text("ascii").replace("PRODUCT('bracket','bracket'", "PRODUCT('F01-0042','bracket'")
    path.write_text(text, "ascii")
    (part,) = read_in(path).prototypes.values()
    assert (part.name, part.part_number) == ("bracket", "F01-0042")


def test_mirrored_and_scaled_placements_are_exact_or_refused_aloud(
    box: Any, step: Any, read_document: Any, codes_of: Any
) -> None:
    """A mirror moves the centre to the other side; a scale of 2 has eight times the volume."""
    mirror, double = gp_Trsf(), gp_Trsf()
    mirror.SetMirror(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(1, 0, 0)))
    double.SetScale(gp_Pnt(0, 0, 0), 2.0)
    document = step()
    part, top = document.part(box(10, 20, 30), "part"), document.assembly("top")
    document.place(top, part, mirror, "mirrored")
    document.place(top, part, double, "doubled")
    assembly = read_document(document)
    assert codes_of(assembly) == [GeometryCode.SCALED]
    prototype = next(iter(assembly.prototypes.values()))
    volumes, coms, units = place(
        [prototype.volume_m3] * 2,
        [prototype.com_m] * 2,
        [prototype.inertia_unit] * 2,
        [i.transform for i in assembly.instances],
    )
    np.testing.assert_allclose(volumes, [6e-6, 48e-6], rtol=1e-12)
    np.testing.assert_allclose(coms, [[-0.005, 0.010, 0.015], [0.010, 0.020, 0.030]], atol=1e-15)
    np.testing.assert_allclose(units[1], units[0] * 32, rtol=1e-12, atol=1e-20)
    assert np.linalg.det(assembly.instances[0].transform[:3, :3]) == pytest.approx(-1)


@pytest.mark.parametrize(("stated", "doubts"), [(8e-6, 0), (1e-6, 1), (None, 0)])
def test_a_stated_total_counts_scaled_parts_as_they_stand(stated: float | None, doubts: int) -> None:
    """A part of 1 cm³, placed twice as large and mirrored: its assembly has 8 cm³."""
    use = Child("part", "part", np.diag([-2.0, 2, 2, 1]))
    nodes = {"top": Node("top", "top", (use,)), "part": Node("part", "part", (), True)}
    stating = {"top": StatedInStep(stated), "part": StatedInStep()}
    step = StepFile(Path("x.step"), nodes=nodes, stated=stating, roots=[Child("top", "top")])
    found = stated_totals(step, {"part": Prototype("part", "part", volume_m3=1e-6)})
    assert [problem.code for problem in found] == doubts * [GeometryCode.STATED_VOLUME]


@pytest.mark.parametrize(("stated", "codes"), [(1.0005e-6, []), (1.002e-6, [GeometryCode.STATED_VOLUME])])
def test_a_stated_volume_may_be_off_by_a_thousandth(stated: float, codes: list[GeometryCode]) -> None:
    """A file's own figure for a part, and where it begins to speak against what was measured."""
    assert [p.code for p in against_stated(1e-6, np.zeros(3), StatedInStep(stated))] == codes


def test_a_reversed_solid_inside_another_is_a_cavity(box: Any, tmp_path: Path, read_in: Any) -> None:
    """Where the reversed solid lies in the material of another one, it is taken off; beside it, it counts."""
    for name, at, volume in (("inside", (5, 5, 5), 7000), ("beside", (50, 0, 0), 9000)):
        path = tmp_path / f"{name}.brep"
        assert BRepTools.Write_s(compound(box(20, 20, 20), box(10, 10, 10, at).Reversed()), str(path))
        (part,) = read_in(path).prototypes.values()
        assert part.volume_m3 * 1e9 == pytest.approx(volume)
        assert "some are not" in part.problems[-1].message


def test_an_open_solid_is_invalid_and_its_mesh_disagrees(
    box: Any, tmp_path: Path, read_in: Any, codes_of: Any
) -> None:
    """A box with a face missing, sold as a solid: the kernel computes a volume; nobody should believe it."""
    builder, shell, solid = BRep_Builder(), TopoDS_Shell(), TopoDS_Solid()
    builder.MakeShell(shell)
    for part in occt.faces_of(box(20, 20, 20))[:5]:
        builder.Add(shell, part)
    builder.MakeSolid(solid)
    builder.Add(solid, shell)
    path = tmp_path / "open.brep"
    assert BRepTools.Write_s(solid, str(path))
    (prototype,) = read_in(path).prototypes.values()
    expected = [GeometryCode.INVALID_SHAPE, GeometryCode.MESH_MISMATCH, GeometryCode.OPEN_SHELL]
    assert codes_of(prototype) == expected


def test_a_nesting_bomb_is_refused_before_the_kernel_sees_it(tmp_path: Path, read_in: Any) -> None:
    """Forty levels of two uses each name a million million parts in 20 kB; the count is made on the text."""
    levels = 40
    lines = []
    for n in range(levels + 1):
        lines.append(f"#{10 * n + 1}=PRODUCT('p{n}','p{n}','',());")
        lines.append(f"#{10 * n + 2}=PRODUCT_DEFINITION_FORMATION('','',#{10 * n + 1});")
        lines.append(f"#{10 * n + 3}=PRODUCT_DEFINITION('','',#{10 * n + 2},$);")
    for n in range(levels):
        for use in (4, 5):
            lines.append(
                f"#{10 * n + use}=NEXT_ASSEMBLY_USAGE_OCCURRENCE('','','',#{10 * n + 3},#{10 * n + 13},$);"
            )
    path = tmp_path / "bomb.step"
    path.write_text(
        "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n" + "\n".join(lines) + "\nENDSEC;\nEND-ISO-10303-21;\n"
    )
    with pytest.raises(DocumentError, match="1099511627776 placed parts, more than the 1000000 allowed"):
        read_in(path)


def test_a_product_that_contains_itself_is_refused(tmp_path: Path, read_in: Any) -> None:
    """A ring of uses is an error with the product's name, not a hang."""
    path = tmp_path / "ring.step"
    path.write_text(
        "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n"
        "#1=PRODUCT('ring','ring','',());\n#2=PRODUCT_DEFINITION_FORMATION('','',#1);\n"
        "#3=PRODUCT_DEFINITION('','',#2,$);\n#4=NEXT_ASSEMBLY_USAGE_OCCURRENCE('','','',#3,#3,$);\n"
        "ENDSEC;\nEND-ISO-10303-21;\n"
    )
    with pytest.raises(DocumentError, match="the product 'ring' contains itself"):
        read_in(path)


def test_a_part_twice_at_one_place_is_reported(
    step: Any, box: Any, trsf: Any, read_document: Any, codes_of: Any
) -> None:
    """An accident of copying; both are counted, since the BOM counts both."""
    document = step()
    top, part = document.assembly("top"), document.part(box(10, 10, 10), "cube")
    # An exporter that multiplies placements leaves rounding behind.
    for name, along in (("one", 0), ("two", 1e-9), ("three", 20), ("near", 20.01)):
        document.place(top, part, trsf((along, 0, 0)), name)
    assembly = read_document(document)
    assert codes_of(assembly) == [GeometryCode.COINCIDENT_PARTS]
    assert "1 (two)" in assembly.problems[0].message
    assert len(assembly.instances) == 4


def test_a_product_without_any_name_is_reported(
    step_part: Any, box: Any, read_in: Any, codes_of: Any
) -> None:
    """No BOM line can have its name; it is called after its file."""
    path = step_part(box(10, 10, 10), "block")
    path.write_text(path.read_text().replace("PRODUCT('block','block'", "PRODUCT('','  '"))
    (part,) = read_in(path).prototypes.values()
    assert (part.name, codes_of(part)) == ("block", [GeometryCode.NAME])


def moved_surface(text: str, kind: str, offset: float) -> str:
    """STEP text whose first plane is moved along its normal, or its first cylinder made wider, edges not."""
    entities = dict(re.findall(r"#(\d+) = ([^;]*);", text))
    number, body = next(item for item in entities.items() if item[1].startswith(f"{kind}("))
    if kind == "CYLINDRICAL_SURFACE":
        head, _, radius = body[:-1].rpartition(",")
        return text.replace(f"#{number} = {body};", f"#{number} = {head},{float(radius) + offset!r});")
    (axes,) = re.findall(r"#(\d+)", body)
    place, normal = (n for n in re.findall(r"#(\d+)", entities[axes])[:2])
    at, along = (
        np.array(entities[n].split("(")[2].rstrip(")").split(","), dtype=float) for n in (place, normal)
    )
    moved = ",".join(repr(float(x)) for x in at + offset * along)
    return text.replace(f"#{place} = {entities[place]};", f"#{place} = CARTESIAN_POINT('',({moved}));")


@pytest.mark.parametrize(
    ("offset", "code"),
    [(0.0, None), (5e-5, None), (1e-3, GeometryCode.NOT_CONVERGENT), (0.05, GeometryCode.OPEN_SHELL)],
)
@pytest.mark.parametrize("kind", ["PLANE", "CYLINDRICAL_SURFACE"])
def test_a_face_beside_its_own_edges_is_doubted(
    kind: str,
    offset: float,
    code: GeometryCode | None,
    step_part: Any,
    box: Any,
    read_in: Any,
    tmp_path: Path,
) -> None:
    """The kernel widens the edges' tolerances until such a face is valid; [mm], in a bored block of 10 mm.

    Also where FreeCAD has imported it, and keeps the shape with the wide tolerances.
    """
    bore = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(5, 5, -1), gp_Dir(0, 0, 1)), 4.0, 12.0).Shape()
    path = step_part(BRepAlgoAPI_Cut(box(10, 10, 10), bore).Shape())
    text = path.read_text()
    path.write_text(moved_surface(text, kind, offset))
    assert path.read_text() != text
    (part,) = read_in(path).prototypes.values()
    assert [p.code for p in part.problems] == ([code] if code else [])
    doc = Doc("imported")
    assert BRepTools.Write_s(imported(path), str(tmp_path / "shape.brp"))
    doc.entries["Body.Shape.brp"] = (tmp_path / "shape.brp").read_bytes()
    doc.add("Part::Feature", "Body", Shape=Raw("Part::PropertyPartShape", '<Part file="Body.Shape.brp"/>'))
    (part,) = read_in(doc.save(tmp_path / "imported.FCStd")).prototypes.values()
    assert [p.code for p in part.problems] == ([code] if code else [])


def imported(path: Path) -> Any:
    """The shape of a STEP file."""
    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    return reader.OneShape()


def test_a_spline_face_that_does_not_meet_its_edges_is_doubted(step_part: Any, box: Any) -> None:
    """Where our own integration is asked, it reports that by itself: a squashed torus, cut, the cut moved."""
    squash = gp_GTrsf()
    squash.SetValue(1, 1, 5.0)
    torus = BRepBuilderAPI_GTransform(BRepPrimAPI_MakeTorus(10, 1).Shape(), squash, True).Shape()
    path = step_part(BRepAlgoAPI_Cut(torus, box(200, 50, 50, (-100, 0, -25))).Shape())
    text = path.read_text()
    for offset, codes in ((0.0, []), (1e-2, [GeometryCode.NOT_CONVERGENT])):
        path.write_text(moved_surface(text, "PLANE", offset))
        (solid,) = occt.solids_of(imported(path))
        notes: list[Note] = []
        found = solid_moments(solid, 1e-8, notes)
        assert [note.code for note in notes] == codes
        assert abs(found.volume) == pytest.approx(math.pi**2 * 50, rel=1e-3)


@pytest.mark.parametrize(("aside", "doubt"), [(0.0, 0.0), (1.0, 0.0075)])
def test_points_that_lag_behind_along_an_edge_open_no_gap(aside: float, doubt: float, box: Any) -> None:
    """An edge of 10 mm that runs at another pace in its face, 1.5 mm apart for equal t; or beside it."""
    array = pytest.importorskip("OCP.collections")
    (solid,) = occt.solids_of(box(10, 10, 10))
    face = occt.faces_of(solid)[0]
    edge = occt.edges_of(face)[0]
    flat = BRepAdaptor_Curve2d(edge, face)
    span = (flat.FirstParameter(), flat.LastParameter())
    begin, end = (np.array([p.X(), p.Y()]) for p in map(flat.Value, span))
    across = np.array([begin[1] - end[1], end[0] - begin[0]]) / 10
    poles, knots = array.Array1_gp_Pnt2d(1, 3), array.Array1_double(1, 2)
    for number, pole in enumerate((begin, begin + 0.2 * (end - begin) + aside * across, end), start=1):
        poles.SetValue(number, gp_Pnt2d(*pole.tolist()))
    for number, knot in enumerate(span, start=1):
        knots.SetValue(number, knot)
    spline = Geom2dConvert.CurveToBSplineCurve_s(Geom2d_BezierCurve(poles))
    spline.SetKnots(knots)
    BRep_Builder().UpdateEdge(edge, spline, face, 2.0)
    assert beside_edges(solid, 1000.0) == pytest.approx(doubt, rel=0.2)


def test_a_name_stands_for_the_only_product_that_has_it() -> None:
    """A product without a name is known by its part number."""
    parts = (("P-1", "Plate"), ("P-2", ""), ("P-3", "Twin"), ("P-4", "Twin"))
    products = Products({key: ProductFacts(*part) for key, part in enumerate(parts)})
    assert products.named("Plate") is products.facts[0]
    assert products.named("P-2") is products.facts[1]
    assert [products.named(name) for name in ("Twin", "P-1", "Bolt")] == [None] * 3
