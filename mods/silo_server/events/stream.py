# SPDX-License-Identifier: LGPL-2.1-or-later
"""``GET /api/events`` as an ASGI response: replay, live events, filters, heartbeat, until the client goes."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence

from starlette.responses import JSONResponse, Response
from starlette.types import Receive, Scope, Send

from silo.bom.errors import BusyError
from silo_server.events.hub import Batch, Frame, Hub
from silo_server.events.log import EventMark

HEADERS = {
    "cache-control": "no-store",
    "x-accel-buffering": "no",  # nginx passes every event on at once
}

HEARTBEAT = b"event: heartbeat\ndata: {}\n\n"


# A user's tabs and programs on one machine; each stream holds a connection.
MOST_STREAMS = 50


class EventResponse(Response):
    """The stream. ``last``: what the client saw last, None = only what is new from now on.

    ``items`` (UUIDs or part numbers) lets only their events through, and those of no item.
    ``still_allowed`` is asked at the start and with every heartbeat: a stream must not outlive its token.
    """

    media_type = "text/event-stream"

    def __init__(
        self,
        hub: Hub,
        last: EventMark | None,
        items: Sequence[str] = (),
        still_allowed: Callable[[], bool] = lambda: True,
        caller: tuple[int | None, str] = (None, ""),
    ) -> None:
        super().__init__(headers=HEADERS)
        del self.headers["content-length"]
        self._hub = hub
        self._last = last
        self._still_allowed = still_allowed
        self._caller = caller
        self._items = frozenset(item.casefold() for item in items)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        streams = self._hub.streams
        if streams[self._caller] >= MOST_STREAMS:
            full = f"there are {MOST_STREAMS} event streams of this user at this address; close one"
            await JSONResponse({"error": BusyError.code, "message": full}, 503, {"Retry-After": "30"})(
                scope, receive, send
            )
            return
        streams[self._caller] += 1
        try:
            await self._stream(receive, send)
        finally:
            streams[self._caller] -= 1
            if not streams[self._caller]:
                del streams[self._caller]

    async def _stream(self, receive: Receive, send: Send) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": self.raw_headers})
        gone = asyncio.ensure_future(_disconnected(receive))
        stream = asyncio.ensure_future(self._run(send))
        self._hub.listeners += 1
        try:
            await asyncio.wait((gone, stream), return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._hub.listeners -= 1
            gone.cancel()
            stream.cancel()
            results = await asyncio.gather(gone, stream, return_exceptions=True)
        ended = results[1]
        if isinstance(ended, Exception) and not isinstance(ended, OSError):
            raise ended

    async def _run(self, send: Send) -> None:
        hub = self._hub
        # No beat yet: the credential may have been revoked since the request was let in, so look first.
        beats, epoch = -1, hub.epoch
        cursor, reset = await hub.place(self._last)
        # The first bytes show proxies and clients that the stream stands.
        await _send(send, _hello(cursor) + (_reset(cursor) if reset else b""))
        while not hub.closed:
            if hub.epoch != epoch:
                epoch, cursor = hub.epoch, hub.head
                await _send(send, _reset(cursor))
            batch = await hub.take(cursor)
            cursor = batch.cursor
            payload = self._payload(batch)
            if hub.beats != beats:
                payload = payload or HEARTBEAT * (beats >= 0)
                beats = hub.beats
                if not await asyncio.to_thread(self._still_allowed):
                    break
            if payload:
                await _send(send, payload)
            if cursor.id >= hub.head.id and (beats, epoch) == (hub.beats, hub.epoch) and not hub.closed:
                await hub.wait()
        await send({"type": "http.response.body", "body": b"", "more_body": False})

    def _passes(self, frame: Frame) -> bool:
        if not self._items:
            return True
        about = {frame.item_uuid, frame.part_number_key} - {None}
        return not about or bool(about & self._items)

    def _payload(self, batch: Batch) -> bytes:
        frames = b"".join(frame.payload for frame in batch.frames if self._passes(frame))
        return _reset(batch.cursor) + frames if batch.reset else frames


def _hello(cursor: EventMark) -> bytes:
    # With the id a listener that is cut off before its first event can ask for what it missed.
    return f": connected\nid: {cursor}\nretry: 2000\n\n".encode()


def _reset(cursor: EventMark) -> bytes:
    return f"id: {cursor}\nevent: reset\ndata: {{}}\n\n".encode()


async def _send(send: Send, payload: bytes) -> None:
    await send({"type": "http.response.body", "body": payload, "more_body": True})


async def _disconnected(receive: Receive) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass
