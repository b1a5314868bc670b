# SPDX-License-Identifier: LGPL-2.1-or-later
"""Items, part numbers and schemas; revisions and their files; documents.

A document is a file of a project under its own UUID. The file of one item is the item's, with its revisions;
what is sent to either address arrives at both.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Annotated, Any

import anyio.to_thread
from fastapi import APIRouter, Depends, Path, Query
from pydantic import Field, TypeAdapter, ValidationError
from starlette.datastructures import UploadFile
from starlette.responses import FileResponse, Response

from silo.api import wire
from silo.api.wire import FactSource, HeldItem, ItemTexts, LinkedFile
from silo.bom.errors import NotFoundError, RejectedError
from silo.bom.items.part_address import part_segment
from silo.bom.message import message
from silo.bom.numbers import whole_number
from silo.file_kind import ATTACHMENT_KINDS, MODEL
from silo_server.db.answers import KeptAnswer, KeyedRequest, earlier_answer, keep_answer
from silo_server.db.transaction import Tx
from silo_server.fields import to_wire
from silo_server.routes import openapi
from silo_server.routes.answers import READ_ERRORS, WRITE_ERRORS, etag_of, json_answer
from silo_server.routes.call import Call, Editor, Viewer
from silo_server.routes.models import (
    ChecksumsBody,
    ContentsOut,
    DocumentsOut,
    ItemChangeBody,
    ItemOut,
    ItemsOut,
    LookAlikesBody,
    LookAlikesOut,
    NewItemBody,
    NumberBody,
    NumberOut,
    RevisionBody,
    RevisionOut,
    Short,
    Text,
    UuidsBody,
)
from silo_server.routes.requests import BoundedRoute, ExpectedVersion, idempotency_key, json_body
from silo_server.schema import describe, describe_form
from silo_server.services import attachments, documents, items, revisions, scene, search
from silo_server.services.bom.last_sync import NEVER, LastSync, last_sync, last_syncs
from silo_server.services.bom.unit_change import change_item_and_lines
from silo_server.services.documents import (
    documents_by_uuid,
    documents_holding,
    find_document,
    linked_from,
    linking_to,
    make_document,
    of_contents,
    shown,
)
from silo_server.services.drawn_picture import keep_picture
from silo_server.services.field_checks import sha256_or_none, text_problem
from silo_server.services.file_store import StoredFile
from silo_server.services.product.where_used import where_used
from silo_server.services.releases import draft_of
from silo_server.services.revisions import RevisionOrigin, revision_to_wire
from silo_server.services.scheme import scheme_of
from silo_server.values import Document, Item, Revision

router = APIRouter(route_class=BoundedRoute, prefix="/api", tags=["items"], responses=READ_ERRORS)

PATCH_BODY = {
    "requestBody": {
        "required": True,
        "content": {
            media_type: {"schema": openapi.JSON_OBJECT}
            for media_type in ("application/merge-patch+json", "application/json")
        },
    }
}
Uuid = Annotated[str, Path(json_schema_extra={"format": "uuid"})]
Limit = Annotated[int, Query(ge=1, le=1000)]
Offset = Annotated[int, Query(ge=0, le=10_000_000)]
Word = Annotated[Short, Query()]


@router.get("/items", response_model=list[ItemOut])
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
    """Return a page of the items that match, best first, then by part number.

    ``X-Total-Count`` is the number of all items that match.
    """
    query = items.ItemQuery(
        search=search or q,
        item_type=item_type,
        category=category,
        include_archived=include_archived,
        limit=limit,
        offset=offset,
    )
    with call.read() as tx:
        items_of_page, total = items.list_items(tx, query)
    return json_answer([item_to_wire(item) for item in items_of_page], headers={"X-Total-Count": str(total)})


@router.get("/items/search", response_model=list[ItemOut])
def search_items(
    call: Viewer, q: Word = "", item_type: Word | None = None, limit: Limit = 20, offset: Offset = 0
) -> Response:
    """Search items as a user types: an item must have every word, in any of the searched texts."""
    return list_items(call, q, item_type=item_type, limit=limit, offset=offset)


@router.post(
    "/items", status_code=201, response_model=ItemOut, responses={**WRITE_ERRORS, 200: {"model": ItemOut}}
)
def create_item(call: Editor, body: NewItemBody) -> Response:
    """Make an item. A repeat with the same ``id`` (or ``Idempotency-Key``) returns the same item: 200.

    409 for a different request with a known ``id``.
    """
    new = items.NewItem(
        schema=body.schema_name,
        uuid=body.id,
        key=idempotency_key(call.request),
        texts=body.model_dump(include=_TEXTS, exclude_none=True),
        **body.model_dump(exclude={"schema_name", "id", *_TEXTS}, exclude_none=True),
    )
    with call.write() as tx:
        item, made = items.create_item(tx, new)
        return _answer(item, 201 if made else 200)


@router.get("/items/by-uuid/{uuid}", response_model=ItemOut)
def get_item_by_uuid(call: Viewer, uuid: Uuid) -> Response:
    """Return the item with this UUID; 404 if there is none or it is archived, 400 for no UUID."""
    with call.read() as tx:
        item = items.get_by_uuid(tx, uuid)
        last = last_sync(tx, item)
    return _answer(item, last=last)


@router.post("/items/by-uuid", response_model=ItemsOut)
def get_items_by_uuid(call: Viewer, body: UuidsBody) -> Response:
    """Return the items with these UUIDs; unknown ones are absent. Changes nothing, so a viewer may ask."""
    with call.read() as tx:
        items_found = items.get_by_uuids(tx, body.uuids)
        last = last_syncs(tx, [item.id for item in items_found])
    return json_answer({"items": [item_to_wire(item, last.get(item.id, NEVER)) for item in items_found]})


@router.post("/items/look-alikes", response_model=LookAlikesOut)
def find_look_alikes(call: Viewer, body: LookAlikesBody) -> Response:
    """Find the items with the name or the very file of a component, for many components. Changes nothing."""
    with call.read() as tx:
        matches = search.find_look_alikes(tx, [(query.name, query.sha256) for query in body.wanted])
    return json_answer({"look_alikes": [[asdict(like) for like in likes] for likes in matches]})


@router.get("/items/{part_number}", response_model=ItemOut)
def get_item(call: Viewer, part_number: str) -> Response:
    """Return one item."""
    with call.read() as tx:
        item = items.get_item(tx, part_number)
        last = last_sync(tx, item)
    return _answer(item, last=last)


@router.put("/items/{part_number}", response_model=ItemOut, responses=WRITE_ERRORS)
def change_item(call: Editor, part_number: str, body: ItemChangeBody, expected: ExpectedVersion) -> Response:
    """Change an item in place; ``properties`` make a new revision. A new number does not change the UUID.

    ``If-Match`` with the item's ``ETag``: 412 if somebody else changed the item first.
    """
    texts = body.model_dump(include=_TEXTS)
    change = items.ItemChange(texts=texts, **body.model_dump(exclude=_TEXTS))
    with call.write() as tx:
        return _answer(change_item_and_lines(tx, part_number, change, expected))


@router.patch(
    "/items/{part_number}/properties",
    response_model=ItemOut,
    responses=WRITE_ERRORS,
    openapi_extra=PATCH_BODY,
)
async def patch_properties(
    call: Editor,
    part_number: str,
    expected: ExpectedVersion,
    comment: Annotated[Text, Query()] = "",
    source: FactSource = "hand",
) -> Response:
    """Change some properties by a JSON merge patch (RFC 7386): null removes one, the rest stays.

    ``source``: where mass and material come from; ``cad`` replaces only values that came from ``cad``.
    """
    patch = await json_body(call.request)
    if not isinstance(patch, dict):
        raise RejectedError(message("body: wanted a JSON object with the properties to change"))

    def work() -> Response:
        with call.write() as tx:
            return _answer(items.patch_properties(tx, part_number, patch, comment, expected, source))

    return await anyio.to_thread.run_sync(work)


@router.delete("/items/{part_number}", status_code=204, responses=WRITE_ERRORS)
def archive_item(call: Editor, part_number: str, expected: ExpectedVersion) -> Response:
    """Archive an item; its number stays taken and its lines stay in their BOMs.

    ``X-Total-Count`` is the number of BOM lines with this item; ``X-Used-In`` names the first of those BOMs
    (part numbers, encoded as in a path, with commas between them).
    """
    with call.write() as tx:
        used, uses = where_used(tx, items.get_item(tx, part_number), limit=20)
        items.archive_item(tx, part_number, expected)
    where = ",".join(part_segment(usage.parent.part_number) for usage in used)
    return Response(status_code=204, headers={"X-Total-Count": str(uses), "X-Used-In": where})


@router.post("/items/{part_number}/unarchive", response_model=ItemOut, responses=WRITE_ERRORS)
def unarchive_item(call: Editor, part_number: str) -> Response:
    """Bring an archived item back."""
    with call.write() as tx:
        return _answer(items.unarchive_item(tx, part_number))


@router.post("/generate-part-number", response_model=NumberOut)
def generate_part_number(call: Editor, body: NumberBody) -> Response:
    """Return the number that the next item of the category would get; the number stays free."""
    with call.read() as tx:
        number = items.preview_number(tx, body.schema_name, body.category)
    return json_answer({"part_number": number})


@router.get("/schemas")
def list_schemas(call: Viewer) -> list[dict[str, Any]]:
    """Return the part-number schema: the site's own, or the one that comes with the server."""
    with call.read() as tx:
        return [describe(scheme_of(tx))]


