# SPDX-License-Identifier: LGPL-2.1-or-later
"""Times of changes are in the order of the changes, whoever writes and whatever the clocks say."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from random import Random

from hunting import over

from silo_server.db.database import Database
from silo_server.run import prepare
from silo_server.services.bom.history import change_at, list_changes, state_at
from silo_server.services.bom.line_edit import add_line, change_line
from silo_server.services.bom.lines import lines_of
from silo_server.services.bom.merge import merge_bom
from silo_server.services.bom.merge_request import read_merge_request
from silo_server.services.items import ItemChange, NewItem, change_item, create_item, get_item
from silo_server.services.revisions import list_revisions
from silo_server.settings import Settings
from silo_server.times import Clock, utc_now
from silo_server.values import LineState

WRITERS, EACH = 10, 6


def wild(seed: int) -> Clock:
    """A clock that is set forward and back all the time."""
    random = Random(seed)
    return lambda: datetime(2026, 11, 22, tzinfo=UTC) + timedelta(seconds=random.uniform(-1000, 1000))


def check(db: Database, parent: str) -> None:
    """ "As of its own time" is the change itself, for each change, and so is the state."""
    with db.read() as tx:
        item = get_item(tx, parent)
        changes = list_changes(tx, item, 1000)[::-1]
        times = [change.at for change in changes]
        assert times == sorted(set(times))
        assert [change_at(tx, item, change.at) for change in changes] == [change.id for change in changes]
        now = [(line.id, line.state) for line in lines_of(tx, item)]
        assert [(line.line_id, line.state) for line in state_at(tx, item, changes[-1].id)] == now


def filled(url: str, clock: Clock) -> Database:
    """A database with an assembly and parts."""
    db = Database(Settings(database_url=url), clock)
    prepare(db)
    with db.write() as tx:
        for name in ("TOP", *(f"P-{number}" for number in range(WRITERS))):
            create_item(tx, NewItem(part_number=name))
    return db


def test_changes_of_one_bom_by_many_writers(url: str) -> None:
    """Two processes' worth of writers wait for one another; who waits longest must not be of the past."""
    first, second = filled(url, utc_now), Database(Settings(database_url=url))
    begin = threading.Barrier(WRITERS)

    def write(number: int) -> None:
        db = (first, second)[number % 2]
        begin.wait()
        with db.write() as tx:
            add_line(tx, "TOP", f"P-{number}", LineState(1, "manual"))
        for quantity in range(2, EACH):
            with db.write() as tx:
                change_line(tx, "TOP", f"P-{number}", {"quantity": float(quantity)})

    with ThreadPoolExecutor(WRITERS) as pool:
        list(pool.map(write, range(WRITERS)))
    check(first, "TOP")
    first.close()
    second.close()


@over("sqlite")
def test_changes_under_clocks_that_are_set_back(url: str) -> None:
    """Merges, edits, and changes of the item: each is later than the one before."""
    first = filled(url, wild(1))
    second = Database(Settings(database_url=url), wild(2))
    for number in range(30):
        with (first, second)[number % 2].write() as tx:
            if number % 3:
                entries = [{"child_part_number": f"P-{number % 4}", "quantity": number}]
                merge_bom(tx, "TOP", read_merge_request({"entries": entries}, 10), None)
            else:
                change_item(tx, "TOP", ItemChange(properties={"n": number}))
    check(first, "TOP")
    with first.read() as tx:
        times = [revision.created_at for revision in list_revisions(tx, get_item(tx, "TOP"))[0]]
    assert times == sorted(set(times), reverse=True)
    first.close()
    second.close()
