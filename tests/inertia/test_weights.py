# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a scale says of a link or a component: its parts are scaled to it, and the tensor with them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from silo.bom.errors import InputError
from silo.inertia.assembly import Assembly, Instance, Prototype
from silo.inertia.calculation import calculate
from silo.inertia.codes import Source
from silo.inertia.geometry.together import Mesh, mesh_solid
from silo.inertia.masses import Options
from silo.inertia.task import Task

LINKS = {"arm": ["arm"], "base": ["base"]}


def assembly() -> Assembly:
    """An arm of two motors of 1 and 8 cm³ and a rod without volume, and a base of one cube of 1 cm³."""

    def part(key: str, size: float) -> Prototype:
        corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) * size * 6 ** (1 / 3) / 100
        solid = mesh_solid(Mesh(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])))
        return Prototype(key, key, solid.volume_m3, solid.com_m, solid.inertia_unit, bool(solid.volume_m3))

    parts = {key: part(key, size) for key, size in (("small", 1), ("large", 2), ("rod", 0), ("cube", 1))}
    place = [np.eye(4) for _ in range(4)]
    for number, matrix in enumerate(place):
        matrix[0, 3] = number
    instances = (
        Instance(("arm", "small"), ("arm", "small"), "small", place[0]),
        Instance(("arm", "large"), ("arm", "large"), "large", place[1]),
        Instance(("arm", "rod"), ("arm", "rod"), "rod", place[2]),
        Instance(("base", "cube"), ("base", "cube"), "cube", place[3]),
    )
    return Assembly("robot", parts, instances)


def run(weights: dict[str, str], links: Any = None) -> Any:
    """The report at the default density: 1 g, 8 g, 0 g in the arm, 1 g in the base."""
    return calculate(assembly(), None, Task(links=links or LINKS, weights=weights))


def codes(report: Any) -> set[str]:
    """Codes of all warnings."""
    return {str(w.code) for w in report.warnings}


def test_a_link_weighs_what_the_scale_says() -> None:
    """Centre as before, tensor in proportion; the source says so; the other link stays."""
    before, after = run({}), run({"arm": "18 g"})
    assert before.bodies["arm"].mass == pytest.approx(0.009)
    assert after.bodies["arm"].mass == pytest.approx(0.018)
    assert np.allclose(after.bodies["arm"].inertia, 2 * before.bodies["arm"].inertia)
    assert np.allclose(after.bodies["arm"].com, before.bodies["arm"].com)
    assert after.bodies["base"] == before.bodies["base"]
    assert {part.source for part in after.links["arm"].parts} == {Source.TARGET_MASS}
    assert all("arm is 0.018 kg" in part.density_source for part in after.links["arm"].parts)
    assert after.total.mass == pytest.approx(0.019)


def test_a_component_keeps_its_weight_in_a_weighed_link() -> None:
    """The rest of the link shares what is left."""
    report = run({"arm": "0.02", "arm/small": "5 g"})
    masses = {part.name: part.mass for part in report.links["arm"].parts}
    assert masses == pytest.approx({"small": 0.005, "large": 0.015, "rod": 0.0})
    assert run({"product:small": "5 g"}).bodies["arm"].mass == pytest.approx(0.013)


@pytest.mark.parametrize("order", [("arm", "arm/small"), ("arm/small", "arm")])
def test_a_component_keeps_its_weight_in_a_weighed_component(order: tuple[str, str]) -> None:
    """The inner component is weighed first, in whatever order the weights are given."""
    weights = {"arm": "20 g", "arm/small": "5 g"}
    report = run({name: weights[name] for name in order}, {"robot": ["arm", "base"]})
    masses = {part.name: part.mass for part in report.links["robot"].parts}
    assert masses == pytest.approx({"small": 0.005, "large": 0.015, "rod": 0.0, "cube": 0.001})
    assert "target_mass_differs" not in codes(report)


def test_a_part_without_mass_and_volume_gets_its_weight_as_a_point() -> None:
    """A cable that nobody modelled."""
    assert run({"arm/rod": "1 g"}).bodies["arm"].mass == pytest.approx(0.010)


def test_a_map_says_it_too() -> None:
    """Beside the patterns of a link; the command's word comes first."""
    links = {"arm": {"parts": ["arm"], "mass": "27 g"}, "base": ["base"]}
    assert run({}, links).bodies["arm"].mass == pytest.approx(0.027)
    assert run({"arm": "9 g"}, links).bodies["arm"].mass == pytest.approx(0.009)


def test_parts_without_a_mass_share_a_weight_by_volume() -> None:
    """Nobody knows their material: 1 and 8 cm³, and a rod without volume."""
    task = Task(options=Options(unknown_is_zero=True), links=LINKS, weights={"arm": "9 g"})
    report = calculate(assembly(), None, task)
    masses = {part.name: part.mass for part in report.links["arm"].parts}
    assert masses == pytest.approx({"small": 0.001, "large": 0.008, "rod": 0.0})


@pytest.mark.parametrize(
    ("weights", "said"),
    [
        ({"arm": "4 g", "arm/large": "5 g"}, True),  # more in its parts than in the whole
        ({"arm": "5 g", "arm/large": "5 g"}, True),  # nothing is left for the others
        ({"leg": "1 kg"}, True),  # nothing of this name
        ({"base": "4 g", "base/cube": "5 g"}, True),  # all of its parts are weighed
        ({"base": "4 g", "base/cube": "4.1 g"}, False),  # within the doubt of a scale
    ],
)
def test_weights_that_contradict_each_other_are_reported(weights: dict[str, str], said: bool) -> None:
    """What was weighed first counts."""
    assert ("target_mass_differs" in codes(run(weights))) == said


@pytest.mark.parametrize("text", ["heavy", "-1 kg", "0", ""])
def test_what_is_no_mass_is_refused(text: str) -> None:
    """Before anything is computed."""
    with pytest.raises(InputError, match="arm: wanted a mass"):
        run({"arm": text})
