# SPDX-License-Identifier: LGPL-2.1-or-later
"""The list of items, and that of categories, as tables over HTTP: each goes out as CSV, and comes in as an
update.
"""

from __future__ import annotations

from collections import Counter
from typing import Annotated, Any, Literal

import anyio.to_thread
from fastapi import APIRouter, Query
from starlette.responses import Response

from silo.bom.message import message
from silo_server.routes.answers import READ_ERRORS, WRITE_ERRORS, json_answer
from silo_server.routes.bom.imports import IMPORT_BODY, uploaded
from silo_server.routes.call import Admin, Editor, Viewer
from silo_server.routes.made_files import CSV, content_of
from silo_server.routes.requests import BoundedRoute
from silo_server.services import import_undo, part_import, scheme
from silo_server.services.part_import import ImportedPart, PartsAllowed

router = APIRouter(route_class=BoundedRoute, prefix="/api", tags=["items"], responses=READ_ERRORS)
STATUSES = ("add", "change", "same", "skip", "error")


@router.get("/items/export.csv", response_class=Response, responses=content_of("text/csv"))
def export_items(call: Viewer) -> Response:
    """Return all items that are not archived as CSV. The import takes it back and changes nothing."""
    with call.server.large_reads.enter(), call.read() as tx:
        return _csv("".join(part_import.export_parts(tx)), "items.csv")


@router.post("/items/import", responses=WRITE_ERRORS, openapi_extra=IMPORT_BODY)
async def import_items(
    call: Editor,
    dry_run: Annotated[bool, Query()] = False,
    category: Annotated[str, Query(max_length=32)] = "",
    duplicates: Annotated[Literal["", "first", "new"], Query()] = "",
    leave_out: Annotated[bool, Query()] = False,
) -> Response:
    """Import a list of parts from a CSV or a workbook: new items, and updates with their differences.

    ``dry_run`` says row by row what would happen. ``category``: of new parts whose category the scheme does
    not know. ``duplicates``: of different rows with one number the first counts, or the others get new
    numbers. ``leave_out``: rows with problems are left out; without it a wrong row refuses the whole file.
    ``import``, in the answer, can be undone.
    """
    data, name = await uploaded(call.request)
    allowed = PartsAllowed(category, duplicates, leave_out)

    def work() -> Response:
        with call.read() as tx:
            read = part_import.read_parts_table(tx, data, call.server.settings.max_merge_entries)
        done = None
        with call.read() if dry_run else call.write() as tx:
            if dry_run:
                plan = part_import.plan_parts(tx, read, allowed)
            else:
                plan, done = part_import.apply_parts(tx, read, allowed, name or "")
            counts = Counter(row.status for row in plan)
            return json_answer(
                {
                    "dry_run": dry_run,
                    "import": done,
                    "counts": {status: counts[status] for status in STATUSES},
                    "problems": [
                        message("row {row}: {problem}", row=row.row, problem=problem)
                        for row in plan
                        for problem in row.problems
                    ],
                    "unused_columns": list(read.unused),
                    "notes": list(read.notes),
                    "rows": [_row_to_wire(row) for row in plan],
                }
            )

    return await anyio.to_thread.run_sync(work)


@router.post("/imports/{import_id}/undo", responses=WRITE_ERRORS)
def undo_import(call: Editor, import_id: int) -> dict[str, Any]:
    """Take an import back: its lines, its suppliers, its changes of items; items that it made are archived.

    409 if something of it was changed since.
    """
    with call.write() as tx:
        undone = import_undo.undo_import(tx, import_id)
        return {"import": undone.id, "kind": undone.kind, "file": undone.file_name}


@router.get("/categories/export.csv", response_class=Response, responses=content_of("text/csv"))
def export_categories(call: Viewer) -> Response:
    """Return the categories, and how part numbers of each are written, as CSV."""
    with call.read() as tx:
        return _csv(scheme.export_scheme(tx), "categories.csv")


@router.post("/categories/import", responses=WRITE_ERRORS, openapi_extra=IMPORT_BODY)
async def import_categories(call: Admin, dry_run: Annotated[bool, Query()] = False) -> Response:
    """Let a list of categories, from a CSV or a workbook, be the site's scheme.

    A category that the list does not have is removed, unless items are of it. Items keep their numbers.
    """
    data, _ = await uploaded(call.request)

    def work() -> Response:
        read = scheme.read_categories(data)
        with call.read() if dry_run else call.write() as tx:
            plan = (scheme.plan_scheme if dry_run else scheme.apply_scheme)(tx, read)
            counts = Counter(row.status for row in plan.rows)
            return json_answer(
                {
                    "dry_run": dry_run,
                    "counts": {status: counts[status] for status in STATUSES},
                    "problems": plan.problems,
                    "unused_columns": list(read.unused),
                    "notes": list(read.notes),
                    "removed": list(plan.removed),
                    "kept": [category.code for category in plan.kept],
                    "rows": [
                        {
                            "row": row.row,
                            "part_number": row.code,
                            "name": row.name,
                            "status": row.status,
                            "problems": list(row.problems),
                            **({"why": row.why} if row.why else {}),
                            "changes": {
                                title: {"before": before, "after": after}
                                for title, before, after in row.changes
                            },
                        }
                        for row in plan.rows
                    ],
                }
            )

    return await anyio.to_thread.run_sync(work)


def _csv(text: str, name: str) -> Response:
    headers = {"Content-Disposition": f'attachment; filename="{name}"'}
    return Response(text.encode(), media_type=CSV, headers=headers)


def _row_to_wire(row: ImportedPart) -> dict[str, Any]:
    return {
        "row": row.row,
        "part_number": row.part_number,
        "name": row.name,
        "status": row.status,
        "problems": list(row.problems),
        **({"why": row.why} if row.why else {}),
        "changes": {
            column: {"before": before, "after": after}
            for column, (before, after) in (row.changes or {}).items()
        },
    }
