# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which row of a BOM belongs to which: by item numbers, by levels, or by indented names.

Item numbers win over levels, levels over indents. No parent is invented.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from silo.bom.headers import Heading
from silo.bom.message import message
from silo.inertia.bom.table import BomCode, BOMEntry, BomWarning
from silo.tables import structure
from silo.tables.sheet import Sheet


def with_levels_of_indents(rows: list[BOMEntry], sheet: Sheet, warnings: list[BomWarning]) -> list[BOMEntry]:
    """Derive levels from the spaces before the names, if nothing else shows the structure."""
    at = sheet.columns.at
    if Heading.LEVEL in at or any("." in row.item for row in rows):
        return rows
    column = next(at[role] for role in (Heading.NAME, Heading.DESCRIPTION, Heading.PART_NUMBER) if role in at)
    cells = {row.line: row.cells[column] for row in sheet.rows if column < len(row.cells)}
    levels = structure.indent_levels([cells.get(row.line, "") for row in rows])
    if levels is None:
        return rows
    words = message("the names are indented; a row belongs to the one above it that is indented less")
    warnings.append(BomWarning(BomCode.FILE, words, sheet.header_line))
    return [replace(row, level=level + 1) for row, level in zip(rows, levels, strict=True)]


def item_role_of(sheet: Sheet) -> Heading:
    """Return the role of the column with item numbers; some tools call it the level: 1, 1.1, 1.1.2."""

    def dotted(role: Heading) -> bool:
        return structure.is_position_column([sheet.columns.cell(row.cells, role) for row in sheet.rows])

    return Heading.LEVEL if dotted(Heading.LEVEL) and not dotted(Heading.ITEM) else Heading.ITEM


def level_of(text: str, item_role: Heading, line: int, name: str, warnings: list[BomWarning]) -> int:
    """Read a level: "2", "..2" and "+2" are one below "1". Item numbers (1.1) are no levels."""
    level = structure.level(text) if text and item_role is not Heading.LEVEL else None
    if level is None and text and item_role is not Heading.LEVEL:
        words = message("the level “{text}” cannot be read; the row is taken to stand at the top", text=text)
        warnings.append(BomWarning(BomCode.FILE, words, line, name))
    return 1 if level is None else level


def doubtful_items(rows: Sequence[BOMEntry]) -> Iterator[BomWarning]:
    """Warn of item numbers that a spreadsheet may have changed.

    A spreadsheet changes 1.10 to 1.1, and 1.2 to the second of January.
    """
    if not any("." in row.item for row in rows):
        return
    first: dict[str, int] = {}
    for row in rows:
        if first.setdefault(row.item, row.line) != row.line and "." in row.item:
            words = message(
                "the item number {item} stands in line {line} as well (was it 1.10 for 1.1?)",
                item=row.item,
                line=first[row.item],
            )
            yield BomWarning(
                BomCode.FILE,
                message("{words}; rows below may belong to either", words=words),
                row.line,
                row.name,
            )
        elif row.item and not structure.position(row.item):
            words = message(
                "the item number “{item}” cannot be read; the row is taken to stand at the top", item=row.item
            )
            yield BomWarning(BomCode.FILE, words, row.line, row.name)


def with_structure(rows: Sequence[BOMEntry]) -> tuple[BOMEntry, ...]:
    """Fill in ``parent``, ``level`` and ``has_children`` of the rows.

    Item numbers win over levels. A row whose parent is not in the file (a flattened list, a cut-out) is at
    the top level; no parent is invented for it.
    """
    if any("." in row.item for row in rows):
        parents = structure.by_positions([structure.position(row.item) for row in rows]).parents
    else:
        parents = structure.by_levels([row.level for row in rows]).parents
    having = {parent for parent in parents if parent is not None}
    levels: list[int] = []
    for parent in parents:
        levels.append(1 if parent is None else levels[parent] + 1)
    return tuple(
        replace(row, parent=parent, level=level, has_children=index in having)
        for index, (row, parent, level) in enumerate(zip(rows, parents, levels, strict=True))
    )
