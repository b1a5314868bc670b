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
from typing import TYPE_CHECKING

from silo.api.revisions import Standing, has_model
from silo.api.transport import Cancel
from silo.api.wire import Revision
from silo.bom.compare.states import ComparedAssembly
from silo.bom.compare.three_states import ThreeLines, compare_three
from silo.bom.compare.two_states import LineChange, compare_assemblies
from silo.bom.entry import Extraction
from silo.bom.errors import InputError, listed
from silo.bom.items.naming import display_name
from silo.bom.message import message
from silo.bom.walk.links import extract
from silo.bom.walk.roots import choose_assembly
from silo.fcstd import Library
from silo.fcstd.contents import FileContents
from silo.platform.whole_files import remove_patiently, scratch_folder

if TYPE_CHECKING:
    from silo.api.client import SiloClient


def top_of(extraction: Extraction) -> ComparedAssembly:
    """Return the assembly itself with its direct lines."""
    return ComparedAssembly(extraction.assembly, tuple(extraction.entries))


def bom_in(content: Path | str, path: str) -> ComparedAssembly | None:
    """Read the BOM of a file that belongs at ``path``; None for a part, and for a file with several
    assemblies.
    """
    contents = FileContents(instead={os.path.realpath(path): os.fspath(content)})
    with Library(contents=contents) as library:
        try:
            return top_of(extract(choose_assembly(library.open(path))))
        except InputError:
            return None


@dataclass
class RevisionBoms:
    """BOMs of the revisions of one item, each file fetched once. Close it, or use it in a ``with`` block."""

    client: SiloClient
    part_number: str
    path: str
    cancelled: Cancel | None = None
    _known: dict[int, ComparedAssembly | None] = field(default_factory=dict)
    _stack: ExitStack = field(default_factory=ExitStack)

    def __enter__(self) -> RevisionBoms:
        self._folder = Path(self._stack.enter_context(scratch_folder("silo-revisions-")))
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def bom(self, number: int) -> ComparedAssembly | None:
        """Download a revision and read its BOM; None for a part."""
        if number not in self._known:
            target = self._folder / f"{number}.FCStd"
            self.client.download_file(self.part_number, target, number, cancelled=self.cancelled)
            self._known[number] = bom_in(target, self.path)
            remove_patiently(target)
        return self._known[number]

    def change(self, older: int | None, newer: int) -> tuple[LineChange, ...]:
        """Return the lines that differ between two revisions; all lines if there is no older one."""
        before, after = self.bom(older) if older is not None else None, self.bom(newer)
        changes = compare_assemblies([before] if before else [], [after] if after else [])
        return tuple(line for change in changes for line in change.lines)

    def three(self, stands: Standing, mine: ComparedAssembly | None) -> tuple[ThreeLines, ...]:
        """Compare base → theirs → mine, if all three are assemblies."""
        if mine is None or stands.newest is None:
            return ()
        theirs = self.bom(stands.newest.revision_number)
        base = self.bom(stands.base.revision_number) if stands.base is not None else None
        return compare_three(base, theirs, mine) if theirs is not None else ()


def file_revisions(revisions: Sequence[Revision]) -> list[Revision]:
    """Return the revisions with a model, newest first."""
    return sorted(filter(has_model, revisions), key=lambda revision: revision.revision_number, reverse=True)


def words(lines: Sequence[LineChange], most: int = 6) -> str:
    """Write a difference in one line, such as ``+ Bolt 4, - Plate 1, Nut 4 → 8``."""
    return listed(line_texts(lines), most)


def line_texts(lines: Iterable[LineChange]) -> list[str]:
    """Write each line of a difference in words."""
    texts = []
    for line in lines:
        name = display_name(line.entry) or line.entry.object_name
        if line.old is None:
            texts.append(f"+ {name} {line.entry.quantity:g}")
        elif line.new is None:
            texts.append(f"- {name} {line.entry.quantity:g}")
        elif line.old.quantity != line.new.quantity:
            texts.append(
                message(
                    "{name} {before} → {after}",
                    name=name,
                    before=f"{line.old.quantity:g}",
                    after=f"{line.new.quantity:g}",
                )
            )
        else:
            texts.append(message("{name} moved", name=name))
    return texts
