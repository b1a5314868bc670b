# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which row of a table stands below which: by position numbers, by levels, or by indented names.

Position numbers (1, 1.1, 2) win over levels (1, 2, 2; ".1", "..2"; 01; 1.0), levels over indents. No parent
is invented: a position without the row above it, a level that jumps down by two and a text that is no level
are problems.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from silo.bom.message import message

_DOTTED = re.compile(r"\d{1,6}(?:[.,]\d{1,6}){1,30}")
_POSITION = re.compile(r"\d{1,6}(?:\.\d{1,6}){0,30}")
_LEVEL = re.compile(r"[\s.+>·_|\-]{0,60}(\d{1,3})(?:[.,]0{1,3})?[\s.]{0,60}")
_DOTS = re.compile(r"([.+>·|\-])\1{0,60}")


@dataclass(frozen=True, slots=True)
class RowTree:
    """The tree of a table's rows.

    parents
        index of the row above each row, None at the top.
    by
        what shows it: "position", "level", "indent", or "" for a flat table.
    problems
        index of a row → what is wrong with its place.
    """

    parents: tuple[int | None, ...]
    by: str = ""
    problems: Mapping[int, str] = field(default_factory=dict)

    @property
    def depths(self) -> tuple[int, ...]:
        """Return how many rows stand above each row."""
        depths: list[int] = []
        for parent in self.parents:
            depths.append(0 if parent is None else depths[parent] + 1)
        return tuple(depths)


def is_position_column(cells: Sequence[str]) -> bool:
    """Return True if a column has positions such as 1.1; "1.0" in all cells is a spreadsheet's 1."""
    dotted = [cell for cell in map(str.strip, cells) if _DOTTED.fullmatch(cell.rstrip("."))]
    return any(not re.fullmatch(r"\d+[.,]0+", cell) for cell in dotted)


def position(text: str) -> str:
    """Return a position number in its one form: "1,1." is 1.1, and 1.0 is 1; "" for another text."""
    plain = text.strip().rstrip(".").replace(",", ".")
    if not _POSITION.fullmatch(plain):
        return ""
    return re.sub(r"(?:\.0{1,6}){1,31}$", "", plain)


def level(text: str) -> int | None:
    """Read a level: 2, 02, 2.0, ".2", "..2", "+2" and two dots are 2; None for another text."""
    bare = text.strip()
    match = _LEVEL.fullmatch(bare)
    if match is not None:
        return int(match[1])
    return len(bare) if _DOTS.fullmatch(bare) else None


def by_positions(positions: Sequence[str]) -> RowTree:
    """Find the tree of rows with position numbers (:func:`position`)."""
    seen: dict[str, int] = {}
    parents: list[int | None] = []
    problems: dict[int, str] = {}
    for index, text in enumerate(positions):
        head = text.rpartition(".")[0]
        parent = seen.get(head) if head else None
        parents.append(parent)
        if head and parent is None:
            problems[index] = message("the position {text} has no row {head} above it", text=text, head=head)
        elif text and text in seen:
            problems[index] = message(
                "the position {text} stands here twice; a spreadsheet makes 1.1 of 1.10", text=text
            )
        elif not text:
            problems[index] = message("the row has no position number that can be read")
        if text:
            seen[text] = index
    return RowTree(tuple(parents), "position", problems)


def by_levels(levels: Sequence[int | None]) -> RowTree:
    """Find the tree of rows with levels, which may start at 0 or 1."""
    known = [value for value in levels if value is not None]
    top = min(known, default=1)
    stack: list[tuple[int, int]] = []
    parents: list[int | None] = []
    problems: dict[int, str] = {}
    for index, value in enumerate(levels):
        here = top if value is None else value
        if value is None:
            problems[index] = message("the row has no level that can be read")
        while stack and stack[-1][0] >= here:
            stack.pop()
        above = stack[-1][0] if stack else top - 1
        if here > above + 1:
            problems.setdefault(
                index,
                message(
                    "the level {here} follows on {above}",
                    here=here,
                    above=above if stack else message("no row"),
                ),
            )
        parents.append(stack[-1][1] if stack else None)
        stack.append((here, index))
    return RowTree(tuple(parents), "level", problems)


def indent_levels(cells: Sequence[str]) -> list[int] | None:
    """Return the levels that the spaces before the names show; None if they show none.

    A step is two spaces or more, and there are never two steps down at once: a single wrong space makes no
    sub-assembly.
    """
    depths = [_indent(cell) for cell in cells]
    step = min(filter(None, depths), default=0)
    levels = [depth // step if step else 0 for depth in depths]
    deeper = any(below > above + 1 for above, below in pairwise([-1, *levels]))
    if step < 2 or deeper or any(depth % step for depth in depths):
        return None
    return levels


def _indent(cell: str) -> int:
    text = cell.expandtabs(4)
    return len(text) - len(text.lstrip())


def flat(count: int) -> RowTree:
    """Return the structure of a table of one level."""
    return RowTree((None,) * count)
