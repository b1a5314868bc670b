# SPDX-License-Identifier: LGPL-2.1-or-later
"""A URDF with its ``<inertial>`` elements filled in, every other byte of the file as it was.

An XML library that writes a file again changes quotes, spaces, comments' places; people's diffs then show the
whole file. So the places are found with expat, which gives byte positions, and only they are replaced.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any
from xml.parsers import expat

import numpy as np

from silo.bom.errors import InputError
from silo.inertia.arrays import Floats
from silo.inertia.links.claims import ROOT_LINK
from silo.inertia.links.frames import MOST_RAD, origin_frame
from silo.inertia.output.snippets import inertial
from silo.inertia.output.whole_file import write_whole
from silo.inertia.rigid import MassProps

MAX_BYTES = 64 * 1024 * 1024

# From its first character to its end; a quoted ">" is no end.
_TAG = re.compile(rb"<(?:\"[^\"]*\"|'[^']*'|[^>\"'])*>")


@dataclass(eq=False)
class _Span:
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


@dataclass(frozen=True)
class Filled:
    """A new file, which links were written, which of ours it does not have, which of its own got nothing."""

    data: bytes
    written: tuple[str, ...]
    absent: tuple[str, ...]
    untouched: tuple[str, ...]


def write_urdf(urdf: Urdf, links: Mapping[str, MassProps], target: Path | str | None) -> Filled:
    """Fill a URDF into ``target``, completely or not at all; does nothing if it has none of ``links``."""
    filled = urdf.filled(links)
    if filled.written and target is not None:
        write_whole(target, filled.data, like=urdf.source)
    return filled


def read_urdf(path: Path | str) -> Urdf:
    """Read a URDF file; InputError if it is absent, far too large, or no readable URDF."""
    try:
        if Path(path).stat().st_size > MAX_BYTES:
            raise InputError(f"{path}: larger than {MAX_BYTES // 2**20} MB, which no URDF is")
        return Urdf(Path(path).read_bytes(), str(path))
    except OSError as error:
        raise InputError(f"{path}: the URDF cannot be read ({error.strerror or error})") from error


def _edit(data: bytes, span: _Span, props: MassProps, newline: bytes) -> tuple[int, int, bytes]:
    indent = _indent_before(data, span.start)
    inner = indent + b"  "
    if span.first_child is not None:
        inner = _indent_before(data, span.first_child) or inner
    text = (newline + inner).join(line.encode("ascii") for line in inertial(props).split("\n"))
    if span.inertial is not None:
        return (*span.inertial, text)
    if span.closed:
        slash = data.rindex(b"/", span.start, span.tag_end)
        body = b">" + newline + inner + text + newline + indent + b"</link>"
        return slash, span.tag_end, body
    if not data[span.tag_end : span.end].strip():
        return span.tag_end, span.end, newline + inner + text + newline + indent
    return span.tag_end, span.tag_end, newline + inner + text


def _indent_before(data: bytes, position: int) -> bytes:
    line = data[data.rfind(b"\n", 0, position) + 1 : position]
    return line if not line.strip() else b""


@dataclass(eq=False)
class _Joint:
    parent: str = ""
    child: str = ""
    xyz: str = "0 0 0"
    rpy: str = "0 0 0"


@dataclass(eq=False)
class Urdf:
    """One URDF: its links with their places in the text, and its joints.

    Raises InputError if ``data`` is no URDF that can be read (also for DOCTYPE: not needed in a URDF, and
    a way to attack its reader), and for two links of one name or two inertials in one link: nobody knows
    which one counts.
    """

    data: bytes
    source: str = "URDF"
    _links: list[_Span] = field(default_factory=list)
    _joints: list[_Joint] = field(default_factory=list)
    _stack: list[str] = field(default_factory=list)
    _open: _Span | None = None
    _joint: _Joint | None = None
    _inertial_at: int = -1

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
    def names(self) -> tuple[str, ...]:
        """Return the names of the links, in the file's order."""
        return tuple(span.name for span in self._links)

    @property
    def meshes(self) -> dict[str, tuple[str, ...]]:
        """Return link → file names of its visual and collision meshes."""
        return {span.name: tuple(span.meshes) for span in self._links}

    def filled(self, links: Mapping[str, MassProps]) -> Filled:
        """Replace or insert ``<inertial>`` of the named links; the rest of the file stays byte for byte."""
        newline = b"\r\n" if b"\r\n" in self.data else b"\n"
        data = self.data
        for span in sorted(self._links, key=lambda span: -span.start):
            if span.name in links:
                start, end, text = _edit(self.data, span, links[span.name], newline)
                data = data[:start] + text + data[end:]
        return Filled(
            data,
            tuple(name for name in links if name in self.names),
            tuple(name for name in links if name not in self.names),
            tuple(name for name in self.names if name not in links),
        )

    @cached_property
    def frames(self) -> dict[str, Floats]:
        """Return link → placement (4, 4) [m] of its frame in the root link's frame, with the joints at
        position zero.

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
            matrix = origin_frame(xyz, rpy) @ matrix
        return matrix

    def _doctype(self, *_: Any) -> None:
        raise InputError(f"{self.source}: has a DOCTYPE, which a URDF does not need and which is not read")

    def _start(self, parser: expat.XMLParserType, tag: str, attributes: dict[str, str]) -> None:
        here = parser.CurrentByteIndex
        if not self._stack and tag != "robot":
            raise InputError(f"{self.source}: wanted a URDF (<robot>), got <{tag}>")
        above = self._stack[-1] if self._stack else ""
        if self._open is not None and above == "link":
            self._open.first_child = self._open.first_child or here
            if tag == "inertial":
                self._inertial_at = here
        elif tag == "link" and "gazebo" not in self._stack and above != "joint" and "name" in attributes:
            end, closed = self._tag_end(here)
            self._open = _Span(attributes["name"], here, end, closed)
        elif tag == "joint" and "gazebo" not in self._stack:
            self._joint = _Joint()
        elif self._open is not None and tag == "mesh" and "filename" in attributes:
            self._open.meshes.append(attributes["filename"])
        elif self._joint is not None and above == "joint":
            self._in_joint(self._joint, tag, attributes)
        self._stack.append(tag)

    @staticmethod
    def _in_joint(joint: _Joint, tag: str, attributes: dict[str, str]) -> None:
        if tag == "parent":
            joint.parent = attributes.get("link", "")
        elif tag == "child":
            joint.child = attributes.get("link", "")
        elif tag == "origin":
            joint.xyz = attributes.get("xyz", joint.xyz)
            joint.rpy = attributes.get("rpy", joint.rpy)

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
