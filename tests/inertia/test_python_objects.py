# SPDX-License-Identifier: LGPL-2.1-or-later
"""The objects that a Python user gets, as users of trimesh would expect them, and the spec's names."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from bodies import box, placement

import silo.inertia as inertia
from silo.bom.errors import InputError
from silo.inertia import MATERIAL_DENSITIES, EnhancedInertiaCalculator, InertiaCalculator, MassProps

Fixture = Callable[..., Any]
ARM = Path(__file__).parents[2] / "examples" / "arm"


@pytest.fixture(name="report")
def _report(assemble: Fixture, compute: Fixture) -> Any:
    return compute(
        assemble(
            ("base/a", box("a", 0.1, 0.2, 0.3), placement((0.1, 0, 0))),
            ("arm/<b>", box("<b>", 0.3, 0.1, 0.05), placement((0, 1, 2))),
        ),
        "Name,Mass\na,2 kg\n<b>,0.5 kg\n",
    )


def test_a_link_has_what_trimesh_calls_it(report: Any) -> None:
    """The same numbers as trimesh's own mass properties of the same box."""
    body = report.bodies["base"]
    mesh = trimesh.creation.box((0.1, 0.2, 0.3))
    corner = box("a", 0.1, 0.2, 0.3).com_m + np.array([0.1, 0, 0])
    mesh.apply_translation(corner)
    mesh.density = 2 / mesh.volume
    assert body.mass == pytest.approx(mesh.mass)
    np.testing.assert_allclose(body.center_mass, mesh.center_mass, atol=1e-12)
    np.testing.assert_allclose(body.moment_inertia, mesh.moment_inertia, atol=1e-12)
    np.testing.assert_allclose(
        np.sort(body.principal_inertia_components), np.sort(mesh.principal_inertia_components), atol=1e-12
    )
    axes, moments = body.principal_inertia_vectors, body.principal_inertia_components
    np.testing.assert_allclose(axes.T @ np.diag(moments) @ axes, body.moment_inertia, atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1)


def test_bodies_add_up_to_the_whole(report: Any) -> None:
    """With + and with sum(), in one frame."""
    whole = sum(report.bodies.values())
    assert isinstance(whole, MassProps)
    assert whole.frame == report.total.frame == "assembly frame"
    assert whole.mass == pytest.approx(report.total.mass)
    np.testing.assert_allclose(whole.moment_inertia, report.total.moment_inertia, rtol=1e-12, atol=1e-15)
    moved = whole.transformed(placement((1, 2, 3)))
    np.testing.assert_allclose(moved.center_mass, whole.center_mass + np.array([1, 2, 3]))
    with pytest.raises(TypeError):
        whole + 1


def test_bodies_of_two_frames_are_not_added() -> None:
    """Each link's own numbers added as they are would be wrong in silence."""
    report = inertia.compute_link_inertials(ARM / "arm.step", ARM / "bom.csv", frame="own")
    with pytest.raises(InputError, match="two frames"):
        sum(report.bodies.values())
    moved = [link.props.transformed(link.frame.placement) for link in report.links.values()]
    assert report.total is not None
    np.testing.assert_allclose(sum(moved).moment_inertia, report.total.moment_inertia, rtol=1e-9)  # type: ignore[union-attr]


def test_what_a_person_sees(report: Any) -> None:
    """One line."""
    assert repr(report.bodies["base"]).startswith("MassProps(mass=2 kg, com=[")
    assert "frame='assembly frame'" in repr(report.bodies["base"])
    assert "not finite" in repr(MassProps(1, [0, 0, 0], np.full((3, 3), np.nan)))
    assert repr(report) == "InertiaReport('asm': 2 links, 2.5 kg, 3 warnings)"


def test_the_names_of_the_spec() -> None:
    """bom-inertia: the calculator, and the table of densities as plain values."""
    assert EnhancedInertiaCalculator is InertiaCalculator
    assert MATERIAL_DENSITIES["steel"] == 7850
    assert MATERIAL_DENSITIES["aluminium"] == MATERIAL_DENSITIES["aluminum"] == 2700
    assert MATERIAL_DENSITIES["ppa-cf"] == 1400
    assert MATERIAL_DENSITIES["default"] == 1000
    assert all(1 <= value < 25_000 for value in MATERIAL_DENSITIES.values())
    assert set(inertia.__all__) == set(inertia._HOME)


def test_copies_are_equal_and_read_only(report: Any) -> None:
    """By pickle (other processes) and by copy; equal means every number and the frame."""
    body = report.bodies["arm"]
    for other in (pickle.loads(pickle.dumps(body)), copy.deepcopy(body), copy.copy(body)):
        assert (other, hash(other)) == (body, hash(body))
        assert not any(array.flags.writeable for array in (other.com, other.inertia))
    assert pickle.loads(pickle.dumps(report)).bodies == report.bodies
    for name, value in (
        ("mass", 9),
        ("com", np.array([0, 0, 9])),
        ("inertia", np.eye(3)),
        ("frame", "x"),
    ):
        assert replace(body, **{name: value}) != body
    assert body != "arm"


@pytest.mark.parametrize("density", [0, -1000, float("nan"), float("inf"), 7.85, 1e30])
def test_a_default_density_that_no_solid_has_is_refused(density: float) -> None:
    """7.85 is steel in g/cm³, and would make a robot of aerogel."""
    with pytest.raises(InputError, match="wanted a default density from 25 to 23000"):
        inertia.compute_link_inertials(ARM / "arm.step", density=density)


def test_a_bom_that_was_read_before_is_taken() -> None:
    """So that the parser's options (columns, units) reach the one call."""
    table = inertia.BOMParser(decimal=".").parse(ARM / "bom.csv")
    one, two = (inertia.compute_link_inertials(ARM / "arm.step", bom) for bom in (table, ARM / "bom.csv"))
    assert one.bodies == two.bodies
    assert one.bom == two.bom


def test_what_is_no_placement_is_refused(report: Any) -> None:
    for bad in ("x", None, np.eye(3), np.zeros((4, 4)), [[1, 2], [3]]):
        with pytest.raises(InputError, match="a placement"):
            report.bodies["arm"].transformed(bad)
