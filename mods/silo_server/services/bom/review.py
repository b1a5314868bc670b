# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a merge left for a person to decide, in one BOM and in all, and the decisions about it.

Every page shows how many BOMs wait, so finding them reads nothing but what waits
(``db.tables.UNREFERENCED``, ``INCOMPLETE``).

What people do to a single BOM line (add, change, remove) is one change in the history.

A person follows an item with all that is in it, or a project folder. News are what somebody else changed
since the person looked. A page says how many news there are, with the open BOMs that the person settles
(the badge).
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from enum import StrEnum
from typing import Any, NamedTuple

from sqlalchemy import ColumnElement, delete, func, insert, or_, select, text, true, union, update

from silo.api.wire import LineTexts
from silo.bom.errors import ConflictError, ForbiddenError, NotFoundError, RejectedError, VersionConflictError
from silo.bom.quantities import counts_pieces, plain, same_quantity
from silo.bom.report import Reason
from silo.bom.text import character_problem
from silo_server.actors import Actor, Role
from silo_server.db.database import Database
from silo_server.db.rows import insert_rows, one_of
from silo_server.db.tables import (
    INCOMPLETE,
    UNREFERENCED,
    assignees,
    bom_conflicts,
    bom_last_syncs,
    bom_lines,
    follows,
    items,
    product_looks,
    users,
)
from silo_server.db.tables import events as event_log
from silo_server.db.transaction import Tx
from silo_server.errors import DuplicateError, LinesChangedError
from silo_server.events import log
from silo_server.schema import text_hints
from silo_server.services import access
from silo_server.services.bom.history import Change, last_merge
from silo_server.services.bom.lines import (
    ChangeKind,
    ChangeNote,
    LineId,
    LineRecord,
    apply_changes,
    check_no_cycle,
    component_of,
    line_of,
    lines_of,
    mark_of,
    new_line_id,
    parent_to_change,
)
from silo_server.services.bom.summary import LastChange, Summary, at_once
from silo_server.services.bom.tree import Graph, Told, conflicts_in
from silo_server.services.field_checks import quantity_problem
from silo_server.services.items import get_by_uuids, get_item
from silo_server.user_json import json_problem
from silo_server.values import Item, Line, LineState

REL_TYPES = ("component", "alternate", "reference")
SOURCES = ("manual", "assembly")


@dataclass(frozen=True, slots=True)
class Edited:
    """The line after an edit (None once removed), its parent, and the BOM's version and change."""

    parent: Item
    line: Line | None
    version: int
    change_id: int
    child_part_number: str


def add_line(
    tx: Tx,
    part_number: str,
    child_part_number: str,
    state: LineState,
    expected: int | None = None,
    *,
    why: str | None = None,
) -> Edited:
    """Add a line. Raises DuplicateError if the BOM has the child already, CycleError, RejectedError."""
    parent = parent_to_change(tx, part_number, expected)
    child = get_item(tx, child_part_number)
    check_state(state)
    for line in lines_of(tx, parent):
        if line.child_id == child.id and line.state.rel_type == state.rel_type:
            raise DuplicateError(
                f"{child.part_number} is in the BOM of {parent.part_number} already; change its line instead"
            )
    check_no_cycle(tx, parent, [child.id])
    change = LineRecord(new_line_id(), child.id, None, state)
    text = f"{child.part_number} added, quantity {plain(state.quantity)}"
    return _apply(tx, parent, change, child.part_number, text, why)


def change_line(
    tx: Tx,
    part_number: str,
    which: str | LineId,
    changes: Mapping[str, Any],
    expected: int | None = None,
    *,
    why: str | None = None,
) -> Edited:
    """Change the fields (those of LineState that people own) of the line with this id, or of this child.

    A different quantity, or a unit other than pieces, makes an assembly line a manual override, which
    remembers the quantity of the assembly; that quantity, in pieces again, ends the override. A ``source``
    among the changes wins over this.
    """
    parent = parent_to_change(tx, part_number, expected)
    lines = lines_of(tx, parent)
    line = line_of(lines, which, parent)
    after = edited_state(line.state, changes)
    check_state(after)
    if after == line.state:
        return Edited(parent, line, parent.bom_version, 0, line.child_part_number)
    child = line.child_part_number
    if after.rel_type != line.state.rel_type and any(
        (other.child_id, other.state.rel_type) == (line.child_id, after.rel_type) for other in lines
    ):
        raise DuplicateError(f"{child} is in this BOM as {after.rel_type} already")
    fields = sorted(k for k in changes if getattr(after, k) != getattr(line.state, k))
    if not same_quantity(after.quantity, line.state.quantity):
        quantity = f"quantity {plain(line.state.quantity)} → {plain(after.quantity)}"
        fields = [quantity, *(name for name in fields if name != "quantity")]
    words = ", ".join(name.replace("_", " ") for name in fields) or "source"
    change = LineRecord(line.id, line.child_id, line.state, after, line.position)
    return _apply(tx, parent, change, child, f"{child} changed: {words}", why)


