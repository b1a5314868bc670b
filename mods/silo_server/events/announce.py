# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is announced: each event's name and data, written to the log together with the change.

Names: the spec's ``bom_merge``; the real Silo's ``item.created``, ``item.updated``, ``item.deleted``,
``revision.created``, ``server.state``; ours ``bom.updated`` for changes of a BOM that are no merge, and
``document.revised`` for a file that is no item's, ``file.attached`` and ``file.removed`` for attachments.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from silo_server.db.transaction import Tx
from silo_server.times import spec_time
from silo_server.user_json import dumps
from silo_server.values import Document, Item, NewEvent, Revision


def item_created(tx: Tx, item: Item) -> None:
    _about(tx, "item.created", item, {**_named(item), "item_type": item.item_type})


def item_updated(tx: Tx, item: Item, summary: str = "changed") -> None:
    data = {**_named(item), "revision": item.current_revision, "summary": summary}
    _about(tx, "item.updated", item, data)


def item_deleted(tx: Tx, item: Item) -> None:
    _about(tx, "item.deleted", item, {"part_number": item.part_number, "id": item.uuid})


def revision_created(tx: Tx, of: Item | Document, revision: Revision) -> None:
    data = {
        "revision_number": revision.revision_number,
        "comment": revision.comment,
        "file_name": revision.file_name,
        "user": revision.created_by,
    }
    if isinstance(of, Item):
        _about(tx, "revision.created", of, {"part_number": of.part_number, "id": of.uuid, **data})
    else:
        tx.emit(NewEvent("document.revised", dumps({"document": of.uuid, **data})))


def file_attached(tx: Tx, item: Item, kind: str, file_name: str, number: int, comment: str) -> None:
    """Announce a new revision of an attachment, or its new kind."""
    data = {"kind": kind, "file_name": file_name, "revision_number": number, "comment": comment}
    _about(tx, "file.attached", item, {**_named(item), **data, "user": tx.actor.username})


def file_removed(tx: Tx, item: Item, kind: str, file_name: str) -> None:
    data = {"kind": kind, "file_name": file_name, "user": tx.actor.username}
    _about(tx, "file.removed", item, {**_named(item), **data})


def bom_updated(tx: Tx, item: Item, kind: str, summary: str) -> None:
    data = {
        "item": item.part_number,
        "kind": kind,
        "user": tx.actor.username,
        "timestamp": spec_time(tx.stamp),
        "summary": summary,
    }
    _about(tx, "bom.updated", item, data)


def bom_merged(tx: Tx, item: Item, data: Mapping[str, Any]) -> None:
    _about(tx, "bom_merge", item, data)


def released(tx: Tx, item: Item, label: str, what: str) -> None:
    """Announce what became of a revision of a product: submitted, approved, released, rejected, …"""
    data = {**_named(item), "revision": label, "status": what, "user": tx.actor.username}
    _about(tx, "revision.released" if what == "released" else "revision.reviewed", item, data)


def server_state(tx: Tx, mode: str) -> None:
    tx.emit(NewEvent("server.state", dumps({"mode": mode})))


def _named(item: Item) -> dict[str, Any]:
    return {
        "part_number": item.part_number,
        "id": item.uuid,
        "name": item.name,
        "description": item.description,
    }


def _about(tx: Tx, name: str, item: Item, data: Mapping[str, Any]) -> None:
    tx.emit(NewEvent(name, dumps(data), item.uuid, item.part_number))
