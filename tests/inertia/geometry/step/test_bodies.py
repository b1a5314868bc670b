# SPDX-License-Identifier: LGPL-2.1-or-later
"""Every body that the text of a STEP file names is measured, or named in a warning; none vanishes.

``SILO_HUNT=20000 pytest tests/inertia/geometry/step/test_bodies.py`` reads so many files of random bodies.
"""

from __future__ import annotations

import os
import random
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from OCP.BRep import BRep_Builder
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from OCP.gp import gp_Pnt
from OCP.TopoDS import TopoDS_Compound, TopoDS_Shell
from step_bodies import KINDS, MM, Bodies, begun, some
from step_writer import StepDocument, trsf_of

from silo.inertia.assembly import Prototype
from silo.inertia.geometry import kernel as occt
from silo.inertia.geometry.part21 import WANTED, read_products, scan
from silo.inertia.notes import GeometryCode

COUNT = int(os.environ.get("SILO_HUNT", "60"))
SEED = int(os.environ.get("SILO_HUNT_SEED", "29"))

ReadIn = Callable[..., Any]


def only(assembly: Any) -> Prototype:
    """The one product."""
    (part,) = assembly.prototypes.values()
    return part


def complaint(made: Bodies, part: Prototype) -> str:
    """What differs from the list of bodies that the file was written from; "" for nothing."""
    volume = part.volume_m3 * 1e9 / MM[made.unit] ** 3
    said = [p.message for p in part.problems if p.code == GeometryCode.BODY_MISSING]
    if abs(volume - made.volume) > 1e-7 * max(made.volume, 1.0):
        return f"{volume:.9g} for {made.volume:.9g}"
    return f"{len(said)} named of {made.lost}: {said}" if len(said) != made.lost else ""


@pytest.mark.parametrize("unit", MM)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("cube", [True, False])
def test_a_body_of_each_kind(kind: str, unit: str, cube: bool, tmp_path: Path, read_in: ReadIn) -> None:
    """Beside a cube and alone, in each unit."""
    path = tmp_path / "part.step"
    made = begun(path, unit)
    KINDS[kind](made, 50.0)
    made.cube = cube
    made.volume -= 0 if cube else made.side**3
    part = only(read_in(made.write(path)))
    assert not complaint(made, part)
    named = re.findall(r"#(\d+)", " ".join(p.message for p in part.problems))
    assert [int(number) for number in named] == (made.items if made.lost else [])


def test_random_bodies(tmp_path: Path, read_in: ReadIn) -> None:
    """Several in one product; nothing differs from the writer's own list."""
    dice = random.Random(SEED)
    wrong = []
    for number in range(COUNT):
        path = tmp_path / "part.step"
        made = some(path, dice, dice.choice(sorted(MM)))
        if not made.cube and made.lost == len(made.items):
            continue  # nothing is left of the product: another sentence says so
        if words := complaint(made, only(read_in(path))):
            wrong.append(f"{number}: {words}: {[line for line in made.lines if 'LID' not in line][-3:]}")
    assert not wrong, f"{len(wrong)} of {COUNT}: " + "\n".join(wrong[:5])


def test_triangles_of_an_exact_body_are_no_other_body(tmp_path: Path, read_in: ReadIn) -> None:
    """AP242 files carry both; the link says so."""
    path = tmp_path / "part.step"
    made = begun(path)
    KINDS["TESSELLATED_SOLID"](made, 50.0)
    made.lines[-1] = made.lines[-1].replace(",$)", f",#{made.brep})")
    made.volume, made.lost = 1000.0, 0
    assert not complaint(made, only(read_in(made.write(path))))


