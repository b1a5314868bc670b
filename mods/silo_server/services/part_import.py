# SPDX-License-Identifier: LGPL-2.1-or-later
"""The list of items as a table: out as CSV, in as an update that shows each difference first.

A part number of a file is kept as it is. A row without a number means the item of its name and description,
if there is one; else a part is made, with the next number of its category. An empty cell changes nothing.
What the file leaves open is a question: a number that stands there twice for different parts, and a category
that the scheme does not know, which would decide a number for good.
"""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from sqlalchemy import select

from silo.bom.errors import InputError, RejectedError, listed
from silo.bom.headers import Heading, safe_cell
from silo.bom.message import joined, message
from silo.bom.units import PIECES, stored_unit
from silo.tables.part_rows import FACTS, PARTS, PartRow, PartRows, part_rows
from silo.tables.sheet import Layout
from silo_server.db.rows import one_of
from silo_server.db.tables import documents, items, revisions
from silo_server.db.transaction import Tx
from silo_server.schema import ITEM_TYPES, Schema
from silo_server.services.bom.unit_change import change_item_and_lines
from silo_server.services.import_file import read_import
from silo_server.services.import_log import Done, log_import
from silo_server.services.item_cells import ARCHIVED, COLUMNS, TEXTS, cells_of, change_of
from silo_server.services.items import (
    ItemChange,
    NewItem,
    check_number,
    create_item,
    get_by_numbers,
    to_item,
    unarchive_item,
)
from silo_server.services.scheme import scheme_of
from silo_server.services.table_layouts import remembered_layout
from silo_server.values import Item
from silo_server.web_address import address_problem

ATTACHMENTS = "Attachments"
DUPLICATES = ("", "first", "new")


@dataclass(frozen=True, slots=True)
class PartsAllowed:
    """What a user allows an import of parts.

    category
        of new parts whose own is unknown; "": such rows are problems.
    duplicates
        of rows with one number, that differ: the ``first`` counts, or the others get a ``new`` number; "": a
        problem.
    leave_out
        rows with a problem are left out by name.
    """

    category: str = ""
    duplicates: str = ""
    leave_out: bool = False


PARTS_AS_THEY_ARE = PartsAllowed()


@dataclass(frozen=True, slots=True)
class ImportedPart:
    """What becomes of a row. ``status``: add change same skip error.

    changes
        name of a column → (before, after).
    could
        what a user may allow instead of a problem: ``category``, ``duplicates``.
    """

    row: int
    part_number: str
    name: str
    status: str
    problems: Sequence[str] = ()
    changes: Mapping[str, tuple[str, str]] | None = None
    new: NewItem | None = None
    change: ItemChange | None = None
    why: str = ""
    could: str = ""


def read_parts_table(tx: Tx, data: bytes, max_rows: int, layout: Layout | None = None) -> PartRows:
    """Read the rows of a list of parts; ``layout`` None: as a file with the same headings was read.

    RejectedError if it is none, TooLargeError above ``max_rows``.
    """
    known: tuple[str, ...] = ()
    if layout is None:
        layout, known = remembered_layout(tx, "parts", data, PARTS)
    sheet = read_import(data, PARTS, max_rows, layout)
    try:
        read = part_rows(sheet)
    except InputError as error:
        raise RejectedError(str(error), list(error.problems)) from None
    return replace(read, notes=(*known, *read.notes))


@dataclass
class _Known:
    """What Silo has of the parts of a file."""

    schema: Schema
    usual: str
    by_number: Mapping[str, Item]
    by_name: Mapping[str, Sequence[Item]]
    attached: Mapping[int, Sequence[str]]
    claimed: set[int] = field(default_factory=set)

    def code(self, group: str) -> str:
        """Find the category that a cell names by code, name or path; "" for none."""
        return self.schema.named(group)

    def of_name(self, row: PartRow, like: int) -> tuple[Item | None, str]:
        """Find the item that a row without a number means; else say why it cannot be found.

        ``like``: how many rows of the file say the same.
        """
        name, text = (row.texts.get(role, "") for role in (Heading.NAME, Heading.DESCRIPTION))
        free = [item for item in self.by_name.get(name, ()) if item.id not in self.claimed]
        same = [item for item in free if not text or item.description in (text, name)] or free
        if len(same) > like:
            called = listed([item.part_number for item in same], 5)
            return None, message(
                "Part number: {name}: {part_numbers} are called so; give the part number",
                name=name,
                part_numbers=called,
            )
        item = next(iter(same), None)
        if item is not None:
            self.claimed.add(item.id)
        return item, ""


