# SPDX-License-Identifier: LGPL-2.1-or-later
"""The one way a BOM changes: the lines, their history and the BOM's version in one stroke.

Every caller (merge, edit, resolve, restore, undo, import) says which lines become what; what is written here
is set-based, and the history is exact by construction: folding all changes gives the state.
"""

from __future__ import annotations

import uuid as uuids
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import count
from typing import Any

from sqlalchemy import delete, func, insert, select, update

from silo.bom.errors import CycleError, VersionConflictError
from silo_server.db.bulk import insert_rows, one_of, update_rows
from silo_server.db.engine import Tx
from silo_server.db.tables import bom_change_lines, bom_changes, bom_lines, items
from silo_server.json_values import dumps
from silo_server.services import events
from silo_server.services.bom.lines import state_columns, state_to_json
from silo_server.services.items import get_item
from silo_server.values import Item, LineState, names_of


class ChangeKind(StrEnum):
    """Why a BOM changed."""

    MERGE = "merge"  # an assembly was synced
    EDIT = "edit"  # a person added, changed or removed lines
    RESOLVE = "resolve"  # a person decided on unreferenced lines or conflicts
    IMPORT = "import"  # a CSV was imported
    RESTORE = "restore"  # an earlier state was brought back
    UNDO = "undo"  # one change was taken back
    FOLDED = "folded"  # the state that changes led to which are no longer kept (SILO_HISTORY_DAYS)


@dataclass(frozen=True, slots=True)
class LineChange:
    """One line that becomes something else: ``before`` None = new, ``after`` None = removed.

    ``position`` is its place in the BOM, None for a new line at the end.
    """

    line_id: str
    child_id: int
    before: LineState | None
    after: LineState | None
    position: int | None = None

    @property
    def action(self) -> str:
        if self.before is None:
            return "added"
        if self.after is None:
            return "removed"
        return "changed"


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
    """A line's stable id."""
    return str(uuids.uuid4())


def parent_to_change(tx: Tx, part_number: str, expected: int | None) -> Item:
    """The item whose BOM is to be changed, locked, and with the ``expected`` version of the BOM."""
    parent = get_item(tx, part_number, lock=True)
    check_version(parent, expected)
    return parent


def check_version(parent: Item, expected: int | None) -> None:
    """Raise VersionConflictError unless the BOM still has the version that the request was made from."""
    if expected is not None and expected != parent.bom_version:
        raise VersionConflictError(
            f"the BOM of {parent.part_number} has version {parent.bom_version}, the request was made from "
            f"version {expected}; read it again and repeat"
        )


def apply_changes(tx: Tx, parent: Item, changes: Sequence[LineChange], note: ChangeNote) -> tuple[int, int]:
    """Write ``changes`` to the parent's BOM (whose lock the caller holds) and to its history.

    Returns (change id, version after). The version moves only when a line does. What is no merge is announced
    here; a merge has an event of its own.
    """
    version = parent.bom_version + (1 if changes else 0)
    placed = _placed(tx, parent, changes)
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
        events.bom_updated(tx, parent, note.kind, note.summary)
    return change_id, version


def check_no_cycle(tx: Tx, parent: Item, child_ids: Collection[int]) -> None:
    """Raise CycleError where one of the children to be added contains the parent, or is it.

    The caller's edges are added under the structure lock, so that two requests cannot close a ring together.
    """
    if not child_ids:
        return
    tx.lock_structure()
    for ring in find_rings(tx, parent, child_ids).values():
        raise CycleError(ring)


def find_rings(tx: Tx, parent: Item, child_ids: Collection[int]) -> dict[int, list[str]]:
    """Those of the children that contain the parent, or are it, each with the part numbers of the ring.

    Looks upwards from the parent: its ancestors are few where its children may be thousands.
    """
    wanted = set(child_ids)
    if not wanted:
        return {}
    edges = _edges_above(tx, parent.id)
    above: dict[int, int] = {parent.id: parent.id}
    queue = [parent.id]
    found: list[int] = []
    while queue and len(found) < len(wanted):
        node = queue.pop(0)
        if node in wanted:
            found.append(node)
        for ancestor in edges.get(node, ()):
            if ancestor not in above:
                above[ancestor] = node
                queue.append(ancestor)
    return {child_id: _ring(tx, parent.id, child_id, above) for child_id in found}


def _edges_above(tx: Tx, item_id: int) -> dict[int, list[int]]:
    reach = select(bom_lines.c.parent_id, bom_lines.c.child_id).where(bom_lines.c.child_id == item_id)
    cte = reach.cte("above", recursive=True)
    cte = cte.union(
        select(bom_lines.c.parent_id, bom_lines.c.child_id).join(cte, bom_lines.c.child_id == cte.c.parent_id)
    )
    edges: dict[int, list[int]] = {}
    for parent_id, child_id in tx.conn.execute(select(cte.c.parent_id, cte.c.child_id)):
        edges.setdefault(child_id, []).append(parent_id)
    return edges


def _ring(tx: Tx, parent_id: int, child_id: int, above: Mapping[int, int]) -> list[str]:
    # `above` leads from an ancestor down to the parent: parent -> child (the new edge) -> ... -> parent.
    ids = [parent_id, child_id]
    while ids[-1] != parent_id:
        ids.append(above[ids[-1]])
    names = dict(
        tx.conn.execute(select(items.c.id, items.c.part_number).where(one_of(tx, items.c.id, ids))).all()
    )
    return [names[i] for i in ids]


def _placed(tx: Tx, parent: Item, changes: Sequence[LineChange]) -> list[LineChange]:
    if all(change.position is not None for change in changes):
        return list(changes)
    last = tx.conn.scalar(select(func.max(bom_lines.c.position)).where(bom_lines.c.parent_id == parent.id))
    places = count((last or 0) + 1)
    return [c if c.position is not None else replace(c, position=next(places)) for c in changes]


def _write_lines(tx: Tx, parent: Item, changes: Sequence[LineChange]) -> None:
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


def history_row(change: LineChange) -> dict[str, Any]:
    """A changed line as the history stores it."""
    return {
        "line_id": change.line_id,
        "child_id": change.child_id,
        "position": change.position,
        "action": change.action,
        "before": dumps(state_to_json(change.before)) if change.before else None,
        "after": dumps(state_to_json(change.after)) if change.after else None,
    }