@router.get("/schemas/{name}")
def get_schema(call: Viewer, name: str) -> dict[str, Any]:
    """Return a part-number schema: its segments with their values."""
    with call.read() as tx:
        return describe(scheme_of(tx, name))


@router.get("/schemas/{name}/form")
def get_schema_form(call: Viewer, name: str) -> dict[str, Any]:
    """Return the form descriptor for new items."""
    with call.read() as tx:
        return describe_form(scheme_of(tx, name))


def item_to_wire(item: Item, last_sync: LastSync | None = None) -> dict[str, Any]:
    """Return an item as the API sends it, with ``last_sync`` if that was looked up."""
    fields = {} if last_sync is None else {"last_sync": last_sync.to_wire()}
    empty = (name for name in ("supplier_parts", "origins") if not getattr(item, name))
    left_out = ("id", "uuid", "texts", *empty)
    return fields | {"id": item.uuid, **item.texts} | to_wire(item, *left_out)


def _answer(item: Item, status: int = 200, last: LastSync | None = None) -> Response:
    return json_answer(item_to_wire(item, last), status, {"ETag": etag_of(item.version)})


revisions_router = APIRouter(
    route_class=BoundedRoute, prefix="/api/items/{part_number}", tags=["revisions"], responses=READ_ERRORS
)

