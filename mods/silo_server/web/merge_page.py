# SPDX-License-Identifier: LGPL-2.1-or-later
"""The page at ``resolve_url``: what a merge left to decide, and the BOM's lines."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Annotated, Any
from urllib.parse import parse_qsl, urlencode

from fastapi import APIRouter, Depends, Query
from starlette.datastructures import FormData
from starlette.responses import Response

from silo.bom.errors import (
    BusyError,
    ConflictError,
    CycleError,
    NotFoundError,
    RejectedError,
    SiloError,
)
from silo.bom.numbers import whole_number
from silo.bom.units import PIECES
from silo_server.db.transaction import Tx
from silo_server.errors import DuplicateError, LinesChangedError
from silo_server.events import log
from silo_server.routes.call import Call
from silo_server.routes.requests import NumberedRoute
from silo_server.schema import text_hints
from silo_server.services.bom import history, line_edit, review
from silo_server.services.bom.assignees import assignee_of, editors
from silo_server.services.bom.decisions import Decision, resolve
from silo_server.services.bom.last_sync import in_sentences, last_sync
from silo_server.services.bom.line_state import mark_of
from silo_server.services.bom.lines import LineId, component_of, line_of, lines_of
from silo_server.services.import_undo import undo_bom_change
from silo_server.services.items import get_item
from silo_server.services.product.summary_read import summary_of
from silo_server.services.revisions import files_until, has_file
from silo_server.services.search import fits
from silo_server.values import Line, LineState
from silo_server.web import line_form
from silo_server.web.accounts import Reader, Writer
from silo_server.web.forms import AmbiguousError, Form, back, text, texts, whole
from silo_server.web.line_form import FIELDS, LineForm, by_whom, sentences
from silo_server.web.render import (
    N_,
    NOTICE,
    Address,
    Page,
    _,
    arranged,
    isolate,
    page,
    page_of,
    plural,
    segment,
    sentence,
)

router = APIRouter(route_class=NumberedRoute, include_in_schema=False)

LATER_CHANGES = 5
# So many open questions are shown; up to so many have a form each, more are decided by boxes.
MOST_SHOWN, MOST_FORMS = 1000, 100


@dataclass(frozen=True)
class PageState:
    """What the page is asked to show besides the BOM: a problem, and the form that is being filled in.

    edit
        the line whose form is open; ``typed`` and ``why`` are what stands in it, ``seen`` what it showed
        before, ``clashes`` the fields that somebody else changed as well.
    view
        the query of the page that the person came from, without ``edit``.
    chosen, reasons
        the boxes of a decision that was refused, and its reasons, by line ("" for that of all chosen ones).
    story
        what happened meanwhile, in words.
    readings
        the two numbers that a quantity can be read as.
    """

    problem: str = ""
    edit: str = ""
    view: str = ""
    typed: Mapping[str, str] = field(default_factory=dict)
    seen: Mapping[str, str] = field(default_factory=dict)
    why: str = ""
    clashes: Sequence[str] = ()
    chosen: Collection[str] = ()
    reasons: Mapping[str, str] = field(default_factory=dict)
    story: Sequence[str] = ()
    readings: Sequence[str] = ()


class RefusedDecision(Exception):
    """A form that was not carried out: how the page shows it again."""

    def __init__(self, asked: PageState, status: int = 409) -> None:
        super().__init__(asked.problem)
        self.asked, self.status = asked, status


def bom_path(part_number: str) -> str:
    """Return the address of an item's merge page."""
    return f"/items/{segment(part_number)}/bom"


SHOWS: Mapping[str, tuple[str, Callable[[Line], bool]]] = {
    "cad": (N_("from CAD"), lambda line: line.state.source == "assembly"),
    "hand": (N_("by hand"), lambda line: line.state.source == "manual"),
    "override": (N_("overridden here"), lambda line: line.state.override),
    "unreferenced": (N_("unreferenced"), lambda line: line.state.unreferenced_since is not None),
    "archived": (N_("archived items"), lambda line: line.child_archived),
}


@dataclass(frozen=True)
class LineView:
    """The part of the address that says which lines the table has (:func:`table_of`)."""

    q: Annotated[str, Query(max_length=200)] = ""
    show: Annotated[str, Query(pattern=f"^({'|'.join(SHOWS)})?$")] = ""
    sort: Annotated[str, Query(max_length=20)] = ""
    page: Annotated[int, Query(ge=1, le=10**7)] = 1


