# SPDX-License-Identifier: LGPL-2.1-or-later
"""Cases 36 to 40: sums over parts and links, on whole reports, with an independent oracle."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import trimesh
from bodies import box, cylinder
from hunting import examples
from hypothesis import given, settings
from hypothesis import strategies as st

from silo.inertia.assembly import Assembly, Instance
from silo.inertia.links.frames import origin_frame
from silo.inertia.links.link_map import link_map

Fixture = Callable[..., Any]
BOM = "Name,Material,Mass\nplate,steel,\nrod,aluminum,\nblock,,0.7500 kg\nodd,PLA,\n"
PROTOTYPES = {
    "plate": box("plate", 0.1, 0.2, 0.01),
    "rod": cylinder("rod", 0.02, 0.3),
    "block": box("block", 0.05, 0.06, 0.07),
    "odd": box("odd", 0.3, 0.001, 0.02),
}

places = st.tuples(
    st.sampled_from(sorted(PROTOTYPES)),
    st.sampled_from(["base", "arm", "hand"]),
    st.tuples(*[st.floats(-2, 2)] * 3),
    st.tuples(*[st.floats(-3, 3)] * 3),
)
layouts = st.lists(places, min_size=1, max_size=10)
quietly = settings(max_examples=examples(15))


def build(layout: list[Any], outer: np.ndarray | None = None) -> Assembly:
    """An assembly of the drawn parts, all moved by ``outer``."""
    outer = np.eye(4) if outer is None else outer
    return Assembly(
        "asm",
        PROTOTYPES,
        tuple(
            Instance((link, f"{name}{i}"), (link, name), name, outer @ origin_frame(xyz, rpy))
            for i, (name, link, xyz, rpy) in enumerate(layout)
        ),
    )


def close(left: Any, right: Any, scale: float = 1.0) -> None:
    """Mass properties equal to 1e-10 of their size."""
    assert left.mass == pytest.approx(right.mass, rel=1e-12)
    assert left.com == pytest.approx(right.com, rel=1e-10, abs=1e-12)
    size = max(np.abs(right.inertia).max(), 1e-12) * scale
    assert np.abs(left.inertia - right.inertia).max() <= 1e-10 * size


@quietly
@given(layouts, st.randoms(use_true_random=False))
def test_case_36_order_of_parts_does_not_matter(compute: Fixture, layout: list[Any], random: Any) -> None:
    """Any order of instances gives the same links."""
    one = compute(build(layout), BOM)
    random.shuffle(layout)
    two = compute(build(layout), BOM)
    assert one.links.keys() == two.links.keys()
    for name, link in one.links.items():
        close(two.links[name].props, link.props)


@quietly
@given(layouts, st.tuples(*[st.floats(-2, 2)] * 3), st.tuples(*[st.floats(-3, 3)] * 3))
def test_case_37_moving_everything(compute: Fixture, layout: list[Any], xyz: Any, rpy: Any) -> None:
    """A rigid motion of the whole turns each tensor and moves each centre, nothing else."""
    outer = origin_frame(xyz, rpy)
    before, after = compute(build(layout), BOM), compute(build(layout, outer), BOM)
    for name, link in before.links.items():
        close(after.links[name].props, link.props.transformed(outer), scale=10)
    shift = np.eye(4)
    shift[:3, 3] = xyz
    shifted = compute(build(layout, shift), BOM)
    for name, link in before.links.items():
        assert shifted.links[name].props.inertia == pytest.approx(link.props.inertia, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize(("name", "mass"), [("plate", 1.57), ("block", 0.75)])
def test_case_38_one_part_alone(compute: Fixture, name: str, mass: float) -> None:
    """A link of one part has that part's own tensor, by material as by mass."""
    prototype = PROTOTYPES[name]
    found = compute(build([(name, "base", (1, 2, 3), (0, 0, 0))]), BOM).links["base"].props
    assert found.mass == pytest.approx(mass)
    assert found.com == pytest.approx([1, 2, 3])
    expected = prototype.inertia_unit * mass / prototype.volume_m3
    assert found.inertia == pytest.approx(expected, rel=1e-12, abs=1e-18)


