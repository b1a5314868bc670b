# SPDX-License-Identifier: LGPL-2.1-or-later
"""The contents of files, read once for several sessions."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar

from silo.bom.message import message
from silo.fcstd.container import DOCUMENT_XML, ContainerFile, Directory, FileStat
from silo.fcstd.errors import FcstdError
from silo.fcstd.facts import Remembered
from silo.fcstd.limits import Limits
from silo.fcstd.xmltext import SharedTexts, XmlText

# How many files' facts are kept as values: as many as a large vault needs at one time.
_REMEMBERED_AT_MOST = 20_000


@dataclass(frozen=True, slots=True)
class Content:
    """What was read of one file: its text, as far as it is unpacked, and the directory of its container.

    changed_ns
        when the file system last changed anything of the file (``st_ctime_ns``).
    read_ns
        a moment before it was opened, by this machine's clock.
    """

    xml: XmlText
    directory: Directory
    state: FileStat
    changed_ns: int
    read_ns: int

    @property
    def digest(self) -> str:
        """Return a text that distinguishes this content from any other."""
        return self.xml.digest(self.directory.raw)

    known: ClassVar[None] = None  # nothing that could spare reading it

    @property
    def size(self) -> int:
        """Return roughly how many bytes stay in memory; unpacked text is counted elsewhere."""
        return self.xml.packed_size + 2 * len(self.directory.raw) + 300 * self.directory.entry_count


class FileContents:
    """The contents of files for several sessions, one after the other: a file that many assemblies use is
    read once. Those that were not asked for longest are forgotten first.

    instead
        real path → a file that is read in its place, such as another revision of it.
    clock
        nanoseconds.
    """

    def __init__(
        self,
        limits: Limits | None = None,
        *,
        instead: Mapping[str, str] | None = None,
        clock: Callable[[], int] = time.time_ns,
    ) -> None:
        self.limits = limits or Limits()
        self._instead = dict(instead or {})
        self._clock = clock
        self.shared = SharedTexts(self.limits.resident)
        self.reads = 0
        self._known: OrderedDict[str, Content] = OrderedDict()
        self._remembered: OrderedDict[tuple[str, str], Remembered] = OrderedDict()
        self._size = 0

    def read(self, path: str) -> Content:
        """Return the content of a file; reads it if it is not in memory. Raises FcstdError."""
        if (known := self._known.get(path)) is not None:
            self._known.move_to_end(path)
            return known
        content = self._read(path)
        self.reads += 1
        self._keep(path, content)
        return content

    def _keep(self, path: str, content: Content) -> None:
        if (before := self._known.pop(path, None)) is not None:
            self._size -= before.size
        self._known[path] = content
        self._size += content.size
        while self._size > self.limits.resident and len(self._known) > 1:
            _, oldest = self._known.popitem(last=False)
            self._size -= oldest.size

    def remembered(self, path: str, facts: str) -> Remembered:
        """Return the content of a file whose facts are known."""
        content = self._remembered.get((path, facts))
        if content is None:
            content = self._remembered[path, facts] = Remembered(path, facts, self)
            if len(self._remembered) > _REMEMBERED_AT_MOST:
                self._remembered.popitem(last=False)
        return content

    def add(self, path: str, content: Content) -> None:
        """Take over what another process has read."""
        content.xml.shared = self.shared
        self._keep(path, content)

    def _read(self, path: str) -> Content:
        read_ns = self._clock()
        with ContainerFile(self._instead.get(path, path), self.limits) as container:
            entry = container.entry(DOCUMENT_XML)
            if entry is None:
                reason = message("it is not a FreeCAD document (there is no Document.xml in it)")
                raise FcstdError(path, reason, state=container.state)
            packed = container.packed(entry, self.limits.packed)
            if container.changed():
                raise FcstdError(
                    path, message("it is being written just now; try again"), state=container.state
                )
            xml = XmlText(path, entry, packed, self.limits, self.shared)
            return Content(xml, container.directory, container.state, container.changed_ns, read_ns)
