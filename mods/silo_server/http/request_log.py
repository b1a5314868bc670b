# SPDX-License-Identifier: LGPL-2.1-or-later
"""Around the whole application: an id for each request, a line of log, metrics, the sub-path.

The id is the caller's own ``X-Request-ID`` if it has a plain one; it is in the answer's headers, in the
log line, and in the log of a fault. Log lines are JSON on standard error (``SILO_REQUEST_LOG``); they never
hold a query, a token or a login link's secret.
"""

from __future__ import annotations

import json
import logging
import re
import secrets
import sys
import time
from dataclasses import dataclass
from urllib.parse import urlsplit, urlunsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from silo_server.metrics import Metrics
from silo_server.settings import Settings
from silo_server.times import stamp, utc_now

request_logger = logging.getLogger("silo_server.requests")
HEADER = "X-Request-ID"
KEY = "silo.request"
_PLAIN = re.compile(r"[A-Za-z0-9._-]{1,64}")
_SECRET_PATH = re.compile(r"^/login/link/.+")


@dataclass(slots=True)
class RequestInfo:
    """What the log says of a request; ``user`` once it is known."""

    id: str
    user: str | None = None


def info_of(scope: Scope) -> RequestInfo:
    """Return the info of a request; a new one if the application runs without :class:`Observed`."""
    info = scope.get(KEY)
    return info if isinstance(info, RequestInfo) else RequestInfo("-")


class Observed:
    """The application with ids, log and metrics; nothing that it raises goes further.

    A fault was logged with its request id by ``failures`` already; uvicorn would write it a second time.
    """

    def __init__(self, app: ASGIApp, settings: Settings, metrics: Metrics) -> None:
        self.app = app
        self._root = settings.root_path
        self._metrics = metrics
        self._log = settings.request_log

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        given = Headers(scope=scope).get(HEADER, "")
        info = RequestInfo(given if _PLAIN.fullmatch(given) else secrets.token_hex(8))
        inner = self._without_root({**scope, KEY: info})
        status = 0
        started = time.perf_counter()

        async def observed(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                headers = MutableHeaders(scope=message)
                headers[HEADER] = info.id
                target = _own_path(headers.get("location", ""))
                if target:
                    headers["location"] = target
                if self._root and target.startswith("/") and not target.startswith("//"):
                    headers["location"] = self._root + target
            await send(message)

        try:
            await self.app(inner, receive, observed)
        except Exception as error:
            if not status:
                request_logger.error("request %s was not answered", info.id, exc_info=error)
        finally:
            self._note(inner, info, status, time.perf_counter() - started)

    def _without_root(self, scope: Scope) -> Scope:
        # A proxy may pass the sub-path on or not; from here on there is none.
        path: str = scope["path"]
        if self._root and (path == self._root or path.startswith(self._root + "/")):
            return {**scope, "path": path[len(self._root) :] or "/"}
        return scope

    def _note(self, scope: Scope, info: RequestInfo, status: int, seconds: float) -> None:
        route = getattr(scope.get("route"), "path", "")
        self._metrics.request(scope["method"], route or "unknown", status, seconds)
        if not self._log:
            return
        client = scope.get("client")
        request_logger.info(
            json.dumps(
                {
                    "time": stamp(utc_now()),
                    "id": info.id,
                    "method": scope["method"],
                    "path": _SECRET_PATH.sub("/login/link/…", scope["path"]),
                    "status": status,
                    "ms": round(seconds * 1000, 1),
                    "user": info.user,
                    "address": client[0] if client else None,
                },
                ensure_ascii=False,
            )
        )


def _own_path(target: str) -> str:
    """Make a redirect a path. All lead to this server, by an address that the caller's Host header chose."""
    parts = urlsplit(target)
    if not parts.netloc:
        return target
    return urlunsplit(("", "", "/" + parts.path.lstrip("/"), parts.query, parts.fragment))


def log_to_stderr(settings: Settings) -> None:
    """Write a line of JSON for each request to standard error, if the settings ask for it."""
    if settings.request_log:
        handler: logging.Handler = logging.StreamHandler(sys.stderr)
        handler.setFormatter(logging.Formatter("%(message)s"))
        request_logger.addHandler(handler)
        request_logger.propagate = False
        request_logger.setLevel(logging.INFO)
