# SPDX-License-Identifier: LGPL-2.1-or-later
"""Around every route: the limit of a request's size, headers that keep a browser strict, compression."""

from __future__ import annotations

import asyncio
import re
import time

from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.middleware.gzip import GZipMiddleware
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from silo_server.failures import error_answer
from silo_server.settings import MIB, Settings

# A body may take another second for each BODY_PACE bytes.
BODY_PACE = 8 * 1024
CLOSE = {"Connection": "close"}
# Answers from this size on are compressed; a packet or two are sent as they are.
COMPRESSED_BYTES = 1400
# Half the time of the highest level for a tenth more bytes.
COMPRESSION = 5
# A stream of events must not be held back, a file keeps its length and its ranges.
_AS_IT_IS = re.compile(r"/(?:events|thumbnail|file(?:/[0-9]+)?|export\.xlsx)$")
UPLOAD_PATH = re.compile(r"/(?:api/)?items/[^/]+/file$")

SECURITY_HEADERS = {
    "Content-Security-Policy": (
        "default-src 'self'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
        "object-src 'none'; base-uri 'none'; frame-ancestors 'none'; form-action 'self'"
    ),
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=()",
    "Cache-Control": "no-store",
}


class SecurityHeaders:
    """Adds the headers that are not there yet; a route may be stricter by itself."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in SECURITY_HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        await self.app(scope, receive, send_with_headers)


class Compressed:
    """Compresses answers for callers that take it. For this a page shows its secret masked."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app
        self._gzip = GZipMiddleware(app, minimum_size=COMPRESSED_BYTES, compresslevel=COMPRESSION)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        as_it_is = scope["type"] != "http" or _AS_IT_IS.search(scope["path"])
        await (self.app if as_it_is else self._gzip)(scope, receive, send)


class BodyLimit:
    """413 for a body above the limit, announced or sent; uploads have a limit of their own."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self.app = app
        self.settings = settings

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        limit = self._limit(scope["path"])
        message = f"the request is larger than this server takes ({limit / MIB:g} MiB)"
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
            left = begun + self.settings.request_body_seconds + taken / BODY_PACE - time.monotonic()
            try:
                part = await asyncio.wait_for(receive(), max(left, 0.01))
            except TimeoutError:
                raise HTTPException(408, "the request's body came too slowly", CLOSE) from None
            whole = not part.get("more_body", False)
            taken += len(part.get("body", b""))
            if taken > limit:
                raise HTTPException(413, message)
            return part

        await self.app(scope, counted, send)

    def _limit(self, path: str) -> int:
        # A form has some bytes around its file.
        if UPLOAD_PATH.match(path):
            return self.settings.max_file_bytes + 64 * 1024
        return self.settings.max_body_bytes