def test_angles_are_in_the_unit_of_the_file(tmp_path: Path, read_in: ReadIn) -> None:
    """A cone's half angle of 45 degrees."""
    path = tmp_path / "part.step"
    made = begun(path)
    KINDS["CONE"](made, 50.0)
    made.lines[-1] = re.sub(r"0\.78\d+", "45.", made.lines[-1])
    radian = made.add("( NAMED_UNIT(*) PLANE_ANGLE_UNIT() SI_UNIT($,.RADIAN.) )")
    measure = made.add(f"PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(0.017453292519943295),#{radian})")
    degree = made.add(f"( CONVERSION_BASED_UNIT('DEGREE',#{measure}) NAMED_UNIT(*) PLANE_ANGLE_UNIT() )")
    text = made.write(path).read_text("ascii")
    first = re.search(r"#(\d+) = \( NAMED_UNIT\(\*\) PLANE_ANGLE_UNIT", text)
    assert first is not None
    assigned = re.search(r"GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\([^)]*\)\)", text)
    assert assigned is not None
    path.write_text(text.replace(assigned[0], assigned[0].replace(f"#{first[1]}", f"#{degree}")), "ascii")
    assert not complaint(made, only(read_in(path)))


def test_a_body_without_volume_is_named(tmp_path: Path, read_in: ReadIn) -> None:
    """A cylinder of no radius: the kernel makes a solid of it that nothing can be in."""
    path = tmp_path / "part.step"
    made = begun(path)
    made.item(f"RIGHT_CIRCULAR_CYLINDER('c',#{made.axis(50.0)},3.,0.)", 0.0)
    part = only(read_in(made.write(path)))
    assert part.volume_m3 == pytest.approx(1e-6)
    assert any("no volume that can be computed" in problem.message for problem in part.problems)


def test_a_mapped_body_that_is_not_read_is_named(tmp_path: Path, read_in: ReadIn, codes_of: Any) -> None:
    """Its numbers say another place than it stands in, so it is not made from them."""
    path = tmp_path / "part.step"
    made = begun(path)
    block = made.add(f"BLOCK('',#{made.axes(50.0)},1.,2.,3.)")
    context = made.add("( GEOMETRIC_REPRESENTATION_CONTEXT(3) REPRESENTATION_CONTEXT('','') )")
    other = made.add(f"SHAPE_REPRESENTATION('',(#{block}),#{context})")
    source = made.add(f"REPRESENTATION_MAP(#{made.axes(0.0)},#{other})")
    made.item(f"MAPPED_ITEM('',#{source},#{made.axes(90.0)})", None)
    assembly = read_in(made.write(path))
    part = only(assembly)
    assert not complaint(made, part)
    assert codes_of(assembly) == []  # it is not a body of no product as well
    assert f"BLOCK #{block}" in part.problems[0].message


def test_a_mapped_shape_of_another_product_stays_its_own() -> None:
    """An assembly may place its parts so; their bodies are theirs alone."""
    products = "".join(
        f"#{n}=PRODUCT('{n}','','',());#{n + 1}=PRODUCT_DEFINITION_FORMATION('','',#{n});"
        f"#{n + 2}=PRODUCT_DEFINITION('','',#{n + 1},$);#{n + 3}=PRODUCT_DEFINITION_SHAPE('','',#{n + 2});"
        f"#{n + 4}=SHAPE_REPRESENTATION('',(#{item}),$);"
        f"#{n + 5}=SHAPE_DEFINITION_REPRESENTATION(#{n + 3},#{n + 4});"
        for n, item in ((10, 32), (20, 30))
    )
    mapped = "#30=SPHERE('',1.,$);#31=REPRESENTATION_MAP(#9,#24);#32=MAPPED_ITEM('',#31,#9);"
    facts = read_products(scan(f"{products}{mapped}END-ISO-10303-21;".encode(), WANTED)).facts
    assert {number: found.bodies for number, found in facts.items()} == {12: (), 22: (30,)}


def test_a_body_that_stands_twice_hides_no_other(tmp_path: Path, read_in: ReadIn) -> None:
    """As many solids as bodies, and one of the bodies is none of them."""
    path = tmp_path / "part.step"
    made = begun(path)
    context = made.add("( GEOMETRIC_REPRESENTATION_CONTEXT(3) REPRESENTATION_CONTEXT('','') )")
    other = made.add(f"SHAPE_REPRESENTATION('',(#{made.brep}),#{context})")
    source = made.add(f"REPRESENTATION_MAP(#{made.axes(0.0)},#{other})")
    made.item(f"MAPPED_ITEM('',#{source},#{made.axes(90.0)})", 1000.0)
    KINDS["SWEPT_DISK_SOLID"](made, 50.0)
    assert not complaint(made, only(read_in(made.write(path))))


