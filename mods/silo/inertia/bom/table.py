# SPDX-License-Identifier: LGPL-2.1-or-later
"""A BOM as it was read: the table that keeps every row, its entries, and the warnings about it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum

from silo.bom.message import message


class BomCode(StrEnum):
    """The machine names of what reading a BOM noticed."""

    FILE = "bom_file"  # how the file had to be read
    NO_NAME = "bom_row_without_name"
    LEFT_OUT = "bom_row_left_out"  # a sum, or a part that is not fitted
    ROW_LENGTH = "bom_row_length"
    DUPLICATE_NAME = "bom_duplicate_name"
    UNREADABLE_MASS = "bom_mass_unreadable"
    AMBIGUOUS_MASS = "bom_mass_ambiguous"
    MASS_WITHOUT_UNIT = "bom_mass_without_unit"
    UNREADABLE_QUANTITY = "bom_quantity_unreadable"
    TOTAL_DIFFERS = "bom_total_differs"
    MISSING_COLUMN = "bom_missing_column"
    UNUSED_COLUMN = "bom_column_unused"  # that may hold masses


@dataclass(frozen=True)
class BomWarning:
    """One finding about the BOM; ``line`` of the file (1 = first), 0 if it is about no single line."""

    code: BomCode
    message: str
    line: int = 0
    name: str = ""

    def __str__(self) -> str:
        return (
            message("line {line}: {message}", line=self.line, message=self.message)
            if self.line
            else self.message
        )


@dataclass(frozen=True)
class BOMEntry:
    """One row of a BOM (spec bom-inertia, Task 1: ``name``, ``material``, ``mass_kg``; the rest is ours).

    name
        as written, stripped.
    material
        None if none is assigned.
    mass_kg
        mass of ONE piece [kg], None if the BOM has none.
    quantity
        pieces per one parent; None if the file does not say or cannot be read.
    quantum_kg
        half of the last digit the file shows: the mass is ``mass_kg`` ± this.
    overridden, unsure
        the mass is marked as set by hand; it could be read two ways.
    item, level, parent, has_children
        structure: the item number ("1.1.2"), nesting depth (1 = top), index of the parent row in the table's
        ``rows`` (None at the top), and whether rows hang below this one (a sub-assembly).
    line
        of the file, for people; not part of equality.
    """

    name: str
    material: str | None
    mass_kg: float | None
    part_number: str = ""
    quantity: float | None = None
    quantum_kg: float = 0.0
    overridden: bool = False
    unsure: bool = False
    item: str = ""
    level: int = 1
    parent: int | None = None
    has_children: bool = False
    line: int = field(default=0, compare=False)

    @property
    def has_mass(self) -> bool:
        """Return True if the BOM gives a mass; 0 kg is one."""
        return self.mass_kg is not None

    @property
    def has_material(self) -> bool:
        """Return True if a material is assigned."""
        return self.material is not None

    @property
    def data(self) -> tuple[str | None, float | None]:
        """Return the values that decide a mass; rows with equal values need not be distinguished."""
        return (self.material, self.mass_kg)


class BomTable(Mapping[str, BOMEntry]):
    """All rows of a BOM; as a mapping, name → entry.

    Under a name that several rows share, the mapping gives the *first* row, and ``warnings`` says so with
    the lines. Calculations use ``rows``, never the mapping.
    """

    def __init__(
        self, rows: tuple[BOMEntry, ...], warnings: tuple[BomWarning, ...] = (), source: str = ""
    ) -> None:
        self.rows = rows
        self.warnings = warnings
        self.source = source
        self._first: dict[str, BOMEntry] = {}
        for row in rows:
            self._first.setdefault(row.name, row)

    def __getitem__(self, name: str) -> BOMEntry:
        return self._first[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._first)

    def __len__(self) -> int:
        return len(self._first)

    def __repr__(self) -> str:
        return f"BomTable({len(self.rows)} rows, {len(self)} names, {len(self.warnings)} warnings)"

    def total_quantity(self, row: BOMEntry) -> float | None:
        """Return the pieces in the whole product: the row's quantity times that of every parent; None if one
        is unknown.
        """
        total = 1.0
        for entry in (row, *self.ancestors(row)):
            if entry.quantity is None:
                return None
            total *= entry.quantity
        return total

    def ancestors(self, row: BOMEntry) -> tuple[BOMEntry, ...]:
        """Return the rows above in the structure, the nearest first."""
        entries: list[BOMEntry] = []
        parent = row.parent
        while parent is not None:
            entries.append(self.rows[parent])
            parent = self.rows[parent].parent
        return tuple(entries)


def as_table(entries: Mapping[str, BOMEntry]) -> BomTable:
    """Make a table of any mapping name → entry; a table is returned unchanged."""
    if isinstance(entries, BomTable):
        return entries
    return BomTable(tuple(replace(entry, name=name) for name, entry in entries.items()))
