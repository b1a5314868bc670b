# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which column of a table has which role, by its heading or by the user's word; all others are unused.

If two columns fit a role, the column whose name fits better has it, then the first. Several columns of
prices are one role: "Price 1; Price 100" are the prices of two quantities.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from silo.bom.errors import InputError
from silo.bom.headers import Heading, normal, plain_cell
from silo.bom.message import message
from silo.tables.heading_detail import PriceHeading, price_heading
from silo.tables.kind import TableKind

Assigned = Mapping[str, str | int]
"""Role → heading or index of the column, from the user."""


@dataclass(frozen=True, slots=True)
class Columns:
    """Where each role is.

    at
        role → index of the column.
    others
        columns that mean the same as a used column, and lost to it.
    prices
        all columns of prices, with what their headings say.
    chosen
        True if the user chose the columns.
    """

    at: Mapping[str, int]
    others: tuple[tuple[str, int], ...] = ()
    prices: tuple[tuple[int, PriceHeading], ...] = ()
    chosen: bool = False

    def cell(self, row: Sequence[str], role: str) -> str:
        """Return the row's cell for a role; "" if there is no such column or the row is too short.

        An apostrophe that keeps a spreadsheet from running the cell as a formula is no part of it.
        """
        return cell_at(row, self.at.get(role))

    @property
    def used(self) -> set[int]:
        """Return the indices of all columns that have a role."""
        return {*self.at.values(), *(index for index, _ in self.prices)}


def cell_at(row: Sequence[str], index: int | None) -> str:
    """Return the text of a cell; "" if there is no such cell."""
    return plain_cell(row[index].strip()) if index is not None and index < len(row) else ""


def find_columns(header: Sequence[str], kind: TableKind, assigned: Assigned | None = None) -> Columns:
    """Find the roles of a heading row. What is ``assigned`` wins over the names of the columns.

    If an index is assigned, only what is assigned is used. InputError for a role that does not exist.
    """
    unknown = sorted((assigned or {}).keys() - {*kind.roles})
    if unknown:
        raise InputError(
            message(
                "unknown column role {unknown}; the roles are {roles}",
                unknown=", ".join(unknown),
                roles=", ".join(sorted(kind.roles)),
            )
        )
    plain = [normal(cell) for cell in header]
    at: dict[str, int] = {}
    for role, column in (assigned or {}).items():
        place = column if isinstance(column, int) else next(iter(_places(plain, normal(column))), None)
        if place is not None:
            at[role] = place
    chosen = any(isinstance(column, int) for column in (assigned or {}).values())
    best: dict[str, int] = {}
    seen: list[tuple[str, int]] = []
    taken = set(at.values())
    for index, cell in enumerate(() if chosen else header):
        found = kind.role_of(cell) if cell.strip() else None
        if found is None or index in taken or found[0] not in kind.roles or found[0] in (assigned or {}):
            continue
        role, rank = found
        seen.append((role, index))
        if rank < best.get(role, sys.maxsize):
            at[role], best[role] = index, rank
    prices: list[tuple[int, PriceHeading]] = []
    if Heading.PRICE in at:
        columns = [i for role, i in seen if role == Heading.PRICE] or [at[Heading.PRICE]]
        prices = [(i, price_heading(header[i]) or PriceHeading()) for i in columns if i < len(header)]
    others = tuple(
        (role, i) for role, i in seen if at[role] != i and role != Heading.PRICE and role in kind.single
    )
    return Columns(at, others, tuple(prices), chosen)


def _places(plain: Sequence[str], wanted: str) -> list[int]:
    return [index for index, text in enumerate(plain) if text == wanted]
