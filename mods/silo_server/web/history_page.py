# SPDX-License-Identifier: LGPL-2.1-or-later
"""What happened to a BOM: every change, any two points side by side, and the way back."""

from __future__ import annotations

from functools import partial

from fastapi import APIRouter
from starlette.responses import Response

from silo.bom.errors import RejectedError, VersionConflictError
from silo_server.routes.context import Call, PageFrom
from silo_server.services.bom import history
from silo_server.services.items import get_item
from silo_server.web.forms import Form, back, text, whole
from silo_server.web.line_form import changes, sentences
from silo_server.web.login_page import Reader, Writer
from silo_server.web.merge_page import bom_path
from silo_server.web.render import page, plural
from silo_server.web.tables import part_of

router = APIRouter(include_in_schema=False)

PAGE_SIZE = 50
# So many lines of each change stand on the list; the others are a click away.
TOLD_LINES = 12
KNOWN = 500


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
            made, _ = history.restore(tx, part_number, change_id, reason or None, expected)
    except VersionConflictError:
        problem = (
            "Nothing was restored: somebody else changed this BOM meanwhile. Here is what differs now; "
            "restore again if that, too, should be as it was."
        )
        points = (change_id, None)
        return _compare(call, part_number, points, problem=problem, reason=reason, status=412)
    said = f"Restored: {plural(was, 'line', 'lines')} as of change {change_id}."
    return back(bom_path(part_number), said, undo=made)
