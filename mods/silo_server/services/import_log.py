# SPDX-License-Identifier: LGPL-2.1-or-later
"""What each import of a table did: written down, so that one *Undo* takes all of it back."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from sqlalchemy import insert, select

from silo_server.db.rows import one_of
from silo_server.db.tables import imports
from silo_server.db.transaction import Tx
from silo_server.fields import from_row
from silo_server.user_json import dumps


@dataclass(frozen=True, slots=True)
class Import:
    """An import that was done: its kind (bom, parts, prices), file, and what it did."""

    id: int
    at: str
    username: str
    kind: str
    file_name: str
    done: str
    undone_at: str | None = None
    undone_by: str | None = None


@dataclass
class Done:
    """What an import did.

    made
        the items that it made, by id.
    changed
        id of an item that it changed → column → (text before, text after).
    suppliers, boms
        (id of the item, the number of its change).
    number
        the number of the import, by which it can be undone.
    """

    made: list[int] = field(default_factory=list)
    changed: dict[int, Mapping[str, tuple[str, str]]] = field(default_factory=dict)
    suppliers: list[tuple[int, int]] = field(default_factory=list)
    boms: list[tuple[int, int]] = field(default_factory=list)
    number: int | None = None

    @property
    def anything(self) -> bool:
        """Return True if the import changed anything."""
        return bool(self.made or self.changed or self.suppliers or self.boms)


def log_import(tx: Tx, kind: str, file_name: str, done: Done) -> int | None:
    """Write down what an import did; return its number, None for an import that changed nothing."""
    if not done.anything:
        return None
    said = {"made": done.made, "changed": done.changed, "suppliers": done.suppliers, "boms": done.boms}
    row = {
        "at": tx.stamp,
        "username": tx.actor.username,
        "kind": kind,
        "file_name": file_name[:200],
        "done": dumps(said),
    }
    number: int = tx.conn.execute(insert(imports).values(row).returning(imports.c.id)).scalar_one()
    done.number = number
    return number


def import_of_change(tx: Tx, item_id: int, change: int) -> Import | None:
    """Find the import that made a change of a BOM, if it is among the newest and was not undone."""
    for found in last_imports(tx, ("bom",), 50):
        if not found.undone_at and [item_id, change] in json.loads(found.done)["boms"]:
            return found
    return None


def last_imports(tx: Tx, kinds: Sequence[str], limit: int = 10) -> list[Import]:
    """Read the newest imports of these kinds, newest first."""
    query = (
        select(imports).where(one_of(tx, imports.c.kind, kinds)).order_by(imports.c.id.desc()).limit(limit)
    )
    return [from_row(Import, row) for row in tx.conn.execute(query)]
