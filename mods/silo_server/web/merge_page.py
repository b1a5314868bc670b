# SPDX-License-Identifier: LGPL-2.1-or-later
"""The page at ``resolve_url``: what a merge left for a person to decide, and the BOM's lines."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request
from starlette.datastructures import FormData
from starlette.responses import Response

from silo.bom.errors import ConflictError, NotFoundError, RejectedError, SiloError, VersionConflictError
from silo_server.db.engine import Tx
from silo_server.routes.context import Server, ServerDep
from silo_server.services import events
from silo_server.services.bom import edits, history
from silo_server.services.bom import review as service
from silo_server.services.bom.last_sync import in_sentences, last_sync
from silo_server.services.bom.lines import LineId, line_of, lines_of
from silo_server.services.bom.review import Action, Decision
from silo_server.services.items import get_item
from silo_server.values import Actor, Line
from silo_server.web.forms import Form, amount, back, text, texts, whole
from silo_server.web.guard import Reader, Writer
from silo_server.web.render import page, plural, segment
from silo_server.web.words import FIELDS, sentences

router = APIRouter(include_in_schema=False)

# A person looks at that many lines; all of them are one click away.
FIRST_LINES = 500
LATER_CHANGES = 5
KEPT = "kept on purpose, not in the CAD model"
CHANGED_MEANWHILE = (
    "Somebody else changed this BOM while you were deciding. Nothing of yours was done; "
    "this is how it stands now."
)


@dataclass(frozen=True)
class Asked:
    """What the page is asked to show besides the BOM: a problem, and the form that is being filled in."""

    problem: str = ""
    edit: str = ""
    show_all: bool = False
    typed: Mapping[str, str] = field(default_factory=dict)


def bom_path(part_number: str) -> str:
    """The merge page of an item."""
    return f"/items/{segment(part_number)}/bom"


@router.get("/items/{part_number}/bom")
def merge_page(
    request: Request,
    server: ServerDep,
    caller: Reader,
    part_number: str,
    edit: Annotated[str, Query(max_length=64)] = "",
    all: bool = False,
) -> Response:
    """Unreferenced lines, conflicts, the last sync in plain words, and all lines; ``edit`` opens one."""
    return _show(request, server, caller, part_number, Asked(edit=edit, show_all=all))


@router.post("/items/{part_number}/bom/decide")
def decide(request: Request, server: ServerDep, caller: Writer, part_number: str, form: Form) -> Response:
    """Carry a decision out, for one line or for all chosen ones."""

    def work(tx: Tx) -> str:
        names = {line.id: line.child_part_number for line in lines_of(tx, get_item(tx, part_number))}
        decisions = decisions_of(form, names)
        if not decisions:
            return "No line was chosen, so nothing was changed."
        service.resolve(tx, part_number, decisions, whole(form, "version"))
        return _done(decisions)

    return _do(request, server, caller, part_number, work)


@router.post("/items/{part_number}/bom/undo")
def undo(request: Request, server: ServerDep, caller: Writer, part_number: str, form: Form) -> Response:
    """Take a change back, as a new change."""

    def work(tx: Tx) -> str:
        change_id = whole(form, "change_id")
        if change_id is None:
            raise RejectedError("change_id: wanted the number of a change, got none; load the page again")
        history.undo(tx, part_number, change_id, None)
        return "Undone."

    return _do(request, server, caller, part_number, work)


@router.post("/items/{part_number}/bom/lines")
def add_line(request: Request, server: ServerDep, caller: Writer, part_number: str, form: Form) -> Response:
    """Add a manual line."""

    def work(tx: Tx) -> str:
        values = line_fields(form)
        if not text(form, "child"):
            raise RejectedError("part number: wanted the number of an item, got nothing")
        new = edits.NewLine(child_part_number=text(form, "child"), **values)
        added = edits.add_line(tx, part_number, new, whole(form, "version"))
        return f"{added.line.child_part_number if added.line else 'The line'} added."

    return _do(request, server, caller, part_number, work, Asked(typed=_typed(form)))


@router.post("/items/{part_number}/bom/lines/{line_id}")
def change_line(
    request: Request, server: ServerDep, caller: Writer, part_number: str, line_id: str, form: Form
) -> Response:
    """Change what a person may change on a line."""

    def work(tx: Tx) -> str:
        which = LineId(line_id)
        edited = edits.change_line(tx, part_number, which, line_fields(form), whole(form, "version"))
        if not edited.change_id or edited.line is None:
            return "Nothing was different, so nothing was changed."
        return f"{edited.line.child_part_number} changed."

    return _do(request, server, caller, part_number, work, Asked(edit=line_id, typed=_typed(form)))


@router.post("/items/{part_number}/bom/lines/{line_id}/remove")
def remove_line(
    request: Request, server: ServerDep, caller: Writer, part_number: str, line_id: str, form: Form
) -> Response:
    """Take a line out of the BOM."""

    def work(tx: Tx) -> str:
        edited = edits.remove_line(tx, part_number, LineId(line_id), whole(form, "version"))
        return f"{edited.child_part_number} removed."

    return _do(request, server, caller, part_number, work)


def decisions_of(form: FormData, names: Mapping[str, str]) -> list[Decision]:
    """The decisions in a submitted form: one action for each line (by its id, or its child) in ``chosen``.

    names
        line id → part number, of the BOM's lines.
    """
    try:
        action = Action(text(form, "action"))
    except ValueError:
        raise RejectedError("action: wanted one of the buttons, got none; load the page again") from None
    reason = text(form, "reason") or (KEPT if action is Action.KEEP else None)
    return [
        Decision(names.get(which, which), action, reason, which if which in names else None)
        for which in texts(form, "chosen")
    ]


def line_fields(form: FormData) -> dict[str, Any]:
    """The fields of a line that people fill in."""
    return {
        "quantity": amount(form, "quantity"),
        "unit": text(form, "unit", 32) or None,
        "reference_designators": tuple(text(form, "reference_designators", 10_000).replace(",", " ").split()),
        "find_number": text(form, "find_number", 32) or None,
        "notes": text(form, "notes", 10_000) or None,
    }


def _do(
    request: Request,
    server: Server,
    caller: Actor,
    part_number: str,
    work: Callable[[Tx], str],
    asked: Asked | None = None,
) -> Response:
    """Do ``work`` and go back; where it cannot be done, the page says why and keeps what was typed."""
    try:
        with server.db.write(caller) as tx:
            notice = work(tx)
    except SiloError as error:
        given = asked or Asked()
        problem = CHANGED_MEANWHILE if isinstance(error, VersionConflictError) else _plain(error)
        shown = Asked(problem, given.edit, typed=given.typed)
        return _show(request, server, caller, part_number, shown, error.status_hint)
    return back(bom_path(part_number), notice)


def _show(
    request: Request, server: Server, caller: Actor, part_number: str, asked: Asked, status: int = 200
) -> Response:
    with server.db.read(caller) as tx:
        item = get_item(tx, part_number)
        found = service.review(tx, item.part_number)
        lines = lines_of(tx, item)
        last = last_sync(tx, item)
        merge = found.last_merge
        merged = history.get_change(tx, item, merge.id)[1] if merge else []
        recent = history.list_changes(tx, item, LATER_CHANGES)
        seen = events.head(tx)
    return page(
        request,
        "merge.html",
        caller,
        status=status,
        item=item,
        total=len(lines),
        lines=lines if asked.show_all else lines[:FIRST_LINES],
        editing=_editing(lines, asked, item),
        typed=asked.typed,
        problem=asked.problem,
        last=last,
        gaps=in_sentences(last.gaps),
        unreferenced=found.unreferenced,
        conflicts=found.conflicts,
        merge=merge,
        merged=sentences(merged),
        later=[change for change in recent if merge is None or change.id > merge.id],
        newest=recent[0] if recent else None,
        seen=seen,
    )


def _editing(lines: list[Line], asked: Asked, item: Any) -> Line | None:
    if not asked.edit:
        return None
    for which in (LineId(asked.edit), asked.edit):
        with suppress(NotFoundError, ConflictError):
            return line_of(lines, which, item)
    return None


def _typed(form: FormData) -> dict[str, str]:
    return {name: str(form.get(name, "")) for name in ("child", *FIELDS)}


def _done(decisions: list[Decision]) -> str:
    words = {
        Action.REMOVE: "removed",
        Action.KEEP: "kept as intentional",
        Action.TAKE_CAD: "set to what CAD says",
        Action.KEEP_SILO: "left as Silo says",
    }[decisions[0].action]
    who = decisions[0].child_part_number
    return f"{who if len(decisions) == 1 else plural(len(decisions), 'line', 'lines')} {words}."


def _plain(error: SiloError) -> str:
    problems = error.problems if isinstance(error, RejectedError) else ()
    message = "; ".join(
        problem.partition(": ")[2] if problem.startswith("decisions[") else problem for problem in problems
    ) or str(error)
    return message[:1].upper() + message[1:] + "."
