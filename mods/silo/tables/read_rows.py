# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is read from a table: its rows, and what a user must know of the reading."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Generic, TypeVar

from silo.tables.sheet import Sheet

Row = TypeVar("Row")


# Without slots: ``ReadRows[PartRow](())`` would fail, for Python then tries to set an attribute of it.
@dataclass(frozen=True)
class ReadRows(Generic[Row]):
    """The rows of a table; the titles of the columns that are not used; what was assumed to read it."""

    rows: tuple[Row, ...]
    unused: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def rows_of(sheet: Sheet, rows: Iterable[Row]) -> ReadRows[Row]:
    """Put the rows that were read from a sheet with what the sheet says of its reading."""
    return ReadRows(tuple(rows), tuple(sheet.unused), sheet.notes)
