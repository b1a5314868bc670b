# SPDX-License-Identifier: LGPL-2.1-or-later
"""Requests that come twice: the same gets the first answer, another one under the same key is refused."""

from __future__ import annotations

import json
import uuid
from collections.abc import Callable
from typing import Any

import pytest
from hunting import BOTH
from model_file import model_file
from server_testing import Answer, Api, bom, form_body

Send = Callable[[Api, str, dict[str, Any]], Answer]


def merge(api: Api, item: str, said: dict[str, Any]) -> Answer:
    return api.call("POST", bom(item, "merge"), said)


def upload(api: Api, item: str, said: dict[str, Any]) -> Answer:
    fields = {**said, "file": tuple(said["file"])}
    body, headers = form_body({name: value for name, value in fields.items() if name != "key"})
    headers = {**headers, "Idempotency-Key": said["key"]}
    return api.call("POST", f"/api/items/{item}/file", body=body, headers=headers)


def create(api: Api, item: str, said: dict[str, Any]) -> Answer:
    key = {"Idempotency-Key": said["key"]} if "key" in said else {}
    return api.call("POST", "/api/items", {k: v for k, v in said.items() if k != "key"}, headers=key)


def import_csv(api: Api, item: str, said: dict[str, Any]) -> Answer:
    body, headers = said["csv"].encode(), {"Content-Type": "text/csv"}
    if "name" in said:
        body, headers = form_body({"file": (said["name"], body)})
    return api.call(
        "POST", bom(item, "import"), body=body, headers={**headers, "Idempotency-Key": said["key"]}
    )


# LEAF is a part.
MERGE = {
    "sync_id": "KEY",
    "entries": [
        {"child_part_number": "LEAF", "quantity": 2, "components": [{"file": "a.FCStd", "object": "B"}]}
    ],
    "left_out": [{"reason": "missing", "name": "Lid", "file": "lid.FCStd"}],
    "document": {"file": "Top.FCStd", "folder": "robot"},
}
UPLOAD = {
    "key": "KEY",
    "file": ("a.FCStd", model_file(b"one")),
    "comment": "first",
    "properties": '{"mass_kg": 1}',
    "path": "parts/a.FCStd",
    "base_revision": "0",
    "links": "[]",
}
ITEM = {"id": "UUID", "category": "F01", "name": "Screw", "properties": {"a": 1}}
IMPORT = {"key": "KEY", "csv": "Part number,Quantity\nLEAF,3\n"}
# How it is sent, the request, and by what the other requests differ, one by one.
ROWS: list[tuple[Send, dict[str, Any], list[dict[str, Any]]]] = [
    (
        merge,
        MERGE,
        [
            {"entries": [{"child_part_number": "LEAF", "quantity": 3}]},
            {"entries": [{"child_part_number": "LEAF", "quantity": 2}]},
            {"left_out": []},
            {"document": {"file": "Other.FCStd", "folder": "robot"}},
            {"document": {"file": "Top.FCStd", "folder": "arm"}},
        ],
    ),
    (
        upload,
        UPLOAD,
        [
            {"file": ("a.FCStd", model_file(b"two"))},
            {"file": ("b.FCStd", model_file(b"one"))},
            {"comment": "second"},
            {"properties": '{"mass_kg": 2}'},
            {"path": "a.FCStd"},
            {"base_revision": "1"},
            {"links": '[{"path": "b.FCStd", "item": "", "sha256": ""}]'},
        ],
    ),
    (
        create,
        ITEM,
        [{"name": "Bolt"}, {"category": "F02"}, {"properties": {"a": 2}}, {"part_number": "LEAF-2"}],
    ),
    (create, {**ITEM, "id": None, "key": "KEY"}, [{"name": "Bolt"}]),
    (import_csv, IMPORT, [{"csv": "Part number,Quantity\nLEAF,4\n"}]),
    (import_csv, {**IMPORT, "name": "robot.csv"}, [{"name": "arm.csv"}]),
]


@BOTH
@pytest.mark.parametrize(
    ("send", "request_", "others"), ROWS, ids=[f"{s.__name__}-{n}" for n, (s, *_) in enumerate(ROWS)]
)
def test_a_key_stands_for_one_whole_request(
    api: Api, send: Send, request_: dict[str, Any], others: list[dict[str, Any]]
) -> None:
    """Once more: the same answer, nothing is done. With other content: 409, and the first stays."""
    parent, leaf = api.items(2)
    key, wanted_id = uuid.uuid4().hex, str(uuid.uuid4())

    def filled(said: dict[str, Any]) -> dict[str, Any]:
        files = {name: value for name, value in said.items() if name == "file"}
        text = json.dumps({name: value for name, value in said.items() if name != "file"})
        return {
            **json.loads(text.replace("KEY", key).replace("UUID", wanted_id).replace("LEAF", leaf)),
            **files,
        }

    def state() -> Any:
        events = api.get("/api/items?limit=1000&include_archived=true")
        return [
            events,
            api.get(bom(parent)),
            api.get(bom(parent, "history")),
            api.get(f"/api/items/{parent}/revisions"),
        ]

    first = send(api, parent, filled(request_))
    assert first.status in (200, 201), first.body
    before = state()
    again = send(api, parent, filled(request_))
    assert (again.status in (200, 201), again.json()) == (True, first.json())
    for other in others:
        refused = send(api, parent, filled({**request_, **other}))
        assert (refused.status, refused.json()["error"]) == (409, "conflict"), (other, refused.body)
        assert "was used before for another request" in refused.json()["message"]
    assert state() == before


@BOTH
def test_a_key_belongs_to_its_item_and_its_kind(api: Api) -> None:
    """A commit names its file and its BOM by one key."""
    parent, other, leaf = api.items(3)
    said = {"sync_id": "one", "entries": [{"child_part_number": leaf, "quantity": 1}]}
    for item in (parent, other):
        assert merge(api, item, said).status == 200
        assert upload(api, item, {"key": "one", "file": ("a", model_file(b"x"))}).status == 201
        assert import_csv(api, item, {"key": "one", "csv": f"Part number,Quantity\n{leaf},1\n"}).status == 200


@pytest.mark.parametrize(
    ("key", "problem"),
    [
        ("", "wanted 1 to 128 characters"),
        ("k" * 129, "wanted a text of at most 128 characters"),
        ("a\x9fb", "wanted text without control characters and non-characters, got U+009F"),
    ],
    ids=["empty", "too long", "a control character"],
)
def test_a_key_is_a_short_text(api: Api, key: str, problem: str) -> None:
    """Nothing is made under a key that is refused; 128 characters are a key."""
    before = api.get("/api/items")
    refused = create(api, "", {"category": "F01", "key": key})
    assert (refused.status, refused.json()["error"]) == (400, "rejected")
    assert f"Idempotency-Key: {problem}" in refused.json()["message"]
    assert api.get("/api/items") == before
    assert create(api, "", {"category": "F01", "key": uuid.uuid4().hex * 4}).status == 201


def test_an_id_that_is_known_is_no_new_item(api: Api) -> None:
    """Whoever made it: an id without the request that made it is that of another item."""
    item = api.get(f"/api/items/{api.item()}")
    error = api.bad(409, "POST", "/api/items", {"category": "F01", "id": item["id"], "name": item["name"]})
    assert item["part_number"] in error["message"]
