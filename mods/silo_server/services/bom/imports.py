# SPDX-License-Identifier: LGPL-2.1-or-later
"""The import of a table into a BOM: first what would happen, row by row; then, if nothing is wrong, all.

Rows add manual lines or change lines that are there (by the rules of a user's edit); lines that the file
does not name stay as they are. Our own single-level export, imported again, changes nothing. A row without a
part number, as KiCad writes them, means the part of its manufacturer's number, else of its name: the value
and the footprint. Unknown parts are made on the way, and rows of one part added up, if the user allows that.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Any

from sqlalchemy import select

from silo.api.wire import LineTexts
from silo.bom.errors import RejectedError, listed
from silo.bom.headers import (
    designators,
)
from silo.bom.numbers import whole_number
from silo.bom.quantities import exact_sum
from silo_server.db.rows import one_of
from silo_server.db.tables import items
from silo_server.db.transaction import Tx
from silo_server.schema import find_schema
from silo_server.services.bom.change import (
    ChangeKind,
    ChangeNote,
    LineRecord,
    apply_changes,
    new_line_id,
    parent_to_change,
)
from silo_server.services.bom.cycles import check_no_cycle, find_rings
from silo_server.services.bom.import_table import BOUGHT, Record
from silo_server.services.bom.line_edit import check_state, edited_state
from silo_server.services.bom.lines import lines_of
from silo_server.services.items import (
    ItemQuery,
    NewItem,
    check_number,
    create_item,
    get_item,
    list_items,
)
from silo_server.values import Item, Line, LineState

"""The header must be among this many first lines (title blocks are a few lines long)."""


@dataclass(frozen=True, slots=True)
class Allowed:
    """What a person allows an import beside changing lines.

    category
        in which unknown parts are made; "": none is made.
    add_up
        rows of one part are added up.
    """

    category: str = ""
    add_up: bool = False


NOTHING = Allowed()


@dataclass(frozen=True, slots=True)
class ImportRow:
    """What becomes of one row of the file. ``status``: add change same skip error.

    name
        what the file calls a part that has no number there.
    new
        the part that is made for it.
    could
        what a person may allow instead of a problem: ``make`` the part, ``add_up``.
    """

    row: int
    part_number: str
    status: str
    problems: Sequence[str] = ()
    before: LineState | None = None
    after: LineState | None = None
    child_id: int | None = None
    line: Line | None = None
    name: str = ""
    new: NewItem | None = None
    could: str = ""


@dataclass(frozen=True, slots=True)
class ImportPlan:
    """What an import would do; ``problems`` are those of all rows."""

    rows: Sequence[ImportRow]

    @property
    def problems(self) -> list[str]:
        return [f"row {row.row}: {problem}" for row in self.rows for problem in row.problems]

    @property
    def new(self) -> list[NewItem]:
        """Return the parts that the import makes, each once."""
        return [row.new for row in self.rows if row.new]

    def count(self, status: str) -> int:
        """Count the rows with this status."""
        return sum(row.status == status for row in self.rows)

    def could(self, what: str) -> int:
        """Count the rows whose problem a person may allow: ``make`` the part, or ``add_up``."""
        return sum(row.could == what for row in self.rows)


def plan_import(
    tx: Tx, part_number: str, records: Sequence[Record], allowed: Allowed = NOTHING
) -> ImportPlan:
    """Plan an import of the rows of :func:`read_csv`, row by row; change nothing."""
    parent = get_item(tx, part_number)
    if allowed.category:
        find_schema(None).category(allowed.category)
    records = list(_identified(tx, records))
    added: dict[int, int] = {}
    if allowed.add_up:
        records, added = _added_up(records)
    lines = {(line.child_part_number.casefold(), line.state.rel_type): line for line in lines_of(tx, parent)}
    keys = {record.get("part_number", "").casefold() for _, record in records}
    query = select(items.c.id, items.c.part_number_key, items.c.archived_at)
    ids = {
        row.part_number_key: (row.id, row.archived_at is not None)
        for row in tx.conn.execute(query.where(one_of(tx, items.c.part_number_key, keys)))
    }
    new = {ids[key][0] for key in keys if key in ids}
    rings = find_rings(tx, parent, new - {line.child_id for line in lines.values()})
    rows: list[ImportRow] = []
    seen: set[tuple[str, str]] = set()
    for number, record in records:
        if number in added:
            number_of, name = record.get("part_number", ""), f"added to row {added[number]}"
            rows.append(ImportRow(number, number_of, "skip", name=name))
            continue
        row = _plan_row(number, record, lines, ids, allowed.category)
        key = (_key(record), row.after.rel_type if row.after else "")
        if row.status not in ("error", "skip") and key in seen:
            problem = f"{row.part_number or row.name} stands here twice"
            row = ImportRow(number, row.part_number, "error", (problem,), name=row.name, could="add_up")
        seen.add(key)
        if row.status == "add" and row.child_id in rings:
            row = ImportRow(number, row.part_number, "error", (_in_a_ring(parent, rings[row.child_id]),))
        rows.append(row)
    return ImportPlan(rows)


def _key(record: Mapping[str, str]) -> str:
    """Return what all rows of one part have in common."""
    return (record.get("part_number") or f"\n{record.get('unknown')}").casefold()


def _name_of(record: Mapping[str, str]) -> str:
    """Find the name of a row's part: name, value with footprint (no KiCad library), or description."""
    value = " ".join(filter(None, (record.get("value"), record.get("footprint", "").rpartition(":")[2])))
    return record.get("name") or (value if record.get("value") else record.get("description", ""))


