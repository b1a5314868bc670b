# SPDX-License-Identifier: LGPL-2.1-or-later
"""BOM import from CSV: first what would happen, row by row; then, when nothing is wrong, all of it at once.

Rows add manual lines or change lines that are there (by the rules of a person's edit); lines that the file
does not name stay as they are. Our own single-level export, imported again, changes nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import select

from silo.bom.errors import RejectedError
from silo_server.db.bulk import one_of
from silo_server.db.engine import Tx
from silo_server.db.tables import items
from silo_server.services import events
from silo_server.services.bom.changes import (
    ChangeKind,
    ChangeNote,
    LineChange,
    apply_changes,
    check_no_cycle,
    check_version,
    find_rings,
    new_line_id,
)
from silo_server.services.bom.csv_file import Record
from silo_server.services.bom.edits import check_state, edited_state
from silo_server.services.bom.lines import lines_of
from silo_server.services.items import get_item
from silo_server.values import Item, Line, LineState


@dataclass(frozen=True, slots=True)
class ImportRow:
    """What becomes of one row of the file. ``status``: add change same skip error."""

    row: int
    part_number: str
    status: str
    problems: Sequence[str] = ()
    before: LineState | None = None
    after: LineState | None = None
    child_id: int | None = None
    line: Line | None = None


@dataclass(frozen=True, slots=True)
class ImportPlan:
    """What an import would do; ``problems`` are those of all rows."""

    rows: Sequence[ImportRow]

    @property
    def problems(self) -> list[str]:
        return [f"row {row.row}: {problem}" for row in self.rows for problem in row.problems]

    def count(self, status: str) -> int:
        """How many rows have this status."""
        return sum(row.status == status for row in self.rows)


def plan_import(tx: Tx, part_number: str, records: Sequence[Record]) -> ImportPlan:
    """Say what an import of the rows of ``csv_file.read_csv`` would do, row by row; changes nothing."""
    parent = get_item(tx, part_number)
    lines = {(line.child_part_number.casefold(), line.state.rel_type): line for line in lines_of(tx, parent)}
    keys = {record.get("part_number", "").casefold() for _, record in records}
    query = select(items.c.id, items.c.part_number_key, items.c.archived_at)
    known = {
        row.part_number_key: (row.id, row.archived_at is not None)
        for row in tx.conn.execute(query.where(one_of(tx, items.c.part_number_key, keys)))
    }
    new = {known[key][0] for key in keys if key in known}
    rings = find_rings(tx, parent, new - {line.child_id for line in lines.values()})
    rows: list[ImportRow] = []
    seen: set[tuple[str, str]] = set()
    for number, record in records:
        row = _plan_row(number, record, lines, known)
        key = (row.part_number.casefold(), row.after.rel_type if row.after else "")
        if row.status not in ("error", "skip") and key in seen:
            row = ImportRow(number, row.part_number, "error", (f"{row.part_number} stands here twice",))
        seen.add(key)
        if row.status == "add" and row.child_id in rings:
            row = ImportRow(number, row.part_number, "error", (_in_a_ring(parent, rings[row.child_id]),))
        rows.append(row)
    return ImportPlan(rows)


def apply_import(
    tx: Tx, part_number: str, records: Sequence[Record], file_name: str | None, expected: int | None
) -> tuple[ImportPlan, int, int]:
    """Import the rows of ``csv_file.read_csv`` as one change. Returns (what was done, change, version).

    RejectedError lists every problem, and then nothing was changed.
    """
    parent = get_item(tx, part_number, lock=True)
    check_version(parent, expected)
    plan = plan_import(tx, part_number, records)
    if plan.problems:
        raise RejectedError(
            f"{len(plan.problems)} problems in the file, so nothing was imported: {plan.problems[0]}",
            plan.problems,
        )
    changes = []
    for row in plan.rows:
        if row.status == "add" and row.child_id is not None:
            changes.append(LineChange(new_line_id(), row.child_id, None, row.after))
        elif row.status == "change" and row.line is not None:
            changes.append(
                LineChange(row.line.id, row.line.child_id, row.before, row.after, row.line.position)
            )
    check_no_cycle(tx, parent, [c.child_id for c in changes if c.before is None])
    text = f"imported: {plan.count('add')} added, {plan.count('change')} changed"
    note = ChangeNote(kind=ChangeKind.IMPORT, summary=text, document_file=file_name)
    change_id, version = apply_changes(tx, parent, changes, note)
    events.bom_updated(tx, parent, ChangeKind.IMPORT, text)
    return plan, change_id, version


def _in_a_ring(parent: Item, ring: Sequence[str]) -> str:
    if len(ring) <= 2:
        return f"Part number: {parent.part_number} is the assembly itself, which cannot be a part of itself"
    return f"Part number: {ring[1]} contains {parent.part_number} itself ({' → '.join(ring)})"


def _plan_row(
    number: int,
    record: Mapping[str, str],
    lines: Mapping[tuple[str, str], Line],
    known: Mapping[str, tuple[int, bool]],
) -> ImportRow:
    name = record.get("part_number", "")
    if record.get("level", "1") not in ("", "1"):
        return ImportRow(number, name, "skip")
    problems: list[str] = []
    changes = _changes(record, problems)
    key = name.casefold()
    line = lines.get((key, changes.get("rel_type", "component")))
    child = known.get(key)
    if not name:
        problems.append("Part number: is empty")
    elif child is None:
        problems.append(f"Part number: {name!r} does not exist on this server")
    elif child[1] and line is None:
        problems.append(f"Part number: {name!r} is archived")
    before = line.state if line else None
    after = None
    if not problems:
        after = edited_state(before, changes) if before else LineState(**{"source": "manual", **changes})
        try:
            check_state(after)
        except RejectedError as error:
            problems.extend(error.problems)
    if problems or child is None:
        return ImportRow(number, name, "error", problems)
    status = "add" if before is None else "same" if after == before else "change"
    return ImportRow(number, name, status, (), before, after, child[0], line)


def _changes(record: Mapping[str, str], problems: list[str]) -> dict[str, Any]:
    changes: dict[str, Any] = {}
    if "quantity_problem" in record:
        problems.append(f"Quantity: {record['quantity_problem']}")
    else:
        changes["quantity"] = float(record["quantity"])
    for name in ("unit", "find_number", "notes"):
        if name in record:
            changes[name] = record[name] or None
    if record.get("rel_type"):
        changes["rel_type"] = record["rel_type"].lower()
    if "reference_designators" in record:
        changes["reference_designators"] = tuple(record["reference_designators"].replace(",", " ").split())
    if "child_revision" in record:
        revision = record["child_revision"]
        known = revision.isascii() and revision.isdigit() and len(revision) < 7
        if revision and not known:
            problems.append(f"Revision: wanted a whole number, got {revision[:40]!r}")
        changes["child_revision"] = int(revision) if known else None
    return changes
