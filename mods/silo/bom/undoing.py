# SPDX-License-Identifier: LGPL-2.1-or-later
"""When a file or a BOM would undo a colleague's newer file: the rules, once, for the server and the fake."""

from __future__ import annotations

from typing import Protocol

from silo.bom.errors import MissingRevisionError


class FileRevision(Protocol):
    """A revision with a file."""

    @property
    def revision_number(self) -> int: ...

    @property
    def file_checksum(self) -> str | None: ...


def would_undo(newest: FileRevision | None, base: int | None, sha256: str | None) -> bool:
    """True where a file that was made from revision ``base`` would undo the newest one.

    newest
        the item's newest revision with a file; the very file with this ``sha256`` is nobody else's.
    base
        None where nobody says what the file was made from.
    """
    if base is None or newest is None:
        return False
    return newest.revision_number > base and newest.file_checksum != sha256


def base_of(revision: int | None, sha256: str | None, same: int | None) -> int | None:
    """The revision that a merge's document is, or was made from; None where nobody knows.

    revision, sha256
        what the request says: a revision, and the SHA-256 of its file. Without a revision ``sha256`` is that
        of the document, which may be edited, and then is no revision.
    same
        the newest revision whose file has this ``sha256``; None where none has.

    Raises :class:`MissingRevisionError` for a revision that the server does not have: it was restored from a
    backup since, and the number may by now be that of another file.
    """
    if revision is None:
        return same
    if sha256 and same is None:
        raise MissingRevisionError(
            f"revision {revision} with the SHA-256 {sha256[:12]}… is not on this server, so its BOM was not "
            "merged. The server may have been restored from a backup: send the file again, then its BOM"
        )
    return revision
