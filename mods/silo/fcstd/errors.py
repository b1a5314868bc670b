# SPDX-License-Identifier: LGPL-2.1-or-later
"""The error of an FCStd file that cannot be read."""

from __future__ import annotations

from silo.bom.errors import DocumentError
from silo.bom.findings import FindingCode


class FcstdError(DocumentError):
    """A file that cannot be read.

    finding
        what a link to this file has: missing, unreadable, …
    state
        the state of the file (``FileStat``) that was tried, None where it could not be opened.
    """

    def __init__(
        self,
        path: str,
        reason: str,
        finding: FindingCode = FindingCode.UNREADABLE_FILE,
        state: object = None,
    ) -> None:
        super().__init__(path, reason)
        self.finding = finding
        self.state = state
