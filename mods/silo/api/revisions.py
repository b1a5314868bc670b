# SPDX-License-Identifier: LGPL-2.1-or-later
"""What an item's revisions say about a file of ours. Pure."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from silo.api.arrived import checksum_of

if TYPE_CHECKING:
    from silo.api.wire import Revision


@dataclass(frozen=True)
class Standing:
    """How a file stands to its item's revisions.

    base
        the revision that it was made from; None where it is none of them.
    newest
        the newest revision with a file; None where there is none.
    """

    base: Revision | None
    newest: Revision | None

    @property
    def newer(self) -> Revision | None:
        """The revision that committing the file would undo; None where it would undo nothing."""
        if self.newest is None or self.newest.revision_number <= self.base_number:
            return None
        return self.newest

    @property
    def base_number(self) -> int:
        """The base's number; -1 where it is not known, so that any revision is newer."""
        return self.base.revision_number if self.base is not None else -1


def has_file(revision: Revision) -> bool:
    """True for a revision with a file; the others only change properties."""
    return bool(revision.file_checksum or revision.file_name or revision.file_key or revision.file_size)


def standing(
    revisions: Iterable[Revision], origin: str, known: int | None = None, seen: int | None = None
) -> Standing:
    """How a file that was made from ``origin`` (a SHA-256) stands.

    known
        the number of that revision, for a server that keeps no checksums.
    seen
        the newest revision that a person has seen and decided about.
    """
    files = sorted((r for r in revisions if has_file(r)), key=lambda r: r.revision_number)
    mine = [r for r in files if checksum_of(r) == origin or r.revision_number in (known, seen)]
    # What a person saw may be gone from the list, or have no file: the newest up to it then.
    mine += [r for r in files if seen is not None and r.revision_number <= seen]
    base = max(mine, key=lambda r: r.revision_number, default=None)
    return Standing(base, files[-1] if files else None)


def newest_number(revisions: Iterable[Revision]) -> int:
    """The number of the newest revision; 0 where there is none."""
    return max((revision.revision_number for revision in revisions), default=0)


def is_newest(sha256: str, revisions: Iterable[Revision]) -> bool:
    """True where the newest revision is this very file. An older one does not count: a person may go back."""
    newest = max(revisions, key=lambda revision: revision.revision_number, default=None)
    return newest is not None and checksum_of(newest) == sha256


def other_name(path: str, revisions: Iterable[Revision]) -> str:
    """The name of the item's newest file, where this one is called otherwise; "" where it is not.

    "Save As" copies the identity along.
    """
    named = [revision for revision in revisions if revision.file_name]
    if not named:
        return ""
    newest = max(named, key=lambda revision: revision.revision_number)
    known = os.path.basename(str(newest.file_name))
    return known if known.casefold() != os.path.basename(path).casefold() else ""
