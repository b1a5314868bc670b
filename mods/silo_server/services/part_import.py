# SPDX-License-Identifier: LGPL-2.1-or-later
"""The list of items as a table: out as CSV, in as an update that shows each difference first.

A part number of a file is kept as it is. A row without a number means the item of its name, if there is
one; else a part is made, with the next number of its category. An empty cell changes nothing. A number that
stands in the file twice is a problem, and so is a category that the schema does not know, unless the user
names one for such rows: it decides a number for good.
"""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import select

from silo.bom.errors import InputError, RejectedError, listed
from silo.bom.headers import Heading, safe_cell
from silo.tables.part_rows import FACTS, PARTS, PartRow, PartRows, part_rows
from silo.tables.sheet import Layout
from silo_server.db.rows import one_of
from silo_server.db.tables import items
from silo_server.db.transaction import Tx
from silo_server.schema import ITEM_TYPES, Schema, find_schema
from silo_server.services.bom.unit_change import change_item_and_lines
from silo_server.services.import_file import read_import
from silo_server.services.items import (
    ItemChange,
    NewItem,
    check_number,
    create_item,
    get_by_numbers,
    to_item,
)
from silo_server.values import Item

# What an export has, by the headings that an import reads.
COLUMNS: Mapping[str, str] = {
    "part_number": "Part number",
    "name": "Name",
    "description": "Description",
    "category": "Category",
    "item_type": "Item type",
    "sourcing_type": "Sourcing",
    "notes": "Notes",
    "material": "Material",
    "manufacturer": "Manufacturer",
    "manufacturer_part_number": "Manufacturer's part number",
    "supplier": "Supplier",
    "supplier_part_number": "Supplier's part number",
}
_PROPERTIES = (*FACTS, Heading.MATERIAL)


