# SPDX-License-Identifier: LGPL-2.1-or-later
"""Attachments: the files beside the model of an item, each of a kind, with revisions of its own.

* An attachment is a document of a kind other than ``model`` (:mod:`silo.file_kind`), at one item.
* A file with the name of an attachment of the same item and kind is its next revision; the same content
  again makes none.
* A removed attachment is no longer shown; its revisions stay, for releases that hold them.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from uuid import uuid4

from sqlalchemy import select, update

from silo.bom.errors import NotFoundError, RejectedError
from silo.bom.message import message
from silo.file_kind import ATTACHMENT_KINDS, MODEL
from silo_server.db.rows import one_of
from silo_server.db.tables import documents, items, revisions
from silo_server.db.transaction import Tx
from silo_server.events import announce
from silo_server.fields import from_row
from silo_server.services.documents import find_document, get_document, make_document
from silo_server.services.file_store import StoredFile
from silo_server.services.items import by_ids, get_item
from silo_server.services.revisions import add_revision
from silo_server.values import Document, Item


@dataclass(frozen=True, slots=True)
class Attachment:
    """An attachment as it is now, with the fields of its newest revision; ``id`` is its document's UUID."""

    id: str
    part_number: str
    kind: str
    revision_number: int
    file_name: str
    file_checksum: str
    file_size: int
    comment: str
    created_at: str
    created_by: str


def attachments_of(tx: Tx, holders: Collection[int]) -> dict[int, list[Attachment]]:
    """Read the attachments of items, by kind and name; an item without any is absent."""
    doc = documents.c
    query = (
        select(doc.attached_to, doc.uuid.label("id"), items.c.part_number, revisions)
        .join(items, items.c.id == doc.attached_to)
        .join(revisions, revisions.c.document_id == doc.id)
        .where(one_of(tx, doc.attached_to, holders), doc.removed_at.is_(None))
        .where(revisions.c.revision_number == doc.current_revision)
    )
    found: dict[int, list[Attachment]] = {}
    for row in tx.conn.execute(query):
        # The row has the ids of both tables; the document's UUID is what the world knows.
        values: Mapping[str, Any] = {"id": row[1], "part_number": row.part_number}
        found.setdefault(row.attached_to, []).append(from_row(Attachment, row, **values))
    for several in found.values():
        several.sort(key=_order)
    return found


def _order(attachment: Attachment) -> tuple[int, str, str]:
    return ATTACHMENT_KINDS.index(attachment.kind), attachment.file_name.casefold(), attachment.id


def attach(
    tx: Tx, item: Item, file: StoredFile, kind: str | None = None, comment: str = ""
) -> tuple[Attachment, bool]:
    """Attach a file to an item, and return the attachment and whether it is a new revision.

    kind
        None: that of its content; a PDF at a bought item is its data sheet.

    The caller holds the item's lock. Raises RejectedError for a kind that no attachment has.
    """
    kind = kind or _usual_kind(item, file)
    if kind not in ATTACHMENT_KINDS:
        raise RejectedError(
            message(
                "kind: wanted {kinds}, got {kind}; a model goes to /api/items/{part_number}/file",
                kinds=" or ".join(ATTACHMENT_KINDS),
                kind=repr(kind[:40]),
            )
            if kind != MODEL
            else message(
                "{file} is a model; send it as the file of {part_number}, or name another kind",
                file=file.name,
                part_number=item.part_number,
            )
        )
    same_name = (
        other
        for other in attachments_of(tx, [item.id]).get(item.id, ())
        if (other.kind, other.file_name.casefold()) == (kind, file.name.casefold())
    )
    there = next(same_name, None)
    document = (
        make_document(tx, str(uuid4()), kind=kind, attached_to=item.id)
        if there is None
        else get_document(tx, there.id)
    )
    return revise(tx, document, file, comment)


def revise(tx: Tx, document: Document, file: StoredFile, comment: str = "") -> tuple[Attachment, bool]:
    """Add a revision to an attachment, and return it and whether there is a new one."""
    item = item_of(tx, document)
    if document.removed_at is not None:
        raise NotFoundError(
            message(
                "the attachment {uuid} of {part_number} was removed",
                uuid=document.uuid,
                part_number=item.part_number,
            )
        )
    before = _find(tx, document)
    if before is not None and (before.file_checksum, before.file_name) == (file.checksum, file.name):
        return before, False
    add_revision(tx, document, comment=comment, file=file)
    after = _find(tx, document)
    assert after is not None  # it has just got a revision
    _touch(tx, item)
    announce.file_attached(tx, item, after.kind, after.file_name, after.revision_number, comment)
    return after, True


def change_kind(tx: Tx, uuid: str, kind: str) -> Attachment:
    """Give an attachment another kind. Raises NotFoundError, RejectedError."""
    if kind not in ATTACHMENT_KINDS:
        raise RejectedError(
            message(
                "kind: wanted {kinds}, got {kind}", kinds=" or ".join(ATTACHMENT_KINDS), kind=repr(kind[:40])
            )
        )
    item, document = _locked(tx, uuid)
    tx.conn.execute(update(documents).where(documents.c.id == document.id).values(kind=kind))
    tx.conn.execute(update(revisions).where(revisions.c.document_id == document.id).values(kind=kind))
    after = _find(tx, document)
    assert after is not None  # an attachment has a revision from the start
    _touch(tx, item)
    announce.file_attached(tx, item, kind, after.file_name, after.revision_number, after.comment)
    return after


def remove(tx: Tx, uuid: str) -> tuple[Item, Attachment]:
    """Show an attachment no longer, and return its item and what it was. Raises NotFoundError."""
    item, document = _locked(tx, uuid)
    before = _find(tx, document)
    assert before is not None  # an attachment has a revision from the start
    tx.conn.execute(update(documents).where(documents.c.id == document.id).values(removed_at=tx.stamp))
    _touch(tx, item)
    announce.file_removed(tx, item, before.kind, before.file_name)
    return item, before


def item_of(tx: Tx, document: Document) -> Item:
    """Find the item that an attachment lies at."""
    assert document.attached_to is not None
    return by_ids(tx, [document.attached_to])[document.attached_to]


def _locked(tx: Tx, uuid: str) -> tuple[Item, Document]:
    """Lock the item of an attachment. Raises NotFoundError for any other document, and for a removed one."""
    document = find_document(tx, uuid)
    if document is None or document.attached_to is None:
        raise NotFoundError(message("no attachment has the UUID {uuid}", uuid=uuid))
    item = get_item(tx, item_of(tx, document).part_number, include_archived=True, lock=True)
    document = get_document(tx, uuid)
    if document.removed_at is not None:
        raise NotFoundError(
            message(
                "the attachment {uuid} of {part_number} was removed", uuid=uuid, part_number=item.part_number
            )
        )
    return item, document


def _find(tx: Tx, document: Document) -> Attachment | None:
    assert document.attached_to is not None
    several: Sequence[Attachment] = attachments_of(tx, [document.attached_to]).get(document.attached_to, ())
    return next((other for other in several if other.id == document.uuid), None)


def _usual_kind(item: Item, file: StoredFile) -> str:
    if item.is_bought and file.kind == "drawing" and file.name.lower().endswith(".pdf"):
        return "data_sheet"
    return file.kind


def _touch(tx: Tx, item: Item) -> None:
    """Note that something about the item changed, for "changed since"; its own fields did not."""
    stamped = {"updated_at": tx.stamp, "updated_by": tx.actor.username}
    tx.conn.execute(update(items).where(items.c.id == item.id).values(stamped))