# A file is handed out as a thing to keep, never as something a browser would run or show.
DOWNLOAD_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; sandbox",
    "Cache-Control": "private, no-cache",
}
_MAX_FIELD = 8 << 20
_TEXTS = set(ItemTexts.model_fields)
_LINKS = TypeAdapter(Annotated[list[LinkedFile], Field(max_length=10_000)])
_HELD = TypeAdapter(Annotated[list[HeldItem], Field(max_length=10_000)])
Find = Callable[[Tx, bool], Item | Document]
"""Finds the item or document that a file belongs to; with True it locks it, and makes a new document."""
RevisionNumber = Annotated[int, Path(ge=1, le=1_000_000)]
BINARY: dict[int | str, dict[str, Any]] = {
    200: {"content": {"application/octet-stream": {}}, "description": "The file"},
    206: {"content": {"application/octet-stream": {}}, "description": "The part of the file asked for"},
    304: {"description": "The file is still the one that If-None-Match names"},
    416: {"description": "The file has no such range"},
}
_FORM: openapi.Schema = {
    "file": {"type": "string", "format": "binary"},
    "kind": {
        "type": "string",
        "enum": ["", MODEL, *ATTACHMENT_KINDS],
        "description": "else that of the content; what is no model becomes an attachment of the item",
    },
    "comment": openapi.text(10_000),
    "properties": {"type": "string", "description": "a JSON object"},
    "sha256": {**openapi.SHA256, "description": "of the file; another content is refused"},
    "base_revision": {
        "type": "integer",
        "minimum": 0,
        "maximum": 1_000_000,
        "description": "what the file was made from; 409 if there is a newer file",
    },
    "path": openapi.text(1000, description="where the file is in its project, with /"),
    "links": {
        "type": "string",
        "description": "a JSON list of the linked files: path, item (UUID), sha256, document (UUID)",
    },
    "items": {
        "type": "string",
        "description": "a JSON list of the items in the file: item (UUID), object",
    },
    "former": openapi.text(36, description="the document (UUID) that the file was before"),
}
UPLOAD = {
    **openapi.refused(
        "properties that are no JSON object, links or items that are no such list, a model that is none, "
        "and a sha256 that is not that of the file"
    ),
    "requestBody": {
        "required": True,
        "content": {
            "multipart/form-data": {"schema": {"type": "object", "required": ["file"], "properties": _FORM}}
        },
    },
}


@dataclass(frozen=True)
class RevisionsAsked:
    """Which revisions: those above ``after`` and below ``before``, without the newest ``offset`` of them."""

    limit: Annotated[int, Query(ge=1, le=1000)] = 100
    before: Annotated[int | None, Query(ge=1, le=2**31 - 1)] = None
    after: Annotated[int, Query(ge=0, le=2**31 - 1)] = 0
    offset: Annotated[int, Query(ge=0, le=2**31 - 1)] = 0


Asked = Annotated[RevisionsAsked, Depends()]


@revisions_router.get("/revisions", response_model=list[RevisionOut])
def list_revisions(call: Viewer, part_number: str, asked: Asked) -> Response:
    """Return revisions of an item, newest first: those above ``after`` and below ``before``.

    ``X-Total-Count`` is the number of those above ``after``.
    """
    return _revisions(call, numbered(part_number), asked)


def _revisions(call: Call, find: Find, asked: RevisionsAsked) -> Response:
    with call.read() as tx:
        of = find(tx, False)
        revisions_of_page, total = revisions.list_revisions(
            tx, of, asked.limit, before=asked.before, after=asked.after, skip=asked.offset
        )
    rows = [revision_to_wire(of, revision) for revision in revisions_of_page]
    return json_answer(rows, headers={"X-Total-Count": str(total)})


@revisions_router.get("/revisions/{number}", response_model=RevisionOut)
def get_revision(call: Viewer, part_number: str, number: RevisionNumber) -> Response:
    """Return one revision, with the files that its file links to."""
    return _revision(call, numbered(part_number), number)


def _revision(call: Call, find: Find, number: int) -> Response:
    with call.read() as tx:
        of = find(tx, False)
        revision = revisions.get_revision(tx, of, number)
    return json_answer(revision_to_wire(of, revision, links=True))


@revisions_router.post("/revisions", status_code=201, response_model=RevisionOut, responses=WRITE_ERRORS)
def add_revision(call: Editor, part_number: str, body: RevisionBody) -> Response:
    """Add a revision without a file: a new snapshot of the properties."""
    with call.write() as tx:
        item = items.get_item(tx, part_number, lock=True)
        revision = revisions.add_revision(tx, item, comment=body.comment, properties=body.properties)
        return json_answer(revision_to_wire(item, revision, links=True), 201)


