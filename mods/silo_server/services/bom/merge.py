# SPDX-License-Identifier: LGPL-2.1-or-later
"""The merge of an assembly into its BOM (spec bom-sync §5): check, plan, apply, announce; one transaction.

The rules are those of :mod:`silo.bom.compare.merge`; here is what a server adds: who may change which row is
enforced on the stored rows, a ``sync_id`` gives the same answer again, a version mismatch is refused, and a
reviewer's decision on a conflict stays until the assembly says another quantity.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from typing import Any

from sqlalchemy import delete, select

from silo.bom.compare.answer import answer_of, summary
from silo.bom.compare.bom_diff import BomDiff, QuantityChange
from silo.bom.compare.merge import MergePlan, plan_merge
from silo.bom.compare.owner import is_manual
from silo.bom.errors import RejectedError
from silo.bom.message import message
from silo.bom.quantities import plain, quantity_of
from silo_server.db.answers import KeptAnswer, KeyedRequest, earlier_answer, keep_answer
from silo_server.db.rows import insert_rows, one_of
from silo_server.db.tables import bom_conflicts, items
from silo_server.db.transaction import Tx
from silo_server.events import announce
from silo_server.fields import names_of
from silo_server.services.bom.change import (
    ChangeNote,
    apply_changes,
    check_version,
    locked_parent,
    new_line_id,
)
from silo_server.services.bom.cycles import check_no_cycle
from silo_server.services.bom.last_sync import LastSync, last_sync, record_merge
from silo_server.services.bom.line_record import ChangeKind, LineRecord
from silo_server.services.bom.lines import lines_of
from silo_server.services.bom.merge_repeat import rebuilt, without_unchanged
from silo_server.services.bom.merge_request import MergeRequestIn
from silo_server.services.items import get_item
from silo_server.services.releases import draft_of
from silo_server.services.revisions import check_document
from silo_server.times import spec_time
from silo_server.user_json import dumps
from silo_server.values import Item, Line, LineState

# An event goes to every listener: beyond this many unchanged lines it only says how many there are.
EVENT_UNCHANGED_LINES = 500


def event_of(tx: Tx, parent: Item, diff: BomDiff, answer: Mapping[str, Any]) -> dict[str, Any]:
    """Make the spec's event; it has ``warnings`` only if there is a conflict, which the diff lacks."""
    diff_json = dict(answer["diff"])
    if len(diff_json["unchanged"]) > EVENT_UNCHANGED_LINES:
        diff_json["unchanged_count"] = len(diff_json["unchanged"])
        diff_json["unchanged"] = []
    event: dict[str, Any] = {
        "type": "bom_merge",
        "item": parent.part_number,
        "user": tx.actor.username,
        "timestamp": spec_time(tx.stamp),
        "summary": summary(diff),
        "diff": diff_json,
        "resolve_url": answer["resolve_url"],
    }
    if "sync_id" in answer:
        event["sync_id"] = answer["sync_id"]
    if "left_out" in answer:
        event["left_out"] = answer["left_out"][:EVENT_UNCHANGED_LINES]
    if diff.conflicts:
        event["warnings"] = answer["warnings"]
    return event


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
    proposed: Mapping[str, str]  # part number → the find number that CAD proposes


def preview_merge(tx: Tx, part_number: str, request: MergeRequestIn, expected: int | None) -> MergeOutcome:
    """Return the answer that :func:`merge_bom` would give, without changing anything."""
    parent = get_item(tx, part_number)
    check_version(parent, expected)
    prepared = _prepare(tx, parent, request)
    answer = answer_of(prepared.plan.diff, parent.part_number, request.sync_id, request.left_out)
    return MergeOutcome(dumps(answer), parent.bom_version)


