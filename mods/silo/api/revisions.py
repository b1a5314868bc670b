# SPDX-License-Identifier: LGPL-2.1-or-later
"""What an item's revisions say about a file of ours: what it was made from, and whether it arrived already.

An upload whose answer was lost is not sent again before this is known: it would make a second revision.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from silo.api.transport import Cancel
from silo.api.wire import Revision
from silo.bom.errors import ConflictError, NewerRevisionError, NotFoundError, ServerFaultError
from silo.durable import remove_patiently
from silo.files import bare_checksum, seen_as
from silo.folders import scratch_folder
from silo.platform import no_device_name


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

    def check(self, part_number: str) -> None:
        """Raise NewerRevisionError where committing the file would undo a newer revision."""
        if (newest := self.newer) is None:
            return
        made = (
            f"revision {self.base_number}" if self.base is not None else "a file that is no revision in Silo"
        )
        raise NewerRevisionError(
            f"{newest.created_by or 'Somebody'} committed revision {newest.revision_number} of {part_number}"
            f"{f' ({newest.comment})' if newest.comment else ''}, and this was made from {made}. "
            "Sending it would undo that. Look at theirs; then send yours on top of it, or discard it and "
            "take theirs",
            newest.model_dump(mode="json", exclude={"properties", "links"}),
        )


def has_file(revision: Revision) -> bool:
    """True for a revision with a file; the others only change properties."""
    return bool(revision.file_checksum or revision.file_name or revision.file_key or revision.file_size)


def standing(
    revisions: Iterable[Revision], origin: str, known: int | None = None, seen: str = ""
) -> Standing:
    """How a file that was made from ``origin`` (a SHA-256) stands.

    known
        the number of that revision, for a server that keeps no checksums. Else the checksum decides: a server
        that was restored from a backup gives the same numbers to other files.
    seen
        the newest revision that a person has seen and decided about: its number and its checksum.
    """
    files = sorted((r for r in revisions if has_file(r)), key=lambda r: r.revision_number)
    mine = [
        r
        for r in files
        if seen == seen_as(r.revision_number, r.file_checksum)
        or (checksum_of(r) == origin if checksum_of(r) else r.revision_number == known)
    ]
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
    one, other = (no_device_name(os.path.basename(name)).casefold() for name in (known, path))
    return known if one != other else ""


REPACKED = (".kc",)
"""Files that a server packs anew: what comes down differs from what went up."""


def is_there(revisions: Iterable[Revision], file_name: str, sha256: str, number: int | None) -> bool:
    """True where a file that became revision ``number`` is among these. The checksum decides where it is that
    of the file as it was sent; a revision without a file decides nothing."""
    by_number = Path(file_name).suffix.lower() in REPACKED
    known = list(revisions)
    files = [r for r in known if has_file(r)] or known  # some servers say nothing of files
    return any(
        checksum_of(r) == sha256 or (r.revision_number == number and (by_number or not checksum_of(r)))
        for r in files
    )


class Downloads(Protocol):
    """What is needed of a Silo."""

    def download_file(
        self,
        part_number: str,
        path: Path | str,
        revision: int | None = None,
        *,
        cancelled: Cancel | None = None,
    ) -> str: ...


def download_revision(
    client: Downloads,
    part_number: str,
    path: Path,
    revision: int,
    checksum: str,
    *,
    cancelled: Cancel | None = None,
) -> str:
    """Fetch a revision's file to ``path``; gives its SHA-256.

    Raises ServerFaultError where it is not the file that was committed (``checksum``; "" where the server
    names none): it was damaged in the store or on the way.
    """
    found = client.download_file(part_number, path, revision, cancelled=cancelled)
    if checksum and found != checksum:
        remove_patiently(path)
        raise ServerFaultError(
            f"the file of {part_number}, revision {revision}, is not the one that was committed: its SHA-256 "
            f"is {found[:12]}…, wanted {checksum[:12]}…. Nothing was written; the server's administrator can "
            "check its files"
        )
    return found


class MayHaveArrivedError(ConflictError):
    """Nothing shows whether one of these revisions is the file. ``newest``: the last of them."""

    def __init__(self, part_number: str, sent: SentFile, revisions: Sequence[int]) -> None:
        numbers = ", ".join(map(str, revisions))
        super().__init__(
            f"{part_number}: {sent.file_name} may have arrived already, as revision {numbers}; this server "
            "keeps no checksum to compare. Look at it in Silo: Retry sends the file, Discard does not"
        )
        self.newest = max(revisions)


@dataclass(frozen=True)
class SentFile:
    """The file that was sent. ``base``: the newest revision that the item had before the first try."""

    file_name: str
    sha256: str
    size: int
    base: int


def find_arrived(
    client: Downloads,
    part_number: str,
    sent: SentFile,
    known: Sequence[Revision],
    *,
    cancelled: Cancel | None = None,
) -> Revision | None:
    """The revision that holds the file already; None where there is none, so that it may be sent.

    By the server's checksum; where it keeps none, by size, then by reading the revision's file. Raises
    :class:`MayHaveArrivedError` where even that says nothing: a person looks before it is sent a second time.
    """
    doubtful: list[Revision] = []
    for revision in sorted(known, key=lambda one: one.revision_number):
        if revision.revision_number <= sent.base:
            continue
        if checksum := checksum_of(revision):
            if checksum == sent.sha256:
                return revision
            continue
        same = _same_content(client, part_number, revision, sent, cancelled)
        if same:
            return revision
        if same is None:
            doubtful.append(revision)
    if doubtful:
        raise MayHaveArrivedError(part_number, sent, [revision.revision_number for revision in doubtful])
    return None


def checksum_of(revision: Revision) -> str:
    """The SHA-256 of a revision's file in lower-case hex; "" where the server names none."""
    return bare_checksum(revision.file_checksum)


def _same_content(
    client: Downloads, part_number: str, revision: Revision, sent: SentFile, cancelled: Cancel | None
) -> bool | None:
    """None: nothing shows it."""
    repacked = Path(sent.file_name).suffix.lower() in REPACKED
    if revision.file_size is not None and revision.file_size != sent.size and not repacked:
        return False
    with scratch_folder("silo-") as folder:
        try:
            stored = client.download_file(
                part_number, Path(folder) / "file", revision.revision_number, cancelled=cancelled
            )
        except NotFoundError:
            # A revision without a file is a change of properties; one that names a file cannot be read.
            return None if revision.file_key or revision.file_size else False
    if stored == sent.sha256:
        return True
    return None if repacked else False
