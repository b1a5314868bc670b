# SPDX-License-Identifier: LGPL-2.1-or-later
"""A robot from a real STEP file (as1, of the format's own test suite), as three other programs read it back.

MuJoCo is there always; yourdfpy and pinocchio (`pip install yourdfpy pin`, 600 MB) are asked if they are
installed.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

NAMES = {"rod-assembly_1": "rod", "l-bracket-assembly_1": "left", "l-bracket-assembly_2": "right"}
BOM = """Name;Menge;Werkstoff;Masse [g]
plate;1;S235;
l-bracket;2;EN AW-6061;
bolt;6;;8,5
nut;8;brass;
rod;1;;20,0
"""
JOINTS = {
    "left": ("base_link", "0.03 0.075 0.02", "0 0 1.5707963267948966"),
    "right": ("base_link", "0.15 0.075 0.02", "0.3 -0.2 0.1"),
    "rod": ("left", "0.01 0.02 0.05", "0 1.2 0"),
}
URDF = "".join(
    f'<link name="{child}"/><joint name="to_{child}" type="revolute"><parent link="{parent}"/>'
    f'<child link="{child}"/><origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="0 1 0"/>'
    '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
    for child, (parent, xyz, rpy) in JOINTS.items()
)
URDF = (
    '<robot name="as1"><link name="world"/><link name="base_link"/><joint name="free" type="floating">'
    f'<parent link="world"/><child link="base_link"/></joint>{URDF}</robot>'
)

Read = dict[str, tuple[float, Any, Any]]
"""Link → mass [kg], centre (3,) [m] and tensor (3, 3) [kg m²] about it, all in the link's frame."""


@pytest.fixture(name="robot")
def _robot(run: Callable[..., Any], step_files: Path, tmp_path: Path) -> tuple[Path, dict[str, Any]]:
    """The filled URDF and the report: a map from `links`, its links renamed, a German BOM with gaps."""
    step, work = step_files / "as1-oc-214.stp", tmp_path
    assert run("links", step, "--out", work / "map.yaml").code == 0
    text = (work / "map.yaml").read_text("utf-8")
    for ours, theirs in NAMES.items():
        assert f'  "{ours}":\n' in text
        text = text.replace(f'  "{ours}":\n', f'  "{theirs}":\n')
    (work / "map.yaml").write_text(text, "utf-8")
    (work / "bom.csv").write_text(BOM, "cp1252")
    (work / "as1.urdf").write_text(URDF, "utf-8")
    ran = run(
        *("inertia", step, "--bom", work / "bom.csv", "--links", work / "map.yaml", "--json"),
        *("--urdf", work / "as1.urdf", "--urdf-out", work / "filled.urdf"),
    )
    assert ran.code == 0, ran.err
    return work / "filled.urdf", json.loads(ran.out)


def by_mujoco(path: Path) -> Read:
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_path(str(path))
    found = {}
    for number in range(1, model.nbody):
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, model.body_iquat[number])
        turn = turn.reshape(3, 3)
        tensor = turn @ np.diag(model.body_inertia[number]) @ turn.T
        found[model.body(number).name] = (model.body_mass[number], model.body_ipos[number], tensor)
    return found


def by_yourdfpy(path: Path) -> Read:
    yourdfpy = pytest.importorskip("yourdfpy", reason="pip install yourdfpy")
    links = yourdfpy.URDF.load(str(path), build_scene_graph=False, load_meshes=False).robot.links
    return {
        one.name: (one.inertial.mass, one.inertial.origin[:3, 3], one.inertial.inertia)
        for one in links
        if one.inertial is not None
    }


def by_pinocchio(path: Path) -> Read:
    pinocchio = pytest.importorskip("pinocchio", reason="pip install pin")
    model = pinocchio.buildModelFromUrdf(str(path))
    bodies = [frame for frame in model.frames if frame.type == pinocchio.FrameType.BODY]
    parts = {frame.name: model.inertias[frame.parentJoint] for frame in bodies if frame.name != "world"}
    return {name: (one.mass, one.lever, one.inertia) for name, one in parts.items()}


READERS = [by_mujoco, by_yourdfpy, by_pinocchio]


def check_links(read: Read, report: dict[str, Any], ground: str = "") -> None:
    """Compare mass, centre and tensor of each link, in its frame.

    ground
        the link that stands on the ground: not every program keeps its mass.
    """
    links = {link["name"]: link for link in report["links"]}
    assert read.keys() | {ground} == links.keys() | {ground}
    for name in links.keys() - {ground}:
        mass, centre, tensor = read[name]
        assert mass == pytest.approx(links[name]["mass"], rel=1e-12)
        np.testing.assert_allclose(centre, links[name]["com"], atol=1e-12)
        np.testing.assert_allclose(tensor, links[name]["inertia"], atol=1e-9 * np.trace(tensor))


@pytest.mark.parametrize("reader", READERS)
def test_other_programs_read_the_arm_of_the_tutorial(
    reader: Callable[[Path], Read], run: Callable[..., Any], arm: Path
) -> None:
    """The masses of the tutorial's STEP file and BOM, in the model that the robotics engineer gets."""
    out = arm / "read.urdf"
    files = ["--bom", arm / "bom.csv", "--urdf", arm / "arm.urdf", "--urdf-out", out]
    ran = run("inertia", arm / "arm.step", *files, "--json")
    assert ran.code == 0, ran.err
    check_links(reader(out), json.loads(ran.out), ground="base_link")


@pytest.mark.parametrize("reader", READERS)
def test_other_programs_read_what_was_found(
    reader: Callable[[Path], Read], robot: tuple[Path, dict[str, Any]]
) -> None:
    """Each link has its values; together they are the whole assembly."""
    path, report = robot
    read = reader(path)
    check_links(read, report)
    links = {link["name"]: link for link in report["links"]}
    assert read.keys() == {"base_link", *NAMES.values()}
    first = np.zeros(3)
    for name, (mass, centre, _) in read.items():
        first += mass * (np.array(links[name]["frame"]["placement"]) @ [*centre, 1])[:3]
    total = sum(mass for mass, _, _ in read.values())
    assert total == pytest.approx(report["total"]["mass"], rel=1e-12)
    np.testing.assert_allclose(first / total, report["total"]["com"], atol=1e-9)
    pieces = {part["name"]: part for link in report["links"] for part in link["parts"]}
    assert total > 6 * 0.0085 + 0.02 + 8500 * 8 * pieces["nut"]["volume"]


def test_nothing_is_guessed(robot: tuple[Path, dict[str, Any]]) -> None:
    """Each product has its row of the BOM, and nothing is to be warned of."""
    _, report = robot
    sources = {part["name"]: part["source"] for link in report["links"] for part in link["parts"]}
    weighed = dict.fromkeys(("bolt", "rod"), "bom_mass")
    assert sources == {**dict.fromkeys(("plate", "l-bracket", "nut"), "material"), **weighed}
    assert report["warnings"] == []
