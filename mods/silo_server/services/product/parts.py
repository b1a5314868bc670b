# SPDX-License-Identifier: LGPL-2.1-or-later
"""The parts of a product, as totals, filters and order lists read them."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from decimal import Decimal
from itertools import islice
from typing import Any, NamedTuple, TypeVar

from sqlalchemy import select

from silo.bom.numbers import read_number
from silo_server.db.rows import one_of
from silo_server.db.tables import items
from silo_server.db.transaction import Tx
from silo_server.services.product.graph import Graph
from silo_server.values import bought

# So many rows get what they show of their parts at once.
PORTION = 1000

R = TypeVar("R")


def portions(rows: Iterable[R]) -> Iterator[list[R]]:
    """Yield the rows in lists of up to :data:`PORTION` rows."""
    rest = iter(rows)
    while portion := list(islice(rest, PORTION)):
        yield portion


DEFAULT_CURRENCY = "EUR"


class RolledItem(NamedTuple):
    """What totals, filters and order lists read of an item; ``properties`` with its supplier."""

    part_number: str
    name: str
    description: str
    properties: Mapping[str, Any]
    thumbnail_key: str | None = None
    is_bought: bool = False
    has_bom: bool = False
    sourcing_type: str | None = None
    supplier_parts: Sequence[Mapping[str, Any]] = ()
    archived_at: str | None = None
    unit: str | None = None


def parts_of(tx: Tx, graph: Graph) -> dict[int, RolledItem]:
    """Read what roll-ups need of all items in the graph, by internal id."""
    return some_parts(tx, graph.names())


_row = items.c
# What :func:`rolled_item` reads, in its order.
ROLLED = (
    _row.id,
    _row.part_number,
    _row.name,
    _row.description,
    _row.properties,
    _row.thumbnail_key,
    _row.supplier_parts,
    _row.sourcing_type,
    _row.item_type,
    _row.bom_version,
    _row.archived_at,
    _row.unit,
)


# What is stored is whole: without a look for spaces around it, in half the time.
_read_json = json.JSONDecoder().raw_decode


def some_parts(tx: Tx, item_ids: Collection[int]) -> dict[int, RolledItem]:
    """Read what roll-ups need of these items, by internal id; without items nothing is asked."""
    if not item_ids:
        return {}
    query = select(*ROLLED).where(one_of(tx, items.c.id, item_ids))
    return dict(map(rolled_item, tx.conn.execute(query)))


def rolled_item(row: Sequence[Any]) -> tuple[int, RolledItem]:
    """Make an item, with its internal id, from a row that begins with :data:`ROLLED`."""
    part_id, number, name, about, text, key, offers, sourcing, kind, version, archived, unit = row[
        : len(ROLLED)
    ]
    properties, listed = _read_json(text)[0], json.loads(offers) if offers else ()
    if listed:
        properties = with_supplier(properties, listed)
    is_bought, has_bom = bought(sourcing, properties.get("supplier")), kind == "assembly" or version > 0
    return part_id, RolledItem(
        number, name, about, properties, key, is_bought, has_bom, sourcing, listed, archived, unit
    )


def with_supplier(
    properties: Mapping[str, Any], listed: Sequence[Mapping[str, Any]] | None
) -> Mapping[str, Any]:
    """Add to properties the supplier that a list shows: the preferred one, else the first."""
    if not listed:
        return properties
    shown = next((line for line in listed if line["preferred"]), listed[0])
    names = {"supplier": "supplier", "supplier_part_number": "number", "lead_time_days": "lead_time_days"}
    return {**properties, **{name: shown[key] for name, key in names.items()}}


def currency_of(properties: Mapping[str, Any]) -> str:
    """Return the currency of an item's cost as it is typed; :data:`DEFAULT_CURRENCY` if it states none."""
    return str(properties.get("currency") or DEFAULT_CURRENCY).strip().upper()


_NUMBER = int | float | Decimal


def positive_number(properties: Mapping[str, Any], name: str) -> float | None:
    """Read a property as a number of at least 0; None if it is absent or no such number."""
    value = properties.get(name)
    if isinstance(value, str):
        value = read_number(value, points_are_decimal=True).value
    if isinstance(value, bool) or not isinstance(value, _NUMBER):
        return None
    return float(value) if 0 <= value < 1e15 else None