def merge_bom(tx: Tx, part_number: str, request: MergeRequestIn, expected: int | None) -> MergeOutcome:
    """Merge the assembly's direct children into the BOM.

    Raises NotFoundError (parent), RejectedError (all bad entries at once), CycleError, VersionConflictError,
    ConflictError (the ``sync_id`` was used for something else), NewerRevisionError (the document is not the
    item's newest file), MissingRevisionError (its file is not here).
    """
    parent = locked_parent(tx, part_number)
    proposed = [(entry.key, entry.find_number) for entry in request.entries if entry.find_number]
    entries = [(entry.key, float(entry.quantity), entry.components) for entry in request.entries]
    document = (getattr(request, name) for name in names_of(MergeRequestIn) if name.startswith("document"))
    keyed = KeyedRequest.of(
        f"merge {parent.id}", request.sync_id, entries, request.left_out, *document, *proposed
    )
    if earlier := earlier_answer(tx, keyed):
        whole = earlier.text if earlier.change_id is None else rebuilt(tx, parent, earlier)
        return MergeOutcome(whole, earlier.version)
    check_version(parent, expected)
    prepared = _prepare(tx, parent, request)
    changes = _line_changes(tx, prepared)
    change_id, version = apply_changes(
        tx,
        parent,
        changes,
        ChangeNote(
            kind=ChangeKind.MERGE,
            summary=summary(prepared.plan.diff),
            document_file=request.document_file,
            document_sha256=request.document_sha256,
            document_revision=request.document_revision,
            sync_id=request.sync_id,
        ),
    )
    _remember_conflicts(tx, prepared)
    kept = [change.part_number for change in prepared.plan.diff.kept]
    record_merge(tx, parent, request, prepared.child_ids, prepared.before, kept)
    answer = answer_of(prepared.plan.diff, parent.part_number, request.sync_id, request.left_out)
    if (draft := draft_of(tx, parent)) is not None:
        answer["draft"] = draft
    text = dumps(answer)
    if keyed is not None:
        shorter = without_unchanged(prepared.lines, changes, answer)
        kept_change = change_id if shorter and len(shorter) < len(text) else None
        keep_answer(tx, keyed, KeptAnswer(shorter if shorter and kept_change else text, version, kept_change))
    announce.bom_merged(tx, parent, event_of(tx, parent, prepared.plan.diff, answer))
    return MergeOutcome(text, version)


def _prepare(tx: Tx, parent: Item, request: MergeRequestIn) -> _Prepared:
    check_document(tx, parent, request.document_revision, request.document_sha256)
    lines = lines_of(tx, parent)
    child_ids, names = _children(tx, request, lines)
    entries: list[dict[str, Any]] = [
        {"child_part_number": names[entry.key], "quantity": entry.quantity} for entry in request.entries
    ]
    before = last_sync(tx, parent)
    lines_before = [
        {**_as_mapping(line), "components": before.components.get(line.child_id, ())} for line in lines
    ]
    plan = plan_merge(entries, lines_before, request.missing)
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
    open_ones = tuple(c for c in conflicts if accepted.get(child_ids[c.part_number]) != _cad_quantity(c))
    plan = replace(plan, diff=replace(plan.diff, conflicts=open_ones))
    proposed = {names[entry.key]: entry.find_number for entry in request.entries[::-1] if entry.find_number}
    return _Prepared(parent, lines, child_ids, plan, accepted, conflicts, before, proposed)


