# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the pane shows of the server's events."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from activities import activity_of

from silo.api.sse import ServerEvent
from silo.bom.errors import InputError
from silo.workbench.activity.events import of_event

if TYPE_CHECKING:
    pass


def page(path: str) -> str:
    return f"https://silo.example.com{path}"


def test_a_page_of_another_server_is_not_offered() -> None:
    """Events say where to look; only the server in the settings may send people anywhere."""

    def refuse(path: str) -> str:
        raise InputError(path)

    event = ServerEvent("1", "item.created", {"part_number": "M01-0001", "name": "x"})
    made = of_event(event, refuse)
    assert made is not None
    assert made.actions == ()


def test_a_gap_is_reported_once() -> None:
    """A server that counts again has forgotten what happened; the pane does not pretend to know."""
    gaps = [of_event(ServerEvent(str(n), "reset", {"reason": "counts again"}), page, now=n) for n in range(3)]
    activity = activity_of(gap for gap in gaps if gap is not None)
    (entry,) = activity.entries
    assert entry.title == "Some activity may be missing"


@pytest.mark.parametrize("kind", ["heartbeat", "server.state", "job.done"])
def test_what_people_need_not_see_is_no_box(kind: str) -> None:
    """Nor is an event without an item."""
    assert of_event(ServerEvent("1", kind, {"part_number": "M01-0001"}), page) is None
    assert of_event(ServerEvent("1", "item.created", {}), page) is None


def test_what_a_colleague_did_is_a_box() -> None:
    """Items and revisions; the first revision of a new item is shown with the item."""

    def titles(*events: ServerEvent) -> list[str]:
        return [made.title for made in (of_event(event, page) for event in events) if made is not None]

    data = {"part_number": "M01-0001", "user": "alice"}
    revised = {**data, "comment": "thinner", "revision_number": 2}
    kinds = [("item.created", data), ("revision.created", revised), ("item.deleted", data)]
    assert titles(*(ServerEvent(kind, kind, given) for kind, given in kinds)) == [
        "New item: M01-0001",
        "Revision 2 of M01-0001",
        "Archived: M01-0001",
    ]
    first = ServerEvent("1", "revision.created", {**data, "comment": "created", "revision_number": 1})
    assert titles(first) == []
    entry = of_event(ServerEvent("1", "revision.created", revised), page)
    assert entry is not None
    assert (entry.who, [line.text for line in entry.lines]) == ("alice", ["thinner"])
