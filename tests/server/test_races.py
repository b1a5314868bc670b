# SPDX-License-Identifier: LGPL-2.1-or-later
"""Two at once, each held at the worst moment: what the locks are for; and rules that only mutants break.

One transaction has done its work and not committed; the other begins, and is seen to wait for it in the
database itself (no sleeps). Then the first commits. Without its lock the second works on what it read before.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from server_testing import Api, Databases, bom, merge_body, wait_until
from sqlalchemy import func, select, text
from web_visitor import enter

from silo.bom.errors import CycleError
from silo_server.db.database import Database
from silo_server.db.transaction import Tx
from silo_server.run import prepare
from silo_server.services.bom import history
from silo_server.services.bom.line_edit import add_line
from silo_server.services.bom.merge import merge_bom
from silo_server.services.bom.merge_request import read_merge_request
from silo_server.services.items import NewItem, create_item, get_item
from silo_server.settings import Settings
from silo_server.values import LineState

PARTS = ("TOP", "SUB", "A", "B")


@pytest.fixture
def pg(databases: Databases, tmp_path: Path) -> Iterator[Database]:
    """A PostgreSQL with a few items."""
    made = Database(Settings(database_url=databases.new("postgres"), files_dir=tmp_path))
    prepare(made, "silo_races")
    with made.write() as tx:
        for number in PARTS:
            create_item(tx, NewItem(part_number=number, name=number))
    yield made
    made.close()


def one_waits_for_the_other(
    db: Database, first: Callable[[Tx], Any], second: Callable[[Tx], Any]
) -> list[BaseException]:
    """Do ``first``; before its commit begin ``second``, until it waits; commit. What ``second`` raised."""
    pids: list[int] = []
    raised: list[BaseException] = []

    def work() -> None:
        try:
            with db.write() as tx:
                pids.append(tx.conn.scalar(select(func.pg_backend_pid())) or 0)
                second(tx)
        except Exception as error:  # noqa: BLE001  the caller looks at it
            raised.append(error)

    thread = threading.Thread(target=work)
    with db.write() as tx:
        first(tx)
        thread.start()
        wait_until(lambda: bool(pids), "the second transaction")

        def waits_or_is_through() -> bool:
            query = text("SELECT wait_event_type FROM pg_stat_activity WHERE pid = :pid")
            with db.read() as look:
                waiting = look.conn.scalar(query, {"pid": pids[0]}) == "Lock"
            return waiting or not thread.is_alive()

        wait_until(waits_or_is_through, "the second waiting for the first")
    thread.join(60)
    assert not thread.is_alive()
    return raised


@pytest.mark.postgres
def test_two_merges_of_one_assembly_come_one_after_the_other(pg: Database) -> None:
    """The second plans on what the first left: versions count up, nothing is added twice or lost."""

    def merge(entries: dict[str, float]) -> Callable[[Tx], Any]:
        request = read_merge_request(merge_body(entries), 100)
        return lambda tx: merge_bom(tx, "TOP", request, None)

    assert one_waits_for_the_other(pg, merge({"A": 1}), merge({"B": 2})) == []
    with pg.read() as tx:
        top = get_item(tx, "TOP")
        changes = history.list_changes(tx, top)
        lines = {line.child.part_number: line.state for line in history.state_at(tx, top, changes[0].id)}
    assert [change.version for change in changes] == [2, 1]
    assert (top.bom_version, changes[0].line_count) == (2, 2)  # B came, and A is flagged
    assert lines["A"].unreferenced_since is not None
    assert lines["B"].quantity == 2


@pytest.mark.postgres
def test_two_edges_of_a_ring_are_not_added_together(pg: Database) -> None:
    """TOP → SUB here and SUB → TOP there, at the same moment: one of them is refused."""

    def add(parent: str, child: str) -> Callable[[Tx], Any]:
        return lambda tx: add_line(tx, parent, child, LineState(1.0, "manual"))

    raised = one_waits_for_the_other(pg, add("TOP", "SUB"), add("SUB", "TOP"))
    assert [type(error) for error in raised] == [CycleError]


def asked(api: Api, parent: str) -> dict[str, float]:
    """The open conflicts: part number → what CAD says."""
    found = api.get(bom(parent, "review"))["conflicts"]
    return {conflict["child_part_number"]: conflict["assembly_quantity"] for conflict in found}


def test_a_kept_quantity_is_asked_again_when_cad_says_something_new(api: Api) -> None:
    """And only then; also after CAD went back and forth."""
    parent, child = api.items(2)
    api.merge(parent, {child: 1})
    api.good("PUT", bom(parent, child), {"quantity": 5})
    api.merge(parent, {child: 2})
    assert asked(api, parent) == {child: 2}
    decisions = {"decisions": [{"child_part_number": child, "action": "keep_silo"}]}
    api.good("POST", bom(parent, "resolve"), decisions)
    assert asked(api, parent) == {}
    api.merge(parent, {child: 2})
    assert asked(api, parent) == {}
    api.merge(parent, {child: 3})
    assert asked(api, parent) == {child: 3}
    api.merge(parent, {child: 2})
    assert asked(api, parent) == {child: 2}


@pytest.mark.parametrize("rel_type", ["alternate", "reference"])
def test_a_merge_touches_no_line_that_is_no_component(api: Api, rel_type: str) -> None:
    """Whatever its source says: neither quantity nor flag, with the child in the assembly or without."""
    parent, child, other = api.items(3)
    line = {"child_part_number": child, "rel_type": rel_type, "quantity": 7, "source": "assembly"}
    api.good("POST", bom(parent), line)
    before = api.get(bom(parent))[0]
    for entries in ({child: 2}, {child: 3, other: 1}, {other: 1}):
        api.merge(parent, entries)
        now = next(row for row in api.get(bom(parent)) if row["id"] == before["id"])
        assert {k: now[k] for k in ("quantity", "rel_type", "source", "unreferenced_since")} == {
            k: before[k] for k in ("quantity", "rel_type", "source", "unreferenced_since")
        }


def test_an_undo_does_not_close_a_ring(api: Api) -> None:
    """The line that was removed would contain its parent by now: 409 with the path, nothing is changed."""
    top, sub = api.items(2)
    api.good("POST", bom(top), {"child_part_number": sub})
    api.good("DELETE", bom(top, sub))
    removal = api.get(bom(top, "history"))[0]["id"]
    api.good("POST", bom(sub), {"child_part_number": top})
    told = api.bad(409, "POST", bom(top, "undo"), {"change_id": removal})
    assert told["error"] == "cycle"
    assert api.get(bom(top)) == []


@pytest.mark.parametrize("method", ["DELETE", "PUT", "PATCH", "POST"])
def test_no_method_that_changes_goes_without_the_forms_secret(api: Api, method: str) -> None:
    """A session's cookie alone changes nothing, whichever the method."""
    parent, child = api.items(2)
    api.good("POST", bom(parent), {"child_part_number": child})
    cookie = enter(api, "admin").cookie
    path = {"DELETE": bom(parent, child), "PUT": bom(parent, child), "POST": "/api/items"}.get(
        method, f"/api/items/{parent}/properties"
    )
    before = api.get(bom(parent))
    browser = api.as_(None)
    for headers in ({"Cookie": cookie}, {"Cookie": cookie, "X-CSRF-Token": "guess"}):
        browser.bad(403, method, path, {"quantity": 9}, headers=headers)
    assert api.get(bom(parent)) == before
