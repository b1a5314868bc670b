# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reading BOM lines: of one parent, of many, and as JSON.

The one way a BOM changes: the lines, their history and the BOM's version in one stroke.

Every caller (merge, edit, resolve, restore, undo, import) says which lines become what; what is written here
is set-based, and the history is exact by construction: folding all changes gives the state.
"""

from __future__ import annotations

import hashlib
import json
import uuid as uuids
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import lru_cache
from itertools import count
from typing import Any

from sqlalchemy import Integer, Select, delete, func, insert, literal_column, select, type_coerce, update

from silo.bom.errors import ConflictError, CycleError, NotFoundError, VersionConflictError
from silo.bom.quantities import plain
from silo_server.db.rows import insert_rows, one_of, update_rows
from silo_server.db.tables import bom_change_lines, bom_changes, bom_lines, items
from silo_server.db.transaction import STRUCTURE_LOCK, Tx
from silo_server.errors import TooLargeError
from silo_server.events import announce
from silo_server.fields import names_of, to_wire
from silo_server.services.items import get_item
from silo_server.user_json import dumps
from silo_server.values import Item, Line, LineState

# "override" as the number that SQLite has: making a bool of it costs more than all the rest of the row.
STATE_COLUMNS = [
    type_coerce(bom_lines.c.override, Integer) if name == "override" else bom_lines.c[name]
    for name in names_of(LineState)
]


def select_lines(*, bare: bool = False) -> Select[*tuple[Any, ...]]:
    """Select lines with their children, in the columns that :func:`to_line` reads.

    ``bare``: without UUID, name and description of the children, which take a third of the time.
    """
    texts = (items.c.uuid, items.c.name, items.c.description)
    return select(
        bom_lines.c.id,
        bom_lines.c.parent_id,
        bom_lines.c.child_id,
        bom_lines.c.position,
        items.c.part_number,
        *(literal_column("''").label(text.name) if bare else text for text in texts),
        items.c.item_type,
        items.c.current_revision,
        items.c.archived_at,
        *STATE_COLUMNS,
    ).join(items, items.c.id == bom_lines.c.child_id)


def to_line(row: Any, child: tuple[Any, ...] = ()) -> Line:
    """Make a line from a row of :func:`select_lines`; reading by position makes this fast.

    ``child``: the same child as read from another row (:func:`child_of`).
    """
    return Line._make((*row[:4], *(child or child_of(row)), _state(*row[11:])))


def child_of(row: Any) -> tuple[Any, ...]:
    """Return the values of a row of :func:`select_lines` that describe the child."""
    return (*row[4:10], row[10] is not None)


# Most lines of a BOM are in one of a few states (so many pieces, from the assembly, nothing noted); a frozen
# value can be shared, and making one costs ten times as much as finding it.
@lru_cache(maxsize=16384)
def _state(*columns: Any) -> LineState:
    raw: Any = LineState(*columns)  # the columns are in the order of the fields
    designators, metadata = (json.loads(text) for text in (raw.reference_designators, raw.metadata))
    state: LineState = replace(
        raw, reference_designators=tuple(designators), override=bool(raw.override), metadata=metadata
    )
    return state


def lines_of(tx: Tx, parent: Item) -> list[Line]:
    """Read the lines of a BOM, in their order."""
    query = select_lines().where(bom_lines.c.parent_id == parent.id).order_by(bom_lines.c.position)
    return [to_line(row) for row in tx.conn.execute(query)]


# The most lines of several BOMs in one answer; one BOM alone may have any number.
MOST_LINES_AT_ONCE = 10_000


def check_line_count(tx: Tx, parent_ids: Sequence[int]) -> None:
    """Raise TooLargeError if several BOMs together have more lines than one answer may have.

    A BOM that is named twice counts twice.
    """
    row = bom_lines.c.parent_id
    query = select(row, func.count()).where(one_of(tx, row, set(parent_ids))).group_by(row)
    counts: dict[int, int] = dict(tx.conn.execute(query).all())
    count = sum(counts.get(parent_id, 0) for parent_id in parent_ids)
    most = min(MOST_LINES_AT_ONCE, tx.settings.max_expanded_rows)
    if count > most and len(parent_ids) > 1:
        raise TooLargeError(f"these BOMs have {count} lines, an answer at most {most}; ask for fewer")


def lines_of_many(tx: Tx, parent_ids: Collection[int]) -> dict[int, list[Line]]:
    """Read the lines of many BOMs, by parent, each in their order."""
    query = (
        select_lines()
        .where(one_of(tx, bom_lines.c.parent_id, parent_ids))
        .order_by(bom_lines.c.parent_id, bom_lines.c.position)
    )
    lines: dict[int, list[Line]] = {}
    for row in tx.conn.execute(query):
        lines.setdefault(row[1], []).append(to_line(row))
    return lines


@dataclass(frozen=True, slots=True)
class LineId:
    """Names a line by its own id, which stays whatever happens to the line."""

    id: str


def line_of(lines: Iterable[Line], which: str | LineId, parent: Item) -> Line:
    """Find the line with this id, or the only line of this child.

    Raises NotFoundError if there is none, ConflictError if the child has several lines: none is chosen by
    chance.
    """
    if isinstance(which, LineId):
        line = next((line for line in lines if line.id == which.id), None)
        if line is None:
            raise NotFoundError(f"the BOM of {parent.part_number} has no line with the id {which.id!r}")
        return line
    key = which.casefold()
    matches = [line for line in lines if line.child_part_number.casefold() == key]
    if len(matches) > 1:
        ids = ", ".join(f"{line.state.rel_type}: {line.id}" for line in matches)
        raise ConflictError(
            f"the BOM of {parent.part_number} has {len(matches)} lines for {which!r} ({ids}); "
            "name a line by its id"
        )
    if not matches:
        raise NotFoundError(f"the BOM of {parent.part_number} has no line for {which!r}")
    return matches[0]


def component_of(lines: Iterable[Line], which: str | LineId, parent: Item) -> Line:
    """Find a line as :func:`line_of` does; of several lines of a child take the component, as CAD does."""
    lines = list(lines)
    if isinstance(which, str):
        key = which.casefold()
        own = [line for line in lines if line.child_part_number.casefold() == key]
        lines = [line for line in own if line.state.rel_type == "component"] or own
    return line_of(lines, which, parent)


def state_to_json(state: LineState) -> dict[str, Any]:
    """Write a line's state as the history stores it: only the fields that are set."""
    fields = ((name, getattr(state, name)) for name in names_of(LineState))
    return {
        name: value
        for name, value in fields
        if value is not None and value is not False and value != () and value != {}
    }


