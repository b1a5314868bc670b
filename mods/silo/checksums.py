# SPDX-License-Identifier: LGPL-2.1-or-later
"""The SHA-256 of a file's content: here, and as a server writes it."""

from __future__ import annotations

import hashlib
from pathlib import Path

from silo.bom.errors import DocumentError
from silo.bom.system_refusals import why_refused


def content_hash(path: Path | str) -> str:
    """Hash a file's content with SHA-256, in hexadecimal. Raises OSError."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def sha256_of(path: str) -> str:
    """Hash a document that must be readable; DocumentError if it is not."""
    try:
        return content_hash(path)
    except OSError as error:
        raise DocumentError(path, why_refused(error)) from error


def bare_checksum(checksum: str | None) -> str:
    """Return a server's SHA-256 in lower-case hex; "" if it gives none."""
    return (checksum or "").lower().removeprefix("sha256:")


def seen_as(number: int, checksum: str | None) -> str:
    """Return a name for the file of a revision that a user saw. It includes the file's hash, if the server
    knows that, because a restored server gives the same number to another file.
    """
    return f"{number} {bare_checksum(checksum)}".strip()
