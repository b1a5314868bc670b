# SPDX-License-Identifier: LGPL-2.1-or-later
"""A URDF with meshes as geometry: places, scales, several shapes of a link, and what is not there."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
import trimesh

from silo.bom.errors import DocumentError, InputError
from silo.cli.main import main
from silo.inertia import compute_link_inertials, geometry
from silo.inertia.assembly import Assembly
from silo.inertia.geometry.options import ReadOptions
from silo.inertia.geometry.robot import found_mesh
from silo.inertia.notes import GeometryCode
from silo.inertia.urdf import read_urdf

JOINT = """<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><origin xyz="{3}"
    rpy="{4}"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>"""


def _robot(folder: Path, body: str, name: str = "robot.urdf") -> Path:
    path = folder / name
    path.write_text(f'<?xml version="1.0"?>\n<robot name="arm">\n{body}\n</robot>\n', "utf-8")
    return path


def _box(path: Path, size: tuple[float, float, float] = (0.1, 0.2, 0.3)) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    trimesh.creation.box(size).export(path)
    return path


def _visual(inner: str, origin: str = "", kind: str = "visual") -> str:
    return f"<{kind}>{origin}<geometry>{inner}</geometry></{kind}>"


def _read(path: Path) -> Assembly:
    return geometry.read(path, options=ReadOptions(isolate=False, cache=False))


@pytest.mark.parametrize("suffix", ["stl", "obj", "glb", "ply", "dae"])
def test_a_link_weighs_what_its_mesh_encloses_in_metres(tmp_path: Path, suffix: str) -> None:
    if suffix == "dae":
        pytest.importorskip("collada")
    _box(tmp_path / f"meshes/upper.{suffix}")
    mesh = f'<mesh filename="meshes/upper.{suffix}"/>'
    link = f'<link name="upper">{_visual(mesh)}</link>'
    report = compute_link_inertials(_robot(tmp_path, link), density=1000.0, read_options=_here())
    assert report.bodies["upper"].mass == pytest.approx(0.1 * 0.2 * 0.3 * 1000)


def _here() -> ReadOptions:
    return ReadOptions(isolate=False, cache=False)


def test_origins_scales_and_several_visuals_add_up(tmp_path: Path) -> None:
    """Two boxes, one mirrored and half as long, 1 m apart: by hand."""
    _box(tmp_path / "a.stl", (0.1, 0.1, 0.2))
    link = (
        '<link name="l">'
        + _visual('<mesh filename="a.stl"/>', '<origin xyz="0 0 0.5"/>')
        + _visual(
            '<mesh filename="a.stl" scale="1 -1 0.5"/>',
            '<origin xyz="0 0 -0.5" rpy="1.5707963267948966 0 0"/>',
        )
        + "</link>"
    )
    body = compute_link_inertials(_robot(tmp_path, link), read_options=_here()).bodies["l"]
    assert body.mass == pytest.approx(3.0)
    assert body.com == pytest.approx(np.array([0, 0, 0.5 * (2 - 1) / 3]))
    apart = 2 * (0.5 - 1 / 6) ** 2 + (0.5 + 1 / 6) ** 2
    upright, lying = 2 * (0.1**2 + 0.2**2) / 12, (0.1**2 + 0.1**2) / 12
    assert body.inertia[0, 0] == pytest.approx(apart + upright + lying)


def test_collision_shapes_count_only_without_a_visual_one(tmp_path: Path) -> None:
    small, large = '<box size="0.1 0.1 0.1"/>', '<box size="1 1 1"/>'
    body = (
        f'<link name="both">{_visual(large, kind="collision")}{_visual(small)}</link>'
        f'<link name="hull">{_visual(large, kind="collision")}</link>'
        + JOINT.format("j", "both", "hull", "0 0 1", "0 0 0")
    )
    report = compute_link_inertials(_robot(tmp_path, body), read_options=_here())
    assert report.bodies["both"].mass == pytest.approx(1.0)
    assert report.bodies["hull"].mass == pytest.approx(1000.0)


@pytest.mark.parametrize(
    ("shape", "oracle"),
    [
        ('<box size="0.1 0.2 0.3"/>', trimesh.primitives.Box([0.1, 0.2, 0.3])),
        ('<cylinder radius="0.1" length="0.4"/>', trimesh.creation.cylinder(0.1, 0.4, sections=2000)),
        ('<sphere radius="0.1"/>', trimesh.creation.icosphere(6, 0.1)),
        ('<capsule radius="0.1" length="0.4"/>', trimesh.creation.capsule(0.4, 0.1, count=[400, 400])),
    ],
)
def test_primitives_are_what_a_fine_mesh_of_them_is(
    tmp_path: Path, shape: str, oracle: trimesh.Trimesh
) -> None:
    (part,) = _read(_robot(tmp_path, f'<link name="l">{_visual(shape)}</link>')).prototypes.values()
    assert part.volume_m3 == pytest.approx(oracle.volume, rel=1e-3)
    about = np.diag(oracle.moment_inertia) / oracle.density
    assert np.diag(part.inertia_unit) == pytest.approx(about, rel=2e-3)


def test_links_stand_where_the_joints_put_them(tmp_path: Path) -> None:
    cube = _visual('<box size="0.1 0.1 0.1"/>')
    body = (
        f'<link name="a">{cube}</link><link name="b">{cube}</link><link name="c">{cube}</link>'
        + JOINT.format("ab", "a", "b", "1 0 0", f"0 0 {math.pi / 2}")
        + JOINT.format("bc", "b", "c", "1 0 0", "0 0 0")
    )
    places = {i.path[0]: i.transform for i in _read(_robot(tmp_path, body)).instances}
    assert places["c"][:3, 3] == pytest.approx(np.array([1, 1, 0]), abs=1e-12)


@pytest.mark.parametrize(
    ("named", "at"),
    [
        ("package://my_robot/meshes/a.stl", "meshes/a.stl"),
        ("package://my_robot/meshes/a.stl", "my_robot/meshes/a.stl"),
        ("../meshes/a.stl", "meshes/a.stl"),
        ("model://a.stl", "urdf/a.stl"),
        ("meshes\\a.stl", "urdf/meshes/a.stl"),
    ],
)
def test_meshes_are_found_in_the_package_around(tmp_path: Path, named: str, at: str) -> None:
    mesh = _box(tmp_path / "work" / at)
    (tmp_path / "work/urdf").mkdir(exist_ok=True)
    found = found_mesh(_robot(tmp_path / "work/urdf", ""), named)
    assert found is not None
    assert found.resolve() == mesh.resolve()


def test_a_missing_mesh_is_not_read_and_ends_with_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    body = (
        '<link name="l">'
        + _visual('<mesh filename="gone.stl"/>')
        + _visual('<box size="1 1 1"/>')
        + "</link>"
    )
    path = _robot(tmp_path, body)
    notes = [note.code for part in _read(path).prototypes.values() for note in part.problems]
    assert GeometryCode.NOT_READ in notes
    assert main(["inertia", str(path), "--json", "--no-cache"]) == 1
    assert "gone.stl" in capsys.readouterr().out


def test_a_robot_is_weighed_by_link_and_by_mesh_and_written_back(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _box(tmp_path / "motor.stl", (0.1, 0.1, 0.1))
    mesh, box = _visual('<mesh filename="motor.stl"/>'), _visual('<box size="0.1 0.1 0.2"/>')
    body = (
        f'<link name="base">{mesh}</link>\n<link name="arm">{mesh}{box}</link>\n'
        '<link name="tip"/>\n'
        + JOINT.format("j", "base", "arm", "0 0 1", "0 0 0.5")
        + JOINT.format("t", "arm", "tip", "0 0 1", "0 0 0")
    )
    path = _robot(tmp_path, body)
    (tmp_path / "bom.csv").write_text("Name,Quantity,Mass\nmotor,2,0.5 kg\narm,1,0.9 kg\n", "utf-8")
    out = tmp_path / "out.urdf"
    arguments = ["inertia", str(path), "--bom", str(tmp_path / "bom.csv"), "--urdf-out", str(out), "--json"]
    assert main([*arguments, "--no-cache"]) == 0
    links = {link["name"]: link for link in json.loads(capsys.readouterr().out)["links"]}
    assert links["base"]["mass"] == pytest.approx(0.5)
    assert links["arm"]["mass"] == pytest.approx(0.9)  # 0.5 kg of the motor, the rest is the box's
    text = out.read_text("utf-8")
    assert text.count("<inertial>") == 2
    assert text.index('<link name="tip"/>') > text.rindex("</inertial>")
    # The frame of the numbers is the link's: the motor's centre is its origin.
    assert '<origin xyz="0 0 0" rpy="0 0 0"/>' in text


def test_links_that_no_body_can_be_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    inertial = (
        '<inertial><mass value="{}"/><inertia ixx="{}" ixy="0" ixz="0" iyy="{}" iyz="0" izz="{}"/></inertial>'
    )
    box = _visual('<box size="1 1 1"/>')
    body = (
        f'<link name="base">{box}</link>'
        f'<link name="hip">{inertial.format(1, -0.1, -0.1, 0.1)}</link>'
        f'<link name="thin">{inertial.format(1, 0.1, 0.1, 0.5)}</link>'
        f'<link name="nan">{inertial.format("nan", 0.1, 0.1, 0.1)}</link>'
        f'<link name="less">{inertial.format(-1, 0.1, 0.1, 0.1)}</link>'
        f'<link name="good">{inertial.format(1, 0.1, 0.1, 0.1)}</link>'
    )
    for child in ("hip", "thin", "nan", "less", "good"):
        body += JOINT.format(child, "base", child, "0 0 0", "0 0 0")
    main(["inertia", str(_robot(tmp_path, body)), "--json", "--no-cache"])
    warnings = json.loads(capsys.readouterr().out)["warnings"]
    found = [w["message"] for w in warnings if w["code"] == "urdf_impossible"]
    beginnings = (
        "The link hip is not ours, and its inertia tensor has a principal moment",
        "The link thin is not ours, and its inertia tensor has a principal moment above the sum",
        "The link nan is not ours, and its mass or a moment of inertia is no finite number;",
        "The link less is not ours, and its mass is negative (-1 kg);",
    )
    assert len(found) == len(beginnings)  # one sentence each, and none about the good one
    for sentence, beginning in zip(found, beginnings, strict=True):
        assert sentence.startswith(beginning)


MOVING = """<link name="a"/><link name="b"/><link name="c"/><link name="d"/><link name="e"/>
<joint name="ab" type="revolute"><parent link="a"/><child link="b"/><origin xyz="1 0 0.2" rpy="0.1 0.2 0.3"/>
  <axis xyz="0 2 2"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="bc" type="prismatic"><parent link="b"/><child link="c"/><origin xyz="0 0.5 0" rpy="0 0 1"/>
  <axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="cd" type="continuous"><parent link="c"/><child link="d"/><origin xyz="0.3 0 0"/></joint>