@revisions_router.post(
    "/file", status_code=201, response_model=RevisionOut, responses=WRITE_ERRORS, openapi_extra=UPLOAD
)
async def upload_file(call: Editor, part_number: str) -> Response:
    """Upload a file (form part ``file``, texts ``comment`` and ``properties``) as a new revision.

    The item's own file is a model. Any other content becomes an attachment of the item; the answer is then
    the revision of that attachment, with its ``kind`` and its ``document``.

    ``Idempotency-Key`` makes a repeat give the revision that the first request made. With ``base_revision``
    a file is refused (409 ``newer_revision``, with that revision) if somebody has committed one since.
    """
    return await receive(call, numbered(part_number))


def numbered(part_number: str) -> Find:
    """Return a function that finds the item with this number."""
    return lambda tx, lock: items.get_item(tx, part_number, lock=lock)


async def receive(call: Call, find: Find) -> Response:
    """Store an upload as a new revision of an item or a document.

    The form is read here and not by a parameter, so that no one without a role fills the disk.
    """
    async with call.request.form(max_files=1, max_fields=20, max_part_size=_MAX_FIELD) as form:
        twice = [name for name in _FORM if len(form.getlist(name)) > 1]
        if twice:
            raise RejectedError(
                message("{parts}: wanted one part of this name, got several", parts=", ".join(twice))
            )
        file, comment, raw = form.get("file"), form.get("comment"), form.get("properties")
        if not isinstance(file, UploadFile):
            raise RejectedError(message("file: wanted a multipart form with the file in a part named 'file'"))
        if problem := text_problem(comment or "", 10_000) or text_problem(raw or "", _MAX_FIELD):
            raise RejectedError(message("comment, properties: {problem}", problem=problem))
        kind = form.get("kind") or ""
        if kind not in ("", MODEL, *ATTACHMENT_KINDS):
            raise RejectedError(
                message("kind: wanted {model} or {kinds}", model=MODEL, kinds=" or ".join(ATTACHMENT_KINDS))
            )
        sha256 = sha256_or_none("sha256", form.get("sha256"))
        properties = _properties(raw if isinstance(raw, str) else None)
        origin = RevisionOrigin(
            _base_revision(form.get("base_revision")),
            _path(form.get("path")),
            _list("links", _LINKS, form.get("links")),
            _list("items", _HELD, form.get("items")),
            _former(form.get("former")),
        )
        key, text, digest = idempotency_key(call.request), str(comment or ""), sha256 or ""

        def answer(tx: Tx, of: Item | Document, revision: Revision) -> Response:
            answer_json = revision_to_wire(of, revision, links=True)
            if isinstance(of, Item) and (draft := draft_of(tx, of)):
                answer_json["draft"] = draft
            return json_answer(answer_json, 201)

        def work() -> Response:
            return store_file(call, find, file, text, answer, properties, key, digest, origin, str(kind))

        return await anyio.to_thread.run_sync(work)


@revisions_router.get("/file", response_class=Response, responses=BINARY)
def download_newest(call: Viewer, part_number: str) -> Response:
    """Send the newest file."""
    return _download(call, numbered(part_number))


@revisions_router.get("/file/{number}", response_class=Response, responses=BINARY)
def download_revision(call: Viewer, part_number: str, number: RevisionNumber) -> Response:
    """Send the file of one revision."""
    return _download(call, numbered(part_number), number)


@revisions_router.get(
    "/thumbnail",
    response_class=Response,
    responses={200: {"content": {"image/png": {}}, "description": "The picture"}},
)
def thumbnail(call: Viewer, part_number: str, key: Annotated[str, Query(max_length=64)] = "") -> Response:
    """Send the picture of the newest file that has one.

    A browser may keep a picture for a year if it asks with the ``key`` of the picture.
    """
    with call.read() as tx:
        item = items.get_item(tx, part_number)
    if not item.thumbnail_key:
        raise NotFoundError(message("item {part_number} has no thumbnail", part_number=item.part_number))
    path = call.server.files.path_of(item.thumbnail_key)
    kept = "max-age=31536000, immutable" if key and item.thumbnail_key.startswith(key) else "max-age=300"
    return FileResponse(path, media_type="image/png", headers={"Cache-Control": f"private, {kept}"})


