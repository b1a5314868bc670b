# SPDX-License-Identifier: LGPL-2.1-or-later
"""MJCF files as geometry: read, weighed, written, and loaded again by MuJoCo, which is the oracle."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from silo.cli.main import main
from silo.inertia.urdf import read_urdf

MODEL = """<?xml version="1.0"?>
<!-- <robot> is no element here -->
<mujoco model="arm">
  <compiler angle="radian" meshdir="meshes" eulerseq="XYz" autolimits="true"/>
  <include file="settings.xml"/>
  <asset>
    <mesh file="wedge.stl"/>
    <mesh name="small" class="scaled" file="wedge.stl"/>
    <mesh name="turned" file="wedge.stl" refpos="0.01 0.02 0.03" refquat="0.9 0.1 0.2 0.3" scale="2 2 2"/>
  </asset>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body name="base" pos="0.1 0.2 0.3" euler="0.3 0.4 0.5">
      <geom type="mesh" mesh="wedge" pos="0 0 0.1" axisangle="1 1 0 0.7"/>
      <geom class="wall" fromto="0 0 0 0.1 0.2 0.3"/>
      <frame pos="0 0 0.5" quat="0.5 0.5 0.5 0.5">
        <body name="upper" childclass="wall" zaxis="1 2 3">
          <joint axis="0 0 1" range="-1 1"/>
          <body name="hand" pos="1 0 0" xyaxes="0 1 0 -1 0.1 0">
            <geom type="mesh" mesh="turned"/>
            <geom type="ellipsoid" size="0.1 0.2 0.3" pos="0 0 1"/>
          </body>
          <geom size="0.02 0.1" euler="0.1 -0.2 0.3"/>
          <geom type="box" size="0.1 0.2 0.3" fromto="0 0 0 1 1 1"/>
          <geom type="ellipsoid" size="0.1 0.3" fromto="0 0 0 0.5 -1 1"/>
          <inertial pos="0 0 0" mass="99" diaginertia="1 1 1"/>
        </body>
        <geom type="mesh" mesh="small" pos="0.5 0 0"/>
      </frame>
    </body>
    <body pos="1 1 1"><geom size="0.05"/></body>
    <body name="sensor"/>
  </worldbody>
</mujoco>
"""
SETTINGS = """<mujocoinclude>
  <default>
    <default class="wall"><geom type="capsule" size="0.03"/></default>
    <default class="scaled"><mesh scale="0.5 -0.5 0.25"/></default>
  </default>
</mujocoinclude>
"""


@pytest.fixture(name="model")
def _model(tmp_path: Path) -> Path:
    (tmp_path / "meshes").mkdir()
    corners = [[0, 0, 0], [0.2, 0, 0], [0, 0.1, 0], [0.05, 0.02, 0.3]]
    wedge = trimesh.Trimesh(corners, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    wedge.export(tmp_path / "meshes/wedge.stl")
    (tmp_path / "settings.xml").write_text(SETTINGS, "utf-8")
    path = tmp_path / "arm.xml"
    path.write_text(MODEL, "utf-8")
    return path


def _bodies(model: Any) -> dict[str, tuple[float, Any, Any]]:
    """Body → mass, centre and tensor about it, in the body's axes, as MuJoCo has them."""
    mujoco = pytest.importorskip("mujoco")
    found = {}
    for number in range(1, model.nbody):
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, model.body_iquat[number])
        turn = turn.reshape(3, 3)
        tensor = turn @ np.diag(model.body_inertia[number]) @ turn.T
        name = model.body(number).name or f"body_{number}"
        found[name] = (model.body_mass[number], model.body_ipos[number].copy(), tensor)
    return found


def _links(capsys: pytest.CaptureFixture[str], *arguments: object) -> dict[str, Any]:
    assert main(["inertia", *map(str, arguments), "--no-cache", "--json"]) == 0
    return {link["name"]: link for link in json.loads(capsys.readouterr().out)["links"]}


def _same(links: dict[str, Any], bodies: dict[str, Any], tolerance: float) -> None:
    for name, link in links.items():
        mass, centre, tensor = bodies[name]
        assert mass == pytest.approx(link["mass"], rel=tolerance)
        np.testing.assert_allclose(centre, link["com"], atol=tolerance)
        np.testing.assert_allclose(tensor, link["inertia"], atol=tolerance * np.trace(tensor))