def remove_line(
    tx: Tx,
    part_number: str,
    which: str | LineId,
    expected: int | None = None,
    *,
    seen: str | None = None,
    why: str | None = None,
) -> Edited:
    """Remove the line with this id, or of this child; only people do this.

    seen
        the :func:`mark_of` the line as the person saw it; LinesChangedError if the line has changed since.
    """
    parent = parent_to_change(tx, part_number, expected)
    line = line_of(lines_of(tx, parent), which, parent)
    if seen is not None and seen != mark_of(line.state):
        raise LinesChangedError(f"{line.child_part_number} was changed meanwhile", [line.id])
    change = LineRecord(line.id, line.child_id, line.state, None, line.position)
    return _apply(tx, parent, change, line.child_part_number, f"{line.child_part_number} removed", why)


def edited_state(before: LineState, changes: Mapping[str, Any]) -> LineState:
    """Apply a person's edit to a state; pure, so that the import's preview gives the same result."""
    after = replace(before, **changes)
    if "source" in changes:
        if after.source == "assembly":
            return replace(after, override=False, cad_quantity=None, reason=None)
        return replace(after, unreferenced_since=None)
    pieces = counts_pieces(after.unit)
    same_unit = after.unit == before.unit or (pieces and counts_pieces(before.unit))
    if same_unit and same_quantity(after.quantity, before.quantity):
        return after
    if before.override and pieces and same_quantity(after.quantity, before.cad_quantity):
        return replace(after, source="assembly", override=False, cad_quantity=None)
    if before.source == "assembly":
        return replace(
            after, source="manual", override=True, cad_quantity=before.quantity, unreferenced_since=None
        )
    return after


def check_state(state: LineState) -> None:
    """Raise RejectedError, with everything that is wrong, unless the line's state is usable."""
    problems = []
    problem = quantity_problem(state.quantity)
    if problem:
        problems.append(f"quantity: {problem}")
    if state.rel_type not in REL_TYPES:
        problems.append(f"rel_type: wanted one of {', '.join(REL_TYPES)}, got {state.rel_type!r}")
    if state.source not in SOURCES:
        problems.append(f"source: wanted one of {', '.join(SOURCES)}, got {state.source!r}")
    for name, field in LineTexts.model_fields.items():
        value, limit = getattr(state, name), text_hints(field).get("maxLength")
        if value is not None and limit and len(value) > limit:
            problems.append(f"{name}: wanted at most {limit} characters, got {len(value)}")
    for name in (*LineTexts.model_fields, "reason", "reference_designators"):
        for written in (value,) if isinstance(value := getattr(state, name), str) else value or ():
            if problem := character_problem(written):
                problems.append(f"{name}: {problem}")
    if state.metadata and (problem := json_problem(state.metadata)):
        problems.append(f"metadata: {problem}")
    if problems:
        raise RejectedError("; ".join(problems), problems)


def _apply(tx: Tx, parent: Item, change: LineRecord, child: str, text: str, why: str | None = None) -> Edited:
    note = ChangeNote(kind=ChangeKind.EDIT, summary=text, reason=why)
    change_id, version = apply_changes(tx, parent, [change], note)
    after = None
    if change.after is not None:
        after = next(line for line in lines_of(tx, parent) if line.id == change.line_id)
    return Edited(parent, after, version, change_id, child)


class ReviewAction(StrEnum):
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
    action: ReviewAction
    reason: str | None = None
    line_id: str | None = None
    seen: str | None = None


@dataclass(frozen=True, slots=True)
class Conflict:
    """CAD and a person's line differ. ``cad_quantity`` 0: the assembly no longer has it."""

    line: Line
    cad_quantity: float
    since: str


