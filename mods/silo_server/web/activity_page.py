# SPDX-License-Identifier: LGPL-2.1-or-later
"""What happens on the server, live: an event wakes the page's script, which asks this page for the rest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from silo_server.routes.context import ServerDep
from silo_server.services import events
from silo_server.services.events import DatedEvent
from silo_server.web.guard import Reader
from silo_server.web.render import page, segment

router = APIRouter(include_in_schema=False)

MOST = 100
NAMES = (
    "bom_merge",
    "bom.updated",
    "item.created",
    "item.updated",
    "item.deleted",
    "revision.created",
    "server.state",
)


@dataclass(frozen=True, slots=True)
class Entry:
    """One event in words. ``counts`` are the marks of a merge: (mark, number, word)."""

    at: str
    kind: str
    item: str
    link: str
    words: str
    user: str
    counts: tuple[tuple[str, int, str], ...] = ()


@router.get("/activity")
def activity_page(
    request: Request,
    server: ServerDep,
    caller: Reader,
    after: Annotated[int, Query(ge=0, le=2**62)] = 0,
) -> Response:
    """The newest events, newest first; ``after`` leaves out what is known already."""
    with server.db.read(caller) as tx:
        found = events.newest(tx, MOST, after)
        last = events.head(tx)
    entries = [entry_of(event) for event in found]
    return page(
        request, "activity.html", caller, entries=entries, last=last, names=" ".join(NAMES), live=True
    )


def entry_of(event: DatedEvent) -> Entry:
    """An event in words."""
    data = event.data
    item = str(data.get("item") or data.get("part_number") or "")
    path = f"/items/{segment(item)}" if item else ""
    if event.name in ("bom_merge", "bom.updated"):
        path += "/bom"
    user = str(data.get("user") or "")
    return Entry(event.at, event.name, item, path, _words(event.name, data), user, _counts(event.name, data))


def _words(name: str, data: Mapping[str, Any]) -> str:
    called = str(data.get("name") or "")
    if name == "bom_merge":
        return "BOM merged from CAD"
    if name == "bom.updated":
        return f"BOM: {data.get('summary', 'changed')}"
    if name == "item.created":
        return f"{called} registered"
    if name == "item.updated":
        return f"{called} changed"
    if name == "item.deleted":
        return "archived"
    if name == "revision.created":
        comment = data.get("comment")
        return f"revision {data.get('revision_number', '')}" + (f": {comment}" if comment else "")
    if name == "server.state":
        closed = data.get("mode") == "read-only"
        return "The server takes no changes at the moment" if closed else "The server takes changes again"
    return name


def _counts(name: str, data: Mapping[str, Any]) -> tuple[tuple[str, int, str], ...]:
    if name != "bom_merge":
        return ()
    diff, warnings = data.get("diff", {}), data.get("warnings", ())
    counts = (
        ("added", len(diff.get("added", ())), "added"),
        ("changed", len(diff.get("quantity_changed", ())), "quantity changed"),
        ("warn", len(diff.get("removed", ())), "unreferenced"),
        ("conflict", sum(warning.get("type") == "conflict" for warning in warnings), "to decide"),
    )
    return tuple(count for count in counts if count[1]) or (("same", 0, "changed"),)
