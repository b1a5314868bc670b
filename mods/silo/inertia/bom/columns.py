# SPDX-License-Identifier: LGPL-2.1-or-later
"""The role of each column of a BOM: by :mod:`silo.bom.headers`, by its mass header, or by the user's word."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from silo.bom.errors import InputError
from silo.bom.headers import Heading, alias, normal, plain_cell
from silo.inertia.bom.mass_header import MassHeader, read_mass_header

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
    ),
)
"""What a mass calculation reads of a BOM."""

MASS_COLUMNS = (Heading.MASS, Heading.TOTAL_MASS)

_ONE_ONLY = (*MASS_COLUMNS, Heading.MATERIAL, Heading.QUANTITY)

NAMING = (Heading.NAME, Heading.PART_NUMBER, Heading.DESCRIPTION)

_SILOS_OWN = {"part number", "total quantity", "unreferenced since"}


@dataclass(frozen=True, slots=True)
class Columns:
    """Where each role is (column index), and what the headers of the mass columns say.

    others
        columns that mean a quantity, a mass or a material as well, and lost to the one that is used.
    unused
        columns that may hold masses by their headers, and whose role nobody knows.
    exact
        masses are written in full (Silo's own export does so): a short one was not rounded.
    """

    at: Mapping[Heading, int]
    masses: Mapping[Heading, MassHeader]
    others: tuple[tuple[Heading, int], ...]
    unused: tuple[int, ...]
    exact: bool

    def cell(self, row: Sequence[str], role: Heading) -> str:
        """Return the row's cell for a role; "" if there is no such column or the row is too short.

        An apostrophe that keeps a spreadsheet from running the cell as a formula is no part of it.
        """
        index = self.at.get(role)
        return plain_cell(row[index].strip()) if index is not None and index < len(row) else ""

    @property
    def usable(self) -> bool:
        """Return True if rows can be distinguished: by name, part number or description."""
        return not self.at.keys().isdisjoint(NAMING)


def find_columns(header: Sequence[str], given: Mapping[str, str] | None = None) -> Columns:
    """Find the roles of a header line. ``given``: role → header text, from the user; it wins over aliases.

    If two columns fit a role, the column whose name fits better gets it, then the first. Raises InputError
    for a role that does not exist.
    """
    unknown = sorted((given or {}).keys() - ROLES)
    if unknown:
        raise InputError(
            f"unknown column role {', '.join(unknown)}; the roles are {', '.join(sorted(ROLES))}"
        )
    wanted = {Heading(role): normal(text) for role, text in (given or {}).items()}
    plain = [normal(cell) for cell in header]
    at = {role: plain.index(text) for role, text in wanted.items() if text in plain}
    taken = set(at.values())
    best: dict[Heading, int] = {}
    seen: list[tuple[Heading, int]] = []
    unused: list[int] = []
    for index, cell in enumerate(header):
        role_here = _role_of(cell)
        if index in taken:
            continue
        if role_here is None:
            if read_mass_header(cell).names_masses:
                unused.append(index)
        elif role_here[0] not in wanted:
            role, rank = role_here
            seen.append((role, index))
            if rank < best.get(role, sys.maxsize):
                at[role], best[role] = index, rank
    masses = {role: read_mass_header(header[at[role]]) for role in MASS_COLUMNS if role in at}
    others = tuple((role, i) for role, i in seen if role in _ONE_ONLY and at[role] != i)
    return Columns(at, masses, others, tuple(unused), set(plain) >= _SILOS_OWN)


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
