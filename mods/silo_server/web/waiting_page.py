# SPDX-License-Identifier: LGPL-2.1-or-later
"""All that waits: revisions in review, and the BOMs with something open, by project folder, with one decision
for many of them.

What waits for the user who looks: reviews to approve, the open BOMs that are theirs, and the news of what
they follow.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Annotated, Any

from fastapi import APIRouter, Query
from starlette.datastructures import FormData
from starlette.responses import Response

from silo.bom.errors import SiloError, VersionConflictError
from silo.bom.numbers import whole_number
from silo_server.db.transaction import Tx
from silo_server.routes.call import Call
from silo_server.routes.requests import NumberedRoute
from silo_server.services import following
from silo_server.services.bom import assignees, history
from silo_server.services.bom.assignees import editors
from silo_server.services.bom.decisions import ReviewAction, decide_all, lines_for
from silo_server.services.bom.restore import undo_change
from silo_server.services.bom.waiting import Waiting, waiting
from silo_server.services.following import have_seen
from silo_server.services.releases import review_count, reviews, reviews_for
from silo_server.services.scene import with_model
from silo_server.services.search import fits
from silo_server.values import Line
from silo_server.web.accounts import Reader, Writer
from silo_server.web.forms import Form, back, back_to, text, texts
from silo_server.web.line_form import DONE, decision_of
from silo_server.web.render import N_, Address, _, arranged, isolate, page, page_of, plural, spoken

router = APIRouter(route_class=NumberedRoute, include_in_schema=False)

# What may wait, and what the filter calls it.
KINDS: Mapping[str, tuple[str, Callable[[Waiting], int]]] = {
    "unreferenced": (N_("unreferenced lines"), lambda row: row.unreferenced),
    "conflicts": (N_("conflicts"), lambda row: row.conflicts),
    "incomplete": (N_("incomplete syncs"), lambda row: row.left_out),
    "unregistered": (N_("unregistered parts"), lambda row: row.unregistered),
    "units": (N_("lines with unit?"), lambda row: row.units),
    "held": (N_("BOMs that are held"), lambda row: int(row.held is not None)),
}
_SORTS: Mapping[str, Callable[[Waiting], Any]] = {
    "number": lambda row: row.part_number.casefold(),
    "name": lambda row: row.name.casefold(),
    "folder": lambda row: row.folder.casefold(),
    "unreferenced": lambda row: row.unreferenced,
    "conflicts": lambda row: row.conflicts,
    "incomplete": lambda row: row.left_out,
    "unregistered": lambda row: row.unregistered,
    "units": lambda row: row.units,
    "assignee": lambda row: row.assignee.casefold(),
    "synced": lambda row: row.synced_at,
}
MOST_TOLD = 20
PAGE_SIZE = 200


@router.get("/waiting")
def waiting_page(
    call: Reader,
    q: Annotated[str, Query(max_length=200)] = "",
    folder: Annotated[str, Query(max_length=1024)] = "",
    kind: Annotated[str, Query(pattern=f"^({'|'.join(KINDS)})?$")] = "",
    who: Annotated[str, Query(max_length=64)] = "",
    sort: Annotated[str, Query(max_length=20)] = "",
    number: Annotated[int, Query(ge=1, le=10**7, alias="page")] = 1,
) -> Response:
    """Show the BOMs that wait: in ``folder`` and below, those that ``who`` settles (``-``: no one)."""
    view = {"q": q, "folder": folder, "kind": kind, "who": who, "sort": sort}
    view |= {"page": str(number) if number > 1 else ""}
    return _show(call, {name: value for name, value in view.items() if value})


@router.post("/waiting/decide")
def decide(call: Writer, form: Form) -> Response:
    """Decide about all chosen BOMs. Each decision is a separate change; what was not done is named.

    Nothing is done before a user has seen the list of lines that it removes.
    """
    action, reason = decision_of(form)
    chosen = list(dict.fromkeys(texts(form, "chosen")))
    view = _view_of(form)
    if not text(form, "sure") and (gone := _gone(call, action, chosen)):
        reason, at = text(form, "reason"), Address("/waiting", view)
        return page(call, "sure.html", at=at, action=action, reason=reason, chosen=chosen, gone=gone)
    lines = 0

    def work(tx: Tx, value: str) -> int | None:
        nonlocal lines
        part_number, _space, seen = value.rpartition(" ")
        count, change = decide_all(tx, part_number, action, reason, seen)
        lines += count
        return change

    changes, problems = _each(call, chosen, lambda value: value.rpartition(" ")[0], work)
    if lines:
        notice = _(
            "%(lines)s in %(boms)s %(done)s.",
            lines=plural(lines, "line"),
            boms=plural(len(changes), "BOM"),
            done=_(DONE[action]),
        )
    else:
        notice = _("The chosen BOMs have nothing open of this kind, so nothing was changed.")
    if problems:
        return _show(call, view, notice, problems, text(form, "reason"), 409, changes)
    return back(Address("/waiting", view).url(), notice, undo=changes)


@router.post("/waiting/undo")
def undo(call: Writer, form: Form) -> Response:
    """Undo one decision about many BOMs: a new change in each of them."""
    made = list(dict.fromkeys(text(form, "changes", 20_000).split(",")))[::-1]

    def work(tx: Tx, change: str) -> int:
        number = whole_number(change, 18) or 0
        return undo_change(tx, history.item_changed_by(tx, number), number, None)[0]

    changes, problems = _each(call, made, lambda change: _("change %(id)s", id=change), work)
    notice, view = _("Undone in %(boms)s.", boms=plural(len(changes), "BOM")), _view_of(form)
    if problems:
        return _show(call, view, notice, problems, status=409)
    return back(Address("/waiting", view).url(), notice)


@router.post("/waiting/assign")
def assign(call: Writer, form: Form) -> Response:
    """Give the chosen BOMs to a user, or to no one in particular."""
    chosen = list(dict.fromkeys(value.rpartition(" ")[0] for value in texts(form, "chosen")))
    who, view = text(form, "assignee", 64), _view_of(form)
    if not chosen:
        return _show(call, view, _("Nothing was changed."), [_("No BOM was chosen.")], status=400)
    with call.write() as tx:
        for part_number in chosen:
            assignees.assign(tx, part_number, who)
    name = isolate(who) if who else _("nobody in particular")
    return back(
        back_to(form, Address("/waiting", view).url()),
        _("%(boms)s given to %(name)s.", boms=plural(len(chosen), "BOM"), name=name),
    )


@router.get("/mine")
def mine_page(call: Reader) -> Response:
    """Show the open BOMs that are the person's own, and what the person follows, news first."""
    with call.read() as tx:
        rows = waiting(tx)
        subjects = following.followed(tx, call.actor)
        own_reviews, in_review = reviews_for(tx, call.actor), review_count(tx)
    followed = {subject.folder for subject in subjects}
    return page(
        call,
        "mine.html",
        waiting=len(rows) + in_review,
        reviews=own_reviews,
        rows=[row for row in rows if row.assignee == call.actor.username],
        found=subjects,
        open_of=_open_of,
        folders=sorted({part for row in rows for part in _folders(row.folder)} - followed),
    )


