# SPDX-License-Identifier: LGPL-2.1-or-later
"""The list of items as a table over HTTP: its export as CSV, and its import as an update."""

from __future__ import annotations

from collections import Counter
from typing import Annotated, Any

import anyio.to_thread
from fastapi import APIRouter, Query
from starlette.responses import Response

from silo_server.routes.answers import READ_ERRORS, WRITE_ERRORS, json_answer
from silo_server.routes.bom.imports import IMPORT_BODY, uploaded
from silo_server.routes.call import Editor, Viewer
from silo_server.routes.made_files import CSV, content_of
from silo_server.routes.requests import BoundedRoute
from silo_server.services import part_import
from silo_server.services.part_import import ImportedPart

router = APIRouter(route_class=BoundedRoute, prefix="/api", tags=["items"], responses=READ_ERRORS)


@router.get("/items/export.csv", response_class=Response, responses=content_of("text/csv"))
def export_items(call: Viewer) -> Response:
    """Return all items that are not archived as CSV. The import takes it back and changes nothing."""
    with call.server.large_reads.enter(), call.read() as tx:
        text = "".join(part_import.export_parts(tx))
    return Response(
        text.encode(), media_type=CSV, headers={"Content-Disposition": 'attachment; filename="items.csv"'}
    )


@router.post("/items/import", responses=WRITE_ERRORS, openapi_extra=IMPORT_BODY)
async def import_items(
    call: Editor,
    dry_run: Annotated[bool, Query()] = False,
    category: Annotated[str, Query(max_length=32)] = "",
) -> Response:
    """Import a list of parts from a CSV or a workbook: new items, and updates with their differences.

    ``dry_run`` says row by row what would happen. ``category``: of new parts whose category the schema does
    not know. A wrong row refuses the whole file.
    """
    data, _ = await uploaded(call.request)

    def work() -> Response:
        read = part_import.read_parts_table(data, call.server.settings.max_merge_entries)
        with call.read() if dry_run else call.write() as tx:
            plan = (part_import.plan_parts if dry_run else part_import.apply_parts)(tx, read, category)
            counts = Counter(row.status for row in plan)
            return json_answer(
                {
                    "dry_run": dry_run,
                    "counts": {
                        status: counts[status] for status in ("add", "change", "same", "skip", "error")
                    },
                    "problems": [f"row {row.row}: {problem}" for row in plan for problem in row.problems],
                    "unused_columns": list(read.unused),
                    "notes": list(read.notes),
                    "rows": [_row_to_wire(row) for row in plan],
                }
            )

    return await anyio.to_thread.run_sync(work)


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
