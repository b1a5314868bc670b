# SPDX-License-Identifier: LGPL-2.1-or-later
"""How the server is: health, readiness, metrics, modules, mode, housekeeping."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any, Literal

from fastapi import APIRouter, Request
from prometheus_client import CONTENT_TYPE_LATEST
from pydantic import BaseModel
from starlette.responses import Response

from silo.bom.errors import AuthError
from silo_server.db.state import mode_of
from silo_server.housekeeping import last_run
from silo_server.http.unknown_callers import NEEDS_TOKEN
from silo_server.probe import HEALTH_SECONDS, READY_SECONDS, ServerStanding
from silo_server.routes.answers import READ_ERRORS, json_answer
from silo_server.routes.call import Admin, ServerDep, Viewer, client_address, find_actor
from silo_server.routes.requests import BoundedRoute
from silo_server.services.mode import change_mode
from silo_server.standing import standing
from silo_server.times import stamp

router = APIRouter(route_class=BoundedRoute, tags=["system"])
MODULES = (
    "core",
    "schemas",
    "bom",
    "bom_merge",
    "bom_history",
    "events",
    "files",
    "auth",
    "export",
    "import",
)


class ModeBody(BaseModel):
    """``PUT /api/admin/mode``."""

    mode: Literal["normal", "read-only"]


@router.get("/health")
async def health(server: ServerDep) -> dict[str, Any]:
    """Answer that the process lives, and in which mode. Waits for nothing that others wait for."""
    state = await server.probe.look(HEALTH_SECONDS) or server.probe.last
    return {"status": "ok", "mode": state.mode}


@router.api_route("/health", methods=["HEAD", "OPTIONS"], include_in_schema=False)
@router.api_route("/ready", methods=["OPTIONS"], include_in_schema=False)
async def looked_at() -> Response:
    """Answer load balancers and browsers that test an address before they use it."""
    return Response(status_code=204, headers={"Allow": "GET, HEAD, OPTIONS"})


@router.api_route("/ready", methods=["HEAD"], include_in_schema=False)
@router.get("/ready", responses={503: {"description": "The database or the file store is not there"}})
async def ready(server: ServerDep) -> Response:
    """Say if the server can work: 200, or 503 while database or file store cannot be reached or are full."""
    state = await server.probe.look(READY_SECONDS) or ServerStanding(
        "degraded", "unreachable", server.probe.last.files
    )
    body = {
        "status": "ready" if state.ready else "not ready",
        "mode": state.mode,
        "database": state.database,
        "files": state.files,
        "sse_clients": server.hub.listeners,
        "takes_item_ids": True,
        "device_login": True,
        "freecad": server.settings.freecad_version,
    }
    return json_answer(body, 200 if state.ready else 503)


@router.get(
    "/metrics",
    response_class=Response,
    responses={**READ_ERRORS, 200: {"content": {"text/plain": {}}, "description": "The numbers"}},
)
def metrics(call: Viewer) -> Response:
    """Return the metrics for Prometheus; the role viewer is enough."""
    rendered = call.request.app.state.metrics.render(call.server.db, call.server.hub, call.server.files)
    return Response(rendered, headers={"Content-Type": CONTENT_TYPE_LATEST})


@router.get("/api/openapi.json", include_in_schema=False)
def openapi_document(request: Request, server: ServerDep) -> Response:
    """Return the OpenAPI document; where ``SILO_OPENAPI_LOGIN`` is set, to known callers only."""
    if server.settings.openapi_login and find_actor(request) is None:
        raise AuthError(NEEDS_TOKEN)
    return json_answer(request.app.openapi(), 200)


@router.get("/api/modules", responses=READ_ERRORS)
async def modules(call: Viewer) -> dict[str, Any]:
    """Return the modules of this server."""
    return {"modules": {name: {"enabled": True} for name in MODULES}}


@router.get("/api/admin/mode", responses=READ_ERRORS)
def get_mode(call: Admin) -> dict[str, Any]:
    """Return the mode: ``normal`` or ``read-only``."""
    with call.read() as tx:
        return {"mode": mode_of(tx)}


@router.get("/api/admin/system", responses=READ_ERRORS)
def get_system(call: Admin) -> dict[str, Any]:
    """Return version, database, disk, last backup and housekeeping, queues, counts, warnings of the start.

    ``request`` is how this request reached the server, so that the caller can see what a proxy makes of it.
    """
    server, request = call.server, call.request
    return standing(server.db, server.hub, server.files, server.large_reads) | {
        "at": stamp(server.db.clock()),
        "request": {
            "scheme": request.url.scheme,
            "address": client_address(request),
            "forwarded_for": request.headers.get("x-forwarded-for", ""),
        },
    }


@router.get("/api/admin/housekeeping", responses=READ_ERRORS)
def get_housekeeping(call: Admin) -> dict[str, Any]:
    """Return when old rows and files were last deleted, how many, and what failed; null if never."""
    with call.read() as tx:
        run = last_run(tx)
    return {"last_run": asdict(run) if run else None}


@router.put("/api/admin/mode", responses=READ_ERRORS)
def set_mode(call: Admin, body: ModeBody) -> dict[str, Any]:
    """Allow changes, or refuse them (503) until the mode is set again; all processes follow at once."""
    with call.write(even_when_read_only=True) as tx:
        return {"mode": change_mode(tx, body.mode)}
