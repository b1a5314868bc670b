# SPDX-License-Identifier: LGPL-2.1-or-later
"""An item as the cells of its row in a list of parts: written for an export, and changed by an import.

A cell of a column is a text of the item, one of its properties, or a field of its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sqlalchemy import update

from silo.bom.headers import Heading
from silo.bom.units import PIECES, stored_unit
from silo.tables.part_rows import FACTS
from silo_server.db.tables import items
from silo_server.db.transaction import Tx
from silo_server.services.bom.unit_change import change_item_and_lines
from silo_server.services.items import ItemChange, archive_item
from silo_server.values import Item

# What an export has, by the headings that an import reads.
COLUMNS: Mapping[str, str] = {
    "part_number": "Part number",
    "name": "Name",
    "description": "Description",
    "category": "Category",
    "item_type": "Item type",
    "unit": "Unit",
    "sourcing_type": "Sourcing",
    "notes": "Notes",
    "sourcing_link": "Link",
    "material": "Material",
    "manufacturer": "Manufacturer",
    "manufacturer_part_number": "Manufacturer's part number",
    "supplier": "Supplier",
    "supplier_part_number": "Supplier's part number",
}
ARCHIVED = "archived"
"""The column of an archived item that an import brings back; no export has it."""
PROPERTIES = (*(str(role) for role in FACTS), str(Heading.MATERIAL), "sourcing_link")
# Fields of an item's texts, by the columns that have another name.
TEXTS = {"sourcing_type": "sourcing_type", "notes": "long_description", "unit": "unit"}


def cells_of(item: Item) -> dict[str, str]:
    """Return an item as the cells of its row."""
    cells: dict[str, Any] = {
        "part_number": item.part_number,
        "name": item.name,
        "description": item.description,
        "category": item.category,
        "item_type": item.item_type,
        **{column: item.texts.get(field) for column, field in TEXTS.items()},
        "unit": stored_unit(item.texts.get("unit")) or PIECES.symbol,
        **{name: item.properties.get(name) for name in PROPERTIES},
        ARCHIVED: "yes" if item.archived_at else "no",
    }
    return {column: "" if cell is None else str(cell) for column, cell in cells.items()}


def change_of(item: Item, cells: Mapping[str, str], comment: str) -> ItemChange:
    """Make the change that gives an item these cells; an empty one clears a text or a property."""
    named = {name: text for name, text in cells.items() if name in PROPERTIES}
    properties = {name: value for name, value in item.properties.items() if named.get(name, "x")}
    properties |= {name: text for name, text in named.items() if text}
    return ItemChange(
        name=cells.get("name"),
        description=cells.get("description"),
        item_type=cells.get("item_type"),
        category=cells.get("category") or None,
        texts={TEXTS[column]: text for column, text in cells.items() if column in TEXTS},
        properties=properties if named else None,
        comment=comment,
    )


def restore_cells(tx: Tx, item: Item, cells: Mapping[str, str]) -> None:
    """Give an item the cells that it had before."""
    if cells.get("category") == "":
        tx.conn.execute(update(items).where(items.c.id == item.id).values(category=None))
    if len(cells) > (ARCHIVED in cells):
        change_item_and_lines(tx, item.part_number, change_of(item, cells, "import undone"))
    if cells.get(ARCHIVED) == "yes":
        archive_item(tx, item.part_number)
