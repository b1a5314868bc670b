# SPDX-License-Identifier: LGPL-2.1-or-later
"""The table of a mass calculation: what its columns mean, by :mod:`silo.bom.headers` and by their mass
headers.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass

from silo.bom.headers import Heading, alias, normal
from silo.bom.message import message
from silo.inertia.bom.mass_header import MassHeader, read_mass_header
from silo.tables.columns import Columns
from silo.tables.kind import TableKind
from silo.tables.sheet import Sheet
from silo.workbook.sheet import SheetRow

ROLES = (
    *(
        Heading.NAME,
        Heading.PART_NUMBER,
        Heading.DESCRIPTION,
        Heading.MATERIAL,
        Heading.MASS,
        Heading.TOTAL_MASS,
    ),
    *(
        Heading.QUANTITY,
        Heading.ITEM,
        Heading.LEVEL,
        Heading.FIND_NUMBER,
        Heading.MASS_UNIT,
        Heading.UNIT,
        Heading.NOT_FITTED,
        Heading.FITTED,
    ),
)
"""What a mass calculation reads of a BOM."""

MASS_COLUMNS = (Heading.MASS, Heading.TOTAL_MASS)

_ONE_ONLY = (*MASS_COLUMNS, Heading.MATERIAL, Heading.QUANTITY)

NAMING = (Heading.NAME, Heading.PART_NUMBER, Heading.DESCRIPTION)

_SILOS_OWN = {"part number", "total quantity", "unreferenced since"}


@dataclass(frozen=True, slots=True)
class MassColumns:
    """What the headings of the mass columns say.

    masses
        role → its header.
    unused
        columns that may hold masses by their headers, and whose role is unknown.
    exact
        masses are written in full (Silo's own export does so): a short one was not rounded.
    """

    masses: Mapping[str, MassHeader]
    unused: tuple[int, ...]
    exact: bool


def mass_columns(sheet: Sheet) -> MassColumns:
    """Read the headings of a table's mass columns."""
    at = sheet.columns.at
    masses = {str(role): read_mass_header(sheet.header[at[role]]) for role in MASS_COLUMNS if role in at}
    unused = tuple(
        index
        for index, cell in enumerate(sheet.header)
        if index not in at.values() and _role_of(cell) is None and read_mass_header(cell).names_masses
    )
    return MassColumns(masses, unused, {*map(normal, sheet.header)} >= _SILOS_OWN)


def continues(header: SheetRow, columns: Columns, below: SheetRow) -> bool:
    """Return True if the line below a heading is its second one: it names no part, and units of masses."""
    if any(columns.cell(below.cells, role) for role in NAMING):
        return False
    if any(letter.isdigit() for cell in below.cells for letter in cell):
        return False
    places = [columns.at[role] for role in MASS_COLUMNS if role in columns.at]
    read = [
        read_mass_header(message("mass ({cell})", cell=cell.strip("[](){} ")))
        for place in places
        for cell in below.cells[place : place + 1]
        if any(map(str.isalpha, cell))
    ]
    return bool(read) and not any(mass_header.strange or mass_header.rate for mass_header in read)


def _role_of(cell: str) -> tuple[Heading, int] | None:
    """Find the role and rank of a header: "Mass", "Mass (g)", "mass_kg", "Gewicht in kg", "Summe Masse"."""
    role = alias(normal(cell.replace("/", " per ")))  # "Mass/unit" is no unit of a mass
    if role is not None and role[0] not in MASS_COLUMNS:
        return role if role[0] in ROLES else None
    header = read_mass_header(cell)
    if header.unit and not header.title and (role is None):
        role = Heading.MASS, sys.maxsize - 1  # "kg", "[g/pc]", "Total kg"
    role = role or alias(header.title)
    if role is None or role[0] not in MASS_COLUMNS or header.rate:
        return None
    return (Heading.TOTAL_MASS, role[1]) if header.total else role


MASSES = TableKind(roles=ROLES, naming=NAMING, single=_ONE_ONLY, role_of=_role_of, any_name=True)
"""The table of a mass calculation."""
