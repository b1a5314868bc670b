# SPDX-License-Identifier: LGPL-2.1-or-later
"""Items, part numbers and schemas."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated, Any

import anyio.to_thread
from fastapi import APIRouter, Path, Query
from starlette.responses import Response

from silo.bom.errors import RejectedError
from silo_server.routes import document
from silo_server.routes.context import (
    READ_ERRORS,
    WRITE_ERRORS,
    Editor,
    ExpectedVersion,
    Viewer,
    etag_of,
    json_answer,
    json_body,
)
from silo_server.routes.models import (
    ItemChangeBody,
    ItemOut,
    ItemsOut,
    LookAlikesBody,
    LookAlikesOut,
    NewItemBody,
    NumberBody,
    NumberOut,
    Short,
    Text,
    UuidsBody,
)
from silo_server.schema.catalog import describe, describe_form, find_schema, schemas
from silo_server.services import items as service
from silo_server.services import search
from silo_server.services.bom.last_sync import NEVER, LastSync, last_sync, last_syncs
from silo_server.services.numbering import preview_number
from silo_server.values import Item, to_wire

router = APIRouter(prefix="/api", tags=["items"])

PATCH_BODY = {
    "requestBody": {
        "required": True,
        "content": {
            media_type: {"schema": document.JSON_OBJECT}
            for media_type in ("application/merge-patch+json", "application/json")
        },
    }
}
Uuid = Annotated[str, Path(json_schema_extra={"format": "uuid"})]
Limit = Annotated[int, Query(ge=1, le=1000)]
Offset = Annotated[int, Query(ge=0, le=10_000_000)]
Word = Annotated[Short, Query()]


@router.get("/items", response_model=list[ItemOut], responses=READ_ERRORS)
def list_items(
    call: Viewer,
    search: Word = "",
    q: Word = "",
    item_type: Word | None = None,
    category: Word | None = None,
    include_archived: bool = False,
    limit: Limit = 100,
    offset: Offset = 0,
) -> Response:
    """Items by part number; ``X-Total-Count`` says how many match in all."""
    query = service.ItemQuery(
        search=search or q,
        item_type=item_type,
        category=category,
        include_archived=include_archived,
        limit=limit,
        offset=offset,
    )
    with call.read() as tx:
        found, total = service.list_items(tx, query)
    return json_answer([item_to_wire(item) for item in found], headers={"X-Total-Count": str(total)})


@router.get("/items/search", response_model=list[ItemOut], responses=READ_ERRORS)
def search_items(
    call: Viewer, q: Word = "", item_type: Word | None = None, limit: Limit = 20, offset: Offset = 0
) -> Response:
    """Search as you type: every word must be somewhere in number, name or description."""
    return list_items(call, q, item_type=item_type, limit=limit, offset=offset)


@router.post(
    "/items", status_code=201, response_model=ItemOut, responses={**WRITE_ERRORS, 200: {"model": ItemOut}}
)
def create_item(call: Editor, body: NewItemBody) -> Response:
    """Make an item; 200 with the item where its ``id`` is known already."""
    new = service.NewItem(
        schema=body.schema_name,
        uuid=body.id,
        **body.model_dump(exclude={"schema_name", "id"}, exclude_none=True),
    )
    with call.write() as tx:
        item, made = service.create_item(tx, new)
        return _answer(item, 201 if made else 200)


@router.get("/items/by-uuid/{uuid}", response_model=ItemOut, responses=READ_ERRORS)
def get_item_by_uuid(call: Viewer, uuid: Uuid) -> Response:
    """The item with this UUID; 404 when there is none or it is archived, 400 for no UUID."""
    with call.read() as tx:
        item = service.get_by_uuid(tx, uuid)
        last = last_sync(tx, item)
    return _answer(item, last=last)


@router.post("/items/by-uuid", response_model=ItemsOut, responses=READ_ERRORS)
def get_items_by_uuid(call: Viewer, body: UuidsBody) -> Response:
    """Many UUIDs in one request; those that are not known are absent. Reads only, so a viewer may."""
    with call.read() as tx:
        found = service.get_by_uuids(tx, body.uuids)
        last = last_syncs(tx, [item.id for item in found])
    return json_answer({"items": [item_to_wire(item, last.get(item.id, NEVER)) for item in found]})


@router.post("/items/look-alikes", response_model=LookAlikesOut, responses=READ_ERRORS)
def find_look_alikes(call: Viewer, body: LookAlikesBody) -> Response:
    """The items that have a component's name or its very file, for many components. Reads only."""
    with call.read() as tx:
        found = search.find_look_alikes(tx, [(one.name, one.sha256) for one in body.wanted])
    return json_answer({"look_alikes": [[asdict(like) for like in likes] for likes in found]})


