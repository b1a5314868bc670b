# SPDX-License-Identifier: LGPL-2.1-or-later
"""The JSON of bom-sync.md §5, exactly: request, response, event."""

from __future__ import annotations

import re
from typing import Any

import pytest
from server_testing import Api, bom

REQUEST = {
    "source": "assembly",
    "entries": [
        {"child_part_number": "PRT-100", "quantity": 1, "source": "assembly"},
        {"child_part_number": "ASM-200", "quantity": 2, "source": "assembly"},
        {"child_part_number": "PRT-300", "quantity": 1, "source": "assembly"},
        {"child_part_number": "F01-001", "quantity": 12, "source": "assembly"},
    ],
}
DIFF = {
    "added": [{"part_number": "PRT-300", "quantity": 1}],
    "removed": [{"part_number": "PRT-400", "quantity": 2}],
    "quantity_changed": [{"part_number": "F01-001", "old_quantity": 8, "new_quantity": 12}],
    "unchanged": [{"part_number": "PRT-100", "quantity": 1}, {"part_number": "ASM-200", "quantity": 2}],
}
RESPONSE = {
    "status": "merged",
    "diff": DIFF,
    "warnings": [
        {
            "type": "unreferenced",
            "part_number": "PRT-400",
            "message": "Present in server BOM but not in assembly",
        }
    ],
    "resolve_url": "/items/ASM-001/bom",
}


@pytest.fixture(scope="module")
def spec_items(server: Any) -> None:
    """The items of the spec's example."""
    with Api(server.base_url, server.token) as api:
        for number in ("ASM-001", "ASM-200"):
            api.item(number, item_type="assembly")
        for number in ("PRT-100", "PRT-300", "PRT-400", "F01-001"):
            api.item(number)


def test_merge_answers_and_announces_exactly_as_the_spec_says(api: Api, spec_items: None) -> None:
    """Spec §5: the example's request on the example's BOM gives the example's response and event."""
    before = {"PRT-100": 1, "ASM-200": 2, "PRT-400": 2, "F01-001": 8}
    api.merge("ASM-001", before)
    with api.events() as events:
        answer = api.call("POST", bom("ASM-001", "merge"), REQUEST)
        event = events.next("bom_merge")
    assert answer.status == 200
    assert answer.json() == RESPONSE
    stamp = event.data.pop("timestamp")
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", stamp)
    assert event.data == {
        "type": "bom_merge",
        "item": "ASM-001",
        "user": "admin",
        "summary": "BOM updated: 1 added, 1 quantity changed, 1 unreferenced",
        "diff": DIFF,
        "resolve_url": "/items/ASM-001/bom",
    }


def test_whole_quantities_are_written_as_whole_numbers(api: Api) -> None:
    """The spec writes 12, never 12.0; a fraction stays one."""
    parent, a, b = api.items(3)
    body = api.call(
        "POST",
        bom(parent, "merge"),
        {"entries": [{"child_part_number": a, "quantity": 12.0}, {"child_part_number": b, "quantity": 0.5}]},
    ).body
    assert b'"quantity":12}' in body
    assert b'"quantity":0.5}' in body


def test_resolve_url_leads_to_a_page(api: Api, server: Any) -> None:
    """The merge's ``resolve_url`` is a page that shows the BOM, for who is logged in."""
    parent, a = api.items(2)
    api.merge(parent, {a: 3})
    url = api.merge(parent, {})["resolve_url"]
    assert url == f"/items/{parent}/bom"
    stranger = api.as_(None).call("GET", url)
    assert stranger.status == 303
    assert stranger.headers["location"].startswith("/login?next=")
    page = api.call("GET", url)
    assert page.status == 200
    assert a in page.body.decode()
    assert "unreferenced" in page.body.decode() or "not referenced" in page.body.decode()