def plan_parts(tx: Tx, read: PartRows, allowed: PartsAllowed = PARTS_AS_THEY_ARE) -> list[ImportedPart]:
    """Plan an import, row by row; change nothing."""
    schema = scheme_of(tx)
    rows = [row for row in read.rows if not row.left_out]
    numbers = [row.texts[Heading.PART_NUMBER] for row in rows if row.texts.get(Heading.PART_NUMBER)]
    in_file = {number.casefold() for number in numbers}
    by_name = _by_name(tx, {row.texts.get(Heading.NAME, "") for row in rows} - {""}, in_file)
    usual = schema.category(allowed.category).code if allowed.category else ""
    there = get_by_numbers(tx, numbers, include_archived=True)
    known = _Known(schema, usual, there, by_name, _attachment_names(tx))
    counts = Counter(number.casefold() for number in numbers)
    first: dict[str, PartRow] = {}
    alike = Counter(_says(row) for row in rows)
    plan = []
    for row in read.rows:
        number, name = (row.texts.get(role, "") for role in (Heading.PART_NUMBER, Heading.NAME))
        left_out, could, problems = row.left_out, "", list(row.problems)
        if not left_out and counts[number.casefold()] > 1:
            before = first.setdefault(number.casefold(), row)
            if before is not row and _says(before) == _says(row):
                left_out = message("the same as row {row}", row=before.line)
            elif before is not row and allowed.duplicates == "first":
                left_out = message(
                    "row {row} has the number {part_number} too, and counts",
                    row=before.line,
                    part_number=number,
                )
            elif before is not row and allowed.duplicates == "new":
                row, number = replace(row, texts={**row.texts, Heading.PART_NUMBER: ""}), ""
            elif not allowed.duplicates and any(
                _says(other) != _says(row)
                for other in rows
                if other.texts.get(Heading.PART_NUMBER, "").casefold() == number.casefold()
            ):
                problems.append(
                    message(
                        "Part number: {part_number} stands in the file more than once",
                        part_number=number,
                    )
                )
                could = "duplicates"
        if left_out:
            plan.append(ImportedPart(row.line, number, name, "skip", why=left_out))
            continue
        item = known.by_number.get(number) if number else None
        if not number and name:
            item, problem = known.of_name(row, max(1, alike[_says(row)]))
            problems += filter(None, (problem,))
        planned = _planned(row, item, known, problems, could)
        if planned.status == "error" and allowed.leave_out:
            why = joined("; ", planned.problems)
            planned = ImportedPart(row.line, planned.part_number, name, "skip", why=why)
        plan.append(planned)
    return plan


def _says(row: PartRow) -> frozenset[tuple[str, str]]:
    """Return all that a row says, to compare it with another."""
    return frozenset((role, text) for role, text in row.texts.items() if text)


def _planned(
    row: PartRow, item: Item | None, known: _Known, problems: list[str], could: str = ""
) -> ImportedPart:
    texts = row.texts
    number, name = texts.get(Heading.PART_NUMBER, ""), texts.get(Heading.NAME, "")
    group = texts.get(Heading.CATEGORY, "")
    code = known.code(group)
    if not code and (group or not number) and item is None:
        code = known.usual
        if not code:
            what = (
                message("there is no category {category}", category=repr(group[:60]))
                if group
                else message("a part without a number needs one")
            )
            problems.append(message("Category: {problem}; name the category of such rows", problem=what))
            could = could or "category"
    if (link := texts.get(Heading.LINK)) and (problem := address_problem(link)):
        problems.append(message("Link: {problem}", problem=problem))
    kind = texts.get(Heading.ITEM_TYPE, "").casefold()
    if kind and kind not in ITEM_TYPES:
        problems.append(
            message(
                "Item type: wanted {known}, got {item_type}",
                known=", ".join(ITEM_TYPES),
                item_type=repr(kind[:40]),
            )
        )
    if number and item is None:
        try:
            check_number(number)
        except RejectedError as error:
            problems.append(str(error))
    if not (number or name or texts.get(Heading.DESCRIPTION)):
        problems.append(message("Name: is empty, and there is no part number"))
    if problems:
        return ImportedPart(
            row.line, number, name, "error", problems, could=could if len(problems) == 1 else ""
        )
    facts = {role.value: texts[role] for role in (*FACTS, Heading.MATERIAL) if texts.get(role)}
    facts |= {"sourcing_link": texts[Heading.LINK]} if texts.get(Heading.LINK) else {}
    unit = stored_unit(texts.get(Heading.UNIT))
    own = {
        "sourcing_type": texts.get(Heading.SOURCING) or "",
        "notes": texts.get(Heading.NOTES) or "",
        "unit": unit or "",
    }
    if item is None:
        given = {TEXTS[column]: text for column, text in own.items() if text}
        if unit == PIECES.symbol:
            del given["unit"]
        new = NewItem(
            category=code or None,
            part_number=number or None,
            name=name,
            description=texts.get(Heading.DESCRIPTION, ""),
            item_type=kind or None,
            texts=given,
            properties=facts,
        )
        return ImportedPart(row.line, number, name, "add", new=new, why=_lacking(row))
    wanted = {
        "name": name,
        "description": texts.get(Heading.DESCRIPTION, ""),
        "item_type": kind,
        "category": code,
        **own,
        **facts,
    }
    before = cells_of(item)
    changes = {ARCHIVED: ("yes", "no")} if item.archived_at else {}
    changes |= {
        column: (before[column], after)
        for column, after in wanted.items()
        if after and after != before[column].strip()
    }
    why = _lacking(row, known.attached.get(item.id, ()))
    if not changes:
        return ImportedPart(row.line, item.part_number, name or item.name, "same", why=why)
    after = {column: new for column, (_, new) in changes.items() if column != ARCHIVED}
    change = change_of(item, after, "imported")
    return ImportedPart(
        row.line, item.part_number, name or item.name, "change", changes=changes, change=change, why=why
    )


