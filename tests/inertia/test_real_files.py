# SPDX-License-Identifier: LGPL-2.1-or-later
"""Public STEP files end to end: BOMs made for them give exactly their sums, and gaps are reported."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from typing import Any

import pytest

from silo.inertia.assembly import Assembly
from silo.inertia.codes import Source
from silo.inertia.masses import Options
from silo.inertia.notes import GeometryCode
from silo.inertia.output.accepted import writable
from silo.inertia.output.snippets import snippets
from silo.inertia.products import leaf_products

Fixture = Callable[..., Any]
Real = Callable[[str], Assembly]
FILES = (
    "as1-oc-214.stp",
    "asm4_bearing.stp",
    "dm1-id-214.stp",
    "io1-cm-214.stp",
    "mayo_cube.step",
    "odri_foot.step",
    "odri_motor.step",
    "so101_base.step",
    "so101_wrist_roll_pitch.step",
    "trimesh_featuretype.step",
)


def bom_of(assembly: Assembly, mass: Callable[[int], float]) -> tuple[str, float]:
    """A BOM with one row per product name, in Onshape's shape, and the mass of everything."""
    counts: dict[str, int] = {}
    for product in leaf_products(assembly):
        counts[product.name] = counts.get(product.name, 0) + product.count
    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow(["Item", "Quantity", "Part number", "Description", "Material", "Mass", "Name"])
    total = 0.0
    for number, (name, count) in enumerate(counts.items(), start=1):
        writer.writerow([number, count, "", "", "- None -", f"{mass(number):.6f} kg", name])
        total += count * mass(number)
    return out.getvalue(), total


@pytest.mark.parametrize("name", FILES)
def test_a_complete_bom_gives_exactly_its_sum(real: Real, compute: Fixture, name: str) -> None:
    """Every product finds its row by its exact name; the masses add up, and every link is a real body."""
    assembly = real(name)
    text, total = bom_of(assembly, lambda number: 0.1 + 0.01 * number)
    report = compute(assembly, text)
    assert report.total.mass == pytest.approx(total, rel=1e-12)
    assert {part.source for _, part in report.parts()} == {Source.BOM_MASS}
    matching = {"not_in_bom", "row_unused", "count_differs", "ambiguous", "no_mass_no_material"}
    assert matching.isdisjoint({str(w.code) for w in report.warnings})
    for link in report.links.values():
        assert not link.problems, (link.name, link.problems)


@pytest.mark.parametrize("name", FILES)
def test_case_42_all_of_steel(real: Real, compute: Fixture, name: str) -> None:
    """The mass is 7850 times the volume; what has no solid is reported; MuJoCo takes each link as it is."""
    assembly = real(name)
    text, _ = bom_of(assembly, lambda number: 0.0)
    report = compute(assembly, text.replace("- None -,0.000000 kg", "Steel,No value"))
    volume = sum(assembly.prototypes[i.prototype].volume_m3 for i in assembly.instances)
    assert report.total.mass == pytest.approx(7850 * volume, rel=1e-9)
    empty = {p.name for p in assembly.prototypes.values() if not p.volume_m3}
    assert {w.part_name for w in report.warnings if w.code == "no_volume"} == empty
    links = writable(report.links.values())
    assert set(links) == {link.name for link in report.links.values() if link.props.mass > 0}
    mujoco = pytest.importorskip("mujoco")
    bodies = snippets(links, "mjcf").replace("<inertial", "<freejoint/><inertial")
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
    masses = {model.body(i).name: model.body_mass[i] for i in range(1, model.nbody)}
    assert masses == pytest.approx({link: props.mass for link, props in links.items()}, rel=1e-12)


@pytest.mark.parametrize("name", FILES)
def test_an_empty_bom_warns_of_every_part(real: Real, compute: Fixture, name: str) -> None:
    """No part has a mass that nobody gave it without a word."""
    assembly = real(name)
    report = compute(assembly, "Name,Material,Mass\n")
    warned = {(w.link_name, w.part_name) for w in report.warnings if w.code == "not_in_bom"}
    assert warned == {(link, part.name) for link, part in report.parts()}


def test_case_11_fourteen_balls_share_one_row(real: Real, compute: Fixture) -> None:
    """asm4_bearing: sixteen products, fourteen of them "Ball": one row of 14 pieces is right for all."""
    assembly = real("asm4_bearing.stp")
    assert len(assembly.prototypes) == 16
    report = compute(
        assembly, "Name,Quantity,Material,Mass\nBall,14,Steel,\nOuter_Ring,1,Steel,\nInner_Ring,1,Steel,\n"
    )
    assert report.warnings == []
    balls = [part for _, part in report.parts() if part.name == "Ball"]
    assert [part.quantity for part in balls] == [14]
    wrong = compute(assembly, "Name,Quantity,Material,Mass\nBall,12,Steel,\n")
    assert "count_differs" in {str(w.code) for w in wrong.warnings}


def test_case_13_geometry_that_is_elsewhere(real: Real, compute: Fixture) -> None:
    """so101_wrist: a product whose geometry the file lacks. Its BOM mass is a point, flagged."""
    assembly = real("so101_wrist_roll_pitch.step")
    report = compute(
        assembly,
        "Name,Quantity,Material,Mass\nWiring_holder v1,1,,0.002000 kg\nWrist_Roll_Pitch_SO101 v2,1,ABS,\n",
    )
    codes = {(w.part_name, str(w.code)) for w in report.warnings}
    assert ("Wiring_holder v1", "point_mass") in codes
    assert ("Wiring_holder v1", GeometryCode.NO_GEOMETRY) in codes
    assert report.total.mass == pytest.approx(
        0.002 + 1050 * sum(p.volume_m3 for p in assembly.prototypes.values())
    )


def test_densities_of_the_file_are_used_when_asked(real: Real, compute: Fixture) -> None:
    """dm1 states densities in lb/in³; so101_base names ABS with 1060 kg/m³."""
    for name in ("dm1-id-214.stp", "so101_base.step"):
        assembly = real(name)
        report = compute(assembly, None, options=Options(1000.0, step_density=True))
        expected = sum(
            (assembly.prototypes[i.prototype].step_density or 0) * assembly.prototypes[i.prototype].volume_m3
            for i in assembly.instances
        )
        assert report.total.mass == pytest.approx(expected, rel=1e-12)
        assert {part.source for _, part in report.parts()} == {Source.STEP_DENSITY}
        assert report.warnings == []
