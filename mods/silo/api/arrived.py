# SPDX-License-Identifier: LGPL-2.1-or-later
"""Did an upload arrive whose answer was lost? A second upload would make a second revision of one file."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from silo.api.transport import Cancel
from silo.api.wire import Revision
from silo.bom.errors import ConflictError, NotFoundError

REPACKED = (".kc",)
"""Files that a server packs anew: what comes down differs from what went up."""


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


class MayHaveArrivedError(ConflictError):
    """Nothing shows whether one of these revisions is the file. ``newest``: the last of them."""

    def __init__(self, part_number: str, sent: Sent, revisions: Sequence[int]) -> None:
        numbers = ", ".join(map(str, revisions))
        super().__init__(
            f"{part_number}: {sent.file_name} may have arrived already, as revision {numbers}; this server "
            "keeps no checksum to compare. Look at it in Silo: Retry sends the file, Discard does not"
        )
        self.newest = max(revisions)


@dataclass(frozen=True)
class Sent:
    """The file that was sent. ``base``: the newest revision that the item had before the first try."""

    file_name: str
    sha256: str
    size: int
    base: int


def find_arrived(
    client: Downloads,
    part_number: str,
    sent: Sent,
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
    return (revision.file_checksum or "").lower().removeprefix("sha256:")


def _same_content(
    client: Downloads, part_number: str, revision: Revision, sent: Sent, cancelled: Cancel | None
) -> bool | None:
    """None: nothing shows it."""
    repacked = Path(sent.file_name).suffix.lower() in REPACKED
    if revision.file_size is not None and revision.file_size != sent.size and not repacked:
        return False
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True, prefix="silo-") as folder:
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
