# SPDX-License-Identifier: LGPL-2.1-or-later
"""Geometry and structure of files over HTTP, and the scene of a product (decision 24)."""

from __future__ import annotations

from typing import Annotated, Any

import anyio.to_thread
from fastapi import APIRouter, Path, Query
from pydantic import Field
from starlette.responses import FileResponse, Response

from silo.api import wire
from silo.bom.errors import RejectedError
from silo_server.routes import openapi
from silo_server.routes.answers import READ_ERRORS, WRITE_ERRORS, json_answer
from silo_server.routes.call import Call, Editor, Viewer
from silo_server.routes.models import RequestBody
from silo_server.routes.requests import BoundedRoute
from silo_server.services import items, scene

router = APIRouter(route_class=BoundedRoute, prefix="/api", tags=["models"], responses=READ_ERRORS)

Sha256 = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
Checksum = Annotated[str, Path(pattern="^[0-9a-f]{64}$")]


class ContentsBody(RequestBody):
    """``POST /api/models/missing``, and its answer: contents by their SHA-256."""

    sha256: list[Sha256] = Field(max_length=10_000)


def _binary(kind: str) -> dict[int | str, dict[str, Any]]:
    media = {"content": {kind: {}}, "description": "As it was sent, packed with gzip"}
    return {200: media, 304: {"description": "Still what If-None-Match names"}}


def _sent(kind: str, schema: openapi.Schema) -> openapi.Schema:
    wanted = {"required": True, "content": {kind: {"schema": schema}}}
    return {
        **openapi.refused("a GLB of more than meshes, a structure that lacks what it names"),
        "requestBody": wanted,
    }


GLB, JSON = "model/gltf-binary", "application/json"
_BYTES = {"type": "string", "format": "binary"}


@router.post("/models/missing", response_model=ContentsBody)
def missing(call: Viewer, body: ContentsBody) -> Response:
    """Return which of these files of revisions have no geometry or no structure yet."""
    with call.read() as tx:
        return json_answer({"sha256": scene.missing(tx, body.sha256)})


@router.put(
    "/models/{sha256}/geometry",
    status_code=204,
    responses=WRITE_ERRORS,
    openapi_extra=_sent("application/octet-stream", _BYTES),
)
async def put_geometry(call: Editor, sha256: Checksum) -> Response:
    """Store the geometry of a file: a GLB, packed with gzip (``Content-Encoding``) or not."""
    return await _keep(call, sha256, "geometry")


@router.put(
    "/models/{sha256}/structure",
    status_code=204,
    responses=WRITE_ERRORS,
    openapi_extra=_sent(JSON, {"type": "object"}),
)
async def put_structure(call: Editor, sha256: Checksum) -> Response:
    """Store which parts a file shows, and where: JSON, packed with gzip (``Content-Encoding``) or not."""
    return await _keep(call, sha256, "structure")


async def _keep(call: Call, sha256: str, part: scene.Part) -> Response:
    coding = call.request.headers.get("content-encoding", "identity").lower()
    if coding not in ("gzip", "identity"):
        raise RejectedError(f"Content-Encoding: wanted gzip or none, got {coding[:40]!r}")
    sent = await call.request.body()

    def work() -> Response:
        body = scene.unpacked(part, sent, coding == "gzip")
        check = scene.check_glb if part == "geometry" else scene.check_structure
        check(body)
        with call.write() as tx:
            scene.keep(tx, call.server.files, sha256, part, body)
        return Response(status_code=204)

    return await anyio.to_thread.run_sync(work)


@router.get("/models/{sha256}/geometry", response_class=Response, responses=_binary(GLB))
def get_geometry(call: Viewer, sha256: Checksum, v: Annotated[str, Query(max_length=64)] = "") -> Response:
    """Return the geometry of a file. With the ``v`` of a scene a browser may keep it for a year."""
    return _part(call, sha256, "geometry", GLB, v)


@router.get("/models/{sha256}/structure", response_class=Response, responses=_binary(JSON))
def get_structure(call: Viewer, sha256: Checksum, v: Annotated[str, Query(max_length=64)] = "") -> Response:
    """Return which parts a file shows, and where. With ``v`` a browser may keep the answer for a year."""
    return _part(call, sha256, "structure", JSON, v)


def _part(call: Call, sha256: str, part: scene.Part, kind: str, version: str) -> Response:
    with call.read() as tx:
        checksum = scene.stored(tx, sha256, part)
    kept = "max-age=31536000, immutable" if version and checksum.startswith(version) else "no-cache"
    headers = {"ETag": f'"{checksum}"', "Cache-Control": f"private, {kept}", "Content-Encoding": "gzip"}
    if call.request.headers.get("if-none-match") == headers["ETag"]:
        return Response(status_code=304, headers=headers)
    return FileResponse(call.server.files.path_of(checksum), media_type=kind, headers=headers)


@router.get("/items/{part_number}/scene", response_model=wire.Scene, responses=WRITE_ERRORS)
def get_scene(
    call: Viewer, part_number: str, revision: Annotated[int | None, Query(ge=1, le=2**31 - 1)] = None
) -> Response:
    """Return the place of each part of a product: from the newest files, or as a revision recorded them."""
    with call.server.large_reads.enter(), call.read() as tx:
        item = items.get_item(tx, part_number, include_archived=True)
        return json_answer(scene.scene(tx, call.server.files, item, revision))
