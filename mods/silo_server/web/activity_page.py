# SPDX-License-Identifier: LGPL-2.1-or-later
"""What happens on the server, live: an event wakes the page's script, which asks this page for the rest."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Query
from starlette.responses import Response

from silo_server.routes.context import PageFrom
from silo_server.services import events
from silo_server.services.events import EventQuery, LoggedEvent
from silo_server.services.items import get_by_uuids
from silo_server.values import Item
from silo_server.web.login_page import Reader
from silo_server.web.render import isolate, page, segment
from silo_server.web.tables import Address, Part, part_of

router = APIRouter(include_in_schema=False)

MOST = 100
# What a person may look for, and the events that it is.
KINDS = {
    "syncs": ("bom_merge",),
    "BOM edits": ("bom.updated",),
    "items": ("item.created", "item.updated", "item.deleted"),
    "files and revisions": ("revision.created",),
    "the server": ("server.state",),
}
NAMES = tuple(name for names in KINDS.values() for name in names)


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
    item_name: str = ""


@router.get("/activity")
def activity_page(
    call: Reader,
    before: PageFrom = None,
    after: PageFrom = None,
    kind: Annotated[str, Query(max_length=40)] = "",
    user: Annotated[str, Query(max_length=64)] = "",
    item: Annotated[str, Query(max_length=64)] = "",
    newer_than: PageFrom = None,
) -> Response:
    """What happened, newest first, by kind, user and item.

    ``before`` and ``after`` page through it; ``newer_than`` is for the page's script, which knows the rest.
    """
    asked = EventQuery(KINDS.get(kind, ()), user.strip(), item.strip())
    with call.read() as tx:
        if newer_than is None:
            part = part_of(partial(events.newest, tx, asked), MOST, before, after)
        else:
            # The newest of them, where there are more than a page holds.
            newest = [event for event in events.newest(tx, asked, MOST) if event.id > newer_than]
            part = Part(newest, None, None)
        last = events.head(tx)
        users = events.usernames(tx)
        uuids = [event.item_uuid for event in part.rows if event.item_uuid]
        items = {one.uuid: one for one in get_by_uuids(tx, uuids, include_archived=True)}
    entries = [entry_of(event, items.get(event.item_uuid or "")) for event in part.rows]
    address = Address("/activity", {"kind": kind if kind in KINDS else "", "user": user, "item": item})
    return page(
        call,
        "activity.html",
        entries=entries,
        part=part,
        address=address,
        kinds=list(KINDS),
        users=sorted({*users, *([user] if user else [])}),
        last=last,
        names=" ".join(NAMES),
        live=before is None and after is None,
    )


def entry_of(event: LoggedEvent, item: Item | None = None) -> Entry:
    """An event in words. ``item``: what it is about, as it is now."""
    data: dict[str, Any] = json.loads(event.data)
    number = item.part_number if item else str(data.get("item") or data.get("part_number") or "")
    path = f"/items/{segment(number)}" if number else ""
    if event.name in ("bom_merge", "bom.updated"):
        path += "/bom"
    return Entry(
        event.at,
        event.name,
        number,
        path,
        _words(event.name, data),
        event.username or str(data.get("user") or ""),
        _counts(event.name, data),
        item.name if item else str(data.get("name") or ""),
    )


def _words(name: str, data: Mapping[str, Any]) -> str:
    if name == "bom.updated":
        return f"BOM: {data.get('summary', 'changed')}"
    if name == "revision.created":
        comment = data.get("comment")
        return f"revision {data.get('revision_number', '')}" + (
            f": {isolate(str(comment))}" if comment else ""
        )
    if name == "server.state":
        closed = data.get("mode") == "read-only"
        return "The server takes no changes at the moment" if closed else "The server takes changes again"
    said = {"bom_merge": "BOM merged from CAD", "item.created": "registered", "item.updated": "changed"}
    return (said | {"item.deleted": "archived"}).get(name, name)


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
