# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which item, which line, which version, which moment: nobody is answered about another one."""

from __future__ import annotations

import threading
import uuid
from typing import Any
from urllib.parse import quote

import pytest
from hunting import BOTH
from server_testing import Api, bom

pytestmark = BOTH


def together(count: int, work: Any) -> list[Any]:
    """What so many threads get that do ``work(number)`` at the same moment."""
    gate, got = threading.Barrier(count), []

    def run(number: int) -> None:
        gate.wait(60)
        got.append(work(number))

    threads = [threading.Thread(target=run, args=(n,)) for n in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(90)
    assert len(got) == count
    return got


@pytest.mark.parametrize("numbered", [True, False])
def test_the_same_new_item_sent_many_times_at_once_is_one_item(api: Api, numbered: bool) -> None:
    """Every answer is that item: a client that lost its answer must not hear that its number is taken."""
    for _ in range(3):
        body: dict[str, Any] = {"id": str(uuid.uuid4()), "name": "Same", "category": "F01"}
        if numbered:
            body["part_number"] = "SAME-" + uuid.uuid4().hex[:8]

        def send(_: int, body: dict[str, Any] = body) -> tuple[int, Any]:
            answer = api.as_(api.token).call("POST", "/api/items", body)
            return answer.status, answer.json()

        got = together(8, send)
        assert sorted({status for status, _ in got}) in ([200, 201], [201])
        assert [status for status, _ in got].count(201) == 1
        assert {item["id"] for _, item in got} == {body["id"]}
        assert len({item["part_number"] for _, item in got}) == 1


def test_a_repeat_gives_the_item_also_when_it_was_renamed(api: Api) -> None:
    """The same request gives it; one that names another number, even its new one, is another request."""
    first = "OLD-" + uuid.uuid4().hex[:8]
    body = {"id": str(uuid.uuid4()), "part_number": first, "name": "Renamed"}
    api.good("POST", "/api/items", body)
    api.good("PUT", f"/api/items/{first}", {"part_number": first + "-new"})
    answer = api.call("POST", "/api/items", body)
    assert (answer.status, answer.json()["part_number"]) == (200, first + "-new")
    for number in (first.lower(), first + "-new"):
        api.bad(409, "POST", "/api/items", {**body, "part_number": number})
    api.bad(409, "POST", "/api/items", {**body, "part_number": "OTHER-1"})


def test_a_component_and_an_alternate_of_one_child_are_two_lines(api: Api) -> None:
    """Each is reached by its id; by the child alone nobody is guessed at."""
    parent, child = api.items(2)
    for rel_type, quantity in (("alternate", 7), ("component", 1)):
        body = {"child_part_number": child, "rel_type": rel_type, "quantity": quantity}
        api.good("POST", bom(parent), body)
    ids = {line["rel_type"]: line["id"] for line in api.get(bom(parent))}
    for method in ("PUT", "DELETE"):
        told = api.bad(409, method, bom(parent, child), {"quantity": 9} if method == "PUT" else None)
        assert ids["alternate"] in told["message"]
    changed = api.good("PUT", bom(parent, f"lines/{ids['alternate']}"), {"quantity": 9})
    assert (changed["rel_type"], changed["quantity"]) == ("alternate", 9)
    decisions = [{"line_id": ids["alternate"], "action": "remove"}]
    api.good("POST", bom(parent, "resolve"), {"decisions": decisions})
    assert [line["rel_type"] for line in api.get(bom(parent))] == ["component"]
    api.bad(404, "DELETE", bom(parent, f"lines/{ids['alternate']}"))
    other = api.item()
    api.bad(404, "DELETE", bom(other, f"lines/{ids['component']}"))
    assert api.call("DELETE", bom(parent, f"lines/{ids['component']}")).status == 204
    assert api.get(bom(parent)) == []


def test_an_item_has_a_version_and_if_match(api: Api) -> None:
    """Each change counts it up; who made his from an older one gets 412, and nothing is changed."""
    number = api.item()
    path = f"/api/items/{number}"
    steps: list[tuple[str, str, Any]] = [
        ("PUT", path, {"name": "second"}),
        ("PUT", path, {"properties": {"a": 1}}),
        ("PATCH", path + "/properties", {"b": 2}),
        ("POST", path + "/revisions", {"properties": {"c": 3}}),
        ("DELETE", path, None),
    ]
    for method, where, body in steps:
        read = api.call("GET", path)
        etag = read.headers["etag"]
        assert etag == f'"v{read.json()["version"]}"'
        if method != "POST":
            api.bad(412, method, where, body, headers={"If-Match": '"v0"'})
        assert api.call("GET", path).json() == read.json()
        api.good(method, where, body, headers={"If-Match": etag})
        after = api.get("/api/items?include_archived=true&search=" + number)[0]
        assert after["version"] > read.json()["version"]
    same = api.good("POST", path + "/unarchive")
    assert api.good("PUT", path, {"name": same["name"]})["version"] == same["version"]


# The examples of RFC 7386, appendix A, that are about objects: what was, the patch, what becomes of it.
PATCHES: list[tuple[Any, Any, Any]] = [
    ({"a": "b"}, {"a": "c"}, {"a": "c"}),
    ({"a": "b"}, {"b": "c"}, {"a": "b", "b": "c"}),
    ({"a": "b"}, {"a": None}, {}),
    ({"a": "b", "b": "c"}, {"a": None}, {"b": "c"}),
    ({"a": ["b"]}, {"a": "c"}, {"a": "c"}),
    ({"a": "c"}, {"a": ["b"]}, {"a": ["b"]}),
    ({"a": {"b": "c"}}, {"a": {"b": "d", "c": None}}, {"a": {"b": "d"}}),
    ({"a": [{"b": "c"}]}, {"a": [1]}, {"a": [1]}),
    ({"e": None}, {"a": 1}, {"e": None, "a": 1}),
    ({}, {"a": {"bb": {"ccc": None}}}, {"a": {"bb": {}}}),
]


def test_properties_are_patched_as_the_rfc_says(api: Api) -> None:
    """A new revision with the merged properties; the same patch again makes none."""
    headers = {"Content-Type": "application/merge-patch+json"}
    for before, patch, after in PATCHES:
        path = f"/api/items/{api.item(properties=before)}/properties"
        made = api.good("PATCH", path, patch, headers=headers)
        assert made["properties"] == after, patch
        again = api.good("PATCH", path, patch, headers=headers)
        assert again["current_revision"] == made["current_revision"]
    for wrong in ([1], "x", 3, None):
        text = b"null" if wrong is None else str(wrong).replace("'", '"').encode()
        assert api.call("PATCH", path, body=text, headers=headers).status == 400


def test_a_changes_own_time_is_the_state_it_left(api: Api) -> None:
    """Times that the server told mean the same moment when they come back, to the microsecond."""
    parent, *children = api.items(6)
    for number, child in enumerate(children):
        api.add_line(parent, child, quantity=number + 1)
    changes = api.get(bom(parent, "history"))[::-1]
    for number, change in enumerate(changes, start=1):
        for when in (quote(change["at"]), change["at"].replace("Z", "%2B00:00")):
            rows = api.get(bom(parent, f"compare?from=0&to={when}"))
            assert rows["to"] == change["id"]
            assert [row["child_part_number"] for row in rows["lines"]] == children[:number]


def test_an_upload_keeps_the_properties_that_it_does_not_name(api: Api) -> None:
    """What is given with a file is added to what is there."""
    number = api.item(properties={"kept": 1, "changed": 1})
    made = api.upload(number, properties='{"changed": 2, "new": 3}')
    assert made["properties"] == {"kept": 1, "changed": 2, "new": 3}
