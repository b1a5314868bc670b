# SPDX-License-Identifier: LGPL-2.1-or-later
"""Answers about files, and the trail of each: all that it depends on."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

import silo.bom
import silo.fcstd
from silo.fcstd.container import FileState
from silo.fcstd.facts import Remembered
from silo.fcstd.library import Content, Library
from silo.fcstd.limits import FcstdError
from silo.fcstd.locate import Found, NotFound

FORMAT = 4
_ENCODER = json.JSONEncoder(separators=(",", ":"))
_SETTLED_NS = 2_500_000_000  # FAT has ticks of 2 s, the coarsest in use


@cache
def engine() -> str:
    """A name for the code that reads documents: another one where any of it differs."""
    digest = sha256(f"{FORMAT}".encode())
    for package in (silo.bom, silo.fcstd):
        for folder in package.__path__:
            for file in sorted(Path(folder).rglob("*.py")):
                digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]


class Seen(NamedTuple):
    """A file at the time of a look. ``content`` begins with "!" for a file that could not be read."""

    content: str
    inode: int
    size: int
    modified_ns: int
    changed_ns: int
    read_ns: int

    @classmethod
    def of(cls, content: Content | Remembered) -> Seen:
        """What was read."""
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
    def unread(cls, error: FcstdError) -> Seen | None:
        """What could not be read: known by its state, so that any change of it counts. None without one."""
        state = error.state
        if not isinstance(state, FileState):
            return None
        content = f"!{state.inode}:{state.size}:{state.modified_ns}:{error.reason}"
        return cls(content, state.inode, state.size, state.modified_ns, 0, 0)

    def text(self) -> str:
        """For the index."""
        return f"{self.inode} {self.size} {self.modified_ns} {self.changed_ns} {self.read_ns} {self.content}"

    @classmethod
    def from_text(cls, text: str) -> Seen:
        """What :meth:`text` wrote."""
        *numbers, content = text.split(" ", 5)
        return cls(content, *map(int, numbers))

    def still(self, status: os.stat_result) -> bool:
        """True where the file certainly is what it was then."""
        then = (self.inode, self.size, self.modified_ns, self.changed_ns)
        now = (status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns)
        return then == now and max(self.modified_ns, self.changed_ns) + _SETTLED_NS < self.read_ns


class Known(NamedTuple):
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
    seen: Mapping[str, Seen] = {}
    lasting: bool = True

    @classmethod
    def found_in(cls, library: Library, answer: Any) -> Known:
        """An answer that was found in a session which did nothing else."""
        seen: dict[str, Seen] = {}
        lasting = True
        for path, document in library.documents.items():
            if not isinstance(document, FcstdError):
                seen[path] = Seen.of(document.content)
            elif (unread := Seen.unread(document)) is not None:
                seen[path] = unread
            else:
                lasting = False
        led: dict[tuple[str, ...], dict[str, str]] = {}
        for (folders, recorded), found in library.lookups.items():
            if isinstance(found, Found) and found.real in seen and found.is_straight(recorded, folders[0]):
                continue
            led.setdefault(folders, {})[recorded] = led_to(found)
        if len(seen) == 1 and not led:
            return cls(json_of(answer), next(iter(seen.values())).content, seen, lasting)
        files = {path: one.content for path, one in seen.items()}
        return cls(json_of(answer), json_of([files, list(led.items())]), seen, lasting)

    @property
    def is_of_one_file(self) -> bool:
        """True where nothing but the very file that was asked about was read, and no link followed."""
        return not self.trail.startswith("[")

    @property
    def links(self) -> frozenset[str]:
        """The files that links lead to, counted or not; of those that are not there what is recorded."""
        if self.is_of_one_file:
            return frozenset()
        files, lookups = json.loads(self.trail)
        found = frozenset(
            _target(to) or os.path.normpath(os.path.join(folders[-1], recorded))
            for folders, led in lookups
            for recorded, to in led.items()
        )
        return found.union(files) - {next(iter(files), "")}


def led_to(found: Found | NotFound) -> str:
    if isinstance(found, NotFound):
        return f"!{found.code}:{found.detail}"
    if found.opened == found.real and not found.respelt:
        return found.real
    return f"{found.opened}\0{found.real}\0{found.respelt}"


def _target(led: str) -> str | None:
    return None if led.startswith("!") else (led.split("\0") * 2)[1]


def json_of(value: Any) -> str:
    # Escaped: a file's name need not be valid Unicode, and SQLite takes nothing else.
    return _ENCODER.encode(value)
