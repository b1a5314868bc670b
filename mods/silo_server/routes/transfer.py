# SPDX-License-Identifier: LGPL-2.1-or-later
"""BOM export and import."""

from __future__ import annotations

import os
from collections.abc import Iterator
from tempfile import SpooledTemporaryFile
from typing import IO, Annotated, Any, cast

import anyio.to_thread
from fastapi import APIRouter, Query, Request
from starlette.datastructures import UploadFile
from starlette.responses import Response, StreamingResponse

from silo.bom.errors import RejectedError
from silo_server.routes import document
from silo_server.routes.context import (
    FORM_TYPES,
    READ_ERRORS,
    WRITE_ERRORS,
    Editor,
    ExpectedVersion,
    Viewer,
    etag_of,
    json_answer,
)
from silo_server.routes.review import state_to_wire
from silo_server.services.bom import exports, imports
from silo_server.services.bom.exports import View

router = APIRouter(prefix="/api/items/{part_number}/bom", tags=["bom transfer"])

SPOOL_BYTES = 1024 * 1024
CHUNK = 64 * 1024
XLSX = "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet"


def _content(media_type: str) -> dict[int | str, dict[str, Any]]:
    return {**READ_ERRORS, 200: {"content": {media_type: {}}, "description": "The file"}}


IMPORT_BODY = {
    **document.refused(
        "what is no CSV with a header row (part number, quantity), and rows that name unknown parts or "
        "unusable values; without dry_run a wrong row refuses the whole file"
    ),
    "requestBody": {
        "required": True,
        "content": {
            "text/csv": {"schema": {"type": "string"}},
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


Pieces = Annotated[int, Query(ge=1, le=1_000_000)]


@router.get("/export.csv", response_class=Response, responses=_content("text/csv"))
def export_csv(
    call: Viewer, part_number: str, view: View = View.SINGLE, pieces: Pieces = 1, semicolons: bool = False
) -> Response:
    """The BOM as CSV (RFC 4180, UTF-8); cells that would run as formulas are made text.

    ``pieces``: totals for so many of it. ``semicolons``: for an Excel that expects 1,5 instead of 1.5.
    """
    with call.read() as tx:
        made = exports.export(tx, part_number, view, pieces)
    out = _spool()
    exports.to_csv(made, out, semicolons=semicolons)
    return _file(out, "text/csv; charset=utf-8; header=present", made, "csv")


@router.get("/export.xlsx", response_class=Response, responses=_content(XLSX))
def export_xlsx(call: Viewer, part_number: str, view: View = View.SINGLE, pieces: Pieces = 1) -> Response:
    """The BOM as a workbook."""
    with call.read() as tx:
        made = exports.export(tx, part_number, view, pieces)
    out = _spool()
    exports.to_xlsx(made, out)
    return _file(out, XLSX, made, "xlsx")


@router.get("/export.json", responses=READ_ERRORS)
def export_json(call: Viewer, part_number: str, view: View = View.SINGLE, pieces: Pieces = 1) -> Response:
    """The BOM as JSON."""
    with call.read() as tx:
        made = exports.export(tx, part_number, view, pieces)
    return json_answer(exports.to_json(made))


@router.post("/import", responses=WRITE_ERRORS, openapi_extra=IMPORT_BODY)
async def import_csv(
    call: Editor, part_number: str, expected: ExpectedVersion, dry_run: Annotated[bool, Query()] = False
) -> Response:
    """Import a CSV (as the body, or as the form part ``file``).

    ``dry_run`` says row by row what would happen; without it everything is imported, or, where a row is
    wrong, nothing (400 with all problems).
    """
    data, name = await _uploaded(call.request)

    def work() -> Response:
        records = imports.read_csv(data, call.server.settings.max_merge_entries)
        if dry_run:
            with call.read() as tx:
                return json_answer(plan_to_wire(imports.plan_import(tx, part_number, records), dry_run))
        with call.write() as tx:
            plan, _, version = imports.apply_import(tx, part_number, records, name, expected)
            return json_answer(plan_to_wire(plan, dry_run), headers={"ETag": etag_of(version)})

    return await anyio.to_thread.run_sync(work)


def plan_to_wire(plan: imports.ImportPlan, dry_run: bool) -> dict[str, Any]:
    """What an import does, or would do."""
    return {
        "dry_run": dry_run,
        "counts": {status: plan.count(status) for status in ("add", "change", "same", "skip", "error")},
        "problems": plan.problems,
        "rows": [
            {
                "row": row.row,
                "part_number": row.part_number,
                "status": row.status,
                "problems": list(row.problems),
                "before": state_to_wire(row.before),
                "after": state_to_wire(row.after),
            }
            for row in plan.rows
        ],
    }


async def _uploaded(request: Request) -> tuple[bytes, str | None]:
    if not request.headers.get("content-type", "").startswith(FORM_TYPES):
        return await request.body(), None
    async with request.form(max_files=1, max_fields=20) as form:
        file = form.get("file")
        if not isinstance(file, UploadFile):
            raise RejectedError("file: wanted a multipart form with the CSV in a part named 'file'")
        return await file.read(), file.filename


def _spool() -> IO[bytes]:
    # On the disk where it is large: ten exports at once must not take the memory of ten whole files.
    return cast(IO[bytes], SpooledTemporaryFile(max_size=SPOOL_BYTES))


def _sent(out: IO[bytes]) -> Iterator[bytes]:
    with out:
        while chunk := out.read(CHUNK):
            yield chunk


def _file(out: IO[bytes], media_type: str, made: exports.Export, suffix: str) -> Response:
    stem = "".join(c if c.isascii() and (c.isalnum() or c in "-_.") else "_" for c in made.root.part_number)
    many = f"-for-{made.pieces}" if made.pieces > 1 else ""
    disposition = f'attachment; filename="{stem}-bom-{made.view.value}{many}.{suffix}"'
    headers = {"Content-Disposition": disposition, "Content-Length": str(out.seek(0, os.SEEK_END))}
    out.seek(0)
    return StreamingResponse(_sent(out), media_type=media_type, headers=headers)
