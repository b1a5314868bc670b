# SPDX-License-Identifier: LGPL-2.1-or-later
"""The server's events: one open stream, and a live connection that looks after itself.

``EventListener`` keeps one stream open from a thread of its own: it begins again after every loss, with
growing pauses and a little chance (many clients must not return in one moment), resumes where it stopped
(``Last-Event-ID``), and says how it is doing. It only calls back; it knows no Qt and touches no document.
"""

from __future__ import annotations

import importlib.util
import logging
import math
import random
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, closing, nullcontext
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, Protocol, TypeVar

import requests

from silo.api.foreign import Where, translated
from silo.api.pause import Pause
from silo.api.policy import Backoff, ErrorScope, judge, pause_after, told_wait
from silo.api.replies import WebPageError, error_of
from silo.api.sse import HEARTBEAT, RESET, STATE, ServerEvent, SseParser
from silo.api.transport import MAX_ERROR, ApiCall, Transport, read_some
from silo.api.wire import ServerState
from silo.bom.errors import (
    AuthError,
    ConfigError,
    PackageError,
    RejectedError,
    RouteMissingError,
    ServerFaultError,
    SiloError,
)
from silo.bom.message import message
from silo.bom.numbers import whole_number

log = logging.getLogger("silo.api")


SILENCE = 90.0
"""Seconds without a byte after which a stream counts as dead: three heartbeats of the server."""


def open_stream(transport: Transport, last_event_id: str | None, silence: float) -> HttpEventStream:
    """Ask for the events after ``last_event_id``; raises as every request does, and PackageError."""
    if importlib.util.find_spec("sseclient") is None:
        raise PackageError(
            message("live events need the Python package sseclient-py, which is not installed")
        )
    headers = {"Accept": "text/event-stream", "Cache-Control": "no-cache", "Accept-Encoding": "identity"}
    if last_event_id:
        headers["Last-Event-ID"] = last_event_id
    call = ApiCall(
        "GET", transport.address.api("events"), message("its events"), headers=headers, endless=True
    )
    response = transport.open(call, read_timeout=silence)
    where = Where(transport.address.host, message("its events"), transport.timeouts.connect, silence)
    kind = response.headers.get("Content-Type", "")
    if response.status_code != 200 or "text/event-stream" not in kind.lower():
        with closing(response):
            reply = transport.reply(response, replace(call, max_bytes=MAX_ERROR, endless=False))
        if not reply.ok:
            raise error_of(reply)
        raise ServerFaultError(
            message("{asked} answered no event stream; check that it is a Silo server", asked=where.asked)
        )
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
        """Return the id from which to resume: that of the last event, or of a mark that the server sent
        alone.
        """
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
        raw: Any = self._response.raw
        try:
            if hasattr(raw, "shutdown"):  # urllib3 2.3
                raw.shutdown()
            else:
                raw._fp.fp.raw._sock.shutdown(socket.SHUT_RDWR)
        except (AttributeError, ValueError, RuntimeError, OSError):
            return  # It ended by itself meanwhile.


class Connection(StrEnum):
    """How the connection is."""

    CONNECTING = "connecting"  # on the way
    ONLINE = "online"  # events come in
    READ_ONLY = "read-only"  # events come in, the server takes no changes now
    DEGRADED = "degraded"  # events come in, a part of the server fails
    OFFLINE = "offline"  # no connection; it is tried again
    REFUSED = "refused"  # the token is not accepted; tried again rarely, or when a user acts
    UNSUPPORTED = "unsupported"  # the server has no events; tried again rarely, it may be updated
    NO_READER = "no-reader"  # a Python package is missing; tried again rarely, it may be installed
    STOPPED = "stopped"  # by stop()


SELDOM = 300.0
"""Seconds between two attempts at a server that does not know events."""

_MODES = {"read-only": Connection.READ_ONLY, "degraded": Connection.DEGRADED}


@dataclass(frozen=True)
class ConnectionState:
    """A change of the connection: what, why in plain words, and in how many seconds it is tried again."""

    kind: Connection
    message: str = ""
    retry_in: float | None = None

    def __str__(self) -> str:
        again = (
            message("; next try in {retry_in} s", retry_in=f"{self.retry_in:.0f}")
            if self.retry_in is not None
            else ""
        )
        return (
            message("{kind}: {message}{again}", kind=self.kind, message=self.message, again=again)
            if self.message
            else str(self.kind)
        )


@dataclass
class _Heard:
    anything: bool = False


_Told = TypeVar("_Told")


def _number(marker: str | None) -> int:
    # Servers count; if one does not, its markers have no order and none is "before" another.
    number = whole_number(marker or "", 29)
    return -1 if number is None else number


