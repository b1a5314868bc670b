# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a document is now: a user at another desk may have registered it, or made it another document.

The server says it of each content (:class:`silo.api.wire.KnownContent`). The record of a file that lies here
is then still of the former document, and says what the bytes on disk come from.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

from silo.bom.errors import RouteMissingError
from silo.project_folder import FileRecord

if TYPE_CHECKING:
    from silo.api.client import SiloClient


def documents_now(records: Iterable[FileRecord], client: SiloClient) -> dict[str, str]:
    """Return document → the document that it became, for records whose document became another one."""
    documents = {record.document.lower(): record for record in records if record.document and record.sha256}
    if not documents:
        return {}
    try:
        known = client.get_contents({record.sha256 for record in documents.values()})
    except RouteMissingError:
        return {}
    return {
        documents[content.document.lower()].document: content.now
        for content in known
        if content.document.lower() in documents and content.now.lower() != content.document.lower()
    }


def record_for(record: FileRecord | None, document: str, former: str = "") -> FileRecord | None:
    """Return the record if it is of this document, or of its former one; then without a revision, for that
    is the number of another document's.
    """
    if record is None or record.is_of(document):
        return record
    return replace(record, revision=0) if former and record.is_of(former) else None
