# SPDX-License-Identifier: LGPL-2.1-or-later
"""The limits of a request's body: its size, the pace at which it comes, and what all bodies hold together.

An upload goes to the disk as it comes. Every other body is in memory until its request is answered.
"""

from __future__ import annotations

import asyncio
import re
import time
from collections import Counter

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from silo.budget import size
from silo_server.http.errors import RETRY_SECONDS, error_answer
from silo_server.http.unknown_callers import CALLER, UNKNOWN_BODY
from silo_server.settings import Settings

# A body may take another second for each BODY_PACE bytes.
BODY_PACE = 8 * 1024
# [s] So often a request that waits for its body checks if the server is about to stop.
CLOSING_SECONDS = 0.5
CLOSE = {"Connection": "close"}
UPLOAD_PATH = re.compile(r"/(?:api/)?(?:items|documents)/[^/]+/files?$")


class BodyLimit:
    """413 for a body above the limit, announced or sent; uploads have a limit of their own.

    503 for a body that does not fit beside those of all other requests. One user has half of the room.
    """

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self.app = app
        self.settings = settings
        self._held: Counter[int | None] = Counter()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        caller: int | None = scope.get(CALLER)
        in_memory = not UPLOAD_PATH.match(scope["path"])
        limit = UNKNOWN_BODY if caller is None else self._limit(scope["path"])
        message = f"the request is larger than this server takes ({size(limit)})"
        # A browser gets its answer from inside, where errors become pages.
        headers = Headers(scope=scope)
        length = headers.get("content-length", "")
        from_browser = "text/html" in headers.get("accept", "")
        if length.isdecimal() and int(length) > limit and not from_browser:
            await error_answer(413, "too_large", message)(scope, receive, send)
            return
        taken = 0
        whole = False
        begun = time.monotonic()

        async def counted() -> Message:
            nonlocal taken, whole
            if whole:
                return await receive()
            # A body must come at some pace: else half a request could be kept open without end.
            end = begun + self.settings.request_body_seconds + taken / BODY_PACE
            while True:
                left = end - time.monotonic()
                try:
                    part = await asyncio.wait_for(receive(), min(max(left, 0.01), CLOSING_SECONDS))
                    break
                except TimeoutError:
                    if scope["app"].state.server.hub.closed:
                        raise HTTPException(503, "the server is stopping; try again later", CLOSE) from None
                    if left <= CLOSING_SECONDS:
                        raise HTTPException(408, "the request's body came too slowly", CLOSE) from None
            whole = not part.get("more_body", False)
            came = len(part.get("body", b""))
            taken += came
            if taken > limit:
                raise HTTPException(413, message)
            if in_memory:
                self._held[caller] += came
                self._check_room(caller)
            return part

        try:
            await self.app(scope, counted, send)
        finally:
            if in_memory:
                self._held[caller] -= taken
                self._held += Counter()  # forget users without a body

    def _check_room(self, caller: int | None) -> None:
        room = self.settings.max_bodies_bytes
        if self._held[caller] > room // 2 or self._held.total() > room:
            message = "the server holds too many requests at the moment; nothing was changed, try again later"
            raise HTTPException(503, message, {"Retry-After": RETRY_SECONDS, **CLOSE})

    def _limit(self, path: str) -> int:
        # A form has some bytes around its file.
        if UPLOAD_PATH.match(path):
            return self.settings.max_file_bytes + 64 * 1024
        return self.settings.max_body_bytes
