# SPDX-License-Identifier: LGPL-2.1-or-later
"""Cases 4, 5, 7, 9, 10, 12 and 13 of inertia-facts §9, from file to mass.

The files that showed them first are not among the public test data. Each test makes one of its own with the
same trait, which its docstring names, and goes the whole way: geometry, BOM, mass, centre, warnings.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from OCP import collections
from OCP.BRep import BRep_Builder
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakePrism
from OCP.BRepTools import BRepTools
from OCP.gp import gp_Pnt, gp_Vec
from OCP.TopoDS import TopoDS_Compound
from step_writer import trsf_of

from silo.inertia.codes import Decided, Rule
from silo.inertia.notes import GeometryCode

Fixture = Callable[..., Any]
HEAD = "Item,Quantity,Part number,Material,Mass,Name\n"


def box(x: float, y: float, z: float, at: tuple[float, float, float] = (0, 0, 0)) -> Any:
    """A box [mm] with one corner at ``at``."""
    return BRepPrimAPI_MakeBox(gp_Pnt(*at), x, y, z).Shape()


def together(*shapes: Any) -> Any:
    """Several shapes as one."""
    builder, compound = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(compound)
    for shape in shapes:
        builder.Add(compound, shape)
    return compound


def line() -> Any:
    """A wire of one edge."""
    edge = BRepBuilderAPI_MakeEdge(gp_Pnt(0, 0, 0), gp_Pnt(5, 0, 0)).Edge()
    return BRepBuilderAPI_MakeWire(edge).Wire()


def masses(report: Any) -> dict[str, float]:
    return {part.name: part.mass for _, part in report.parts()}


def test_case_04_solid_and_wire_leaves_in_inches(
    step: Fixture, tmp_path: Path, pipeline: Fixture, codes: Fixture
) -> None:
    """Stand-in for as1_pe_203: inches, each product a SOLID beside a wire COMPOUND, two leaves for one part.

    Eighteen parts stay eighteen, named by what holds the leaves, and the BOM's quantities fit.
    """
    document = step()
    top = document.assembly("as1")
    products = {
        name: document.part(together(box(25.4 * size, 25.4, 25.4), line()), name)
        for name, size in (("plate", 4), ("bolt", 1), ("nut", 2))
    }
    for name, count in (("plate", 1), ("bolt", 8), ("nut", 9)):
        for number in range(count):
            document.place(top, products[name], trsf_of((100 * number, 0, 0)), f"{name}_{number}")
    path = document.write(tmp_path / "as1_pe.step", "INCH")
    rows = "1,1,,steel,,plate\n2,8,,,0.0500 kg,bolt\n3,9,,aluminum,,nut\n"
    report = pipeline(path, HEAD + rows)
    inch = 0.0254**3
    assert masses(report) == pytest.approx(
        {"plate": 4 * inch * 7850, "bolt": 0.05, "nut": 2 * inch * 2700}, rel=1e-9
    )
    assert sum(part.quantity for _, part in report.parts()) == 18
    assert report.total.mass == pytest.approx(4 * inch * 7850 + 8 * 0.05 + 18 * inch * 2700, rel=1e-9)
    assert codes(report) == []


def test_case_05_instances_are_called_otherwise_than_their_products(
    step: Fixture, tmp_path: Path, pipeline: Fixture, codes: Fixture
) -> None:
    """Stand-in for openplm_test2: the instance of "L-BRACKET" is called "NUT" and the other way round.

    The BOM is about products: each gets its own row, whatever its instances are called.
    """
    document = step()
    top = document.assembly("top")
    document.place(top, document.part(box(10, 10, 10), "L-BRACKET"), name="NUT")
    document.place(top, document.part(box(20, 20, 20), "NUT"), name="L-BRACKET")
    report = pipeline(
        document.write(tmp_path / "names.step"), HEAD + "1,1,,steel,,L-BRACKET\n2,1,,aluminum,,NUT\n"
    )
    assert masses(report) == pytest.approx({"L-BRACKET": 0.00785, "NUT": 0.0216}, rel=1e-9)
    assert {part.paths[0]: part.name for _, part in report.parts()} == {
        "NUT": "L-BRACKET",
        "L-BRACKET": "NUT",
    }
    assert codes(report) == []


def test_case_07_three_solids_a_void_and_the_next_part(
    step: Fixture, tmp_path: Path, pipeline: Fixture, codes: Fixture
) -> None:
    """As multisolid.step of the survey: 0.3 kg over three solids, a hollow part of 0.2 kg, 0.1 kg after it.

    0.6 kg in all. Solids taken one by one shift the names: the hollow part's mass lands on a cube.
    """
    document = step()
    top = document.assembly("top")
    cubes = [box(20, 20, 20, (40 * k, 0, 0)) for k in range(3)]
    hollow = BRepAlgoAPI_Cut(box(40, 40, 40), box(20, 20, 20, (10, 10, 10))).Shape()
    document.place(top, document.part(together(*cubes), "multi"), name="multi")
    document.place(top, document.part(hollow, "hollow"), trsf_of((0, 100, 0)), "hollow")
    document.place(top, document.part(box(20, 20, 20), "after"), trsf_of((0, 200, 0)), "after")
    rows = "1,1,,,0.300 kg,multi\n2,1,,,0.200 kg,hollow\n3,1,,,0.100 kg,after\n"
    report = pipeline(document.write(tmp_path / "multisolid.step"), HEAD + rows)
    assert masses(report) == {"multi": 0.3, "hollow": 0.2, "after": 0.1}
    assert report.total.mass == pytest.approx(0.6)
    centres = np.array([[0.05, 0.01, 0.01], [0.02, 0.12, 0.02], [0.01, 0.21, 0.01]])
    wanted = np.array([0.3, 0.2, 0.1]) @ centres / 0.6
    np.testing.assert_allclose(report.total.com, wanted, atol=1e-12)
    assert codes(report) == []


def test_case_09_a_part_that_is_inside_out(
    tmp_path: Path, pipeline: Fixture, part: Fixture, codes: Fixture
) -> None:
    """Stand-in for the negative part of the quadruped: a solid whose faces all look inwards.

    The kernel's volume is negative, and every peer takes a negative mass. Here it is turned, and reported.
    """
    path = tmp_path / "perna.brep"
    assert BRepTools.Write_s(box(10, 20, 30).Reversed(), str(path))
    report = pipeline(path, HEAD + "1,1,,steel,,perna\n")
    assert part(report, "perna").mass == pytest.approx(6e-6 * 7850, rel=1e-9)
    assert np.linalg.eigvalsh(report.total.inertia).min() > 0
    assert codes(report) == [GeometryCode.NEGATIVE_VOLUME]


def test_case_09_thirteen_parts_of_one_name(
    step: Fixture, tmp_path: Path, pipeline: Fixture, codes: Fixture
) -> None:
    """Stand-in for the names of the quadruped: thirteen products "Peça", and a servo whose "™" became "?".

    The quantities tell eleven of the thirteen apart; two share one, and their materials decide.
    """
    document = step()
    top = document.assembly("quadrupede")
    counts = [*range(1, 12), 12, 12]
    rows, expected = [], 0.0
    for number, count in enumerate(counts):
        product = document.part(box(10 + number, 10, 10), "Peça")
        for copy in range(count):
            document.place(top, product, trsf_of((0, 100 * number, 50 * copy)), "Peça")
        density, material = (7850, "Steel") if number == 12 else (1250, "PLA")
        mass = round((10 + number) * 1e-7 * density, 9)
        expected += count * mass
        rows.append(f"{number},{count},,{material},{mass:.9f} kg,Peça")
    document.place(top, document.part(box(20, 20, 40), "MG996R? servo"), name="MG996R? servo")
    rows.append("20,1,,,0.055000000 kg,MG996R™ servo")
    report = pipeline(document.write(tmp_path / "quadruped.step"), HEAD + "\n".join(reversed(rows)) + "\n")
    assert report.total.mass == pytest.approx(expected + 0.055, rel=1e-9)
    parts = [part for _, part in report.parts()]
    assert sorted(p.quantity for p in parts if p.name == "Peça") == counts
    assert all(p.mass == pytest.approx(p.volume * (7850 if p.material == "Steel" else 1250), rel=1e-6)
               for p in parts if p.name == "Peça")  # fmt: skip
    assert {p.decided_by for p in parts} <= {Decided.QUANTITY, Decided.MASS, Decided.REMAINING, Decided.ONLY}
    (servo,) = [p for p in parts if p.name.startswith("MG996R")]
    assert (servo.rule, servo.mass) == (Rule.WILDCARD, 0.055)
    assert set(codes(report)) == {"bom_duplicate_name", GeometryCode.NAME}


def test_case_10_an_invalid_gear_is_never_taken_in_silence(
    step: Fixture, tmp_path: Path, pipeline: Fixture, codes: Fixture, part: Fixture
) -> None:
    """Stand-in for Thor's gears: an outline that crosses itself, so that one lobe is inside out.

    The kernel integrates it without a complaint and to another number with each tolerance. By material the
    mass is doubted aloud, and it is not written to the server; a BOM mass stands.
    """
    path = step_of(step, tmp_path, "Art1GearMotor", crossed_prism())
    by_material = pipeline(path, HEAD + "1,1,G-1,steel,,Art1GearMotor\n")
    doubts = {GeometryCode.INVALID_SHAPE, GeometryCode.MESH_MISMATCH, GeometryCode.NOT_CONVERGENT}
    assert doubts & set(codes(by_material, "Art1GearMotor"))
    from silo.inertia.push import plan_push

    assert "in doubt" in plan_push(by_material).skipped[0].reason
    weighed = pipeline(path, HEAD + "1,1,G-1,,0.040 kg,Art1GearMotor\n")
    assert part(weighed, "Art1GearMotor").mass == 0.04
    assert doubts & set(codes(weighed, "Art1GearMotor"))


def test_case_10_an_integration_that_does_not_settle_is_reported(
    tmp_path: Path, pipeline: Fixture, codes: Fixture
) -> None:
    """Stand-in for Thor's other gear: free-form faces so wild that the kernel's integration gives up."""
    path = tmp_path / "Art2MotorGear.brep"
    assert BRepTools.Write_s(wild_prism(), str(path))
    report = pipeline(path, HEAD + "1,1,,steel,,Art2MotorGear\n")
    assert GeometryCode.NOT_CONVERGENT in codes(report)
    (told,) = [w for w in report.warnings if w.code == GeometryCode.NOT_CONVERGENT]
    assert re.search(r"relative error of \d", told.message)


def step_of(step: Fixture, folder: Path, name: str, shape: Any) -> Path:
    document = step()
    document.part(shape, name)
    path: Path = document.write(folder / f"{name}.step")
    return path


def array_of_points(points: np.ndarray[Any, Any]) -> Any:
    """(n, 3) or (n, m, 3) [mm] as an array of the kernel."""
    size, kind = points.shape[:-1], points.ndim - 1
    array = getattr(collections, f"Array{kind}_gp_Pnt")(*(bound for n in size for bound in (1, n)))
    for index in np.ndindex(*size):
        array.SetValue(*(i + 1 for i in index), gp_Pnt(*(float(v) for v in points[index])))
    return array


def crossed_prism() -> Any:
    """A prism on a closed free-form outline in the form of an 8."""
    from OCP.GeomAPI import GeomAPI_PointsToBSpline

    turns = np.linspace(0, 2 * np.pi, 25)
    size = 1 + 0.1 * (np.cos(turns) > 0)
    points = np.stack([20 * np.cos(turns) * size, 10 * np.sin(2 * turns) * size, 0 * turns], axis=1)
    edge = BRepBuilderAPI_MakeEdge(GeomAPI_PointsToBSpline(array_of_points(points)).Curve()).Edge()
    face = BRepBuilderAPI_MakeFace(BRepBuilderAPI_MakeWire(edge).Wire(), True).Face()
    return BRepPrimAPI_MakePrism(face, gp_Vec(0, 0, 10)).Shape()


def wild_prism() -> Any:
    """A prism on a surface through random heights: it overshoots by kilometres between them."""
    from OCP.GeomAPI import GeomAPI_PointsToBSplineSurface

    count = 20
    heights = 30 + 30 * np.random.default_rng(0).uniform(-1, 1, (count, count))
    grid = np.stack([*np.meshgrid(np.arange(count), np.arange(count), indexing="ij"), heights], axis=2)
    surface = GeomAPI_PointsToBSplineSurface(array_of_points(grid)).Surface()
    return BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(surface, 1e-6).Face(), gp_Vec(0, 0, -60)).Shape()