@dataclass(frozen=True, slots=True)
class Review:
    """What is open on a BOM, and all its lines."""

    parent: Item
    lines: Sequence[Line]
    unreferenced: Sequence[Line]
    conflicts: Sequence[Conflict]
    last_merge: Change | None


def review(tx: Tx, part_number: str) -> Review:
    """Find the open questions of an item's BOM."""
    parent = get_item(tx, part_number)
    lines = lines_of(tx, parent)
    return Review(
        parent,
        lines,
        [line for line in lines if line.state.unreferenced_since],
        open_conflicts(tx, parent, lines),
        last_merge(tx, parent),
    )


def open_conflicts(tx: Tx, parent: Item, lines: Sequence[Line]) -> list[Conflict]:
    """Find the open conflicts of one BOM, in the order of its lines."""
    graph = Graph(parent, {parent.id: lines}, conflicts_in(tx, [parent.id]))
    conflict = graph.conflicts.get(parent.id, {})
    return [Conflict(line, *conflict[line.child_id]) for line in lines if graph.told(line) is not None]


def told_quantities(tx: Tx, parent_ids: Collection[int]) -> dict[int, dict[int, float]]:
    """Read the quantities that the last merge gave for people's lines; 0: not in the assembly.

    Parent → child → quantity, by internal ids.
    """
    rows = tx.conn.execute(
        select(bom_conflicts.c.parent_id, bom_conflicts.c.child_id, bom_conflicts.c.cad_quantity).where(
            one_of(tx, bom_conflicts.c.parent_id, parent_ids)
        )
    )
    quantities: dict[int, dict[int, float]] = {}
    for row in rows:
        quantities.setdefault(row.parent_id, {})[row.child_id] = row.cad_quantity
    return quantities


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
        if decision.action is ReviewAction.KEEP_SILO:
            _accept(tx, parent, line)
        if after != line.state:
            changes.append(LineRecord(line.id, line.child_id, line.state, after, line.position))
    if problems:
        raise RejectedError(f"nothing was changed: {problems[0]}", problems)
    return _write(tx, parent, settled, changes)


def marks_of(lines: Sequence[Line], conflicts: Mapping[str, Conflict]) -> dict[str, str]:
    """Make the mark of each line as a page shows it: its state, and CAD's quantity if they differ."""
    quantities = {line_id: conflict.cad_quantity for line_id, conflict in conflicts.items()}
    return {line.id: mark_of(line.state, quantities.get(line.id)) for line in lines}


def _decided(line: Line, decision: Decision, conflict: Conflict | None) -> LineState | None:
    state, reason = line.state, decision.reason
    if decision.action is ReviewAction.REMOVE:
        return None
    if decision.action is ReviewAction.KEEP:
        if state.unreferenced_since is None:
            raise RejectedError(f"{line.child_part_number} is not unreferenced; there is nothing to keep")
        return replace(state, source="manual", unreferenced_since=None, reason=reason)
    if conflict is None:
        raise RejectedError(f"{line.child_part_number} is not in conflict")
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
    ReviewAction.REMOVE: "removed",
    ReviewAction.KEEP: "kept as intentional",
    ReviewAction.TAKE_CAD: "set to the assembly's quantity",
    ReviewAction.KEEP_SILO: "kept at Silo's quantity",
}


def _write(
    tx: Tx, parent: Item, decisions: Sequence[Decision], changes: Sequence[LineRecord]
) -> tuple[int, int]:
    counts = {action: sum(d.action is action for d in decisions) for action in ReviewAction}
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


class Waiting(NamedTuple):
    """A BOM that waits, and for what. ``left_out`` counts what was left out, without unregistered parts.

    told
        CAD's quantities in its conflicts, by the child's internal id.
    """

    item_id: int
    part_number: str
    name: str
    version: int
    folder: str
    document_file: str
    synced_at: str | None
    told: Told
    assignee: str
    unreferenced: int
    left_out: int
    unregistered: int

    @property
    def conflicts(self) -> int:
        """Count the lines for which CAD has another quantity."""
        return len(self.told)

    @property
    def mark(self) -> str:
        """Make the mark of what is decided about: the BOM's version, and CAD's quantities in conflict."""
        return _mark(self.version, self.told)


