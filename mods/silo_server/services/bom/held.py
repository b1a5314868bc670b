# SPDX-License-Identifier: LGPL-2.1-or-later
"""The BOMs that wait on a designer's computer: the file of the assembly is here, its BOM is not.

A client reports a BOM that it cannot send, for example because a linked file is missing there. The next merge
of the assembly takes the report back. A report changes no line, and no event announces it.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import delete, insert, select, update

from silo.bom.left_out import Reason, what_holds
from silo.bom.message import Message, message
from silo_server.db.rows import one_of
from silo_server.db.tables import held_boms
from silo_server.db.transaction import Tx
from silo_server.times import wire_time
from silo_server.user_json import dumps
from silo_server.values import Item


@dataclass(frozen=True, slots=True)
class HeldBom:
    """A BOM that is held.

    since, username
        when it was first reported, and who reported it last.
    left_out
        what keeps it: the fields of :class:`silo.bom.left_out.LeftOut`.
    """

    since: str
    username: str
    left_out: Sequence[Mapping[str, Any]]
    document_file: str | None = None
    folder: str = ""

    @property
    def words(self) -> Message:
        """Say at whose computer the BOM is held, and why: ``held by mara: 2 files missing``."""
        return message("held by {user}: {why}", user=self.username, why=what_holds(self.left_out))

    def as_gap(self) -> dict[str, Any]:
        """Return it as one more thing that the BOM lacks."""
        return {"reason": Reason.HELD.value, "message": str(self.words)}

    def to_wire(self) -> dict[str, Any]:
        """Return it as the API sends it."""
        return {
            "since": wire_time(self.since),
            "user": self.username,
            "left_out": [dict(part) for part in self.left_out],
            "document_file": self.document_file,
        }


def held_of(tx: Tx, parent_ids: Collection[int]) -> dict[int, HeldBom]:
    """Read which of these assemblies have a BOM that is held."""
    row = held_boms.c
    return {found.parent_id: _read(found) for found in _rows(tx, one_of(tx, row.parent_id, parent_ids))}


def all_held(tx: Tx) -> dict[int, HeldBom]:
    """Read all BOMs that are held."""
    return {found.parent_id: _read(found) for found in _rows(tx)}


def _rows(tx: Tx, *where: Any) -> Sequence[Any]:
    return tx.conn.execute(select(held_boms).where(*where)).all()


def _read(row: Any) -> HeldBom:
    return HeldBom(
        row.since, row.username, tuple(json.loads(row.left_out)), row.document_file, row.folder or ""
    )


def record_held(
    tx: Tx, parent: Item, left_out: Sequence[Mapping[str, Any]], file: str | None, folder: str | None
) -> HeldBom:
    """Record that the BOM of an assembly is held; a repeat keeps the time of the first report."""
    what = {
        "at": tx.stamp,
        "username": tx.actor.username,
        "left_out": dumps([dict(part) for part in left_out]),
        "document_file": file,
        "folder": folder,
    }
    changed = tx.conn.execute(update(held_boms).where(held_boms.c.parent_id == parent.id).values(**what))
    if not changed.rowcount:
        tx.conn.execute(insert(held_boms).values(parent_id=parent.id, since=tx.stamp, **what))
    tx.touched.add(parent.uuid)
    return held_of(tx, [parent.id])[parent.id]


def forget_held(tx: Tx, parent: Item) -> None:
    """Take the report back: the BOM has arrived."""
    tx.conn.execute(delete(held_boms).where(held_boms.c.parent_id == parent.id))