def _children(
    tx: Tx, request: MergeRequestIn, lines: Sequence[Line]
) -> tuple[dict[str, int], dict[str, str]]:
    """Find (part number → item id, key → part number) of each child; RejectedError lists all bad entries."""
    child_ids = {line.child_part_number: line.child_id for line in lines}
    names = {line.child_part_number.casefold(): line.child_part_number for line in lines}
    asked = {entry.key for entry in request.entries if entry.key not in names}
    archived: set[str] = set()
    query = select(items.c.id, items.c.part_number, items.c.part_number_key, items.c.archived_at)
    for row in tx.conn.execute(query.where(one_of(tx, items.c.part_number_key, asked))):
        if row.archived_at:
            archived.add(row.part_number_key)
            continue
        child_ids[row.part_number] = row.id
        names[row.part_number_key] = row.part_number
    problems = list(request.problems)
    for entry in request.entries:
        if entry.key not in names:
            name = message(
                "entries[{index}].child_part_number: {part_number}",
                index=entry.index,
                part_number=repr(entry.part_number),
            )
            gone = entry.key in archived
            problem = (
                message("{entry} is archived", entry=name)
                if gone
                else message("{entry} does not exist on this server", entry=name)
            )
            problems.append((entry.index, problem))
    if problems:
        texts = [text for _, text in sorted(problems, key=lambda problem: problem[0])]
        raise RejectedError(
            message(
                "{n} of the entries cannot be merged, so nothing was changed: {problem}{more}",
                n=len(texts),
                problem=texts[0],
                more=message(" (and {n} more)", n=len(texts) - 1) if len(texts) > 1 else "",
            ),
            texts,
        )
    return child_ids, names


def _as_mapping(line: Line) -> dict[str, Any]:
    state = line.state
    return {
        "child_part_number": line.child_part_number,
        "quantity": state.quantity,
        "source": state.source,
        "unit": state.unit,
        "child_unit": line.child_unit,
        "rel_type": state.rel_type,
        "unreferenced_since": state.unreferenced_since,
    }


def _overrides_gone(lines: Sequence[Line], numbers: set[str]) -> list[QuantityChange]:
    # A user changed a quantity of a CAD line; now the assembly no longer has it. The line is theirs, so it
    # stays, but silence would leave a part in the BOM that is not needed.
    return [
        QuantityChange(line.child_part_number, 0.0, plain(line.state.quantity), line.unit or "")
        for line in lines
        if line.state.override and line.child_part_number not in numbers
    ]


def _line_changes(tx: Tx, prepared: _Prepared) -> list[LineRecord]:
    plan = prepared.plan
    changes = [
        LineRecord(
            new_line_id(),
            prepared.child_ids[added.part_number],
            None,
            LineState(
                quantity_of(added.quantity or 0),
                "assembly",
                find_number=prepared.proposed.get(added.part_number),
            ),
        )
        for added in plan.diff.added
    ]
    quantities = {c.part_number: quantity_of(c.local_quantity) for c in plan.diff.quantity_changed}
    flag, unflag = set(plan.flag), set(plan.unflag)
    touched = flag | unflag | quantities.keys()
    for line in prepared.lines:
        name, before = line.child_part_number, line.state
        # Ownership is enforced here, on the stored row, whatever the plan says.
        if name not in touched or is_manual(_as_mapping(line)):
            continue
        since = tx.stamp if name in flag else None if name in unflag else before.unreferenced_since
        after = replace(before, quantity=quantities.get(name, before.quantity), unreferenced_since=since)
        changes.append(LineRecord(line.id, line.child_id, before, after, line.position))
    return changes


def _cad_quantity(conflict: QuantityChange) -> Decimal:
    return quantity_of(conflict.local_quantity)


def _remember_conflicts(tx: Tx, prepared: _Prepared) -> None:
    ours = bom_conflicts.c.parent_id == prepared.parent.id
    before = {row.child_id: row for row in tx.conn.execute(select(bom_conflicts).where(ours))}
    tx.conn.execute(delete(bom_conflicts).where(ours))
    rows = []
    for conflict in prepared.conflicts:
        child_id = prepared.child_ids[conflict.part_number]
        row_before = before.get(child_id)
        of_cad = _cad_quantity(conflict)
        same = row_before is not None and row_before.cad_quantity == of_cad
        rows.append(
            {
                "parent_id": prepared.parent.id,
                "child_id": child_id,
                "cad_quantity": of_cad,
                "since": row_before.since if row_before is not None and same else tx.stamp,
                "accepted": prepared.accepted.get(child_id) == of_cad,
            }
        )
    insert_rows(tx, bom_conflicts, rows)