<joint name="de" type="fixed"><parent link="d"/><child link="e"/><origin xyz="0 0 0.4"/></joint>"""


def test_joints_stand_where_they_were_exported(tmp_path: Path) -> None:
    """The frames of all links at a pose are those of a simulator at that pose."""
    mujoco = pytest.importorskip("mujoco")
    inertial = (
        '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    )
    text = MOVING
    for name in "abcde":
        text = text.replace(f'<link name="{name}"/>', f'<link name="{name}">{inertial}</link>')
    path = _robot(tmp_path, '<mujoco><compiler fusestatic="false"/></mujoco>' + text)
    pose = {"ab": 0.52, "bc": -0.25, "cd": 2.2}
    frames = read_urdf(path).at(pose).frames
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    for joint, position in pose.items():
        data.joint(joint).qpos = position
    mujoco.mj_forward(model, data)
    for name in "bcde":
        assert frames[name][:3, 3] == pytest.approx(data.body(name).xpos, abs=1e-9)
        assert frames[name][:3, :3].ravel() == pytest.approx(data.body(name).xmat, abs=1e-9)


def test_a_joint_that_follows_another_follows_it(tmp_path: Path) -> None:
    body = MOVING.replace(
        '<axis xyz="0 0 1"/>', '<axis xyz="0 0 1"/><mimic joint="ab" multiplier="0.5" offset="0.1"/>'
    )
    urdf = read_urdf(_robot(tmp_path, body))
    assert urdf.at({"ab": 0.4}).frames["c"] == pytest.approx(urdf.at({"ab": 0.4, "bc": 0.3}).frames["c"])


@pytest.mark.parametrize(
    ("pose", "words"),
    [
        ({"elbow": 1.0}, "there is no joint elbow; it has ab, bc, cd, de"),
        ({"de": 1.0}, "the joint de is fixed"),
    ],
)
def test_a_joint_that_is_not_there_is_refused(pose: dict[str, float], words: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=words):
        read_urdf(_robot(tmp_path, MOVING)).at(pose)


def test_the_links_that_mujoco_makes_part_of_its_world(tmp_path: Path) -> None:
    body = MOVING.replace('name="ab" type="revolute"', 'name="ab" type="fixed"')
    assert read_urdf(_robot(tmp_path, body)).fused_base == ("a", "b")


def test_a_step_file_in_another_pose_is_weighed_in_the_frames_of_its_links(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The same arm, exported straight and bent, gives the same inertia of its links."""
    results = []
    for angle in (0.0, 0.9):
        scene = trimesh.Scene()
        bent = trimesh.transformations.rotation_matrix(angle, [0, 0, 1], [0.3, 0, 0])
        for name, offset, place in (("upper", 0.15, np.eye(4)), ("lower", 0.4, bent)):
            arm = trimesh.creation.box((0.2, 0.04, 0.02))
            arm.apply_translation((offset, 0, 0))
            scene.add_geometry(arm, node_name=name, geom_name=name, transform=place)
        mesh = tmp_path / f"arm{angle:g}.glb"
        mesh.write_bytes(scene.export(file_type="glb"))
        body = '<link name="upper"/><link name="lower"/>' + JOINT.format(
            "elbow", "upper", "lower", "0.3 0 0", "0 0 0"
        )
        urdf = _robot(tmp_path, body, f"arm{angle:g}.urdf")
        links = tmp_path / "map.yaml"
        links.write_text("links:\n  upper: {parts: [upper]}\n  lower: {parts: [lower]}\n", "utf-8")
        arguments = ["inertia", str(mesh), "--urdf", str(urdf), "--links", str(links), "--json", "--no-cache"]
        main([*arguments, *(["--joint", f"elbow={angle}"] if angle else [])])
        found = json.loads(capsys.readouterr().out)["links"]
        results.append({link["name"]: (link["com"], link["inertia"]) for link in found})
    for name in ("upper", "lower"):
        for straight, turned in zip(results[0][name], results[1][name], strict=True):
            assert np.array(turned) == pytest.approx(np.array(straight), abs=1e-6)


def test_a_robot_without_shapes_is_refused_in_words(tmp_path: Path) -> None:
    with pytest.raises(DocumentError, match="none of its links has a shape"):
        _read(_robot(tmp_path, '<link name="a"/>'))