def _identified(tx: Tx, records: Iterable[Record]) -> Iterator[Record]:
    """Yield the rows with the number of the part that each one means.

    ``unknown`` names a part that is not here, ``several`` says that a name has several parts.
    """
    nameless = [record for _, record in records if not record.get("part_number")]
    row, by_name, by_maker = items.c, dict[str, list[str]](), dict[str, list[str]]()
    query = select(row.name, row.part_number).where(row.archived_at.is_(None)).order_by(row.part_number_key)
    for name, number in tx.conn.execute(query.where(one_of(tx, row.name, {*map(_name_of, nameless)} - {""}))):
        by_name.setdefault(name, []).append(number)
    for maker in {record.get("manufacturer_part_number", "") for record in nameless} - {""}:
        same_items, _ = list_items(tx, ItemQuery(search=maker, limit=100))
        numbers = ((item.part_number, item.properties.get("manufacturer_part_number")) for item in same_items)
        by_maker[maker] = [
            part_number for part_number, own in numbers if str(own).casefold() == maker.casefold()
        ]
    for number, record in records:
        maker, name = record.get("manufacturer_part_number", ""), _name_of(record)
        record_fields = dict(record)
        if not record.get("part_number") and (maker or name):
            same = by_maker[maker] if maker else by_name.get(name, [])
            if len(same) == 1:
                record_fields["part_number"] = same[0]
            elif same:
                record_fields["several"] = (
                    f"{maker or name}: {listed(same, 5)} are called so; give the part number"
                )
            else:
                record_fields["unknown"] = maker or name
        yield number, record_fields


# Rows that differ in one of these are not added up.
_BESIDE = ("rel_type", "level", "unit", "child_revision", "not_fitted")


def _added_up(records: Sequence[Record]) -> tuple[list[Record], dict[int, int]]:
    """Add the quantities of all rows of a part to its first row.

    Returns all rows, and for the number of each other row the number of the first.
    """
    first: dict[tuple[str, ...], tuple[int, dict[str, str]]] = {}
    made: list[Record] = []
    added: dict[int, int] = {}
    for number, record in records:
        is_part = bool(record.get("part_number") or "unknown" in record)
        if "quantity_problem" in record or not is_part:
            made.append((number, record))
            continue
        key = (_key(record), *(record.get(name, "") for name in _BESIDE))
        whole = first.get(key)
        if whole is None:
            first[key] = number, dict(record)
            made.append(first[key])
            continue
        added[number] = whole[0]
        made.append((number, record))
        into = whole[1]
        into["quantity"] = str(exact_sum(map(Decimal, (into["quantity"], record["quantity"]))))
        for name, between in (("reference_designators", " "), ("notes", "; ")):
            texts = dict.fromkeys(filter(None, (into.get(name), record.get(name))))
            if texts:
                into[name] = between.join(texts)
    return made, added


