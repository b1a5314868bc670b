# SPDX-License-Identifier: LGPL-2.1-or-later
"""Server-sent events: bytes in, typed events out. No network and no threads in here.

A stream may be cut at any byte, may mix line ends, and must not hand over the half event that a dropped
connection leaves. So the stream is cut into whole blocks of bounded size here, and sseclient-py reads the
fields of a block. The mark of an ``id`` without data is read here too: sseclient-py gives no event for it.

Both dialects come out as one: the spec's ``bom_merge`` and the real Silo's ``bom.merged`` are ``bom_merge``.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from typing import Any

from pydantic import ValidationError

from silo.api.wire import MergeEvent
from silo.bom.errors import ServerFaultError
from silo.bom.message import message

MERGE = "bom_merge"
HEARTBEAT = "heartbeat"
STATE = "server.state"
RESET = "reset"

_SAME = {"bom.merged": MERGE, "bom_merged": MERGE, "bom.merge": MERGE}
_ID = re.compile(rb"^id: ?(.*)$", re.MULTILINE)
_MARK = b"\xef\xbb\xbf"


@dataclass(frozen=True)
class ServerEvent:
    """One event.

    id
        for ``Last-Event-ID``; None where the server gave none.
    type
        canonical: ``bom_merge``, ``item.created``, ``item.updated``, ``item.deleted``, ``revision.created``,
        ``server.state``, ``heartbeat``, ``reset`` (what was seen before may be stale: read again), or the
        server's own word.
    data
        the JSON as it came; the text where it is none.
    merge
        the typed content of a ``bom_merge``; None where that cannot be read (``data`` still has it).
    name
        the event as the server calls it: ``bom.merged`` and ``bom_merge`` are one ``type``.
    """

    id: str | None
    type: str
    data: Any = None
    merge: MergeEvent | None = field(default=None, compare=False)
    name: str = field(default="", compare=False)

    @property
    def item(self) -> str | None:
        """Return the part number that the event is about, in either dialect."""
        if self.merge is not None:
            return self.merge.item
        number = self.data.get("part_number", self.data.get("item")) if isinstance(self.data, dict) else None
        return number if isinstance(number, str) else None

    @property
    def mode(self) -> str | None:
        """Return the mode in a ``server.state`` event."""
        mode = self.data.get("mode") if self.type == STATE and isinstance(self.data, dict) else None
        return mode if isinstance(mode, str) else None


class SseParser:
    """A stream of bytes, fed in pieces of any size, as events.

    Raises :class:`ServerFaultError` for a single event above ``max_bytes``: a stream without an end of line
    must not fill the memory.
    """

    def __init__(self, max_bytes: int = 16 << 20) -> None:
        self._max = max_bytes
        self._start: bytes | None = b""
        self._after_cr = False
        self._buffer = bytearray()
        self.last_event_id: str | None = None

    def feed(self, chunk: bytes) -> list[ServerEvent]:
        """Take a piece of the stream, and return the events that it completes."""
        searched = max(0, len(self._buffer) - 1)
        self._buffer += self._normal(self._without_mark(chunk))
        events: list[ServerEvent] = []
        while (end := self._buffer.find(b"\n\n", searched)) >= 0:
            block = bytes(self._buffer[:end])
            del self._buffer[: end + 2]
            searched = 0
            self.last_event_id = _marker(block) or self.last_event_id
            event = read_block(block)
            if event is not None:
                events.append(event)
        if len(self._buffer) > self._max:
            raise ServerFaultError(
                message(
                    "the event stream sent one event above {max} MB, which is refused",
                    max=f"{self._max / 1000000.0:.0f}",
                )
            )
        return events

    def _without_mark(self, chunk: bytes) -> bytes:
        # A byte order mark may lead the stream, and it may arrive in three pieces.
        if self._start is None:
            return chunk
        self._start += chunk
        if len(self._start) < len(_MARK) and _MARK.startswith(self._start):
            return b""
        chunk, self._start = self._start.removeprefix(_MARK), None
        return chunk

    def _normal(self, chunk: bytes) -> bytes:
        # A CR ends its line at once; a LF directly after it belongs to it, even if it is in the next piece.
        if not chunk:
            return b""  # An empty piece says nothing of what follows the CR.
        if self._after_cr:
            chunk = chunk.removeprefix(b"\n")
        self._after_cr = chunk.endswith(b"\r")
        return chunk.replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def read_block(block: bytes) -> ServerEvent | None:
    """Read the event in one block of lines; None for a comment or a block without data."""
    from sseclient import SSEClient  # late: the add-on works without live events

    # Another encoding costs letters, not the stream.
    whole = block.decode("utf-8", "replace").encode() + b"\n\n"
    event = next(SSEClient(iter((whole,))).events(), None)
    if event is None:
        return None
    data, name = _json(event.data), event.event
    if name == "message" and isinstance(data, dict) and isinstance(data.get("type"), str):
        name = data["type"]
    kind = _SAME.get(name, name)
    return ServerEvent(_marker(block), kind, data, _merge(data) if kind == MERGE else None, name)


def _marker(block: bytes) -> str | None:
    # A server may set the id without an event, to say where to resume.
    matches = _ID.findall(block)
    return matches[-1].decode("utf-8", "replace") or None if matches and b"\0" not in matches[-1] else None


def _json(text: str) -> Any:
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return text


def _merge(data: Any) -> MergeEvent | None:
    if not isinstance(data, dict):
        return None
    try:
        return MergeEvent.model_validate({**data, "type": MERGE})
    except ValidationError:
        return None
