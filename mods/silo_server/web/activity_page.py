# SPDX-License-Identifier: LGPL-2.1-or-later
"""What happens on the server, live: an event wakes the page's script, which asks this page for the rest.

What happened to a BOM: every change, any two points side by side, and the way back.
"""

from __future__ import annotations

import json
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import date, timedelta
from functools import partial
from typing import Annotated, Any, NamedTuple

from fastapi import APIRouter, Query
from starlette.responses import Response

from silo.bom.errors import NotFoundError, RejectedError, VersionConflictError
from silo_server.errors import ArchivedPartsError
from silo_server.events import log
from silo_server.events.log import EventQuery, LoggedEvent
from silo_server.routes.call import Call
from silo_server.routes.requests import NumberedRoute, PageFrom
from silo_server.services import revisions
from silo_server.services.bom import history
from silo_server.services.bom.differences import compare
from silo_server.services.bom.restore import restore_bom
from silo_server.services.items import get_by_uuids, get_item
from silo_server.services.looks import last_look
from silo_server.services.product.changes import PastChange
from silo_server.services.product.frozen import changes_of
from silo_server.services.product.graph import ids_below
from silo_server.services.releases import NUMBERED, list_releases
from silo_server.values import Item
from silo_server.web.accounts import Reader, Writer
from silo_server.web.forms import Form, back, text, whole
from silo_server.web.line_form import changes, sentences
from silo_server.web.merge_page import bom_path
from silo_server.web.render import N_, Address, ListPart, _, isolate, page, part_of, plural, segment, spoken

router = APIRouter(route_class=NumberedRoute, include_in_schema=False)

MOST = 100


class EventView(NamedTuple):
    """How the page shows events of a name.

    kind
        what a user may look for.
    words
        with values of the event's data.
    below
        the page of the item that it links to.
    """

    kind: str
    words: str
    below: str = ""


EVENTS = {
    "bom_merge": EventView(N_("syncs"), N_("BOM merged from CAD"), "/bom"),
    "bom.updated": EventView(N_("BOM edits"), N_("BOM: {summary}"), "/bom"),
    "item.created": EventView(N_("items"), N_("registered")),
    "item.updated": EventView(N_("items"), "{summary}"),
    "item.deleted": EventView(N_("items"), N_("archived")),
    "revision.created": EventView(N_("files and revisions"), N_("revision {revision_number}{comment}")),
    "document.revised": EventView(N_("files and revisions"), N_("revision {revision_number}{comment}")),
    "revision.reviewed": EventView(
        N_("reviews and releases"), N_("revision {revision} {status}"), "/releases"
    ),
    "revision.released": EventView(
        N_("reviews and releases"), N_("revision {revision} {status}"), "/releases"
    ),
    "server.state": EventView(N_("the server"), N_("The server takes {changes}")),
}
KINDS = {
    kind: tuple(name for name, shown in EVENTS.items() if shown.kind == kind)
    for kind in dict.fromkeys(shown.kind for shown in EVENTS.values())
}
NAMES = tuple(EVENTS)


@dataclass(frozen=True, slots=True)
class ActivityEntry:
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
    """Show what happened, newest first, by kind, user, item (with all that is ``inside``) and days.

    ``before`` and ``after`` page through it; ``newer_than`` is for the page's script, which knows the rest.
    """
    days = {"since": _day(since), "until": _day(until)}
    with call.read() as tx:
        names, number = KINDS.get(kind, ()), item.strip()
        asked = EventQuery(names, user.strip(), number, days["since"], days["until"])
        with suppress(NotFoundError):
            if inside and number:
                asked = replace(asked, inside=ids_below(get_item(tx, number, include_archived=True)))
        if newer_than is None:
            part = part_of(partial(log.newest, tx, asked), MOST, before, after)
        else:
            # The newest of them, if there are more than a page holds.
            newest = [event for event in log.newest(tx, asked, MOST) if event.id > newer_than]
            part = ListPart(newest, None, None)
        last = log.head(tx)
        users = log.usernames(tx)
        uuids = [event.item_uuid for event in part.rows if event.item_uuid]
        items = {uuid.uuid: uuid for uuid in get_by_uuids(tx, uuids, include_archived=True)}
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
    """Read a day; "" for anything else, as a filter without a meaning filters nothing."""
    with suppress(ValueError):
        return date.fromisoformat(text).isoformat()
    return ""


