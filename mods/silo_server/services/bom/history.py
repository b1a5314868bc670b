# SPDX-License-Identifier: LGPL-2.1-or-later
"""The BOM's history: every change that ever was, the state at any of them, two states side by side.

Nothing is stored twice: the state after a change is, per line, what the last change up to it made of it.
Change 0 is the empty BOM before everything.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import func, select

from silo.bom.errors import ConflictError, NotFoundError
from silo_server.db.bulk import newest_first, one_of
from silo_server.db.engine import Tx
from silo_server.db.tables import bom_change_lines, bom_changes, bom_conflicts
from silo_server.services.bom.changes import (
    ChangeKind,
    ChangeNote,
    LineChange,
    apply_changes,
    check_no_cycle,
    parent_to_change,
)
from silo_server.services.bom.lines import lines_of, stored_state
from silo_server.services.items import by_ids
from silo_server.values import Item, Line, LineState, from_row, names_of


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


@dataclass(frozen=True, slots=True)
class ChangedLine:
    """What one change made of one line; ``before`` None = added, ``after`` None = removed."""

    line_id: str
    child: Item
    position: int
    before: LineState | None
    after: LineState | None


@dataclass(frozen=True, slots=True)
class PastLine:
    """A line as it was at some point."""

    line_id: str
    child: Item
    position: int
    state: LineState


@dataclass(frozen=True, slots=True)
class Difference:
    """A line in two states; ``fields`` names what differs. ``status``: added removed changed unchanged."""

    child: Item
    status: str
    before: LineState | None
    after: LineState | None
    fields: Sequence[str]


def list_changes(
    tx: Tx, parent: Item, limit: int = 50, before: int | None = None, after: int | None = None
) -> list[Change]:
    """The BOM's changes, newest first; ``before`` and ``after`` are change ids to page on and back."""
    return _changes(tx, [bom_changes.c.parent_id == parent.id], limit, before, after)


def lines_of_changes(
    tx: Tx, change_ids: Collection[int], most: int = 2**31 - 1
) -> dict[int, list[ChangedLine]]:
    """The first ``most`` lines of each of these changes, in one question."""
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
    children = by_ids(tx, {row.child_id for row in rows})
    found: dict[int, list[ChangedLine]] = {}
    for row in rows:
        found.setdefault(row.change_id, []).append(_changed_line(row, children))
    return found


def get_change(tx: Tx, parent: Item, change_id: int) -> tuple[Change, list[ChangedLine]]:
    """One change with its lines; NotFoundError where this BOM has no such change."""
    found = _changes(tx, [bom_changes.c.parent_id == parent.id, bom_changes.c.id == change_id], 1)
    if not found:
        raise NotFoundError(f"the BOM of {parent.part_number} has no change {change_id}")
    return found[0], lines_of_changes(tx, [change_id]).get(change_id, [])


def stories(
    tx: Tx, parent: Item, line_ids: Collection[str], after: int = 0
) -> dict[str, list[tuple[Change, ChangedLine]]]:
    """What happened to these lines after change ``after``, newest first; lines without a story are absent."""
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
    known = {change.id: change for change in _changes(tx, [one_of(tx, bom_changes.c.id, ids)], len(ids))}
    children = by_ids(tx, {row.child_id for row in rows})
    found: dict[str, list[tuple[Change, ChangedLine]]] = {}
    for row in rows:
        line = _changed_line(row, children)
        found.setdefault(row.line_id, []).append((known[row.change_id], line))
    return found


def last_merge(tx: Tx, parent: Item) -> Change | None:
    """The newest merge, None where there was none."""
    conditions = [bom_changes.c.parent_id == parent.id, bom_changes.c.kind == ChangeKind.MERGE.value]
    return next(iter(_changes(tx, conditions, 1)), None)


def change_at(tx: Tx, parent: Item, when: str) -> int:
    """The change that made the BOM what it was at ``when`` (as stored: ISO 8601, UTC); 0 before the first."""
    found = tx.conn.scalar(
        select(func.max(bom_changes.c.id)).where(
            bom_changes.c.parent_id == parent.id, bom_changes.c.at <= when
        )
    )
    return found or 0


def state_at(tx: Tx, parent: Item, change_id: int) -> list[PastLine]:
    """The BOM as change ``change_id`` left it; NotFoundError where this BOM has no such change."""
    if change_id != 0:
        get_own_change(tx, parent, change_id)
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
    children = by_ids(tx, {row.child_id for row in rows})
    return [
        PastLine(row.line_id, children[row.child_id], row.position, stored_state(row.after)) for row in rows
    ]