@router.get("/items/{part_number}/bom")
def merge_page(
    call: Reader,
    part_number: str,
    _view: Annotated[LineView, Depends()],
    edit: Annotated[str, Query(max_length=64)] = "",
) -> Response:
    """Show unreferenced lines, conflicts, the last sync in plain words, and the lines; ``edit`` opens one."""
    return _show(call, part_number, PageState(edit=edit, view=view_of(call.request.url.query)))


@router.post("/items/{part_number}/bom/decide")
def decide(call: Writer, part_number: str, form: Form) -> Response:
    """Carry out a decision, for one line or for all chosen lines, if they are as the person saw them."""
    chosen = [value.partition(" ")[0] for value in texts(form, "chosen")]
    reasons = {chosen[0] if chosen and "bulk" not in form else "": text(form, "reason")}
    asked = PageState(chosen=chosen, reasons=reasons)

    def work(tx: Tx) -> tuple[str, int]:
        parent = get_item(tx, part_number)
        names = {line.id: line.child_part_number for line in lines_of(tx, parent)}
        decisions = line_form.decisions_of(form, names)
        if not decisions:
            return _("No line was chosen, so nothing was changed."), 0
        try:
            change, _lines = resolve(tx, part_number, decisions)
        except LinesChangedError as error:
            story = line_form.meanwhile(tx, parent, error.line_ids, whole(form, "at") or 0)
            gone = [names.get(line_id, _("a line that is gone")) for line_id in error.line_ids]
            count = plural(len(gone), "line was", "lines were")
            problem = _(
                "Nothing was done: %(count)s changed while you were deciding. Look again, then decide.",
                count=count,
            )
            refusals = [
                f"{names.get(line_id, _('A line'))}: {words}" for line_id in story for words in story[line_id]
            ] or gone
            left = [line_id for line_id in chosen if line_id not in error.line_ids]
            raise RefusedDecision(replace(asked, problem=problem, story=refusals, chosen=left), 412) from None
        return _decided_text(decisions), change

    return _do(call, part_number, form, work, asked)


@router.post("/items/{part_number}/bom/undo")
def undo(call: Writer, part_number: str, form: Form) -> Response:
    """Undo a change, as a new change; an import is taken back as a whole."""

    def work(tx: Tx) -> tuple[str, int]:
        change_id = whole(form, "change_id")
        if change_id is None:
            raise RejectedError(_("change_id: wanted the number of a change, got none; load the page again"))
        return _("Undone."), undo_bom_change(tx, part_number, change_id)

    return _do(call, part_number, form, work)


@router.post("/items/{part_number}/bom/lines")
def add_line(call: Writer, part_number: str, form: Form) -> Response:
    """Add a manual line. If the part has a line already, open that one with what was typed."""
    sent = line_form.read(form)
    child = text(form, "child")
    asked = PageState(typed={**sent.typed, "child": child}, why=sent.why)

    def work(tx: Tx) -> tuple[str, int]:
        if not child:
            raise RejectedError(_("part number: wanted the number of an item, got nothing"))
        new = LineState(**{"quantity": 1.0, "source": "manual", **line_form.values_of(sent.typed)})
        try:
            added = line_edit.add_line(tx, part_number, child, new, why=sent.why or None)
        except DuplicateError as error:
            parent = get_item(tx, part_number)
            line = component_of(lines_of(tx, parent), child, parent)
            # Fields that were left empty keep what the line has.
            typed = {**line_form.shown(line.state), **{k: v for k, v in sent.typed.items() if v}}
            problem = f"{_sentence(error)} {_('Its line is open here with your values.')}"
            raise RefusedDecision(replace(asked, problem=problem, edit=line.id, typed=typed)) from None
        return _("%(number)s added.", number=isolate(added.child_part_number)), added.change_id

    return _do(call, part_number, form, work, asked)


@router.post("/items/{part_number}/bom/lines/{line_id}")
def change_line(call: Writer, part_number: str, line_id: str, form: Form) -> Response:
    """Save what the person changed in the form of a line; ask about what two people changed."""

    def change(tx: Tx, line: Line, sent: LineForm, asked: PageState, news: list[str]) -> tuple[str, int]:
        if clashes := line_form.unmade(sent):
            raise RefusedDecision(
                replace(asked, problem=_("Choose yours or theirs, then save."), clashes=clashes), 400
            )
        edit = line_form.edit_of(sent, line.state)
        if edit.clashes:
            problem = _(
                "Nothing was saved yet: somebody else changed %(number)s while you edited it. "
                "Choose whose value stays.",
                number=line.child_part_number,
            )
            raise RefusedDecision(replace(asked, problem=problem, story=news, clashes=edit.clashes), 412)
        why = sent.why or None
        edited = line_edit.change_line(
            tx, part_number, LineId(line.id), line_form.values_of(edit.mine), why=why
        )
        also = _(" Meanwhile: %(told)s.", told="; ".join(news)) if edit.theirs and news else ""
        if not edited.change_id or edited.line is None:
            return _("Your values are the same as in Silo, so nothing was changed.") + also, 0
        notice = _("%(number)s changed.", number=isolate(edited.child_part_number))
        return notice + also, edited.change_id

    return _do_line(call, part_number, line_id, form, change)


