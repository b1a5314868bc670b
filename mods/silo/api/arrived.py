# SPDX-License-Identifier: LGPL-2.1-or-later
"""Whether a file arrived at the server already.

An upload whose answer was lost is not sent again before this is known: it would make a second revision.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from silo.api.revisions import checksum_of, has_model
from silo.api.transport import Cancel
from silo.api.wire import Revision
from silo.bom.errors import ConflictError, NotFoundError
from silo.bom.message import message
from silo.platform.whole_files import scratch_folder

if TYPE_CHECKING:
    from silo.api.client import SiloClient


REPACKED = (".kc",)
"""Files that a server packs again: what comes down differs from what went up."""


def is_there(revisions: Iterable[Revision], file_name: str, sha256: str, number: int | None) -> bool:
    """Return True if a file that became revision ``number`` is among these. The checksum decides if it is
    that of the file as it was sent; a revision without a file decides nothing.
    """
    by_number = Path(file_name).suffix.lower() in REPACKED
    revisions_here = list(revisions)
    files = [r for r in revisions_here if has_model(r)] or revisions_here  # some servers say nothing of files
    return any(
        checksum_of(r) == sha256 or (r.revision_number == number and (by_number or not checksum_of(r)))
        for r in files
    )


class MayHaveArrivedError(ConflictError):
    """Nothing shows whether one of these revisions is the file. ``newest``: the last of them."""

    def __init__(self, part_number: str, sent: SentFile, revisions: Sequence[int]) -> None:
        numbers = ", ".join(map(str, revisions))
        super().__init__(
            message(
                "{part_number}: {file_name} may have arrived already, as revision {numbers}; this server "
                "keeps no checksum to compare. Look at it in Silo: Retry sends the file, Discard does not",
                part_number=part_number,
                file_name=sent.file_name,
                numbers=numbers,
            )
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
    client: SiloClient,
    part_number: str,
    sent: SentFile,
    revisions: Sequence[Revision],
    *,
    cancelled: Cancel | None = None,
) -> Revision | None:
    """Find the revision that holds the file already; None if there is none, so that the file may be sent.

    Compares the server's checksum; if it keeps none, the size, and then the content of the revision's file.
    Raises :class:`MayHaveArrivedError` if even that decides nothing: a user looks before it is sent a
    second time.
    """
    doubtful: list[Revision] = []
    for revision in sorted(revisions, key=lambda other: other.revision_number):
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


def _same_content(
    client: SiloClient, part_number: str, revision: Revision, sent: SentFile, cancelled: Cancel | None
) -> bool | None:
    """Return True or False if the server shows whether the revision holds the file; None if nothing
    shows it.
    """
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
