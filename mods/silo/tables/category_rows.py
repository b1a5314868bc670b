# SPDX-License-Identifier: LGPL-2.1-or-later
"""The rows of a list of categories: code, name, how its part numbers are written, and what is above it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from silo.bom.headers import normal
from silo.bom.message import message
from silo.tables.bom_rows import refuse_clashes
from silo.tables.columns import cell_at
from silo.tables.kind import TableKind
from silo.tables.read_rows import ReadRows, rows_of
from silo.tables.sheet import Sheet

# Role → headings. The headings of other tables mean other things here: a "number" is no part's.
_HEADINGS: Mapping[str, str] = {
    "code": "code; category; category code; id; key; kategorie; kürzel; schlüssel; nummernkreis",
    "name": "name; category name; description; title; bezeichnung; benennung; beschreibung",
    "prefix": "prefix; number prefix; präfix; vorsatz",
    "digits": "digits; serial digits; number of digits; stellen; ziffern; anzahl stellen",
    "parent": "parent; parent category; above; group; übergeordnet; obergruppe; gruppe",
    "item_type": "item type; type; artikeltyp; typ",
    "standard": "standard parts; standard part; kind of standard part; standard; normteile; normteil",
}
_ROLE_OF = {
    normal(title): (role, rank)
    for role, titles in _HEADINGS.items()
    for rank, title in enumerate(titles.split(";"))
}
ROLES = tuple(_HEADINGS)
CATEGORIES = TableKind(
    roles=ROLES,
    naming=("code", "name"),
    needed=("name",),
    single=ROLES,
    role_of=lambda cell: _ROLE_OF.get(normal(cell)),
)


@dataclass(frozen=True, slots=True)
class CategoryRow:
    """A row of a list of categories. ``texts``: role → text of the cell, "" without a column."""

    line: int
    texts: Mapping[str, str]
    left_out: str = ""


CategoryRows = ReadRows[CategoryRow]


def category_rows(sheet: Sheet) -> CategoryRows:
    """Read the rows. InputError if two columns of one meaning differ."""
    refuse_clashes(sheet, CATEGORIES)
    at, rows = sheet.columns.at, []
    for row in sheet.rows:
        texts = {role: cell_at(row.cells, at.get(role)) for role in ROLES}
        empty = "" if any(texts.values()) else message("no cell in a column that is used")
        rows.append(CategoryRow(row.line, texts, empty))
    return rows_of(sheet, rows)
