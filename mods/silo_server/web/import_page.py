# SPDX-License-Identifier: LGPL-2.1-or-later
"""Import of a BOM from CSV: first every row with what would become of it, then, on a click, all of it.

Between the two the file travels in the form, packed, so that nothing waits on the server and any of its
processes can go on.
"""

from __future__ import annotations

import base64
import binascii
import zlib
from dataclasses import dataclass

from fastapi import APIRouter, Request
from starlette.datastructures import FormData, UploadFile
from starlette.responses import Response

from silo.bom.errors import RejectedError, SiloError, VersionConflictError
from silo_server.errors import TooLargeError
from silo_server.routes.context import Server, ServerDep
from silo_server.services.bom import imports
from silo_server.services.items import get_item
from silo_server.values import Actor
from silo_server.web.forms import Form, back, text, whole
from silo_server.web.guard import Writer
from silo_server.web.merge_page import bom_path
from silo_server.web.render import isolate, page
from silo_server.web.words import changes

router = APIRouter(include_in_schema=False)

MOST_BYTES = 8 * 1024 * 1024
MOST_ROWS = 1000


@dataclass(frozen=True)
class Upload:
    """A CSV and what it is called."""

    name: str
    data: bytes

    @property
    def packed(self) -> str:
        return base64.b64encode(zlib.compress(self.data)).decode("ascii")


@router.get("/items/{part_number}/import")
def import_page(request: Request, server: ServerDep, caller: Writer, part_number: str) -> Response:
    """Choose a file."""
    return _show(request, server, caller, part_number, None)


@router.post("/items/{part_number}/import/check")
def check(request: Request, server: ServerDep, caller: Writer, part_number: str, form: Form) -> Response:
    """Say what the file would do; nothing is written."""
    try:
        return _show(request, server, caller, part_number, _uploaded(form))
    except (RejectedError, TooLargeError) as error:
        return _show(request, server, caller, part_number, None, str(error), error.status_hint)


@router.post("/items/{part_number}/import")
def apply(request: Request, server: ServerDep, caller: Writer, part_number: str, form: Form) -> Response:
    """Write it; where the BOM changed since the check, check again instead."""
    upload = _carried(form)
    try:
        records = imports.read_csv(upload.data, server.settings.max_merge_entries)
        with server.db.write(caller) as tx:
            plan, change, _ = imports.apply_import(
                tx, part_number, records, upload.name, whole(form, "version")
            )
    except VersionConflictError:
        problem = "The BOM was changed by somebody else since the file was checked; nothing was imported."
        return _show(request, server, caller, part_number, upload, problem, 412)
    except SiloError as error:
        return _show(request, server, caller, part_number, upload, str(error), error.status_hint)
    said = f"Imported {isolate(upload.name)}: {plan.count('add')} added, {plan.count('change')} changed."
    return back(bom_path(part_number), said, undo=change)


def _show(
    request: Request,
    server: Server,
    caller: Actor,
    part_number: str,
    upload: Upload | None,
    problem: str = "",
    status: int = 200,
) -> Response:
    records = imports.read_csv(upload.data, server.settings.max_merge_entries) if upload else ()
    with server.db.read(caller) as tx:
        item = get_item(tx, part_number)
        plan = imports.plan_import(tx, part_number, records) if upload else None
    rows = plan.rows if plan else ()
    said = {row.row: changes(row.before, row.after) for row in rows if row.before and row.after}
    # What is wrong, and what would change, is worth reading; rows that are as they were are not.
    order = {"error": 0, "add": 1, "change": 1, "skip": 2, "same": 2}
    return page(
        request,
        "import.html",
        caller,
        status=status,
        item=item,
        upload=upload,
        plan=plan,
        rows=sorted(rows, key=lambda row: (order[row.status], row.row))[:MOST_ROWS],
        said=said,
        problem=problem,
    )


def _uploaded(form: FormData) -> Upload:
    file = form.get("file")
    if not isinstance(file, UploadFile) or not file.filename:
        raise RejectedError("No file was chosen.")
    data = file.file.read(MOST_BYTES + 1)
    if len(data) > MOST_BYTES:
        raise TooLargeError(f"The file is larger than {MOST_BYTES // 2**20} MiB; this cannot be a BOM.")
    return Upload(file.filename[:200], data)


def _carried(form: FormData) -> Upload:
    packed = text(form, "packed", MOST_BYTES * 2)
    unpacker = zlib.decompressobj()
    try:
        data = unpacker.decompress(base64.b64decode(packed, validate=True), MOST_BYTES)
    except (binascii.Error, ValueError, zlib.error):
        raise RejectedError("the file did not come back whole; choose it again") from None
    if not unpacker.eof:
        raise TooLargeError(f"The file is larger than {MOST_BYTES // 2**20} MiB; this cannot be a BOM.")
    return Upload(text(form, "name", 200) or "file.csv", data)
