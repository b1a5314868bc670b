# SPDX-License-Identifier: LGPL-2.1-or-later
"""The event stream: names, order, replay, filters, reset, heartbeat."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from hunting import BOTH
from server_testing import Api, Databases, bom, wait_until

from silo_server.housekeeping import tidy
from silo_server.run import RunningServer, running_server
from silo_server.settings import Settings

pytestmark = BOTH


@pytest.fixture(scope="module")
def quick(
    kind: str, databases: Databases, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[RunningServer]:
    """A server of its own with a short log and a quick heartbeat."""
    url, tmp_path = databases.new(kind), tmp_path_factory.mktemp("quick")
    settings = Settings(database_url=url, heartbeat_seconds=0.05, event_log_size=5)
    with running_server(url, token="silo_quick", files_dir=tmp_path, settings=settings) as running:
        yield running


def test_the_stream_is_an_event_stream_that_nothing_buffers(api: Api) -> None:
    """Type, no caching, and nginx has to pass everything on."""
    with api.events() as events:
        headers = {name.lower(): value for name, value in events.response.getheaders()}
    assert headers["content-type"].startswith("text/event-stream")
    assert headers["cache-control"] == "no-store"
    assert headers["x-accel-buffering"] == "no"


def test_every_kind_of_event(api: Api) -> None:
    """The real Silo's names for items and revisions, the spec's for merges, ours for other BOM changes."""
    with api.events() as events:
        parent = api.item(name="Parent")
        made = events.next()
        assert (made.name, made.data["part_number"]) == ("item.created", parent)
        assert {"part_number", "description", "item_type"} <= made.data.keys()
        child = api.item()
        events.next("item.created")
        api.good("PUT", f"/api/items/{child}", {"name": "New"})
        assert events.next().name == "item.updated"
        api.upload(child, comment="c")
        revision = events.next()
        assert revision.name == "revision.created"
        assert {"part_number": child, "revision_number": 1, "comment": "c"}.items() <= revision.data.items()
        api.merge(parent, {child: 1})
        assert events.next().data["type"] == "bom_merge"
        api.edit_line(parent, child, notes="x")
        edited = events.next()
        assert (edited.name, edited.data["item"]) == ("bom.updated", parent)
        api.good("DELETE", f"/api/items/{child}")
        assert events.next().name == "item.deleted"


def test_a_refused_request_is_not_announced(api: Api) -> None:
    """Events are written with the change or not at all."""
    parent, child = api.items(2)
    with api.events(f"?item={parent}") as events:
        api.bad(400, "POST", bom(parent, "merge"), {"entries": [{"child_part_number": "NO", "quantity": 1}]})
        api.merge(parent, {child: 7})
        assert events.next().data["diff"]["added"][0]["quantity"] == 7


def test_replay_loses_nothing_and_doubles_nothing(api: Api) -> None:
    """``Last-Event-ID``: exactly what came after it, then what comes."""
    parent, child = api.items(2)
    with api.events(f"?item={parent}") as events:
        api.merge(parent, {child: 1})
        first = events.next("bom_merge").id
    assert first is not None
    for quantity in (2, 3, 4):
        api.merge(parent, {child: quantity})
    with api.events(f"?item={parent}", first) as events:
        seen = [events.next("bom_merge") for _ in range(3)]
        api.merge(parent, {child: 5})
        seen.append(events.next("bom_merge"))
    assert [event.data["diff"]["quantity_changed"][0]["new_quantity"] for event in seen] == [2, 3, 4, 5]
    ids = [event.id for event in seen]
    assert ids == sorted(set(ids))
    with api.events(f"?item={parent}&last_event_id={ids[2]}") as events:
        assert events.next().id == ids[3]


def test_replay_while_events_come_in(api: Api) -> None:
    """Clients come and go while merges run: each sees every event after its own last one, once, in order."""
    parent, child = api.items(2)
    with api.events(f"?item={parent}") as events:
        api.merge(parent, {child: 1})
        start = events.next("bom_merge").id

    def merge_on() -> None:
        mine = api.as_(api.token)
        for quantity in range(2, 22):
            mine.merge(parent, {child: quantity})

    results: list[list[float]] = []

    def come_and_go() -> None:
        last, seen = start, list[float]()
        while not seen or seen[-1] != 21:
            with api.events(f"?item={parent}", last) as stream:
                for _ in range(4):
                    event = stream.next("bom_merge")
                    last = event.id
                    seen.append(event.data["diff"]["quantity_changed"][0]["new_quantity"])
                    if seen[-1] == 21:
                        break
        results.append(seen)

    threads = [threading.Thread(target=merge_on)] + [threading.Thread(target=come_and_go) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert results == [list(range(2, 22))] * 3


def test_a_filter_by_item(api: Api) -> None:
    """Only the events of these items come, named by number (whatever its case) or UUID."""
    a, b, c = api.items(3)
    uuid = api.get(f"/api/items/{b}")["id"]
    with api.events(f"?item={a.lower()}&item={uuid}") as events:
        for number in (c, b, c, a):
            api.good("PUT", f"/api/items/{number}", {"name": "again " + number})
        assert [events.next().data["part_number"] for _ in range(2)] == [b, a]


def test_who_was_away_for_too_long_has_to_read_again(quick: RunningServer) -> None:
    """Behind the log's end: ``reset``, then live; within it: replay. The trimming is what restarts do."""
    with Api(quick.base_url, "silo_quick") as api:
        with api.events() as events:
            api.item()
            old = events.next("item.created").id
            for number in api.items(20):  # a server that has not read them yet would send a second reset
                assert events.next("item.created").data["part_number"] == number
        tidy(quick.app.state.server.db, quick.app.state.server.files)
        with api.events("", old) as events:
            reset = events.next("reset", "item.created")
            assert (reset.name, reset.data) == ("reset", {})
            number = api.item()
            assert events.next("item.created").data["part_number"] == number
        assert reset.id is not None
        with api.events("", reset.id) as events:
            assert events.next("item.created").data["part_number"] == number


