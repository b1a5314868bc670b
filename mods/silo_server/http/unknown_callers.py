# SPDX-License-Identifier: LGPL-2.1-or-later
"""Who may send a body: a caller is known by the headers of a request before anything of its body is read.

* A program that is not known gets its 401 at once, but for the requests that let callers in.
* A form of a browser that is not known is read up to a small limit, to be kept over the login.
* Each address has a few such requests at a time.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable
from typing import Any

import anyio.to_thread
from fastapi import Request
from sqlalchemy.exc import SQLAlchemyError
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from silo.bom.errors import AuthError, BusyError, SiloError
from silo.bom.message import message
from silo.budget import KIB
from silo_server.http.errors import answer_of

# [bytes] of a body that is read before its sender is known.
UNKNOWN_BODY = 64 * KIB
MOST_FOR_AN_ADDRESS = 16
# Where a caller becomes known, so that no credential can be wanted.
LETS_IN = re.compile(r"/login(?:/.*)?|/language|/api/auth/(?:login|device(?:/token)?)")
# In the scope: what the caller is counted under, None for a caller who is not known.
CALLER = "silo.caller"

NEEDS_TOKEN = "a valid token is needed: send it as 'Authorization: Bearer silo_…'"


def has_body(scope: Scope) -> bool:
    """Check if a request announces a body."""
    headers = Headers(scope=scope)
    return headers.get("content-length", "0").strip() != "0" or "transfer-encoding" in headers


class UnknownCallers:
    """Refuses bodies of callers who are not known.

    find_user
        finds the id of the user who sends a request, by its headers; None if unknown. Asks the database.
    """

    def __init__(self, app: ASGIApp, find_user: Callable[[Request], int | None]) -> None:
        self.app = app
        self._find_user = find_user
        self._under_way: Counter[str] = Counter()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or not has_body(scope):
            await self.app(scope, receive, send)
            return
        request, path = Request(scope), scope["path"]
        try:
            user = await anyio.to_thread.run_sync(self._find_user, request)
            if user is None and path.startswith("/api/") and not LETS_IN.fullmatch(path):
                raise AuthError(NEEDS_TOKEN)
        except (SiloError, SQLAlchemyError) as error:
            await (await answer_of(request, error))(scope, receive, send)
            return
        inner: dict[str, Any] = {**scope, CALLER: user}
        if user is not None:
            await self.app(inner, receive, send)
            return
        address = request.client.host if request.client else ""
        if self._under_way[address] >= MOST_FOR_AN_ADDRESS:
            busy = BusyError(
                message("too many requests without a login come from this address; try again later")
            )
            await (await answer_of(request, busy))(scope, receive, send)
            return
        self._under_way[address] += 1
        try:
            await self.app(inner, receive, send)
        finally:
            self._under_way[address] -= 1
            self._under_way += Counter()  # forget addresses without any