def waiting(tx: Tx) -> list[Waiting]:
    """Find all BOMs that wait for a person, by part number; archived assemblies never wait.

    Reads only what a list of them is filtered and sorted by: there may be thousands.
    """
    unreferenced, conflicts, gaps = _unreferenced(tx), conflicts_in(tx), _gaps(tx)
    row, last, nobody = items.c, bom_last_syncs.c, Told()
    shown = (row.id, row.part_number, row.name, row.bom_version, last.folder, last.document_file, last.at)
    query = (
        select(*shown, users.c.username)
        .outerjoin_from(items, bom_last_syncs, last.parent_id == row.id)
        .outerjoin(assignees, assignees.c.item_id == row.id)
        .outerjoin(users, users.c.id == assignees.c.user_id)
        .where(one_of(tx, row.id, {*unreferenced, *conflicts, *gaps}), row.archived_at.is_(None))
    )
    waitings = [
        Waiting(
            *(record, number, name, version, folder or "", file or "", at),
            *(
                conflicts.get(record, nobody),
                who or "",
                unreferenced[record],
                *gaps.get(record, (0, 0)),
            ),
        )
        for record, number, name, version, folder, file, at, who in tx.conn.execute(query)
    ]
    return sorted(waitings, key=lambda record: record.part_number.casefold())


def waiting_count(tx: Tx) -> int:
    """Count the BOMs that wait."""
    return _count(tx, lambda _: true())


def open_among(tx: Tx, item_ids: Collection[int]) -> int:
    """Count how many of these BOMs wait."""
    return _count(tx, lambda element: one_of(tx, element, item_ids))


def waiting_in(tx: Tx, folder: str) -> int:
    """Count the BOMs that wait in a project folder and in the folders below it."""
    last = bom_last_syncs.c
    inside = or_(last.folder == folder, last.folder.startswith(f"{folder}/", autoescape=True))
    return _count(tx, lambda element: element.in_(select(last.parent_id).where(inside)))


def _count(tx: Tx, which: Callable[[ColumnElement[int]], ColumnElement[bool]]) -> int:
    unreferenced = select(bom_lines.c.parent_id).where(text(f"bom_lines.{UNREFERENCED}"))
    incomplete = select(bom_last_syncs.c.parent_id).where(text(f"({INCOMPLETE})"))
    disputed = select(items.c.id).where(one_of(tx, items.c.id, conflicts_in(tx)))
    parent_id = union(unreferenced, incomplete, disputed).subquery().c.parent_id
    # Archived items are few: PostgreSQL reads all items, for each page, if asked which of these are not.
    archived = select(items.c.id).where(items.c.archived_at.is_not(None))
    return (
        tx.conn.scalar(select(func.count(parent_id)).where(parent_id.not_in(archived), which(parent_id))) or 0
    )


def _mark(version: int, conflicts: Told) -> str:
    # A sync that only brings other conflicts changes no line, and so not the version.
    digest = repr(sorted((child, conflict[0]) for child, conflict in conflicts.items()))
    return f"{version}-{hashlib.sha256(digest.encode()).hexdigest()[:16]}"


def lines_for(tx: Tx, part_number: str, action: ReviewAction, seen: str) -> tuple[list[Line], list[Line]]:
    """Find the open lines of a BOM that ``action`` is about, and those of them that it would remove.

    seen
        the mark of what the person saw; VersionConflictError if the BOM has changed since.
    """
    open_lines = review(tx, part_number)
    if action in (ReviewAction.TAKE_CAD, ReviewAction.KEEP_SILO):
        lines = [conflict.line for conflict in open_lines.conflicts]
        gone = [
            conflict.line
            for conflict in open_lines.conflicts
            if action is ReviewAction.TAKE_CAD and not conflict.cad_quantity
        ]
    else:
        lines = list(open_lines.unreferenced)
        gone = lines if action is ReviewAction.REMOVE else []
    conflicts = {
        conflict.line.child_id: (conflict.cad_quantity, conflict.since) for conflict in open_lines.conflicts
    }
    if lines and seen != _mark(open_lines.parent.bom_version, conflicts):
        raise VersionConflictError(f"the BOM of {part_number} has changed since you looked")
    return lines, gone


def decide_all(
    tx: Tx, part_number: str, action: ReviewAction, reason: str | None, seen: str
) -> tuple[int, int | None]:
    """Decide the same about all lines of :func:`lines_for`; return how many, and the change, if any."""
    lines, _ = lines_for(tx, get_item(tx, part_number, lock=True).part_number, action, seen)
    decisions = [Decision(line.child_part_number, action, reason, line.id) for line in lines]
    return len(decisions), resolve(tx, part_number, decisions)[0] if decisions else None


