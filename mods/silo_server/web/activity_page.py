# SPDX-License-Identifier: LGPL-2.1-or-later
"""What happens on the server, live: an event wakes the page's script, which asks this page for the rest.

What happened to a BOM: every change, any two points side by side, and the way back.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import date, timedelta
from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Query
from starlette.responses import Response

from silo.bom.errors import NotFoundError, RejectedError, VersionConflictError, counted
from silo_server import events
from silo_server.events import EventQuery, LoggedEvent
from silo_server.routes.context import Call, PageFrom
from silo_server.services import revisions
from silo_server.services.bom import history, tree
from silo_server.services.bom.summary import last_look
from silo_server.services.items import get_by_uuids, get_item
from silo_server.settings import ArchivedPartsError
from silo_server.values import Item
from silo_server.web.accounts import Reader, Writer
from silo_server.web.forms import Form, back, text, whole
from silo_server.web.line_form import changes, sentences
from silo_server.web.merge_page import bom_path
from silo_server.web.render import Address, Part, isolate, page, part_of, segment, sentence

router = APIRouter(include_in_schema=False)

MOST = 100
# What a person may look for, and the events that it is.
KINDS = {
    "syncs": ("bom_merge",),
    "BOM edits": ("bom.updated",),
    "items": ("item.created", "item.updated", "item.deleted"),
    "files and revisions": ("revision.created", "document.revised"),
    "reviews and releases": ("revision.reviewed", "revision.released"),
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
    inside: bool = False,
    since: Annotated[str, Query(max_length=10)] = "",
    until: Annotated[str, Query(max_length=10)] = "",
    newer_than: PageFrom = None,
) -> Response:
    """What happened, newest first, by kind, user, item (with all that is ``inside``) and days.

    ``before`` and ``after`` page through it; ``newer_than`` is for the page's script, which knows the rest.
    """
    days = {"since": _day(since), "until": _day(until)}
    with call.read() as tx:
        names, number = KINDS.get(kind, ()), item.strip()
        asked = EventQuery(names, user.strip(), number, days["since"], days["until"])
        with suppress(NotFoundError):
            if inside and number:
                asked = replace(asked, inside=tree.ids_below(get_item(tx, number, include_archived=True)))
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
    view = {"kind": kind if kind in KINDS else "", "user": user, "item": item, **days}
    address = Address("/activity", view | {"inside": "1" if inside else ""})
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


def _day(text: str) -> str:
    """A day as it was given, "" for anything else: a filter that nobody can mean filters nothing."""
    with suppress(ValueError):
        return date.fromisoformat(text).isoformat()
    return ""


def entry_of(event: LoggedEvent, item: Item | None = None) -> Entry:
    """An event in words. ``item``: what it is about, as it is now."""
    data: dict[str, Any] = json.loads(event.data)
    number = item.part_number if item else str(data.get("item") or data.get("part_number") or "")
    path = f"/items/{segment(number)}" if number else ""
    if event.name in ("bom_merge", "bom.updated"):
        path += "/bom"
    if event.name in ("revision.reviewed", "revision.released"):
        path += "/releases"
    if event.name == "document.revised":
        number, path = str(data.get("file_name") or ""), f"/documents/{segment(str(data.get('document')))}"
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
    if name in ("revision.created", "document.revised"):
        comment = data.get("comment")
        return f"revision {data.get('revision_number', '')}" + (
            f": {isolate(str(comment))}" if comment else ""
        )
    if name in ("revision.reviewed", "revision.released"):
        return f"revision {data.get('revision', '')} {data.get('status', '')}"
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


PAGE_SIZE = 50
# So many lines of each change stand on the list; the others are a click away.
TOLD_LINES = 12
KNOWN = 500
USUAL_DAYS = 30
MOST_CHANGES = 1000


@router.get("/items/{part_number}/history")
def history_page(call: Reader, part_number: str, before: PageFrom = None, after: PageFrom = None) -> Response:
    """All changes with their lines, newest first; ``before`` and ``after`` are the changes to page from."""
    with call.read() as tx:
        item = get_item(tx, part_number, include_archived=True)
        part = part_of(partial(history.list_changes, tx, item), PAGE_SIZE, before, after)
        lines = history.lines_of_changes(tx, [change.id for change in part.rows], TOLD_LINES)
        newest = next(iter(history.list_changes(tx, item, 1)), None)
    told = {
        change.id: sentences(lines.get(change.id, []), TOLD_LINES, change.line_count) for change in part.rows
    }
    return page(
        call,
        "history.html",
        item=item,
        changes=part.rows,
        told=told,
        newest=newest,
        part=part,
    )


@router.get("/items/{part_number}/changes")
def changes_page(
    call: Reader,
    part_number: str,
    since: Annotated[str, Query(max_length=40)] = "",
    until: Annotated[str, Query(max_length=40)] = "",
) -> Response:
    """What changed in a product over all levels: between dates or revisions, or since the person looked."""
    problem, found, first = "", [], ""
    with call.server.large_reads.enter(), call.read() as tx:
        item = get_item(tx, part_number, include_archived=True)
        now, looked = tx.stamp, last_look(tx, call.actor.own_id, item)
        if since in ("", "look"):
            since = looked if looked and since else (tx.at - timedelta(days=USUAL_DAYS)).date().isoformat()
        try:
            first = history.moment(tx, item, since)
            last = history.moment(tx, item, until, end=True) if until else now
            found = history.what_changed(tx, item, first, last)
        except (NotFoundError, RejectedError) as error:
            problem = str(error)
        points, _ = revisions.list_revisions(tx, item)
    return page(
        call,
        "changes.html",
        status=400 if problem else 200,
        item=item,
        problem=sentence(problem),
        found=found[:MOST_CHANGES],
        more=max(0, len(found) - MOST_CHANGES),
        first=first,
        since=since,
        until=until,
        looked=looked,
        points=points,
        counts=Counter(one.what for one in found),
        asked=Address("", {"from": since, "to": until}).url().removeprefix("?"),
    )


@router.get("/items/{part_number}/compare")
def compare_page(
    call: Reader, part_number: str, old: PageFrom = None, new: PageFrom = None, all: bool = False
) -> Response:
    """Two points of time, line by line; without ``old`` what the newest change did."""
    return _compare(call, part_number, (old, new), show_all=all)


def _compare(
    call: Call,
    part_number: str,
    wanted: tuple[int | None, int | None],
    *,
    show_all: bool = False,
    problem: str = "",
    reason: str = "",
    status: int = 200,
    archived: bool = False,
) -> Response:
    old, new = wanted
    with call.read() as tx:
        item = get_item(tx, part_number, include_archived=True)
        known = history.list_changes(tx, item, KNOWN)
        asked = {point for point in (old, new) if point} - {change.id for change in known}
        known += [history.get_change(tx, item, point)[0] for point in sorted(asked, reverse=True)]
        latest = known[0].id if known else 0
        second = latest if new is None else new
        before = history.list_changes(tx, item, 1, second) if old is None else []
        first = (before[0].id if before else 0) if old is None else old
        first, second = sorted((first, second))
        rows = history.compare(history.state_at(tx, item, first), history.state_at(tx, item, second))
    counts = {status: sum(row.status == status for row in rows) for status in STATUSES}
    shown = [
        (row, changes(row.before, row.after) if row.before and row.after else [])
        for row in rows
        if show_all or row.status != "unchanged"
    ]
    return page(
        call,
        "compare.html",
        status=status,
        item=item,
        rows=shown,
        counts=counts,
        summary=", ".join(f"{count} {status}" for status, count in counts.items() if count),
        old=first,
        new=second,
        known=known,
        show_all=show_all,
        latest=latest,
        problem=problem,
        reason=reason,
        archived=archived,
    )


STATUSES = ("added", "removed", "changed", "unchanged")


@router.post("/items/{part_number}/restore")
def restore(call: Writer, part_number: str, form: Form) -> Response:
    """Make the BOM again what it was, where nobody changed it since the page was shown; a new change."""
    change_id, reason = whole(form, "change_id"), text(form, "reason")
    if change_id is None:
        raise RejectedError("change_id: wanted the number of a change, got none; load the page again")
    try:
        with call.write() as tx:
            item = get_item(tx, part_number)
            was = len(history.state_at(tx, item, change_id))
            expected = whole(form, "version")
            sure = bool(text(form, "with_archived"))
            made, _ = history.restore(
                tx, part_number, change_id, reason or None, expected, with_archived=sure
            )
    except ArchivedPartsError as error:
        numbers = ", ".join(error.part_numbers[:10])
        problem = f"Nothing was restored yet: archived parts would come back ({numbers})."
        return _compare(
            call, part_number, (change_id, None), problem=problem, reason=reason, status=409, archived=True
        )
    except VersionConflictError:
        problem = (
            "Nothing was restored: somebody else changed this BOM meanwhile. Here is what differs now; "
            "restore again if that, too, should be as it was."
        )
        points = (change_id, None)
        return _compare(call, part_number, points, problem=problem, reason=reason, status=412)
    said = f"Restored: {counted(was, 'line', 'lines')} as of change {change_id}."
    return back(bom_path(part_number), said, undo=[made])
