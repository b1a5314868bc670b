# SPDX-License-Identifier: LGPL-2.1-or-later
"""The BOM's history: every change that ever was, the state at any of them, two states side by side.

What changed in a product, over all levels, between two times: lines, quantities, data and files of its parts.

Nothing is stored twice: the state after a change is, per line, what the last change up to it made of it.
Change 0 is the empty BOM before everything.
"""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any, NamedTuple

from sqlalchemy import func, select

from silo.api.wire import RELEASE_LABEL
from silo.bom.errors import ConflictError, NotFoundError, RejectedError
from silo.bom.numbers import whole_number
from silo.bom.quantities import plain
from silo_server.db.rows import newest_first, one_of
from silo_server.db.tables import bom_change_lines, bom_changes, bom_conflicts, items, revisions
from silo_server.db.transaction import Tx
from silo_server.errors import ArchivedPartsError
from silo_server.fields import from_row, names_of
from silo_server.services.bom.change import (
    ChangeKind,
    ChangeNote,
    LineRecord,
    apply_changes,
    parent_to_change,
)
from silo_server.services.bom.cycles import check_no_cycle
from silo_server.services.bom.line_state import stored_state
from silo_server.services.bom.lines import lines_of, lines_of_many
from silo_server.services.items import by_ids
from silo_server.times import stamp
from silo_server.values import Item, Line, LineState


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


class Difference(NamedTuple):
    """A line in two states; ``fields`` names what differs. ``status``: added removed changed unchanged."""

    child: NamedItem
    status: str
    before: LineState | None
    after: LineState | None
    fields: Sequence[str]


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
        raise NotFoundError(f"the BOM of {parent.part_number} has no change {change_id}")
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
        raise NotFoundError(f"the BOM of {parent.part_number} has no change {change_id}")
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


def compare(before: Sequence[PastLine], after: Sequence[PastLine]) -> list[Difference]:
    """Compare two states side by side; pure. The order is that of the later one; removed lines are last."""
    old = {line.line_id: line.state for line in before}
    new = {line.line_id for line in after}
    rows = [_difference(line.child, old.get(line.line_id), line.state) for line in after]
    rows.extend(_difference(line.child, line.state, None) for line in before if line.line_id not in new)
    return rows


