# SPDX-License-Identifier: LGPL-2.1-or-later
"""The one way a BOM changes: the lines, their history and the BOM's version in one stroke.

Every caller (merge, edit, resolve, restore, undo, import) says which lines become what; what is written here
is set-based, and the history is exact by construction: folding all changes gives the state.
"""

from __future__ import annotations

import uuid as uuids
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import Any

from sqlalchemy import delete, func, insert, select, update

from silo.bom.errors import VersionConflictError
from silo.bom.message import message
from silo_server.db.rows import insert_rows, one_of, update_rows
from silo_server.db.tables import bom_change_lines, bom_changes, bom_lines, items
from silo_server.db.transaction import Tx
from silo_server.events import announce
from silo_server.fields import names_of
from silo_server.services.bom.find_numbers import with_numbers
from silo_server.services.bom.line_record import ChangeKind, LineRecord
from silo_server.services.bom.line_state import state_columns, state_to_json
from silo_server.services.items import get_item
from silo_server.user_json import dumps
from silo_server.values import Item


@dataclass(frozen=True, kw_only=True)
class ChangeNote:
    """What goes with a change into the history. ``document`` is the file the BOM was taken from."""

    kind: ChangeKind
    summary: str
    reason: str | None = None
    document_file: str | None = None
    document_sha256: str | None = None
    document_revision: int | None = None
    sync_id: str | None = None
    refers_to: int | None = None
    decisions: Sequence[Mapping[str, Any]] = ()


def new_line_id() -> str:
    """Make the id of a new line; it never changes."""
    return str(uuids.uuid4())


def parent_to_change(tx: Tx, part_number: str, expected: int | None) -> Item:
    """Lock the item whose BOM is to be changed, and check that the BOM has the ``expected`` version."""
    parent = locked_parent(tx, part_number)
    check_version(parent, expected)
    return parent


def locked_parent(tx: Tx, part_number: str) -> Item:
    """Lock an item. The transaction's time is then later than that of each change of the item's BOM.

    So "as of" a time and the retention, which look at times, agree with the order of the changes.
    """
    parent = get_item(tx, part_number, lock=True)
    ours = select(bom_changes.c.at).where(bom_changes.c.parent_id == parent.id)
    last = tx.conn.scalar(ours.order_by(bom_changes.c.id.desc()).limit(1))
    if last is not None:
        tx.take_time(max(last, parent.updated_at))
    return parent


def check_version(parent: Item, expected: int | None) -> None:
    """Raise VersionConflictError unless the BOM still has the version that the request was made from."""
    if expected is not None and expected != parent.bom_version:
        raise VersionConflictError(
            message(
                "the BOM of {part_number} has version {version}, the request was made from version "
                "{expected}; read it again and repeat",
                part_number=parent.part_number,
                version=parent.bom_version,
                expected=expected,
            )
        )


def apply_changes(tx: Tx, parent: Item, changes: Sequence[LineRecord], note: ChangeNote) -> tuple[int, int]:
    """Write ``changes`` to the parent's BOM (whose lock the caller holds) and to its history.

    Returns (change id, version after). The version moves only when a line does. What is no merge is announced
    here; a merge has an event of its own.
    """
    version = parent.bom_version + (1 if changes else 0)
    placed = with_numbers(tx, parent, _placed(tx, parent, changes), note.kind)
    _write_lines(tx, parent, placed)
    change_id = tx.conn.execute(
        insert(bom_changes)
        .values(
            parent_id=parent.id,
            version=version,
            at=tx.stamp,
            username=tx.actor.username,
            **{name: getattr(note, name) for name in names_of(ChangeNote)}
            | {
                "kind": note.kind.value,
                "decisions": dumps([dict(d) for d in note.decisions]) if note.decisions else None,
            },
        )
        .returning(bom_changes.c.id)
    ).scalar_one()
    if changes:
        rows = [{"change_id": change_id, **history_row(change)} for change in placed]
        insert_rows(tx, bom_change_lines, rows)
        tx.conn.execute(update(items).where(items.c.id == parent.id).values(bom_version=version))
    if note.kind is not ChangeKind.MERGE:
        announce.bom_updated(tx, parent, note.kind, note.summary)
    return change_id, version


def _placed(tx: Tx, parent: Item, changes: Sequence[LineRecord]) -> list[LineRecord]:
    if all(change.position is not None for change in changes):
        return list(changes)
    last = tx.conn.scalar(select(func.max(bom_lines.c.position)).where(bom_lines.c.parent_id == parent.id))
    places = count((last or 0) + 1)
    return [c if c.position is not None else replace(c, position=next(places)) for c in changes]


def _write_lines(tx: Tx, parent: Item, changes: Sequence[LineRecord]) -> None:
    added = [(c, c.after) for c in changes if c.before is None and c.after is not None]
    changed = [(c, c.after) for c in changes if c.before is not None and c.after is not None]
    removed = [c.line_id for c in changes if c.after is None]
    if removed:
        tx.conn.execute(delete(bom_lines).where(one_of(tx, bom_lines.c.id, removed)))
    update_rows(tx, bom_lines, "id", [{"id": c.line_id, **state_columns(s)} for c, s in changed])
    rows = [
        {
            "id": c.line_id,
            "parent_id": parent.id,
            "child_id": c.child_id,
            "position": c.position,
            **state_columns(state),
        }
        for c, state in added
    ]
    insert_rows(tx, bom_lines, rows)


def history_row(change: LineRecord) -> dict[str, Any]:
    """Write a changed line as a row of the history."""
    return {
        "line_id": change.line_id,
        "child_id": change.child_id,
        "position": change.position,
        "action": change.action,
        "before": dumps(state_to_json(change.before)) if change.before else None,
        "after": dumps(state_to_json(change.after)) if change.after else None,
    }
