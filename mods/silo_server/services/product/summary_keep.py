# SPDX-License-Identifier: LGPL-2.1-or-later
"""Keeping summaries, per assembly (``product_summaries``).

**When it is valid.** What changes an item, its BOM or its file announces an event, but for a refused sync,
which only says so. What is kept of the item and of all that it is in goes in the same transaction
(``db.engine``). A read makes what is missing from its own snapshot. A thread keeps it later, under the lock
of the event log, and only what no event since that snapshot concerns: so nothing that is kept is old, and
looking changes nothing. What is too large for a read, the thread makes bottom up.

**Always closed.** If an assembly is kept, so are all assemblies in it; so what is not kept has nothing kept
above it, and outdating an item stops there.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from datetime import datetime, timedelta

from sqlalchemy import delete, select

from silo.bom.errors import CycleError
from silo_server.db.database import Database
from silo_server.db.rows import insert_rows, one_of
from silo_server.db.tables import bom_last_syncs, bom_lines, held_boms, items, product_summaries
from silo_server.db.tables import events as event_log
from silo_server.db.transaction import EVENT_LOCK, Tx
from silo_server.db.usage import uses_of
from silo_server.events import log
from silo_server.services.product.graph import children_first
from silo_server.services.product.summary_make import Built, Unmade, make_summaries
from silo_server.times import stamp

# Assemblies with so many lines are made at once if a part of a product is kept after the other.
BATCH_LINES = 20_000

# [s] Its waits and its statements.
LONGEST_CHANGE = 300


def keep_summaries(db: Database, ended: Callable[[], bool] = lambda: False) -> None:
    """Store the summaries that reads have made, unless an event since then concerns them.

    ended
        says whether to stop before a product that no read could make is made whole.
    """
    while db.built:
        built = db.built.popleft()
        if isinstance(built, Unmade):
            with suppress(CycleError):  # the read that asked says so
                _keep_below(db, built.item_ids, ended=ended)
            continue
        with db.write(even_when_read_only=True) as tx:
            tx.lock(EVENT_LOCK)
            _keep(tx, built)


def _keep(tx: Tx, built: Built) -> None:
    if built.head < log.horizon_of(tx):
        return
    since = select(event_log.c.item_uuid).where(event_log.c.id > built.head)
    # A sync that is refused or held has no event, and a time that may be before the look by as long as a
    # change may take.
    begun = stamp(datetime.fromisoformat(built.at) - timedelta(seconds=LONGEST_CHANGE))
    refused = select(bom_last_syncs.c.parent_id).where(bom_last_syncs.c.refused_at > begun)
    held = select(held_boms.c.parent_id).where(held_boms.c.at > begun)
    told = items.c.id.in_(refused) | items.c.id.in_(held)
    touched = set(tx.conn.scalars(uses_of(items.c.uuid.in_(since) | told)))
    rows = [row for row in built.rows if row["item_id"] not in touched]
    if rows:
        ids = [row["item_id"] for row in rows]
        tx.conn.execute(delete(product_summaries).where(one_of(tx, product_summaries.c.item_id, ids)))
        insert_rows(tx, product_summaries, rows)


def keep_all(db: Database, report: Callable[[str], None] = lambda _: None) -> int:
    """Make the summaries of all assemblies again; return how many. The server may run meanwhile."""
    with db.write(even_when_read_only=True) as tx:
        tx.lock(EVENT_LOCK)
        tx.conn.execute(delete(product_summaries))
    with db.read() as tx:
        products = set(tx.conn.scalars(select(items.c.id).where(items.c.item_type == "assembly")))
        products |= set(tx.conn.scalars(select(bom_lines.c.parent_id).distinct()))
    return _keep_below(db, products, report)


def _keep_below(
    db: Database,
    wanted: Collection[int],
    report: Callable[[str], None] = lambda _: None,
    ended: Callable[[], bool] = lambda: False,
) -> int:
    """Make and keep the summaries that these products lack, part by part; return how many.

    So a read of a product of any size finds all that it needs kept.
    """
    below: dict[int, list[int]] = {}
    counts: Counter[int] = Counter()
    with db.read() as tx:
        line = bom_lines.c
        kept = select(product_summaries.c.item_id)
        scalars = tx.conn.scalars(kept.where(one_of(tx, product_summaries.c.item_id, wanted)))
        level = set(wanted).difference(scalars)
        unmade = set(level)
        while level:
            query = select(line.parent_id, line.child_id, line.rel_type)
            query = query.where(one_of(tx, line.parent_id, level), line.child_id.not_in(kept))
            level = set()
            with tx.conn.execute(query, execution_options={"yield_per": 5000}) as rows:
                for parent_id, child_id, rel_type in rows:
                    counts[parent_id] += 1
                    if rel_type == "component":
                        below.setdefault(parent_id, []).append(child_id)
                        level.add(child_id)
            level -= unmade
            unmade |= level
        number_of = select(items.c.id, items.c.part_number).where(one_of(tx, items.c.id, below))
        names = dict(tx.conn.execute(number_of).all())
    order, done = list(children_first(below, sorted(unmade & {*wanted, *below}), lambda: names)), 0
    for part in _parts(order, counts):
        if ended():
            break
        with db.read() as tx:
            make_summaries(tx, part)
        keep_summaries(db, ended)
        done += len(part)
        report(f"{done} of {len(order)} assemblies")
    return done


def _parts(order: Iterable[int], counts: Mapping[int, int]) -> Iterator[list[int]]:
    """Yield the assemblies in groups of up to :data:`BATCH_LINES` lines; one alone may have more."""
    part: list[int] = []
    lines = 0
    for item_id in order:
        if part and lines + counts[item_id] > BATCH_LINES:
            yield part
            part, lines = [], 0
        part.append(item_id)
        lines += counts[item_id]
    if part:
        yield part