def restore(
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
    text = f"restored as of change {change_id}: {len(changes)} lines changed"
    note = ChangeNote(kind=ChangeKind.RESTORE, summary=text, reason=reason, refers_to=change_id)
    return apply_changes(tx, parent, changes, note)


def item_changed_by(tx: Tx, change_id: int) -> str:
    """Find the part number of the item whose BOM a change is of; NotFoundError for an unknown change."""
    of_it = select(items.c.part_number).join(bom_changes, bom_changes.c.parent_id == items.c.id)
    value = tx.conn.scalar(of_it.where(bom_changes.c.id == change_id))
    if value is None:
        raise NotFoundError(f"there is no change {change_id}")
    return str(value)


def undo(tx: Tx, part_number: str, change_id: int, expected: int | None) -> tuple[int, int]:
    """Undo one change, as a new change. Returns (change id, version).

    Raises ConflictError, naming the lines, if one of them has changed again since.
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
    changes = [LineRecord(n.line_id, n.child.id, n.after, n.before, n.position) for n in lines]
    _reopen(tx, parent, change, current)
    words = change.summary  # called so for its translation
    text = f"undone: {words}"
    return apply_changes(
        tx, parent, changes, ChangeNote(kind=ChangeKind.UNDO, summary=text, refers_to=change_id)
    )


class PastChange(NamedTuple):
    """One thing that differs in a product between two times, and who did it last ("" if it is not known).

    what
        ``added``, ``removed``, ``quantity`` or ``line`` of a BOM, ``data`` or ``file`` of an item.
    within
        the BOM of a line; "" for an item.
    """

    what: str
    within: str
    part_number: str
    name: str
    before: str
    after: str
    at: str
    username: str


def moment(tx: Tx, item: Item, text: str, *, end: bool = False) -> str:
    """Read the time that a person names: a date (its ``end``), a time, or a revision such as ``r3``.

    Returns it as stored. Raises RejectedError; NotFoundError for a revision, frozen or not, that the item
    does not have.
    """
    if text.startswith("r") and (number := whole_number(text[1:], 9)) is not None:
        row = revisions.c
        value = tx.conn.scalar(
            select(row.created_at).where(row.item_id == item.id, row.revision_number == number)
        )
        if value is None:
            raise NotFoundError(f"{item.part_number} has no revision {number}")
        return str(value)
    try:
        when = datetime.fromisoformat(text.replace(" ", "+"))
        if when.tzinfo is None and len(text) == 10:
            when = when.replace(tzinfo=UTC) + timedelta(days=int(end))
        if when.tzinfo is not None:
            return stamp(when)
    except (ValueError, OverflowError):
        pass
    is_label = re.fullmatch(RELEASE_LABEL, text, re.ASCII)
    raise (NotFoundError if is_label else RejectedError)(
        "wanted a date such as 2026-02-08, a time with its zone such as 2026-02-08T22:15:00Z, a revision of "
        f"{item.part_number} such as r3, or one of its frozen revisions, got {text[:60]!r}"
    )


def what_changed(tx: Tx, root: Item, since: str, until: str) -> list[PastChange]:
    """Find what differs in a product between two times, by item.

    Items that were added or removed are not compared themselves.
    """
    since, until = sorted((since, until))
    walked = _Walked(tx, since, until)
    happenings: list[PastChange] = []
    before, after = (walked.reached(root.id, side) for side in (0, 1))
    common = before & after
    numbers = by_ids(tx, walked.changed.keys() & common)
    for item_id, parent in numbers.items():
        at, who = walked.changed[item_id]
        for difference in compare(*walked.states[item_id]):
            if difference.status != "unchanged":
                happenings.append(line_happened(parent.part_number, difference, at, who))
    happenings += _items_happened(tx, common, since, until)
    return in_order(happenings)


def in_order(happenings: Iterable[PastChange]) -> list[PastChange]:
    """Sort changes by BOM or item."""
    return sorted(
        happenings, key=lambda change: (change.within or change.part_number, change.part_number, change.what)
    )


class _Walked:
    """The BOMs of a product at two times; those without a change since the first are read as they are."""

    def __init__(self, tx: Tx, since: str, until: str) -> None:
        self._tx, self._since, self._until = tx, since, until
        self._children: dict[int, tuple[set[int], set[int]]] = {}
        self.states: dict[int, tuple[list[PastLine], list[PastLine]]] = {}
        self.changed: dict[int, tuple[str, str]] = {}

    def reached(self, root: int, side: int) -> set[int]:
        """Find all items of the product at the first time (``side`` 0) or at the second (1)."""
        seen, level = {root}, {root}
        while level:
            self._load(level - self._children.keys())
            level = set[int]().union(*(self._children[item_id][side] for item_id in level)) - seen
            seen |= level
        return seen

    def _load(self, ids: Collection[int]) -> None:
        tx, row = self._tx, bom_changes.c
        query = select(row.parent_id, row.at, row.username).where(row.at > self._since)
        for parent_id, at, who in tx.conn.execute(
            query.where(one_of(tx, row.parent_id, ids)).order_by(row.id)
        ):
            if at <= self._until or parent_id not in self.changed:
                self.changed[parent_id] = (at, who)
        lines = lines_of_many(tx, [item_id for item_id in ids if item_id not in self.changed])
        for item_id in ids:
            now = {line.child_id for line in lines.get(item_id, ()) if line.state.rel_type == "component"}
            self._children[item_id] = (now, now)
        for item in by_ids(tx, self.changed.keys() & ids).values():
            then, later = (
                state_at(tx, item, change_at(tx, item, when)) for when in (self._since, self._until)
            )
            self.states[item.id] = (then, later)
            sides = (
                {line.child.id for line in state if line.state.rel_type == "component"}
                for state in (then, later)
            )
            self._children[item.id] = (next(sides), next(sides))


def line_happened(within: str, difference: Difference, at: str, who: str) -> PastChange:
    what = difference.status
    before, after = (
        "" if state is None else f"{plain(state.quantity)} {state.unit or ''}".rstrip()
        for state in (difference.before, difference.after)
    )
    if what == "changed":
        others = [name for name in difference.fields if name not in ("quantity", "unit", *_BESIDE)]
        what = "line" if others else "quantity" if before != after else "line"
        if what == "line":
            names = others or list(difference.fields)
            before, after = (_fields(state, names) for state in (difference.before, difference.after))
    return PastChange(
        what, within, difference.child.part_number, difference.child.name, before, after, at, who
    )


# What changes with a quantity, or when CAD loses and finds a line.
_BESIDE = ("source", "override", "cad_quantity")


def _fields(state: LineState | None, names: Sequence[str]) -> str:
    values = ((name.replace("_", " "), getattr(state, name)) for name in names)
    return "; ".join(f"{name}: {_text(value)}" for name, value in values)


def _text(value: Any) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(map(str, value)) or "–"
    return "–" if value in (None, "", {}, False) else "yes" if value is True else str(value)[:200]


def _items_happened(tx: Tx, ids: Collection[int], since: str, until: str) -> Iterator[PastChange]:
    row = revisions.c
    within = one_of(tx, row.item_id, ids) & (row.created_at <= until)
    touched = set(tx.conn.scalars(select(row.item_id).where(within, row.created_at > since).distinct()))
    query = select(revisions).where(one_of(tx, row.item_id, touched), row.created_at <= until)
    items_before: dict[int, list[Any]] = {}
    for record in tx.conn.execute(query.order_by(row.item_id, row.revision_number)):
        items_before.setdefault(record.item_id, []).append(record)
    for item in by_ids(tx, touched).values():
        rows = items_before[item.id]
        old = [record for record in rows if record.created_at <= since]
        last = rows[-1]
        sides = json.loads(old[-1].properties) if old else {}, json.loads(last.properties)
        if differences := data_differs(*sides):
            what = ("data", "", item.part_number, item.name, *differences)
            yield PastChange(*what, last.created_at, last.created_by)
        files = [record for record in rows if record.file_checksum]
        older = [file for file in files if file.created_at <= since]
        if files and (not older or older[-1].file_checksum != files[-1].file_checksum):
            newest = files[-1]
            before, after = (_file(versions) for versions in (older, files))
            what = ("file", "", item.part_number, item.name, before, after)
            yield PastChange(*what, newest.created_at, newest.created_by)


def data_differs(then: Mapping[str, Any], now: Mapping[str, Any]) -> tuple[str, str] | None:
    """Describe the values that differ, before and after; None if none does."""
    names = sorted(name for name in then.keys() | now.keys() if then.get(name) != now.get(name))
    before, after = ("; ".join(f"{name}: {_text(side.get(name))}" for name in names) for side in (then, now))
    return (before, after) if names else None


def _file(revisions_with_file: Sequence[Any]) -> str:
    last = revisions_with_file[-1] if revisions_with_file else None
    return f"{last.file_name}, revision {last.revision_number}" if last else ""


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


def _named(tx: Tx, item_ids: Collection[int]) -> dict[int, NamedItem]:
    row = items.c
    query = select(row.id, row.part_number, row.name, row.archived_at)
    return {
        found[0]: NamedItem(*found) for found in tx.conn.execute(query.where(one_of(tx, row.id, item_ids)))
    }


def _changed_line(row: Any, children: Mapping[int, NamedItem]) -> ChangedLine:
    child = children[row.child_id]
    return ChangedLine(row.line_id, child, row.position, _state(row.before), _state(row.after))


def _difference(child: NamedItem, before: LineState | None, after: LineState | None) -> Difference:
    if before is None:
        return Difference(child, "added", None, after, ())
    if after is None:
        return Difference(child, "removed", before, None, ())
    names = [name for name in names_of(LineState) if getattr(before, name) != getattr(after, name)]
    return Difference(child, "changed" if names else "unchanged", before, after, names)


def _state(text: str | None) -> LineState | None:
    return None if text is None else stored_state(text)