def test_a_tree_without_end_is_named(tmp_path: Path, read_in: ReadIn) -> None:
    """2**30 bodies in thirty lines, and one that holds itself."""
    path = tmp_path / "part.step"
    made = begun(path)
    last = made.add(f"BLOCK('',#{made.axes(50.0)},1.,1.,1.)")
    for _ in range(30):
        last = made.add(f"BOOLEAN_RESULT('',.UNION.,#{last},#{last})")
    made.item(f"CSG_SOLID('deep',#{last})", None)
    made.item(f"CSG_SOLID('itself',#{made.first + len(made.lines)})", None)
    assert not complaint(made, only(read_in(made.write(path))))


def open_box(at: float, size: float, missing: int = 1) -> Any:
    """A box as a shell without some of its faces."""
    builder, shell = BRep_Builder(), TopoDS_Shell()
    builder.MakeShell(shell)
    for face in occt.faces_of(BRepPrimAPI_MakeBox(gp_Pnt(at, 0, 0), size, size, size).Shape())[missing:]:
        builder.Add(shell, face)
    return shell


@pytest.mark.parametrize(
    ("surface", "said"),
    [
        (open_box(50, 4), True),
        (open_box(50, 0.5), False),  # a small one: a symbol beside the part
        (open_box(50, 4, 5), False),  # one flat face, a label
        (open_box(2, 4), False),  # within the cube: the skin of a thread or an engraving
    ],
    ids=["a body without a lid", "small", "flat", "within"],
)
def test_open_surfaces_beside_a_solid(
    surface: Any, said: bool, step_part: Any, read_in: ReadIn, codes_of: Any
) -> None:
    """They are a body with a hole, or a decoration: what they would enclose decides."""
    builder, both = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(both)
    builder.Add(both, BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 0), 10, 10, 10).Shape())
    builder.Add(both, surface)
    part = only(read_in(step_part(both)))
    assert part.volume_m3 == pytest.approx(1e-6)
    assert (GeometryCode.BODY_MISSING in codes_of(part)) == said


@pytest.mark.parametrize("beside", [False, True])
def test_an_open_surface_of_triangles_beside_a_solid(
    beside: bool, tmp_path: Path, read_in: ReadIn, codes_of: Any
) -> None:
    """A tetrahedron without one side, alone and beside a surface of exact faces."""
    path = tmp_path / "part.step"
    made = begun(path)
    points = made.add("COORDINATES_LIST('',4,((50.,0.,0.),(56.,0.,0.),(50.,6.,0.),(50.,0.,6.)))")
    triangles = "((1,3,2),(1,2,4),(1,4,3))"
    face = made.add(f"TRIANGULATED_FACE('',#{points},4,((0.,0.,1.)),$,(1,2,3,4),{triangles})")
    made.item(f"TESSELLATED_SHELL('t',(#{face}),$)", 0.0)
    if beside:
        shell = made.add(f"OPEN_SHELL('',({','.join(made.faces[:2])}))")
        made.item(f"SHELL_BASED_SURFACE_MODEL('s',(#{shell}))", 0.0)
    part = only(read_in(made.write(path)))
    assert part.volume_m3 == pytest.approx(1e-6)
    assert GeometryCode.BODY_MISSING in codes_of(part)


STYLE, LAYER = "STYLED_ITEM('',(),#{})", "PRESENTATION_LAYER_ASSIGNMENT('','',(#{}))"
IN_ONE_PLACE = "CONTEXT_DEPENDENT_OVER_RIDING_STYLED_ITEM('',(),#{},$,())"


