# SPDX-License-Identifier: LGPL-2.1-or-later
"""Attachments over HTTP: the files beside the model of an item. Their revisions are those of a document."""

from __future__ import annotations

from typing import Annotated

import anyio.to_thread
from fastapi import APIRouter
from pydantic import WithJsonSchema
from starlette.datastructures import UploadFile
from starlette.responses import Response

from silo.api import wire
from silo.bom.errors import RejectedError
from silo.bom.message import message
from silo.file_kind import ATTACHMENT_KINDS
from silo_server.fields import to_wire
from silo_server.routes import openapi
from silo_server.routes.answers import READ_ERRORS, WRITE_ERRORS, json_answer
from silo_server.routes.call import Editor, Viewer
from silo_server.routes.items import Uuid, checked_hash
from silo_server.routes.models import AttachmentsOut, RequestBody, Short
from silo_server.routes.requests import BoundedRoute
from silo_server.services import attachments
from silo_server.services.field_checks import sha256_or_none, text_problem
from silo_server.services.items import get_item, normal_uuid

router = APIRouter(route_class=BoundedRoute, prefix="/api", tags=["attachments"], responses=READ_ERRORS)

_KINDS: openapi.Schema = {"type": "string", "enum": list(ATTACHMENT_KINDS)}
_FORM: openapi.Schema = {
    "file": {"type": "string", "format": "binary"},
    "kind": {"type": "string", "enum": ["", *ATTACHMENT_KINDS], "description": "else that of the content"},
    "comment": openapi.text(10_000),
    "sha256": {**openapi.SHA256, "description": "of the file; another content is refused"},
}
_UPLOAD = {
    **openapi.refused("a model without another kind, and a sha256 that is not that of the file"),
    "requestBody": {
        "required": True,
        "content": {
            "multipart/form-data": {"schema": {"type": "object", "required": ["file"], "properties": _FORM}}
        },
    },
}


class KindBody(RequestBody):
    """``PUT /api/documents/{uuid}/kind``."""

    kind: Annotated[Short, WithJsonSchema(_KINDS)]


@router.get("/items/{part_number}/files", response_model=AttachmentsOut)
def list_attachments(call: Viewer, part_number: str) -> Response:
    """Return the attachments of an item as they are now, by kind and name; the model is not among them."""
    with call.read() as tx:
        item = get_item(tx, part_number, include_archived=True)
        found = attachments.attachments_of(tx, [item.id]).get(item.id, [])
    return json_answer({"files": [to_wire(attachment) for attachment in found]})


@router.post(
    "/items/{part_number}/files",
    status_code=201,
    response_model=wire.Attachment,
    responses={**WRITE_ERRORS, 200: {"model": wire.Attachment}},
    openapi_extra=_UPLOAD,
)
async def attach(call: Editor, part_number: str) -> Response:
    """Attach a file (form part ``file``, texts ``kind`` and ``comment``) to an item.

    A file with the name and the kind of an attachment is its next revision. The very content again makes
    none: 200.
    """
    async with call.request.form(max_files=1, max_fields=20) as form:
        twice = [name for name in _FORM if len(form.getlist(name)) > 1]
        if twice:
            raise RejectedError(
                message("{parts}: wanted one part of this name, got several", parts=", ".join(twice))
            )
        file, kind, comment = form.get("file"), form.get("kind") or "", form.get("comment") or ""
        if not isinstance(file, UploadFile):
            raise RejectedError(message("file: wanted a multipart form with the file in a part named 'file'"))
        if problem := text_problem(comment, 10_000) or text_problem(kind, 200):
            raise RejectedError(message("comment, kind: {problem}", problem=problem))
        sha256 = sha256_or_none("sha256", form.get("sha256"))

        def work() -> Response:
            with call.read() as tx:
                get_item(tx, part_number)  # before anything is written to the disk
            stored = call.server.files.keep(file.filename or "file", file.file)
            checked_hash(stored, sha256 or "")
            with call.write() as tx:
                item = get_item(tx, part_number, lock=True)
                made, new = attachments.attach(tx, item, stored, str(kind) or None, str(comment))
                return json_answer(to_wire(made), 201 if new else 200)

        return await anyio.to_thread.run_sync(work)


@router.put("/documents/{uuid}/kind", response_model=wire.Attachment, responses=WRITE_ERRORS)
def change_kind(call: Editor, uuid: Uuid, body: KindBody) -> Response:
    """Give an attachment another kind."""
    with call.write() as tx:
        return json_answer(to_wire(attachments.change_kind(tx, normal_uuid(uuid), body.kind)))


@router.delete("/documents/{uuid}", status_code=204, responses=WRITE_ERRORS)
def remove(call: Editor, uuid: Uuid) -> Response:
    """Show an attachment no longer. Releases keep what they hold of it; a model cannot be removed: 404."""
    with call.write() as tx:
        attachments.remove(tx, normal_uuid(uuid))
    return Response(status_code=204)
