# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which row of a BOM belongs to which: by item numbers, by levels, or by indented names.

Item numbers win over levels, levels over indents. No parent is invented.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

from silo.bom.headers import Heading
from silo.inertia.bom.sheet import Sheet
from silo.inertia.bom.table import BomCode, BOMEntry, BomWarning


def with_levels_of_indents(rows: list[BOMEntry], sheet: Sheet, warnings: list[BomWarning]) -> list[BOMEntry]:
    """Derive levels from the spaces before the names, if nothing else shows the structure.

    A step is two spaces or more, and there are never two steps down at once: a single wrong space makes no
    sub-assembly.
    """
    at = sheet.columns.at
    if Heading.LEVEL in at or any("." in row.item for row in rows):
        return rows
    column = next(at[role] for role in (Heading.NAME, Heading.DESCRIPTION, Heading.PART_NUMBER) if role in at)
    cells = {row.line: row.cells[column] for row in sheet.rows if column < len(row.cells)}
    depths = [_depth(cells.get(row.line, "")) for row in rows]
    step = min(filter(None, depths), default=0)
    levels = [depth // step if step else 0 for depth in depths]
    deeper = any(level > above + 1 for above, level in pairwise([-1, *levels]))
    if step < 2 or deeper or any(depth % step for depth in depths):
        return rows
    words = "the names are indented; a row belongs to the one above it that is indented less"
    warnings.append(BomWarning(BomCode.FILE, words, sheet.header_line))
    return [replace(row, level=level + 1) for row, level in zip(rows, levels, strict=True)]


def _depth(cell: str) -> int:
    text = cell.expandtabs(4)
    return len(text) - len(text.lstrip())


def item_role_of(sheet: Sheet) -> Heading:
    """Return the role of the column with item numbers; some tools call it the level: 1, 1.1, 1.1.2."""

    def dotted(role: Heading) -> bool:
        return any(re.fullmatch(r"\d+(?:\.\d+)+", sheet.columns.cell(r.cells, role)) for r in sheet.rows)

    return Heading.LEVEL if dotted(Heading.LEVEL) and not dotted(Heading.ITEM) else Heading.ITEM


def level_of(text: str, item_role: Heading, line: int, name: str, warnings: list[BomWarning]) -> int:
    """Read a level: "2", "..2" and "+2" are one below "1". Item numbers (1.1) are no levels."""
    match = re.fullmatch(r"[\s.+>·-]*(\d{1,3})[\s.]*", text)
    if match is None and text and item_role is not Heading.LEVEL:
        words = f"the level “{text}” cannot be read; the row is taken to stand at the top"
        warnings.append(BomWarning(BomCode.FILE, words, line, name))
    return int(match[1]) if match else 1


def doubtful_items(rows: Sequence[BOMEntry]) -> Iterator[BomWarning]:
    """Warn of item numbers that a spreadsheet may have changed.

    A spreadsheet changes 1.10 to 1.1, and 1.2 to the second of January.
    """
    if not any("." in row.item for row in rows):
        return
    first: dict[str, int] = {}
    for row in rows:
        if first.setdefault(row.item, row.line) != row.line and "." in row.item:
            words = (
                f"the item number {row.item} stands in line {first[row.item]} as well (was it 1.10 for 1.1?)"
            )
            yield BomWarning(BomCode.FILE, f"{words}; rows below may belong to either", row.line, row.name)
        elif row.item and not _ITEM.fullmatch(row.item.strip().rstrip(".")):
            words = f"the item number “{row.item}” cannot be read; the row is taken to stand at the top"
            yield BomWarning(BomCode.FILE, words, row.line, row.name)


_ITEM = re.compile(r"\d+(?:\.\d+)*")


def with_structure(rows: Sequence[BOMEntry]) -> tuple[BOMEntry, ...]:
    """Fill in ``parent``, ``level`` and ``has_children`` of the rows.

    Item numbers win over levels. A row whose parent is not in the file (a flattened list, a cut-out) is at
    the top level; no parent is invented for it.
    """
    parents = _by_item(rows) if any("." in row.item for row in rows) else _by_level(rows)
    having = {parent for parent in parents if parent is not None}
    levels: list[int] = []
    for parent in parents:
        levels.append(1 if parent is None else levels[parent] + 1)
    return tuple(
        replace(row, parent=parent, level=level, has_children=index in having)
        for index, (row, parent, level) in enumerate(zip(rows, parents, levels, strict=True))
    )


def _by_item(rows: Sequence[BOMEntry]) -> list[int | None]:
    seen: dict[str, int] = {}
    parents: list[int | None] = []
    for index, row in enumerate(rows):
        item = row.item.strip().rstrip(".")
        parent: int | None = None
        if _ITEM.fullmatch(item):
            head = item.rpartition(".")[0]
            parent = seen.get(head) if head else None
            seen[item] = index
        parents.append(parent)
    return parents


def _by_level(rows: Sequence[BOMEntry]) -> list[int | None]:
    """Find the parent of each row: the last row above it that is one level up (levels may start at 0 or
    1).
    """
    stack: list[tuple[int, int]] = []
    parents: list[int | None] = []
    for index, row in enumerate(rows):
        while stack and stack[-1][0] >= row.level:
            stack.pop()
        parents.append(stack[-1][1] if stack else None)
        stack.append((row.level, index))
    return parents