def entry_of(event: LoggedEvent, item: Item | None = None) -> ActivityEntry:
    """Describe an event in words. ``item``: what it is about, as it is now."""
    data: dict[str, Any] = json.loads(event.data)
    number = item.part_number if item else str(data.get("item") or data.get("part_number") or "")
    path = f"/items/{segment(number)}" if number else ""
    if event.name in EVENTS:
        path += EVENTS[event.name].below
    if event.name == "document.revised":
        number, path = str(data.get("file_name") or ""), f"/documents/{segment(str(data.get('document')))}"
    return ActivityEntry(
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
    if name not in EVENTS:
        return name
    values = {
        **data,
        "summary": spoken(str(data.get("summary") or "changed")),
        "status": _(str(data.get("status", ""))),
        "comment": f": {isolate(str(data['comment']))}" if data.get("comment") else "",
        "changes": _("no changes at the moment") if data.get("mode") == "read-only" else _("changes again"),
    }
    return _(EVENTS[name].words).format_map(defaultdict(str, values))


def _counts(name: str, data: Mapping[str, Any]) -> tuple[tuple[str, int, str], ...]:
    if name != "bom_merge":
        return ()
    diff, warnings = data.get("diff", {}), data.get("warnings", ())
    counts = (
        ("added", len(diff.get("added", ())), _("added")),
        ("changed", len(diff.get("quantity_changed", ())), _("quantity changed")),
        ("warn", len(diff.get("removed", ())), _("unreferenced")),
        ("conflict", sum(warning.get("type") == "conflict" for warning in warnings), _("to decide")),
    )
    return tuple(count for count in counts if count[1]) or (("same", 0, _("changed")),)


PAGE_SIZE = 50
# The list shows so many lines of each change; the others are a click away.
TOLD_LINES = 12
KNOWN = 500
USUAL_DAYS = 30
MOST_CHANGES = 1000


@router.get("/items/{part_number}/history")
def history_page(call: Reader, part_number: str, before: PageFrom = None, after: PageFrom = None) -> Response:
    """Show all changes of a BOM, newest first; ``before`` and ``after`` are the changes to page from."""
    with call.read() as tx:
        item = get_item(tx, part_number, include_archived=True)
        part = part_of(partial(history.list_changes, tx, item), PAGE_SIZE, before, after)
        lines = history.lines_of_changes(tx, [change.id for change in part.rows], TOLD_LINES)
        newest = next(iter(history.list_changes(tx, item, 1)), None)
    texts = {
        change.id: sentences(lines.get(change.id, []), TOLD_LINES, change.line_count) for change in part.rows
    }
    return page(
        call,
        "history.html",
        item=item,
        changes=part.rows,
        told=texts,
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
    """Show what changed in a product over all levels.

    Between two dates or revisions; since the person last looked (``look``); or in the last 30 days.
    """
    problem, first, last, status = "", "", "", 200
    happenings: Sequence[PastChange] = ()
    models: list[list[int]] = [[], []]
    with call.server.large_reads.enter(), call.read() as tx:
        item = get_item(tx, part_number, include_archived=True)
        looked = last_look(tx, call.actor.own_id, item)
        if since in ("", "look"):
            since = looked if looked and since else (tx.at - timedelta(days=USUAL_DAYS)).date().isoformat()
        try:
            first, last, happenings = changes_of(tx, item, since, until)
            models = [revisions.files_until(tx, item, point) for point in (first, last)]
        except (NotFoundError, RejectedError) as error:
            problem, status = str(error), 404 if isinstance(error, NotFoundError) else 400
        points, _count = revisions.list_revisions(tx, item)
        has_file = revisions.has_file(tx, item)
        frozen = [change for change in list_releases(tx, item) if change.status in NUMBERED]
    return page(
        call,
        "changes.html",
        status=status,
        item=item,
        problem=problem,
        found=happenings[:MOST_CHANGES],
        more=max(0, len(happenings) - MOST_CHANGES),
        first=first,
        last=last,
        now=tx.stamp,
        since=since,
        until=until,
        looked=looked,
        points=points,
        frozen=frozen,
        by_whom=any(change.at for change in happenings),
        models=models,
        has_file=has_file,
        counts=Counter(change.what for change in happenings),
        asked=Address("", {"from": since, "to": until}).url().removeprefix("?"),
    )


@router.get("/items/{part_number}/compare")
def compare_page(
    call: Reader, part_number: str, old: PageFrom = None, new: PageFrom = None, all: bool = False
) -> Response:
    """Show two points of time, line by line; without ``old``, what the newest change did."""
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
        changes_listed = history.list_changes(tx, item, KNOWN)
        asked = {point for point in (old, new) if point} - {change.id for change in changes_listed}
        changes_listed += [history.get_change(tx, item, point)[0] for point in sorted(asked, reverse=True)]
        latest = changes_listed[0].id if changes_listed else 0
        second = latest if new is None else new
        before = history.list_changes(tx, item, 1, second) if old is None else []
        first = (before[0].id if before else 0) if old is None else old
        first, second = sorted((first, second))
        rows = compare(history.state_at(tx, item, first), history.state_at(tx, item, second))
        at = {change.id: change.at for change in changes_listed}
        models = [revisions.files_until(tx, item, at.get(point, "")) for point in (first, second)]
        has_file = revisions.has_file(tx, item)
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
        summary=", ".join(f"{count} {_(status)}" for status, count in counts.items() if count),
        old=first,
        new=second,
        known=changes_listed,
        models=models,
        has_file=has_file,
        show_all=show_all,
        latest=latest,
        problem=problem,
        reason=reason,
        archived=archived,
    )


STATUSES = (N_("added"), N_("removed"), N_("changed"), N_("unchanged"))


@router.post("/items/{part_number}/restore")
def restore(call: Writer, part_number: str, form: Form) -> Response:
    """Restore an earlier state of the BOM as a new change, if the page showed the newest."""
    change_id, reason = whole(form, "change_id"), text(form, "reason")
    if change_id is None:
        raise RejectedError(_("change_id: wanted the number of a change, got none; load the page again"))
    try:
        with call.write() as tx:
            item = get_item(tx, part_number)
            was = len(history.state_at(tx, item, change_id))
            expected = whole(form, "version")
            sure = bool(text(form, "with_archived"))
            made, _lines = restore_bom(
                tx, part_number, change_id, reason or None, expected, with_archived=sure
            )
    except ArchivedPartsError as error:
        numbers = ", ".join(error.part_numbers[:10])
        problem = _(
            "Nothing was restored yet: archived parts would come back (%(numbers)s).", numbers=numbers
        )
        return _compare(
            call, part_number, (change_id, None), problem=problem, reason=reason, status=409, archived=True
        )
    except VersionConflictError:
        problem = _(
            "Nothing was restored: somebody else changed this BOM meanwhile. Below are the differences "
            "now; restore again if all of them should go back."
        )
        points = (change_id, None)
        return _compare(call, part_number, points, problem=problem, reason=reason, status=412)
    notice = _("Restored: %(lines)s as of change %(change)s.", lines=plural(was, "line"), change=change_id)
    return back(bom_path(part_number), notice, undo=[made])