@router.post("/mine/follow")
def follow(call: Reader, form: Form) -> Response:
    """Begin or stop following an item or a folder."""
    on = bool(text(form, "on"))
    target = text(form, "target", 1024) or f"folder:{text(form, 'folder', 1000)}"
    with call.write(even_when_read_only=True) as tx:
        following.follow(tx, target, on=on)
    notice = (
        _("You follow it now: the page For me says what changes.") if on else _("You no longer follow it.")
    )
    return back(back_to(form, "/mine"), notice)


@router.post("/mine/seen")
def seen(call: Reader, form: Form) -> Response:
    """Mark all news as seen."""
    with call.write(even_when_read_only=True) as tx:
        have_seen(tx)
    return back("/mine", _("All news is marked as seen."))


_VIEW = ("q", "folder", "kind", "who", "sort")


def _view_of(form: FormData) -> dict[str, str]:
    return dict(Address("/waiting", {name: text(form, name, 1024) for name in _VIEW}).but())


def _gone(call: Call, action: ReviewAction, chosen: Sequence[str]) -> dict[str, Sequence[Line]]:
    """Find the lines that ``action`` would remove, by part number; BOMs that changed since are left out."""
    gone: dict[str, Sequence[Line]] = {}
    with call.read() as tx:
        for value in chosen:
            part_number, _space, seen = value.rpartition(" ")
            with suppress(SiloError):
                if lines := lines_for(tx, part_number, action, seen)[1]:
                    gone[part_number] = lines
    return gone


