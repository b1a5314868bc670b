# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which column of a BOM holds what a mass needs: by :mod:`silo.bom.headers`, by the user's word.

Masses need more than an alias: their headers state units and say whether they are of one piece or of all.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from silo.bom.errors import InputError
from silo.bom.headers import Role, alias, normal, plain_cell
from silo.bom.numbers import plain_text
from silo.inertia.bom.masses import unit_factor

_TOTAL = {
    "total", "totale", "totales", "totals", "gesamt", "ges", "insgesamt", "summe", "sum", "somme", "suma",
    "somma", "extended", "ext", "row", "line", "zeile", "all", "alle", "tous", "todos", "tutti", "qty",
    "quantity", "count", "menge", "anzahl", "stückzahl", "quantité", "cantidad", "quantità", "lot", "batch",
    "set", "group", "subtotal", "cumulative", "rolled", "rollup", "rolledup", "σ", "∑", "合計", "小計", "总",
    "合计", "總",
}  # fmt: skip
_EACH = {
    "each", "ea", "unit", "units", "piece", "pieces", "pc", "pcs", "part", "item", "one", "single", "1",
    "einzel", "einzeln", "stück", "stk", "st", "teil", "pièce", "unité", "unitaire", "pieza", "unidad",
    "unitaria", "unitario", "pezzo", "unità", "個", "单件", "単体", "件",
}  # fmt: skip
_FILLERS = {"x", "×", "per", "pro", "par", "por", "je", "in", "en", "for", "für", "of", "the", "a"}

_WORD = re.compile(r"/|[^\W_]+|[×∑]")
_BRACKETS = re.compile(r"[\(\[（【<]([^)\]）】>]*)[\)\]）】>]")


@dataclass(frozen=True, slots=True)
class MassHeader:
    """A mass column's header.

    title
        the words that remain: "mass" of "Mass (each) [g]".
    unit
        of its cells, "" where it states none.
    total
        True where a cell is the mass of the whole row.
    strange
        what stands in brackets and is not understood.
    rate
        True where a cell is no mass: "kg/m", "g/cm3".
    """

    title: str
    unit: str = ""
    total: bool = False
    strange: str = ""
    rate: bool = False


def read_mass_header(cell: str) -> MassHeader:
    """Take a header apart; for any text, also one that is no mass column's."""
    text = plain_text(cell)
    unit, strange, total, each, rate = "", [], False, False, False
    for bracket in _BRACKETS.findall(text):
        found = _inside(bracket)
        unit = unit or found.unit
        total, each, rate = total or found.total, each or found.each, rate or found.rate
        if found.strange:
            strange.append(bracket.strip())
    kept: list[str] = []
    for word in _WORD.findall(_BRACKETS.sub(" ", text)):
        low = word.casefold()
        if low in _TOTAL:
            total = True
        elif low in _EACH:
            each = True
        elif kept and not unit and unit_factor(word) is not None:
            unit = word  # "mass_kg", "Gewicht in kg"; never the first word
        elif low not in _FILLERS or not kept:
            kept.append(low)
    # "Mass (unit) × qty" is the row's: each says what is multiplied.
    return MassHeader(" ".join(kept), unit, total, ", ".join(strange), rate)


@dataclass(frozen=True, slots=True)
class _Bracket:
    unit: str = ""
    total: bool = False
    each: bool = False
    strange: bool = False
    rate: bool = False


def _inside(text: str) -> _Bracket:
    if unit_factor(text.strip().rstrip(".")) is not None:
        return _Bracket(unit=text.strip().rstrip("."))
    unit, total, each, strange, rate, over = "", False, False, False, False, False
    for word in _WORD.findall(text):
        low = word.casefold()
        if low in ("/", "per", "pro", "par", "por", "je"):
            over = True
        elif low in _EACH:
            each = True
        elif over:
            # "g/pc" was left above; what else stands below the line makes a rate: kg/m, g/cm3.
            rate = rate or bool(unit)
            strange = strange or not unit
        elif low in _TOTAL:
            total = True
        elif not unit and unit_factor(word) is not None:
            unit = word
        elif low not in _FILLERS:
            strange = True
    return _Bracket(unit, total, each, strange, rate)


ROLES = (
    *(Role.NAME, Role.PART_NUMBER, Role.DESCRIPTION, Role.MATERIAL, Role.MASS, Role.TOTAL_MASS),
    *(Role.QUANTITY, Role.ITEM, Role.LEVEL, Role.FIND_NUMBER),
)
"""What a mass calculation reads of a BOM."""


@dataclass(frozen=True, slots=True)
class Columns:
    """Where each role is (column index), and the units that the headers of the mass columns state.

    others
        columns that mean a quantity, a mass or a material as well, and lost to the one that is used.
    exact
        masses are written in full (Silo's own export does so): a short one was not rounded.
    strange
        what the header of a mass column says in brackets and is not understood.
    """

    at: Mapping[Role, int]
    units: Mapping[Role, str] = field(default_factory=dict)
    others: tuple[tuple[Role, int], ...] = ()
    exact: bool = False
    strange: Mapping[Role, str] = field(default_factory=dict)

    def cell(self, row: Sequence[str], role: Role) -> str:
        """The row's cell for a role; "" where there is no such column or the row is too short.

        An apostrophe that keeps a spreadsheet from running the cell as a formula is no part of it.
        """
        index = self.at.get(role)
        text = row[index].strip() if index is not None and index < len(row) else ""
        return plain_cell(text)

    @property
    def usable(self) -> bool:
        """True where rows can be distinguished: by name, part number or description."""
        return bool({Role.NAME, Role.PART_NUMBER, Role.DESCRIPTION} & self.at.keys())


_MASSES = (Role.MASS, Role.TOTAL_MASS)
_ONE_ONLY = (*_MASSES, Role.MATERIAL, Role.QUANTITY)
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
    masses = {role: read_mass_header(header[at[role]]) for role in _MASSES if role in at}
    units = {role: mass.unit for role, mass in masses.items() if mass.unit}
    strange = {role: mass.strange for role, mass in masses.items() if mass.strange}
    others = tuple((role, i) for role, i in seen if role in _ONE_ONLY and at[role] != i)
    exact = {normal(cell) for cell in header} >= _SILOS_OWN
    return Columns(at, units, others, exact, strange)


def _given_roles(given: Mapping[str, str]) -> dict[Role, str]:
    known = {role.value for role in ROLES}
    unknown = sorted(set(given) - known)
    if unknown:
        raise InputError(
            f"unknown column role {', '.join(unknown)}; the roles are {', '.join(sorted(known))}"
        )
    return {Role(role): text for role, text in given.items()}


def _role_of(cell: str) -> tuple[Role, int] | None:
    """Role and rank of one header cell: "Mass", "Mass (g)", "mass_kg", "Gewicht in kg", "Summe Masse"."""
    found = alias(normal(cell))
    if found is not None and found[0] is not Role.MASS:
        return found if found[0] in ROLES else None
    header = read_mass_header(cell)
    found = found or alias(header.title)
    if found is None or found[0] not in _MASSES or header.rate:
        return None
    return (Role.TOTAL_MASS, found[1]) if header.total else found
