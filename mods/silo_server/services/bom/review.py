# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a merge left for a person to decide, in one BOM and in all, and the decisions about it.

Every page shows how many BOMs wait, so finding them reads nothing but what waits (``db.tables.UNREFERENCED``,
``INCOMPLETE``).
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

from sqlalchemy import func, select, text, update

from silo.bom.diff import same_quantity
from silo.bom.errors import ConflictError, NotFoundError, RejectedError, VersionConflictError
from silo.bom.left_out import Reason
from silo_server.db.bulk import one_of
from silo_server.db.engine import Tx
from silo_server.db.tables import INCOMPLETE, UNREFERENCED, bom_conflicts, bom_last_syncs, bom_lines, items
from silo_server.errors import LinesChangedError
from silo_server.services.bom.changes import (
    ChangeKind,
    ChangeNote,
    LineChange,
    apply_changes,
    parent_to_change,
)
from silo_server.services.bom.history import Change, last_merge
from silo_server.services.bom.last_sync import NEVER, LastSync, last_syncs
from silo_server.services.bom.lines import LineId, component_of, lines_of, mark_of
from silo_server.services.items import by_ids, get_item
from silo_server.values import Item, Line, LineState


class Action(StrEnum):
    """What a person decides about a line."""

    REMOVE = "remove"  # take it out of the BOM
    KEEP = "keep"  # keep it as an intentional, non-CAD line, with a reason
    TAKE_CAD = "take_cad"  # a conflict: the assembly is right, and owns the line from now on
    KEEP_SILO = (
        "keep_silo"  # a conflict: Silo is right; asked again only when the assembly says another number
    )


@dataclass(frozen=True, slots=True)
class Decision:
    """One decision about one line: the one with ``line_id``, else the component line of the child.

    seen
        the :func:`mark_of` the line, and of what CAD said of it, as the person saw them; None: not known.
    """

    child_part_number: str
    action: Action
    reason: str | None = None
    line_id: str | None = None
    seen: str | None = None


@dataclass(frozen=True, slots=True)
class Conflict:
    """CAD and a person's line differ. ``cad_quantity`` 0: the assembly has it no more."""

    line: Line
    cad_quantity: float
    since: str


@dataclass(frozen=True, slots=True)
class Review:
    """What is open on a BOM."""

    parent: Item
    unreferenced: Sequence[Line]
    conflicts: Sequence[Conflict]
    last_merge: Change | None


def review(tx: Tx, part_number: str) -> Review:
    """What is open on the BOM of this item."""
    parent = get_item(tx, part_number)
    lines = lines_of(tx, parent)
    return Review(
        parent,
        [line for line in lines if line.state.unreferenced_since],
        open_conflicts(tx, parent, lines),
        last_merge(tx, parent),
    )


def open_conflicts(tx: Tx, parent: Item, lines: Sequence[Line]) -> list[Conflict]:
    """The conflicts of the last merge that neither a decision nor an edit has settled since."""
    rows = tx.conn.execute(
        select(bom_conflicts).where(bom_conflicts.c.parent_id == parent.id, ~bom_conflicts.c.accepted)
    ).all()
    found = {row.child_id: row for row in rows}
    return [
        Conflict(line, found[line.child_id].cad_quantity, found[line.child_id].since)
        for line in lines
        if line.child_id in found
        and line.state.source == "manual"
        and line.state.rel_type == "component"
        and not same_quantity(line.state.quantity, found[line.child_id].cad_quantity)
    ]


def told_quantities(tx: Tx, parent_ids: Collection[int]) -> dict[int, dict[int, float]]:
    """What the last merge said of people's lines: parent → child → quantity (internal ids); 0: not in the
    assembly."""
    rows = tx.conn.execute(
        select(bom_conflicts.c.parent_id, bom_conflicts.c.child_id, bom_conflicts.c.cad_quantity).where(
            one_of(tx, bom_conflicts.c.parent_id, parent_ids)
        )
    )
    found: dict[int, dict[int, float]] = {}
    for row in rows:
        found.setdefault(row.parent_id, {})[row.child_id] = row.cad_quantity
    return found