def get_own_change(tx: Tx, parent: Item, change_id: int) -> int:
    """``change_id`` where it is a change of this BOM; NotFoundError otherwise."""
    owner = tx.conn.scalar(select(bom_changes.c.parent_id).where(bom_changes.c.id == change_id))
    if owner != parent.id:
        raise NotFoundError(f"the BOM of {parent.part_number} has no change {change_id}")
    return change_id


def compare(before: Sequence[PastLine], after: Sequence[PastLine]) -> list[Difference]:
    """Two states side by side, in the order of the later one, what is gone last; pure."""
    old = {line.line_id: line.state for line in before}
    new = {line.line_id for line in after}
    rows = [_difference(line.child, old.get(line.line_id), line.state) for line in after]
    rows.extend(_difference(line.child, line.state, None) for line in before if line.line_id not in new)
    return rows


def restore(
    tx: Tx, part_number: str, change_id: int, reason: str | None, expected: int | None
) -> tuple[int, int]:
    """Make the BOM again what change ``change_id`` left; a new change. Returns (change id, version)."""
    parent = parent_to_change(tx, part_number, expected)
    target = {line.line_id: line for line in state_at(tx, parent, change_id)}
    changes = []
    current = {line.id: line for line in lines_of(tx, parent)}
    for line_id, line in current.items():
        wanted = target.get(line_id)
        after = wanted.state if wanted else None
        if after != line.state:
            changes.append(LineChange(line_id, line.child_id, line.state, after, line.position))
    missing = [line for line_id, line in target.items() if line_id not in current]
    check_no_cycle(tx, parent, [line.child.id for line in missing])
    changes.extend(LineChange(m.line_id, m.child.id, None, m.state, m.position) for m in missing)
    text = f"restored as of change {change_id}: {len(changes)} lines changed"
    note = ChangeNote(kind=ChangeKind.RESTORE, summary=text, reason=reason, refers_to=change_id)
    return apply_changes(tx, parent, changes, note)


def undo(tx: Tx, part_number: str, change_id: int, expected: int | None) -> tuple[int, int]:
    """Take one change back, as a new change. Returns (change id, version).

    Raises ConflictError, naming the lines, where one of them was changed again since.
    """
    parent = parent_to_change(tx, part_number, expected)
    change, lines = get_change(tx, parent, change_id)
    if change.kind == ChangeKind.FOLDED:
        raise ConflictError(f"change {change_id} cannot be undone: what was before it is no longer kept")
    current = {line.id: line for line in lines_of(tx, parent)}
    untouched = {
        (line.child_id, line.state.rel_type): line.id
        for line in current.values()
        if line.id not in {changed.line_id for changed in lines}
    }
    touched = [
        line.child.part_number
        for line in lines
        if line.after != (current[line.line_id].state if line.line_id in current else None)
        # The line was removed, and the same part has got a new line since.
        or (line.before is not None and (line.child.id, line.before.rel_type) in untouched)
    ]
    if touched:
        raise ConflictError(
            f"change {change_id} cannot be undone: {', '.join(touched[:10])} changed again since; "
            "restore the BOM of that time instead, or change the lines"
        )
    check_no_cycle(tx, parent, [line.child.id for line in lines if line.after is None])
    changes = [LineChange(n.line_id, n.child.id, n.after, n.before, n.position) for n in lines]
    _reopen(tx, parent, change, current)
    text = f"undone: {change.summary}"
    return apply_changes(
        tx, parent, changes, ChangeNote(kind=ChangeKind.UNDO, summary=text, refers_to=change_id)
    )


def _reopen(tx: Tx, parent: Item, change: Change, current: Mapping[str, Line]) -> None:
    # "Keep Silo's quantity" lives beside the line; undoing it asks the question again.
    kept = [decision for decision in change.decisions if decision["action"] == "keep_silo"]
    ids = {decision["line_id"] for decision in kept}
    children = [line.child_id for line in current.values() if line.id in ids]
    tx.conn.execute(
        bom_conflicts.update()
        .where(bom_conflicts.c.parent_id == parent.id, one_of(tx, bom_conflicts.c.child_id, children))
        .values(accepted=False)
    )


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


def _changed_line(row: Any, children: Mapping[int, Item]) -> ChangedLine:
    child = children[row.child_id]
    return ChangedLine(row.line_id, child, row.position, _state(row.before), _state(row.after))


def _difference(child: Item, before: LineState | None, after: LineState | None) -> Difference:
    if before is None:
        return Difference(child, "added", None, after, ())
    if after is None:
        return Difference(child, "removed", before, None, ())
    names = [name for name in names_of(LineState) if getattr(before, name) != getattr(after, name)]
    return Difference(child, "changed" if names else "unchanged", before, after, names)


def _state(text: str | None) -> LineState | None:
    return None if text is None else stored_state(text)
