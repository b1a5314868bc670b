# SPDX-License-Identifier: LGPL-2.1-or-later
"""A merge in the words of spec §6's box."""

from __future__ import annotations

from typing import Any

import pytest

from silo.api.wire import MergeDiff, MergeResult
from silo.bom_sync.activity_text import activity_text, counts_text, unregistered_text

LINE = {"part_number": "P", "quantity": 1}
CHANGE = {"part_number": "P", "old_quantity": 1, "new_quantity": 2}


def result(**lists: Any) -> MergeResult:
    """A server's answer."""
    warnings = lists.pop("warnings", [])
    return MergeResult.model_validate(
        {"status": "merged", "diff": lists, "warnings": warnings, "resolve_url": "/items/ASM-001/bom"}
    )


def test_the_box_of_the_spec() -> None:
    """Headline, counts, link, unregistered components."""
    merge = result(added=[LINE], quantity_changed=[CHANGE], removed=[LINE])
    told = activity_text("ASM-001", merge, unregistered=2)
    assert told.lines() == (
        "BOM Updated: ASM-001",
        "+1 added  ~1 qty changed  ⚠1 unreferenced",
        "View in Silo →",
        "⚠ 2 components have no Silo part number",
    )
    assert told.resolve_url == "/items/ASM-001/bom"
    assert activity_text("A", merge, resolve_url="https://silo/x").resolve_url == "https://silo/x"


@pytest.mark.parametrize(
    ("lists", "words"),
    [
        ({}, "no changes"),
        ({"unchanged": [LINE]}, "no changes"),
        ({"added": [LINE] * 12}, "+12 added"),
        ({"removed": [LINE], "quantity_changed": [CHANGE] * 2}, "~2 qty changed  ⚠1 unreferenced"),
    ],
)
def test_what_is_zero_is_left_out(lists: dict[str, Any], words: str) -> None:
    """Only what happened is reported."""
    assert counts_text(MergeDiff.model_validate(lists)) == words


def test_conflicts_are_counted() -> None:
    """They come as warnings of the server."""
    merge = result(warnings=[{"type": "conflict", "part_number": "P", "message": "CAD 4, Silo 6"}])
    assert activity_text("A", merge).counts == "⚡1 in conflict"


@pytest.mark.parametrize(("count", "words"), [(0, ""), (1, "1 component has no Silo part number")])
def test_one_and_none(count: int, words: str) -> None:
    """Grammar."""
    assert unregistered_text(count) == words
