# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reading summaries, kept ones and those that a read makes from its own snapshot, and their cost."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Set
from contextlib import suppress
from decimal import Decimal

from sqlalchemy import select

from silo.bom.errors import BusyError, CycleError
from silo_server.db.rows import one_of
from silo_server.db.tables import product_summaries
from silo_server.db.transaction import Tx
from silo_server.services.product.cost import PartCost, ProductCost, at_prices, part_cost
from silo_server.services.product.graph import Graph
from silo_server.services.product.parts import some_parts
from silo_server.services.product.summary import Summary
from silo_server.services.product.summary_make import MOST_NAMED, make_summaries, stored_summary
from silo_server.services.product.worth import MassAndCost
from silo_server.services.suppliers import rates_of
from silo_server.values import Item

# A list of items sums up what has so many lines in all.
MOST_FOR_A_LIST = 2000


def summary_of(tx: Tx, item: Item) -> Summary:
    """Return the summary of one product. Raises CycleError; BusyError while a large one is summed up."""
    return summaries(tx, [item.id])[item.id]


def summaries(tx: Tx, item_ids: Collection[int]) -> dict[int, Summary]:
    """Return the summaries of these items by internal id; those that are not kept are made."""
    wanted = set(item_ids)
    by_item = dict(_stored(tx, wanted))
    made = make_summaries(tx, wanted - by_item.keys(), tx.settings.max_expanded_rows)
    return by_item | {item_id: node.summary for item_id, node in made.items()}


def product_cost(tx: Tx, summary: Summary, pieces: int = 1) -> ProductCost:
    """Return what so many pieces of a product cost, by its summary."""
    worth = summary.worth.times(pieces)
    parts = some_parts(tx, worth.graded)
    rates = rates_of(tx) if parts else {}
    prices = {part_id: part_cost(part, worth.graded[part_id], rates) for part_id, part in parts.items()}
    unknown = {part_id for part_id, found in prices.items() if found.price is None}
    unknown.difference_update(summary.open_graded)
    named = sorted({*summary.cost_missing, *(parts[part_id].part_number for part_id in unknown)})
    totals = at_prices(worth, prices).costs
    return ProductCost(totals, summary.no_cost + len(unknown), named[:MOST_NAMED], prices)


def prices_besides(
    tx: Tx, worths: Iterable[MassAndCost], prices: Mapping[int, PartCost]
) -> Mapping[int, PartCost]:
    """Add to the prices of a product those of one piece of what counts in none: it is in what is bought."""
    wanted = {part_id for worth in worths for part_id in worth.graded} - prices.keys()
    if not wanted:
        return prices
    rates = rates_of(tx)
    return {
        **prices,
        **{part_id: part_cost(part, Decimal(1), rates) for part_id, part in some_parts(tx, wanted).items()},
    }


def marks_of(tx: Tx, listed: Iterable[Item]) -> dict[int, list[str]]:
    """Describe what is open in each of these products, for a list of them."""
    wanted = {item.id for item in listed if item.item_type == "assembly" or item.bom_version}
    by_item = at_once(tx, wanted)
    return {item_id: summary.inside(item_id, is_open=False) for item_id, summary in by_item.items()}


def at_once(tx: Tx, wanted: Set[int]) -> dict[int, Summary]:
    """Return the summaries of these items; a large product is absent until the server has summed it up."""
    by_item = dict(_stored(tx, wanted))
    with suppress(BusyError, CycleError):
        made = make_summaries(tx, wanted - by_item.keys(), MOST_FOR_A_LIST)
        by_item |= {item_id: node.summary for item_id, node in made.items()}
    return by_item


def standing_alone(tx: Tx, graph: Graph) -> set[int]:
    """Find the assemblies of a graph that state a mass in place of parts without one, by internal id."""
    by_item = summaries(tx, graph.lines.keys() - {graph.root.id})
    return {item_id for item_id, summary in by_item.items() if summary.stands_alone}


def _stored(tx: Tx, item_ids: Collection[int]) -> Iterator[tuple[int, Summary]]:
    row = product_summaries.c
    query = select(row.item_id, row.summary).where(one_of(tx, row.item_id, item_ids))
    for item_id, written in tx.conn.execute(query):
        yield item_id, stored_summary(written)