@quietly
@given(layouts)
def test_case_39_links_sum_up_to_the_assembly(compute: Fixture, layout: list[Any]) -> None:
    """The links together are the assembly, however the parts are dealt out."""
    from silo.inertia.rigid import combine

    report = compute(build(layout), BOM)
    close(combine([link.props for link in report.links.values()]), report.total)
    dealt = compute(
        build(layout), BOM, links=link_map({"links": {"a": ["**/plate*", "**/rod*"], "b": ["**"]}})
    )
    close(combine([link.props for link in dealt.links.values()]), report.total)


@quietly
@given(layouts)
def test_case_40_trimesh_scene_is_an_independent_oracle(compute: Fixture, layout: list[Any]) -> None:
    """trimesh sums meshes with densities in its own way; boxes have exact meshes."""
    layout = [(name if name != "rod" else "plate", *rest) for name, *rest in layout]
    report = compute(build(layout), BOM)
    density = {"plate": 7850.0, "block": 0.75 / PROTOTYPES["block"].volume_m3, "odd": 1250.0}
    extents = {"plate": (0.1, 0.2, 0.01), "block": (0.05, 0.06, 0.07), "odd": (0.3, 0.001, 0.02)}
    for link, props in report.link_properties.items():
        scene = trimesh.Scene()
        mass = 0.0
        for name, where, xyz, rpy in layout:
            if where == link:
                mesh = trimesh.creation.box(extents[name])
                mesh.density = density[name]
                mass += mesh.mass
                scene.add_geometry(mesh, transform=origin_frame(xyz, rpy))
        tensor = scene.moment_inertia
        # Scene.moment_inertia is about the scene's centre of mass.
        assert props.mass == pytest.approx(mass, rel=1e-9)
        assert props.com == pytest.approx(tuple(scene.center_mass), rel=1e-8, abs=1e-10)
        ours = report.links[link].props.inertia
        assert np.abs(ours - tensor).max() <= 1e-8 * np.abs(tensor).max()


def test_two_body_formula(compute: Fixture) -> None:
    """The off-axis case by hand: two boxes, parallel axis for both."""
    report = compute(
        build([("block", "base", (0, 0, 0), (0, 0, 0)), ("block", "base", (0.4, 0.3, 0), (0, 0, 0))]), BOM
    )
    props = report.links["base"].props
    own = PROTOTYPES["block"].inertia_unit * 0.75 / PROTOTYPES["block"].volume_m3
    mu = 0.75 * 0.75 / 1.5
    expected = 2 * own + mu * np.array([[0.09, -0.12, 0], [-0.12, 0.16, 0], [0, 0, 0.25]])
    assert props.com == pytest.approx([0.2, 0.15, 0])
    assert props.inertia == pytest.approx(expected, rel=1e-12)


def test_ten_thousand_instances_have_a_stable_report(compute: Fixture) -> None:
    """Case 20, the numbers: 10 000 instances of four parts, one part line per product and link."""
    layout = [(name, "base", (i * 0.01, 0, 0), (0, 0, 0)) for i in range(2500) for name in sorted(PROTOTYPES)]
    report = compute(build(layout), BOM)
    (link,) = report.links.values()
    assert [(part.name, part.quantity) for part in link.parts] == [(n, 2500) for n in sorted(PROTOTYPES)]
    assert link.props.mass == pytest.approx(sum(part.total_mass for part in link.parts))
    assert link.problems == ()


def test_causes_stand_by_the_mass_at_stake(assemble: Any, compute: Any) -> None:
    """Three parts of 1 kg that the BOM lacks come before one of 2 kg that is rounded to ± 0.5 kg."""
    cubes = [(f"l/{name}", box(name, 0.1, 0.1, 0.1)) for name in ("heavy", "a", "b", "c")]
    report = compute(assemble(*cubes), "Name,Mass\nheavy,2 kg\n")
    found = {str(cause.code): cause.mass for cause in report.causes()}
    assert list(found) == ["not_in_bom", "mass_rounded", *list(found)[2:]]
    assert (found["not_in_bom"], found["mass_rounded"]) == (pytest.approx(3.0), pytest.approx(0.5))
