# SPDX-License-Identifier: LGPL-2.1-or-later
"""The server's additions to the error tree: the same faults, with the HTTP status that is exact for them."""

from __future__ import annotations

from collections.abc import Sequence

from silo.bom.errors import (
    ConflictError,
    RejectedError,
    RemoteError,
    UnreachableError,
    VersionConflictError,
    listed,
)
from silo.bom.message import message


class TooLargeError(RejectedError):
    """413: more than the server takes in one request; the message names the limit."""

    status_hint = 413
    code = "too_large"


class TooManyAttemptsError(RemoteError):
    """429: too many failed logins; ``retry_after`` seconds until the next try is looked at."""

    status_hint = 429
    code = "too_many_attempts"

    def __init__(self, message: str, retry_after: int) -> None:
        super().__init__(message)
        self.retry_after = retry_after


class InDoubtError(UnreachableError):
    """503 without ``Retry-After``: it is not known whether the change was stored."""

    status_hint = 503
    code = "unavailable"


class DuplicateError(ConflictError):
    """409: there is one already."""

    code = "duplicate"


class LinesChangedError(VersionConflictError):
    """Lines are no longer as the person saw them, who therefore decides again; ``line_ids`` names them."""

    def __init__(self, message: str, line_ids: Sequence[str]) -> None:
        super().__init__(message)
        self.line_ids = tuple(line_ids)


class ArchivedPartsError(ConflictError):
    """A state of a BOM would bring archived parts back, and it was not allowed."""

    def __init__(self, part_numbers: Sequence[str]) -> None:
        super().__init__(
            message(
                "nothing was restored: archived parts would come back ({part_numbers}); say that they may "
                "(with_archived)",
                part_numbers=listed(part_numbers, 10),
            )
        )
        self.part_numbers = tuple(part_numbers)


def cause_of(error: BaseException) -> str:
    """Return what the database's driver or the operating system said, in one line; no SQL and no values."""
    return str(getattr(error, "orig", None) or error).strip().partition("\n")[0] or type(error).__name__
