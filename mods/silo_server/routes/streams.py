# SPDX-License-Identifier: LGPL-2.1-or-later
"""The stream of events."""

from __future__ import annotations

import re
from typing import Annotated

from fastapi import APIRouter, Query
from sqlalchemy.exc import SQLAlchemyError
from starlette.responses import Response

from silo.bom.errors import RejectedError
from silo.bom.message import message
from silo_server.events import log
from silo_server.events.stream import EventResponse
from silo_server.routes.answers import READ_ERRORS
from silo_server.routes.call import Viewer, find_actor
from silo_server.routes.requests import BoundedRoute

router = APIRouter(route_class=BoundedRoute, tags=["system"])

EVENT_ID = re.compile(r"(?P<number>[0-9]{1,18})(?:-(?P<tag>[0-9a-f]{8}))?")


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
    """Stream events: those since ``Last-Event-ID`` (or ``last_event_id``), then new ones as they happen.

    ``item`` (part numbers or UUIDs, repeatable): only events of these items. The event ``reset`` means: the
    log does not go back that far, so read everything again.
    """
    last = _event_id(call.request.headers.get("last-event-id") or last_event_id)

    def still_allowed() -> bool:
        try:
            return find_actor(call.request) is not None
        except SQLAlchemyError:
            return True  # a lost database is no reason to end the streams

    caller = (call.actor.user_id, call.actor.address)
    return EventResponse(call.server.hub, last, item or (), still_allowed, caller)


def _event_id(text: str | None) -> log.EventMark | None:
    if text is None or text == "":
        return None
    match = EVENT_ID.fullmatch(text)
    if match is None:
        raise RejectedError(
            message("Last-Event-ID: wanted the id of an event (a number), got {got}", got=repr(text[:40]))
        )
    return log.EventMark(int(match["number"]), match["tag"] or "")