def test_bodies_weigh_what_mujoco_makes_of_their_geoms(
    model: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each way of placing, defaults of classes, frames, meshes with scales and references."""
    mujoco = pytest.importorskip("mujoco")
    spec = mujoco.MjSpec.from_file(str(model))
    spec.compiler.inertiafromgeom = 1
    spec.body("sensor").add_geom(size=[0.01, 0, 0])  # without one MuJoCo does not load it
    for mesh in spec.meshes:
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_EXACT
    links = _links(capsys, model)
    assert set(links) == {"base", "upper", "hand", "body_4"}
    _same(links, _bodies(spec.compile()), 1e-6)  # MuJoCo keeps vertices in single precision


def test_defaults_may_stand_behind_what_takes_them(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """As MuJoCo has it: those of a class before the classes in it, and all of them before the assets."""
    mujoco = pytest.importorskip("mujoco")
    include = '  <include file="settings.xml"/>\n'
    text = MODEL.replace('<body name="sensor"/>', "").replace(include, "")
    model.write_text(text.replace("</mujoco>", include + "</mujoco>"), "utf-8")
    wall = '<default class="wall"><geom type="capsule" size="0.03"/></default>'
    bare = wall.replace(' size="0.03"', "")
    inner = f'<default class="outer">{bare}<geom size="0.04"/></default>'
    model.with_name("settings.xml").write_text(SETTINGS.replace(wall, inner), "utf-8")
    spec = mujoco.MjSpec.from_file(str(model))
    spec.compiler.inertiafromgeom = 1
    for mesh in spec.meshes:
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_EXACT
    _same(_links(capsys, model), _bodies(spec.compile()), 1e-6)


def test_what_is_written_is_loaded_by_mujoco(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """By a BOM with a mesh and a body; an inertial that stands behind other bodies is replaced."""
    mujoco = pytest.importorskip("mujoco")
    model.write_text(MODEL.replace('<body name="sensor"/>', ""), "utf-8")
    bom = model.with_name("bom.csv")
    bom.write_text("Name,Mass\nturned,1.5 kg\nupper,2 kg\n", "utf-8")
    filled = model.with_name("filled.xml")
    links = _links(capsys, model, "--bom", bom, "--urdf-out", filled)
    assert links["upper"]["mass"] == pytest.approx(2.0)
    assert [part["mass"] for part in links["hand"]["parts"] if part["name"] == "turned"] == [1.5]
    _same(links, _bodies(mujoco.MjModel.from_xml_path(str(filled))), 1e-9)
    text = filled.read_text("utf-8")
    assert 'mass="99"' not in text
    assert text.count("<inertial ") == 4
    kept = [line for line in MODEL.splitlines() if "geom" in line and "body pos" not in line]
    assert all(line in text.splitlines() for line in kept)


@pytest.mark.parametrize("kind", ["", 'type="box"', 'type="capsule" size="9 9"'])
def test_a_geom_that_is_fitted_to_a_mesh_weighs_as_the_mesh(
    kind: str, model: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model.write_text(
        '<mujoco><compiler meshdir="meshes"/><asset><mesh file="wedge.stl"/></asset><worldbody>'
        f'<body name="a"><geom {kind} mesh="wedge"/></body></worldbody></mujoco>',
        "utf-8",
    )
    assert _links(capsys, model)["a"]["mass"] == pytest.approx(0.2 * 0.1 * 0.3 / 6 * 1000)


def test_visual_geoms_weigh_and_collision_geoms_do_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "r.xml"
    path.write_text(
        '<mujoco><default><default class="v"><geom contype="0" conaffinity="0"/></default></default>'
        "<worldbody>"
        '<body name="a"><geom class="v" type="box" size=".1 .1 .1"/><geom type="sphere" size="1"/></body>'
        "</worldbody></mujoco>",
        "utf-8",
    )
    assert _links(capsys, path)["a"]["mass"] == pytest.approx(8.0)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('autolimits="true"', 'inertiafromgeom="true"', "MuJoCo ignores each <inertial>"),
        ('autolimits="true"', 'settotalmass="3"', "settotalmass"),
        ('<body name="sensor"/>', '<replicate count="3"><body name="s"/></replicate>', "<replicate>"),
        ('euler="0.3 0.4 0.5"', 'euler="0.3 x 0.5"', "is no number"),
        ('coordinate="local"', 'coordinate="global"', "global coordinates"),
        ('name="sensor"', 'name="base"', "2 links named base"),
    ],
)
def test_what_cannot_be_right_is_refused_and_not_written(
    old: str, new: str, words: str, model: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = MODEL.replace('angle="radian"', 'angle="radian" coordinate="local"')
    assert old in text
    model.write_text(text.replace(old, new), "utf-8")
    before = model.read_bytes()
    assert main(["inertia", str(model), "--in-place", "--no-cache"]) == 2
    assert words in capsys.readouterr().err
    assert model.read_bytes() == before


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ('<mujocoinclude><body name="x"/></mujocoinclude>', "<body> makes bodies"),
        ('<mujocoinclude><include file="settings.xml"/></mujocoinclude>', "nest without end"),
        ("<mujocoinclude>", "not valid XML"),
        (None, "cannot be read"),
    ],
)
def test_an_included_file_is_read_or_refused(
    settings: str | None, words: str, model: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (model.parent / "settings.xml").unlink()
    if settings is not None:
        (model.parent / "settings.xml").write_text(settings, "utf-8")
    assert main(["inertia", str(model), "--no-cache"]) == 2
    assert words in capsys.readouterr().err


def test_a_mesh_that_is_not_there_is_in_no_mass(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (model.parent / "meshes/wedge.stl").unlink()
    assert main(["inertia", str(model), "--no-cache"]) == 1
    assert "wedge.stl is not there" in capsys.readouterr().out


def test_places_are_those_of_the_world(model: Path) -> None:
    mujoco = pytest.importorskip("mujoco")
    spec = mujoco.MjSpec.from_file(str(model))
    spec.body("sensor").add_geom(size=[0.01, 0, 0])
    made = spec.compile()
    data = mujoco.MjData(made)
    mujoco.mj_kinematics(made, data)
    frames = read_urdf(model).frames
    for name in ("base", "upper", "hand"):
        np.testing.assert_allclose(frames[name][:3, 3], data.body(name).xpos, atol=1e-12)
        np.testing.assert_allclose(frames[name][:3, :3], data.body(name).xmat.reshape(3, 3), atol=1e-12)