@pytest.mark.parametrize("over", [(STYLE,), (LAYER,), (STYLE, LAYER), (IN_ONE_PLACE,), ()])
def test_what_the_file_hides_is_counted_and_noted(
    over: tuple[str, ...], tmp_path: Path, read_in: ReadIn, codes_of: Any
) -> None:
    """INVISIBILITY of a body itself, of its style, its layer, its style's layer, or in one place."""
    path = tmp_path / "part.step"
    made = begun(path)
    body = KINDS["BLOCK"](made, 50.0)
    hidden = body
    for entity in over:
        hidden = made.add(entity.format(hidden))
    made.add(f"INVISIBILITY((#{hidden}))")
    part = only(read_in(made.write(path)))
    assert codes_of(part) == [GeometryCode.HIDDEN]
    assert part.volume_m3 == pytest.approx(1.006e-6)


def test_a_shape_that_the_file_hides_hides_its_bodies(tmp_path: Path, read_in: ReadIn, codes_of: Any) -> None:
    """INVISIBILITY of the whole representation."""
    path = begun(tmp_path / "part.step").write(tmp_path / "part.step")
    text = path.read_text("ascii")
    shape = re.search(r"#(\d+) = ADVANCED_BREP_SHAPE_REPRESENTATION", text)
    assert shape is not None
    hiding = f"#99999 = INVISIBILITY((#{shape[1]}));\nENDSEC;\nEND-ISO"
    path.write_text(text.replace("ENDSEC;\nEND-ISO", hiding), "ascii")
    assert codes_of(only(read_in(path))) == [GeometryCode.HIDDEN]


def test_a_body_of_no_product_is_named(tmp_path: Path, read_in: ReadIn, codes_of: Any) -> None:
    """Its representation hangs on nothing, so the kernel never sees it."""
    path = tmp_path / "part.step"
    made = begun(path)
    body = made.add(f"BLOCK('lost',#{made.axes(50.0)},1.,1.,1.)")
    context = made.add("( GEOMETRIC_REPRESENTATION_CONTEXT(3) REPRESENTATION_CONTEXT('','') )")
    made.add(f"SHAPE_REPRESENTATION('',(#{body}),#{context})")
    assembly = read_in(made.write(path))
    assert codes_of(assembly) == [GeometryCode.BODY_MISSING]
    assert f"BLOCK #{body}" in assembly.problems[0].message


def test_a_body_of_an_assembly_itself_is_placed(tmp_path: Path, read_in: ReadIn) -> None:
    """The kernel gives the assembly no shape of its own; its primitive is made, and counts."""
    document = StepDocument()
    top = document.assembly("top")
    document.place(top, document.part(BRepPrimAPI_MakeBox(10, 10, 10).Shape(), "p"), trsf_of((50, 0, 0)), "i")
    path = document.write(tmp_path / "top.step")
    made = Bodies()
    block = made.add(f"BLOCK('b',#{made.axes(90.0)},1.,2.,3.)")
    text = path.read_text("ascii").replace(
        " SHAPE_REPRESENTATION('',(", f" SHAPE_REPRESENTATION('',(#{block},", 1
    )
    text = text.replace("ENDSEC;\nEND-ISO", "\n".join([*made.lines, "ENDSEC;\nEND-ISO"]))
    path.write_text(text, "ascii")
    assembly = read_in(path)
    volumes = sorted(assembly.prototypes[one.prototype].volume_m3 for one in assembly.instances)
    assert volumes == pytest.approx([6e-9, 1e-6])


@pytest.mark.parametrize("lost", ["SWEPT_DISK_SOLID", "BLOCK of no product", ""])
def test_bodies_are_counted_where_positions_mean_nothing(
    lost: str, tmp_path: Path, read_in: ReadIn, codes_of: Any
) -> None:
    """A name looks like an entity, so that ours are not numbered as the kernel's are."""
    path = tmp_path / "part.step"
    made = begun(path)
    if lost == "SWEPT_DISK_SOLID":
        KINDS[lost](made, 50.0)
    elif lost:
        made.add(f"BLOCK('b',#{made.axes(50.0)},1.,2.,3.)")
    text = made.write(path).read_text("ascii")
    path.write_text(text.replace("PRODUCT('part','part'", "PRODUCT('part','#1=X(part'"), "ascii")
    assembly = read_in(path)
    assert only(assembly).volume_m3 == pytest.approx(1e-6)
    assert (GeometryCode.BODY_MISSING in codes_of(assembly)) == bool(lost)