_PNG = {"image/png": {"schema": {"type": "string", "format": "binary", "minLength": 57}}}
_DRAWN = {
    **openapi.refused("what is no PNG, too large a PNG"),
    "requestBody": {"required": True, "content": _PNG},
}


@revisions_router.put("/thumbnail", status_code=204, responses=WRITE_ERRORS, openapi_extra=_DRAWN)
async def put_thumbnail(call: Editor, part_number: str) -> Response:
    """Store what a browser drew of a model as the picture of an item without one. A new file removes it."""
    picture = await call.request.body()

    def work() -> Response:
        with call.write() as tx:
            item = items.get_item(tx, part_number)
            keep_picture(tx, call.server.files, item, picture)
        return Response(status_code=204)

    return await anyio.to_thread.run_sync(work)


def store_file(
    call: Call,
    find: Find,
    file: UploadFile,
    comment: str,
    answer: Callable[[Tx, Item | Document, Revision], Response],
    properties: Mapping[str, Any] | None = None,
    key: str | None = None,
    sha256: str = "",
    origin: RevisionOrigin | None = None,
    kind: str = "",
) -> Response:
    """Store an uploaded file as a new revision, for the API and the pages: of the model or an attachment.

    kind
        "": that of the content.

    ``answer`` is made before the commit.
    """
    origin = origin or RevisionOrigin()
    with call.read() as tx:
        find(tx, False)  # before anything is written to the disk
    stored = call.server.files.keep(file.filename or "file", file.file)
    checked_hash(stored, sha256)
    with call.write() as tx:
        of = find(tx, True)
        told = asdict(origin)
        if not told["former"]:  # a repeat of a request that was made before there was this field
            del told["former"]
        content = (stored.name, stored.checksum, comment, properties, told, *([kind] if kind else ()))
        what = "upload" if isinstance(of, Item) else "upload document"
        request = KeyedRequest.of(f"{what} {of.id}", key, content)
        if earlier := earlier_answer(tx, request):
            number, _, document = earlier.text.partition(" ")
            if document:
                of = documents.get_document(tx, document)
            return answer(tx, of, revisions.get_revision(tx, of, int(number)))
        attached = _attached(tx, of, stored, kind, comment)
        if properties and (attached or isinstance(of, Document)):
            raise RejectedError(message("properties: only the model of an item has any"))
        if attached is not None:
            revision = revisions.get_revision(tx, attached, attached.current_revision)
            keep_answer(tx, request, KeptAnswer(f"{revision.revision_number} {attached.uuid}"))
            return answer(tx, attached, revision)
        merged = {**of.properties, **properties} if isinstance(of, Item) and properties is not None else None
        revision = revisions.add_revision(
            tx, of, comment=comment, properties=merged, file=stored, origin=origin
        )
        scene.fill_in(tx, call.server.files, stored.checksum)
        keep_answer(tx, request, KeptAnswer(str(revision.revision_number)))
        return answer(tx, of, revision)


def _former(raw: object) -> str:
    if raw is None or raw == "":
        return ""
    if not isinstance(raw, str):
        raise RejectedError(message("former: wanted the UUID of a document"))
    return items.normal_uuid(raw)


def _attached(tx: Tx, of: Item | Document, stored: StoredFile, kind: str, comment: str) -> Document | None:
    """Attach a file that is no model, or is meant as none, to the item; None if it is the model's."""
    if not revisions.takes_models(of) and isinstance(of, Document):
        made, _ = attachments.revise(tx, of, stored, comment)
    elif kind == MODEL or (not kind and stored.kind == MODEL) or isinstance(of, Document):
        return None
    else:
        made, _ = attachments.attach(tx, of, stored, kind, comment)
    return documents.get_document(tx, made.id)


