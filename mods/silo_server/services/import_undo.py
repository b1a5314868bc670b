# SPDX-License-Identifier: LGPL-2.1-or-later
"""Taking an import back, all or nothing.

The changes of BOMs and of suppliers are undone, changed items get their values before, and the items that the
import made are archived. What was changed or used since is named, and then nothing is undone.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import partial

from sqlalchemy import func, select, update

from silo.bom.errors import ConflictError, NotFoundError, listed
from silo.bom.message import message
from silo_server.db.rows import one_of
from silo_server.db.tables import bom_changes, bom_lines, imports, items
from silo_server.db.transaction import Tx
from silo_server.fields import from_row
from silo_server.services.bom.restore import undo_change
from silo_server.services.import_log import Import, import_of_change
from silo_server.services.item_cells import cells_of, restore_cells
from silo_server.services.items import archive_item, by_ids, get_item
from silo_server.services.suppliers import undo_supplier_change
from silo_server.values import Item


def undo_import(tx: Tx, import_id: int) -> Import:
    """Take an import back. NotFoundError; ConflictError names what was changed since, and changes nothing."""
    row = tx.conn.execute(select(imports).where(imports.c.id == import_id).with_for_update()).one_or_none()
    if row is None:
        raise NotFoundError(message("there is no import {import_id}", import_id=import_id))
    found = from_row(Import, row)
    if found.undone_at:
        raise ConflictError(
            message(
                "import {import_id} was undone already, by {username}",
                import_id=import_id,
                username=found.undone_by,
            )
        )
    said = json.loads(found.done)
    changed = {int(item_id): columns for item_id, columns in said["changed"].items()}
    ids = {*said["made"], *changed, *(i for i, _ in said["suppliers"]), *(i for i, _ in said["boms"])}
    there, problems = by_ids(tx, ids), list[str]()
    undo_bom = partial(undo_change, expected=None)
    for undo, pairs in ((undo_bom, said["boms"]), (undo_supplier_change, said["suppliers"])):
        for item_id, change in reversed(pairs):
            if not there[item_id].archived_at:
                try:
                    undo(tx, there[item_id].part_number, change)
                except ConflictError as error:
                    problems.append(str(error))
    now = by_ids(tx, changed)
    for item_id, columns in changed.items():
        item = now[item_id]
        cells = cells_of(item)
        since = [column for column, (_, after) in columns.items() if cells[column] != after]
        if since:
            problems.append(
                message(
                    "{part_number}: {since} changed since",
                    part_number=item.part_number,
                    since=", ".join(since),
                )
            )
        elif not item.archived_at or "archived" in columns:
            restore_cells(tx, item, {column: before for column, (before, _) in columns.items()})
    problems += _archive_made(tx, [there[item_id] for item_id in said["made"]])
    if problems:
        raise ConflictError(message("the import cannot be undone: {problems}", problems=listed(problems, 5)))
    undone = {"undone_at": tx.stamp, "undone_by": tx.actor.username}
    tx.conn.execute(update(imports).where(imports.c.id == import_id).values(undone))
    return found


def undo_bom_change(tx: Tx, part_number: str, change: int) -> int:
    """Undo a change of a BOM, with the whole import that it is a part of; return the new change."""
    item = get_item(tx, part_number)
    whole = import_of_change(tx, item.id, change)
    if whole is None:
        return undo_change(tx, part_number, change, None)[0]
    undo_import(tx, whole.id)
    newest = select(func.max(bom_changes.c.id)).where(bom_changes.c.parent_id == item.id)
    return tx.conn.scalar(newest) or 0


def _archive_made(tx: Tx, made: Sequence[Item]) -> list[str]:
    """Archive the items that an import made; list those that are used elsewhere by now."""
    ids = {item.id for item in made}
    row = bom_lines.c
    query = (
        select(row.child_id, items.c.part_number)
        .join(items, items.c.id == row.parent_id)
        .where(one_of(tx, row.child_id, ids), items.c.archived_at.is_(None), ~one_of(tx, row.parent_id, ids))
    )
    used = {use.child_id: use.part_number for use in tx.conn.execute(query)}
    for item in made:
        if not item.archived_at and item.id not in used:
            archive_item(tx, item.part_number)
    return [
        message("{part_number} is in the BOM of {parent}", part_number=item.part_number, parent=used[item.id])
        for item in made
        if item.id in used
    ]