def resolve(
    tx: Tx, part_number: str, decisions: Sequence[Decision], expected: int | None = None
) -> tuple[int, int]:
    """Carry all ``decisions`` out as one change. Returns (change id, version).

    Raises LinesChangedError where lines are not as they were seen, RejectedError with everything that does
    not fit; then nothing was changed.
    """
    parent = parent_to_change(tx, part_number, expected)
    lines = lines_of(tx, parent)
    conflicts = {c.line.id: c for c in open_conflicts(tx, parent, lines)}
    changes: list[LineChange] = []
    problems: list[str] = []
    settled: list[Decision] = []
    seen: set[str] = set()
    asked = {decision.line_id for decision in decisions if decision.seen}
    marks = marks_of([line for line in lines if line.id in asked], conflicts)
    stale = [d.line_id for d in decisions if d.line_id and d.seen and d.seen != marks.get(d.line_id)]
    if stale:
        raise LinesChangedError(
            f"{len(stale)} of the lines were changed meanwhile; nothing was changed", stale
        )
    named: dict[str, list[Line]] = {}
    for line in lines:
        named.setdefault(line.id, []).append(line)
        named.setdefault(line.child_part_number.casefold(), []).append(line)
    for index, decision in enumerate(decisions):
        try:
            which = LineId(decision.line_id) if decision.line_id else decision.child_part_number
            near = named.get(decision.line_id or decision.child_part_number.casefold(), ())
            line = component_of(near, which, parent)
            if line.id in seen:
                raise RejectedError(f"{line.child_part_number} is decided twice")
            seen.add(line.id)
            after = _decided(line, decision, conflicts.get(line.id))
            settled.append(replace(decision, child_part_number=line.child_part_number, line_id=line.id))
        except (RejectedError, NotFoundError, ConflictError) as error:
            problems.append(f"decisions[{index}]: {error}")
            continue
        if decision.action is Action.KEEP_SILO:
            _accept(tx, parent, line)
        if after != line.state:
            changes.append(LineChange(line.id, line.child_id, line.state, after, line.position))
    if problems:
        raise RejectedError(f"nothing was changed: {problems[0]}", problems)
    return _write(tx, parent, settled, changes)


def marks_of(lines: Sequence[Line], conflicts: Mapping[str, Conflict]) -> dict[str, str]:
    """Line id → mark of what a page shows of it: its state, and what CAD says where they differ."""
    told = {line_id: conflict.cad_quantity for line_id, conflict in conflicts.items()}
    return {line.id: mark_of(line.state, told.get(line.id)) for line in lines}


def _decided(line: Line, decision: Decision, conflict: Conflict | None) -> LineState | None:
    state, reason = line.state, decision.reason
    if decision.action is Action.REMOVE:
        return None
    if decision.action is Action.KEEP:
        if state.unreferenced_since is None:
            raise RejectedError(f"{line.child_part_number} is not unreferenced; there is nothing to keep")
        return replace(state, source="manual", unreferenced_since=None, reason=reason)
    if conflict is None:
        raise RejectedError(f"{line.child_part_number} is not in conflict")
    if decision.action is Action.KEEP_SILO:
        return replace(state, override=False, cad_quantity=None, reason=reason or state.reason)
    if conflict.cad_quantity == 0:
        return None
    return replace(
        state,
        quantity=conflict.cad_quantity,
        source="assembly",
        override=False,
        cad_quantity=None,
        reason=None,
    )


def _accept(tx: Tx, parent: Item, line: Line) -> None:
    tx.conn.execute(
        update(bom_conflicts)
        .where(bom_conflicts.c.parent_id == parent.id, bom_conflicts.c.child_id == line.child_id)
        .values(accepted=True)
    )


_WORDS = {
    Action.REMOVE: "removed",
    Action.KEEP: "kept as intentional",
    Action.TAKE_CAD: "set to the assembly's quantity",
    Action.KEEP_SILO: "kept at Silo's quantity",
}


def _write(
    tx: Tx, parent: Item, decisions: Sequence[Decision], changes: Sequence[LineChange]
) -> tuple[int, int]:
    counts = {action: sum(d.action is action for d in decisions) for action in Action}
    text = ", ".join(f"{count} {_WORDS[action]}" for action, count in counts.items() if count)
    reasons = list(dict.fromkeys(d.reason for d in decisions if d.reason))
    note = ChangeNote(
        kind=ChangeKind.RESOLVE,
        summary=text or "nothing decided",
        reason="; ".join(reasons) or None,
        decisions=[
            {
                "child_part_number": d.child_part_number,
                "action": d.action.value,
                "reason": d.reason,
                "line_id": d.line_id,
            }
            for d in decisions
        ],
    )
    return apply_changes(tx, parent, changes, note)


