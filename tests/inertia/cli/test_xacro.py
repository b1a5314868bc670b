# SPDX-License-Identifier: LGPL-2.1-or-later
"""A xacro file is read expanded, and never filled by half."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import pytest
import trimesh

from silo.cli.main import main
from silo.inertia.xacro_files import is_xacro

XACRO = """<?xml version="1.0"?>
<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="finger" params="prefix y">
    <link name="${prefix}finger"><visual><geometry><mesh filename="finger.stl"/></geometry></visual></link>
    <joint name="${prefix}joint" type="fixed"><parent link="palm"/><child link="${prefix}finger"/>
      <origin xyz="0 ${2 * y} 0"/></joint>
  </xacro:macro>
  <link name="palm"><visual><geometry><box size="0.1 0.1 0.02"/></geometry></visual></link>
  <xacro:finger prefix="left_" y="0.02"/>
  <xacro:finger prefix="right_" y="-0.02"/>
</robot>
"""


@pytest.fixture(name="robot")
def _robot(tmp_path: Path) -> Path:
    trimesh.creation.box((0.01, 0.02, 0.05)).export(tmp_path / "finger.stl")
    path = tmp_path / "arm.urdf.xacro"
    path.write_text(XACRO, "utf-8")
    return path


@pytest.mark.parametrize("more", [[], ["--default-density", "2700"], ["--frame", "own"], ["--json"]])
@pytest.mark.parametrize("where", ["--in-place", "--urdf-out"])
def test_nothing_is_written_into_a_xacro_file(
    robot: Path, where: str, more: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    """One macro stands for two links: to fill it for one would be wrong for the other."""
    other = robot.with_name("other.urdf.xacro")
    other.write_text(XACRO, "utf-8")
    written = [where] if where == "--in-place" else [where, str(other)]
    assert main(["inertia", str(robot), *written, *more, "--no-cache"]) == 2
    assert "is a xacro file, and nothing is written into it" in capsys.readouterr().err
    assert robot.read_text("utf-8") == other.read_text("utf-8") == XACRO


@pytest.mark.skipif(importlib.util.find_spec("xacro") is not None, reason="the package xacro is installed")
def test_without_the_package_the_command_says_what_to_install(
    robot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["inertia", str(robot), "--no-cache"]) == 2
    assert "pip install xacro" in capsys.readouterr().err


@pytest.mark.skipif(importlib.util.find_spec("xacro") is None, reason="the package xacro is not installed")
def test_a_xacro_file_is_weighed_expanded_and_the_expanded_urdf_is_written(
    robot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = robot.with_name("arm.urdf")
    assert main(["inertia", str(robot), "--urdf-out", str(out), "--json", "--no-cache"]) == 0
    links = {link["name"]: link["mass"] for link in json.loads(capsys.readouterr().out)["links"]}
    assert links == pytest.approx({"palm": 0.2, "left_finger": 0.01, "right_finger": 0.01})
    text = out.read_text("utf-8")
    assert text.count("<inertial>") == 3
    assert "xacro:" not in text
    assert 'xyz="0 -0.04 0"' in text


def test_a_xacro_file_is_known_by_its_root() -> None:
    assert is_xacro(XACRO.encode())
    assert not is_xacro(b'<robot name="r"><!-- xmlns:xacro="x" --></robot>')
    namespace = b'<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="a"/></robot>'
    assert not is_xacro(namespace)  # what an expansion often leaves
