# SPDX-License-Identifier: LGPL-2.1-or-later
"""Revisions: append-only snapshots of an item's properties, each with the file that was uploaded, if any.

An item and its document count their revisions together; a document without an item has its own numbers.
The file of an item, and of a document that is no attachment, is a model.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, Row, func, insert, select, update

from silo.api.wire import FACTS, FactSource
from silo.bom.compare.base_revision import base_revision_of, would_undo
from silo.bom.errors import NewerRevisionError, NotFoundError, RejectedError
from silo.bom.message import message
from silo.file_kind import MODEL
from silo_server.db.tables import items, revisions
from silo_server.db.transaction import Tx
from silo_server.events import announce
from silo_server.fields import from_row, to_wire
from silo_server.services.documents import document_of, documents_holding, note_former, note_revision
from silo_server.services.file_store import StoredFile
from silo_server.services.search import index_item
from silo_server.times import spec_time
from silo_server.user_json import check_json, dumps
from silo_server.values import Document, Item, Revision


@dataclass(frozen=True, slots=True)
class RevisionOrigin:
    """What the client says of a file: the revision that it was made from, its place, what it links to, which
    items (UUID and object) are in it, and which document it was before."""

    base_revision: int | None = None
    path: str | None = None
    links: Sequence[Mapping[str, str]] | None = None
    items: Sequence[Mapping[str, str]] | None = None
    former: str = ""


def _of(holder: Item | Document) -> ColumnElement[bool]:
    column = revisions.c.item_id if isinstance(holder, Item) else revisions.c.document_id
    return column == holder.id


def takes_models(of: Item | Document) -> bool:
    """Report whether the files of an item or a document are models, and not those of an attachment."""
    return isinstance(of, Item) or of.kind == MODEL


def _with_file(of: Item | Document) -> ColumnElement[bool]:
    """Return the condition of the revisions that show what ``of`` is: models, or those of an attachment."""
    there = _of(of) & revisions.c.file_checksum.is_not(None)
    return there & (revisions.c.kind == MODEL) if takes_models(of) else there


def add_revision(
    tx: Tx,
    of: Item | Document,
    *,
    comment: str = "",
    properties: Mapping[str, Any] | None = None,
    file: StoredFile | None = None,
    origin: RevisionOrigin = RevisionOrigin(),
    source: FactSource = "hand",
) -> Revision:
    """Append a revision to an item, or to a document without an item.

    Without ``properties`` it has those of the revision before.

    source
        where mass, material and the like come from, if they differ.

    A file that was made from an older revision than the newest is refused (:class:`NewerRevisionError`).

    The caller holds the item's lock; the unique key on (item, number) guards the rest.
    """
    if properties is not None:
        check_json("properties", properties)
    if file is not None:
        if takes_models(of) and file.kind != MODEL:
            raise RejectedError(
                message(
                    "the model of {subject} is a FreeCAD document, and the content of {file} is none "
                    "({kind}); send it as an attachment of an item",
                    subject=of.subject,
                    file=file.name,
                    kind=file.kind.replace("_", " "),
                )
            )
        _check_base(tx, of, origin.base_revision, file.checksum)
    last = tx.conn.scalar(select(func.max(revisions.c.revision_number)).where(_of(of)))
    number = (last or 0) + 1
    item, document = (of, None) if isinstance(of, Item) else (None, of)
    if item is not None and file is not None:
        document = document_of(tx, item)
    before = item.properties if item is not None else {}
    snapshot = dict(before) if properties is None else dict(properties)
    tx.conn.execute(
        insert(revisions).values(
            item_id=item.id if item is not None else None,
            document_id=document.id if document is not None else None,
            revision_number=number,
            properties=dumps(snapshot),
            comment=comment,
            status="draft",
            file_name=file.name if file else None,
            file_checksum=file.checksum if file else None,
            file_size=file.size if file else None,
            thumbnail_key=file.thumbnail_key if file else None,
            created_at=tx.stamp,
            created_by=tx.actor.username,
            base_revision=origin.base_revision,
            file_path=origin.path,
            links=None if origin.links is None else dumps([dict(link) for link in origin.links]),
            kind=None if file is None else document.kind if document else MODEL,
        )
    )
    if document is not None:
        note_revision(tx, document, number, origin.links or (), origin.items or ())
        if file is not None:
            note_former(tx, document, origin.former)
    if item is not None:
        changed: dict[str, Any] = {"current_revision": number}
        if file and file.thumbnail_key:
            changed["thumbnail_key"] = file.thumbnail_key
        _keep(tx, item, snapshot, source, changed)
    revision = get_revision(tx, of, number)
    if takes_models(of):
        announce.revision_created(tx, of, revision)
    return revision


def _keep(
    tx: Tx, item: Item, properties: Mapping[str, Any], source: FactSource, changed: Mapping[str, Any]
) -> None:
    """Store the properties of an item, with where they come from, and other values that changed."""
    now = {**properties, **changed}
    new = {name for name in FACTS if properties.get(name) != item.properties.get(name)}
    new |= {"description"} & changed.keys()
    origins = {name: origin for name, origin in item.origins.items() if name not in new}
    origins |= {name: {"source": source, "at": spec_time(tx.stamp)} for name in new if name in now}
    values = {**changed, "properties": dumps(properties), "origins": dumps(origins) if origins else None}
    stamped = {"version": items.c.version + 1, "updated_at": tx.stamp, "updated_by": tx.actor.username}
    tx.conn.execute(update(items).where(items.c.id == item.id).values(**values, **stamped))
    index_item(tx, item.id)


def complete(
    tx: Tx, item: Item, checksum: str, properties: Mapping[str, Any], changed: Mapping[str, Any]
) -> None:
    """Store what an item's file states: in the file's revision or, if there is a later one, in a new one."""
    last = get_revision(tx, item, item.current_revision) if item.current_revision else None
    if last is not None and last.file_checksum != checksum and properties != item.properties:
        add_revision(tx, item, comment="as its file states", properties=properties, source="cad")
    elif last is not None:
        mine = _of(item) & (revisions.c.revision_number == last.revision_number)
        tx.conn.execute(update(revisions).where(mine).values(properties=dumps(dict(properties))))
    _keep(tx, item, properties, "cad", changed)


def _check_base(tx: Tx, of: Item | Document, base: int | None, checksum: str | None) -> None:
    newest = _newest_file(tx, of) if base is not None else None
    if newest is None or not would_undo(newest, base, checksum):
        return
    raise NewerRevisionError(
        message(
            "{user} committed revision {revision} of {subject}, and this was made from revision "
            "{base}. Fetch the newer one first (silo-mod pull, Open from Silo), or commit this on top "
            "of it in FreeCAD",
            user=newest.created_by,
            revision=newest.revision_number,
            subject=of.subject,
            base=base,
        ),
        revision_to_wire(of, newest),
    )


def check_document(tx: Tx, item: Item, base: int | None, checksum: str | None) -> None:
    """Raise :class:`NewerRevisionError` if a BOM is that of an older file and would undo the newest one's,
    :class:`MissingRevisionError` if its file is not here (:mod:`silo.bom.compare.base_revision`)."""
    same = select(func.max(revisions.c.revision_number)).where(
        _with_file(item), revisions.c.file_checksum == checksum
    )
    made_from = base_revision_of(base, checksum, tx.conn.scalar(same) if checksum else None)
    _check_base(tx, item, made_from, checksum)


def list_revisions(
    tx: Tx,
    of: Item | Document,
    limit: int = 100,
    *,
    before: int | None = None,
    after: int = 0,
    skip: int = 0,
) -> tuple[list[Revision], int]:
    """Read revisions below ``before`` and above ``after``, newest first.

    At most ``limit`` of them, without the first ``skip``. Also returns how many revisions above ``after``
    there are in all.
    """
    wanted = _of(of) & (revisions.c.revision_number > after)
    total = tx.conn.scalar(select(func.count()).select_from(revisions).where(wanted)) or 0
    if before is not None:
        wanted &= revisions.c.revision_number < before
    rows = tx.conn.execute(
        select(revisions).where(wanted).order_by(revisions.c.revision_number.desc()).limit(limit).offset(skip)
    ).all()
    return [_to_revision(row) for row in rows], total


def get_revision(tx: Tx, of: Item | Document, number: int) -> Revision:
    """Read one revision; NotFoundError if there is none."""
    row = tx.conn.execute(
        select(revisions).where(_of(of), revisions.c.revision_number == number)
    ).one_or_none()
    if row is None:
        raise NotFoundError(
            message("{subject} has no revision {revision}", subject=of.subject, revision=number)
        )
    return _to_revision(row)


def with_file(tx: Tx, of: Item | Document) -> Item | Document:
    """Find what has the file: the item or document itself, or the document that holds it. NotFoundError."""
    holders = documents_holding(tx, of) if isinstance(of, Item) else []
    for holder in (of, *holders):
        if _newest_file(tx, holder) is not None:
            return holder
    raise NotFoundError(message("{subject} has no file yet", subject=of.subject))


def has_file(tx: Tx, item: Item) -> bool:
    """Report whether a file shows an item: its own, or a file of several items."""
    return bool(files_until(tx, item, tx.stamp))


def newest_file(tx: Tx, of: Item | Document) -> Revision:
    """Read the newest revision with a file. Raises NotFoundError."""
    newest = _newest_file(tx, with_file(tx, of))
    assert newest is not None
    return newest


def files_until(tx: Tx, item: Item, until: str, limit: int = 1) -> list[int]:
    """Find the numbers of the ``limit`` newest revisions with a file that were there at a time."""
    try:
        of = with_file(tx, item)
    except NotFoundError:
        return []
    row = revisions.c
    where = select(row.revision_number).where(_with_file(of), row.created_at <= until)
    return list(tx.conn.scalars(where.order_by(row.revision_number.desc()).limit(limit)))


def _newest_file(tx: Tx, of: Item | Document) -> Revision | None:
    row = tx.conn.execute(
        select(revisions).where(_with_file(of)).order_by(revisions.c.revision_number.desc()).limit(1)
    ).one_or_none()
    return None if row is None else _to_revision(row)


def _to_revision(row: Row[Any]) -> Revision:
    links = json.loads(row.links) if row.links else ()
    return from_row(Revision, row, properties=json.loads(row.properties), links=links)


def revision_to_wire(of: Item | Document, revision: Revision, *, links: bool = False) -> dict[str, Any]:
    """Return a revision as the API sends it; its links only if wanted, as there may be many.

    An older revision of an item that holds an attachment is sent without the file: a client takes the file
    of an item for its model. The attachment has that file too.
    """
    number = of.part_number if isinstance(of, Item) else ""
    wire = {"part_number": number, **to_wire(revision, *(() if links else ("links",)))}
    if takes_models(of) and not revision.is_model:
        wire |= dict.fromkeys(("file_name", "file_checksum", "file_size"))
    if not takes_models(of) and isinstance(of, Document):
        wire["document"] = of.uuid
    return wire