def test_an_id_from_the_future_is_another_server_s(api: Api) -> None:
    """After a database was replaced ids go backwards: the client has to read again."""
    with api.events("", 10**12) as events:
        assert events.next().name == "reset"


def test_a_heartbeat_while_nothing_happens(quick: RunningServer) -> None:
    """``event: heartbeat``, ``data: {}``, without an id."""
    with Api(quick.base_url, "silo_quick") as api, api.events() as events:
        beat = events.next("heartbeat")
        assert (beat.name, beat.data, beat.id) == ("heartbeat", {}, None)


def test_a_revoked_token_ends_its_stream(quick: RunningServer) -> None:
    """A stream does not outlive the token that opened it."""
    with Api(quick.base_url, "silo_quick") as api:
        token = api.good("POST", "/api/auth/tokens", {"name": "short-lived"})
        with api.as_(token["token"]).events() as events:
            events.next("heartbeat")
            api.good("DELETE", f"/api/auth/tokens/{token['id']}")
            with pytest.raises(AssertionError, match="the stream ended"):
                events.next("never")


def test_ids_survive_a_restart(kind: str, databases: Databases, tmp_path: Path) -> None:
    """The log is in the database: ids continue, and a client replays across the restart."""
    url = databases.new(kind)
    with (
        running_server(url, token="silo_quick", files_dir=tmp_path) as first,
        Api(first.base_url, "silo_quick") as api,
    ):
        with api.events() as events:
            api.item("BEFORE")
            last = events.next("item.created").id
        api.item("MISSED")
    with (
        running_server(url, token="silo_quick", files_dir=tmp_path) as second,
        Api(second.base_url, "silo_quick") as api,
        api.events("", last) as events,
    ):
        assert events.next().data["part_number"] == "MISSED"
        api.item("AFTER")
        after = events.next("item.created")
        assert after.data["part_number"] == "AFTER"
        assert after.id is not None
        assert last is not None
        assert after.id > last + 1


def test_listeners_are_counted_and_let_go(api: Api, server: RunningServer) -> None:
    """``/ready`` says how many listen; who hangs up is forgotten."""

    def listening() -> int:
        return int(api.get("/ready")["sse_clients"])

    wait_until(lambda: listening() == 0, "the end of earlier streams")
    with api.events(), api.events():
        assert listening() == 2
    wait_until(lambda: listening() == 0, "the streams' end")


def test_a_last_event_id_is_a_number(api: Api) -> None:
    """Anything else is refused rather than guessed."""
    for last in ("x", "-1", "1.5", "9" * 30):
        api.bad(400, "GET", "/api/events", headers={"Last-Event-ID": last})


def test_what_is_about_no_item_comes_to_all(api: Api) -> None:
    """The server's mode is news for whoever listens to one item."""
    with api.events(f"?item={api.item()}") as events:
        api.good("PUT", "/api/admin/mode", {"mode": "normal"})
        assert events.next("server.state").data == {"mode": "normal"}
