# SPDX-License-Identifier: LGPL-2.1-or-later
"""One open event stream over HTTP."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from typing import Any

import requests

from silo.api.failures import Where, translated
from silo.api.replies import error_of
from silo.api.sse import ServerEvent, SseParser
from silo.api.transport import MAX_ERROR, Call, Transport, read_some
from silo.bom.errors import ServerFaultError, SiloError

SILENCE = 90.0
"""Seconds without a byte after which a stream counts as dead: three heartbeats of the server."""


def open_stream(transport: Transport, last_event_id: str | None, silence: float) -> HttpEventStream:
    """Ask for the events after ``last_event_id``; raises as every request does."""
    headers = {"Accept": "text/event-stream", "Cache-Control": "no-cache", "Accept-Encoding": "identity"}
    if last_event_id:
        headers["Last-Event-ID"] = last_event_id
    call = Call("GET", transport.address.api("events"), "its events", headers=headers, endless=True)
    response = transport.open(call, read_timeout=silence)
    where = Where(transport.address.host, "its events", transport.timeouts.connect, silence)
    kind = response.headers.get("Content-Type", "")
    if response.status_code != 200 or "text/event-stream" not in kind.lower():
        with closing(response):
            reply = transport.reply(response, replace(call, max_bytes=MAX_ERROR, endless=False))
        if not reply.ok:
            raise error_of(reply)
        raise ServerFaultError(f"{where.asked} answered no event stream; check that it is a Silo server")
    return HttpEventStream(response, where)


class HttpEventStream:
    """The events of one connection, until the server ends it, it dies, or :meth:`close` is called.

    Iterating raises :class:`silo.bom.errors.UnreachableError` when the stream is silent for too long.
    """

    def __init__(self, response: requests.Response, where: Where) -> None:
        self._response, self._where = response, where
        self._lock = threading.Lock()
        self._closed = self._reading = False
        self._parser = SseParser()

    @property
    def last_event_id(self) -> str | None:
        """The id to resume from: of the last event, or of a bare mark that the server set."""
        return self._parser.last_event_id

    def __iter__(self) -> Iterator[ServerEvent]:
        with self._lock:
            if self._closed:
                return
            self._reading = True
        try:
            yield from self._events()
        except SiloError:
            # After close() the connection is expected to break.
            if not self._closed:
                raise
        finally:
            self._closed = True
            self._response.close()

    def _events(self) -> Iterator[ServerEvent]:
        while not self._closed:
            with translated(self._where):
                chunk = read_some(self._response)
            if not chunk:
                return
            yield from self._parser.feed(chunk)

    def close(self) -> None:
        """End the stream, from any thread; a reader that waits for bytes wakes up."""
        with self._lock:
            self._closed = True
            reading = self._reading
        if not reading:
            self._response.close()
            return
        # Closing the response here would wait for the reader; shutting the socket down wakes it.
        try:
            _shut_down(self._response)
        except (AttributeError, ValueError, RuntimeError, OSError):
            return  # It ended by itself meanwhile.


def _shut_down(response: requests.Response) -> None:
    raw: Any = response.raw
    if hasattr(raw, "shutdown"):  # urllib3 2.3
        raw.shutdown()
    else:
        raw._fp.fp.raw._sock.shutdown(socket.SHUT_RDWR)
