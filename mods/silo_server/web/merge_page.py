# SPDX-License-Identifier: LGPL-2.1-or-later
"""The page at ``resolve_url``: what a merge left for a person to decide."""

from __future__ import annotations

from fastapi import APIRouter, Request
from starlette.datastructures import FormData
from starlette.responses import Response

from silo.bom.errors import RejectedError
from silo_server.routes.context import ServerDep
from silo_server.services import history
from silo_server.services import review as service
from silo_server.services.items import get_item
from silo_server.services.lines import lines_of
from silo_server.services.review import Action, Decision
from silo_server.web.forms import Form, back, text, texts, whole
from silo_server.web.guard import Reader, Writer
from silo_server.web.render import page, segment
from silo_server.web.words import sentences

router = APIRouter(include_in_schema=False)

_SINGLE = {action.value: action for action in Action}


def bom_path(part_number: str) -> str:
    """The merge page of an item."""
    return f"/items/{segment(part_number)}/bom"


@router.get("/items/{part_number}/bom")
def merge_page(request: Request, server: ServerDep, caller: Reader, part_number: str) -> Response:
    """Unreferenced lines, conflicts, the last change in plain words, and all lines."""
    with server.db.read(caller) as tx:
        item = get_item(tx, part_number)
        found = service.review(tx, item.part_number)
        lines = lines_of(tx, item)
        last = next(iter(history.list_changes(tx, item, 1)), None)
        changed = history.get_change(tx, item, last.id)[1] if last else []
    return page(
        request,
        "merge.html",
        caller,
        item=item,
        lines=lines,
        unreferenced=found.unreferenced,
        conflicts=found.conflicts,
        last_change=last,
        last_lines=sentences(changed),
        can_undo=last is not None,
    )


@router.post("/items/{part_number}/bom/decide")
def decide(server: ServerDep, caller: Writer, part_number: str, form: Form) -> Response:
    """Carry out one button, or all chosen lines at once."""
    decisions = decisions_of(form)
    if not decisions:
        return back(bom_path(part_number), "Nothing was chosen, so nothing was changed.")
    with server.db.write(caller) as tx:
        service.resolve(tx, part_number, decisions, whole(form, "version"))
    lines = "1 line" if len(decisions) == 1 else f"{len(decisions)} lines"
    return back(bom_path(part_number), f"Done: {lines}. It can be undone below.")


@router.post("/items/{part_number}/bom/undo")
def undo(server: ServerDep, caller: Writer, part_number: str, form: Form) -> Response:
    """Take the last change back, as a new change."""
    change_id = whole(form, "change_id")
    if change_id is None:
        raise RejectedError("change_id: wanted the number of a change, got none; load the page again")
    with server.db.write(caller) as tx:
        history.undo(tx, part_number, change_id, None)
    return back(bom_path(part_number), "Undone.")


def decisions_of(form: FormData) -> list[Decision]:
    """The decisions in a submitted form: the button's own line, or ``all`` for the chosen ones."""
    reason = text(form, "reason") or None
    for name, action in _SINGLE.items():
        if name in form:
            return [Decision(text(form, name), action, reason)]
    for_all = _SINGLE.get(text(form, "all"))
    return [Decision(number, for_all, reason) for number in texts(form, "chosen")] if for_all else []
