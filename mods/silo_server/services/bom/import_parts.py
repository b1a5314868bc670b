# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which part each row of an import means: by its number, else its manufacturer's number, else its name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal

from sqlalchemy import select

from silo.bom.errors import RejectedError, listed
from silo.bom.headers import Heading
from silo.bom.message import message
from silo.tables.bom_rows import BOUGHT, BomRow
from silo_server.db.rows import one_of
from silo_server.db.tables import items
from silo_server.db.transaction import Tx
from silo_server.services.items import ItemQuery, NewItem, check_number, list_items


@dataclass(frozen=True, slots=True)
class IdentifiedRow:
    """A row with its part. ``unknown`` names a part that is not here, ``several`` says that a name has
    several.
    """

    of: BomRow
    part_number: str = ""
    unknown: str = ""
    several: str = ""

    @property
    def key(self) -> str:
        """Return what all rows of one part have in common; "" for a row that names none."""
        return self.part_number.casefold() or (f"\n{self.unknown}".casefold() if self.unknown else "")

    @property
    def quantity(self) -> Decimal | None:
        return self.of.quantity

    def with_row(self, row: BomRow) -> IdentifiedRow:
        """Return the same part with another row."""
        return replace(self, of=row)


def name_of(texts: Mapping[str, str]) -> str:
    """Find the name of a row's part: name, value with footprint (no KiCad library), or description."""
    value = " ".join(filter(None, (texts.get("value"), texts.get("footprint", "").rpartition(":")[2])))
    return texts.get("name") or (value if texts.get("value") else texts.get("description", ""))


def identified(tx: Tx, rows: Sequence[BomRow]) -> list[IdentifiedRow]:
    """Find the part of each row."""
    nameless = [row.texts for row in rows if row.means_part and not row.texts.get("part_number")]
    row, by_name, by_maker = items.c, dict[str, list[str]](), dict[str, list[str]]()
    query = select(row.name, row.part_number).where(row.archived_at.is_(None)).order_by(row.part_number_key)
    for name, number in tx.conn.execute(query.where(one_of(tx, row.name, {*map(name_of, nameless)} - {""}))):
        by_name.setdefault(name, []).append(number)
    for maker in {texts.get("manufacturer_part_number", "") for texts in nameless} - {""}:
        same_items, _ = list_items(tx, ItemQuery(search=maker, limit=100))
        numbers = ((item.part_number, item.properties.get("manufacturer_part_number")) for item in same_items)
        by_maker[maker] = [
            part_number for part_number, own in numbers if str(own).casefold() == maker.casefold()
        ]
    return [_identified(each, by_name, by_maker) for each in rows]


def _identified(
    row: BomRow, by_name: Mapping[str, Sequence[str]], by_maker: Mapping[str, Sequence[str]]
) -> IdentifiedRow:
    if number := row.texts.get("part_number"):
        return IdentifiedRow(row, number)
    maker, name = row.texts.get("manufacturer_part_number", ""), name_of(row.texts)
    if not (maker or name):
        return IdentifiedRow(row)
    if not row.means_part:
        return IdentifiedRow(row, unknown=maker or name)
    same = by_maker[maker] if maker else by_name.get(name, [])
    if len(same) == 1:
        return IdentifiedRow(row, same[0])
    if same:
        return IdentifiedRow(
            row,
            several=message(
                "{name}: {part_numbers} are called so; give the part number",
                name=maker or name,
                part_numbers=listed(same, 5),
            ),
        )
    return IdentifiedRow(row, unknown=maker or name)


def new_item(part: IdentifiedRow, category: str, problems: list[str]) -> NewItem:
    """Describe the new part of a row; it is bought if the row names a maker, a supplier or a value."""
    texts = part.of.texts
    facts = {role.value: texts[role] for role in BOUGHT if texts.get(role)}
    bought = facts or texts.get("value")
    try:
        number = check_number(part.part_number) if part.part_number else None
    except RejectedError as error:
        problems.append(str(error))
        number = None
    return NewItem(
        category=category,
        part_number=number,
        name=name_of(texts) or part.unknown,
        description=texts.get(Heading.DESCRIPTION, ""),
        texts={"sourcing_type": "purchased"} if bought else {},
        properties=facts,
    )
