# SPDX-License-Identifier: LGPL-2.1-or-later
"""Revisions and their files."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from typing import Annotated, Any

import anyio.to_thread
from fastapi import APIRouter, Path, Query, Request
from pydantic import Field, TypeAdapter, ValidationError
from starlette.datastructures import UploadFile
from starlette.responses import FileResponse, Response

from silo.api.wire import LinkedFile
from silo.bom.errors import NotFoundError, RejectedError
from silo_server.routes import document
from silo_server.routes.context import (
    READ_ERRORS,
    WRITE_ERRORS,
    Call,
    Editor,
    Viewer,
    json_answer,
)
from silo_server.routes.models import RevisionBody, RevisionOut
from silo_server.services import items, revisions
from silo_server.services.bom.merge_json import is_short_text, sha256_or_none
from silo_server.services.revisions import Origin, revision_to_wire
from silo_server.values import Item, Revision

router = APIRouter(prefix="/api/items/{part_number}", tags=["revisions"])

# A file is handed out as a thing to keep, never as something a browser would run or show.
DOWNLOAD_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; sandbox",
    "Cache-Control": "private, no-cache",
}
_MAX_FIELD = 8 << 20
_LINKS = TypeAdapter(Annotated[list[LinkedFile], Field(max_length=10_000)])
RevisionNumber = Annotated[int, Path(ge=1, le=1_000_000)]
BINARY: dict[int | str, dict[str, Any]] = {
    200: {"content": {"application/octet-stream": {}}, "description": "The file"},
    206: {"content": {"application/octet-stream": {}}, "description": "The part of the file asked for"},
    304: {"description": "The file is still the one that If-None-Match names"},
    416: {"description": "The file has no such range"},
}
_FORM: document.Schema = {
    "file": {"type": "string", "format": "binary"},
    "comment": document.text(10_000),
    "properties": {"type": "string", "description": "a JSON object"},
    "sha256": {**document.SHA256, "description": "of the file; another content is refused"},
    "base_revision": {
        "type": "integer",
        "minimum": 0,
        "maximum": 1_000_000,
        "description": "what the file was made from; 409 where a newer file is there",
    },
    "path": document.text(1000, description="where the file is in its project, with /"),
    "links": {
        "type": "string",
        "description": "a JSON list of the linked files: path, item (UUID), sha256",
    },
}
UPLOAD = {
    **document.refused(
        "properties that are no JSON object, links that are no such list, "
        "and a sha256 that is not that of the file"
    ),
    "requestBody": {
        "required": True,
        "content": {
            "multipart/form-data": {"schema": {"type": "object", "required": ["file"], "properties": _FORM}}
        },
    },
}


@router.get("/revisions", response_model=list[RevisionOut], responses=READ_ERRORS)
def list_revisions(
    call: Viewer,
    part_number: str,
    limit: Annotated[int, Query(ge=1, le=1000)] = 100,
    before: Annotated[int | None, Query(ge=1, le=2**31 - 1)] = None,
    after: Annotated[int, Query(ge=0, le=2**31 - 1)] = 0,
) -> Response:
    """Revisions, newest first; those below the number ``before`` and above ``after``.

    ``X-Total-Count`` says how many there are above ``after``.
    """
    with call.read() as tx:
        item = items.get_item(tx, part_number)
        found, total = revisions.list_revisions(tx, item, limit, before=before, after=after)
    told = [revision_to_wire(item.part_number, revision) for revision in found]
    return json_answer(told, headers={"X-Total-Count": str(total)})


@router.get("/revisions/{number}", response_model=RevisionOut, responses=READ_ERRORS)
def get_revision(call: Viewer, part_number: str, number: RevisionNumber) -> Response:
    """One revision, with the files that its file links to."""
    with call.read() as tx:
        item = items.get_item(tx, part_number)
        revision = revisions.get_revision(tx, item, number)
    return json_answer(revision_to_wire(item.part_number, revision, links=True))


@router.post("/revisions", status_code=201, response_model=RevisionOut, responses=WRITE_ERRORS)
def add_revision(call: Editor, part_number: str, body: RevisionBody) -> Response:
    """A revision without a file: a new property snapshot."""
    with call.write() as tx:
        item = items.get_item(tx, part_number, lock=True)
        revision = revisions.add_revision(tx, item, comment=body.comment, properties=body.properties)
        return json_answer(revision_to_wire(item.part_number, revision, links=True), 201)


@router.post(
    "/file", status_code=201, response_model=RevisionOut, responses=WRITE_ERRORS, openapi_extra=UPLOAD
)
async def upload_file(call: Editor, part_number: str) -> Response:
    """Upload a file (form part ``file``, texts ``comment`` and ``properties``) as a new revision.

    ``Idempotency-Key`` makes a repeat give the revision that the first request made. With ``base_revision``
    a file is refused (409 ``newer_revision``, with that revision) where somebody committed one since.
    The form is read here and not by a parameter, so that nobody without a role fills the disk.
    """
    async with call.request.form(max_files=1, max_fields=20, max_part_size=_MAX_FIELD) as form:
        twice = [name for name in _FORM if len(form.getlist(name)) > 1]
        if twice:
            raise RejectedError(f"{', '.join(twice)}: wanted one part of this name, got several")
        file, comment, raw = form.get("file"), form.get("comment"), form.get("properties")
        if not isinstance(file, UploadFile):
            raise RejectedError("file: wanted a multipart form with the file in a part named 'file'")
        if isinstance(raw, UploadFile) or not is_short_text(comment or "", 10_000):
            raise RejectedError("comment, properties: wanted texts of at most 10 000 characters")
        sha256 = sha256_or_none("sha256", form.get("sha256"))
        properties = _properties(raw)
        origin = Origin(
            _base_revision(form.get("base_revision")), _path(form.get("path")), _links(form.get("links"))
        )
        key, text, digest = _idempotency_key(call.request), str(comment or ""), sha256 or ""

        def answer(item: Item, revision: Revision) -> Response:
            return json_answer(revision_to_wire(item.part_number, revision, links=True), 201)

        def work() -> Response:
            return store_file(call, part_number, file, text, answer, properties, key, digest, origin)

        return await anyio.to_thread.run_sync(work)


@router.get("/file", response_class=Response, responses={**READ_ERRORS, **BINARY})
def download_newest(call: Viewer, part_number: str) -> Response:
    """The newest file."""
    with call.read() as tx:
        revision = revisions.newest_file(tx, items.get_item(tx, part_number))
    return _download(call, revision)


@router.get("/file/{number}", response_class=Response, responses={**READ_ERRORS, **BINARY})
def download_revision(call: Viewer, part_number: str, number: RevisionNumber) -> Response:
    """The file of one revision."""
    with call.read() as tx:
        revision = revisions.get_revision(tx, items.get_item(tx, part_number), number)
    return _download(call, revision)


@router.get(
    "/thumbnail",
    response_class=Response,
    responses={**READ_ERRORS, 200: {"content": {"image/png": {}}, "description": "The picture"}},
)
def thumbnail(call: Viewer, part_number: str, key: Annotated[str, Query(max_length=64)] = "") -> Response:
    """The picture that came with the newest file that has one. One asked for by its ``key`` may be kept."""
    with call.read() as tx:
        item = items.get_item(tx, part_number)
    if not item.thumbnail_key:
        raise NotFoundError(f"item {item.part_number} has no thumbnail")
    path = call.server.files.path_of(item.thumbnail_key)
    kept = "max-age=31536000, immutable" if key and item.thumbnail_key.startswith(key) else "max-age=300"
    return FileResponse(path, media_type="image/png", headers={"Cache-Control": f"private, {kept}"})


def store_file(
    call: Call,
    part_number: str,
    file: UploadFile,
    comment: str,
    answer: Callable[[Item, Revision], Response],
    properties: Mapping[str, Any] | None = None,
    key: str | None = None,
    sha256: str = "",
    origin: Origin | None = None,
) -> Response:
    """An uploaded file as a new revision, for the API and the pages; ``answer`` is made before the commit."""
    with call.read() as tx:
        items.get_item(tx, part_number)  # before anything is written to the disk
    stored = call.server.files.keep(file.filename or "file", file.file)
    if sha256 and stored.checksum != sha256:
        raise RejectedError(
            f"sha256: the file arrived as {stored.checksum}, and {sha256} was sent; no revision was made"
        )
    with call.write() as tx:
        item = items.get_item(tx, part_number, lock=True)
        merged = None if properties is None else {**item.properties, **properties}
        revision = revisions.add_revision(
            tx,
            item,
            comment=comment,
            properties=merged,
            file=stored,
            idempotency_key=key,
            origin=origin or Origin(),
        )
        return answer(item, revision)


def _idempotency_key(request: Request) -> str | None:
    key = request.headers.get("idempotency-key")
    if key is not None and not 0 < len(key) <= 128:
        raise RejectedError("Idempotency-Key: wanted 1 to 128 characters")
    return key


def _base_revision(raw: object) -> int | None:
    if raw is None or raw == "":
        return None
    if not (isinstance(raw, str) and re.fullmatch("[0-9]{1,7}", raw) and int(raw) <= 1_000_000):
        raise RejectedError("base_revision: wanted the number of a revision, or 0 where there was none")
    return int(raw)


def _path(raw: object) -> str | None:
    if raw is None or raw == "":
        return None
    if not is_short_text(raw, 1000):
        raise RejectedError("path: wanted a text of at most 1000 characters")
    return str(raw)


def _links(raw: object) -> list[dict[str, str]] | None:
    if raw is None or raw == "":
        return None
    try:
        found = _LINKS.validate_json(raw if isinstance(raw, str) else "")
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"]))
        wanted = "wanted a JSON list of path, item and sha256"
        raise RejectedError(f"links: {wanted}; {where}: {first['msg']}") from None
    if not all(is_short_text(link.path, 1000) and is_short_text(link.item, 64) for link in found):
        raise RejectedError("links: wanted texts without the character NUL")
    return [link.model_dump() for link in found]


def _properties(raw: str | None) -> dict[str, Any] | None:
    if raw is None or not raw.strip():
        return None
    try:
        value = json.loads(raw)
    except (ValueError, RecursionError):
        value = None
    if not isinstance(value, dict):
        raise RejectedError("properties: wanted a JSON object as text")
    return value


def _download(call: Call, revision: Revision) -> Response:
    if revision.file_checksum is None or revision.file_name is None:
        raise NotFoundError(f"revision {revision.revision_number} has no file")
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
