# SPDX-License-Identifier: LGPL-2.1-or-later
"""Documents over HTTP: the files of a project by their own UUIDs.

The file of one item is the item's, with its revisions; what is sent to either address arrives at both.
"""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Query
from starlette.responses import Response

from silo.api import wire
from silo.bom.errors import NotFoundError
from silo_server.db.engine import Tx
from silo_server.routes.context import READ_ERRORS, WRITE_ERRORS, Editor, Viewer, json_answer
from silo_server.routes.items import (
    BINARY,
    UPLOAD,
    Find,
    RevisionNumber,
    Uuid,
    download,
    receive,
)
from silo_server.routes.models import DocumentsOut, RevisionOut, UuidsBody
from silo_server.services import documents, items, revisions
from silo_server.services.revisions import revision_to_wire
from silo_server.values import Document, Item, to_wire

router = APIRouter(prefix="/api", tags=["documents"])


def known(uuid: str) -> Find:
    """Give the document with this UUID, or the item whose document it is.

    With a lock, a UUID that is not known becomes a new document: whoever sends a file names it.
    """

    def find(tx: Tx, lock: bool) -> Item | Document:
        normal = items.normal_uuid(uuid)
        found = documents.find(tx, normal, lock=lock)
        if found is None and (of := items.get_by_uuids(tx, [normal], include_archived=True)):
            return items.get_item(tx, of[0].part_number, lock=lock)
        if found is not None and found.item_id is not None:
            (item,) = items.by_ids(tx, [found.item_id]).values()
            return items.get_item(tx, item.part_number, lock=lock)
        if found is None:
            return documents.make(tx, normal) if lock else Document(0, normal, None, 0, "", "")
        return found

    return find


@router.post("/documents/by-uuid", response_model=DocumentsOut, responses=READ_ERRORS)
def get_documents(call: Viewer, body: UuidsBody) -> Response:
    """Many documents in one request; those that are not known are absent. Reads only, so a viewer may."""
    with call.read() as tx:
        found = documents.shown(tx, documents.by_uuids(tx, body.uuids))
    return json_answer({"documents": [to_wire(one) for one in found]})


@router.get("/items/{part_number}/documents", response_model=DocumentsOut, responses=READ_ERRORS)
def documents_of(call: Viewer, part_number: str) -> Response:
    """The documents that hold an item: its own, or the file of several parts in which it is an object."""
    with call.read() as tx:
        found = documents.shown(tx, documents.holding(tx, items.get_item(tx, part_number)))
    return json_answer({"documents": [to_wire(one) for one in found]})


@router.get("/documents/{uuid}", response_model=wire.Document, responses=READ_ERRORS)
def get_document(call: Viewer, uuid: Uuid) -> Response:
    """One document, with what it links to and what links to it."""
    with call.read() as tx:
        told = told_of(tx, uuid)
    return json_answer(told)


def told_of(tx: Tx, uuid: str) -> dict[str, Any]:
    """All that is known of a document, for the API and the pages. Raises NotFoundError."""
    found = documents.get(tx, items.normal_uuid(uuid))
    now = documents.shown(tx, [found])
    if not now:
        raise NotFoundError(f"{found.subject} has no file yet")
    newest = revisions.get_revision(tx, found, found.current_revision)
    near = {"linked": documents.linked_from(tx, found), "used_by": documents.linking_to(tx, found)}
    others = {name: [to_wire(one) for one in documents.shown(tx, some)] for name, some in near.items()}
    return {**to_wire(now[0]), "links": newest.links, **others}


@router.get("/documents/{uuid}/revisions", response_model=list[RevisionOut], responses=READ_ERRORS)
def list_revisions(
    call: Viewer,
    uuid: Uuid,
    limit: Annotated[int, Query(ge=1, le=1000)] = 100,
    before: Annotated[int | None, Query(ge=1, le=2**31 - 1)] = None,
    after: Annotated[int, Query(ge=0, le=2**31 - 1)] = 0,
    offset: Annotated[int, Query(ge=0, le=2**31 - 1)] = 0,
) -> Response:
    """Revisions with a file, newest first, as those of an item."""
    with call.read() as tx:
        of = documents.get(tx, items.normal_uuid(uuid))
        found, total = revisions.list_revisions(tx, of, limit, before=before, after=after, skip=offset)
    told = [revision_to_wire(of, revision) for revision in found]
    return json_answer(told, headers={"X-Total-Count": str(total)})


@router.get("/documents/{uuid}/revisions/{number}", response_model=RevisionOut, responses=READ_ERRORS)
def get_revision(call: Viewer, uuid: Uuid, number: RevisionNumber) -> Response:
    """One revision, with the files that its file links to."""
    with call.read() as tx:
        of = documents.get(tx, items.normal_uuid(uuid))
        revision = revisions.get_revision(tx, of, number)
    return json_answer(revision_to_wire(of, revision, links=True))


@router.post(
    "/documents/{uuid}/file",
    status_code=201,
    response_model=RevisionOut,
    responses=WRITE_ERRORS,
    openapi_extra=UPLOAD,
)
async def upload_file(call: Editor, uuid: Uuid) -> Response:
    """Upload a file as a new revision of a document, which the first upload makes; the form is that of an
    item's file."""
    return await receive(call, known(uuid))


@router.get("/documents/{uuid}/file", response_class=Response, responses={**READ_ERRORS, **BINARY})
def download_newest(call: Viewer, uuid: Uuid) -> Response:
    """The newest file."""
    with call.read() as tx:
        revision = revisions.newest_file(tx, documents.get(tx, items.normal_uuid(uuid)))
    return download(call, revision)


@router.get("/documents/{uuid}/file/{number}", response_class=Response, responses={**READ_ERRORS, **BINARY})
def download_revision(call: Viewer, uuid: Uuid, number: RevisionNumber) -> Response:
    """The file of one revision."""
    with call.read() as tx:
        revision = revisions.get_revision(tx, documents.get(tx, items.normal_uuid(uuid)), number)
    return download(call, revision)
