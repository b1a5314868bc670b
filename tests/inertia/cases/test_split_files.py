# SPDX-License-Identifier: LGPL-2.1-or-later
"""Cases 12 and 13 of inertia-facts §9, from files to masses: assemblies whose parts lie in other files.

Stand-in for the koch arms (SolidWorks) and s1-c5-214 (CATIA, nested): the assembly's file holds products and
placements, and no geometry at all; each part is a STEP file of its own, called like its product.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from step_writer import emptied, trsf_of

from silo.inertia.codes import Source
from silo.inertia.notes import GeometryCode
from silo.inertia.rigid import TensorProblem

Fixture = Callable[..., Any]
SIZES = {"upper arm": (10, 10, 100), "hand": (20, 20, 5), "finger": (4, 4, 30)}
BOM = "Quantity,Material,Mass,Name\n2,,0.0270 kg,upper arm\n1,steel,,hand\n4,PLA,,finger\n"


@pytest.fixture(name="koch")
def _koch(step: Fixture, tmp_path: Path) -> Path:
    """koch.STEP: two upper arms, a gripper (a sub-assembly) of a hand and four fingers; parts beside it."""
    document = step()
    top, gripper = document.assembly("koch"), document.assembly("gripper")
    parts = {name: document.part(BRepPrimAPI_MakeBox(*size).Shape(), name) for name, size in SIZES.items()}
    for number in range(2):
        document.place(top, parts["upper arm"], trsf_of((500 * number, 0, 0)), f"upper arm-{number + 1}")
    document.place(gripper, parts["hand"], trsf_of(), "hand-1")
    for number in range(4):
        document.place(gripper, parts["finger"], trsf_of((5 * number, 0, 5)), f"finger-{number + 1}")
    document.place(top, gripper, trsf_of((0, 0, 100)), "gripper-1")
    path = emptied(document.write(tmp_path / "koch.STEP"), *SIZES)
    for name, size in SIZES.items():
        part = step()
        part.part(BRepPrimAPI_MakeBox(*size).Shape(), name)
        part.write(tmp_path / f"{name}.STEP")
    return path


def test_case_12_a_split_assembly_is_completed(
    koch: Path, pipeline: Fixture, codes: Fixture, part: Fixture
) -> None:
    """All parts are found, at every level; masses by the rule; one note says which files were read."""
    report = pipeline(koch, BOM)
    hand, finger = 2e-6 * 7850, 4.8e-7 * 1250
    assert report.total.mass == pytest.approx(2 * 0.027 + hand + 4 * finger, rel=1e-9)
    assert part(report, "finger").quantity == 4
    assert report.links["gripper-1"].props.mass == pytest.approx(hand + 4 * finger, rel=1e-9)
    assert set(codes(report)) == {GeometryCode.EXTERNAL_FILE, "in_root_link"}
    arms = np.array([[0.005, 0.005, 0.05], [0.505, 0.005, 0.05]])
    np.testing.assert_allclose(
        [arms.mean(axis=0)],
        [(report.total.com * report.total.mass - gripper_moment(report)) / 0.054],
        atol=1e-9,
    )


def gripper_moment(report: Any) -> Any:
    """Mass times centre of the gripper [kg m]."""
    props = report.links["gripper-1"].props
    return props.mass * props.com


def test_case_13_without_its_siblings_nothing_is_made_up(
    koch: Path, pipeline: Fixture, codes: Fixture, part: Fixture
) -> None:
    """No geometry: a BOM mass is a point, flagged; a material gives 0 kg, told. Each part says it itself."""
    report = pipeline(koch, BOM, siblings=False)
    assert report.total.mass == pytest.approx(2 * 0.027)
    for name, code in (("upper arm", "point_mass"), ("hand", "no_volume"), ("finger", "no_volume")):
        assert code in codes(report, name)
        assert GeometryCode.NO_GEOMETRY in codes(report, name)
    assert part(report, "hand").source is Source.MATERIAL
    assert TensorProblem.ZERO_MASS in report.links["gripper-1"].problems
    assert "zero_mass_link" in codes(report)


def test_case_13_one_file_is_missing(koch: Path, pipeline: Fixture, codes: Fixture) -> None:
    """The others count; the missing one is named with the file that was looked for."""
    (koch.parent / "finger.STEP").unlink()
    report = pipeline(koch, BOM)
    assert report.total.mass == pytest.approx(2 * 0.027 + 2e-6 * 7850, rel=1e-9)
    assert GeometryCode.NO_GEOMETRY in codes(report, "finger")
    assert "no_volume" in codes(report, "finger")
    assert not {"point_mass", "no_volume"} & set(codes(report, "hand"))
    assert any("finger.STEP" in w.message for w in report.warnings)
