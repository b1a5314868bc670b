# SPDX-License-Identifier: LGPL-2.1-or-later
"""A kind of table: which roles its columns may have, which it needs, and how a heading is recognised."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field

from silo.bom.headers import Heading, alias, normal
from silo.tables.heading_detail import price_heading


def heading_role(cell: str) -> tuple[str, int] | None:
    """Return the role of a heading by the aliases of :mod:`silo.bom.headers`, and how well it fits (0:
    best).
    """
    known = alias(normal(cell))
    if known is not None:
        return known
    price = price_heading(cell)
    return (Heading.PRICE, 0) if price is not None and not price.strange else None


@dataclass(frozen=True, slots=True)
class TableKind:
    """A kind of table.

    roles
        what its columns may mean; a column of another meaning is unused.
    naming
        the roles that say which thing a row is about.
    needed, instead
        the roles that it must have, and what may stand in their place.
    single
        the roles that one column has: two columns that differ are refused.
    role_of
        heading → role and rank.
    any_name
        True if one naming column is enough to recognise the heading row.
    code_pages
        the encodings that are tried after UTF-8; none: bytes that are no UTF-8 stay as they are, for names of
        files.
    """

    roles: tuple[str, ...]
    naming: tuple[str, ...]
    needed: tuple[str, ...] = ()
    instead: Mapping[str, Sequence[str]] = field(default_factory=dict)
    single: tuple[str, ...] = ()
    role_of: Callable[[str], tuple[str, int] | None] = heading_role
    any_name: bool = False
    code_pages: tuple[str, ...] = ("cp1252", "cp932", "gb18030", "latin-1")

    def lacking(self, there: Collection[str]) -> list[str]:
        """Return the needed roles that the table has neither itself nor through a substitute."""
        return [
            role for role in self.needed if role not in there and not {*self.instead.get(role, ())} & {*there}
        ]

    def complete(self, there: Collection[str]) -> bool:
        """Return True if columns of these roles make such a table."""
        return (not self.any_name or not {*self.naming}.isdisjoint(there)) and not self.lacking(there)
