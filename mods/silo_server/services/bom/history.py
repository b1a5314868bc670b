# SPDX-License-Identifier: LGPL-2.1-or-later
"""The BOM's history: every change that ever was, and the state at any of them.

Nothing is stored twice: the state after a change is, per line, what the last change up to it made of it.
Change 0 is the empty BOM before everything.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from sqlalchemy import func, select

from silo.bom.errors import NotFoundError
from silo.bom.message import message
from silo_server.db.rows import newest_first, one_of
from silo_server.db.tables import bom_change_lines, bom_changes, items
from silo_server.db.transaction import Tx
from silo_server.fields import from_row
from silo_server.services.bom.line_record import ChangeKind
from silo_server.services.bom.line_state import stored_state
from silo_server.values import Item, LineState


@dataclass(frozen=True, slots=True)
class Change:
    """One change of a BOM: who, when, why, and from which file."""

    id: int
    version: int
    kind: ChangeKind
    at: str
    username: str
    summary: str
    reason: str | None
    document_file: str | None
    document_sha256: str | None
    document_revision: int | None
    sync_id: str | None
    refers_to: int | None
    decisions: Sequence[Mapping[str, Any]]
    line_count: int


class NamedItem(NamedTuple):
    """What history says of the child of a line, as it is called now."""

    id: int
    part_number: str
    name: str
    archived_at: str | None


@dataclass(frozen=True, slots=True)
class ChangedLine:
    """What one change made of one line; ``before`` None = added, ``after`` None = removed."""

    line_id: str
    child: NamedItem
    position: int
    before: LineState | None
    after: LineState | None


class PastLine(NamedTuple):
    """A line as it was at some point."""

    line_id: str
    child: NamedItem
    position: int
    state: LineState


def list_changes(
    tx: Tx, parent: Item, limit: int = 50, before: int | None = None, after: int | None = None
) -> list[Change]:
    """Read the changes of a BOM, newest first; ``before`` and ``after`` are change ids to page from."""
    return _changes(tx, [bom_changes.c.parent_id == parent.id], limit, before, after)


def lines_of_changes(
    tx: Tx, change_ids: Collection[int], most: int = 2**31 - 1
) -> dict[int, list[ChangedLine]]:
    """Read the first ``most`` lines of each of these changes, by the id of the change."""
    place = func.row_number().over(
        partition_by=bom_change_lines.c.change_id, order_by=bom_change_lines.c.position
    )
    numbered = (
        select(bom_change_lines, place.label("place"))
        .where(one_of(tx, bom_change_lines.c.change_id, change_ids))
        .subquery()
    )
    query = select(numbered).where(numbered.c.place <= most)
    rows = tx.conn.execute(query.order_by(numbered.c.change_id, numbered.c.place)).all()
    children = _named(tx, {row.child_id for row in rows})
    lines: dict[int, list[ChangedLine]] = {}
    for row in rows:
        lines.setdefault(row.change_id, []).append(_changed_line(row, children))
    return lines


def get_change(tx: Tx, parent: Item, change_id: int) -> tuple[Change, list[ChangedLine]]:
    """Return one change with its lines; NotFoundError if this BOM has no such change."""
    changes = _changes(tx, [bom_changes.c.parent_id == parent.id, bom_changes.c.id == change_id], 1)
    if not changes:
        raise NotFoundError(
            message(
                "the BOM of {part_number} has no change {change}",
                part_number=parent.part_number,
                change=change_id,
            )
        )
    return changes[0], lines_of_changes(tx, [change_id]).get(change_id, [])


def stories(
    tx: Tx, parent: Item, line_ids: Collection[str], after: int = 0
) -> dict[str, list[tuple[Change, ChangedLine]]]:
    """Read what happened to these lines after change ``after``, by line id, newest first.

    Lines that did not change are absent.
    """
    if not line_ids:
        return {}
    rows = tx.conn.execute(
        select(bom_change_lines)
        .join(bom_changes, bom_changes.c.id == bom_change_lines.c.change_id)
        .where(
            bom_changes.c.parent_id == parent.id,
            bom_changes.c.id > after,
            one_of(tx, bom_change_lines.c.line_id, line_ids),
        )
        .order_by(bom_change_lines.c.change_id.desc())
    ).all()
    ids = {row.change_id for row in rows}
    changes = {change.id: change for change in _changes(tx, [one_of(tx, bom_changes.c.id, ids)], len(ids))}
    children = _named(tx, {row.child_id for row in rows})
    by_line: dict[str, list[tuple[Change, ChangedLine]]] = {}
    for row in rows:
        line = _changed_line(row, children)
        by_line.setdefault(row.line_id, []).append((changes[row.change_id], line))
    return by_line


def last_merge(tx: Tx, parent: Item) -> Change | None:
    """Find the newest merge of a BOM; None if there was none."""
    conditions = [bom_changes.c.parent_id == parent.id, bom_changes.c.kind == ChangeKind.MERGE.value]
    return next(iter(_changes(tx, conditions, 1)), None)


def change_at(tx: Tx, parent: Item, when: str) -> int:
    """Find the change that gave the BOM its state at ``when`` (ISO 8601, UTC, as stored); 0: before all."""
    value = tx.conn.scalar(
        select(func.max(bom_changes.c.id)).where(
            bom_changes.c.parent_id == parent.id, bom_changes.c.at <= when
        )
    )
    return value or 0


def state_at(tx: Tx, parent: Item, change_id: int) -> list[PastLine]:
    """Return the BOM as change ``change_id`` left it; NotFoundError if the change is not one of this BOM."""
    owner = select(bom_changes.c.parent_id).where(bom_changes.c.id == change_id)
    if change_id != 0 and tx.conn.scalar(owner) != parent.id:
        raise NotFoundError(
            message(
                "the BOM of {part_number} has no change {change}",
                part_number=parent.part_number,
                change=change_id,
            )
        )
    newest = (
        select(bom_change_lines.c.line_id, func.max(bom_change_lines.c.change_id).label("change_id"))
        .join(bom_changes, bom_changes.c.id == bom_change_lines.c.change_id)
        .where(bom_changes.c.parent_id == parent.id, bom_changes.c.id <= change_id)
        .group_by(bom_change_lines.c.line_id)
        .subquery()
    )
    rows = tx.conn.execute(
        select(bom_change_lines)
        .join(
            newest,
            (newest.c.line_id == bom_change_lines.c.line_id)
            & (newest.c.change_id == bom_change_lines.c.change_id),
        )
        .where(bom_change_lines.c.after.is_not(None))
        .order_by(bom_change_lines.c.position)
    ).all()
    children = _named(tx, {row.child_id for row in rows})
    return [
        PastLine(row.line_id, children[row.child_id], row.position, stored_state(row.after)) for row in rows
    ]


def item_changed_by(tx: Tx, change_id: int) -> str:
    """Find the part number of the item whose BOM a change is of; NotFoundError for an unknown change."""
    of_it = select(items.c.part_number).join(bom_changes, bom_changes.c.parent_id == items.c.id)
    value = tx.conn.scalar(of_it.where(bom_changes.c.id == change_id))
    if value is None:
        raise NotFoundError(message("there is no change {change}", change=change_id))
    return str(value)


def _changes(
    tx: Tx,
    conditions: Sequence[Any],
    limit: int,
    before: int | None = None,
    after: int | None = None,
) -> list[Change]:
    lines = (
        select(func.count())
        .where(bom_change_lines.c.change_id == bom_changes.c.id)
        .scalar_subquery()
        .label("line_count")
    )
    query = select(bom_changes, lines).where(*conditions)
    return [
        from_row(
            Change,
            row,
            kind=ChangeKind(row.kind),
            decisions=json.loads(row.decisions) if row.decisions else (),
        )
        for row in newest_first(tx, query, bom_changes.c.id, limit, before, after)
    ]


def _named(tx: Tx, item_ids: Collection[int]) -> dict[int, NamedItem]:
    row = items.c
    query = select(row.id, row.part_number, row.name, row.archived_at)
    return {
        found[0]: NamedItem(*found) for found in tx.conn.execute(query.where(one_of(tx, row.id, item_ids)))
    }


def _changed_line(row: Any, children: Mapping[int, NamedItem]) -> ChangedLine:
    child = children[row.child_id]
    return ChangedLine(row.line_id, child, row.position, _state(row.before), _state(row.after))


def _state(text: str | None) -> LineState | None:
    return None if text is None else stored_state(text)
