# SPDX-License-Identifier: LGPL-2.1-or-later
"""Values that nobody means, on every way in: refused with a sentence, and nobody else is harmed."""

from __future__ import annotations

import io
import itertools
import json
import struct
import zipfile
from typing import Any
from urllib.parse import quote, urlencode

import pytest
from hunting import BOTH, over
from model_file import model_file
from server_testing import Answer, Api, bom, form_body

DEPTHS = [33, 260, 900, 20_000]


def nested(depth: int) -> str:
    """A JSON object with so many levels, as text: Python's own writer gives up at a thousand."""
    return '{"a":' * depth + "1" + "}" * depth


HOSTILE = {
    **{f"{depth} levels": nested(depth) for depth in DEPTHS},
    "NaN": '{"m": NaN}',
    "Infinity": '{"m": -Infinity}',
    "an infinite number": '{"m": 1e999}',
    "a long key": json.dumps({"k" * 201: 1}),
    "a deep long key": json.dumps({"a": [{"k" * 201: 1}]}),
    "a long whole number": '{"m": ' + "9" * 309 + "}",
    "one more than a double": json.dumps({"m": 17976931348623157 * 10**292 + 1}),
    "a whole number that Python refuses": '{"m": ' + "9" * 5000 + "}",
    "half a surrogate pair": '{"m": "\\ud800"}',
    "NUL": '{"m": "\\u0000"}',
    "300 KiB": json.dumps({"m": "x" * 300 * 1024}),
}
# The method, the address and the body of each way in; PARENT is an item with a line of CHILD.
WAYS = {
    "item": ("POST", "/api/items", '{"part_number":"PARENT-2","properties":VALUE}'),
    "item change": ("PUT", "/api/items/PARENT", '{"properties":VALUE}'),
    "item patch": ("PATCH", "/api/items/PARENT/properties", "VALUE"),
    "revision": ("POST", "/api/items/PARENT/revisions", '{"properties":VALUE}'),
    "upload": ("POST", "/api/items/PARENT/file", ""),
    "line": (
        "POST",
        "/api/items/PARENT/bom",
        '{"child_part_number":"CHILD","rel_type":"reference","metadata":VALUE}',
    ),
    "line change": ("PUT", "/api/items/PARENT/bom/CHILD", '{"metadata":VALUE}'),
}


@pytest.fixture
def line(api: Api) -> tuple[str, str]:
    """An item with a line, and the part of the line."""
    parent, child = api.items(2)
    api.add_line(parent, child)
    return parent, child


def send(api: Api, way: str, line: tuple[str, str], text: str) -> Answer:
    """Send a JSON object as properties or metadata on one of the ways in."""
    method, path, body = (part.replace("PARENT", line[0]).replace("CHILD", line[1]) for part in WAYS[way])
    data, headers = body.replace("VALUE", text).encode(), {"Content-Type": "application/json"}
    if way == "upload":
        data, headers = form_body({"file": ("x.FCStd", model_file(b"x")), "properties": text})
    return api.call(method, path, body=data, headers=headers)


@pytest.mark.parametrize("way", WAYS)
def test_a_value_that_cannot_be_served_is_refused(api: Api, way: str, line: tuple[str, str]) -> None:
    """400, nothing is stored, and all that lists the item works afterwards.

    A body that no parser takes to its end is over the budget of a body, which is 413; an upload has its
    properties in a field of its form.
    """
    for name, text in HOSTILE.items():
        answer = send(api, way, line, text)
        over_budget = name == "20000 levels" and way != "upload"
        assert answer.status == (413 if over_budget else 400), (name, answer.status, answer.body[:300])
        assert answer.json()["message"], name
    assert api.get(f"/api/items/{line[0]}")["properties"] == {}
    assert [one["metadata"] for one in api.get(bom(line[0]))] == [{}]


@over("postgres")  # it refuses more
@pytest.mark.parametrize("way", WAYS)
def test_what_is_let_in_is_served_as_it_was_sent(api: Api, way: str, line: tuple[str, str]) -> None:
    """The deepest and strangest value that the guard lets in comes back whole, everywhere."""
    value: Any = {"k" * 200: [1, 0.1, True, None, "ü‘\u2028"], "n": 2**62}
    for _ in range(30):
        value = {"a": value}
    answer = send(api, way, line, json.dumps(value))
    assert answer.status in (200, 201), answer.body[:300]
    parent = line[0]
    number = f"{parent}-2" if way == "item" else parent
    last = api.get(bom(parent))[-1]
    told = last["metadata"] if way.startswith("line") else api.get(f"/api/items/{number}")["properties"]
    assert told == value
    for rest in ("expanded", "flat", "history", "export.json"):
        assert api.get(bom(parent, rest))


def test_restore_takes_a_whole_number_and_nothing_that_looks_like_one(
    api: Api, line: tuple[str, str]
) -> None:
    """``false`` is not change 0, the empty BOM."""
    for change in (False, True, "0", 0.5, None):
        api.bad(400, "POST", bom(line[0], "restore"), {"change_id": change})
    assert list(api.lines(line[0])) == [line[1]]