def _unreferenced(tx: Tx) -> Counter[int]:
    query = select(bom_lines.c.parent_id, func.count()).where(text(f"bom_lines.{UNREFERENCED}"))
    return Counter({row[0]: row[1] for row in tx.conn.execute(query.group_by(bom_lines.c.parent_id))})


def _gaps(tx: Tx) -> dict[int, tuple[int, int]]:
    """Count by BOM what its last sync left out: all but the unregistered parts, and these."""
    row = bom_last_syncs.c
    query = select(row.parent_id, row.left_out, row.refused_at).where(text(f"({INCOMPLETE})"))
    gaps: dict[int, tuple[int, int]] = {}
    for parent_id, left_out, refused_at in tx.conn.execute(query):
        reasons = [load["reason"] for load in json.loads(left_out)]
        missing = reasons.count(Reason.UNREGISTERED)
        gaps[parent_id] = len(reasons) + bool(refused_at) - missing, missing
    return gaps


SAME_LOOK = timedelta(hours=1)
ITEM, FOLDER = "item:", "folder:"
MOST_FOLLOWED = 200


class Followed(NamedTuple):
    """What a person follows: an item, or a folder if there is none.

    since
        when the person looked at the item.
    news
        somebody else changed something in it since then.
    waiting
        how many BOMs with something open are in a folder.
    """

    target: str
    item: Item | None
    folder: str
    summary: Summary | None
    changed: LastChange | None
    news: bool
    waiting: int = 0
    since: str = ""


def follow(tx: Tx, target: str, *, on: bool) -> None:
    """Begin or stop following ``item:UUID`` or ``folder:PATH``."""
    kind, _, name = target.partition(":")
    folder = name.strip("/")
    if kind == "item" and get_by_uuids(tx, [name], include_archived=True):
        target = ITEM + name.lower()
    elif kind == "folder" and folder and len(folder) <= 1000:
        target = FOLDER + folder
    else:
        raise RejectedError(f"target: wanted an item or a project folder, got {target[:80]!r}")
    row, user_id = follows.c, tx.actor.own_id
    tx.conn.execute(delete(follows).where(row.user_id == user_id, row.target == target))
    count = tx.conn.scalar(select(func.count()).select_from(follows).where(row.user_id == user_id)) or 0
    if on and count >= MOST_FOLLOWED:
        raise RejectedError(
            f"you can follow at most {MOST_FOLLOWED} items and folders; stop following some first"
        )
    if on:
        seen = {"seen": tx.stamp, "event": log.bounds(tx)[1]}
        tx.conn.execute(insert(follows).values(user_id=user_id, target=target, **seen))


def is_followed(tx: Tx, user_id: int, item: Item) -> bool:
    """Return True if this user follows the item."""
    row = follows.c
    query = select(row.seen).where(row.user_id == user_id, row.target == ITEM + item.uuid)
    return tx.conn.scalar(query) is not None


def have_seen(tx: Tx) -> None:
    """Mark all news of the person as seen."""
    seen = {"seen": tx.stamp, "event": log.bounds(tx)[1]}
    tx.conn.execute(follows.update().where(follows.c.user_id == tx.actor.own_id).values(seen))


def followed(tx: Tx, actor: Actor, *, whole: bool = True) -> list[Followed]:
    """Read what a person follows, news first. Not ``whole``: does not count the BOMs that wait in folders."""
    rows = tx.conn.execute(select(follows).where(follows.c.user_id == actor.own_id)).all()
    if not rows:
        return []
    by_uuid = {row.target.removeprefix(ITEM): row for row in rows if row.target.startswith(ITEM)}
    items_followed = get_by_uuids(tx, list(by_uuid), include_archived=True)
    sums = at_once(tx, {item.id for item in items_followed})
    look = product_looks.c
    query = select(look.item_id, look.at).where(look.user_id == actor.own_id, one_of(tx, look.item_id, sums))
    looked = dict(tx.conn.execute(query).all())
    subjects = []
    for item in items_followed:
        row, summary = by_uuid[item.uuid], sums.get(item.id)
        changed = summary.changed if summary else None
        last = max(row.seen, looked.get(item.id, ""))
        news = changed is not None and changed.at > last and changed.username != actor.username
        subjects.append(Followed(row.target, item, "", summary, changed, news, since=last))
    for row in rows:
        if row.target.startswith(FOLDER):
            folder = row.target.removeprefix(FOLDER)
            changed = _newest_in(tx, folder, row.event, actor.username)
            waits = waiting_in(tx, folder) if whole else 0
            subjects.append(Followed(row.target, None, folder, None, changed, changed is not None, waits))
    return sorted(
        subjects,
        key=lambda subject: (not subject.news, subject.item.part_number if subject.item else subject.folder),
    )


