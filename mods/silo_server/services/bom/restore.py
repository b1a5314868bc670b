# SPDX-License-Identifier: LGPL-2.1-or-later
"""An earlier state of a BOM is restored, or one change undone; each is a new change."""

from __future__ import annotations

from collections.abc import Mapping

from silo.bom.errors import ConflictError
from silo.bom.message import message
from silo_server.db.rows import one_of
from silo_server.db.tables import bom_conflicts
from silo_server.db.transaction import Tx
from silo_server.errors import ArchivedPartsError
from silo_server.services.bom.change import ChangeNote, apply_changes, parent_to_change
from silo_server.services.bom.cycles import check_no_cycle
from silo_server.services.bom.history import Change, get_change, state_at
from silo_server.services.bom.line_record import ChangeKind, LineRecord
from silo_server.services.bom.lines import lines_of
from silo_server.values import Item, Line


def restore_bom(
    tx: Tx,
    part_number: str,
    change_id: int,
    reason: str | None,
    expected: int | None,
    *,
    with_archived: bool = False,
) -> tuple[int, int]:
    """Restore the state that change ``change_id`` left, as a new change. Returns (change id, version).

    Raises ArchivedPartsError if a part that comes back is archived, unless ``with_archived`` allows that.
    """
    parent = parent_to_change(tx, part_number, expected)
    target = {line.line_id: line for line in state_at(tx, parent, change_id)}
    changes = []
    current = {line.id: line for line in lines_of(tx, parent)}
    for line_id, line in current.items():
        wanted = target.get(line_id)
        after = wanted.state if wanted else None
        if after != line.state:
            changes.append(LineRecord(line_id, line.child_id, line.state, after, line.position))
    missing = [line for line_id, line in target.items() if line_id not in current]
    archived = sorted({line.child.part_number for line in missing if line.child.archived_at})
    if archived and not with_archived:
        raise ArchivedPartsError(archived)
    check_no_cycle(tx, parent, [line.child.id for line in missing])
    changes.extend(LineRecord(m.line_id, m.child.id, None, m.state, m.position) for m in missing)
    text = message("restored as of change {change}: {n} lines changed", change=change_id, n=len(changes))
    note = ChangeNote(kind=ChangeKind.RESTORE, summary=text, reason=reason, refers_to=change_id)
    return apply_changes(tx, parent, changes, note)


def undo_change(tx: Tx, part_number: str, change_id: int, expected: int | None) -> tuple[int, int]:
    """Undo one change, as a new change. Returns (change id, version).

    Raises ConflictError, naming the lines, if one of them has changed again since.
    """
    parent = parent_to_change(tx, part_number, expected)
    change, lines = get_change(tx, parent, change_id)
    if change.kind == ChangeKind.FOLDED:
        raise ConflictError(
            message(
                "change {change} cannot be undone: what was before it is no longer kept", change=change_id
            )
        )
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
            message(
                "change {change} cannot be undone: {part_numbers} changed again since; restore the BOM of "
                "that time instead, or change the lines",
                change=change_id,
                part_numbers=", ".join(touched[:10]),
            )
        )
    check_no_cycle(tx, parent, [line.child.id for line in lines if line.after is None])
    changes = [LineRecord(n.line_id, n.child.id, n.after, n.before, n.position) for n in lines]
    _reopen(tx, parent, change, current)
    words = change.summary  # called so for its translation
    text = message("undone: {words}", words=words)
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
