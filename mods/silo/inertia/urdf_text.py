# SPDX-License-Identifier: LGPL-2.1-or-later
"""The text of a URDF: its links, joints and shapes, with the places of the links in the file.

Read with expat, which gives byte positions: who writes into the file can leave every other byte as it was.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Self
from xml.parsers import expat

import numpy as np

from silo.bom.errors import InputError
from silo.bom.message import message
from silo.bom.system_refusals import why_refused
from silo.inertia.arrays import Floats
from silo.inertia.links.claims import ROOT_LINK
from silo.inertia.links.frames import MOST_RAD, origin_frame
from silo.inertia.rigid import MassProps, tensor_words
from silo.inertia.xacro_files import expanded, is_xacro

MOVING = ("revolute", "continuous", "prismatic")
"""Kinds of joints that have one position."""

MAX_BYTES = 64 * 1024 * 1024

# From its first character to its end; a quoted ">" is no end.
_TAG = re.compile(rb"<(?:\"[^\"]*\"|'[^']*'|[^>\"'])*>")


@dataclass(eq=False)
class LinkSpan:
    """A ``<link>``: where its start tag is and ends, its end tag, first child, its ``<inertial>``s."""

    name: str
    start: int
    tag_end: int
    closed: bool
    end: int = -1
    inertial: tuple[int, int] | None = None
    inertials: int = 0
    first_child: int | None = None
    meshes: list[str] = field(default_factory=list)
    shapes: list[UrdfShape] = field(default_factory=list)
    stated: dict[str, dict[str, str]] = field(default_factory=dict)


@dataclass(eq=False)
class UrdfShape:
    """A visual or collision shape of a link: its origin, its kind, and the values that the file gives it.

    place
        (4, 4) in the link's frame, if the file does not say it as ``xyz`` and ``rpy``.
    """

    collision: bool
    xyz: tuple[float, ...] = (0.0, 0.0, 0.0)
    rpy: tuple[float, ...] = (0.0, 0.0, 0.0)
    kind: str = ""
    values: dict[str, str] = field(default_factory=dict)
    place: Floats | None = None


def read_bytes(path: Path | str) -> bytes:
    """Read a URDF file, a xacro file expanded; InputError if it is absent, or far too large for one."""
    try:
        if Path(path).stat().st_size > MAX_BYTES:
            raise InputError(f"{path}: larger than {MAX_BYTES // 2**20} MB, which no URDF is")
        data = Path(path).read_bytes()
    except OSError as error:
        raise InputError(
            message("{path}: the URDF cannot be read ({error})", path=path, error=why_refused(error))
        ) from error
    return expanded(Path(path)) if is_xacro(data) else data


@dataclass(eq=False)
class _Joint:
    parent: str = ""
    child: str = ""
    xyz: str = "0 0 0"
    rpy: str = "0 0 0"
    name: str = ""
    kind: str = ""
    axis: str = "1 0 0"
    mimic: tuple[str, float, float] | None = None


@dataclass(eq=False)
class UrdfText:
    """One URDF: its links with their places in the text, and its joints.

    Raises InputError if ``data`` is no URDF that can be read (also for DOCTYPE: not needed in a URDF, and
    a way to attack its reader), and for two links of one name or two inertials in one link: it is unknown
    which one counts.

    pose
        joint → position [rad or m] in which the geometry was exported; 0 for the others.
    """

    data: bytes
    source: str = "URDF"
    _links: list[LinkSpan] = field(default_factory=list)
    _joints: list[_Joint] = field(default_factory=list)
    _stack: list[str] = field(default_factory=list)
    _open: LinkSpan | None = None
    _joint: _Joint | None = None
    _inertial_at: int = -1
    robot: str = ""
    pose: Mapping[str, float] = field(default_factory=dict)

    kind: ClassVar[str] = "urdf"
    """Which form of ``<inertial>`` it has."""

    def __post_init__(self) -> None:
        if self.data[:2] in (b"\xff\xfe", b"\xfe\xff"):
            raise InputError(f"{self.source}: UTF-16 is not supported for a URDF; save it as UTF-8")
        parser = expat.ParserCreate(namespace_separator=None)
        parser.StartDoctypeDeclHandler = self._doctype
        parser.StartElementHandler = lambda tag, attributes: self._start(parser, tag, attributes)
        parser.EndElementHandler = lambda tag: self._end(parser, tag)
        try:
            parser.Parse(self.data, True)
        except expat.ExpatError as error:
            raise InputError(f"{self.source}: this is not valid XML ({error})") from error
        count = Counter(self.names)
        problems = [f"has {number} links named {name}" for name, number in count.items() if number > 1]
        problems += [
            f"the link {link.name} has {link.inertials} <inertial>"
            for link in self._links
            if link.inertials > 1
        ]
        if problems:
            raise InputError(f"{self.source}: {'; '.join(problems)}; a link and its inertial are there once")

    @property
    def unused(self) -> str:
        """Say why the simulator would not use what is filled in; "" if it does."""
        return ""

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the links, in the file's order."""
        return tuple(span.name for span in self._links)

    @property
    def meshes(self) -> dict[str, tuple[str, ...]]:
        """Return link → file names of its visual and collision meshes."""
        return {span.name: tuple(span.meshes) for span in self._links}

    def shapes(self, link: str) -> tuple[UrdfShape, ...]:
        """Return the visual shapes of a link, or its collision shapes if it has no visual one."""
        (span,) = (span for span in self._links if span.name == link)
        visual = tuple(shape for shape in span.shapes if not shape.collision)
        return visual or tuple(span.shapes)

    @property
    def impossible(self) -> dict[str, str]:
        """Return link → what no rigid body can have in the inertia that the file gives it."""
        return {
            span.name: words for span in self._links if span.stated and (words := _impossible(span.stated))
        }

    @cached_property
    def frames(self) -> dict[str, Floats]:
        """Return link → placement (4, 4) [m] of its frame in the root link's frame, with the joints at
        their positions in :attr:`pose`, zero if they have none there.

        It is empty if there is a :attr:`problem`.
        """
        return {} if self.problem else self._placements

    @cached_property
    def problem(self) -> str:
        """Say why the joints do not give the places of the links: no tree, or no numbers; otherwise ""."""
        try:
            self._placements  # noqa: B018 - asked for what it raises
        except InputError as error:
            return str(error)
        return ""

    @cached_property
    def _placements(self) -> dict[str, Floats]:
        return {name: self._placement(name) for name in self.names}

    @cached_property
    def doubts(self) -> tuple[str, ...]:
        """Report what is odd about the joints' origins although they can be read: more than a turn means
        degrees.
        """
        turned = [
            f"{joint.parent} → {joint.child} (rpy=“{joint.rpy}”)"
            for joint in self._joints
            if np.abs(_numbers(joint.rpy)).max() > MOST_RAD
        ]
        if not turned:
            return ()
        words = f"joints that turn by more than a whole turn: {', '.join(turned)}; rpy is in rad"
        return (f"{self.source}: {words}",)

    @cached_property
    def root(self) -> str:
        """Return the link to which all others are attached: ``base_link`` if there is one, else the tree's
        root.
        """
        below = {joint.child for joint in self._joints}
        roots = [name for name in self.names if name not in below]
        return roots[0] if len(roots) == 1 and ROOT_LINK not in self.names else ROOT_LINK

    @cached_property
    def fused_base(self) -> tuple[str, ...]:
        """Return the root and all links that are fixed to it: MuJoCo makes them part of its world."""
        fixed = {joint.child for joint in self._joints if joint.kind == "fixed"}
        if self.problem:
            return ()
        below = {joint.child for joint in self._joints}
        return tuple(
            name
            for name in self.names
            if all(joint.child in fixed for joint in self._way_up(name))
            and (name in fixed or name not in below)
        )

    @cached_property
    def loose(self) -> frozenset[str]:
        """Return the links that no joints connect to the root; the places of their frames are unknown."""
        if self.problem:
            return frozenset()
        tops = {name: [name, *(j.parent for j in self._way_up(name))][-1] for name in self.names}
        often = [top for top, _ in Counter(tops.values()).most_common(1)]
        return frozenset(name for name, top in tops.items() if top != tops.get(self.root, *often))

    @cached_property
    def _above(self) -> dict[str, _Joint]:
        above: dict[str, _Joint] = {}
        for joint in self._joints:
            if joint.child in above:
                raise InputError(f"{self.source}: the link {joint.child} has two parents; a URDF is a tree")
            above[joint.child] = joint
        return above

    def _way_up(self, link: str) -> Iterator[_Joint]:
        seen = {link}
        while link in self._above:
            joint = self._above[link]
            yield joint
            link = joint.parent
            if link in seen:
                raise InputError(f"{self.source}: the joints form a ring through {link}; a URDF is a tree")
            seen.add(link)

    def _placement(self, link: str) -> Floats:
        matrix: Floats = np.eye(4)
        for joint in self._way_up(link):
            xyz, rpy = _numbers(joint.xyz), _numbers(joint.rpy)
            if len(xyz) != 3 or len(rpy) != 3 or not np.isfinite([*xyz, *rpy]).all():
                raise InputError(
                    f"{self.source}: the joint {joint.parent} → {joint.child} has the origin "
                    f"xyz=“{joint.xyz}” rpy=“{joint.rpy}”, wanted three numbers each; "
                    "a xacro file must be expanded first"
                )
            matrix = origin_frame(xyz, rpy) @ self._moved(joint) @ matrix
        return matrix

    def _moved(self, joint: _Joint) -> Floats:
        """Return (4, 4) of a joint's own motion at its position in :attr:`pose`."""
        position = self._position(joint)
        matrix: Floats = np.eye(4)
        if not position or joint.kind not in MOVING:
            return matrix
        axis = np.array(_numbers(joint.axis))
        length = float(np.linalg.norm(axis)) if axis.shape == (3,) else 0.0
        if not np.isfinite(length) or length == 0:
            words = f"the joint {joint.name} has the axis “{joint.axis}”, wanted three numbers"
            raise InputError(f"{self.source}: {words}")
        axis = axis / length
        if joint.kind == "prismatic":
            matrix[:3, 3] = axis * position
            return matrix
        x, y, z = axis.tolist()
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        # Rodrigues' rotation.
        matrix[:3, :3] += math.sin(position) * cross + (1 - math.cos(position)) * cross @ cross
        return matrix

    def _position(self, joint: _Joint) -> float:
        if joint.name in self.pose or joint.mimic is None:
            return self.pose.get(joint.name, 0.0)
        leader, multiplier, offset = joint.mimic
        return multiplier * self.pose.get(leader, 0.0) + (offset if leader in self.pose else 0.0)

    def at(self, pose: Mapping[str, float]) -> Self:
        """Return the same URDF with its joints at these positions [rad or m].

        Raises InputError for a joint that it does not have, or that does not move.
        """
        kinds = {joint.name: joint.kind for joint in self._joints}
        for name in pose:
            if name not in kinds:
                joints = ", ".join(kinds) or "none"
                raise InputError(
                    message(
                        "{source}: there is no joint {name}; it has {joints}",
                        source=self.source,
                        name=name,
                        joints=joints,
                    )
                )
            if kinds[name] not in MOVING:
                raise InputError(
                    message(
                        "{source}: the joint {name} is {kind}, and has no position",
                        source=self.source,
                        name=name,
                        kind=kinds[name] or "?",
                    )
                )
        return type(self)(self.data, self.source, pose=pose)

    def _doctype(self, *_: Any) -> None:
        raise InputError(f"{self.source}: has a DOCTYPE, which a URDF does not need and which is not read")

    def _start(self, parser: expat.XMLParserType, tag: str, attributes: dict[str, str]) -> None:
        here = parser.CurrentByteIndex
        if not self._stack and tag != "robot":
            raise InputError(f"{self.source}: wanted a URDF (<robot>), got <{tag}>")
        above = self._stack[-1] if self._stack else ""
        if tag == "robot" and not self._stack:
            self.robot = attributes.get("name", "")
        if self._open is not None:
            self._in_link(self._open, tag, above, attributes)
        if self._open is not None and above == "link":
            self._open.first_child = self._open.first_child or here
            if tag == "inertial":
                self._inertial_at = here
        elif tag == "link" and "gazebo" not in self._stack and above != "joint" and "name" in attributes:
            end, closed = self._tag_end(here)
            self._open = LinkSpan(attributes["name"], here, end, closed)
        elif tag == "joint" and "gazebo" not in self._stack:
            self._joint = _Joint(name=attributes.get("name", ""), kind=attributes.get("type", ""))
        elif self._open is not None and tag == "mesh" and "filename" in attributes:
            self._open.meshes.append(attributes["filename"])
        elif self._joint is not None and above == "joint":
            self._in_joint(self._joint, tag, attributes)
        self._stack.append(tag)

    @staticmethod
    def _in_link(link: LinkSpan, tag: str, above: str, attributes: dict[str, str]) -> None:
        if tag in ("visual", "collision") and above == "link":
            link.shapes.append(UrdfShape(tag == "collision"))
        elif above in ("visual", "collision") and tag == "origin" and link.shapes:
            link.shapes[-1].xyz = tuple(_numbers(attributes.get("xyz", "0 0 0")))
            link.shapes[-1].rpy = tuple(_numbers(attributes.get("rpy", "0 0 0")))
        elif above == "geometry" and link.shapes:
            link.shapes[-1].kind, link.shapes[-1].values = tag, attributes
        elif above == "inertial" and tag in ("mass", "inertia"):
            link.stated[tag] = attributes

    @staticmethod
    def _in_joint(joint: _Joint, tag: str, attributes: dict[str, str]) -> None:
        if tag == "parent":
            joint.parent = attributes.get("link", "")
        elif tag == "child":
            joint.child = attributes.get("link", "")
        elif tag == "origin":
            joint.xyz = attributes.get("xyz", joint.xyz)
            joint.rpy = attributes.get("rpy", joint.rpy)
        elif tag == "axis":
            joint.axis = attributes.get("xyz", joint.axis)
        elif tag == "mimic":
            multiplier, offset = (
                (_numbers(attributes.get(key, usual)) or [math.nan])[0]
                for key, usual in (("multiplier", "1"), ("offset", "0"))
            )
            joint.mimic = attributes.get("joint", ""), multiplier, offset

    def _end(self, parser: expat.XMLParserType, tag: str) -> None:
        here = parser.CurrentByteIndex
        self._stack.pop()
        above = self._stack[-1] if self._stack else ""
        if self._open is not None and tag == "inertial" and above == "link":
            # For a tag that closes itself expat gives the place behind it as that of its end.
            first, closed = self._tag_end(self._inertial_at)
            self._open.inertial = (self._inertial_at, first if closed else self._tag_end(here)[0])
            self._open.inertials += 1
        elif self._open is not None and tag == "link":
            self._open.end = here
            self._links.append(self._open)
            self._open = None
        elif self._joint is not None and tag == "joint":
            if self._joint.parent and self._joint.child:
                self._joints.append(self._joint)
            self._joint = None

    def _tag_end(self, start: int) -> tuple[int, bool]:
        """Find the end of the tag that begins at ``start``, and if it closes itself. A quoted ">" is no
        end.
        """
        match = _TAG.match(self.data, start)
        if match is None:
            raise InputError(f"{self.source}: a tag at byte {start} has no end")
        return match.end(), match[0].endswith(b"/>")


def _numbers(text: str) -> list[float]:
    try:
        return [float(value) for value in text.split()] or [math.nan]
    except ValueError:
        return [math.nan]


def _impossible(stated: Mapping[str, Mapping[str, str]]) -> str:
    """Say what is impossible about the mass and the inertia of an <inertial>; "" if a rigid body has them."""
    mass = (_numbers(stated.get("mass", {}).get("value", "")) or [math.nan])[0]
    values = [(_numbers(stated.get("inertia", {}).get(key, "0")) or [math.nan])[0] for key in _TENSOR]
    if not np.isfinite([mass, *values]).all():
        return "its mass or a moment of inertia is no finite number"
    if mass < 0:
        return f"its mass is negative ({mass:g} kg)"
    xx, xy, xz, yy, yz, zz = values
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    problems = MassProps(mass, np.zeros(3), tensor).check() if mass > 0 else ()
    return f"its inertia tensor {tensor_words(problems)}" if problems else ""


_TENSOR = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