def checked_hash(stored: StoredFile, sha256: str) -> None:
    """Raise RejectedError if another content arrived than ``sha256`` ("": any) says was sent."""
    if sha256 and stored.checksum != sha256:
        raise RejectedError(
            message(
                "sha256: the file arrived as {arrived}, and {sent} was sent; no revision was made",
                arrived=stored.checksum,
                sent=sha256,
            )
        )


def _base_revision(raw: object) -> int | None:
    if raw is None or raw == "":
        return None
    number = whole_number(raw, 7) if isinstance(raw, str) else None
    if number is None or number > 1_000_000:
        raise RejectedError(
            message("base_revision: wanted the number of a revision, or 0 where there was none")
        )
    return number


def _path(raw: object) -> str | None:
    if raw is None or raw == "":
        return None
    if problem := text_problem(raw, 1000):
        raise RejectedError(message("path: {problem}", problem=problem))
    return str(raw)


def _list(name: str, kind: TypeAdapter[Any], raw: object) -> list[dict[str, str]] | None:
    if raw is None or raw == "":
        return None
    try:
        values = kind.validate_json(raw if isinstance(raw, str) else "")
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"]))
        raise RejectedError(
            message(
                "{field}: wanted a JSON list as text; {place}: {problem}",
                field=name,
                place=where,
                problem=first["msg"],
            )
        ) from None
    entries: list[dict[str, str]] = [value.model_dump(exclude_defaults=True) for value in values]
    for text in (text for value in entries for text in value.values()):
        if problem := text_problem(text, 1000):
            raise RejectedError(f"{name}: {problem}")
    return entries


def _properties(raw: str | None) -> dict[str, Any] | None:
    if raw is None or not raw.strip():
        return None
    try:
        value = json.loads(raw)
    except (ValueError, RecursionError):
        value = None
    if not isinstance(value, dict):
        raise RejectedError(message("properties: wanted a JSON object as text"))
    return value


def _download(call: Call, find: Find, number: int | None = None) -> Response:
    """Send the file of a revision, or the newest file. Raises NotFoundError."""
    with call.read() as tx:
        of = find(tx, False)
        revision = revisions.newest_file(tx, of) if number is None else revisions.get_revision(tx, of, number)
    if revision.file_checksum is None or revision.file_name is None:
        raise NotFoundError(message("revision {revision} has no file", revision=revision.revision_number))
    etag = f'"{revision.file_checksum}"'
    headers = {**DOWNLOAD_HEADERS, "ETag": etag}
    if call.request.headers.get("if-none-match") == etag:
        return Response(status_code=304, headers=headers)
    return FileResponse(
        call.server.files.path_of(revision.file_checksum),
        media_type="application/octet-stream",
        filename=revision.file_name,
        content_disposition_type="attachment",
        headers=headers,
    )


by_uuid = APIRouter(route_class=BoundedRoute, prefix="/api", tags=["documents"], responses=READ_ERRORS)


def document_at(uuid: str) -> Find:
    """Return a function that finds the document with this UUID, or the item that the document belongs to.

    With a lock, an unknown UUID becomes a new document: the sender of a file chooses the UUID.
    """

    def find(tx: Tx, lock: bool) -> Item | Document:
        normal = items.normal_uuid(uuid)
        document = find_document(tx, normal, lock=lock)
        if document is None and (of := items.get_by_uuids(tx, [normal], include_archived=True)):
            return items.get_item(tx, of[0].part_number, lock=lock)
        if document is not None and document.item_id is not None:
            (item,) = items.by_ids(tx, [document.item_id]).values()
            return items.get_item(tx, item.part_number, lock=lock)
        if document is None:
            return make_document(tx, normal) if lock else Document(0, normal, None, 0, "", "")
        return document

    return find


