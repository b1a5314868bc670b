# SPDX-License-Identifier: LGPL-2.1-or-later
"""The decisions of a reviewer about unreferenced lines and conflicts; all of a request are one change.

A decision says which state of the line the reviewer saw. If the line has changed since, nothing is changed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

from sqlalchemy import update

from silo.bom.errors import ConflictError, NotFoundError, RejectedError, VersionConflictError
from silo.bom.message import Message, joined, message, template
from silo.bom.units import counts_pieces
from silo_server.db.tables import bom_conflicts
from silo_server.db.transaction import Tx
from silo_server.errors import LinesChangedError
from silo_server.services.bom.change import ChangeNote, apply_changes, parent_to_change
from silo_server.services.bom.conflicts import CadQuantity, Conflict, open_conflicts
from silo_server.services.bom.line_edit import owned_by_users
from silo_server.services.bom.line_record import ChangeKind, LineRecord
from silo_server.services.bom.lines import LineId, component_of, lines_of
from silo_server.services.bom.review import marks_of, review
from silo_server.services.bom.waiting import conflicts_mark
from silo_server.services.items import get_item
from silo_server.values import Item, Line, LineState


class ReviewAction(StrEnum):
    """What a user decides about a line."""

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
    action: ReviewAction
    reason: str | None = None
    line_id: str | None = None
    seen: str | None = None


def resolve(
    tx: Tx, part_number: str, decisions: Sequence[Decision], expected: int | None = None
) -> tuple[int, int]:
    """Carry out all ``decisions`` as one change. Returns (change id, version).

    Raises LinesChangedError if lines are not as they were seen, RejectedError with everything that does
    not fit; then nothing was changed.
    """
    parent = parent_to_change(tx, part_number, expected)
    lines = lines_of(tx, parent)
    conflicts = {c.line.id: c for c in open_conflicts(tx, parent, lines)}
    changes: list[LineRecord] = []
    problems: list[str] = []
    settled: list[Decision] = []
    seen: set[str] = set()
    asked = {decision.line_id for decision in decisions if decision.seen}
    marks = marks_of([line for line in lines if line.id in asked], conflicts)
    stale = [d.line_id for d in decisions if d.line_id and d.seen and d.seen != marks.get(d.line_id)]
    if stale:
        raise LinesChangedError(
            message("{n} of the lines were changed meanwhile; nothing was changed", n=len(stale)), stale
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
                raise RejectedError(
                    message("{part_number} is decided twice", part_number=line.child_part_number)
                )
            seen.add(line.id)
            after = _decided(line, decision, conflicts.get(line.id))
            settled.append(replace(decision, child_part_number=line.child_part_number, line_id=line.id))
        except (RejectedError, NotFoundError, ConflictError) as error:
            problems.append(message("decisions[{index}]: {problem}", index=index, problem=error))
            continue
        if decision.action is ReviewAction.KEEP_SILO:
            _accept(tx, parent, line)
        if after != line.state:
            changes.append(LineRecord(line.id, line.child_id, line.state, after, line.position))
    if problems:
        raise RejectedError(message("nothing was changed: {problem}", problem=problems[0]), problems)
    return _write(tx, parent, settled, changes)


def _decided(line: Line, decision: Decision, conflict: Conflict | None) -> LineState | None:
    state, reason = line.state, decision.reason
    if decision.action is ReviewAction.REMOVE:
        return None
    if decision.action is ReviewAction.KEEP:
        if state.unreferenced_since is None:
            raise RejectedError(
                message(
                    "{part_number} is not unreferenced; there is nothing to keep",
                    part_number=line.child_part_number,
                )
            )
        kept = replace(state, source="manual", unreferenced_since=None, reason=reason)
        return owned_by_users(kept, state, line.child_unit)
    if conflict is None:
        raise RejectedError(message("{part_number} is not in conflict", part_number=line.child_part_number))
    if decision.action is ReviewAction.KEEP_SILO:
        return replace(state, override=False, cad_quantity=None, reason=reason or state.reason)
    if conflict.cad_quantity == 0:
        return None
    return replace(
        state,
        quantity=conflict.cad_quantity,
        unit=state.unit if counts_pieces(state.unit) else None,
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
    ReviewAction.REMOVE: template("{n} removed"),
    ReviewAction.KEEP: template("{n} kept as intentional"),
    ReviewAction.TAKE_CAD: template("{n} set to the assembly's quantity"),
    ReviewAction.KEEP_SILO: template("{n} kept at Silo's quantity"),
}


def _write(
    tx: Tx, parent: Item, decisions: Sequence[Decision], changes: Sequence[LineRecord]
) -> tuple[int, int]:
    counts = {action: sum(d.action is action for d in decisions) for action in ReviewAction}
    text = joined(", ", [Message(_WORDS[action], {"n": count}) for action, count in counts.items() if count])
    reasons = list(dict.fromkeys(d.reason for d in decisions if d.reason))
    note = ChangeNote(
        kind=ChangeKind.RESOLVE,
        summary=text or message("nothing decided"),
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


def lines_for(tx: Tx, part_number: str, action: ReviewAction, seen: str) -> tuple[list[Line], list[Line]]:
    """Find the open lines of a BOM that ``action`` is about, and those of them that it would remove.

    seen
        the mark of what the person saw; VersionConflictError if the BOM has changed since.
    """
    found = review(tx, part_number)
    if action in (ReviewAction.TAKE_CAD, ReviewAction.KEEP_SILO):
        lines = [conflict.line for conflict in found.conflicts]
        gone = [
            conflict.line
            for conflict in found.conflicts
            if action is ReviewAction.TAKE_CAD and not conflict.cad_quantity
        ]
    else:
        lines = list(found.unreferenced)
        gone = lines if action is ReviewAction.REMOVE else []
    conflicts = {
        conflict.line.child_id: CadQuantity(conflict.cad_quantity, conflict.since)
        for conflict in found.conflicts
    }
    if lines and seen != conflicts_mark(found.parent.bom_version, conflicts):
        raise VersionConflictError(
            message("the BOM of {part_number} has changed since you looked", part_number=part_number)
        )
    return lines, gone


def decide_all(
    tx: Tx, part_number: str, action: ReviewAction, reason: str | None, seen: str
) -> tuple[int, int | None]:
    """Decide the same about all lines of :func:`lines_for`; return how many, and the change, if any."""
    lines, _ = lines_for(tx, get_item(tx, part_number, lock=True).part_number, action, seen)
    decisions = [Decision(line.child_part_number, action, reason, line.id) for line in lines]
    return len(decisions), resolve(tx, part_number, decisions)[0] if decisions else None
