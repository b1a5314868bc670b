# SPDX-License-Identifier: LGPL-2.1-or-later
"""What an item's revisions say about a file of ours: what it was made from, and what is newer."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass

from silo.api.wire import Revision
from silo.bom.errors import NewerRevisionError
from silo.bom.message import message
from silo.checksums import bare_checksum, seen_as
from silo.file_kind import MODEL, kind_by_name
from silo.platform.device_names import no_device_name


@dataclass(frozen=True)
class Standing:
    """How a file stands to its item's revisions.

    base
        the revision that it was made from; None where it is none of them.
    newest
        the newest revision with a model; None where there is none.
    """

    base: Revision | None
    newest: Revision | None

    @property
    def newer(self) -> Revision | None:
        """Return the revision that committing the file would undo; None if it would undo nothing."""
        if self.newest is None or self.newest.revision_number <= self.base_number:
            return None
        return self.newest

    @property
    def base_number(self) -> int:
        """Return the base's number; -1 if it is not known, so that any revision is newer."""
        return self.base.revision_number if self.base is not None else -1

    def check(self, part_number: str) -> None:
        """Raise NewerRevisionError if committing the file would undo a newer revision."""
        if (newest := self.newer) is None:
            return
        made = (
            message("revision {base_number}", base_number=self.base_number)
            if self.base is not None
            else message("a file that is no revision in Silo")
        )
        raise NewerRevisionError(
            message(
                "{created_by} committed revision {revision_number} of {part_number}{comment}, and this was "
                "made from {made}. Sending it would undo that. Look at theirs; then send yours on top of "
                "it, or discard it and take theirs",
                created_by=newest.created_by or "Somebody",
                revision_number=newest.revision_number,
                part_number=part_number,
                comment=message(" ({comment})", comment=newest.comment) if newest.comment else "",
                made=made,
            ),
            newest.model_dump(mode="json", exclude={"properties", "links"}),
        )


def has_model(revision: Revision) -> bool:
    """Return True if the revision has a file that may be a model; a revision without a file only changes
    properties. A server that knows no kinds keeps drawings among models: the name says so, then the content.
    """
    kind = revision.kind or kind_by_name(revision.file_name or "")
    there = revision.file_checksum or revision.file_name or revision.file_key or revision.file_size
    return bool(there) and kind in ("", MODEL)


def standing(
    revisions: Iterable[Revision], origin: str, known: int | None = None, seen: str = ""
) -> Standing:
    """Compare a file that was made from ``origin`` (a SHA-256) with the revisions of its item.

    known
        the number of that revision, for a server that keeps no checksums. Otherwise the checksum decides,
        since a server that was restored from a backup gives the same numbers to other files.
    seen
        the newest revision that a user has seen and decided about: its number and its checksum.
    """
    files = sorted((r for r in revisions if has_model(r)), key=lambda r: r.revision_number)
    mine = [
        r
        for r in files
        if seen == seen_as(r.revision_number, r.file_checksum)
        or (checksum_of(r) == origin if checksum_of(r) else r.revision_number == known)
    ]
    base = max(mine, key=lambda r: r.revision_number, default=None)
    return Standing(base, files[-1] if files else None)


def newest_number(revisions: Iterable[Revision]) -> int:
    """Return the number of the newest revision; 0 if there is none."""
    return max((revision.revision_number for revision in revisions), default=0)


def is_newest(sha256: str, revisions: Iterable[Revision]) -> bool:
    """Return True if the newest revision is this very file. An older one does not count: a user may go back
    to it.
    """
    newest = max(revisions, key=lambda revision: revision.revision_number, default=None)
    return newest is not None and checksum_of(newest) == sha256


def other_name(path: str, revisions: Iterable[Revision]) -> str:
    """Return the name of the item's newest file if ``path`` has another name; "" if it has the same.

    "Save As" copies the identity along.
    """
    named = [revision for revision in revisions if revision.file_name and has_model(revision)]
    if not named:
        return ""
    newest = max(named, key=lambda revision: revision.revision_number)
    old_name = os.path.basename(str(newest.file_name))
    file_name, other = (no_device_name(os.path.basename(name)).casefold() for name in (old_name, path))
    return old_name if file_name != other else ""


def checksum_of(revision: Revision) -> str:
    """Return the SHA-256 of a revision's file in lower-case hex; "" if the server names none."""
    return bare_checksum(revision.file_checksum)
