# SPDX-License-Identifier: LGPL-2.1-or-later
"""The import of a BOM from a table over HTTP."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from typing import Annotated, Any

import anyio.to_thread
from fastapi import Query, Request
from starlette.datastructures import UploadFile
from starlette.responses import Response

from silo.bom.errors import RejectedError
from silo.bom.message import message
from silo.tables.bom_rows import BOM
from silo_server.db.answers import KeptAnswer, KeyedRequest, earlier_answer, keep_answer
from silo_server.routes import openapi
from silo_server.routes.answers import WRITE_ERRORS, etag_of, json_answer, raw_json
from silo_server.routes.bom import bom_router
from silo_server.routes.bom.history import state_to_wire
from silo_server.routes.call import Editor
from silo_server.routes.made_files import XLSX
from silo_server.routes.requests import FORM_TYPES, ExpectedVersion, idempotency_key
from silo_server.services.bom import imports
from silo_server.services.bom.change import locked_parent
from silo_server.services.bom.import_plan import Allowed, ImportPlan
from silo_server.services.file_store import clean_name
from silo_server.services.table_layouts import remembered_layout
from silo_server.user_json import dumps

router = bom_router("bom transfer")

IMPORT_BODY = {
    **openapi.refused(
        "what is no table with a header row (part number, quantity), and rows that name unknown parts or "
        "unusable values; without dry_run a wrong row refuses the whole file"
    ),
    "requestBody": {
        "required": True,
        "content": {
            "text/csv": {"schema": {"type": "string"}},
            XLSX: {"schema": {"type": "string", "format": "binary"}},
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "required": ["file"],
                    "properties": {"file": {"type": "string", "format": "binary"}},
                }
            },
        },
    },
}


@router.post("/import", responses=WRITE_ERRORS, openapi_extra=IMPORT_BODY)
async def import_csv(
    call: Editor,
    part_number: str,
    expected: ExpectedVersion,
    dry_run: Annotated[bool, Query()] = False,
    make: Annotated[str, Query(max_length=32)] = "",
    add_up: Annotated[bool, Query()] = False,
    quantities: Annotated[bool, Query()] = False,
    remove: Annotated[bool, Query()] = False,
    leave_out: Annotated[bool, Query()] = False,
) -> Response:
    """Import a CSV or a workbook: XLSX, ODS, XLS (as the body, or as the form part ``file``).

    ``dry_run`` says row by row what would happen. Without it everything is imported or, if a row is wrong,
    nothing (400 with all problems). ``make``: unknown parts are made in this category; ``add_up``: rows of
    one part are added up; ``quantities``: the quantity counts where the designators name another number;
    ``remove``: lines that the file does not have are removed; ``leave_out``: rows with problems are left out.
    ``import``, in the answer, can be undone. A file with levels changes the BOMs of its
    sub-assemblies too. A repeat with the same ``Idempotency-Key`` gets the first answer.
    """
    data, name = await uploaded(call.request)
    allowed = Allowed(make, add_up, quantities, remove, leave_out)

    def work() -> Response:
        with call.read() as tx:
            layout, known = remembered_layout(tx, "bom", data, BOM)
        records = imports.read_bom(data, call.server.settings.max_merge_entries, layout)
        records = replace(records, notes=(*known, *records.notes))
        if dry_run:
            with call.read() as tx:
                return json_answer(
                    plan_to_wire(imports.plan_import(tx, part_number, records, allowed), dry_run)
                )
        with call.write() as tx:
            parent = locked_parent(tx, part_number)
            digest = hashlib.sha256(data).hexdigest()
            request = KeyedRequest.of(
                f"import {parent.id}",
                idempotency_key(call.request),
                digest,
                name,
                *filter(
                    None,
                    (
                        make,
                        add_up,
                        quantities and "quantities",
                        remove and "remove",
                        leave_out and "leave_out",
                    ),
                ),
            )
            answer = earlier_answer(tx, request)
            if answer is None:
                plan, done, version = imports.apply_import(tx, part_number, records, name, expected, allowed)
                answer = KeptAnswer(dumps(plan_to_wire(plan, dry_run, done.number)), version)
                keep_answer(tx, request, answer)
            return raw_json(answer.text, headers={"ETag": etag_of(answer.version)})

    return await anyio.to_thread.run_sync(work)


def plan_to_wire(plan: ImportPlan, dry_run: bool, done: int | None = None) -> dict[str, Any]:
    """Return the plan of an import as the API sends it."""
    return {
        "dry_run": dry_run,
        "import": done,
        "counts": {status: plan.count(status) for status in ("add", "change", "same", "skip", "error")},
        "problems": plan.problems,
        "unused_columns": list(plan.unused),
        "notes": list(plan.notes),
        "missing": [
            {"parent": each.parent, "part_number": each.line.child_part_number, "id": each.line.id}
            for each in plan.missing
        ],
        "removed": plan.removed,
        "rows": [
            {
                "row": row.row,
                "part_number": row.part_number,
                "status": row.status,
                **({"name": row.name} if row.name else {}),
                **({"new": True} if row.new else {}),
                **({"why": row.why} if row.why else {}),
                "parent": row.parent,
                "depth": row.depth,
                "problems": list(row.problems),
                "before": state_to_wire(row.before),
                "after": state_to_wire(row.after),
            }
            for row in plan.rows
        ],
    }


async def uploaded(request: Request) -> tuple[bytes, str | None]:
    """Read the table of an import (the body, or the form part ``file``), and the name of its file."""
    if not request.headers.get("content-type", "").startswith(FORM_TYPES):
        return await request.body(), None
    async with request.form(max_files=1, max_fields=20) as form:
        file = form.get("file")
        if not isinstance(file, UploadFile):
            raise RejectedError(
                message("file: wanted a multipart form with the table in a part named 'file'")
            )
        return await file.read(), clean_name(file.filename or "")
