# SPDX-License-Identifier: LGPL-2.1-or-later
"""What counts as a merge: the answer must say what was done, or the BOM must show it."""

from __future__ import annotations

from typing import Any

import pytest

from silo.api.client import SiloClient
from silo.api.merging import UNCLEAR
from silo.api.wire import MergeEntry, MergeRequest
from silo.bom.errors import ServerFaultError

MERGE, BOM = "POST /api/items/A01-0001/bom/merge", "GET /api/items/A01-0001/bom"
REQUEST = MergeRequest(entries=[MergeEntry(child_part_number="F01-0001", quantity=4)], sync_id="s")
SHOWN = [{"child_part_number": "f01-0001", "quantity": 4.0000000001, "source": "assembly"}]
EMPTY: dict[str, Any] = {"added": [], "removed": [], "quantity_changed": [], "unchanged": []}

ODD = [
    {},
    {"merged": True},
    {"status": "merged"},
    {"status": "queued", "diff": EMPTY},
    {"diff": {"lines": 3}},
    {"diff": {"added": 3}},
    [],
    "null",
    "OK",
    "",
    "<html><title>Welcome</title></html>",
]


@pytest.mark.parametrize("odd", ODD, ids=repr)
def test_an_unknown_answer_counts_only_if_the_bom_shows_it(
    server: Any, client: SiloClient, answer: Any, odd: Any
) -> None:
    """Sent, answer not understood: read the BOM and report what it shows."""
    server.on(MERGE, answer(200, odd))
    server.on(BOM, answer(200, SHOWN))
    [warning] = client.merge_bom("A01-0001", REQUEST).warnings
    assert (warning.type, "not understood" in warning.message) == (UNCLEAR, True)


@pytest.mark.parametrize(
    "shown",
    [[], [{"child_part_number": "F01-0001", "quantity": 5, "source": "assembly"}]],
    ids=["missing", "another quantity"],
)
def test_a_bom_that_does_not_show_it_is_no_success(
    server: Any, client: SiloClient, answer: Any, shown: Any
) -> None:
    """The entry stays and is sent again."""
    server.on(MERGE, answer(200, {}))
    server.on(BOM, answer(200, shown))
    with pytest.raises(ServerFaultError, match="does not show F01-0001"):
        client.merge_bom("A01-0001", REQUEST)


def test_a_line_of_a_person_may_differ(server: Any, client: SiloClient, answer: Any) -> None:
    """A merge leaves manual lines."""
    server.on(MERGE, answer(200, {}))
    server.on(BOM, answer(200, [{"child_part_number": "F01-0001", "quantity": 5, "source": "manual"}]))
    assert client.merge_bom("A01-0001", REQUEST).warnings[0].type == UNCLEAR


def test_a_bom_that_cannot_be_read_back_is_no_success(server: Any, client: SiloClient, answer: Any) -> None:
    """Nobody knows then."""
    server.on(MERGE, answer(200, {}))
    server.on(BOM, answer(500))
    with pytest.raises(ServerFaultError, match="cannot be read back"):
        client.merge_bom("A01-0001", REQUEST)


@pytest.mark.parametrize(
    "failed",
    [
        {"error": "locked", "message": "somebody edits it"},
        {"error": "somebody edits it"},
        {"status": "error", "message": "somebody edits it", "diff": EMPTY},
        {"status": "failed", "diff": EMPTY, "message": "somebody edits it"},
        {"ok": False, "message": "somebody edits it"},
        {"success": False, "diff": EMPTY, "message": "somebody edits it"},
    ],
    ids=repr,
)
def test_a_200_that_reports_a_failure_is_one(
    server: Any, client: SiloClient, answer: Any, failed: dict[str, Any]
) -> None:
    """Whatever the BOM shows."""
    server.on(MERGE, answer(200, failed))
    server.on(BOM, answer(200, SHOWN))
    with pytest.raises(ServerFaultError, match="reports a failure: somebody edits it"):
        client.merge_bom("A01-0001", REQUEST)


def test_a_dry_run_has_nothing_to_read_back(server: Any, client: SiloClient, answer: Any) -> None:
    """Its answer is all there is."""
    server.on(MERGE, answer(200, {}))
    with pytest.raises(ServerFaultError, match="not understood"):
        client.merge_bom("A01-0001", REQUEST.model_copy(update={"dry_run": True}))


def test_unknown_extras_do_no_harm(server: Any, client: SiloClient, answer: Any) -> None:
    """Strict in what is essential, tolerant in the rest."""
    server.on(MERGE, answer(200, {"diff": {"added": None, "moved": 3}, "new": 1, "error": None}))
    assert client.merge_bom("A01-0001", REQUEST).warnings == []
