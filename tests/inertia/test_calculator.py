# SPDX-License-Identifier: LGPL-2.1-or-later
"""The spec's facade on a real STEP file (the example arm, whose dimensions are known)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from silo.inertia import (
    BOMEntry,
    BOMParser,
    InertiaCalculator,
    InertiaReport,
    compute_link_inertials,
)
from silo.inertia.rigid import combine

ARM = Path(__file__).parents[2] / "examples" / "arm"


def test_compute_from_step_is_the_whole_at_one_density() -> None:
    """Twice the density, twice the mass and tensor, the same centre."""
    one = InertiaCalculator().compute_from_step(ARM / "arm.step")
    two = InertiaCalculator(default_density=2000.0).compute_from_step(str(ARM / "arm.step"))
    light = compute_link_inertials(ARM / "arm.step", density=500.0)
    assert light.total is not None
    assert light.total.mass == pytest.approx(one.mass / 2)
    assert {str(w.code) for w in light.warnings} == {"no_bom"}
    assert one.mass > 1
    assert two.mass == pytest.approx(2 * one.mass)
    assert two.ixx == pytest.approx(2 * one.ixx)
    assert two.com == pytest.approx(one.com)


def test_compute_from_step_with_bom_fills_the_report() -> None:
    """Result, link properties and warnings under the link's name."""
    report = InertiaReport()
    bom = BOMParser().parse(ARM / "bom.csv")
    found = InertiaCalculator().compute_from_step_with_bom(ARM / "arm.step", bom, "robot", report)
    assert report.link_properties == {"robot": found}
    assert {w.link_name for w in report.warnings} == {"robot"}
    assert {str(w.code) for w in report.warnings} >= {"row_unused", "no_mass_no_material", "mass_rounded"}


def test_a_plain_dict_will_do() -> None:
    """The spec's Dict[part_name, BOMEntry]: priority mass, material, zero, else the default, told."""
    entries = {
        "Base plate": BOMEntry("Base plate", None, 1.0),
        "Column": BOMEntry("Column", "steel", None),
        "Palm": BOMEntry("Palm", None, None),
    }
    report = InertiaReport()
    for name in ("robot", "another"):  # nothing of an earlier link is lost
        InertiaCalculator().compute_from_step_with_bom(ARM / "arm.step", entries, name, report)
    assert list(report.link_properties) == ["robot", "another"]
    assert {w.link_name for w in report.warnings} == {"robot", "another"}
    parts = {part.name: part for part in report.links["robot"].parts}
    assert parts["Base plate"].mass == 1.0
    assert parts["Column"].mass == pytest.approx(np.pi * (0.045**2 - 0.035**2) * 0.08 * 7850)
    assert parts["Palm"].mass == 0
    told = {(w.part_name, str(w.code)) for w in report.warnings}
    assert ("Palm", "no_mass_no_material") in told
    assert ("Finger", "not_in_bom") in told


def test_compute_link_inertials_sums_up_to_the_whole() -> None:
    """Links by sub-assembly, in the assembly's frame: together they are the assembly."""
    report = compute_link_inertials(ARM / "arm.step", ARM / "bom.csv")
    assert list(report.link_properties) == ["base_link", "upper_arm", "forearm", "gripper"]
    whole = combine([link.props for link in report.links.values()])
    assert [p.mass for p in report.link_properties.values()] == [k.props.mass for k in report.links.values()]
    assert report.total is not None
    assert whole.mass == pytest.approx(report.total.mass)
    assert whole.inertia == pytest.approx(report.total.inertia, rel=1e-12, abs=1e-15)


def test_compute_link_inertials_by_a_map(tmp_path: Path) -> None:
    """The map's file is enough; frames as asked for."""
    path = tmp_path / "map.yaml"
    path.write_text("links:\n  hand: {parts: [gripper], frame: gripper}\n", "utf-8")
    own = compute_link_inertials(ARM / "arm.step", ARM / "bom.csv", links=path)
    plain = compute_link_inertials(ARM / "arm.step", ARM / "bom.csv", frame="own")
    whole = compute_link_inertials(ARM / "arm.step", ARM / "bom.csv", links={"all": ["*"]}, frame="assembly")
    assert whole.total is not None
    assert whole.bodies["all"].mass == pytest.approx(whole.total.mass)
    assert own.link_properties["hand"].com == pytest.approx(plain.link_properties["gripper"].com)
    assert len(own.unclaimed) > 0