@dataclass(frozen=True, slots=True)
class Waiting:
    """A BOM that waits, and for what. ``left_out`` counts what was left out, but the unregistered.

    mark
        of what a decision is about: the BOM's version, and what CAD says of its conflicts.
    """

    item: Item
    mark: str
    last: LastSync
    unreferenced: int
    conflicts: int
    left_out: int
    unregistered: int

    @property
    def total(self) -> int:
        """All that waits."""
        return self.unreferenced + self.conflicts + self.left_out + self.unregistered


def waiting(tx: Tx) -> list[Waiting]:
    """All BOMs that wait, by part number; archived assemblies wait for nobody."""
    unreferenced, conflicts, gaps = _unreferenced(tx), _conflicts(tx), _incomplete(tx)
    found = by_ids(tx, {*unreferenced, *conflicts, *gaps})
    syncs = last_syncs(tx, found)
    rows = []
    for item_id, item in found.items():
        if item.archived_at:
            continue
        last = syncs.get(item_id, NEVER)
        missing = sum(gap["reason"] == Reason.UNREGISTERED for gap in last.gaps)
        rows.append(
            Waiting(
                item,
                _mark(item, conflicts.get(item_id, {})),
                last,
                unreferenced.get(item_id, 0),
                len(conflicts.get(item_id, ())),
                len(last.gaps) - missing,
                missing,
            )
        )
    return sorted(rows, key=lambda row: row.item.part_number.casefold())


def waiting_count(tx: Tx) -> int:
    """How many BOMs wait."""
    ids = {*_unreferenced(tx), *_conflicts(tx), *_incomplete(tx)}
    if not ids:
        return 0
    alive = (
        select(func.count())
        .select_from(items)
        .where(one_of(tx, items.c.id, ids), items.c.archived_at.is_(None))
    )
    return tx.conn.scalar(alive) or 0


def _mark(item: Item, conflicts: Mapping[int, float]) -> str:
    # A sync that only brings other conflicts changes no line, and so not the version.
    told = hashlib.sha256(repr(sorted(conflicts.items())).encode()).hexdigest()[:16]
    return f"{item.bom_version}-{told}"


def decide_all(tx: Tx, part_number: str, action: Action, reason: str | None, seen: str) -> int:
    """Decide the same about all unreferenced lines (``remove``, ``keep``) or all conflicts of a BOM.

    seen
        the mark of what the person saw.
    Returns how many lines there were. VersionConflictError where the BOM is not the one that was seen.
    """
    open_lines = review(tx, get_item(tx, part_number, lock=True).part_number)
    about_conflicts = action in (Action.TAKE_CAD, Action.KEEP_SILO)
    lines = [one.line for one in open_lines.conflicts] if about_conflicts else open_lines.unreferenced
    decisions = [Decision(line.child_part_number, action, reason, line.id) for line in lines]
    if decisions:
        conflicts = {one.line.child_id: one.cad_quantity for one in open_lines.conflicts}
        if seen != _mark(open_lines.parent, conflicts):
            raise VersionConflictError(f"the BOM of {part_number} is not as it was seen")
        resolve(tx, part_number, decisions)
    return len(decisions)


def _unreferenced(tx: Tx) -> Counter[int]:
    query = select(bom_lines.c.parent_id, func.count()).where(text(f"bom_lines.{UNREFERENCED}"))
    return Counter({row[0]: row[1] for row in tx.conn.execute(query.group_by(bom_lines.c.parent_id))})


def _conflicts(tx: Tx) -> dict[int, dict[int, float]]:
    """Parent → child → what CAD says, by the rule of ``review.open_conflicts``, for all BOMs."""
    same = (bom_lines.c.parent_id == bom_conflicts.c.parent_id) & (
        bom_lines.c.child_id == bom_conflicts.c.child_id
    )
    query = (
        select(
            bom_conflicts.c.parent_id,
            bom_conflicts.c.child_id,
            bom_conflicts.c.cad_quantity,
            bom_lines.c.quantity,
        )
        .join(bom_lines, same)
        .where(~bom_conflicts.c.accepted, bom_lines.c.source == "manual", bom_lines.c.rel_type == "component")
    )
    found: dict[int, dict[int, float]] = {}
    for row in tx.conn.execute(query):
        if not same_quantity(row.quantity, row.cad_quantity):
            found.setdefault(row.parent_id, {})[row.child_id] = row.cad_quantity
    return found


def _incomplete(tx: Tx) -> Sequence[int]:
    return tx.conn.scalars(select(bom_last_syncs.c.parent_id).where(text(f"({INCOMPLETE})"))).all()
