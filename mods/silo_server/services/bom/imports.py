# SPDX-License-Identifier: LGPL-2.1-or-later
"""BOM import from CSV: first what would happen, row by row; then, if nothing is wrong, all of it at once.

The columns are known by their names (:mod:`silo.bom.headers`); if they are not, a person says which column
is which (:class:`Layout`). Reading a file is pure: it needs no database.
Rows add manual lines or change lines that are there (by the rules of a person's edit); lines that the file
does not name stay as they are. Our own single-level export, imported again, changes nothing. A row without a
part number, as KiCad writes them, means the part of its manufacturer's number, else of its name: the value
and the footprint. Unknown parts are made on the way, and rows of one part added up, if a person says so.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from decimal import Decimal
from itertools import islice
from typing import Any, NamedTuple

from sqlalchemy import select

from silo.api.wire import LineTexts
from silo.bom.errors import InputError, RejectedError, listed
from silo.bom.headers import (
    Heading,
    designators,
    find_clashes,
    find_roles,
    missing_columns,
    plain_cell,
    second_columns,
)
from silo.bom.numbers import Mark, common_mark, parse_number, read_quantity, whole_number
from silo.bom.quantities import exact_sum
from silo.workbook.encoding import STARTS, unicode_name
from silo.workbook.read import read_workbook
from silo.workbook.sheet import Grid
from silo_server.db.rows import one_of
from silo_server.db.tables import items
from silo_server.db.transaction import Tx
from silo_server.errors import TooLargeError
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

# What a line says; then what identifies a part without a number, or describes a new one.
LINE_ROLES = (
    Heading.PART_NUMBER,
    Heading.QUANTITY,
    Heading.REFERENCE_DESIGNATORS,
    *map(Heading, LineTexts.model_fields),
    Heading.TYPE,
    Heading.REVISION,
    Heading.LEVEL,
)
_BOUGHT = (
    Heading.MANUFACTURER,
    Heading.MANUFACTURER_NUMBER,
    Heading.SUPPLIER,
    Heading.SUPPLIER_NUMBER,
)
ROLES = (
    *LINE_ROLES,
    Heading.NAME,
    Heading.DESCRIPTION,
    Heading.VALUE,
    Heading.FOOTPRINT,
    *_BOUGHT,
    Heading.NOT_FITTED,
)
NEEDED = (Heading.PART_NUMBER, Heading.QUANTITY)
# In place of a needed column, if the file has none.
_INSTEAD = {
    Heading.PART_NUMBER: (Heading.MANUFACTURER_NUMBER, Heading.VALUE),
    Heading.QUANTITY: (Heading.REFERENCE_DESIGNATORS,),
}
_RANGE = re.compile(r"([A-Za-z]+)([0-9]+)-([A-Za-z]*)([0-9]+)")


class Table(NamedTuple):
    """What a table to be imported may say in its columns.

    instead
        what may stand in the place of a needed column, if the file has none.
    single
        columns that a file has once: two that differ are refused.
    """

    roles: Sequence[Heading]
    needed: Sequence[Heading]
    instead: Mapping[Heading, Sequence[Heading]]
    single: Sequence[Heading]

    def lacking(self, there: Collection[Heading]) -> list[Heading]:
        """Return the needed columns that the file has neither itself nor through a substitute."""
        return [
            role for role in self.needed if role not in there and not {*self.instead.get(role, ())} & {*there}
        ]


BOM = Table(ROLES, NEEDED, _INSTEAD, LINE_ROLES)
DELIMITERS = {",": "commas", ";": "semicolons", "\t": "tabs"}
HEADER_WITHIN = 40
"""The header must be among this many first lines (title blocks are a few lines long)."""
MAX_COLUMNS = 200

# Columns of our own exports.
_INCOMPLETE, _SOURCE, _TOTAL = "Incomplete", "Source", "Total quantity"

# (row number, field → text)
Record = tuple[int, dict[str, str]]


@dataclass(frozen=True, slots=True)
class Layout:
    """How a file is read.

    header
        index of the header's line.
    columns
        index of each role's column.
    mark
        the decimal mark of its numbers, None = as the numbers themselves show.
    """

    delimiter: str
    header: int
    columns: Mapping[Heading, int] = field(default_factory=dict)
    mark: Mark | None = None


def read_csv(data: bytes, max_rows: int, layout: Layout | None = None, of: Table = BOM) -> list[Record]:
    """Read the rows that are not empty. RejectedError if this is no such table.

    TooLargeError above ``max_rows``. Needs no database: call it before a transaction begins, which others
    would wait for.
    """
    text = _decode(data)
    chosen, layout = layout is not None, layout or guess(text, of)
    # A person may also choose the column of the names.
    roles = {
        *layout.columns,
        *(_INSTEAD[Heading.PART_NUMBER] if Heading.NAME in layout.columns else ()),
    }
    if missing := of.lacking(roles):
        words = ", ".join(role.replace("_", " ").capitalize() for role in missing)
        raise RejectedError(f"file: choose the column of {words}")
    rows = _rows(text, layout.delimiter)
    try:
        table = list(islice(rows, layout.header + 1 + max_rows + 1))
    except csv.Error as error:
        raise RejectedError(f"file: wanted CSV, got a file that cannot be read as CSV ({error})") from None
    if len(table) - layout.header - 1 > max_rows:
        raise TooLargeError(f"file: this server takes at most {max_rows} rows, got more")
    header, body = table[layout.header] if table else [], table[layout.header + 1 :]
    if of is BOM and Heading.PART_NUMBER in layout.columns:
        _refuse_flat(header, body, layout.columns[Heading.PART_NUMBER])
    if not chosen:
        _refuse_clashes(header, body, layout, of.single)
    gap_column = _column(header, _INCOMPLETE)
    records = []
    for number, cells in enumerate(body, start=layout.header + 2):
        record = {role.value: _cell(cells, i) for role, i in layout.columns.items() if i < len(cells)}
        # Our own exports end with what a sync left out: rows that say so, and have no part number.
        if any(record.values()) and (record.get("part_number") or not _cell(cells, gap_column)):
            if of is BOM and Heading.QUANTITY not in layout.columns:
                record["quantity"] = str(_designated(record.get("reference_designators", "")))
            records.append((number, record))
    return _with_exact_quantities(records, layout) if of is BOM else records


def _designated(cell: str) -> int:
    """Count the places that reference designators name: three in ``R1, R3-R4``."""
    spans = [(designator, _RANGE.fullmatch(designator)) for designator in designators(cell)]
    return sum(
        max(1, int(span[4]) - int(span[2]) + 1) if span and span[3] in ("", span[1]) else 1
        for _, span in spans
    )


def as_csv(data: bytes, of: Table = BOM) -> bytes:
    """Convert a table to CSV: of a workbook (XLSX, ODS, XLS) the one sheet that holds it, else its first.

    RejectedError if several sheets hold such a table, or if lines are hidden or struck out: a person would
    not expect them to be read.
    """
    if not data.startswith(STARTS):
        return data
    try:
        sheets = [(grid, _sheet_text(grid)) for grid in read_workbook(data, "file")]
    except InputError as error:
        raise RejectedError(str(error)) from None
    likely = [sheet for sheet in sheets if guess_of(sheet[1], of)]
    if likely[1:]:
        names = listed([f"“{grid.name}”" for grid, _ in likely])
        raise RejectedError(f"file: the sheets {names} each hold such a table; save the right sheet alone")
    if not sheets:
        raise RejectedError("file: wanted a workbook with a table, got one without a sheet")
    grid, text = (likely or sheets)[0]
    hidden = {row for row, _ in grid.cells} & grid.hidden_rows
    struck = {row for (row, _), cell in grid.cells.items() if cell.struck}
    for rows, words in ((hidden, "hidden"), (struck, "struck out")):
        if rows:
            lines = listed([str(row + 1) for row in sorted(rows)], 8)
            raise RejectedError(
                f"file: of sheet “{grid.name}” these lines are {words}: {lines}; show or delete them, for an "
                "import would take them like all others"
            )
    return text


def _sheet_text(grid: Grid) -> bytes:
    out = io.StringIO()
    writer, line = csv.writer(out), 1
    for row in grid.rows():
        out.write("\n" * (row.line - line))  # lines keep their numbers
        writer.writerow(row.cells)
        line = row.line + 1
    return out.getvalue().encode()


def first_lines(data: bytes, delimiter: str, count: int = 8) -> list[list[str]]:
    """Read the first lines of a file as cells, as far as possible, for a person to name the columns."""
    lines: list[list[str]] = []
    with suppress(csv.Error):
        lines.extend(row[:MAX_COLUMNS] for row in islice(_rows(_decode(data), delimiter), count))
    return lines


def likely_delimiter(data: bytes) -> str:
    """Find the separator that makes the most columns of the first lines."""
    widths = {mark: max(map(len, first_lines(data, mark)), default=0) for mark in DELIMITERS}
    return max(widths, key=lambda mark: widths[mark])


def guess(text: str, of: Table = BOM) -> Layout:
    """Find the delimiter with which there is a header, the header and its columns; else RejectedError."""
    broken: csv.Error | None = None
    near = ""
    for delimiter in DELIMITERS:
        try:
            for index, row in enumerate(islice(_rows(text, delimiter), HEADER_WITHIN)):
                at = find_roles(row[:MAX_COLUMNS], of.roles)
                lacking = of.lacking(at)
                if not lacking:
                    return Layout(delimiter, index, at)
                missing = missing_columns(row[:MAX_COLUMNS], at, lacking)
                # A line with one of the two, and another cell beside it, is a header that lacks the other.
                if len(row) > 1 and set(of.needed) & at.keys():
                    near = near or f"file: in line {index + 1}, {missing}"
        except csv.Error as error:
            broken = error
    if near:
        raise RejectedError(near)
    if broken is not None:
        raise RejectedError(f"file: wanted CSV, got a file that cannot be read as CSV ({broken})")
    words = ", ".join(role.replace("_", " ").capitalize() for role in of.needed)
    raise RejectedError(
        f"file: wanted a header row with {words} among the first {HEADER_WITHIN} rows, found none"
    )


def guess_of(data: bytes, of: Table = BOM) -> Layout | None:
    """Guess as :func:`guess`; None if there is no header that we know."""
    try:
        return guess(_decode(data), of)
    except RejectedError:
        return None


def _refuse_flat(header: Sequence[str], body: Sequence[Sequence[str]], part_number: int) -> None:
    """Refuse our flat export: its totals over all levels would be wrong as the lines of one level."""
    source, total = _column(header, _SOURCE), _column(header, _TOTAL)
    lines = [cells for cells in body if _cell(cells, part_number)]
    if source is None or total is None or not lines:
        return
    if not any(_cell(cells, source) for cells in lines):
        raise RejectedError(
            "file: this is a flat export, whose quantities are totals over all levels, not the lines of this "
            "BOM. Export “these lines” instead, change them, and import that"
        )


def _refuse_clashes(
    header: Sequence[str], body: Sequence[Sequence[str]], layout: Layout, single: Sequence[Heading]
) -> None:
    """Refuse two columns of one role: a person says which one counts, not the order of the file."""
    header = header[:MAX_COLUMNS]
    seconds = second_columns(header, single, layout.columns)
    problems = [
        f"the columns '{clash.ours}' and '{clash.other}' both mean the {words}, and "
        f"in row {layout.header + 2 + clash.row} they say {clash.used[:40]!r} and {clash.unused[:40]!r}"
        for clash in find_clashes(header, body, layout.columns, seconds)
        for words in [clash.role.replace("_", " ")]
    ]
    if problems:
        raise RejectedError(f"file: {'; '.join(problems)}; choose one, or rename the other", problems)


def _column(header: Sequence[str], name: str) -> int | None:
    return next((index for index, cell in enumerate(header) if cell.strip() == name), None)


def _cell(cells: Sequence[str], index: int | None) -> str:
    return plain_cell(cells[index].strip()) if index is not None and index < len(cells) else ""


def _with_exact_quantities(records: list[Record], layout: Layout) -> list[Record]:
    """Replace quantities by plain numerals; put the problem beside a quantity that cannot be read.

    The whole column decides what "1,234" means; in a file separated by commas, a point is a decimal point.
    """
    texts = [record.get("quantity", "") for _, record in records]
    mark = layout.mark or common_mark(number.mark for text in texts if (number := parse_number(text)))
    decimal = layout.mark is None and layout.delimiter == ","
    for (_, record), text in zip(records, texts, strict=True):
        reading = read_quantity(text, mark, points_are_decimal=decimal)
        record["quantity"] = "" if reading.value is None else str(reading.value)
        if reading.problem:
            record["quantity_problem"] = reading.problem
    return records


def _rows(text: str, delimiter: str) -> Iterator[list[str]]:
    return csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)


def _decode(data: bytes) -> str:
    if encoding := unicode_name(data):
        return data.decode(encoding, errors="replace")
    with suppress(UnicodeDecodeError):
        return data.decode()
    # What spreadsheets in western Europe and America write when they are not asked for Unicode.
    return data.decode("cp1252", errors="replace")


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
    facts = {role.value: record[role] for role in _BOUGHT if record.get(role)}
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
