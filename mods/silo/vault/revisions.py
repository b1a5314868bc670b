# SPDX-License-Identifier: LGPL-2.1-or-later
"""The BOMs of an item's revisions, read from their files: what a colleague changed, and when.

A revision's file is read as if it lay where the user's file lies, so that its links lead to the user's other
files: the lines of two revisions, and those of the file at hand, are then named alike.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from silo.api.revisions import Downloads, Standing, has_file
from silo.api.transport import Cancel
from silo.api.wire import Revision
from silo.bom.changes import Assembly, LineChange, ThreeLines, compare_assemblies, compare_three
from silo.bom.errors import InputError
from silo.bom.links import extract
from silo.bom.model import Extraction
from silo.bom.naming import display_name
from silo.bom.roots import choose_assembly
from silo.durable import remove_patiently
from silo.fcstd import Library
from silo.fcstd.library import Contents
from silo.folders import scratch_folder


class RevisionsApi(Downloads, Protocol):
    """What is needed of a Silo; :class:`silo.api.client.SiloClient` has it."""

    def revisions(
        self, part_number: str, /, *, newest: int | None = None, after: int = 0
    ) -> list[Revision]: ...


def top_of(extraction: Extraction) -> Assembly:
    """The assembly itself with its direct lines."""
    return Assembly(extraction.assembly, tuple(extraction.entries))


def bom_in(content: Path | str, path: str) -> Assembly | None:
    """The BOM of a file that belongs at ``path``; None for a part, or where it holds several assemblies."""
    contents = Contents(instead={os.path.realpath(path): os.fspath(content)})
    with Library(contents=contents) as library:
        try:
            return top_of(extract(choose_assembly(library.open(path))))
        except InputError:
            return None


@dataclass
class RevisionBoms:
    """BOMs of the revisions of one item, each file fetched once. Close it, or use it in a ``with`` block."""

    client: RevisionsApi
    part_number: str
    path: str
    cancelled: Cancel | None = None
    _known: dict[int, Assembly | None] = field(default_factory=dict)
    _stack: ExitStack = field(default_factory=ExitStack)

    def __enter__(self) -> RevisionBoms:
        self._folder = Path(self._stack.enter_context(scratch_folder("silo-revisions-")))
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def bom(self, number: int) -> Assembly | None:
        """The BOM of a revision; None for a part."""
        if number not in self._known:
            target = self._folder / f"{number}.FCStd"
            self.client.download_file(self.part_number, target, number, cancelled=self.cancelled)
            self._known[number] = bom_in(target, self.path)
            remove_patiently(target)
        return self._known[number]

    def change(self, older: int | None, newer: int) -> tuple[LineChange, ...]:
        """The lines that differ between two revisions; all of them where there is no older one."""
        before, after = self.bom(older) if older is not None else None, self.bom(newer)
        changes = compare_assemblies([before] if before else [], [after] if after else [])
        return tuple(line for change in changes for line in change.lines)

    def three(self, stands: Standing, mine: Assembly | None) -> tuple[ThreeLines, ...]:
        """Base → theirs → mine, where all of them are assemblies."""
        if mine is None or stands.newest is None:
            return ()
        theirs = self.bom(stands.newest.revision_number)
        base = self.bom(stands.base.revision_number) if stands.base is not None else None
        return compare_three(base, theirs, mine) if theirs is not None else ()


def file_revisions(revisions: Sequence[Revision]) -> list[Revision]:
    """Those with a file, newest first."""
    return sorted(filter(has_file, revisions), key=lambda one: one.revision_number, reverse=True)


def words(lines: Sequence[LineChange], most: int = 6) -> str:
    """A difference in one line, such as ``+ Bolt 4, - Plate 1, Nut 4 → 8``."""
    more = f", and {len(lines) - most} more" if len(lines) > most else ""
    return ", ".join(line_texts(lines[:most])) + more


def line_texts(lines: Iterable[LineChange]) -> list[str]:
    """The lines of a difference in words."""
    told = []
    for line in lines:
        name = display_name(line.entry) or line.entry.object_name
        if line.old is None:
            told.append(f"+ {name} {line.entry.quantity:g}")
        elif line.new is None:
            told.append(f"- {name} {line.entry.quantity:g}")
        elif line.old.quantity != line.new.quantity:
            told.append(f"{name} {line.old.quantity:g} → {line.new.quantity:g}")
        else:
            told.append(f"{name} moved")
    return told
