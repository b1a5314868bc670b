# SPDX-License-Identifier: LGPL-2.1-or-later
"""URDF files: only the inertials change, frames follow the joints, hostile files are plain errors."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from silo.bom.errors import InputError
from silo.inertia.rigid import MassProps
from silo.inertia.urdf import Urdf, read_urdf, write_urdf

PROPS = MassProps(1.5, [0.1, 0.2, 0.3], np.diag([0.01, 0.02, 0.025]))  # type: ignore[arg-type]

ROBOT = b"""<?xml version='1.0' encoding="utf-8"?>
<!-- a comment > with <link name="fake"/> in it -->
<robot name='r'   xmlns:xacro="http://www.ros.org/wiki/xacro">
\t<link name="empty"/>
  <link  name='old' >
     <visual><geometry><box size="1 1 1"/></geometry></visual>
     <inertial> <mass value="9"/> <!-- guessed --> </inertial>
     <collision/>
  </link>
  <link name="a &gt; b"><visual/></link>
  <link name="bare">
  </link>
  <gazebo reference="old"><link name="empty"/></gazebo>
  <joint name="j1" type="revolute">
    <origin xyz="1 2 3" rpy="0 0 1.5707963267948966"/>
    <parent link="empty"/><child link="old"/>
  </joint>
  <joint name="j2" type="fixed"><parent link="old"/><child link="bare"/><origin xyz="1 0 0"/></joint>
</robot>
<!-- the end: \xc3\xa9 -->
"""


def inertial_spans(data: bytes) -> bytes:
    """The file with its inertials cut out, and without the space around them."""
    import re

    return re.sub(rb"\s*<inertial>.*?</inertial>\s*", b"", data, flags=re.DOTALL)


def test_existing_and_missing_inertials_are_filled() -> None:
    """Every named link has exactly one, with our numbers; others keep what they had."""
    filled = Urdf(ROBOT).filled({"empty": PROPS, "old": PROPS, "a > b": PROPS, "bare": PROPS, "ghost": PROPS})
    assert filled.written == ("empty", "old", "a > b", "bare")
    assert filled.absent == ("ghost",)
    assert filled.untouched == ()
    for link in ET.fromstring(filled.data).findall("link"):  # noqa: S314 (our own text)
        (inertial,) = link.findall("inertial")
        assert inertial.find("mass").get("value") == "1.5"  # type: ignore[union-attr]
        assert inertial.find("origin").get("xyz") == "0.1 0.2 0.3"  # type: ignore[union-attr]


def test_the_rest_of_the_file_stays_byte_for_byte() -> None:
    """Quotes, comments, tabs, declaration: a diff shows the inertials only."""
    filled = Urdf(ROBOT).filled({"old": PROPS})
    assert inertial_spans(filled.data) == inertial_spans(ROBOT)
    before, after = ROBOT.split(b"<inertial>")[0], ROBOT.split(b"</inertial>")[1]
    assert filled.data.startswith(before)
    assert filled.data.endswith(after)
    assert filled.untouched == ("empty", "a > b", "bare")


@pytest.mark.parametrize("behind", ["<!-- guessed > <b> -->", "<visual/>", " <?note <inertial/> ?>", "é", ""])
@pytest.mark.parametrize(
    "old", ["<inertial/>", "<inertial />", "<inertial></inertial >", "<inertial\n>\n</inertial>"]
)
def test_an_empty_inertial_is_replaced_and_nothing_behind_it(old: str, behind: str) -> None:
    """Whatever follows it stays, to the byte."""
    data = f"<robot><link name='a'>{old}{behind}</link></robot>".encode()
    filled = Urdf(data).filled({"a": PROPS}).data
    assert filled.startswith(b"<robot><link name='a'><inertial>")
    assert filled.endswith(f"</inertial>{behind}</link></robot>".encode())
    ET.fromstring(filled)  # noqa: S314 (our own text)


def test_filling_twice_changes_nothing_more() -> None:
    """The second run writes the same file."""
    links = {"empty": PROPS, "old": PROPS, "bare": PROPS}
    once = Urdf(ROBOT).filled(links).data
    assert Urdf(once).filled(links).data == once


def test_line_ends_of_the_file_are_kept() -> None:
    """A file of Windows stays one."""
    data = Urdf(ROBOT.replace(b"\n", b"\r\n")).filled({"empty": PROPS, "bare": PROPS}).data
    assert data.count(b"\n") == data.count(b"\r\n")


@pytest.mark.usefixtures("needs_modes")
def test_written_in_place_and_elsewhere(tmp_path: Path) -> None:
    """Atomically, with the file's mode; a target of its own leaves the source alone."""
    path = tmp_path / "robot.urdf"
    path.write_bytes(ROBOT)
    path.chmod(0o640)
    write_urdf(read_urdf(path), {"old": PROPS}, tmp_path / "out.urdf")
    assert path.read_bytes() == ROBOT
    write_urdf(read_urdf(path), {"old": PROPS}, path)
    assert path.read_bytes() == (tmp_path / "out.urdf").read_bytes() != ROBOT
    assert path.stat().st_mode & 0o777 == 0o640
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out.urdf", "robot.urdf"]


