# SPDX-License-Identifier: LGPL-2.1-or-later
"""Health, events, modules, mode."""

from __future__ import annotations

import re
from dataclasses import asdict
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Query
from pydantic import BaseModel
from sqlalchemy.exc import SQLAlchemyError
from starlette.responses import Response

from silo.bom.errors import RejectedError
from silo_server.background import HEALTH_SECONDS, READY_SECONDS, State
from silo_server.db.engine import mode_of
from silo_server.events.stream import EventStream
from silo_server.operation.housekeeping import last_run
from silo_server.operation.metrics import CONTENT_TYPE
from silo_server.routes.context import (
    READ_ERRORS,
    Admin,
    ServerDep,
    Viewer,
    find_actor,
    json_answer,
)
from silo_server.services import events

router = APIRouter(tags=["system"])
EVENT_ID = re.compile(r"(?P<number>[0-9]{1,18})(?:-(?P<tag>[0-9a-f]{8}))?")
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
    """The process lives; says also in which mode. Waits for nothing that others wait for."""
    state = await server.probe.look(HEALTH_SECONDS) or server.probe.last
    return {"status": "ok", "mode": state.mode}


@router.get("/ready", responses={503: {"description": "The database or the file store is not there"}})
async def ready(server: ServerDep) -> Response:
    """The server can do its work: 200, or 503 while the database or the file store is away or full."""
    state = await server.probe.look(READY_SECONDS) or State(
        "degraded", "unreachable", server.probe.last.files
    )
    body = {
        "status": "ready" if state.ready else "not ready",
        "mode": state.mode,
        "database": state.database,
        "files": state.files,
        "sse_clients": server.hub.listeners,
        "takes_item_ids": True,
    }
    return json_answer(body, 200 if state.ready else 503)


@router.get(
    "/metrics",
    response_class=Response,
    responses={**READ_ERRORS, 200: {"content": {"text/plain": {}}, "description": "The numbers"}},
)
def metrics(call: Viewer) -> Response:
    """For Prometheus, with a viewer's token."""
    rendered = call.request.app.state.metrics.render(call.server.db, call.server.hub, call.server.files)
    return Response(rendered, headers={"Content-Type": CONTENT_TYPE})


@router.get(
    "/api/events",
    response_class=Response,
    responses={**READ_ERRORS, 200: {"content": {"text/event-stream": {}}, "description": "The events"}},
)
async def stream_events(
    call: Viewer,
    item: Annotated[list[str] | None, Query(max_length=100)] = None,
    last_event_id: Annotated[str | None, Query(max_length=40)] = None,
) -> Response:
    """Events as they happen. ``Last-Event-ID`` (or ``last_event_id``) replays what came after it.

    ``item`` (part numbers or UUIDs, repeatable) lets only their events through. ``reset`` says: you were away
    for longer than the log goes back, read everything again.
    """
    last = _event_id(call.request.headers.get("last-event-id") or last_event_id)

    def still_allowed() -> bool:
        try:
            return find_actor(call.request) is not None
        except SQLAlchemyError:
            return True  # the database being away is no reason to send everybody away

    return EventStream(call.server.hub, last, item or (), still_allowed)


@router.get("/api/modules", responses=READ_ERRORS)
async def modules(call: Viewer) -> dict[str, Any]:
    """What this server can do."""
    return {"modules": {name: {"enabled": True} for name in MODULES}}


@router.get("/api/admin/mode", responses=READ_ERRORS)
def get_mode(call: Admin) -> dict[str, Any]:
    """The mode: ``normal`` or ``read-only``."""
    with call.read() as tx:
        return {"mode": mode_of(tx)}


@router.get("/api/admin/housekeeping", responses=READ_ERRORS)
def get_housekeeping(call: Admin) -> dict[str, Any]:
    """When old rows and files were last deleted, how many of what, and what went wrong; null before that."""
    with call.read() as tx:
        run = last_run(tx)
    return {"last_run": asdict(run) if run else None}


@router.put("/api/admin/mode", responses=READ_ERRORS)
def set_mode(call: Admin, body: ModeBody) -> dict[str, Any]:
    """Take changes, or take none (503) until set otherwise; all processes follow at once."""
    with call.write(even_when_read_only=True) as tx:
        return {"mode": events.set_mode(tx, body.mode)}


def _event_id(text: str | None) -> events.Mark | None:
    if text is None or text == "":
        return None
    found = EVENT_ID.fullmatch(text)
    if found is None:
        raise RejectedError(f"Last-Event-ID: wanted the id of an event (a number), got {text[:40]!r}")
    return events.Mark(int(found["number"]), found["tag"] or "")
