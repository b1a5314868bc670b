# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the OpenAPI document calls valid is accepted, and what it calls invalid is refused.

One row for each kind that ``benchmarks/server_fuzz.py`` found, so that it stays found.
"""

from __future__ import annotations

from typing import Any
from uuid import uuid4

import jsonschema_rs
import pytest
from hunting import over
from server_testing import Api, bom

pytestmark = over("postgres")  # it refuses more

NUL = "a\x00b"
DEEP: dict[str, Any] = {"a": [{"b": [1.5, None, True, {"c": "text"}]}]}
REFUSED = "x-valid-but-refused"

LINE = ("PUT", "line")
ITEM = ("POST", "items")
CHANGE = ("PUT", "item")
MERGE = ("POST", "merge")
HELD = ("POST", "held")
RESTORE = ("POST", "restore")
RELEASE = ("POST", "releases")
ROWS: list[tuple[tuple[str, str], dict[str, Any], bool]] = [
    (ITEM, {"category": "F01"}, True),
    (ITEM, {"category": "F01", "part_number": "", "id": None, "item_type": None}, True),
    (ITEM, {"category": "F01", "id": "0"}, False),
    (ITEM, {"category": "F01", "id": ""}, False),
    (ITEM, {"category": "nothing"}, False),
    (ITEM, {"category": "", "part_number": ""}, False),
    (ITEM, {}, False),
    (ITEM, {"category": None, "part_number": None}, False),
    (ITEM, {"category": "F01", "item_type": "bolt"}, False),
    (ITEM, {"part_number": "a/b"}, True),
    (ITEM, {"part_number": "a\u0001b"}, False),
    (ITEM, {"part_number": ".."}, True),
    (ITEM, {"part_number": "search"}, True),
    (ITEM, {"part_number": "a\u0085b"}, False),
    (ITEM, {"part_number": "\n\fa"}, False),
    (ITEM, {"part_number": "a\x1f"}, False),
    (RESTORE, {"change_id": 0, "with_archived": 0}, False),
    (RESTORE, {"change_id": 0, "with_archived": False}, True),
    (RELEASE, {"with_parts": "no"}, False),
    (RELEASE, {"with_parts": 0}, False),
    (ITEM, {"part_number": "N" * 65}, False),
    (ITEM, {"category": "F01", "properties": DEEP}, True),
    (ITEM, {"category": "F01", "properties": {NUL: 1}}, False),
    (ITEM, {"category": "F01", "properties": {"a": [{"b": NUL}]}}, False),
    (ITEM, {"category": "F01", "properties": {"k" * 201: 1}}, False),
    (ITEM, {"category": "F01", "properties": {"n": 2**63, "m": -(10**308)}}, True),
    (ITEM, {"category": "F01", "properties": {"n": 6.02214076e23, "m": [1e300]}}, True),
    (ITEM, {"category": "F01", "properties": {"n": 17976931348623157 * 10**292}}, True),
    (ITEM, {"category": "F01", "properties": {"n": 2 * 10**308}}, False),
    (ITEM, {"category": "F01", "properties": {"a": [-(10**309)]}}, False),
    (CHANGE, {"part_number": ""}, False),
    (CHANGE, {"name": "", "description": "", "item_type": "tool", "properties": None}, True),
    (LINE, {"quantity": 3, "rel_type": "component", "source": "manual"}, True),
    (LINE, {"unit": None, "find_number": None, "notes": None, "metadata": None}, True),
    (LINE, {"source": None}, False),
    (LINE, {"rel_type": None}, False),
    (LINE, {"quantity": None}, False),
    (LINE, {"rel_type": ""}, False),
    (LINE, {"source": "robot"}, False),
    (LINE, {"unit": "u" * 33}, False),
    (LINE, {"find_number": "1" * 33}, False),
    (LINE, {"child_revision": 2.0}, True),
    (LINE, {"child_revision": 2.5}, False),
    (LINE, {"metadata": {"a": {NUL: 1}}}, False),
    (MERGE, {"entries": [], "document": None, "left_out": None, "dry_run": None, "sync_id": None}, True),
    (MERGE, {"entries": [], "document": {"file": "A.FCStd", "sha256": None, "revision": 2.0}}, True),
    (MERGE, {"entries": [], "document": {}}, False),
    (MERGE, {"entries": [], "document": {"file": None}}, False),
    (MERGE, {"entries": [], "document": {"file": "A", "sha256": "ab"}}, False),
    (MERGE, {"entries": [], "document": {"file": "A", "revision": 2**31}}, False),
    (MERGE, {"entries": [], "sync_id": ""}, False),
    (MERGE, {"entries": [], "sync_id": "s" * 129}, False),
    (MERGE, {"entries": [], "dry_run": 1}, False),
    (MERGE, {"entries": [], "left_out": [{"reason": "missing", "quantity": 0}]}, True),
    (MERGE, {"entries": [], "left_out": [{"reason": ""}]}, False),
    (MERGE, {"entries": [], "left_out": [{"reason": "missing", "quantity": False}]}, False),
    (MERGE, {"entries": [], "left_out": [{"reason": "missing", "quantity": None}]}, False),
    (MERGE, {"entries": [], "left_out": [{"reason": "missing", "name": NUL}]}, False),
    (MERGE, {"entries": [{"child_part_number": " ", "quantity": 1}]}, False),
    (MERGE, {"entries": [{"child_part_number": "LEAF", "quantity": 2e9}]}, False),
    (HELD, {"left_out": [{"reason": "missing", "name": "Cover", "quantity": 2}]}, True),
    (HELD, {"left_out": [{"reason": "broken"}], "document": {"file": "A.FCStd", "folder": None}}, True),
    (HELD, {"left_out": []}, False),
    (HELD, {"left_out": None}, False),
    (HELD, {"left_out": [{"reason": ""}]}, False),
    (HELD, {"left_out": [{"reason": "missing"}], "document": {}}, False),
    (("POST", "generate"), {"category": "F01"}, True),
    (("POST", "generate"), {"category": "0"}, False),
    (("POST", "users"), {"username": "fuzz.one", "password": None}, True),
    (("POST", "users"), {"username": "0" * 65}, False),
    (("POST", "users"), {"username": ".hidden"}, False),
    (("POST", "users"), {"username": "fuzz.two", "password": "short"}, False),
    (("PUT", "user"), {"password": "12"}, False),
    (("PUT", "user"), {"active": 0.0}, False),
    (("PUT", "user"), {"active": "no"}, False),
    (("PUT", "user"), {"active": True}, True),
    (("POST", "tokens"), {"name": NUL}, False),
    (("POST", "tokens"), {"name": ""}, False),
    *((ITEM, {"category": "F01", "name": f"a{c}"}, False) for c in "\x01\x7f\x9b\ufdd0\uffff\U0010fffe"),
    *((ITEM, {"part_number": f"a{c}b"}, False) for c in "\u200b\u202e\u2066\ufdef\U0001ffff"),
    (ITEM, {"category": "F01", "name": "a\tb\nc\rd\u200b\u00a0\U0001f529"}, True),
]
BODIES = {
    "line": "LineChangeBody",
    "items": "NewItemBody",
    "item": "ItemChangeBody",
    "merge": "MergeRequest",
    "held": "HeldReport",
    "generate": "NumberBody",
    "users": "NewUserBody",
    "user": "UserChangeBody",
    "tokens": "TokenBody",
    "restore": "RestoreBody",
    "releases": "SubmitBody",
}


@pytest.fixture
def document(api: Api) -> Any:
    """The document that the server hands out."""
    return api.get("/api/openapi.json")


def reader(document: Any, schema: dict[str, Any]) -> Any:
    """What says by the document whether a value is valid; formats count."""
    whole = {**schema, "components": document["components"]}
    return jsonschema_rs.Draft202012Validator(whole, validate_formats=True)


def test_a_body_is_accepted_exactly_where_the_document_calls_it_valid(api: Api, document: Any) -> None:
    """The document's word, the server's, and ours are one."""
    api.call("POST", "/api/users", {"username": "another"})
    parent, child, restored = api.items(3)
    api.add_line(parent, child)
    wrong = []
    readers = {
        what: reader(document, {"$ref": f"#/components/schemas/{name}"}) for what, name in BODIES.items()
    }
    for (method, what), body, valid in ROWS:
        path = {
            "line": f"{bom(parent)}/{child}",
            "item": f"/api/items/{parent}",
            "items": "/api/items",
            "merge": bom(parent, "merge"),
            "held": bom(parent, "held"),
            "generate": "/api/generate-part-number",
            "users": "/api/users",
            "user": "/api/users/another",
            "tokens": "/api/auth/tokens",
            "restore": bom(restored, "restore"),
            "releases": f"/api/items/{parent}/releases",
        }[what]
        said = readers[what].is_valid(body)
        if what == "users":
            body = {**body, "username": f"{body['username']}{uuid4().hex[:8] if valid else ''}"}
        status = api.call(method, path, body).status
        if said is not valid or status not in ((200, 201) if valid else (400,)):
            wrong.append((method, what, body, "valid" if valid else "invalid", said, status))
    assert not wrong


def parameter(document: Any, path: str, name: str) -> Any:
    """The reader of a parameter of a GET."""
    parameters = document["paths"][f"/api/items/{{part_number}}/bom/{path}"]["get"]["parameters"]
    return reader(document, next(each["schema"] for each in parameters if each["name"] == name))


def test_a_point_to_compare_is_what_the_document_says(api: Api, document: Any) -> None:
    """Digits without end are no change, and a time has a zone."""
    address, read = bom(api.item(), "compare"), parameter(document, "compare", "to")
    for point, valid in {
        "now": True,
        "0": True,
        "2026-02-08T22:15:00Z": True,
        "2026-01-31T22:15:00.123456%2B01:00": True,
        "2020-12-30T00:00:00Z": True,
        "2024-02-29T00:00:00-14:00": True,
        "2025-02-29T00:00:00Z": False,
        "0000-01-01T00:00:00Z": False,
        "2026-02-08T22:15:00": False,
        "0" * 39: False,
        "yesterday": False,
    }.items():
        assert read.is_valid(point.replace("%2B", "+")) is valid, point
        assert api.call("GET", f"{address}?to={point}").status == (200 if valid else 400), point


@pytest.mark.parametrize("form", ["", ".csv", ".xlsx"], ids=["json", "csv", "xlsx"])
def test_a_moment_of_what_changed_is_what_the_document_says(api: Api, document: Any, form: str) -> None:
    """A date, a time with its zone, a revision or a frozen revision; the item may not have these two."""
    address = f"{bom(api.item(), 'changes')}{form}"
    for name, query in (("from", ""), ("to", "from=2026-01-01&")):
        read = parameter(document, f"changes{form}", name)
        for moment, valid in {
            "2026-02-08": True,
            "2026-02-08T22:15:00%2B01:00": True,
            "r1": True,
            "2026-02-30": False,
            "2026-02-08T22:15:00": False,
            "0": False,
            "r": True,
            "r-1": True,
            "r/1": False,
            "a" * 17: False,
        }.items():
            assert read.is_valid(moment.replace("%2B", "+")) is valid, moment
            status = api.call("GET", f"{address}?{query}{name}={moment}").status
            assert status in ((200, 404) if valid else (400,)), moment


def test_an_operation_that_refuses_what_has_the_right_form_says_why(api: Api, document: Any) -> None:
    """The reason stands at the operation and at its 400; these and no others."""
    told = {
        f"{method.upper()} {path}": operation
        for path, operations in document["paths"].items()
        for method, operation in operations.items()
        if REFUSED in operation
    }
    expected = (
        "file file files geometry import import import import merge resolve structure suppliers thumbnail"
    )
    assert sorted(name.rpartition("/")[2] for name in told) == expected.split()
    for operation in told.values():
        assert operation[REFUSED] in operation["responses"]["400"]["description"]


def test_a_uuid_in_a_path_has_its_format(api: Api, document: Any) -> None:
    """``by-uuid/0`` is no UUID by the document, and 400."""
    (parameter,) = document["paths"]["/api/items/by-uuid/{uuid}"]["get"]["parameters"]
    assert parameter["schema"]["format"] == "uuid"
    assert api.call("GET", "/api/items/by-uuid/0").status == 400
    assert api.call("GET", f"/api/items/by-uuid/{uuid4()}").status == 404


def test_a_repeat_is_judged_like_the_first_request(api: Api) -> None:
    """An id that is known is no way past the rules."""
    first = {"id": str(uuid4()), "category": "F01"}
    assert api.call("POST", "/api/items", first).status == 201
    for more in (
        {"properties": {NUL: 1}},
        {"item_type": "bolt"},
        {"category": "nothing"},
        {"category": None},
        {"part_number": "a\x01b"},
    ):
        assert api.call("POST", "/api/items", {**first, **more}).status == 400, more
    assert api.call("POST", "/api/items", first).status == 200
