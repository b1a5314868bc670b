# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a workbook shows beside its cells: merged cells, hidden and struck-out lines, formulas without a
value.

The text of a merged cell stands in all of its lines. A number in a merged cell may belong to all lines
together, so only the first line has it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from silo.bom.errors import counted, listed
from silo.bom.message import message
from silo.workbook.sheet import Grid, SheetRow

_NUMBER = re.compile(r"[\s+\-−~(]{0,40}[\d.,]")


@dataclass(frozen=True, slots=True)
class AsShown:
    """The records with the texts of merged cells; the lines (1 = first) that are hidden or struck out; what
    a user must know.
    """

    records: list[SheetRow]
    hidden: tuple[int, ...]
    struck: tuple[int, ...]
    notes: tuple[str, ...]


def as_shown(records: Sequence[SheetRow], grid: Grid, header: SheetRow, used: Sequence[int]) -> AsShown:
    """Read what the program shows of the columns that are ``used``."""
    made = list(records)
    facts = {
        place: cell for place, cell in grid.cells.items() if place[0] + 1 > header.line and place[1] in used
    }
    covered = sorted(grid.covered() & facts.keys())
    at = {row.line: index for index, row in enumerate(made)}
    texts, numbers = [], []
    for top, column, bottom, _ in sorted(grid.merged):
        cell = facts.get((top, column))
        if cell is None or bottom == top:
            continue
        what = message(
            "“{text}” in lines {top} to {bottom}", text=cell.text.strip(), top=top + 1, bottom=bottom + 1
        )
        if _NUMBER.match(cell.text):
            numbers.append(what)
            continue
        texts.append(what)
        for index in range(at[top + 1] + 1, len(made)):
            row = made[index]
            if row.line > bottom + 1:
                break
            cells = [*row.cells, *[""] * (column + 1 - len(row.cells))]
            cells[column] = cell.text
            made[index] = row._replace(cells=tuple(cells))
    hidden = sorted({row for row, _ in grid.cells if row in grid.hidden_rows})
    struck = sorted({row for (row, _), cell in facts.items() if cell.struck})
    uncalculated = sum(cell.uncalculated for cell in grid.cells.values())
    hidden_columns = [header.cells[column].strip() for column in used if column in grid.hidden_columns]
    under = [
        message("“{text}” in line {place}", text=facts[place].text.strip(), place=place[0] + 1)
        for place in covered
    ]
    like_others = "in the workbook; {} read like all others"
    notes = {
        f"{counted(uncalculated, 'formula')} without a value; "
        "open and save the workbook in a program that calculates them": uncalculated,
        f"{_lines(hidden)} hidden {like_others.format('hidden lines are')}": hidden,
        f"{_columns(hidden_columns)} hidden {like_others.format('hidden columns are')}": hidden_columns,
        f"{_lines(struck, 'has', 'have')} struck-out text {like_others.format('it is')}": struck,
        f"merged cells: {listed(texts)}; each of these lines was given the text": texts,
        f"merged cells: {listed(numbers)}; only the first of these lines has the number": numbers,
        f"under merged cells, where no program shows it: {listed(under)}; it is not used": under,
    }
    return AsShown(
        made,
        tuple(row + 1 for row in hidden),
        tuple(row + 1 for row in struck),
        tuple(note for note, there in notes.items() if there),
    )


def _lines(rows: Sequence[int], text: str = "is", many: str = "are") -> str:
    numbers = listed([str(row + 1) for row in rows], 8)
    return (
        message("lines {numbers} {many}", numbers=numbers, many=many)
        if len(rows) > 1
        else message("line {numbers} {text}", numbers=numbers, text=text)
    )


def _columns(names: Sequence[str]) -> str:
    shown = listed([f"“{name}”" for name in names], 8)
    return (
        message("the columns {shown} are", shown=shown)
        if len(names) > 1
        else message("the column {shown} is", shown=shown)
    )
