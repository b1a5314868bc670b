# SPDX-License-Identifier: LGPL-2.1-or-later
"""Answers about files, and the trail of each: all that it depends on.

A file is unchanged if size, inode, time of modification and time of change are those of the look that read
it, and both times lie well before that look: a file system's clock has ticks, and two changes in one tick
look like one. Otherwise its content is compared.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any, NamedTuple

from silo.fcstd.container import FileStat
from silo.fcstd.contents import Content
from silo.fcstd.errors import FcstdError
from silo.fcstd.facts import Remembered
from silo.fcstd.library import Library
from silo.locator import FoundFile, NotFound

_ENCODER = json.JSONEncoder(separators=(",", ":"))

_SETTLED_NS = 2_500_000_000  # FAT has ticks of 2 s, the coarsest in use


class SeenFile(NamedTuple):
    """A file at the time of a look. ``content`` begins with "!" for a file that could not be read."""

    content: str
    inode: int
    size: int
    modified_ns: int
    changed_ns: int
    read_ns: int

    @classmethod
    def of(cls, content: Content | Remembered) -> SeenFile:
        """Make the record of a file that was read."""
        state = content.state
        return cls(
            content.digest,
            state.inode,
            state.size,
            state.modified_ns,
            content.changed_ns,
            content.read_ns,
        )

    @classmethod
    def unread(cls, error: FcstdError) -> SeenFile | None:
        """Make the record of a file that could not be read, with its state, so that any change counts. None
        if it has no state.
        """
        state = error.state
        if not isinstance(state, FileStat):
            return None
        content = f"!{state.inode}:{state.size}:{state.modified_ns}:{error.reason}"
        return cls(content, state.inode, state.size, state.modified_ns, 0, 0)

    def text(self) -> str:
        """Write it as a key for the index."""
        return f"{self.inode} {self.size} {self.modified_ns} {self.changed_ns} {self.read_ns} {self.content}"

    @classmethod
    def from_text(cls, text: str) -> SeenFile:
        """Read what :meth:`text` wrote."""
        *numbers, content = text.split(" ", 5)
        return cls(content, *map(int, numbers))

    def still(self, status: os.stat_result) -> bool:
        """Return True if the file certainly has not changed since."""
        then = (self.inode, self.size, self.modified_ns, self.changed_ns)
        now = (status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns)
        return then == now and max(self.modified_ns, self.changed_ns) + _SETTLED_NS < self.read_ns


class StoredAnswer(NamedTuple):
    """An answer with its trail; it travels between processes and machines.

    answer
        JSON.
    trail
        JSON: [{path: content}, [[folders in which links' paths begin, {recorded path: where it leads}], …]].
        Left out are links that lead straight to one of the files: they do as long as it lies there. Only the
        content where nothing was read but the very file that was asked about.
    seen
        path → the file when it was read; empty where the answer comes from the index.
    lasting
        False where the answer must not be kept: a file was being written, or its state is not known.
    """

    answer: str
    trail: str
    seen: Mapping[str, SeenFile] = {}
    lasting: bool = True

    @classmethod
    def found_in(cls, library: Library, answer: Any) -> StoredAnswer:
        """Make the record of an answer and of the files read for it; the session did nothing else."""
        seen: dict[str, SeenFile] = {}
        lasting = True
        for path, document in library.documents.items():
            if not isinstance(document, FcstdError):
                seen[path] = SeenFile.of(document.content)
            elif (unread := SeenFile.unread(document)) is not None:
                seen[path] = unread
            else:
                lasting = False
        led: dict[tuple[str, ...], dict[str, str]] = {}
        for (folders, recorded), location in library.lookups.items():
            if (
                isinstance(location, FoundFile)
                and location.real in seen
                and location.is_straight(recorded, folders[0])
            ):
                continue
            led.setdefault(folders, {})[recorded] = led_to(location)
        if len(seen) == 1 and not led:
            return cls(json_of(answer), next(iter(seen.values())).content, seen, lasting)
        files = {path: file.content for path, file in seen.items()}
        return cls(json_of(answer), json_of([files, list(led.items())]), seen, lasting)

    @property
    def is_of_one_file(self) -> bool:
        """Return True if only the file in question was read, and no link was followed."""
        return not self.trail.startswith("[")

    @property
    def links(self) -> frozenset[str]:
        """Return the files to which links lead, counted or not; for a missing file the recorded path."""
        if self.is_of_one_file:
            return frozenset()
        files, lookups = json.loads(self.trail)
        link_paths = frozenset(
            _target(to) or os.path.normpath(os.path.join(folders[-1], recorded))
            for folders, led in lookups
            for recorded, to in led.items()
        )
        return link_paths.union(files) - {next(iter(files), "")}


def led_to(location: FoundFile | NotFound) -> str:
    if isinstance(location, NotFound):
        return f"!{location.code}:{location.detail}"
    if location.opened == location.real and not location.respelt:
        return location.real
    return f"{location.opened}\0{location.real}\0{location.respelt}"


def _target(led: str) -> str | None:
    return None if led.startswith("!") else (led.split("\0") * 2)[1]


def json_of(value: Any) -> str:
    # Escaped: a file's name need not be valid Unicode, and SQLite takes nothing else.
    return _ENCODER.encode(value)