@router.get("/items/{part_number}", response_model=ItemOut, responses=READ_ERRORS)
def get_item(call: Viewer, part_number: str) -> Response:
    """One item."""
    with call.read() as tx:
        item = service.get_item(tx, part_number)
        last = last_sync(tx, item)
    return _answer(item, last=last)


@router.put("/items/{part_number}", response_model=ItemOut, responses=WRITE_ERRORS)
def change_item(call: Editor, part_number: str, body: ItemChangeBody, expected: ExpectedVersion) -> Response:
    """Change an item in place; ``properties`` make a new revision. The UUID stays whatever the number.

    ``If-Match`` with the item's ``ETag``: 412 where somebody was quicker.
    """
    change = service.ItemChange(**body.model_dump())
    with call.write() as tx:
        return _answer(service.change_item(tx, part_number, change, expected))


@router.patch(
    "/items/{part_number}/properties",
    response_model=ItemOut,
    responses=WRITE_ERRORS,
    openapi_extra=PATCH_BODY,
)
async def patch_properties(
    call: Editor, part_number: str, expected: ExpectedVersion, comment: Annotated[Text, Query()] = ""
) -> Response:
    """Change some properties by a JSON merge patch (RFC 7386): null removes one, the rest stays."""
    patch = await json_body(call.request)
    if not isinstance(patch, dict):
        raise RejectedError("body: wanted a JSON object with the properties to change")

    def work() -> Response:
        with call.write() as tx:
            return _answer(service.patch_properties(tx, part_number, patch, comment, expected))

    return await anyio.to_thread.run_sync(work)


@router.delete("/items/{part_number}", status_code=204, responses=WRITE_ERRORS)
def archive_item(call: Editor, part_number: str, expected: ExpectedVersion) -> Response:
    """Archive an item; its number stays taken and its lines stay in their BOMs."""
    with call.write() as tx:
        service.archive_item(tx, part_number, expected)
    return Response(status_code=204)


@router.post("/items/{part_number}/unarchive", response_model=ItemOut, responses=WRITE_ERRORS)
def unarchive_item(call: Editor, part_number: str) -> Response:
    """Bring an archived item back."""
    with call.write() as tx:
        return _answer(service.unarchive_item(tx, part_number))


@router.post("/generate-part-number", response_model=NumberOut, responses=READ_ERRORS)
def generate_part_number(call: Editor, body: NumberBody) -> Response:
    """The number the next item of the category would get; a preview that consumes nothing."""
    with call.read() as tx:
        number = preview_number(tx, body.schema_name, body.category)
    return json_answer({"part_number": number})


@router.get("/schemas", responses=READ_ERRORS)
def list_schemas(call: Viewer) -> list[dict[str, Any]]:
    """All part-number schemas."""
    return [describe(schema) for schema in schemas().values()]


@router.get("/schemas/{name}", responses=READ_ERRORS)
def get_schema(call: Viewer, name: str) -> dict[str, Any]:
    """A schema: its segments with their values."""
    return describe(find_schema(name))


@router.get("/schemas/{name}/form", responses=READ_ERRORS)
def get_schema_form(call: Viewer, name: str) -> dict[str, Any]:
    """The form descriptor for new items."""
    return describe_form(find_schema(name))


def item_to_wire(item: Item, last_sync: LastSync | None = None) -> dict[str, Any]:
    """An item, under the contract's names; ``last_sync`` where it was looked up."""
    told = {} if last_sync is None else {"last_sync": last_sync.to_wire()}
    return told | {"id": item.uuid} | to_wire(item, "id", "uuid", "created_as")


def _answer(item: Item, status: int = 200, last: LastSync | None = None) -> Response:
    return json_answer(item_to_wire(item, last), status, {"ETag": etag_of(item.version)})