@router.post("/items/{part_number}/bom/lines/{line_id}/remove")
def remove_line(call: Writer, part_number: str, line_id: str, form: Form) -> Response:
    """Take a line out of the BOM, if it is as the person saw it."""

    def remove(tx: Tx, line: Line, sent: LineForm, asked: PageState, news: list[str]) -> tuple[str, int]:
        seen, why = text(form, "mark") or None, sent.why or None
        try:
            edited = line_edit.remove_line(tx, part_number, LineId(line.id), seen=seen, why=why)
        except LinesChangedError:
            problem = _(
                "Nothing was removed: %(number)s was changed by somebody else meanwhile.",
                number=line.child_part_number,
            )
            raise RefusedDecision(replace(asked, problem=problem, story=news), 412) from None
        return _("%(number)s removed.", number=isolate(edited.child_part_number)), edited.change_id

    return _do_line(call, part_number, line_id, form, remove)


def _do_line(
    call: Call,
    part_number: str,
    line_id: str,
    form: FormData,
    act: Callable[[Tx, Line, LineForm, PageState, list[str]], tuple[str, int]],
) -> Response:
    """Do ``act`` to the line of a form. If the line is gone, what was typed stays in the form for a new one.

    act
        gets the line as it is now, the form, how the page shows it again, and what happened to the line
        meanwhile.
    """
    sent = line_form.read(form)
    asked = PageState(edit=line_id, typed=sent.typed, seen=sent.seen, why=sent.why)

    def work(tx: Tx) -> tuple[str, int]:
        parent = get_item(tx, part_number, lock=True)
        news = line_form.meanwhile(tx, parent, [line_id], sent.at).get(line_id, [])
        try:
            line = line_of(lines_of(tx, parent), LineId(line_id), parent)
        except NotFoundError:
            problem = _(
                "This line is no longer in the BOM. Your values are below, ready to be added as a new line."
            )
            typed = {**sent.typed, "child": text(form, "child")}
            raise RefusedDecision(
                replace(asked, problem=problem, story=news, edit="", typed=typed), 404
            ) from None
        return act(tx, line, sent, asked, news)

    return _do(call, part_number, form, work, asked)


def view_of(query: str) -> str:
    """Return the query that the page goes back to: without the line that is being edited, and the notice."""
    kept = [pair for pair in parse_qsl(query[:1000]) if pair[0] not in ("edit", NOTICE)]
    return urlencode(kept)


def _do(
    call: Call,
    part_number: str,
    form: FormData,
    work: Callable[[Tx], tuple[str, int]],
    asked: PageState | None = None,
) -> Response:
    """Do ``work`` and go back; if it cannot be done, the page says why and keeps what was typed."""
    view = view_of(text(form, "view", 1000))
    given = replace(asked or PageState(), view=view)
    try:
        with call.write() as tx:
            notice, change_id = work(tx)
    except RefusedDecision as refused:
        shown = replace(refused.asked, view=view)
        return _show(call, part_number, shown, refused.status)
    except SiloError as error:
        readings = error.readings if isinstance(error, AmbiguousError) else ()
        shown = replace(given, problem=_sentence(error), readings=readings)
        return _show(call, part_number, shown, error.status_hint)
    return back(bom_path(part_number) + (f"?{view}" if view else ""), notice, undo=[change_id])


