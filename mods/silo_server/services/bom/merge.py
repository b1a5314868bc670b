# SPDX-License-Identifier: LGPL-2.1-or-later
"""The merge of an assembly into its BOM (spec bom-sync §5): check, plan, apply, announce; one transaction.

The rules are those of :mod:`silo.bom.merge`; here is what a server adds: who may change which row is enforced
on the stored rows, a ``sync_id`` gives the same answer again, a version mismatch is refused, a person's
decision on a conflict is remembered until the assembly says something else.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from sqlalchemy import delete, insert, select

from silo.bom.errors import ConflictError, RejectedError
from silo.bom.merge import MergePlan, answer_of, plan_merge, summary
from silo.bom.model import QuantityChange
from silo.bom.numbers import plain
from silo_server.db.bulk import insert_rows, one_of
from silo_server.db.engine import Tx
from silo_server.db.tables import bom_conflicts, bom_syncs, items
from silo_server.json_values import dumps
from silo_server.services import events
from silo_server.services.bom.changes import (
    ChangeKind,
    ChangeNote,
    LineChange,
    apply_changes,
    check_no_cycle,
    check_version,
    new_line_id,
)
from silo_server.services.bom.history import state_at
from silo_server.services.bom.last_sync import LastSync, last_sync, remember
from silo_server.services.bom.lines import lines_of
from silo_server.services.bom.merge_json import MergeOrder, event_of
from silo_server.services.items import get_item
from silo_server.services.revisions import check_document
from silo_server.values import Item, Line, LineState


@dataclass(frozen=True, slots=True)
class MergeOutcome:
    """The answer's JSON text, and the BOM's version."""

    answer: str
    version: int


@dataclass(frozen=True, slots=True)
class _Prepared:
    parent: Item
    lines: Sequence[Line]
    child_ids: Mapping[str, int]
    plan: MergePlan
    accepted: Mapping[int, float]
    conflicts: Sequence[QuantityChange]  # all of them, accepted ones too
    before: LastSync


def preview_merge(tx: Tx, part_number: str, order: MergeOrder, expected: int | None) -> MergeOutcome:
    """The answer that :func:`merge_bom` would give, without changing anything."""
    parent = get_item(tx, part_number)
    check_version(parent, expected)
    prepared = _prepare(tx, parent, order)
    answer = answer_of(prepared.plan.diff, parent.part_number, order.sync_id, order.left_out)
    return MergeOutcome(dumps(answer), parent.bom_version)


def merge_bom(tx: Tx, part_number: str, order: MergeOrder, expected: int | None) -> MergeOutcome:
    """Merge the assembly's direct children into the BOM.

    Raises NotFoundError (parent), RejectedError (all bad entries at once), CycleError, VersionConflictError,
    ConflictError (the ``sync_id`` was used for something else), NewerRevisionError (the document is not the
    item's newest file), MissingRevisionError (its file is not here).
    """
    parent = get_item(tx, part_number, lock=True)
    earlier = _replay(tx, parent, order)
    if earlier is not None:
        return earlier
    check_version(parent, expected)
    prepared = _prepare(tx, parent, order)
    changes = _line_changes(tx, prepared)
    change_id, version = apply_changes(tx, parent, changes, _note(prepared, order))
    _remember_conflicts(tx, prepared)
    kept = [change.part_number for change in prepared.plan.diff.kept]
    remember(tx, parent, order, prepared.child_ids, prepared.before, kept)
    answer = answer_of(prepared.plan.diff, parent.part_number, order.sync_id, order.left_out)
    text = dumps(answer)
    if order.sync_id:
        _remember_sync(tx, parent, order, text, version, _reference(prepared, changes, answer, change_id))
    events.bom_merged(tx, parent, event_of(tx, parent, prepared.plan.diff, answer))
    return MergeOutcome(text, version)


def _prepare(tx: Tx, parent: Item, order: MergeOrder) -> _Prepared:
    check_document(tx, parent, order.document_revision, order.document_sha256)
    lines = lines_of(tx, parent)
    child_ids, names = _children(tx, order, lines)
    entries: list[dict[str, Any]] = [
        {"child_part_number": names[entry.key], "quantity": entry.quantity} for entry in order.entries
    ]
    before = last_sync(tx, parent)
    known = [{**_as_mapping(line), "components": before.components.get(line.child_id, ())} for line in lines]
    plan = plan_merge(entries, known, order.missing)
    kept = {change.part_number for change in plan.diff.kept}
    check_no_cycle(tx, parent, [child_ids[change.part_number] for change in plan.diff.added])
    accepted = {
        row.child_id: row.cad_quantity
        for row in tx.conn.execute(
            select(bom_conflicts.c.child_id, bom_conflicts.c.cad_quantity).where(
                bom_conflicts.c.parent_id == parent.id, bom_conflicts.c.accepted
            )
        )
    }
    conflicts = [
        *plan.diff.conflicts,
        *_overrides_gone(lines, kept.union(e["child_part_number"] for e in entries)),
    ]
    open_ones = tuple(c for c in conflicts if accepted.get(child_ids[c.part_number]) != c.local_quantity)
    plan = replace(plan, diff=replace(plan.diff, conflicts=open_ones))
    return _Prepared(parent, lines, child_ids, plan, accepted, conflicts, before)


def _children(tx: Tx, order: MergeOrder, lines: Sequence[Line]) -> tuple[dict[str, int], dict[str, str]]:
    """(part number → item id, key → part number) of every child; RejectedError lists all bad entries."""
    child_ids = {line.child_part_number: line.child_id for line in lines}
    names = {line.child_part_number.casefold(): line.child_part_number for line in lines}
    asked = {entry.key for entry in order.entries if entry.key not in names}
    archived: set[str] = set()
    query = select(items.c.id, items.c.part_number, items.c.part_number_key, items.c.archived_at)
    for row in tx.conn.execute(query.where(one_of(tx, items.c.part_number_key, asked))):
        if row.archived_at:
            archived.add(row.part_number_key)
            continue
        child_ids[row.part_number] = row.id
        names[row.part_number_key] = row.part_number
    problems = list(order.problems)
    for entry in order.entries:
        if entry.key not in names:
            state = "is archived" if entry.key in archived else "does not exist on this server"
            problems.append(
                (entry.index, f"entries[{entry.index}].child_part_number: {entry.part_number!r} {state}")
            )
    if problems:
        texts = [text for _, text in sorted(problems, key=lambda problem: problem[0])]
        raise RejectedError(
            f"{len(texts)} of the entries cannot be merged, so nothing was changed: {texts[0]}"
            + (f" (and {len(texts) - 1} more)" if len(texts) > 1 else ""),
            texts,
        )
    return child_ids, names


def _as_mapping(line: Line) -> dict[str, Any]:
    state = line.state
    return {
        "child_part_number": line.child_part_number,
        "quantity": state.quantity,
        "source": state.source,
        "rel_type": state.rel_type,
        "unreferenced_since": state.unreferenced_since,
    }


def _overrides_gone(lines: Sequence[Line], numbers: set[str]) -> list[QuantityChange]:
    # A person changed a quantity of a CAD line; now the assembly has it no more. The line is theirs, so it
    # stays, but silence would leave a part in the BOM that nobody needs.
    return [
        QuantityChange(line.child_part_number, 0.0, line.state.quantity)
        for line in lines
        if line.state.override and line.child_part_number not in numbers
    ]


def _line_changes(tx: Tx, prepared: _Prepared) -> list[LineChange]:
    plan = prepared.plan
    changes = [
        LineChange(
            new_line_id(),
            prepared.child_ids[added.part_number],
            None,
            LineState(float(added.quantity or 0.0), "assembly"),
        )
        for added in plan.diff.added
    ]
    quantities = {c.part_number: c.local_quantity for c in plan.diff.quantity_changed}
    flag, unflag = set(plan.flag), set(plan.unflag)
    touched = flag | unflag | quantities.keys()
    for line in prepared.lines:
        name, before = line.child_part_number, line.state
        # Ownership is enforced here, on the stored row, whatever the plan says.
        if name not in touched or before.source != "assembly" or before.rel_type != "component":
            continue
        since = tx.stamp if name in flag else None if name in unflag else before.unreferenced_since
        after = replace(before, quantity=quantities.get(name, before.quantity), unreferenced_since=since)
        changes.append(LineChange(line.id, line.child_id, before, after, line.position))
    return changes


def _note(prepared: _Prepared, order: MergeOrder) -> ChangeNote:
    return ChangeNote(
        kind=ChangeKind.MERGE,
        summary=summary(prepared.plan.diff),
        document_file=order.document_file,
        document_sha256=order.document_sha256,
        document_revision=order.document_revision,
        sync_id=order.sync_id,
    )


def _remember_conflicts(tx: Tx, prepared: _Prepared) -> None:
    ours = bom_conflicts.c.parent_id == prepared.parent.id
    before = {row.child_id: row for row in tx.conn.execute(select(bom_conflicts).where(ours))}
    tx.conn.execute(delete(bom_conflicts).where(ours))
    rows = []
    for conflict in prepared.conflicts:
        child_id = prepared.child_ids[conflict.part_number]
        known = before.get(child_id)
        same = known is not None and known.cad_quantity == float(conflict.local_quantity)
        rows.append(
            {
                "parent_id": prepared.parent.id,
                "child_id": child_id,
                "cad_quantity": float(conflict.local_quantity),
                "since": known.since if known is not None and same else tx.stamp,
                "accepted": prepared.accepted.get(child_id) == conflict.local_quantity,
            }
        )
    insert_rows(tx, bom_conflicts, rows)


def _replay(tx: Tx, parent: Item, order: MergeOrder) -> MergeOutcome | None:
    if not order.sync_id:
        return None
    row = tx.conn.execute(
        select(
            bom_syncs.c.answer, bom_syncs.c.version, bom_syncs.c.request_hash, bom_syncs.c.change_id
        ).where(bom_syncs.c.parent_id == parent.id, bom_syncs.c.sync_id == order.sync_id)
    ).one_or_none()
    if row is None:
        return None
    if row.request_hash != _request_hash(order):
        raise ConflictError(
            f"sync_id {order.sync_id!r} was used before for another BOM of {parent.part_number}; "
            "send a new one with new content"
        )
    answer = row.answer if row.change_id is None else _rebuilt(tx, parent, row.answer, row.change_id)
    return MergeOutcome(answer, row.version)


def _reference(
    prepared: _Prepared, changes: Sequence[LineChange], answer: Mapping[str, Any], change_id: int
) -> tuple[str, int] | None:
    """The answer without its unchanged lines, which the history has: (JSON, change); None where it has not.

    Most of an answer says what is as it was; stored in full, a vault's nightly syncs would be gigabytes.
    """
    unchanged = answer["diff"]["unchanged"]
    places = {pair["part_number"]: place for place, pair in enumerate(unchanged)}
    lines = [line for line in prepared.lines if line.state.rel_type == "component"]
    same = [line for line in lines if line.child_part_number in places]
    order = sorted(range(len(same)), key=lambda n: places[same[n].child_part_number])
    if [_pair(same[n].child_part_number, same[n].state) for n in order] != unchanged:
        return None
    others = {line.id for line in lines} | {change.line_id for change in changes}
    kept = {**answer, "diff": {**answer["diff"], "unchanged": []}}
    stored: dict[str, Any] = {"answer": kept, "others": sorted(others - {line.id for line in same})}
    if order != sorted(order):
        stored["order"] = order
    return dumps(stored), change_id


def _rebuilt(tx: Tx, parent: Item, stored: str, change_id: int) -> str:
    kept = json.loads(stored)
    others = set(kept["others"])
    same = [
        _pair(line.child.part_number, line.state)
        for line in state_at(tx, parent, change_id)
        if line.state.rel_type == "component" and line.line_id not in others
    ]
    kept["answer"]["diff"]["unchanged"] = [same[n] for n in kept.get("order", range(len(same)))]
    return dumps(kept["answer"])


def _pair(part_number: str, state: LineState) -> dict[str, Any]:
    return {"part_number": part_number, "quantity": plain(state.quantity)}


def _remember_sync(
    tx: Tx,
    parent: Item,
    order: MergeOrder,
    answer: str,
    version: int,
    reference: tuple[str, int] | None,
) -> None:
    shorter = reference is not None and len(reference[0]) < len(answer)
    tx.conn.execute(
        insert(bom_syncs).values(
            parent_id=parent.id,
            sync_id=order.sync_id,
            request_hash=_request_hash(order),
            answer=reference[0] if reference and shorter else answer,
            version=version,
            at=tx.stamp,
            change_id=reference[1] if reference and shorter else None,
        )
    )


def _request_hash(order: MergeOrder) -> str:
    content = sorted((entry.key, float(entry.quantity)) for entry in order.entries)
    return hashlib.sha256(dumps(content).encode()).hexdigest()