def _newest_in(tx: Tx, folder: str, after: int, but: str) -> LastChange | None:
    """Find the newest event in the BOMs of a folder, after event ``after``, that is not by user ``but``."""
    event, last = event_log.c, bom_last_syncs.c
    query = (
        select(event.at, event.username, items.c.part_number)
        .join(items, items.c.uuid == event.item_uuid)
        .join(bom_last_syncs, last.parent_id == items.c.id)
        .where(event.id > after, event.username != but)
        .where(or_(last.folder == folder, last.folder.startswith(f"{folder}/", autoescape=True)))
    )
    row = tx.conn.execute(query.order_by(event.id.desc()).limit(1)).one_or_none()
    return None if row is None else LastChange(*row)


def assign(tx: Tx, part_number: str, username: str) -> None:
    """Let a person settle what is open in a BOM; username "": nobody in particular."""
    item = get_item(tx, part_number, lock=True)
    tx.conn.execute(delete(assignees).where(assignees.c.item_id == item.id))
    if username:
        user = access.get_user(tx, username)
        if not (user.active and user.role.covers(Role.EDITOR)):
            raise ForbiddenError(f"{user.username} cannot change BOMs, so cannot settle what is open in one")
        tx.conn.execute(insert(assignees).values(item_id=item.id, user_id=user.id, at=tx.stamp))
    access.note(tx, "bom.assigned", item.part_number, username or "nobody")


def assignee_of(tx: Tx, item: Item) -> str:
    """Return the name of the person who settles what is open in a BOM; "" if nobody in particular does."""
    query = select(users.c.username).join(assignees, assignees.c.user_id == users.c.id)
    return tx.conn.scalar(query.where(assignees.c.item_id == item.id)) or ""


def editors(tx: Tx) -> list[str]:
    """List the names of all users who may settle what is open."""
    return [user.username for user in access.list_users(tx) if user.active and user.role.covers(Role.EDITOR)]


def badge(tx: Tx, actor: Actor) -> int:
    """Count what waits for a person: the open BOMs that are theirs, and the news of what they follow."""
    theirs = select(assignees.c.item_id).where(assignees.c.user_id == actor.own_id)
    ids = list(tx.conn.scalars(theirs))
    mine = open_among(tx, ids) if ids else 0
    return mine + sum(subject.news for subject in followed(tx, actor, whole=False))


def last_look(tx: Tx, user_id: int, item: Item) -> str | None:
    """Find when this person last looked at the product before now; looks within one hour count as one."""
    row = tx.conn.execute(select(product_looks).where(_look_of([(user_id, item.id)]))).one_or_none()
    return _look_before(row, tx.stamp)


def keep_looks(db: Database) -> None:
    """Write down who looked at what, and when; no page waits for this."""
    looks = dict(db.looks)
    if not looks:
        return
    with db.write(even_when_read_only=True) as tx:
        ours = _look_of(looks)
        before = {
            (row.user_id, row.item_id): row for row in tx.conn.execute(select(product_looks).where(ours))
        }
        tx.conn.execute(delete(product_looks).where(ours))
        rows = [
            {"user_id": user, "item_id": item, "at": at, "since": _look_before(before.get((user, item)), at)}
            for (user, item), at in looks.items()
        ]
        insert_rows(tx, product_looks, rows)
    for who, at in looks.items():
        if db.looks.get(who) == at:
            del db.looks[who]


def _look_of(whose: Iterable[tuple[int, int]]) -> ColumnElement[bool]:
    row = product_looks.c
    return or_(*((row.user_id == user) & (row.item_id == item) for user, item in whose))


def _look_before(row: Any, now: str) -> str | None:
    if row is None:
        return None
    is_another = datetime.fromisoformat(now) - datetime.fromisoformat(row.at) > SAME_LOOK
    return str(row.at) if is_another else row.since
