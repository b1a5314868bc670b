# SPDX-License-Identifier: LGPL-2.1-or-later
"""The merge as a request: idempotence, preview, versions, everything that is refused."""

from __future__ import annotations

import hashlib
import json
import threading
from typing import Any

import pytest
from server_testing import Api, bom, form_body, merge_body


def test_the_same_request_twice_gives_the_same_state(api: Api) -> None:
    """Idempotent by content: the second merge changes no line."""
    parent, a, b = api.items(3)
    api.merge(parent, {a: 1, b: 2})
    before = api.get(bom(parent))
    api.merge(parent, {a: 1, b: 2})
    assert api.get(bom(parent)) == before


def test_a_sync_id_gives_the_same_answer_again(api: Api) -> None:
    """Idempotent by ``sync_id``: the first answer again, byte by byte, though the BOM changed since."""
    parent, a, b = api.items(3)
    body = merge_body({a: 1}, sync_id="sync-1")
    first = api.call("POST", bom(parent, "merge"), body)
    api.merge(parent, {b: 1})
    after = api.get(bom(parent))
    again = api.call("POST", bom(parent, "merge"), body)
    assert again.status == 200
    assert again.body == first.body
    assert api.get(bom(parent)) == after


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


def test_a_sync_id_for_another_content_is_refused(api: Api) -> None:
    """A ``sync_id`` names one BOM; silently giving the old answer to new content would lose the new."""
    parent, a = api.items(2)
    api.merge(parent, {a: 1}, sync_id="mine")
    error = api.bad(409, "POST", bom(parent, "merge"), merge_body({a: 2}, sync_id="mine"))
    assert "sync_id 'mine' was used before" in error["message"]


def test_a_sync_id_belongs_to_its_parent(api: Api) -> None:
    """Two assemblies may use the same ``sync_id``."""
    first, second, a = api.items(3)
    api.merge(first, {a: 1}, sync_id="shared")
    assert api.merge(second, {a: 2}, sync_id="shared")["diff"]["added"] == [{"part_number": a, "quantity": 2}]


def test_a_dry_run_gives_the_answer_without_the_change(api: Api) -> None:
    """``dry_run``: the same JSON as the merge gives then; no line, version or event of it."""
    parent, a, b = api.items(3)
    api.merge(parent, {a: 1})
    before = api.get(bom(parent))
    preview = api.merge(parent, {b: 2}, dry_run=True, sync_id="not kept")
    assert api.get(bom(parent)) == before
    assert len(api.get(bom(parent, "history"))) == 1
    assert api.merge(parent, {b: 2}, sync_id="not kept") == preview


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


def test_a_repeat_with_sync_id_is_answered_even_where_if_match_is_old_by_now(api: Api) -> None:
    """The retry after a lost answer carries the old version: it must give the answer, not 412."""
    parent, a = api.items(2)
    headers = {"If-Match": api.call("GET", bom(parent)).headers["etag"]}
    body = merge_body({a: 1}, sync_id="retry")
    first = api.call("POST", bom(parent, "merge"), body, headers=headers)
    again = api.call("POST", bom(parent, "merge"), body, headers=headers)
    assert (again.status, again.body) == (200, first.body)


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


@pytest.mark.parametrize("quantity", [0, -1, None, "2", True, [], 1e10])
def test_a_quantity_is_a_finite_number_above_zero(api: Api, quantity: Any) -> None:
    """Anything else is refused, in merges and by hand."""
    parent, a = api.items(2)
    entries = [{"child_part_number": a, "quantity": quantity}]
    assert "quantity" in api.bad(400, "POST", bom(parent, "merge"), {"entries": entries})["problems"][0]
    if not isinstance(quantity, str | bool):
        api.bad(400, "POST", bom(parent), {"child_part_number": a, "quantity": quantity})


@pytest.mark.parametrize("word", ["NaN", "Infinity", "-Infinity", "1e999"])
def test_what_is_no_json_number_is_refused(api: Api, word: str) -> None:
    """Python's JSON would read NaN and Infinity; the server does not."""
    parent, a = api.items(2)
    text = f'{{"entries": [{{"child_part_number": "{a}", "quantity": {word}}}]}}'
    api.bad(400, "POST", bom(parent, "merge"), body=text.encode())


@pytest.mark.parametrize("text", ["", "[", "[]", "null", '{"entries": 1}', "{}", "\udce4"])
def test_a_body_that_is_no_merge_is_refused(api: Api, text: str) -> None:
    """400 with what was wanted."""
    parent = api.item()
    raw = text.encode("utf-8", "surrogateescape")
    assert "body" in api.bad(400, "POST", bom(parent, "merge"), body=raw)["message"]


def test_an_unknown_parent_is_404(api: Api) -> None:
    """404 for the parent, before anything is said of the entries."""
    error = api.bad(404, "POST", bom("NO-SUCH-ASM", "merge"), {"entries": []})
    assert error["error"] == "not_found"
    assert "NO-SUCH-ASM" in error["message"]


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
    body, headers = form_body({"file": ("Gearbox.FCStd", b"gearbox")})
    api.good("POST", f"/api/items/{parent}/file", body=body, headers=headers)
    sha256 = hashlib.sha256(b"gearbox").hexdigest()
    document = {"file": "Gearbox.FCStd", "sha256": sha256, "revision": 1}
    api.merge(parent, {a: 1}, document=document, sync_id="with-document")
    change = api.get(bom(parent, "history"))[0]
    assert change["document"] == document
    assert (change["user"], change["kind"], change["sync_id"]) == ("admin", "merge", "with-document")
    api.bad(400, "POST", bom(parent, "merge"), merge_body({a: 1}, document={"sha256": "short"}))


def test_a_thousand_lines_at_once(api: Api) -> None:
    """A big assembly is one request; all of it arrives, in its order."""
    parent = api.item()
    children = api.items(60)
    entries = {child: n + 1 for n, child in enumerate(children)}
    answer = api.merge(parent, entries)
    assert len(answer["diff"]["added"]) == 60
    assert [line["child_part_number"] for line in api.get(bom(parent))] == children
    assert json.dumps(api.quantities(parent)) == json.dumps(entries)
