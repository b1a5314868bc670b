# SPDX-License-Identifier: LGPL-2.1-or-later
"""All BOMs that wait for a person, by project folder, with one decision for many of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from typing import Annotated, Any

from fastapi import APIRouter, Query
from starlette.responses import Response

from silo.bom.errors import SiloError, VersionConflictError
from silo_server.routes.context import Call
from silo_server.services.bom.review import Waiting, decide_all, waiting
from silo_server.web.forms import Form, back, text, texts
from silo_server.web.line_form import DONE, decision_of
from silo_server.web.login_page import Reader, Writer
from silo_server.web.render import isolate, page, plural
from silo_server.web.tables import Address, arranged, fits, page_of

router = APIRouter(include_in_schema=False)

# What may wait, and what the filter calls it.
KINDS: Mapping[str, tuple[str, Callable[[Waiting], int]]] = {
    "unreferenced": ("unreferenced lines", lambda row: row.unreferenced),
    "conflicts": ("conflicts", lambda row: row.conflicts),
    "incomplete": ("incomplete syncs", lambda row: row.left_out),
    "unregistered": ("unregistered parts", lambda row: row.unregistered),
}
_SORTS: Mapping[str, Callable[[Waiting], Any]] = {
    "number": lambda row: row.item.part_number.casefold(),
    "name": lambda row: row.item.name.casefold(),
    "folder": lambda row: row.last.folder.casefold(),
    "unreferenced": lambda row: row.unreferenced,
    "conflicts": lambda row: row.conflicts,
    "incomplete": lambda row: row.left_out,
    "unregistered": lambda row: row.unregistered,
    "synced": lambda row: row.last.at,
}
MOST_TOLD = 20


@router.get("/waiting")
def waiting_page(
    call: Reader,
    q: Annotated[str, Query(max_length=200)] = "",
    folder: Annotated[str, Query(max_length=1024)] = "",
    kind: Annotated[str, Query(max_length=20)] = "",
    sort: Annotated[str, Query(max_length=20)] = "",
    number: Annotated[int, Query(ge=1, le=10**7, alias="page")] = 1,
) -> Response:
    """The table; ``folder`` is a project's folder or one in it."""
    view = {"q": q, "folder": folder, "kind": kind, "sort": sort, "page": str(number) if number > 1 else ""}
    return _show(call, {name: value for name, value in view.items() if value})


@router.post("/waiting/decide")
def decide(call: Writer, form: Form) -> Response:
    """One decision about all chosen BOMs. Each is a change of its own; what was not done is named."""
    action, reason = decision_of(form)
    lines = boms = 0
    problems: list[str] = []
    for value in dict.fromkeys(texts(form, "chosen")):
        part_number, _, seen = value.rpartition(" ")
        if not part_number:
            problems.append(f"{isolate(value[:80])}: this is no BOM of the table; load the page again")
            continue
        try:
            with call.write() as tx:
                count = decide_all(tx, part_number, action, reason, seen)
            lines, boms = lines + count, boms + bool(count)
        except VersionConflictError:
            problems.append(f"{isolate(part_number)}: it was changed meanwhile, so nothing was done there")
        except SiloError as error:
            problems.append(f"{isolate(part_number)}: {error}")
    if lines:
        said = f"{plural(lines, 'line', 'lines')} in {plural(boms, 'BOM', 'BOMs')} {DONE[action]}."
    else:
        said = "Nothing of this kind was open in what was chosen, so nothing was changed."
    view = dict(Address("/waiting", {n: text(form, n, 1024) for n in ("q", "folder", "kind", "sort")}).but())
    if problems:
        return _show(call, view, said, problems, text(form, "reason"), 409)
    return back(Address("/waiting", view).url(), said)


def _show(
    call: Call,
    view: Mapping[str, str],
    said: str = "",
    problems: list[str] | None = None,
    reason: str = "",
    status: int = 200,
) -> Response:
    with call.read() as tx:
        rows = waiting(tx)
    folders = Counter(part for row in rows for part in _folders(row.last.folder))
    test, kind, folder = fits(view.get("q", "")), KINDS.get(view.get("kind", "")), view.get("folder", "")
    found = [
        row
        for row in rows
        if (kind is None or kind[1](row))
        and (not folder or folder in _folders(row.last.folder))
        and test(row.item.part_number, row.item.name, row.last.folder, row.last.document_file)
    ]
    table = page_of(arranged(found, view.get("sort", ""), _SORTS), len(rows), int(view.get("page", "1")))
    return page(
        call,
        "waiting.html",
        status=status,
        at=Address("/waiting", view),
        table=table,
        view=view,
        sort=view.get("sort", ""),
        folders=sorted(folders.items()),
        kinds=KINDS,
        totals={name: sum(count(row) for row in rows) for name, (_, count) in KINDS.items()},
        said=said,
        reason=reason,
        problems=(problems or [])[:MOST_TOLD],
        more_problems=max(0, len(problems or []) - MOST_TOLD),
    )


def _folders(folder: str) -> list[str]:
    """A folder and all that it lies in: ``robot/arm`` is in ``robot``."""
    parts = folder.split("/")
    return ["/".join(parts[:end]) for end in range(1, len(parts) + 1)] if folder else []
