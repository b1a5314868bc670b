# SPDX-License-Identifier: LGPL-2.1-or-later
"""The revision that a file was made from.

A file or a BOM is refused if it would undo a newer file of a colleague (:func:`would_undo`).
"""

from __future__ import annotations

from typing import Protocol

from silo.bom.errors import MissingRevisionError
from silo.bom.message import message


class FileRevision(Protocol):
    """A revision with a file."""

    @property
    def revision_number(self) -> int: ...

    @property
    def file_checksum(self) -> str | None: ...


def would_undo(newest: FileRevision | None, base: int | None, sha256: str | None) -> bool:
    """Return True if a file that was made from revision ``base`` would undo the newest one.

    newest
        the item's newest revision with a file; if that file has this ``sha256``, nothing is undone.
    base
        None if it is not known what the file was made from.
    """
    if base is None or newest is None:
        return False
    return newest.revision_number > base and newest.file_checksum != sha256


def base_revision_of(revision: int | None, sha256: str | None, same: int | None) -> int | None:
    """Return the revision that a merge's document is, or was made from; None if it is not known.

    revision, sha256
        from the request: a revision, and the SHA-256 of its file. Without a revision, ``sha256`` is that of
        the document, which is no revision if it was edited.
    same
        the newest revision whose file has this ``sha256``; None if none has.

    Raises :class:`MissingRevisionError` for a revision that the server does not have: the server was restored
    from a backup, and another file may have the number by now.
    """
    if revision is None:
        return same
    if sha256 and same is None:
        raise MissingRevisionError(
            message(
                "revision {revision} with the SHA-256 {sha256}… is not on this server, so its BOM was "
                "not merged. The server may have been restored from a backup: send the file again, then "
                "its BOM",
                revision=revision,
                sha256=sha256[:12],
            )
        )
    return revision
