# SPDX-License-Identifier: LGPL-2.1-or-later
"""Documents: the files that have revisions, the items that each one holds, and what it links to.

A file of exactly one item is the item's document: it has the item's UUID and the item's revision numbers, and
the item's routes show it. A file of several items or of none (a part library, a spreadsheet) has a UUID that
its first upload names, and revision numbers of its own. So has an attachment
(:mod:`silo_server.services.attachments`), which is a document of another kind than a model.
"""

from __future__ import annotations

import uuid as uuids
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, delete, insert, select, update

from silo.bom.errors import NotFoundError
from silo.bom.message import message
from silo.file_kind import MODEL
from silo_server.db.rows import insert_rows, one_of
from silo_server.db.tables import document_items, document_links, documents, items, revisions
from silo_server.db.transaction import Tx
from silo_server.fields import from_row
from silo_server.values import Document, Item


@dataclass(frozen=True, slots=True)
class ShownDocument:
    """A document as it is now, with the name and the place of its newest file.

    part_number
        of the item whose document it is; "" without one.
    holds
        the items in it: UUID, part number, and the object that each one is ("": the file as a whole).
    """

    id: str
    part_number: str
    revision_number: int
    file_name: str
    file_path: str | None
    file_checksum: str
    file_size: int
    comment: str
    created_at: str
    created_by: str
    kind: str
    holds: tuple[Mapping[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class KnownContent:
    """A content that a revision of a document has: whose it is, and which document its file is now.

    now, part_number
        the document that it became, or the same; and the item of that, "" without one.
    """

    sha256: str
    document: str
    revision_number: int
    file_path: str | None
    now: str
    part_number: str


def find_document(tx: Tx, uuid: str, *, lock: bool = False) -> Document | None:
    """Find the document with this UUID; None if there is none.

    ``lock`` makes other writers of it wait until this transaction ends.
    """
    if lock:
        tx.lock(uuid)
    row = tx.conn.execute(select(documents).where(documents.c.uuid == uuid)).one_or_none()
    return None if row is None else from_row(Document, row)


def get_document(tx: Tx, uuid: str) -> Document:
    """Find the document with this UUID. Raises NotFoundError."""
    document = find_document(tx, uuid)
    if document is None:
        raise NotFoundError(message("no document has the UUID {uuid}", uuid=uuid))
    return document


def document_of(tx: Tx, item: Item) -> Document:
    """Find the document of an item, or make it. The caller holds the item's lock."""
    row = tx.conn.execute(select(documents).where(documents.c.item_id == item.id)).one_or_none()
    if row is not None:
        return from_row(Document, row)
    # A document without an item may have been given this UUID before; it keeps it.
    uuid = item.uuid if find_document(tx, item.uuid) is None else str(uuids.uuid4())
    return make_document(tx, uuid, item.id)


def make_document(tx: Tx, uuid: str, item_id: int | None = None, **more: Any) -> Document:
    """Make a document that has no revision yet; ``more`` are the columns of an attachment."""
    row = {"uuid": uuid, "item_id": item_id, "current_revision": 0, **more}
    tx.conn.execute(insert(documents).values(**row, created_at=tx.stamp, created_by=tx.actor.username))
    return get_document(tx, uuid)


def note_revision(
    tx: Tx,
    document: Document,
    number: int,
    links: Iterable[Mapping[str, str]],
    held: Iterable[Mapping[str, str]],
) -> None:
    """Note what a new revision of a document links to, and which items are in it.

    Unknown items are left out: the server may not have them yet. Pictures that a browser drew of the items in
    an older file are removed.
    """
    tx.conn.execute(update(documents).where(documents.c.id == document.id).values(current_revision=number))
    for table in (document_items, document_links):
        tx.conn.execute(delete(table).where(table.c.document_id == document.id))
    targets = dict.fromkeys(link.get("document") or link.get("item") or "" for link in links)
    rows = [
        {"document_id": document.id, "target": target} for target in targets if target and len(target) <= 36
    ]
    insert_rows(tx, document_links, rows)
    objects = {(holder["item"].lower(), holder.get("object", "")) for holder in held}
    where = select(items.c.uuid, items.c.id).where(one_of(tx, items.c.uuid, {uuid for uuid, _ in objects}))
    ids = {row.uuid: row.id for row in tx.conn.execute(where)}
    pairs = {(ids[uuid], name) for uuid, name in objects if uuid in ids}
    if document.item_id is not None and document.item_id not in {item for item, _ in pairs}:
        pairs.add((document.item_id, ""))
    rows = [{"document_id": document.id, "item_id": holder, "object": name} for holder, name in sorted(pairs)]
    insert_rows(tx, document_items, rows)
    # What a browser drew of an older file is out of date; the picture of an item's own file stays.
    with_picture = (revisions.c.item_id == items.c.id) & (revisions.c.thumbnail_key == items.c.thumbnail_key)
    own = select(revisions.c.id).where(with_picture).exists()
    drawn = one_of(tx, items.c.id, {item for item, _ in pairs}) & items.c.thumbnail_key.is_not(None) & ~own
    tx.conn.execute(update(items).where(drawn).values(thumbnail_key=None))


def note_former(tx: Tx, document: Document, former: str) -> None:
    """Note which document a file was before its newest revision: it was registered, split, or taken out of
    its item. Links to the former document lead to this one from now on.
    """
    row = documents.c
    tx.conn.execute(update(documents).where(row.id == document.id).values(became=None))
    if former and former != document.uuid:
        tx.conn.execute(update(documents).where(row.uuid == former).values(became=document.uuid))


def of_contents(tx: Tx, contents: Iterable[str]) -> list[KnownContent]:
    """Find the documents that have a model with one of these contents, the newest revision first."""
    query = (
        select(documents.c.uuid, revisions)
        .join(revisions, revisions.c.document_id == documents.c.id)
        .where(one_of(tx, revisions.c.file_checksum, set(contents)), revisions.c.kind == MODEL)
        .order_by(revisions.c.id.desc())
    )
    rows = tx.conn.execute(query).all()
    now = _followed(tx, {row.uuid for row in rows})
    last = {document.uuid: document for document in documents_by_uuid(tx, list(now.values()))}
    ids = {document.item_id for document in last.values() if document.item_id is not None}
    where = select(items.c.id, items.c.part_number).where(one_of(tx, items.c.id, ids))
    numbers = {row.id: row.part_number for row in tx.conn.execute(where)}
    found = []
    for row in rows:
        document = last.get(now[row.uuid])
        number = numbers.get(document.item_id, "") if document is not None and document.item_id else ""
        found.append(
            KnownContent(
                row.file_checksum, row.uuid, row.revision_number, row.file_path, now[row.uuid], number
            )
        )
    return found


def _followed(tx: Tx, uuids: set[str]) -> dict[str, str]:
    """Return which document each of these is now."""
    became: dict[str, str] = {}
    left = uuids
    while left:
        where = select(documents.c.uuid, documents.c.became).where(one_of(tx, documents.c.uuid, left))
        step = {row.uuid: row.became for row in tx.conn.execute(where) if row.became}
        became |= step
        left = set(step.values()) - became.keys()
    return {uuid: _last(uuid, became) for uuid in uuids}


def _last(uuid: str, became: Mapping[str, str]) -> str:
    seen = {uuid}
    while (following := became.get(uuid)) is not None and following not in seen:
        uuid = following
        seen.add(uuid)
    return uuid


def documents_holding(tx: Tx, item: Item) -> list[Document]:
    """Find the documents whose newest revision holds an item, its own first."""
    holding = select(document_items.c.document_id).where(document_items.c.item_id == item.id)
    found = _documents(tx, documents.c.id.in_(holding))
    return sorted(found, key=lambda document: document.item_id != item.id)


def linking_to(tx: Tx, document: Document) -> list[Document]:
    """Find the documents whose newest revision links to this one."""
    sources = select(document_links.c.document_id).where(document_links.c.target == document.uuid)
    return _documents(tx, documents.c.id.in_(sources))


def linked_from(tx: Tx, document: Document) -> list[Document]:
    """Find the documents that the newest revision of this one links to."""
    targets = select(document_links.c.target).where(document_links.c.document_id == document.id)
    return _documents(tx, documents.c.uuid.in_(targets))


def documents_by_uuid(tx: Tx, wanted: Sequence[str]) -> list[Document]:
    """Find the documents with these UUIDs; unknown ones are absent."""
    return _documents(tx, one_of(tx, documents.c.uuid, {uuid.lower() for uuid in wanted}))


def _documents(tx: Tx, which: ColumnElement[bool]) -> list[Document]:
    query = select(documents).where(which).order_by(documents.c.id)
    return [from_row(Document, row) for row in tx.conn.execute(query)]


def shown(tx: Tx, several: Sequence[Document]) -> list[ShownDocument]:
    """Read documents as they are now, in the order given; documents without a file are left out."""
    ids = [holder.id for holder in several]
    newest = (
        select(documents.c.id.label("of"), documents.c.uuid, items.c.part_number, revisions)
        .join(revisions, revisions.c.document_id == documents.c.id)
        .outerjoin(items, items.c.id == documents.c.item_id)
        .where(one_of(tx, documents.c.id, ids))
        .where(revisions.c.revision_number == documents.c.current_revision)
    )
    held: dict[int, list[Mapping[str, str]]] = {}
    query = (
        select(document_items, items.c.uuid, items.c.part_number)
        .join(items, items.c.id == document_items.c.item_id)
        .where(one_of(tx, document_items.c.document_id, ids))
    )
    for each in tx.conn.execute(query.order_by(document_items.c.object, items.c.part_number_key)):
        document = {"item": each.uuid, "part_number": each.part_number, "object": each.object}
        held.setdefault(each.document_id, []).append(document)
    by_item: dict[int, Any] = {each.of: each for each in tx.conn.execute(newest)}
    return [
        from_row(
            ShownDocument,
            row,
            id=row.uuid,
            part_number=row.part_number or "",
            holds=tuple(held.get(row.of, ())),
        )
        for row in map(by_item.get, ids)
        if row is not None
    ]
