# SPDX-License-Identifier: LGPL-2.1-or-later
"""The rows of a list of parts: number, name, description, category, kind, unit, sourcing, notes, link,
makers and suppliers.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from silo.bom.headers import Heading
from silo.bom.message import Message, message
from silo.tables.bom_rows import refuse_clashes
from silo.tables.columns import cell_at
from silo.tables.kind import TableKind
from silo.tables.read_rows import ReadRows, rows_of
from silo.tables.sheet import Sheet
from silo.tables.totals import is_total
from silo.tables.yes_no import read_yes_no

FACTS = (Heading.MANUFACTURER, Heading.MANUFACTURER_NUMBER, Heading.SUPPLIER, Heading.SUPPLIER_NUMBER)
ROLES = (
    Heading.PART_NUMBER,
    Heading.NAME,
    Heading.DESCRIPTION,
    Heading.CATEGORY,
    Heading.ITEM_TYPE,
    Heading.SOURCING,
    Heading.NOTES,
    Heading.UNIT,
    Heading.ASSEMBLY,
    Heading.LINK,
    Heading.ATTACHMENTS,
    Heading.MATERIAL,
    *FACTS,
)
PARTS = TableKind(
    roles=ROLES,
    naming=(Heading.PART_NUMBER, Heading.NAME),
    needed=(Heading.NAME,),
    instead={Heading.NAME: (Heading.PART_NUMBER, Heading.DESCRIPTION)},
    single=ROLES,
)
_BOUGHT_WORDS = "purchased; bought; buy; purchase; kauf; kaufteil; gekauft; zukauf; fremdbezug; f"
_MADE_WORDS = "manufactured; made; make; manufacture; eigenfertigung; fertigung; gefertigt; fertigungsteil; e"
_BOUGHT, _MADE = (
    frozenset(word.strip() for word in words.split(";")) for words in (_BOUGHT_WORDS, _MADE_WORDS)
)


@dataclass(frozen=True, slots=True)
class PartRow:
    """A row of a list of parts. ``texts``: role → text of the cell; a role without a column is absent."""

    line: int
    texts: Mapping[str, str]
    problems: tuple[str, ...] = ()
    left_out: str = ""


PartRows = ReadRows[PartRow]


def part_rows(sheet: Sheet) -> PartRows:
    """Read the rows. InputError if two columns of one meaning differ."""
    refuse_clashes(sheet, PARTS)
    at = sheet.columns.at
    rows = []
    for row in sheet.rows:
        texts = {role: cell_at(row.cells, index) for role, index in at.items()}
        if not any(texts.values()):
            rows.append(PartRow(row.line, texts, left_out=message("no cell in a column that is used")))
            continue
        if is_total([texts.get(role, "") for role in (*PARTS.naming, Heading.DESCRIPTION)], row.cells):
            rows.append(PartRow(row.line, texts, left_out=message("a sum, no part")))
            continue
        problems = []
        if said := texts.get(Heading.SOURCING):
            sourcing = read_sourcing(said)
            texts[Heading.SOURCING] = sourcing
            if not sourcing:
                problems.append(
                    message("Sourcing: wanted purchased or manufactured, got {said}", said=repr(said[:40]))
                )
        if said := texts.pop(Heading.ASSEMBLY, ""):
            problems += _assembly(said, texts)
        rows.append(PartRow(row.line, texts, tuple(problems)))
    return rows_of(sheet, rows)


def _assembly(said: str, texts: dict[str, str]) -> list[Message]:
    """Read the column that says if a part is an assembly; a type that the row names itself counts."""
    answer = read_yes_no(said)
    if answer is None:
        return [message("Assembly: wanted yes or no, got {said}", said=repr(said[:40]))]
    if answer and not texts.get(Heading.ITEM_TYPE):
        texts[Heading.ITEM_TYPE] = "assembly"
    return []


def read_sourcing(text: str) -> str:
    """Read if a part is bought or made; "" for another word. Yes and no answer "Purchaseable"."""
    word = " ".join(text.split()).casefold()
    if word in _BOUGHT or read_yes_no(word) is True:
        return "purchased"
    return "manufactured" if word in _MADE or read_yes_no(word) is False else ""
