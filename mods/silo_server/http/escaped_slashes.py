# SPDX-License-Identifier: LGPL-2.1-or-later
"""A part number with a slash, from programs that quote it as ``%2F``: its segment stays one segment.

A web server decodes ``%2F`` before it looks for the route. The segments that hold one are written with the
escapes of :mod:`silo.bom.items.part_address`, which routes decode.
"""

from __future__ import annotations

import re
from urllib.parse import unquote

from starlette.types import ASGIApp, Receive, Scope, Send

from silo.bom.items.part_address import part_segment

_SLASH = re.compile("%2f", re.IGNORECASE)


class EscapedSlashes:
    """Keeps segments whole that hold an escaped slash."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        raw = scope.get("raw_path") if scope["type"] == "http" else None
        if raw and b"%2f" in raw.lower():
            scope = {**scope, "path": _whole_segments(raw.decode("latin-1"), scope["path"])}
        await self.app(scope, receive, send)


def _whole_segments(raw: str, path: str) -> str:
    """Return the path with its escaped slashes. ``path`` may have lost the sub-path of the server."""
    before = unquote(raw).removesuffix(path)
    segments = (
        part_segment(unquote(segment)) if _SLASH.search(segment) else segment for segment in raw.split("/")
    )
    return unquote("/".join(segments)).removeprefix(before)