def _lacking(row: PartRow, there: Sequence[str] = ()) -> str:
    """Name the attachments of a row that Silo does not have; a table does not bring their content."""
    named = [name.strip() for name in row.texts.get(Heading.ATTACHMENTS, "").split(";")]
    lacking = [name for name in named if name and name not in there]
    if not lacking:
        return ""
    return message("without the attachments {names}, which are no part of a table", names=listed(lacking, 5))


def apply_parts(
    tx: Tx, read: PartRows, allowed: PartsAllowed = PARTS_AS_THEY_ARE, file_name: str = ""
) -> tuple[list[ImportedPart], int | None]:
    """Import the rows, all or nothing. Returns what was done, and the number by which it can be undone.

    RejectedError lists every problem; then nothing was changed.
    """
    plan, done = plan_parts(tx, read, allowed), Done()
    problems = [
        message("row {row}: {problem}", row=row.row, problem=problem)
        for row in plan
        for problem in row.problems
    ]
    if problems:
        raise RejectedError(
            message(
                "{n} problems in the file, so nothing was imported: {problem}",
                n=len(problems),
                problem=problems[0],
            ),
            problems,
        )
    for row in plan:
        if row.new is not None:
            done.made.append(create_item(tx, row.new)[0].id)
        elif row.change is not None:
            changes = row.changes or {}
            if ARCHIVED in changes:
                unarchive_item(tx, row.part_number)
            item = change_item_and_lines(tx, row.part_number, row.change)
            cells = cells_of(item)
            done.changed[item.id] = {name: (before, cells[name]) for name, (before, _) in changes.items()}
    return plan, log_import(tx, "parts", file_name, done)


def export_parts(tx: Tx) -> Iterator[str]:
    """Write all items that are not archived as CSV (RFC 4180), row by row, with the names of attachments."""
    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow([*COLUMNS.values(), ATTACHMENTS])
    attached = _attachment_names(tx)
    query = select(items).where(items.c.archived_at.is_(None)).order_by(items.c.part_number_key)
    for row in tx.conn.execute(query):
        known = cells_of(to_item(row))
        cells = [*(known[column] for column in COLUMNS), "; ".join(attached.get(row.id, ()))]
        writer.writerow(map(safe_cell, cells))
        yield out.getvalue()
        out.seek(0)
        out.truncate()
    yield out.getvalue()


def _attachment_names(tx: Tx) -> dict[int, list[str]]:
    of, newest = documents.c, revisions.c
    query = (
        select(of.attached_to, newest.file_name)
        .join(revisions, (newest.document_id == of.id) & (newest.revision_number == of.current_revision))
        .where(of.attached_to.is_not(None), of.removed_at.is_(None))
        .order_by(of.id)
    )
    found: dict[int, list[str]] = {}
    for item_id, name in tx.conn.execute(query):
        found.setdefault(item_id, []).append(name or "")
    return found


def _by_name(tx: Tx, names: set[str], in_file: set[str]) -> dict[str, list[Item]]:
    """Find items by name, but for those whose number stands in the file."""
    found: dict[str, list[Item]] = {}
    query = select(items).where(one_of(tx, items.c.name, names), items.c.archived_at.is_(None))
    for row in tx.conn.execute(query.order_by(items.c.part_number_key)):
        if row.part_number_key not in in_file:
            found.setdefault(row.name, []).append(to_item(row))
    return found
