# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which row is part of which: from item numbers ("1.1.2") or a level column. Pure."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from silo.inertia.bom.rows import BOMEntry

_ITEM = re.compile(r"\d+(?:\.\d+)*")


def with_structure(rows: Sequence[BOMEntry]) -> tuple[BOMEntry, ...]:
    """The rows with ``parent``, ``level`` and ``has_children`` filled in.

    Item numbers win over levels. A row whose parent is not in the file (a flattened list, a cut-out) stands
    at the top: nothing is invented for it.
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
    """A row's parent is the last row above it that is one level up (levels may start at 0 or 1)."""
    stack: list[tuple[int, int]] = []
    parents: list[int | None] = []
    for index, row in enumerate(rows):
        while stack and stack[-1][0] >= row.level:
            stack.pop()
        parents.append(stack[-1][1] if stack else None)
        stack.append((row.level, index))
    return parents