def _each(
    call: Call, values: Sequence[str], name: Callable[[str], str], work: Callable[[Tx, str], int | None]
) -> tuple[list[int], list[str]]:
    """Do ``work`` for each value in a transaction of its own; return the changes, and what went wrong."""
    changes: list[int] = []
    problems: list[str] = []
    for value in values:
        if not name(value):
            problems.append(
                _("%(value)s: this BOM is not in the table; load the page again", value=isolate(value[:80]))
            )
            continue
        try:
            with call.write() as tx:
                change = work(tx, value)
            changes += [change] if change else []
        except VersionConflictError:
            problems.append(
                _("%(name)s: it was changed meanwhile, so nothing was done there", name=isolate(name(value)))
            )
        except SiloError as error:
            problems.append(f"{isolate(name(value))}: {spoken(str(error))}")
    return changes, problems


def _show(
    call: Call,
    view: Mapping[str, str],
    outcome: str = "",
    problems: list[str] | None = None,
    reason: str = "",
    status: int = 200,
    changes: Sequence[int] = (),
) -> Response:
    with call.read() as tx:
        rows, people, in_review = waiting(tx), editors(tx), reviews(tx)
    who = view.get("who", "")
    folders = Counter(part for row in rows for part in _folders(row.folder))
    test, kind, folder = fits(view.get("q", "")), KINDS.get(view.get("kind", "")), view.get("folder", "")
    waitings = [
        row
        for row in rows
        if (kind is None or kind[1](row))
        and (not folder or folder in _folders(row.folder))
        and (not who or row.assignee == ("" if who == "-" else who))
        and test(row.part_number, row.name, row.folder, row.document_file)
    ]
    order = arranged(waitings, view.get("sort", ""), _SORTS)
    table = page_of(order, len(rows), int(view.get("page", "1")), PAGE_SIZE)
    with call.read() as tx:
        drawn = with_model(tx, {row.item_id for row in table.rows})
    return page(
        call,
        "waiting.html",
        status=status,
        at=Address("/waiting", view),
        table=table,
        drawn=drawn,
        waiting=len(rows) + len(in_review),
        reviews=in_review,
        view=view,
        sort=view.get("sort", ""),
        folders=sorted(folders.items()),
        kinds=KINDS,
        people=people,
        open=_open_of(*rows),
        outcome=outcome,
        # What was done beside the problems can be undone as well.
        done=changes,
        reason=reason,
        problems=(problems or [])[:MOST_TOLD],
        more_problems=max(0, len(problems or []) - MOST_TOLD),
    )


def _open_of(*rows: Waiting) -> list[str]:
    """Count what is open in these BOMs, by kind, in words."""
    unreferenced, conflicts, left_out, unregistered, units, held = (
        sum(count(row) for row in rows) for _words, count in KINDS.values()
    )
    counts = {
        plural(unreferenced, "unreferenced line"): unreferenced,
        plural(conflicts, "conflict"): conflicts,
        plural(left_out, "component left out", "components left out"): left_out,
        plural(unregistered, "unregistered part"): unregistered,
        plural(units, "line with unit?", "lines with unit?"): units,
        plural(held, "BOM held at a designer's", "BOMs held at a designer's"): held,
    }
    return [words for words, count in counts.items() if count]


def _folders(folder: str) -> list[str]:
    """List a folder and all that it lies in: ``robot``, ``robot/arm``."""
    parts = folder.split("/")
    return ["/".join(parts[:end]) for end in range(1, len(parts) + 1)] if folder else []