OTHER_FORMS = {
    "another kind of definition": (r"= PRODUCT_DEFINITION\(", "= PRODUCT_DEFINITION_OCCURRENCE("),
    "a complex definition": (
        r"= PRODUCT_DEFINITION\(('[^)]*)\)",
        r"= ( CHARACTERIZED_OBJECT('','') PRODUCT_DEFINITION(\1) )",
    ),
    "a complex representation": (
        r"= ADVANCED_BREP_SHAPE_REPRESENTATION\(('',\([^)]*\),#\d+)\)",
        r"= ( ADVANCED_BREP_SHAPE_REPRESENTATION() REPRESENTATION(\1) SHAPE_REPRESENTATION() )",
    ),
    "no definition": (r"#\d+ = SHAPE_DEFINITION_REPRESENTATION[^;]*;", ""),
}


@pytest.mark.parametrize("form", OTHER_FORMS)
def test_a_product_that_the_kernel_passes_over_is_named(
    form: str, tmp_path: Path, read_in: ReadIn, codes_of: Any
) -> None:
    """Beside another product, which is read: whatever keeps a body from its product, the body is named."""
    document = StepDocument()
    for size in (10.0, 20.0):
        document.part(BRepPrimAPI_MakeBox(size, 10, 10).Shape(), f"p{size:g}")
    path = document.write(tmp_path / "two.step")
    text, count = re.subn(*OTHER_FORMS[form], path.read_text("ascii"), count=1)
    assert count == 1
    path.write_text(text, "ascii")
    assembly = read_in(path)
    assert only(assembly).volume_m3 in (pytest.approx(1e-6), pytest.approx(2e-6))
    assert codes_of(assembly) == [GeometryCode.BODY_MISSING]
    assert "MANIFOLD_SOLID_BREP" in assembly.problems[0].message


@pytest.mark.parametrize(
    "form", ["", "GLOBAL_UNIT_ASSIGNED_CONTEXT(())", "GLOBAL_UNIT_ASSIGNED_CONTEXT((#{}))"]
)
@pytest.mark.parametrize("other", [True, False])
def test_a_file_without_a_unit_of_length(
    form: str, other: bool, tmp_path: Path, read_in: ReadIn, codes_of: Any
) -> None:
    """No units, none of length, or one that nobody knows; said also if another product has one."""
    path = tmp_path / "part.step"
    made = begun(path)
    parsec = made.add("( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT($,.PARSEC.) )")
    path = made.write(path)
    text = path.read_text("ascii")
    assigned = re.search(r"GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\([^)]*\)\)", text)
    assert assigned is not None
    text = text.replace(assigned[0], form.format(parsec))
    if other:  # a context of another representation states one
        unit = (
            f"#99999 = ( GEOMETRIC_REPRESENTATION_CONTEXT(3) {assigned[0]} REPRESENTATION_CONTEXT('','') );\n"
        )
        text = text.replace("ENDSEC;\nEND-ISO", unit + "ENDSEC;\nEND-ISO")
    path.write_text(text, "ascii")
    assembly = read_in(path)
    assert only(assembly).volume_m3 == pytest.approx(1e-6 if "#" not in form else 1e3)
    assert GeometryCode.UNITS in codes_of(assembly)


def test_an_assembly_without_a_unit_of_length(tmp_path: Path, read_in: ReadIn, codes_of: Any) -> None:
    """The kernel reads none of its bodies; the cause is named beside each missing one."""
    document = StepDocument()
    top = document.assembly("top")
    for size in (10.0, 20.0):
        document.place(top, document.part(BRepPrimAPI_MakeBox(size, 10, 10).Shape(), f"p{size:g}"))
    path = document.write(tmp_path / "top.step")
    text = re.sub(r"GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\s*\([^)]*\)\)", "", path.read_text("ascii"))
    path.write_text(text, "ascii")
    assembly = read_in(path)
    (words,) = (p.message for p in assembly.problems if p.code == GeometryCode.UNITS)
    assert "“p10”, “p20”" in words
    assert ("mm are taken" in words) == all(p.volume_m3 for p in assembly.prototypes.values())
