# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reading summaries: those that are kept, and those that a read makes from its own snapshot."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Set
from contextlib import suppress

from sqlalchemy import select

from silo.bom.errors import BusyError, CycleError
from silo_server.db.rows import one_of
from silo_server.db.tables import product_summaries
from silo_server.db.transaction import Tx
from silo_server.services.product.graph import Graph
from silo_server.services.product.summary import Summary
from silo_server.services.product.summary_make import make_summaries, stored_summary
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
