# SPDX-License-Identifier: LGPL-2.1-or-later
"""A URDF with its ``<inertial>`` elements filled in, every other byte of the file as it was.

An XML library that writes a file again changes quotes, spaces, comments' places; people's diffs then show the
whole file. So only the places of the links are replaced.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from silo.bom.errors import InputError
from silo.inertia.mjcf_text import MjcfText, is_mjcf
from silo.inertia.output.snippets import inertial
from silo.inertia.output.whole_file import write_whole
from silo.inertia.rigid import MassProps
from silo.inertia.urdf_text import LinkSpan, UrdfText, read_bytes


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
    """Read a URDF or MJCF file; InputError if it is absent, far too large, or not readable."""
    data = read_bytes(path)
    return (Mjcf if is_mjcf(data) else Urdf)(data, str(path))


def _edit(data: bytes, span: LinkSpan, props: MassProps, newline: bytes, kind: str) -> tuple[int, int, bytes]:
    indent = _indent_before(data, span.start)
    inner = indent + b"  "
    if span.first_child is not None:
        inner = _indent_before(data, span.first_child) or inner
    text = (newline + inner).join(line.encode("ascii") for line in inertial(props, kind).split("\n"))
    if span.inertial is not None:
        return (*span.inertial, text)
    if span.closed:
        slash = data.rindex(b"/", span.start, span.tag_end)
        body = b">" + newline + inner + text + newline + indent + _ENDS[kind]
        return slash, span.tag_end, body
    if not data[span.tag_end : span.end].strip():
        return span.tag_end, span.end, newline + inner + text + newline + indent
    return span.tag_end, span.tag_end, newline + inner + text


_ENDS = {"urdf": b"</link>", "mjcf": b"</body>"}


def _indent_before(data: bytes, position: int) -> bytes:
    line = data[data.rfind(b"\n", 0, position) + 1 : position]
    return line if not line.strip() else b""


@dataclass(eq=False)
class Urdf(UrdfText):
    """A URDF that can be filled."""

    def filled(self, links: Mapping[str, MassProps]) -> Filled:
        """Replace or insert ``<inertial>`` of the named links; the rest of the file stays byte for byte.

        Raises InputError where the simulator would not use them.
        """
        if self.unused:
            raise InputError(self.unused)
        newline = b"\r\n" if b"\r\n" in self.data else b"\n"
        spans = [span for span in self._links if span.name in links]
        # Bodies of MJCF lie in each other, so the order is that of the places that change.
        edits = sorted(
            (_edit(self.data, span, links[span.name], newline, self.kind) for span in spans), reverse=True
        )
        data = self.data
        for start, end, text in edits:
            data = data[:start] + text + data[end:]
        return Filled(
            data,
            tuple(name for name in links if name in self.names),
            tuple(name for name in links if name not in self.names),
            tuple(name for name in self.names if name not in links),
        )


@dataclass(eq=False)
class Mjcf(Urdf, MjcfText):
    """An MJCF file that can be filled."""
