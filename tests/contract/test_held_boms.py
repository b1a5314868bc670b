# SPDX-License-Identifier: LGPL-2.1-or-later
"""A BOM that a designer's computer holds back: every page and list knows, until the next merge."""

from __future__ import annotations

from typing import Any

from hunting import BOTH
from server_testing import Api, bom

COVER = {"reason": "missing", "name": "Cover", "file": "parts/Cover.FCStd", "object": "Body", "quantity": 2}
BOLT = {"reason": "missing", "name": "Bolt", "file": "parts/Bolt.FCStd", "object": "Body", "quantity": 4}
LOOSE = {"reason": "unregistered", "name": "Pin", "file": "parts/Pin.FCStd", "object": "Body", "quantity": 1}
DOCUMENT = {"file": "Gearbox.FCStd", "folder": "robot/arm"}


def hold(api: Api, parent: str, *left_out: dict[str, Any]) -> Any:
    return api.good("POST", bom(parent, "held"), {"left_out": list(left_out), "document": DOCUMENT})


def merge(api: Api, parent: str, *children: str, **more: Any) -> Any:
    entries = [{"child_part_number": child, "quantity": 1} for child in children]
    return api.good("POST", bom(parent, "merge"), {"source": "assembly", "entries": entries, **more})


def incomplete(api: Api, product: str) -> Any:
    return api.get(bom(product, "summary"))["incomplete"]


@BOTH
def test_a_held_bom_is_known_until_the_next_merge(api: Api) -> None:
    """A repeat keeps the time of the first report; the lines stay as they were; the merge ends it."""
    top, part = api.item(item_type="assembly"), api.item()
    merge(api, top, part)
    before = api.lines(top)
    first = hold(api, top, COVER, LOOSE)
    second = hold(api, top, COVER, BOLT, LOOSE)
    assert first["since"] == second["since"]
    assert second["left_out"] == [COVER, BOLT, LOOSE]
    assert second["document_file"] == DOCUMENT["file"]
    last = api.get(f"/api/items/{top}")["last_sync"]
    assert last["held"] == second
    assert [gap["reason"] for gap in last["left_out"]] == ["held"]
    assert api.lines(top) == before
    user = second["user"]
    assert incomplete(api, top) == {top: f"held by {user}: 2 files missing"}
    merge(api, top, part)
    assert api.get(f"/api/items/{top}")["last_sync"]["left_out"] == []
    assert "held" not in api.get(f"/api/items/{top}")["last_sync"]
    assert incomplete(api, top) == {}


@BOTH
def test_a_product_knows_what_is_held_below_it(api: Api) -> None:
    """In its summary, which was kept before; on the order list; and no release goes out."""
    top, sub = (api.item(item_type="assembly") for _ in range(2))
    part = api.item()
    merge(api, sub, part)
    merge(api, top, sub)
    assert incomplete(api, top) == {}
    user = hold(api, sub, COVER)["user"]
    words = f"held by {user}: 1 file missing"
    assert incomplete(api, top) == {sub: words}
    assert any(f"{sub}: {words}" in line for line in api.get(f"/api/items/{top}/order")["warnings"])
    api.good("POST", f"/api/items/{top}/releases", {"comment": "first"})
    (release,) = api.get(f"/api/items/{top}/releases")["releases"]
    assert f"{sub}: {words}" in release["blocks"]


def test_a_bom_that_never_came_can_be_held(api: Api) -> None:
    """The first commit of an assembly, on a computer that lacks a file; another finding counts no files."""
    (top,) = [api.item(item_type="assembly")]
    user = hold(api, top, {"reason": "broken", "message": "a loop"})["user"]
    assert incomplete(api, top) == {top: f"held by {user}: 1 open question"}
    hold(api, top, COVER, {"reason": "broken", "message": "a loop"})
    assert incomplete(api, top) == {top: f"held by {user}: 1 file missing, 1 other question"}


def test_a_report_that_says_nothing_is_refused(api: Api) -> None:
    """It would say that something is held, and not why; nothing is kept of it."""
    top = api.item(item_type="assembly")
    for body in ({}, {"left_out": []}, {"left_out": "x"}, {"left_out": [{}]}):
        assert "left_out" in str(api.bad(400, "POST", bom(top, "held"), body))
    api.bad(404, "POST", bom("no such item", "held"), {"left_out": [COVER]})
    assert "held" not in api.get(f"/api/items/{top}")["last_sync"]
