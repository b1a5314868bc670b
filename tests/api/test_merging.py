# SPDX-License-Identifier: LGPL-2.1-or-later
"""Merging where the server has no merge, or refuses lines that people own."""

from __future__ import annotations

from typing import Any

import pytest

from silo.api.client import SiloClient
from silo.api.merging import NOT_ATOMIC
from silo.api.wire import MergeEntry, MergeRequest
from silo.bom.errors import ConflictError, RejectedError, RouteMissingError

ITEM, BOM = "GET /api/items/A01-0001", "/api/items/A01-0001/bom"
MERGE, ADD = f"POST {BOM}/merge", f"POST {BOM}"
HEAD = {"id": "11111111-1111-4111-8111-111111111111", "part_number": "A01-0001"}


def request(**quantities: float) -> MergeRequest:
    entries = [MergeEntry(child_part_number=pn.replace("_", "-"), quantity=q) for pn, q in quantities.items()]
    return MergeRequest(entries=entries, sync_id="s")


def line(child: str, quantity: float, source: str = "assembly") -> dict[str, Any]:
    return {"child_part_number": child, "quantity": quantity, "source": source}


LINES = [line("F01-0001", 2), line("F01-0002", 5), line("M01-0001", 1, "manual"), line("M01-0009", 3)]
WANTED = request(F01_0001=2, F01_0002=6, M01_0001=4, M01_0002=1)


@pytest.fixture
def old(server: Any, answer: Any) -> Any:
    """A server of the first phase: single lines, no merge."""
    server.on(MERGE, answer(404, "404 page not found"))
    server.on(ITEM, HEAD)
    server.on(f"GET {BOM}", LINES)
    server.on(ADD, answer(201, line("M01-0002", 1)))
    server.on(f"PUT {BOM}/F01-0002", line("F01-0002", 6))
    return server


def test_the_plan_goes_out_line_by_line(old: Any, client: SiloClient) -> None:
    """Added and changed; nothing deleted, the manual line left, and it says that it was not one step."""
    result = client.merge_bom("A01-0001", WANTED)
    assert [(s.method, s.path) for s in old.seen if s.method in ("POST", "PUT", "DELETE")] == [
        ("POST", f"{BOM}/merge"),
        ("POST", BOM),
        ("PUT", f"{BOM}/F01-0002"),
    ]
    assert old.seen[-1].json() == {"quantity": 6}
    added = next(s for s in old.seen if (s.method, s.path) == ("POST", BOM)).json()
    assert (added["child_part_number"], added["quantity"], added["source"]) == ("M01-0002", 1, "assembly")
    assert {(w.type, w.part_number) for w in result.warnings} == {
        ("unreferenced", "M01-0009"),
        ("conflict", "M01-0001"),
        (NOT_ATOMIC, "A01-0001"),
    }
    assert [change.part_number for change in result.diff.quantity_changed] == ["F01-0002"]


def test_one_refused_line_does_not_hold_up_the_others(old: Any, client: SiloClient, answer: Any) -> None:
    """All that was refused is reported together, after the rest was written."""
    old.scripts[ADD].clear()
    old.on(ADD, answer(400, {"message": "no such child"}))
    with pytest.raises(RejectedError, match=r"1 lines were written.*1 were refused.*no such child"):
        client.merge_bom("A01-0001", WANTED)
    assert f"PUT {BOM}/F01-0002" in old.paths()


def test_a_dry_run_and_a_version_stay_what_they_are(old: Any, client: SiloClient) -> None:
    """The one writes nothing; the other cannot be promised."""
    client.merge_bom("A01-0001", WANTED.model_copy(update={"dry_run": True}))
    with pytest.raises(RouteMissingError):
        client.merge_bom("A01-0001", WANTED, if_match=3)
    assert [path for path in old.paths() if path.startswith(("PUT", f"POST {BOM} "))] == []


def test_a_server_that_has_neither_says_so(server: Any, client: SiloClient, answer: Any) -> None:
    """In one sentence."""
    server.on(ITEM, HEAD)
    server.on(f"GET {BOM}", [])
    server.on(MERGE, answer(405, "Method Not Allowed"))
    server.on(ADD, answer(405, "Method Not Allowed"))
    with pytest.raises(RouteMissingError):
        client.merge_bom("A01-0001", WANTED)


def test_lines_of_people_are_left_out_where_the_server_refuses_them(
    server: Any, client: SiloClient, answer: Any
) -> None:
    """409, then all the others; the conflict is reported, an equal quantity is none."""
    lines = [*LINES, line("F01-0007", 3, "manual")]
    server.on(f"GET {BOM}", lines)
    server.on(MERGE, answer(409, {"error": "conflict"}), {"diff": {"added": []}})
    wanted = request(F01_0001=2, M01_0001=4, F01_0007=3)
    result = client.merge_bom("A01-0001", wanted)
    assert [entry["child_part_number"] for entry in server.seen[-1].json()["entries"]] == ["F01-0001"]
    [warning] = result.warnings
    assert (warning.type, warning.part_number, warning.assembly_quantity, warning.server_quantity) == (
        "conflict",
        "M01-0001",
        4,
        1,
    )


def test_another_conflict_stays_one(server: Any, client: SiloClient, answer: Any) -> None:
    """No manual line is in the way."""
    server.on(f"GET {BOM}", [line("F01-0001", 2)])
    server.on(MERGE, answer(409, {"error": "conflict", "message": "edit session"}))
    with pytest.raises(ConflictError, match="edit session"):
        client.merge_bom("A01-0001", WANTED)
    assert len(server.paths("POST")) == 1


def test_a_refused_dry_run_is_not_asked_again(server: Any, client: SiloClient, answer: Any) -> None:
    """A dry run answers what a merge would do; without the manual lines it would answer something else."""
    server.on(f"GET {BOM}", LINES)
    server.on(MERGE, answer(409, {"error": "conflict"}), {"diff": {"added": []}})
    with pytest.raises(ConflictError):
        client.merge_bom("A01-0001", WANTED.model_copy(update={"dry_run": True}))
    assert [(sent.method, sent.path) for sent in server.seen] == [("POST", f"{BOM}/merge")]
