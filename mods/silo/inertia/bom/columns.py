# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which column of a BOM holds what a mass needs: by :mod:`silo.bom.headers`, by the user's word.

Masses need more than an alias: their headers state units and say whether they are of one piece or of all.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from silo.bom.errors import InputError
from silo.bom.headers import Role, alias, normal, plain_cell
from silo.bom.numbers import plain_text
from silo.inertia.bom.masses import unit_factor

_TOTAL = {
    "total", "totale", "totales", "totals", "tot", "gesamt", "ges", "insgesamt", "summe", "sum", "somme",
    "suma", "somma", "extended", "ext", "extd", "row", "line", "zeile", "all", "alle", "tous", "todos",
    "tutti", "qty", "quantity", "count", "menge", "anzahl", "stückzahl", "quantité", "cantidad", "quantità",
    "lot", "batch", "set", "group", "subtotal", "cumulative", "cumulated", "accumulated",
    "aggregate", "overall", "combined", "complete", "rolled", "roll", "up", "rollup", "rolledup", "σ", "∑",
    "合計", "小計", "总", "合计", "總",
}  # fmt: skip
_EACH = {
    "each", "ea", "unit", "units", "piece", "pieces", "pc", "pcs", "part", "item", "one", "single", "1", "1x",
    "einzel", "einzeln", "stück", "stk", "st", "teil", "pièce", "unité", "unitaire", "pieza", "unidad", "ud",
    "unitaria", "unitario", "pezzo", "unità", "個", "单件", "単体", "件", "individual", "component", "body",
    # of one piece as well, by how it was found out
    "net", "netto", "neto", "nominal", "calculated", "calc", "estimated", "measured", "actual", "cad",
}  # fmt: skip
_FILLERS = {"x", "×", "in", "en", "for", "für", "of", "the", "a"}
_OVER = {"/", "per", "pro", "par", "por", "je"}

_WORD = re.compile(r"[/%]|[^\W_]+|[×∑]")
_BRACKETS = re.compile(r"[\(\[（【<{]([^)\]）】>}]*)[\)\]）】>}]")
_CAMEL = re.compile(r"(?<=[a-z])(?=[A-Z][a-z])|(?<=[Σ∑])(?=\w)")
_ASSEMBLY = {"assembly", "assy", "baugruppe", "robot", "machine"}


@dataclass(slots=True)
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
        True where a cell is no mass: "kg/m", "g/cm3", "%", "10^3 kg".
    pieces
        how many pieces a cell is the mass of: 100 for "kg/100 pcs".
    """

    title: str = ""
    unit: str = ""
    total: bool = False
    strange: str = ""
    rate: bool = False
    pieces: int = 1


def read_mass_header(cell: str) -> MassHeader:
    """Take a header apart; for any text, also one that is no mass column's."""
    text = plain_text(cell)
    header = MassHeader()
    for bracket in _BRACKETS.findall(text):
        plain = bracket.strip().rstrip(".")
        if not header.unit and unit_factor(plain) is not None:
            header.unit = plain  # "lb f"
        elif _read_words(bracket, header):
            header.strange = ", ".join(filter(None, (header.strange, bracket.strip())))
    # "Mass (unit) × qty" is the row's: each says what is multiplied.
    header.title = " ".join(_read_words(_CAMEL.sub(" ", _BRACKETS.sub(" ", text)), header, title=True))
    return header


def _read_words(text: str, header: MassHeader, *, title: bool = False) -> list[str]:
    """Put what the words say into ``header``; the words that say nothing known are returned."""
    kept: list[str] = []
    over = False
    for word in _WORD.findall(text):
        low = word.casefold()
        first = title and not kept
        if low in _OVER:
            over = True
        elif low in _TOTAL or (over and low in _ASSEMBLY):
            header.total = True
        elif low in _EACH:
            continue
        elif over and low.isdecimal():
            header.pieces = int(low) or 1
        elif not first and not header.unit and unit_factor(word) is not None:
            header.unit = word  # "mass_kg", "Gewicht in kg", "Masse/g"; never the first word
        elif over or low == "%" or (not first and any(letter.isdigit() for letter in low)):
            header.rate = True  # kg/m, g/cm3, 1000 kg
        elif first or low not in _FILLERS:
            kept.append(low)
    return kept


ROLES = (
    *(Role.NAME, Role.PART_NUMBER, Role.DESCRIPTION, Role.MATERIAL, Role.MASS, Role.TOTAL_MASS),
    *(Role.QUANTITY, Role.ITEM, Role.LEVEL, Role.FIND_NUMBER, Role.MASS_UNIT),
)
"""What a mass calculation reads of a BOM."""


@dataclass(frozen=True, slots=True)
class Columns:
    """Where each role is (column index), and what the headers of the mass columns say.

    others
        columns that mean a quantity, a mass or a material as well, and lost to the one that is used.
    exact
        masses are written in full (Silo's own export does so): a short one was not rounded.
    """

    at: Mapping[Role, int]
    masses: Mapping[Role, MassHeader]
    others: tuple[tuple[Role, int], ...]
    exact: bool

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


MASS_COLUMNS = (Role.MASS, Role.TOTAL_MASS)
_ONE_ONLY = (*MASS_COLUMNS, Role.MATERIAL, Role.QUANTITY)
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
    masses = {role: read_mass_header(header[at[role]]) for role in MASS_COLUMNS if role in at}
    others = tuple((role, i) for role, i in seen if role in _ONE_ONLY and at[role] != i)
    exact = {normal(cell) for cell in header} >= _SILOS_OWN
    return Columns(at, masses, others, exact)


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
    found = alias(normal(cell.replace("/", " per ")))  # "Mass/unit" is no unit of a mass
    if found is not None and found[0] is not Role.MASS:
        return found if found[0] in ROLES else None
    header = read_mass_header(cell)
    found = found or alias(header.title)
    if found is None or found[0] not in MASS_COLUMNS or header.rate:
        return None
    return (Role.TOTAL_MASS, found[1]) if header.total else found
