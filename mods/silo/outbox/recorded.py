# SPDX-License-Identifier: LGPL-2.1-or-later
"""The record of a file is written when its commit has arrived in Silo (:mod:`silo.project_folder`).

Not where the bytes on disk come from elsewhere by then: a file that was pulled or replaced since the commit
was queued keeps the record that it got.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

from silo.api.wire import Revision
from silo.bom.errors import DocumentError, InputError
from silo.checksums import content_hash
from silo.fcstd import Library
from silo.outbox.entry import Entry, InFile
from silo.project_folder import FileRecord, now, record_of, write_record


def note_arrived(entry: Entry, revision: Revision) -> None:
    """Write the record of a commit's file. What cannot be written costs a repeated question, no commit."""
    if not entry.path or not entry.identity:
        return
    try:
        here = content_hash(entry.path)
    except OSError:  # moved or deleted since; the project finds it again by what its record says
        here = ""
    with suppress(InputError):
        before = record_of(entry.path)
        if here != entry.sha256 and not _is_made_from(entry, before, here):
            return
        uid = before.uid if before is not None and before.uid else uid_of(entry.path)
        item = not InFile.of(entry.document).own
        record = arrived(entry.identity, entry.sha256, revision, entry.server, uid, item=item)
        write_record(entry.path, replace(record, since=entry.taken_at))


def former_document(entry: Entry) -> str:
    """Return the document that the file of a commit was before; "" if it is the same.

    A part that got its number, a file whose item was taken out of it or that holds several now. A file of an
    item that has the identity of another one is no later state of the first.
    """
    record = record_of(entry.path) if entry.path and entry.identity else None
    if record is None or not record.document:
        return ""
    if record.is_of(entry.identity):
        return record.former
    is_item = not InFile.of(entry.document).own
    return "" if record.item and is_item else record.document


def _is_made_from(entry: Entry, before: FileRecord | None, here: str) -> bool:
    """Return True if what lies at a commit's place comes from the commit, though it was edited since."""
    if before is None or not before.sha256:
        return True
    if here == before.sha256 or before.since > entry.taken_at:
        return False
    return before.sha256 in entry.origin.split() or not before.is_of(entry.identity)


def arrived(
    document: str, sha256: str, revision: Revision, server: str, uid: str = "", *, item: bool
) -> FileRecord:
    """Make the record of a file that is a revision, as of now."""
    created = revision.created_at.isoformat() if revision.created_at is not None else ""
    number = revision.revision_number
    return FileRecord(document, sha256, uid, number, server, created, now(), item)


def uid_of(path: str) -> str:
    """Return FreeCAD's UUID of a document; "" if it cannot be read."""
    try:
        with Library() as library:
            return str(library.glance(path).Uid)
    except DocumentError:
        return ""