def apply_import(
    tx: Tx,
    part_number: str,
    records: Sequence[Record],
    file_name: str | None,
    expected: int | None,
    allowed: Allowed = NOTHING,
) -> tuple[ImportPlan, int, int]:
    """Import the rows of :func:`read_csv` as one change. Returns (what was done, change, version).

    RejectedError lists every problem, and then nothing was changed.
    """
    parent = parent_to_change(tx, part_number, expected)
    plan = plan_import(tx, part_number, records, allowed)
    if plan.problems:
        raise RejectedError(
            f"{len(plan.problems)} problems in the file, so nothing was imported: {plan.problems[0]}",
            plan.problems,
        )
    changes = []
    for row in plan.rows:
        child_id = create_item(tx, row.new)[0].id if row.new else row.child_id
        if row.status == "add" and child_id is not None:
            changes.append(LineRecord(new_line_id(), child_id, None, row.after))
        elif row.status == "change" and row.line is not None:
            changes.append(
                LineRecord(row.line.id, row.line.child_id, row.before, row.after, row.line.position)
            )
    check_no_cycle(tx, parent, [c.child_id for c in changes if c.before is None])
    text = f"imported: {plan.count('add')} added, {plan.count('change')} changed"
    note = ChangeNote(kind=ChangeKind.IMPORT, summary=text, document_file=file_name)
    change_id, version = apply_changes(tx, parent, changes, note)
    return plan, change_id, version


def _in_a_ring(parent: Item, ring: Sequence[str]) -> str:
    if len(ring) <= 2:
        return f"Part number: {parent.part_number} is the assembly itself, which cannot be a part of itself"
    return f"Part number: {ring[1]} contains {parent.part_number} itself ({' → '.join(ring)})"


def _plan_row(
    number: int,
    record: Mapping[str, str],
    lines: Mapping[tuple[str, str], Line],
    numbers: Mapping[str, tuple[int, bool]],
    category: str,
) -> ImportRow:
    name, called = record.get("part_number", ""), record.get("unknown", "")
    if record.get("level", "1") not in ("", "1") or record.get("not_fitted"):
        return ImportRow(number, name, "skip", name=called)
    problems: list[str] = []
    changes = _changes(record, problems)
    key = name.casefold()
    line = lines.get((key, changes.get("rel_type", "component")))
    child = numbers.get(key) if name else None
    new, could = None, ""
    if "several" in record:
        problems.append(f"Part number: {record['several']}")
    elif not (name or called):
        problems.append("Part number: is empty")
    elif child is None and category:
        new = _new_item(record, category, problems)
    elif child is None:
        problems.append(f"Part number: {name or called!r} does not exist on this server")
        could = "make"
    elif child[1] and line is None:
        problems.append(f"Part number: {name!r} is archived")
    before = line.state if line else None
    after = None
    if not problems:
        if before:
            changes = {
                field: value for field, value in changes.items() if not _as_written(before, field, value)
            }
            after = edited_state(before, changes)
        else:
            after = LineState(**{"source": "manual", **changes})
        try:
            check_state(after)
        except RejectedError as error:
            problems.extend(error.problems)
    if problems:
        return ImportRow(
            number, name, "error", problems, name=called, could=could if len(problems) == 1 else ""
        )
    status = "add" if before is None else "same" if after == before else "change"
    child_id = child[0] if child else None
    return ImportRow(number, name, status, (), before, after, child_id, line, called, new)


def _new_item(record: Mapping[str, str], category: str, problems: list[str]) -> NewItem:
    """Describe the new part of a row; it is bought if the row names a maker, a supplier or a value."""
    facts = {role.value: record[role] for role in BOUGHT if record.get(role)}
    bought = facts or record.get("value")
    try:
        number = check_number(record["part_number"]) if record.get("part_number") else None
    except RejectedError as error:
        problems.append(str(error))
        number = None
    return NewItem(
        category=category,
        part_number=number,
        name=_name_of(record) or record.get("unknown", ""),
        description=record.get("description", ""),
        texts={"sourcing_type": "purchased"} if bought else {},
        properties=facts,
    )


def _as_written(before: LineState, field: str, value: Any) -> bool:
    """Compare a value of a file with the line's; a file drops spaces at the ends, and splits designators."""
    value_before = getattr(before, field)
    if field == "reference_designators":
        return bool(designators(" ".join(value_before)) == value)
    return isinstance(value_before, str) and value_before.strip() == (value or "")


def _changes(record: Mapping[str, str], problems: list[str]) -> dict[str, Any]:
    changes: dict[str, Any] = {}
    if "quantity_problem" in record:
        problems.append(f"Quantity: {record['quantity_problem']}")
    else:
        changes["quantity"] = float(record["quantity"])
    for name in LineTexts.model_fields:
        if name in record:
            changes[name] = record[name] or None
    if record.get("rel_type"):
        changes["rel_type"] = record["rel_type"].lower()
    if "reference_designators" in record:
        changes["reference_designators"] = designators(record["reference_designators"])
    if "child_revision" in record:
        revision = record["child_revision"]
        changes["child_revision"] = whole_number(revision, 6)
        if revision and changes["child_revision"] is None:
            problems.append(f"Revision: wanted a whole number, got {revision[:40]!r}")
    return changes