@by_uuid.post("/documents/by-uuid", response_model=DocumentsOut)
def get_documents(call: Viewer, body: UuidsBody) -> Response:
    """Return the documents with these UUIDs; unknown ones are absent. Changes nothing: a viewer may ask."""
    with call.read() as tx:
        documents = shown(tx, documents_by_uuid(tx, body.uuids))
    return json_answer({"documents": [to_wire(document) for document in documents]})


@by_uuid.post("/documents/by-content", response_model=ContentsOut)
def get_contents(call: Viewer, body: ChecksumsBody) -> Response:
    """Return whose revisions have these contents (SHA-256), and which document each file is now."""
    with call.read() as tx:
        found = of_contents(tx, body.sha256)
    return json_answer({"contents": [to_wire(content) for content in found]})


@by_uuid.get("/items/{part_number}/documents", response_model=DocumentsOut)
def documents_of(call: Viewer, part_number: str) -> Response:
    """Return the documents that hold an item: its own file, and files of several parts that contain it."""
    with call.read() as tx:
        documents = shown(tx, documents_holding(tx, items.get_item(tx, part_number)))
    return json_answer({"documents": [to_wire(document) for document in documents]})


@by_uuid.get("/documents/{uuid}", response_model=wire.Document)
def get_document(call: Viewer, uuid: Uuid) -> Response:
    """Return one document, the documents that it links to, and those that link to it."""
    with call.read() as tx:
        document_json = told_of(tx, uuid)
    return json_answer(document_json)


def told_of(tx: Tx, uuid: str) -> dict[str, Any]:
    """Describe a document and its links, for the API and the pages. Raises NotFoundError."""
    document = documents.get_document(tx, items.normal_uuid(uuid))
    now = shown(tx, [document])
    if not now:
        raise NotFoundError(message("{subject} has no file yet", subject=document.subject))
    newest = revisions.get_revision(tx, document, document.current_revision)
    near = {"linked": linked_from(tx, document), "used_by": linking_to(tx, document)}
    others = {
        name: [to_wire(shown_document) for shown_document in shown(tx, linked)]
        for name, linked in near.items()
    }
    return {**to_wire(now[0]), "links": newest.links, **others}


def _document(uuid: str) -> Find:
    return lambda tx, _lock: documents.get_document(tx, items.normal_uuid(uuid))


@by_uuid.get("/documents/{uuid}/revisions", response_model=list[RevisionOut])
def list_document_revisions(call: Viewer, uuid: Uuid, asked: Asked) -> Response:
    """Return the revisions of a document, newest first; the parameters are those of an item's revisions."""
    return _revisions(call, _document(uuid), asked)


@by_uuid.get("/documents/{uuid}/revisions/{number}", response_model=RevisionOut)
def get_document_revision(call: Viewer, uuid: Uuid, number: RevisionNumber) -> Response:
    """Return one revision, with the files that its file links to."""
    return _revision(call, _document(uuid), number)


@by_uuid.post(
    "/documents/{uuid}/file",
    status_code=201,
    response_model=RevisionOut,
    responses=WRITE_ERRORS,
    openapi_extra=UPLOAD,
)
async def upload_document_file(call: Editor, uuid: Uuid) -> Response:
    """Upload a file as a new revision of a document; the first upload makes the document.

    The form is that of an item's file.
    """
    return await receive(call, document_at(uuid))


@by_uuid.get("/documents/{uuid}/file", response_class=Response, responses=BINARY)
def download_newest_of_document(call: Viewer, uuid: Uuid) -> Response:
    """Send the newest file."""
    return _download(call, _document(uuid))


@by_uuid.get("/documents/{uuid}/file/{number}", response_class=Response, responses=BINARY)
def download_revision_of_document(call: Viewer, uuid: Uuid, number: RevisionNumber) -> Response:
    """Send the file of one revision."""
    return _download(call, _document(uuid), number)
