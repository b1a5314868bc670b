# SPDX-License-Identifier: LGPL-2.1-or-later
"""What happened to a BOM: every change, any two points side by side, and the way back."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from silo.bom.errors import RejectedError
from silo_server.routes.context import ServerDep
from silo_server.services import history
from silo_server.services.items import get_item
from silo_server.web.forms import Form, back, text, whole
from silo_server.web.guard import Reader, Writer
from silo_server.web.merge_page import bom_path
from silo_server.web.render import page, segment
from silo_server.web.words import changes, sentences

router = APIRouter(include_in_schema=False)

PAGE_SIZE = 50
# Of this many newest changes the lines are told on the list; older ones are a click away.
TOLD = 10


@router.get("/items/{part_number}/history")
def history_page(
    request: Request,
    server: ServerDep,
    caller: Reader,
    part_number: str,
    before: Annotated[int | None, Query(ge=0, le=2**62)] = None,
) -> Response:
    """All changes, newest first."""
    with server.db.read(caller) as tx:
        item = get_item(tx, part_number, include_archived=True)
        found = history.list_changes(tx, item, PAGE_SIZE + 1, before)
        told = {
            change.id: sentences(history.get_change(tx, item, change.id)[1], 12) for change in found[:TOLD]
        }
    more = found[PAGE_SIZE - 1].id if len(found) > PAGE_SIZE else None
    return page(request, "history.html", caller, item=item, changes=found[:PAGE_SIZE], told=told, more=more)


@router.get("/items/{part_number}/compare")
def compare_page(
    request: Request,
    server: ServerDep,
    caller: Reader,
    part_number: str,
    old: Annotated[int, Query(ge=0, le=2**62)] = 0,
    new: Annotated[int | None, Query(ge=0, le=2**62)] = None,
) -> Response:
    """Two points of time, line by line."""
    with server.db.read(caller) as tx:
        item = get_item(tx, part_number, include_archived=True)
        known = history.list_changes(tx, item, 500)
        latest = known[0].id if known else 0
        chosen = latest if new is None else new
        first, second = sorted((old, chosen))
        rows = history.compare(history.state_at(tx, item, first), history.state_at(tx, item, second))
    said = {
        row.child.id: changes(row.before, row.after)
        for row in rows
        if row.before is not None and row.after is not None
    }
    return page(
        request,
        "compare.html",
        caller,
        item=item,
        rows=rows,
        said=said,
        old=first,
        new=second,
        known=known,
        is_latest=first == latest,
    )


@router.post("/items/{part_number}/restore")
def restore(server: ServerDep, caller: Writer, part_number: str, form: Form) -> Response:
    """Make the BOM again what it was; a new change, so nothing of the history is lost."""
    change_id = whole(form, "change_id")
    if change_id is None:
        raise RejectedError("change_id: wanted the number of a change, got none; load the page again")
    with server.db.write(caller) as tx:
        history.restore(tx, part_number, change_id, text(form, "reason") or None, None)
    return back(bom_path(part_number), "Restored. The former state is in the history.")


def history_path(part_number: str) -> str:
    """The history page of an item."""
    return f"/items/{segment(part_number)}/history"