def mark_of(state: LineState, cad_quantity: float | None = None) -> str:
    """Make a short mark of what a person saw of a line; another state has another mark.

    cad_quantity
        the quantity in CAD that a conflict shows beside the line.
    """
    seen = dumps([state_to_json(state), cad_quantity])
    return hashlib.sha256(seen.encode()).hexdigest()[:16]


@lru_cache(maxsize=16384)
def stored_state(text: str) -> LineState:
    """Read a state that :func:`state_to_json` wrote."""
    values = dict(json.loads(text))
    if "reference_designators" in values:
        values["reference_designators"] = tuple(values["reference_designators"])
    return replace(LineState(values.pop("quantity"), values.pop("source")), **values)


def state_columns(state: LineState) -> dict[str, Any]:
    """Write a line's state as values for the columns of the table."""
    return {name: getattr(state, name) for name in names_of(LineState)} | {
        "quantity": float(state.quantity),
        "reference_designators": dumps(list(state.reference_designators)),
        "metadata": dumps(dict(state.metadata)),
    }


def line_to_wire(line: Line, parent_part_number: str) -> dict[str, Any]:
    """Return a line as ``GET …/bom`` sends it.

    It has the contract's keys, and ours for overrides and newer revisions.
    """
    return {
        "id": line.id,
        "parent_part_number": parent_part_number,
        **child_to_wire(line),
        **line_state_to_wire(line.state),
        **revisions_to_wire(line),
    }


def child_to_wire(line: Line) -> dict[str, Any]:
    """Return the child of a line as the API sends it."""
    return {
        "child_part_number": line.child_part_number,
        "child_id": line.child_uuid,
        "child_name": line.child_name,
        "child_description": line.child_description,
        "child_item_type": line.child_item_type,
        "child_archived": line.child_archived,
    }


def line_state_to_wire(state: LineState) -> dict[str, Any]:
    """Return a line's state as the API sends it, with all fields."""
    return to_wire(state) | {"quantity": plain(state.quantity), "cad_quantity": plain(state.cad_quantity)}


def revisions_to_wire(line: Line) -> dict[str, Any]:
    """Return which revision of the child counts, and whether there is a newer one."""
    pinned, newest = line.state.child_revision, line.child_current_revision
    return {
        "effective_revision": pinned if pinned is not None else newest,
        "newer_revision_exists": newer_exists(line),
    }


def newer_exists(line: Line) -> bool:
    """Return True if the line names an older revision of its child than the newest."""
    pinned = line.state.child_revision
    return pinned is not None and pinned < line.child_current_revision


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
class LineRecord:
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
            f"the BOM of {parent.part_number} has version {parent.bom_version}, the request was made from "
            f"version {expected}; read it again and repeat"
        )


def apply_changes(tx: Tx, parent: Item, changes: Sequence[LineRecord], note: ChangeNote) -> tuple[int, int]:
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
        announce.bom_updated(tx, parent, note.kind, note.summary)
    return change_id, version


def check_no_cycle(tx: Tx, parent: Item, child_ids: Collection[int]) -> None:
    """Raise CycleError if one of the children to be added contains the parent, or is it.

    The caller's edges are added under the structure lock, so that two requests cannot close a ring together.
    """
    if not child_ids:
        return
    tx.lock(STRUCTURE_LOCK)
    for ring in find_rings(tx, parent, child_ids).values():
        raise CycleError(ring)


def find_rings(tx: Tx, parent: Item, child_ids: Collection[int]) -> dict[int, list[str]]:
    """Find the children that contain the parent, or are it, each with the part numbers of the ring.

    The search goes up from the parent: it has few ancestors, but may have thousands of children.
    """
    wanted = set(child_ids)
    if not wanted:
        return {}
    edges = _edges_above(tx, parent.id)
    above: dict[int, int] = {parent.id: parent.id}
    queue = [parent.id]
    ring: list[int] = []
    while queue and len(ring) < len(wanted):
        node = queue.pop(0)
        if node in wanted:
            ring.append(node)
        for ancestor in edges.get(node, ()):
            if ancestor not in above:
                above[ancestor] = node
                queue.append(ancestor)
    return {child_id: _ring(tx, parent.id, child_id, above) for child_id in ring}


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
