# SPDX-License-Identifier: LGPL-2.1-or-later
"""Answers are compressed for callers that take it, but for streams and files."""

from __future__ import annotations

import re

from starlette.middleware.gzip import GZipMiddleware
from starlette.types import ASGIApp, Receive, Scope, Send

# Answers from this size on are compressed; a packet or two are sent as they are.
COMPRESSED_BYTES = 1400
# Half the time of the highest level for a tenth more bytes.
COMPRESSION = 5
# A stream of events must not be held back, a file keeps its length and its ranges.
_AS_IT_IS = re.compile(r"/(?:events|thumbnail|geometry|structure|file(?:/[0-9]+)?|export\.xlsx)$")


class Compressed:
    """Compresses answers for callers that take it. For this a page shows its secret masked."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app
        self._gzip = GZipMiddleware(app, minimum_size=COMPRESSED_BYTES, compresslevel=COMPRESSION)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        as_it_is = scope["type"] != "http" or _AS_IT_IS.search(scope["path"])
        await (self.app if as_it_is else self._gzip)(scope, receive, send)
