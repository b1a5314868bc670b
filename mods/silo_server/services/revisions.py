# SPDX-License-Identifier: LGPL-2.1-or-later
"""Revisions: append-only snapshots of an item's properties, each with the file that was uploaded, if any."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Row, func, insert, select, update

from silo.bom.errors import ConflictError, NewerRevisionError, NotFoundError
from silo.bom.merge import base_of, would_undo
from silo_server.db.engine import Tx
from silo_server.db.tables import items, revisions
from silo_server.json_values import check_json, dumps
from silo_server.services import events
from silo_server.services.search import index_item
from silo_server.values import Item, Revision, from_row, to_wire


@dataclass(frozen=True, slots=True)
class StoredFile:
    """A file in the store: what it was called, its SHA-256 and size, and its thumbnail's SHA-256."""

    name: str
    checksum: str
    size: int
    thumbnail_key: str | None = None


@dataclass(frozen=True, slots=True)
class Origin:
    """What the client says of a file: the revision that it was made from, its place, what it links to."""

    base_revision: int | None = None
    path: str | None = None
    links: Sequence[Mapping[str, str]] | None = None


def add_revision(
    tx: Tx,
    item: Item,
    *,
    comment: str = "",
    properties: Mapping[str, Any] | None = None,
    file: StoredFile | None = None,
    idempotency_key: str | None = None,
    origin: Origin = Origin(),
) -> Revision:
    """Append a revision. Without ``properties`` it carries those of the one before on.

    A repeat with the same ``idempotency_key`` gives the revision that the first one made. A file that was
    made from an older revision than the newest is refused (:class:`NewerRevisionError`).

    The caller holds the item's lock; the unique key on (item, number) guards the rest.
    """
    if properties is not None:
        check_json("properties", properties)
    if idempotency_key is not None:
        earlier = _by_key(tx, item, idempotency_key, file)
        if earlier is not None:
            return earlier
    if file is not None:
        _check_base(tx, item, origin.base_revision, file.checksum)
    last = tx.conn.scalar(select(func.max(revisions.c.revision_number)).where(revisions.c.item_id == item.id))
    number = (last or 0) + 1
    snapshot = dict(item.properties) if properties is None else dict(properties)
    tx.conn.execute(
        insert(revisions).values(
            item_id=item.id,
            revision_number=number,
            properties=dumps(snapshot),
            comment=comment,
            status="draft",
            file_name=file.name if file else None,
            file_checksum=file.checksum if file else None,
            file_size=file.size if file else None,
            thumbnail_key=file.thumbnail_key if file else None,
            idempotency_key=idempotency_key,
            created_at=tx.stamp,
            created_by=tx.actor.username,
            base_revision=origin.base_revision,
            file_path=origin.path,
            links=None if origin.links is None else dumps([dict(link) for link in origin.links]),
        )
    )
    changed: dict[str, Any] = {"current_revision": number, "properties": dumps(snapshot)}
    if file and file.thumbnail_key:
        changed["thumbnail_key"] = file.thumbnail_key
    tx.conn.execute(
        update(items)
        .where(items.c.id == item.id)
        .values(**changed, version=items.c.version + 1, updated_at=tx.stamp, updated_by=tx.actor.username)
    )
    index_item(tx, item.id)
    revision = get_revision(tx, item, number)
    events.revision_created(tx, item, revision)
    return revision


def _check_base(tx: Tx, item: Item, base: int | None, checksum: str | None) -> None:
    newest = _newest_file(tx, item) if base is not None else None
    if newest is None or not would_undo(newest, base, checksum):
        return
    raise NewerRevisionError(
        f"{newest.created_by} committed revision {newest.revision_number} of {item.part_number}, and this "
        f"was made from revision {base}. Fetch the newer one first (silo-mod pull, Open from Silo), or "
        "commit this on top of it in FreeCAD",
        revision_to_wire(item.part_number, newest),
    )


def check_document(tx: Tx, item: Item, base: int | None, checksum: str | None) -> None:
    """Raise :class:`NewerRevisionError` where a BOM is that of an older file and would undo the newest one's,
    :class:`MissingRevisionError` where its file is not here (:func:`silo.bom.merge.base_of`)."""
    same = select(func.max(revisions.c.revision_number)).where(
        revisions.c.item_id == item.id, revisions.c.file_checksum == checksum
    )
    _check_base(tx, item, base_of(base, checksum, tx.conn.scalar(same) if checksum else None), checksum)


def list_revisions(
    tx: Tx, item: Item, limit: int = 100, *, before: int | None = None, after: int = 0
) -> tuple[list[Revision], int]:
    """The newest ``limit`` of the item's revisions below ``before`` and above ``after``, newest first.

    And how many revisions above ``after`` there are in all.
    """
    wanted = (revisions.c.item_id == item.id) & (revisions.c.revision_number > after)
    total = tx.conn.scalar(select(func.count()).select_from(revisions).where(wanted)) or 0
    if before is not None:
        wanted &= revisions.c.revision_number < before
    rows = tx.conn.execute(
        select(revisions).where(wanted).order_by(revisions.c.revision_number.desc()).limit(limit)
    ).all()
    return [_to_revision(row) for row in rows], total


def get_revision(tx: Tx, item: Item, number: int) -> Revision:
    """One revision; NotFoundError where there is none."""
    row = tx.conn.execute(
        select(revisions).where(revisions.c.item_id == item.id, revisions.c.revision_number == number)
    ).one_or_none()
    if row is None:
        raise NotFoundError(f"item {item.part_number} has no revision {number}")
    return _to_revision(row)


def newest_file(tx: Tx, item: Item) -> Revision:
    """The newest revision that has a file; NotFoundError where none has."""
    newest = _newest_file(tx, item)
    if newest is None:
        raise NotFoundError(f"item {item.part_number} has no file yet")
    return newest


def _newest_file(tx: Tx, item: Item) -> Revision | None:
    row = tx.conn.execute(
        select(revisions)
        .where(revisions.c.item_id == item.id, revisions.c.file_checksum.is_not(None))
        .order_by(revisions.c.revision_number.desc())
        .limit(1)
    ).one_or_none()
    return None if row is None else _to_revision(row)


def _by_key(tx: Tx, item: Item, key: str, file: StoredFile | None) -> Revision | None:
    row = tx.conn.execute(
        select(revisions).where(revisions.c.item_id == item.id, revisions.c.idempotency_key == key)
    ).one_or_none()
    if row is None:
        return None
    if row.file_checksum != (file.checksum if file else None):
        raise ConflictError(
            f"this Idempotency-Key was used before for another file of {item.part_number}; "
            "send a new key with new content"
        )
    return _to_revision(row)


def _to_revision(row: Row[Any]) -> Revision:
    links = json.loads(row.links) if row.links else ()
    return from_row(Revision, row, properties=json.loads(row.properties), links=links)


def revision_to_wire(part_number: str, revision: Revision, *, links: bool = False) -> dict[str, Any]:
    """A revision, under the contract's names; its links only where they are wanted, there may be many."""
    return {"part_number": part_number, **to_wire(revision, *(() if links else ("links",)))}
