# SPDX-License-Identifier: LGPL-2.1-or-later
"""The state of a file: how its bytes on disk stand to Silo.

The one answer for window, project view, ``status``, ``commit`` and ``pull``, from four things: the bytes on
disk and what they were made from, the record of the file, the queue, and the server. Pure.

What bytes were made from is a list of contents, the nearest first: what this computer's FreeCAD saved them
from, what of the file waits in the queue, and the content of its record
(:meth:`silo.outbox.store.Store.origins`). The first of them that Silo has is the base.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from enum import StrEnum

from silo.api.revisions import Standing, checksum_of, standing
from silo.api.wire import Revision
from silo.checksums import seen_as
from silo.project_folder import FileRecord


class FileState(StrEnum):
    """How a file stands to Silo."""

    SAME = "same"  # is in Silo as it is here
    NEW = "new"  # not in Silo
    EDITED = "edited"  # here, since it was committed or pulled
    NEWER = "newer"  # in Silo, and not edited here
    BOTH = "both"  # edited here, and newer in Silo
    WAITING = "waiting"  # its commit is in the queue
    HELD = "held"  # its commit is in the queue, and a user decides
    SET_BACK = "server set back"  # to an older state: the file is of a revision that the server has lost
    UNKNOWN = "unknown"  # of an item that this server does not have


NOT_SENT = frozenset({FileState.NEWER, FileState.BOTH, FileState.SET_BACK, FileState.UNKNOWN, FileState.HELD})
"""The states that a commit leaves out unless a user says otherwise."""

ON_TOP = frozenset({FileState.BOTH, FileState.SET_BACK})
"""The states that are sent on top of what Silo has, at a user's word."""


def known_number(
    content: str, record: FileRecord | None, server: str, known: Callable[[str], int | None]
) -> int | None:
    """Return the revision that a content is on a server that keeps no checksums; None if it is not known."""
    if record is not None and record.sha256 == content and record.server == server and record.revision:
        return record.revision
    return known(content)


def stands(
    sha256: str,
    origins: Sequence[str],
    revisions: Sequence[Revision],
    number: Callable[[str], int | None],
    seen: str = "",
) -> Standing:
    """Find the revision from which a file was made: the nearest of its origins that the server has.

    number
        the revision that a content is, for servers that keep no checksums.
    seen
        the newest revision that a user has seen and decided about (:func:`silo.checksums.seen_as`).
    """
    found = standing(revisions, "", None, seen)
    for content in (*origins, sha256):
        nearest = standing(revisions, content, number(content))
        if nearest.base is not None:
            is_newer = found.base is None or nearest.base_number > found.base_number
            return nearest if is_newer else found
    return found


def stands_on_newest(
    origins: Sequence[str], newest: Sequence[Revision], number: Callable[[str], int | None]
) -> bool:
    """Return True if the newest revision alone says what a file was made from: it is the nearest origin.

    A farther origin says nothing without the other revisions: the record of a shared folder may be of what
    a colleague committed since.
    """
    return stands("", origins[:1], newest, number).base is not None


def is_seen(revision: Revision, seen: str) -> bool:
    """Return True if a revision is the one that a user has seen and decided about."""
    return bool(seen) and seen == seen_as(revision.revision_number, revision.file_checksum)


def is_set_back(newest: Revision | None, record: FileRecord | None, server: str) -> bool:
    """Return True if the server has lost the revision that the file comes from, and has nothing later.

    By the server's own clock: a revision that a colleague made after the server was set back is later.
    """
    if record is None or record.server != server or not record.revision:
        return False
    if newest is None:
        return True
    if newest.revision_number > record.revision or checksum_of(newest) == record.sha256:
        return False
    made, mine = newest.created_at, record.created
    before = made is None or not mine or _time(made) < _stored(mine)
    return before and (newest.revision_number < record.revision or bool(checksum_of(newest)))


def file_state(
    sha256: str,
    origins: Sequence[str],
    record: FileRecord | None,
    newest: Revision | None,
    server: str,
    revisions: Callable[[], Sequence[Revision]],
    number: Callable[[str], int | None] = lambda _content: None,
) -> FileState:
    """Return the state of a file, before the queue is asked (:func:`with_queue`).

    revisions
        all revisions of the file, asked for only where the newest one does not decide.
    """

    def numbered(content: str) -> int | None:
        return known_number(content, record, server, number)

    if newest is not None and _is(newest, sha256, numbered):
        return FileState.SAME
    if is_set_back(newest, record, server):
        return FileState.SET_BACK
    if newest is None:
        return FileState.NEW
    is_unedited = record is not None and record.sha256 == sha256
    if not is_unedited and stands_on_newest(origins, [newest], numbered):
        return FileState.EDITED
    if not checksum_of(newest) and not any(map(numbered, (*origins, sha256))):
        # The server shows nothing to compare, so what was sent from here counts.
        return FileState.SAME if is_unedited else FileState.EDITED
    if is_unedited:
        return FileState.NEWER
    base = stands(sha256, origins, revisions(), numbered).base
    if base is not None and base.revision_number == newest.revision_number:
        return FileState.EDITED
    return FileState.NEWER if base is not None and _is(base, sha256, numbered) else FileState.BOTH


def _is(revision: Revision, sha256: str, number: Callable[[str], int | None]) -> bool:
    """Return True if a revision is this very content."""
    there = checksum_of(revision)
    return there == sha256 if there else number(sha256) == revision.revision_number


def remembered_state(sha256: str, record: FileRecord | None) -> FileState:
    """Return the state of a file without a server: what its record says."""
    if record is None or not record.sha256:
        return FileState.NEW
    return FileState.SAME if record.sha256 == sha256 else FileState.EDITED


def _time(value: datetime) -> datetime:
    return value if value.tzinfo is not None else value.replace(tzinfo=UTC)


def _stored(text: str) -> datetime:
    try:
        return _time(datetime.fromisoformat(text))
    except ValueError:
        return datetime.max.replace(tzinfo=UTC)
