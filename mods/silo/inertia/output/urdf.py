# SPDX-License-Identifier: LGPL-2.1-or-later
"""A URDF with its ``<inertial>`` elements filled in, every other byte of the file as it was.

An XML library that writes a file again changes quotes, spaces, comments' places; people's diffs then show the
whole file. So the places are found with expat, which gives byte positions, and only they are replaced.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.parsers import expat

import numpy as np

from silo.bom.errors import InputError
from silo.inertia.core import Floats, MassProps
from silo.inertia.links import MOST_RAD, ROOT_LINK, origin_frame
from silo.inertia.output.files import write_whole
from silo.inertia.output.snippets import urdf_inertial

MAX_BYTES = 64 * 1024 * 1024


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


def fill_urdf(data: bytes, links: Mapping[str, MassProps], source: str = "URDF") -> Filled:
    """Replace or insert ``<inertial>`` of the named links; the rest of the file stays byte for byte.

    Raises InputError where ``data`` is no URDF that can be read (also for DOCTYPE: not needed in a URDF, and
    a way to attack its reader).
    """
    spans = _links_of(data, source)
    by_name = {span.name: span for span in spans}
    newline = b"\r\n" if b"\r\n" in data else b"\n"
    edits: list[tuple[int, int, bytes]] = []
    for name, props in links.items():
        if name in by_name:
            edits.append(_edit(data, by_name[name], props, newline))
    result = data
    for start, end, text in sorted(edits, key=lambda edit: edit[0], reverse=True):
        result = result[:start] + text + result[end:]
    return Filled(
        result,
        tuple(name for name in links if name in by_name),
        tuple(name for name in links if name not in by_name),
        tuple(span.name for span in spans if span.name not in links),
    )


def write_urdf(path: Path | str, links: Mapping[str, MassProps], target: Path | str | None = None) -> Filled:
    """Fill a URDF file in place, or into ``target``; whole or not at all.

    Where it has none of ``links``, nothing is written, and ``Filled.written`` is empty.
    """
    filled = fill_urdf(read_urdf(path), links, str(path))
    if filled.written:
        write_whole(target if target is not None else path, filled.data, like=path)
    return filled


def link_names(data: bytes, source: str = "URDF") -> tuple[str, ...]:
    """The links of a URDF, in its order. InputError as :func:`fill_urdf`."""
    return tuple(span.name for span in _links_of(data, source))


def link_meshes(data: bytes, source: str = "URDF") -> dict[str, tuple[str, ...]]:
    """Link → file names of its visual and collision meshes. InputError as :func:`fill_urdf`."""
    return {span.name: tuple(span.meshes) for span in _links_of(data, source)}


def read_urdf(path: Path | str) -> bytes:
    """The file's bytes; InputError where it is absent or far too large."""
    try:
        if Path(path).stat().st_size > MAX_BYTES:
            raise InputError(f"{path}: larger than {MAX_BYTES // 2**20} MB, which no URDF is")
        return Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"{path}: the URDF cannot be read ({error.strerror or error})") from error


def _links_of(data: bytes, source: str) -> Sequence[_Span]:
    """The links, each once. Two of one name, or two inertials in one link: nobody knows which one counts."""
    spans = _Reader(data, source).links
    count = Counter(span.name for span in spans)
    problems = [f"has {number} links named {name}" for name, number in count.items() if number > 1]
    problems += [
        f"the link {span.name} has {span.inertials} <inertial>" for span in spans if span.inertials > 1
    ]
    if problems:
        raise InputError(f"{source}: {'; '.join(problems)}; a link and its inertial are there once")
    return spans


