# SPDX-License-Identifier: LGPL-2.1-or-later
"""BOM import from CSV: first what would happen, row by row; then, when nothing is wrong, all of it at once.

Rows add manual lines or change lines that are there (by the rules of a person's edit); lines that the file
does not name stay as they are. Our own single-level export, imported again, changes nothing.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

from sqlalchemy import select

from silo.bom.errors import RejectedError
from silo.bom.headers import Role, find_roles, missing_columns
from silo.bom.numbers import common_mark, parse_number, read_quantity
from silo_server.db.bulk import one_of
from silo_server.db.engine import Tx
from silo_server.db.tables import items
from silo_server.errors import TooLargeError
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
from silo_server.services.bom.edits import check_state, edited_state
from silo_server.services.bom.exports import plain_cell
from silo_server.services.bom.lines import lines_of
from silo_server.services.items import get_item
from silo_server.values import Line, LineState

ROLES = (
    *(Role.PART_NUMBER, Role.QUANTITY, Role.UNIT, Role.REFERENCE_DESIGNATORS, Role.FIND_NUMBER, Role.NOTES),
    *(Role.TYPE, Role.REVISION, Role.LEVEL),
)
INCOMPLETE = "Incomplete"  # of silo_server.services.bom.exports
NEEDED = (Role.PART_NUMBER, Role.QUANTITY)
HEADER_WITHIN = 40
"""The header must be among this many first lines (title blocks are a few lines long)."""


MAX_COLUMNS = 200

# (row number, field → text)
Record = tuple[int, dict[str, str]]


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
    """Say what an import of the rows of :func:`read_csv` would do, row by row; changes nothing."""
    parent = get_item(tx, part_number)
    lines = {(line.child_part_number.casefold(), line.state.rel_type): line for line in lines_of(tx, parent)}
    keys = {record.get("part_number", "").casefold() for _, record in records}
    query = select(items.c.id, items.c.part_number_key, items.c.archived_at)
    known = {
        row.part_number_key: (row.id, row.archived_at is not None)
        for row in tx.conn.execute(query.where(one_of(tx, items.c.part_number_key, keys)))
    }
    rows: list[ImportRow] = []
    seen: set[tuple[str, str]] = set()
    for number, record in records:
        row = _plan_row(number, record, lines, known)
        key = (row.part_number.casefold(), row.after.rel_type if row.after else "")
        if row.status not in ("error", "skip") and key in seen:
            row = ImportRow(number, row.part_number, "error", (f"{row.part_number} stands here twice",))
        seen.add(key)
        rows.append(row)
    return ImportPlan(rows)


def apply_import(
    tx: Tx, part_number: str, records: Sequence[Record], file_name: str | None, expected: int | None
) -> tuple[ImportPlan, int, int]:
    """Import the rows of :func:`read_csv` as one change. Returns (what was done, change, version).

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


def read_csv(data: bytes, max_rows: int) -> list[Record]:
    """The rows that say anything; RejectedError where this is no BOM, TooLargeError beyond ``max_rows``.

    Needs no database: to be called before a transaction begins, which others would wait for.
    """
    table, start, delimiter = _table(_decode(data), max_rows)
    at = find_roles(table[start], ROLES)
    gap_column = next((i for i, cell in enumerate(table[start]) if cell.strip() == INCOMPLETE), None)
    records = []
    for number, cells in enumerate(table[start + 1 :], start=start + 2):
        record = {role.value: plain_cell(cells[i].strip()) for role, i in at.items() if i < len(cells)}
        # Our own exports end with what a sync left out: rows that say so, and have no part number.
        told = cells[gap_column].strip() if gap_column is not None and gap_column < len(cells) else ""
        if any(record.values()) and (record.get("part_number") or not told):
            records.append((number, record))
    return _with_exact_quantities(records, points_are_decimal=delimiter == ",")


def _with_exact_quantities(records: list[Record], *, points_are_decimal: bool) -> list[Record]:
    """Quantities as plain numerals where they can be read; what is wrong with one stands beside it.

    The whole column decides what "1,234" means; in a file separated by commas, a point is a decimal point.
    """
    texts = [record.get("quantity", "") for _, record in records]
    mark = common_mark(number.mark for text in texts if (number := parse_number(text)))
    for (_, record), text in zip(records, texts, strict=True):
        reading = read_quantity(text, mark, points_are_decimal=points_are_decimal)
        record["quantity"] = "" if reading.value is None else str(reading.value)
        if reading.problem:
            record["quantity_problem"] = reading.problem
    return records


def _table(text: str, max_rows: int) -> tuple[list[list[str]], int, str]:
    """(cells, index of the header row, delimiter), by the delimiter with which there is a header."""
    broken: csv.Error | None = None
    near = ""
    for delimiter in (",", ";", "\t"):
        rows = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
        try:
            table: list[list[str]] = []
            for index, row in enumerate(islice(rows, HEADER_WITHIN)):
                table.append(row)
                at = find_roles(row[:MAX_COLUMNS], ROLES)
                missing = missing_columns(row[:MAX_COLUMNS], at, NEEDED)
                # A line with one of the two, and another cell beside it, is a header that lacks the other.
                if missing and len(row) > 1 and set(NEEDED) & at.keys():
                    near = near or f"file: in line {index + 1}, {missing}"
                if not missing:
                    table.extend(islice(rows, max_rows + 1))
                    if len(table) - index - 1 > max_rows:
                        raise TooLargeError(f"file: this server takes at most {max_rows} rows, got more")
                    return table, index, delimiter
        except csv.Error as error:
            broken = error
    if near:
        raise RejectedError(near)
    if broken is not None:
        raise RejectedError(f"file: wanted CSV, got something that does not read as such ({broken})")
    raise RejectedError(
        f"file: wanted a header row with 'Part number' and 'Quantity' among the first {HEADER_WITHIN} rows, "
        "found none"
    )


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


def _decode(data: bytes) -> str:
    for mark, encoding in ((b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"), (b"", "utf-8-sig")):
        if data.startswith(mark):
            try:
                return data.decode(encoding)
            except UnicodeDecodeError:
                break
    # What spreadsheets in western Europe and America write when they are not asked for Unicode.
    return data.decode("cp1252", errors="replace")
