# SPDX-License-Identifier: LGPL-2.1-or-later
"""One sheet: what each cell says, and which rows, columns and merged cells there are."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from silo.bom.errors import InputError
from silo.bom.message import message
from silo.workbook import limits


class Cell(NamedTuple):
    """What a cell says.

    text
        a number in full, with a decimal point and what its format writes around it ("12.5 g"); a date as in
        ISO 8601; an error by its name; a formula without a value as "=…".
    struck
        True if a part of the text is struck out.
    uncalculated
        True for a formula without a value.
    number
        True if the cell holds a number: its text has a decimal point, whatever the sheet's language is.
    """

    text: str
    struck: bool = False
    uncalculated: bool = False
    number: bool = False


class SheetRow(NamedTuple):
    """Cells of one record and the line of the file that it begins on (1 = first).

    numbers
        indices of the cells that a workbook holds as numbers.
    """

    line: int
    cells: tuple[str, ...]
    numbers: frozenset[int] = frozenset()


@dataclass(eq=False)
class Grid:
    """One sheet. Rows and columns count from 0.

    merged
        (top, left, bottom, right) of each merged range, ends included.
    """

    name: str
    visible: bool = True
    cells: dict[tuple[int, int], Cell] = field(default_factory=dict)
    hidden_rows: set[int] = field(default_factory=set)
    hidden_columns: set[int] = field(default_factory=set)
    merged: list[tuple[int, int, int, int]] = field(default_factory=list)

    def put(self, row: int, column: int, cell: Cell) -> None:
        """Set a cell that is not empty. InputError if the sheet has more cells than a BOM can have."""
        if cell.text:
            self.cells[row, column] = cell._replace(text="\n".join(cell.text.splitlines()))
            if len(self.cells) > limits.MOST_CELLS:
                raise InputError(
                    message(
                        "sheet “{name}” has more than {most_cells} cells, too many for a BOM",
                        name=self.name,
                        most_cells=limits.MOST_CELLS,
                    )
                )

    def covered(self) -> set[tuple[int, int]]:
        """Return the cells with text under a merged cell, where no program shows it."""
        covered_cells: set[tuple[int, int]] = set()
        effort = 0
        for top, left, bottom, right in self.merged:
            size = (bottom - top + 1) * (right - left + 1)
            effort += min(size, len(self.cells))
            if effort > 10 * limits.MOST_CELLS:
                raise InputError(message("sheet “{name}” has merged cells that overlap", name=self.name))
            inside = ((row, column) for row in range(top, bottom + 1) for column in range(left, right + 1))
            for row, column in inside if size < len(self.cells) else self.cells:
                if top <= row <= bottom and left <= column <= right and (row, column) != (top, left):
                    covered_cells.add((row, column))
        return covered_cells & self.cells.keys()

    def rows(self) -> list[SheetRow]:
        """Return the rows that are not empty, each up to its last cell with text."""
        by_row: dict[int, dict[int, str]] = {}
        numbers: dict[int, set[int]] = {}
        covered = self.covered()
        for (row, column), cell in sorted(self.cells.items()):
            if (row, column) not in covered:
                by_row.setdefault(row, {})[column] = cell.text
                if cell.number:
                    numbers.setdefault(row, set()).add(column)
        if sum(map(max, by_row.values())) > 10 * limits.MOST_CELLS:
            raise InputError(
                message("sheet “{name}” is too wide; delete the cells outside of the table", name=self.name)
            )
        return [
            SheetRow(
                row + 1,
                tuple(cells.get(column, "") for column in range(max(cells) + 1)),
                frozenset(numbers.get(row, ())),
            )
            for row, cells in by_row.items()
        ]