@dataclass(frozen=True, slots=True)
class ImportedPart:
    """What becomes of a row. ``status``: add change same skip error.

    changes
        name of a column → (before, after).
    could
        what a user may allow instead of a problem: ``category``.
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


def read_parts_table(data: bytes, max_rows: int, layout: Layout | None = None) -> PartRows:
    """Read the rows of a list of parts. RejectedError if it is none, TooLargeError above ``max_rows``."""
    sheet = read_import(data, PARTS, max_rows, layout)
    try:
        return part_rows(sheet)
    except InputError as error:
        raise RejectedError(str(error), list(error.problems)) from None


def plan_parts(tx: Tx, read: PartRows, category: str = "") -> list[ImportedPart]:
    """Plan an import, row by row; change nothing. ``category``: of the rows whose own is unknown."""
    schema = find_schema(None)
    usual = schema.category(category).code if category else ""
    rows = [row for row in read.rows if not row.left_out]
    numbers = [row.texts[Heading.PART_NUMBER] for row in rows if row.texts.get(Heading.PART_NUMBER)]
    there = get_by_numbers(tx, numbers)
    archived = _archived(tx, numbers)
    by_name = _by_name(tx, {row.texts.get(Heading.NAME, "") for row in rows} - {""})
    twice = {
        number for number, count in Counter(number.casefold() for number in numbers).items() if count > 1
    }
    codes = {each.name.casefold(): each.code for each in schema.categories.values()}
    plan = []
    for row in read.rows:
        number, name = (row.texts.get(role, "") for role in (Heading.PART_NUMBER, Heading.NAME))
        if row.left_out:
            plan.append(ImportedPart(row.line, number, name, "skip", why=row.left_out))
            continue
        problems = list(row.problems)
        if number.casefold() in twice:
            problems.append(f"Part number: {number} stands in the file more than once")
        if number.casefold() in archived:
            problems.append(f"Part number: {number} is archived")
        same = [] if number else by_name.get(name, [])
        if len(same) > 1:
            called = listed([item.part_number for item in same], 5)
            problems.append(f"Part number: {name}: {called} are called so; give the part number")
        item = there.get(number) if number else next(iter(same), None)
        plan.append(_planned(row, item, schema, codes, usual, problems))
    return plan


def _planned(
    row: PartRow,
    item: Item | None,
    schema: Schema,
    codes: Mapping[str, str],
    usual: str,
    problems: list[str],
) -> ImportedPart:
    texts = row.texts
    number, name = texts.get(Heading.PART_NUMBER, ""), texts.get(Heading.NAME, "")
    could = ""
    group = texts.get(Heading.CATEGORY, "")
    code = group.upper() if group.upper() in schema.categories else codes.get(group.casefold(), "")
    if not code and (group or not number) and item is None:
        code = usual
        if not code:
            what = f"there is no category {group[:60]!r}" if group else "a part without a number needs one"
            problems.append(f"Category: {what}; name the category of such rows")
            could = "category"
    kind = texts.get(Heading.ITEM_TYPE, "").casefold()
    if kind and kind not in ITEM_TYPES:
        problems.append(f"Item type: wanted {', '.join(ITEM_TYPES)}, got {kind[:40]!r}")
    if number and item is None:
        try:
            check_number(number)
        except RejectedError as error:
            problems.append(str(error))
    if not (number or name or texts.get(Heading.DESCRIPTION)):
        problems.append("Name: is empty, and there is no part number")
    if problems:
        return ImportedPart(
            row.line, number, name, "error", problems, could=could if len(problems) == 1 else ""
        )
    facts = {role.value: texts[role] for role in _PROPERTIES if texts.get(role)}
    own = {"sourcing_type": texts.get(Heading.SOURCING), "long_description": texts.get(Heading.NOTES)}
    own = {column: text for column, text in own.items() if text}
    if item is None:
        new = NewItem(
            category=code or None,
            part_number=number or None,
            name=name,
            description=texts.get(Heading.DESCRIPTION, ""),
            item_type=kind or None,
            texts=own,
            properties=facts,
        )
        return ImportedPart(row.line, number, name, "add", new=new)
    wanted = {
        "name": name,
        "description": texts.get(Heading.DESCRIPTION, ""),
        "item_type": kind,
        "category": code,
        "sourcing_type": own.get("sourcing_type", ""),
        "notes": own.get("long_description", ""),
        **facts,
    }
    before = cells_of(item)
    changes = {
        column: (before[column], after)
        for column, after in wanted.items()
        if after and after != before[column].strip()
    }
    if not changes:
        return ImportedPart(row.line, item.part_number, name or item.name, "same")
    properties = {column: after for column, (_, after) in changes.items() if column in {*_PROPERTIES}}
    after = {column: new for column, (_, new) in changes.items()}
    change = ItemChange(
        name=after.get("name"),
        description=after.get("description"),
        item_type=after.get("item_type"),
        category=after.get("category"),
        texts={
            field: changes[column][1]
            for column, field in (("sourcing_type", "sourcing_type"), ("notes", "long_description"))
            if column in changes
        },
        properties={**item.properties, **properties} if properties else None,
        comment="imported",
    )
    return ImportedPart(
        row.line, item.part_number, name or item.name, "change", changes=changes, change=change
    )


def apply_parts(tx: Tx, read: PartRows, category: str = "") -> list[ImportedPart]:
    """Import the rows, all or nothing. RejectedError lists every problem; then nothing was changed."""
    plan = plan_parts(tx, read, category)
    problems = [f"row {row.row}: {problem}" for row in plan for problem in row.problems]
    if problems:
        raise RejectedError(
            f"{len(problems)} problems in the file, so nothing was imported: {problems[0]}", problems
        )
    for row in plan:
        if row.new is not None:
            create_item(tx, row.new)
        elif row.change is not None:
            change_item_and_lines(tx, row.part_number, row.change)
    return plan


def cells_of(item: Item) -> dict[str, str]:
    """Return an item as the cells of its row."""
    cells: dict[str, Any] = {
        "part_number": item.part_number,
        "name": item.name,
        "description": item.description,
        "category": item.category,
        "item_type": item.item_type,
        "sourcing_type": item.texts.get("sourcing_type"),
        "notes": item.texts.get("long_description"),
        **{role.value: item.properties.get(role.value) for role in _PROPERTIES},
    }
    return {column: "" if cells[column] is None else str(cells[column]) for column in COLUMNS}


def export_parts(tx: Tx) -> Iterator[str]:
    """Write all items that are not archived as CSV (RFC 4180), row by row."""
    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow(COLUMNS.values())
    query = select(items).where(items.c.archived_at.is_(None)).order_by(items.c.part_number_key)
    for row in tx.conn.execute(query):
        writer.writerow(safe_cell(text) for text in cells_of(to_item(row)).values())
        yield out.getvalue()
        out.seek(0)
        out.truncate()
    yield out.getvalue()


def _archived(tx: Tx, numbers: Sequence[str]) -> set[str]:
    keys = {number.casefold() for number in numbers}
    query = select(items.c.part_number_key).where(
        one_of(tx, items.c.part_number_key, keys), items.c.archived_at.is_not(None)
    )
    return set(tx.conn.scalars(query))


def _by_name(tx: Tx, names: set[str]) -> dict[str, list[Item]]:
    found: dict[str, list[Item]] = {}
    query = select(items).where(one_of(tx, items.c.name, names), items.c.archived_at.is_(None))
    for row in tx.conn.execute(query.order_by(items.c.part_number_key)):
        found.setdefault(row.name, []).append(to_item(row))
    return found
