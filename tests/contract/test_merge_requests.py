# SPDX-License-Identifier: LGPL-2.1-or-later
"""The merge as a request: idempotence, preview, versions, everything that is refused."""

from __future__ import annotations

import hashlib
import threading
from typing import Any

from hunting import BOTH
from model_file import model_file
from server_testing import Api, bom, merge_body


@BOTH
def test_a_replayed_sync_id_is_not_announced_again(api: Api) -> None:
    """A repeat makes no second event and no second change in the history."""
    parent, a = api.items(2)
    with api.events(f"?item={parent}") as events:
        api.merge(parent, {a: 1}, sync_id="once")
        events.next("bom_merge")
        api.merge(parent, {a: 1}, sync_id="once")
        api.merge(parent, {a: 2}, sync_id="next")
        assert events.next("bom_merge").data["sync_id"] == "next"
    assert len(api.get(bom(parent, "history"))) == 2


@BOTH
def test_if_match_lets_the_right_version_through_and_gives_412_for_an_old_one(api: Api) -> None:
    """``If-Match`` on the BOM's version: 412 instead of a lost update, nothing changed."""
    parent, a = api.items(2)
    read = api.call("GET", bom(parent)).headers["etag"]
    ok = api.call("POST", bom(parent, "merge"), merge_body({a: 1}), headers={"If-Match": read})
    assert ok.status == 200
    assert ok.headers["etag"] != read
    error = api.bad(412, "POST", bom(parent, "merge"), merge_body({a: 5}), headers={"If-Match": read})
    assert "read it again" in error["message"]
    assert api.quantities(parent) == {a: 1}
    for anything in (ok.headers["etag"], "*"):
        assert api.call("PUT", bom(parent, a), {"notes": "x"}, headers={"If-Match": anything}).status == 200


def test_all_bad_entries_are_reported_at_once_with_their_index(api: Api) -> None:
    """One 400 lists unknown children and bad quantities together; nothing is merged."""
    parent, good = api.items(2)
    entries: list[Any] = [
        {"child_part_number": "NO-SUCH-1", "quantity": 1},
        {"child_part_number": good, "quantity": 0},
        {"child_part_number": good, "quantity": 2},
        {"child_part_number": "NO-SUCH-2", "quantity": "many"},
        {"quantity": 1},
        7,
    ]
    error = api.bad(400, "POST", bom(parent, "merge"), {"entries": entries})
    assert error["error"] == "rejected"
    assert [problem.split("]")[0] for problem in error["problems"]] == [
        "entries[0",
        "entries[1",
        "entries[3",
        "entries[3",
        "entries[4",
        "entries[5",
    ]
    assert "'NO-SUCH-1' does not exist on this server" in error["problems"][0]
    assert api.get(bom(parent)) == []


def test_a_body_that_is_no_merge_is_refused(api: Api) -> None:
    """400 with what was wanted; Python's JSON would read NaN and Infinity. 413 for what nests without end."""
    parent, a = api.items(2)
    entries = f'{{"entries": [{{"child_part_number": "{a}", "quantity": '
    numbers = [entries + word + "}]}" for word in ("NaN", "Infinity", "-Infinity")]
    for text in ("", "[", "[]", "null", '{"entries": 1}', "{}", "\udce4", *numbers):
        raw = text.encode("utf-8", "surrogateescape")
        assert "body" in api.bad(400, "POST", bom(parent, "merge"), body=raw)["message"], text[:90]
    deep = b"[" * 100_000
    assert "body: it is nested too deep" in api.bad(413, "POST", bom(parent, "merge"), body=deep)["message"]
    endless = f"{entries}1e999}}]}}".encode()
    assert "quantity" in api.bad(400, "POST", bom(parent, "merge"), body=endless)["message"]
    assert api.get(bom(parent)) == []


def test_an_archived_child_cannot_be_added_but_stays_where_it_is(api: Api) -> None:
    """Archiving a part does not break the BOMs it is in; it is not found for new ones."""
    parent, other, a = api.items(3)
    api.merge(parent, {a: 1})
    api.good("DELETE", f"/api/items/{a}")
    assert api.merge(parent, {a: 2})["diff"]["quantity_changed"][0]["new_quantity"] == 2
    error = api.bad(400, "POST", bom(other, "merge"), merge_body({a: 1}))
    assert "is archived" in error["problems"][0]


def test_a_cycle_is_409_with_its_path(api: Api) -> None:
    """An assembly cannot come to contain itself; the path says how it would."""
    top, middle, bottom = api.items(3)
    api.merge(top, {middle: 1})
    api.merge(middle, {bottom: 1})
    error = api.bad(409, "POST", bom(bottom, "merge"), merge_body({top: 1}))
    assert error["error"] == "cycle"
    assert error["path"] == [bottom, top, middle, bottom]
    error = api.bad(409, "POST", bom(top), {"child_part_number": top, "quantity": 1})
    assert error["path"] == [top, top]
    assert api.get(bom(bottom)) == []


@BOTH
def test_two_merges_at_once_cannot_close_a_ring_together(api: Api) -> None:
    """A into B and B into A at the same moment: exactly one of them gets 409."""
    for _ in range(5):
        a, b = api.items(2)
        barrier, statuses = threading.Barrier(2), []

        def merge(parent: str, child: str, gate: threading.Barrier, out: list[int]) -> None:
            mine = api.as_(api.token)
            gate.wait(60)
            out.append(mine.call("POST", bom(parent, "merge"), merge_body({child: 1})).status)

        threads = [
            threading.Thread(target=merge, args=(p, c, barrier, statuses)) for p, c in ((a, b), (b, a))
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert sorted(statuses) == [200, 409]


def test_unknown_keys_are_ignored_and_every_entry_is_the_assembly_s(api: Api) -> None:
    """``source: manual`` in a merge makes no manual line (silo-contract §0.5)."""
    parent, a = api.items(2)
    entry = {"child_part_number": a, "quantity": 1, "source": "manual", "colour": "red"}
    api.good("POST", bom(parent, "merge"), {"source": "manual", "entries": [entry], "later": {}})
    assert api.lines(parent)[a]["source"] == "assembly"


def test_the_merge_says_who_and_from_which_file(api: Api) -> None:
    """``document`` goes into the history with user and time."""
    parent, a = api.items(2)
    api.upload(parent, model_file(b"gearbox"), "Gearbox.FCStd")
    sha256 = hashlib.sha256(model_file(b"gearbox")).hexdigest()
    document = {"file": "Gearbox.FCStd", "sha256": sha256, "revision": 1}
    api.merge(parent, {a: 1}, document=document, sync_id="with-document")
    change = api.get(bom(parent, "history"))[0]
    assert change["document"] == document
    assert (change["user"], change["kind"], change["sync_id"]) == ("admin", "merge", "with-document")
    api.bad(400, "POST", bom(parent, "merge"), merge_body({a: 1}, document={"sha256": "short"}))
