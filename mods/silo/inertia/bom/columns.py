# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which column of a BOM holds what a mass needs: by :mod:`silo.bom.headers`, by the user's word.

Masses need more than an alias: their headers state units and say whether they are of one piece or of all.
"""

from __future__ import annotations

import re
import sys
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from silo.bom.errors import InputError
from silo.bom.headers import BRACKET, Role, alias, normal
from silo.inertia.bom.masses import unit_factor

ROLES = (
    *(Role.NAME, Role.PART_NUMBER, Role.DESCRIPTION, Role.MATERIAL, Role.MASS, Role.TOTAL_MASS),
    *(Role.QUANTITY, Role.ITEM, Role.LEVEL, Role.FIND_NUMBER),
)
"""What a mass calculation reads of a BOM."""


@dataclass(frozen=True, slots=True)
class Columns:
    """Where each role is (column index), and the units that the headers of the mass columns state.

    others
        columns that mean a mass or a material as well, and lost to the one that is used.
    exact
        masses are written in full (Silo's own export does so): a short one was not rounded.
    """

    at: Mapping[Role, int]
    units: Mapping[Role, str] = field(default_factory=dict)
    others: tuple[tuple[Role, int], ...] = ()
    exact: bool = False

    def cell(self, row: Sequence[str], role: Role) -> str:
        """The row's cell for a role; "" where there is no such column or the row is too short.

        An apostrophe that keeps a spreadsheet from running the cell as a formula is no part of it.
        """
        index = self.at.get(role)
        text = row[index].strip() if index is not None and index < len(row) else ""
        return text[1:] if re.match(r"'[=+\-@]", text) else text

    @property
    def usable(self) -> bool:
        """True where rows can be told apart: by name, part number or description."""
        return bool({Role.NAME, Role.PART_NUMBER, Role.DESCRIPTION} & self.at.keys())


_TOTAL_WORDS = frozenset(
    {"total", "totale", "gesamt", "summe", "sum", "extended", "ext", "row", "line", "zeile"}
)
_MASSES = (Role.MASS, Role.TOTAL_MASS)
_ONE_ONLY = (*_MASSES, Role.MATERIAL)
_SILOS_OWN = {"part number", "total quantity", "unreferenced since"}


def find_columns(header: Sequence[str], given: Mapping[str, str] | None = None) -> Columns:
    """Roles of a header line. ``given``: role → header text, from the user; it wins over every alias.

    A role found twice goes to the column whose name fits best, then to the first. Raises
    InputError for a role that does not exist.
    """
    wanted = _given_roles(given or {})
    at: dict[Role, int] = {}
    for role, text in wanted.items():
        place = next((i for i, cell in enumerate(header) if normal(cell) == normal(text)), None)
        if place is not None:
            at[role] = place
    taken = set(at.values())
    best: dict[Role, int] = {}
    seen: list[tuple[Role, int]] = []
    for index, cell in enumerate(header):
        found = _role_of(cell)
        if found is None or index in taken or found[0] in wanted:
            continue
        role, rank = found
        seen.append((role, index))
        if rank < best.get(role, sys.maxsize):
            at[role], best[role] = index, rank
    units = {role: unit for role in _MASSES if role in at and (unit := _unit_of(header[at[role]]))}
    others = tuple((role, i) for role, i in seen if role in _ONE_ONLY and at[role] != i)
    exact = {normal(cell) for cell in header} >= _SILOS_OWN
    return Columns(at, units, others, exact)


def _given_roles(given: Mapping[str, str]) -> dict[Role, str]:
    known = {role.value for role in ROLES}
    unknown = sorted(set(given) - known)
    if unknown:
        raise InputError(
            f"unknown column role {', '.join(unknown)}; the roles are {', '.join(sorted(known))}"
        )
    return {Role(role): text for role, text in given.items()}


def _role_of(cell: str) -> tuple[Role, int] | None:
    """Role and rank of one header cell: "Mass", "Mass (g)", "mass_kg", "Gewicht in kg"."""
    text = normal(cell)
    found = _alias(text)
    if found is not None and found[0] is Role.MASS and _says_total(cell):
        return Role.TOTAL_MASS, found[1]
    if found is None and _says_total(cell):
        # "Weight, total kg", "Summe Masse": what is left without the word is a mass or nothing.
        rest = _alias(" ".join(word for word in text.split() if word not in _TOTAL_WORDS))
        return (Role.TOTAL_MASS, rest[1]) if rest is not None and rest[0] is Role.MASS else None
    return found


def _says_total(cell: str) -> bool:
    text = unicodedata.normalize("NFKC", cell).casefold()
    return bool(_TOTAL_WORDS & set(re.findall(r"[^\W_]+", text))) or "合計" in text


def _alias(text: str) -> tuple[Role, int] | None:
    found = alias(text)
    if found is not None:
        return found if found[0] in ROLES else None
    stem, _, unit = text.rpartition(" ")
    found = alias(stem.removesuffix(" in"))
    if found and found[0] in (Role.MASS, Role.TOTAL_MASS) and unit_factor(unit) is not None:
        return found
    return None


def _unit_of(cell: str) -> str | None:
    """The unit a mass column's header states, in brackets or as its last word."""
    bracket = BRACKET.search(unicodedata.normalize("NFKC", cell))
    if bracket and unit_factor(bracket[1]) is not None:
        return bracket[1].strip()
    words = normal(cell).split()
    return words[-1] if len(words) > 1 and unit_factor(words[-1]) is not None else None