class EventStream(Protocol):
    """One open stream of events. ``close`` may be called from another thread and ends the iteration."""

    @property
    def last_event_id(self) -> str | None: ...

    def __iter__(self) -> Iterator[ServerEvent]: ...

    def close(self) -> None: ...


class EventSource(Protocol):
    """What a listener needs of a Silo."""

    def open_events(self, last_event_id: str | None = None) -> EventStream: ...

    def ready(self) -> ServerState: ...


def _kind(pause: Pause) -> Connection:
    """Return the state that the connection has during a pause."""
    return {AuthError.code: Connection.REFUSED, ConfigError.code: Connection.REFUSED}.get(
        pause.code, Connection.OFFLINE
    )


class Pauses:
    """Where the pause of a server is kept: here, if no other part asks the server."""

    _pause: Pause | None = None

    def clock(self) -> float:
        return time.time()

    def get(self) -> Pause | None:
        return self._pause

    def set(self, pause: Pause | None) -> None:
        self._pause = pause


class EventListener:
    """Calls ``on_event`` for each event but heartbeats, ``on_state`` for each change of the connection.

    api
        anything with ``open_events`` and ``ready``: a :class:`silo.api.client.SiloClient`, a ``FakeSilo``.
    last_event_id
        where to begin; None means with what is new.
    wait
        ``wait(event, seconds)`` sleeps until the event is set; for tests.
    pauses
        where the pause of this server is kept; shared with all others that ask it.
    around
        a context for all that the listener's thread does but waiting for the server's next event.

    Both callbacks run in the listener's thread, one at a time, none after :meth:`stop` has returned. An error
    in a callback is logged and costs only that call. Where events may have been missed (the server lost its
    log or counts again), an event of type ``reset`` comes first: read again what is shown.
    """

    def __init__(
        self,
        api: EventSource,
        on_event: Callable[[ServerEvent], object],
        on_state: Callable[[ConnectionState], object] = lambda state: None,
        *,
        last_event_id: str | None = None,
        backoff: Backoff | None = None,
        chance: Callable[[], float] = random.random,
        wait: Callable[[threading.Event, float], object] = threading.Event.wait,
        around: Callable[[], AbstractContextManager[object]] = nullcontext,
        pauses: Pauses | None = None,
    ) -> None:
        self._api, self._on_event, self._on_state = api, on_event, on_state
        self._backoff, self._chance, self._wait = backoff or Backoff(), chance, wait
        self._around, self._pauses = around, pauses or Pauses()
        self._last_id = last_event_id
        self._stop, self._wake = threading.Event(), threading.Event()
        self._stream: EventStream | None = None
        self._lock = threading.Lock()  # guards _stream
        self._calling = threading.RLock()  # held during a callback, so that stop() can wait for it
        self._thread: threading.Thread | None = None
        self.state = ConnectionState(Connection.STOPPED)

    @property
    def last_event_id(self) -> str | None:
        """Return the id from which the next connection resumes."""
        return self._last_id

    def start(self) -> None:
        """Start listening; also after :meth:`stop`. Does nothing while it runs."""
        if self._thread is not None and self._thread.is_alive() and not self._stop.is_set():
            return
        # A thread that is about to end keeps the old flags, and can no longer call anybody.
        flags = self._stop, self._wake = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, args=flags, name="silo-events", daemon=True)
        self._thread.start()

    def retry_now(self) -> None:
        """End the current pause: the network is back, or a user pressed the button."""
        self._wake.set()

    def stop(self, timeout: float = 2.0) -> None:
        """Stop listening. Returns within ``timeout`` seconds even if a connection hangs; no callback comes
        after.
        """
        self._stop.set()
        self._wake.set()
        with self._lock:
            stream = self._stream
        if stream is not None:
            stream.close()
        thread = self._thread
        if thread is not None and thread is not threading.current_thread():
            thread.join(timeout)
            # Wait for a callback that still runs, but only so long: it may be waiting for us.
            if self._calling.acquire(timeout=timeout):
                self._calling.release()
        self.state = ConnectionState(Connection.STOPPED)

    def _run(self, stop: threading.Event, wake: threading.Event) -> None:
        failures, waited = 0, None
        while not stop.is_set():
            pause, now = self._pauses.get(), self._pauses.clock()
            if pause is not None and pause != waited and pause.left(now):
                waited = pause  # another program that asks this server noted it
                self._rest(stop, wake, _kind(pause), pause.reason, pause.left(now))
                continue
            self._tell(stop, ConnectionState(Connection.CONNECTING))
            heard, kind, answer = _Heard(), Connection.OFFLINE, None
            try:
                self._listen(stop, heard)
                reason: str = message("the server ended the connection")
            except RejectedError as error:
                # The mark is another server's; without it there is a gap, which a reset reports.
                reason = str(error)
                self._forget_mark(stop)
            except PackageError as error:
                self._rest(stop, wake, Connection.NO_READER, str(error), SELDOM)
                continue
            except SiloError as error:
                if stop.is_set():
                    return
                if judge(error).scope is ErrorScope.ALL:
                    now, reached = self._pauses.clock(), 0 if heard.anything else failures
                    before = self._pauses.get()
                    waited = pause_after(error, before, now, self._backoff, self._chance(), reached)
                    failures = waited.failures
                    self._pauses.set(waited)
                    self._rest(stop, wake, _kind(waited), waited.reason, round(waited.until - now, 3))
                    continue
                reason, answer = str(error), told_wait(error)
                # A proxy answers with its own page while the server behind it starts.
                if isinstance(error, RouteMissingError) and not isinstance(error, WebPageError):
                    kind, answer = Connection.UNSUPPORTED, SELDOM
                elif isinstance(error, AuthError):
                    kind, answer = Connection.REFUSED, SELDOM
            # Only received events count as success: a server that greets us and then drops us is not up.
            failures = 1 if heard.anything else failures + 1
            self._rest(stop, wake, kind, reason, self._backoff.pause(failures, self._chance(), answer))

    def _rest(
        self, stop: threading.Event, wake: threading.Event, kind: Connection, reason: str, seconds: float
    ) -> None:
        if stop.is_set():
            return
        endless = math.isinf(seconds)
        self._tell(stop, ConnectionState(kind, reason, None if endless else seconds))
        self._wait(wake, threading.TIMEOUT_MAX if endless else seconds)
        if not stop.is_set():
            wake.clear()

    def _listen(self, stop: threading.Event, heard: _Heard) -> None:
        with self._around():
            stream = self._api.open_events(self._last_id)
        with self._lock:
            self._stream = stream
        try:
            if stop.is_set():
                return
            with self._around():
                self._tell(stop, ConnectionState(self._mode()))
            for event in stream:
                with self._around():
                    if not heard.anything:
                        self._go_well()
                    heard.anything = True
                    self._take(stop, event)
                if stop.is_set():
                    return
        finally:
            stream.close()
            with self._lock:
                self._stream = None
            self._adopt(stop, stream.last_event_id)

    def _go_well(self) -> None:
        """End the pause when the server answers, unless the server named its end or takes no changes."""
        pause = self._pauses.get()
        if pause is not None and not pause.told and self.state.kind is not Connection.READ_ONLY:
            self._pauses.set(None)

    def _mode(self) -> Connection:
        try:
            return _MODES.get(self._api.ready().mode, Connection.ONLINE)
        except SiloError:
            # The stream is open, so the server is there.
            return Connection.ONLINE

    def _take(self, stop: threading.Event, event: ServerEvent) -> None:
        if event.type == RESET:
            self._last_id = event.id or self._last_id
        elif event.id is not None:
            if event.id == self._last_id:
                return  # A replay that begins one too early.
            self._adopt(stop, event.id)
        if event.type == STATE and event.mode is not None:
            self._tell(stop, ConnectionState(_MODES.get(event.mode, Connection.ONLINE)))
            self._go_well()
        if event.type != HEARTBEAT:
            self._call(stop, self._on_event, event)

    def _adopt(self, stop: threading.Event, marker: str | None) -> None:
        if marker is None:
            return
        before, self._last_id = self._last_id, marker
        if _number(marker) < _number(before):
            # The server counts again, so what happened around its restart was never replayed.
            again = ServerEvent(marker, RESET, {"reason": message("the server counts again")})
            self._call(stop, self._on_event, again)

    def _forget_mark(self, stop: threading.Event) -> None:
        if self._last_id is not None:
            self._last_id = None
            gap = ServerEvent(None, RESET, {"reason": message("the server does not know where we stopped")})
            self._call(stop, self._on_event, gap)

    def _tell(self, stop: threading.Event, state: ConnectionState) -> None:
        if not stop.is_set():
            self.state = state
            self._call(stop, self._on_state, state)

    def _call(self, stop: threading.Event, callback: Callable[[_Told], object], value: _Told) -> None:
        with self._calling:
            if stop.is_set():
                return
            try:
                callback(value)
            except Exception:
                # The connection must go on, whatever a callback does.
                log.exception("an error in the receiver of server events; the connection stays open")