def test_frames_follow_the_joints() -> None:
    """Origins chain from the root, all joints at zero; a missing rpy is none."""
    frames = Urdf(ROBOT).frames
    assert frames["empty"] == pytest.approx(np.eye(4))
    assert frames["old"] @ [1, 0, 0, 1] == pytest.approx([1, 3, 3, 1])
    assert frames["bare"][:3, 3] == pytest.approx([1, 3, 3])


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "not valid XML"),
        (b"<robot><link name='a'></robot>", "not valid XML"),
        (b"<sdf><link name='a'/></sdf>", "wanted a URDF"),
        (b"<!DOCTYPE robot [<!ENTITY a 'b'>]><robot>&a;</robot>", "DOCTYPE"),
        ("<robot/>".encode("utf-16"), "UTF-16"),
    ],
)
def test_files_that_are_no_urdf(data: bytes, words: str) -> None:
    """One plain sentence each."""
    with pytest.raises(InputError, match=words):
        Urdf(data, "x.urdf").filled({"a": PROPS})


def test_joints_that_are_no_tree() -> None:
    """A ring, two parents, origins that xacro has not computed yet."""

    def joint(parent: str, child: str, origin: str = "") -> str:
        return (
            f'<joint name="{parent}{child}"><parent link="{parent}"/><child link="{child}"/>{origin}</joint>'
        )

    links = '<link name="a"/><link name="b"/>'
    assert "ring" in Urdf(f"<robot>{links}{joint('a', 'b')}{joint('b', 'a')}</robot>".encode()).problem
    assert "two parents" in Urdf(f"<robot>{links}{joint('a', 'b')}{joint('c', 'b')}</robot>".encode()).problem
    xacro = joint("a", "b", '<origin xyz="${x} 0 0"/>')
    assert "xacro" in Urdf(f"<robot>{links}{xacro}</robot>".encode()).problem


def test_a_missing_file(tmp_path: Path) -> None:
    """With its path."""
    with pytest.raises(InputError, match=r"none\.urdf"):
        write_urdf(read_urdf(tmp_path / "none.urdf"), {}, None)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"<robot><link name='a'/><link name='a'/></robot>", "2 links named a"),
        (b"<robot><link name='a'><inertial/><visual/><inertial/></link></robot>", "link a has 2 <inertial>"),
    ],
)
def test_what_is_there_twice_is_refused(data: bytes, words: str) -> None:
    """Only one of the two would be filled, and nobody knows which one a simulator reads."""
    with pytest.raises(InputError, match=words):
        Urdf(data, "x.urdf").filled({"a": PROPS})


@pytest.mark.usefixtures("needs_symlinks")
def test_a_link_to_a_file_stays_one(tmp_path: Path) -> None:
    """A symbolic link is followed, not replaced by a file of its own."""
    (tmp_path / "robot.urdf").write_bytes(ROBOT)
    (tmp_path / "latest.urdf").symlink_to("robot.urdf")
    write_urdf(read_urdf(tmp_path / "latest.urdf"), {"old": PROPS}, tmp_path / "latest.urdf")
    assert (tmp_path / "latest.urdf").is_symlink()
    assert (tmp_path / "robot.urdf").read_bytes() == Urdf(ROBOT).filled({"old": PROPS}).data


def test_nothing_is_written_where_no_link_is_known(tmp_path: Path) -> None:
    """Neither the file nor a copy of it elsewhere."""
    (tmp_path / "robot.urdf").write_bytes(ROBOT)
    before = (tmp_path / "robot.urdf").stat().st_mtime_ns
    filled = write_urdf(read_urdf(tmp_path / "robot.urdf"), {"ghost": PROPS}, tmp_path / "out.urdf")
    assert (filled.written, filled.absent) == ((), ("ghost",))
    assert [p.name for p in tmp_path.iterdir()] == ["robot.urdf"]
    assert (tmp_path / "robot.urdf").stat().st_mtime_ns == before


@pytest.mark.parametrize(("turn", "doubted"), [("0 0 90", True), ("0 -90 0", True), ("0 -1.57 0", False)])
def test_a_joint_that_turns_by_more_than_a_turn_is_doubted_both_ways(turn: str, doubted: bool) -> None:
    """Degrees are noticed by their size, whatever their sign."""
    joint = f"<joint><parent link='a'/><child link='b'/><origin rpy='{turn}'/></joint>"
    urdf = Urdf(f"<robot><link name='a'/><link name='b'/>{joint}</robot>".encode())
    assert bool(urdf.doubts) is doubted