def _show(call: Call, part_number: str, asked: PageState, status: int = 200) -> Response:
    with call.read() as tx:
        review_of = review.review(tx, part_number)
        item, lines = review_of.parent, review_of.lines
        last = last_sync(tx, item)
        merge = review_of.last_merge
        merged = history.get_change(tx, item, merge.id)[1] if merge else []
        recent = history.list_changes(tx, item, LATER_CHANGES)
        seen = log.head(tx)
        try:
            below = summary_of(tx, item).open_boms(item.id)
        except (BusyError, CycleError) as error:
            below, asked = [], replace(asked, problem=asked.problem or _sentence(error))
        by_hand, cad_words = line_form.disputed(tx, item, lines, review_of)
        # The model is compared with the file before the one that the oldest question came with.
        since = [line.state.unreferenced_since for line in review_of.unreferenced]
        since += [conflict.since for conflict in review_of.conflicts]
        asked_at = min(filter(None, since), default=merge.at if merge else "")
        before = files_until(tx, item, asked_at, 2)[1:]
        drawn = has_file(tx, item)
        assignee, people = assignee_of(tx, item), editors(tx)
    conflicts = {conflict.line.id: conflict for conflict in review_of.conflicts}
    editing = _editing(lines, asked, item)
    problem = asked.problem
    if asked.edit and editing is None and not problem:
        problem = _("The line that you wanted to edit is not in this BOM any more.")
    now = line_form.shown(editing.state) if editing else {}
    table, table_at = table_of(lines, bom_path(item.part_number), asked.view)
    return page(
        call,
        "merge.html",
        status=status,
        item=item,
        total=len(lines),
        table=table,
        # A line is named by its child, which is shorter than its id, if the child has no other line.
        several={child for child, count in Counter(line.child_id for line in lines).items() if count > 1},
        table_at=table_at,
        shows=SHOWS,
        editing=editing,
        editing_apart=editing is not None and editing.id not in {line.id for line in table.rows},
        now=now,
        kept=line_form.still_typed(asked.typed, asked.seen, now),
        mark=mark_of(editing.state) if editing else "",
        marks=review.marks_of([*review_of.unreferenced, *(c.line for c in review_of.conflicts)], conflicts),
        asked=replace(asked, problem=problem),
        labels={name: _(label) for name, label in FIELDS.items()},
        texts={name: text_hints(field) for name, field in line_form.TEXTS.items()},
        group_of=line_form.group_of,
        at=recent[0].id if recent else 0,
        by_hand=by_hand,
        assignee=assignee,
        people=people,
        cad_words=cad_words,
        below=below,
        of_cad=line_form.of_cad,
        by_sync=by_whom(merge) if merge else "",
        before=before,
        has_file=drawn,
        last=last,
        gaps=in_sentences(last.own_gaps),
        held_gaps=in_sentences(last.held_gaps),
        unreferenced=review_of.unreferenced,
        units=review_of.units,
        pieces=PIECES.symbol,
        most_shown=MOST_SHOWN,
        most_forms=MOST_FORMS,
        conflicts=review_of.conflicts,
        merge=merge,
        merged=sentences(merged),
        later=[change for change in recent if merge is None or change.id > merge.id],
        newest=recent[0] if recent else None,
        seen=seen,
    )


_SORTS: Mapping[str, Callable[[Line], Any]] = {
    "number": lambda line: line.child_part_number.casefold(),
    "name": lambda line: line.child_name.casefold(),
    "position": lambda line: line.state.find_number,
    "quantity": lambda line: line.state.quantity,
    "source": lambda line: line.state.source,
}


def table_of(lines: Sequence[Line], path: str, view: str) -> tuple[Page[Line], Address]:
    """Find the lines that the query ``view`` asks for; return a page of them, and its address."""
    asked = {name: value[:200] for name, value in parse_qsl(view) if name in ("q", "show", "sort", "page")}
    test, shown = fits(asked.get("q", "")), SHOWS.get(asked.get("show", ""))
    shown_lines = [
        line
        for line in lines
        if (shown is None or shown[1](line))
        and test(
            line.child_part_number,
            line.child_name,
            *(
                line.state.reason,
                *line.state.reference_designators,
                *(getattr(line.state, name) for name in line_form.TEXTS),
            ),
        )
    ]
    wanted = whole_number(asked.pop("page", "")) or 1
    table = page_of(arranged(shown_lines, asked.get("sort", ""), _SORTS), len(lines), wanted)
    return table, Address(path, asked | ({"page": str(table.number)} if table.number > 1 else {}))


def _editing(lines: Sequence[Line], asked: PageState, item: Any) -> Line | None:
    if not asked.edit:
        return None
    for which in (LineId(asked.edit), asked.edit):
        with suppress(NotFoundError, ConflictError):
            return line_of(lines, which, item)
    return None


def _decided_text(decisions: list[Decision]) -> str:
    who = isolate(decisions[0].child_part_number)
    lines = who if len(decisions) == 1 else plural(len(decisions), "line")
    return f"{lines} {_(line_form.DONE[decisions[0].action])}."


def _sentence(error: SiloError) -> str:
    problems = error.problems if isinstance(error, RejectedError) else ()
    message = "; ".join(
        problem.partition(": ")[2] if problem.startswith("decisions[") else problem for problem in problems
    ) or str(error)
    return sentence(message)