@BOTH
def test_a_moment_at_the_end_of_the_calendar(api: Api, line: tuple[str, str]) -> None:
    """An answer or a 400, never a fault."""
    for moment in (
        "0001-01-01T00:00:00+14:00",
        "9999-12-31T23:59:59-14:00",
        "0001-01-01T00:00:00Z",
        "2026-02-30T00:00:00Z",
        "²",
        "1" * 40,
        "",
    ):
        for name in ("from", "to"):
            answer = api.call("GET", bom(line[0], "compare") + "?" + urlencode({name: moment}))
            assert answer.status in (200, 400), (name, moment)


def test_a_revision_in_a_csv_that_is_no_number(api: Api, line: tuple[str, str]) -> None:
    """Reported with its row beside revisions of Silo; a column of foreign revisions alone is unused."""
    other = api.item()
    for revision in ("²", "5" * 5000, "-1", "1.0", "٣", "1e3"):
        text = f"Part number,Quantity,Revision\r\n{line[1]},1,{revision}\r\n"
        mixed = f"{text}{other},1,1\r\n"
        answer = api.bad(400, "POST", bom(line[0], "import"), body=mixed.encode())
        assert "row 2: Revision" in answer["problems"][0]
        answer = api.good("POST", bom(line[0], "import"), body=text.encode())
        assert answer["unused_columns"] == ["Revision"]
    assert [(one["child_part_number"], one["child_revision"]) for one in api.get(bom(line[0]))] == [
        (line[1], None)
    ]


@over("postgres")  # it refuses more
def test_a_text_that_no_database_holds_is_asked_for(api: Api) -> None:
    """Each text in the address of each read: an answer or a sentence about it, on either database."""
    known = {"part_number": api.item(), "username": "admin"}
    document = api.get("/api/openapi.json")
    asked, vague = 0, []
    for path, operations in document["paths"].items():
        parameters = operations.get("get", {}).get("parameters", ())
        texts = [each["name"] for each in parameters if each["schema"].get("type") == "string"]
        needed = {each["name"]: "1" for each in parameters if each.get("required")} | known
        for name in texts:
            values = needed | {name: "a\0b"}
            inside = {key: quote(value, safe="") for key, value in values.items()}
            query = {
                key: value
                for key, value in values.items()
                if any((each["name"], each["in"]) == (key, "query") for each in parameters)
            }
            answer = api.call("GET", f"{path.format_map(inside)}?{urlencode(query)}")
            asked += 1
            if answer.status >= 500 or b"cannot be stored" in answer.body:
                vague.append((path, name, answer.status))
    assert asked > 60
    assert not vague


def test_the_number_of_a_token_that_is_none(api: Api) -> None:
    """On the page as in the API."""
    headers = {"Content-Type": "application/x-www-form-urlencoded"}
    for number in ("9" * 23, "0", "-1", "²", "1.5"):
        path = "/" + quote(number)
        assert api.call("DELETE", "/api/auth/tokens" + path).status == 400
        answer = api.call("POST", f"/account/tokens{path}/revoke", body=b"", headers=headers)
        assert answer.status in (400, 403)


def test_quantities_that_multiply_beyond_all_sense(api: Api) -> None:
    """A chain of a billion pieces each says so, whoever asks; single levels still show where."""
    chain = api.items(36)
    for above, below in itertools.pairwise(chain):
        api.add_line(above, below, quantity=1e9)
    for rest in ("flat", "cost", "mass", "expanded", "export.csv?view=flat", "export.json?view=indented"):
        answer = api.bad(409, "GET", bom(chain[0], rest))
        assert "multiply" in answer["message"]
    assert api.get(bom(chain[0], "expanded?depth=1"))[0]["total_quantity"] == 1e9
    assert api.call("GET", f"/items/{chain[0]}", headers={"Accept": "text/html"}).status == 200


def test_thumbnails_that_are_damaged_or_bombs(api: Api) -> None:
    """The file is kept as it is, without a picture: the picture is worth no error."""
    number = api.item()
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_LZMA) as archive:
        archive.writestr("thumbnails/Thumbnail.png", b"\x89PNG\r\n\x1a\n" + bytes(1000))
    damaged = bytearray(out.getvalue())
    start = damaged.index(b"Thumbnail.png") + len("Thumbnail.png")
    damaged[start + 6 : start + 40] = b"\xff" * 34
    end = b"PK\x05\x06" + struct.pack("<HHHHIIH", 0, 0, 0xFFFF, 0xFFFF, 50 * 2**20, 0, 0)
    for content in (bytes(damaged), b"x" * 100 + end, b"PK\x05\x06", b"", b"PK\x05\x06" + bytes(21)):
        assert api.upload(number, content)["thumbnail_key"] is None
