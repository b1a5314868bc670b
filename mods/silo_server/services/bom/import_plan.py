# SPDX-License-Identifier: LGPL-2.1-or-later
"""What an import of a BOM would do: each row with its assembly, the lines that the file lacks, what is not
used.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from silo.bom.message import message
from silo_server.services.items import NewItem
from silo_server.values import Line, LineState


@dataclass(frozen=True, slots=True)
class Allowed:
    """What a user allows an import beside changing lines.

    category
        in which unknown parts are made; "": none is made.
    add_up
        rows of one part are added up.
    quantities
        the quantity counts where the reference designators name another number of places.
    remove
        lines that the file does not have are removed.
    leave_out
        rows with problems are left out by name, with what stands below them.
    """

    category: str = ""
    add_up: bool = False
    quantities: bool = False
    remove: bool = False
    leave_out: bool = False


NOTHING = Allowed()


@dataclass(frozen=True, slots=True)
class ImportRow:
    """What becomes of one row of the file. ``status``: add change same skip error.

    parent
        part number of the assembly in whose BOM the line is; "" for a part that has no number yet.
    depth
        how many rows stand above it.
    name
        what the file calls a part that has no number there.
    new
        the part that is made for it.
    why
        why a row is left out.
    could
        what a user may allow instead of a problem: ``make`` the part, ``add_up``, ``quantities``.
    above
        index of the row of its assembly; None for the product itself.
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
    why: str = ""
    parent: str = ""
    depth: int = 0
    above: int | None = None


@dataclass(frozen=True, slots=True)
class MissingLine:
    """A line of Silo that the file does not have, in a BOM of which the file has rows."""

    parent: str
    line: Line


@dataclass(frozen=True, slots=True)
class ImportPlan:
    """What an import would do; ``problems`` are those of all rows.

    unused
        titles of the file's columns that are not used.
    notes
        what was assumed to read the file.
    missing
        the lines that the file does not have; ``removes``: True if they are removed.
    """

    rows: Sequence[ImportRow]
    unused: Sequence[str] = ()
    notes: Sequence[str] = ()
    missing: Sequence[MissingLine] = ()
    removes: bool = False

    @property
    def problems(self) -> list[str]:
        return [
            message("row {row}: {problem}", row=row.row, problem=problem)
            for row in self.rows
            for problem in row.problems
        ]

    @property
    def new(self) -> list[NewItem]:
        """Return the parts that the import makes, each once."""
        return [row.new for row in self.rows if row.new]

    @property
    def removed(self) -> int:
        """Count the lines that the import removes."""
        return len(self.missing) if self.removes else 0

    def count(self, status: str) -> int:
        """Count the rows with this status."""
        return sum(row.status == status for row in self.rows)

    def could(self, what: str) -> int:
        """Count the rows whose problem a user may allow: ``make`` the part, ``add_up``, ``quantities``."""
        return sum(row.could == what for row in self.rows)