def _edit(data: bytes, span: _Span, props: MassProps, newline: bytes) -> tuple[int, int, bytes]:
    indent = _indent_before(data, span.start)
    inner = indent + b"  "
    if span.first_child is not None:
        inner = _indent_before(data, span.first_child) or inner
    text = (newline + inner).join(line.encode("ascii") for line in urdf_inertial(props).split("\n"))
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
class _Reader:
    """Positions of links, and joints, of one URDF."""

    data: bytes
    source: str
    links: list[_Span] = field(default_factory=list)
    joints: list[_Joint] = field(default_factory=list)
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
            raise InputError(f"{self.source}: this is no XML that can be read ({error})") from error

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
            self.links.append(self._open)
            self._open = None
        elif self._joint is not None and tag == "joint":
            if self._joint.parent and self._joint.child:
                self.joints.append(self._joint)
            self._joint = None

    def _tag_end(self, start: int) -> tuple[int, bool]:
        """Where the tag that begins at ``start`` ends, and whether it closes itself; a quoted ">" is none."""
        found = re.compile(rb"<(?:\"[^\"]*\"|'[^']*'|[^>\"'])*>").match(self.data, start)
        if found is None:
            raise InputError(f"{self.source}: a tag at byte {start} has no end")
        return found.end(), found[0].endswith(b"/>")


def urdf_frames(data: bytes, source: str = "URDF") -> dict[str, Floats]:
    """Link → (4, 4) placement of its frame in the root link's frame, all joints at position zero [m].

    Raises InputError where joints do not form a tree, or their origins are no numbers (xacro: expand first).
    """
    reader = _Reader(data, source)
    above = _parents(reader)
    return {span.name: _placement(span.name, above, source) for span in reader.links}


def frame_doubts(data: bytes, source: str = "URDF") -> tuple[str, ...]:
    """What is odd about the joints' origins though it can be read: more than a turn is degrees."""
    turned = [
        f"{joint.parent} → {joint.child} (rpy=“{joint.rpy}”)"
        for joint in _Reader(data, source).joints
        if _turns(joint.rpy) > MOST_RAD
    ]
    if not turned:
        return ()
    return (f"{source}: joints that turn by more than a whole turn: {', '.join(turned)}; rpy is in rad",)


def _turns(rpy: str) -> float:
    try:
        return max((abs(float(value)) for value in rpy.split()), default=0.0)
    except ValueError:
        return 0.0


def root_link(data: bytes, source: str = "URDF") -> str:
    """The link that everything else hangs on: ``base_link`` where there is one, else the tree's root."""
    reader = _Reader(data, source)
    names = [span.name for span in reader.links]
    above = _parents(reader)
    roots = [name for name in names if name not in above]
    return roots[0] if len(roots) == 1 and ROOT_LINK not in names else ROOT_LINK


def _parents(reader: _Reader) -> dict[str, _Joint]:
    above: dict[str, _Joint] = {}
    for joint in reader.joints:
        if joint.child in above:
            raise InputError(f"{reader.source}: the link {joint.child} has two parents; a URDF is a tree")
        above[joint.child] = joint
    return above


def _placement(link: str, above: Mapping[str, _Joint], source: str) -> Floats:
    result: Floats = np.eye(4)
    seen = {link}
    while link in above:
        joint = above[link]
        result = _origin(joint, source) @ result
        link = joint.parent
        if link in seen:
            raise InputError(f"{source}: the joints form a ring through {link}; a URDF is a tree")
        seen.add(link)
    return result


def _origin(joint: _Joint, source: str) -> Floats:
    try:
        xyz = [float(value) for value in joint.xyz.split()]
        rpy = [float(value) for value in joint.rpy.split()]
    except ValueError:
        xyz, rpy = [], []
    if len(xyz) != 3 or len(rpy) != 3 or not np.isfinite([*xyz, *rpy]).all():
        raise InputError(
            f"{source}: the joint {joint.parent} → {joint.child} has the origin xyz=“{joint.xyz}” "
            f"rpy=“{joint.rpy}”, wanted three numbers each; a xacro file must be expanded first"
        )
    return origin_frame(xyz, rpy)
