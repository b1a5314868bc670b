# SPDX-License-Identifier: LGPL-2.1-or-later
"""The live connection: over real HTTP, through losses, restarts and refusals."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from silo.api.client import SiloClient
from silo.api.events import SELDOM, Connection, ConnectionState, EventListener, Pauses
from silo.api.pause import Pause
from silo.api.policy import REFUSED_PAUSES, Backoff
from silo.api.sse import ServerEvent
from silo.bom.errors import AuthError, PackageError, ServerFaultError, UnreachableError
from silo.testing import FakeSilo

EVENTS = "GET /api/events"
SSE = {"Content-Type": "text/event-stream; charset=utf-8"}


def frame(marker: int | str | None, name: str = "item.updated", data: str = '{"part_number": "A"}') -> bytes:
    head = f"id: {marker}\n" if marker is not None else ""
    return f"{head}event: {name}\ndata: {data}\n\n".encode()


class Watch:
    """A listener with everything that it said, in one queue; pauses end at once and are noted."""

    def __init__(self, api: Any, **options: Any) -> None:
        self.said: queue.Queue[ServerEvent | ConnectionState] = queue.Queue()
        self.pauses: list[float] = []
        options.setdefault("chance", lambda: 0.0)
        options.setdefault("wait", self._wait)
        self.listener = EventListener(api, self.said.put, self.said.put, **options)

    def _wait(self, wake: threading.Event, seconds: float) -> None:
        self.pauses.append(seconds)

    def __enter__(self) -> Watch:
        self.listener.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.listener.stop()

    def event(self) -> ServerEvent:
        """The next event."""
        while True:
            said = self.said.get(timeout=60)
            if isinstance(said, ServerEvent):
                return said

    def state(self, kind: Connection) -> ConnectionState:
        """The next change to this state."""
        while True:
            said = self.said.get(timeout=60)
            if isinstance(said, ConnectionState) and said.kind is kind:
                return said


@pytest.fixture
def stream(server: Any, answer: Any) -> Callable[..., Any]:
    """Makes scripted event streams; ``stay`` keeps one open until the server ends."""
    server.on("GET /ready", {"mode": "normal"})

    def make(*frames: bytes, stay: bool = False) -> Any:
        def chunks() -> Iterator[bytes]:
            yield b": hello\n\n"
            yield from frames
            if stay:
                server.ending.wait()

        return answer(200, headers=SSE, chunks=chunks())

    return make


def test_events_come_and_the_connection_is_reported(
    server: Any, client: SiloClient, stream: Callable[..., Any]
) -> None:
    """Connecting, online, events; heartbeats are not passed on."""
    server.on(EVENTS, stream(frame(1), frame(None, "heartbeat", "{}"), frame(2, "bom.merged"), stay=True))
    with Watch(client) as watch:
        watch.state(Connection.CONNECTING)
        watch.state(Connection.ONLINE)
        assert [(e.id, e.type) for e in (watch.event(), watch.event())] == [
            ("1", "item.updated"),
            ("2", "bom_merge"),
        ]
        assert watch.listener.last_event_id == "2"
    sent = server.seen[0].headers
    assert (sent["Accept"], sent["Authorization"], sent["Last-Event-ID"]) == (
        "text/event-stream",
        "Bearer silo_secret",
        None,
    )


def test_after_a_loss_it_continues_where_it_stopped(
    server: Any, client: SiloClient, stream: Callable[..., Any], answer: Any
) -> None:
    """Cut off, refused twice, then replayed from the mark: nothing lost, nothing twice."""
    server.on(
        EVENTS,
        stream(frame(7)),
        answer(drop=True),
        answer(502),
        stream(frame(7), frame(8), frame(9), stay=True),
    )
    with Watch(client) as watch:
        assert [watch.event().id for _ in range(3)] == ["7", "8", "9"]
    asked = [seen.headers["Last-Event-ID"] for seen in server.seen if seen.path == "/api/events"]
    assert asked == [None, "7", "7", "7"]
    assert watch.pauses == [1.0, 2.0, 4.0]


def test_a_server_that_counts_anew_gives_a_reset_first(
    server: Any, client: SiloClient, stream: Callable[..., Any]
) -> None:
    """What happened around its restart was never replayed: read again, then continue from the new count."""
    server.on(EVENTS, stream(frame(500)), stream(frame(3), frame(4)), stream(stay=True))
    with Watch(client) as watch:
        said = [watch.event() for _ in range(4)]
        assert [(e.id, e.type) for e in said] == [
            ("500", "item.updated"),
            ("3", "reset"),
            ("3", "item.updated"),
            ("4", "item.updated"),
        ]
        watch.state(Connection.OFFLINE)
        watch.state(Connection.ONLINE)
    assert server.seen[-2].headers["Last-Event-ID"] == "4"


def test_the_servers_own_reset_moves_the_mark_back(
    server: Any, client: SiloClient, stream: Callable[..., Any]
) -> None:
    """Away for longer than its log goes back; one reset, not two."""
    server.on(EVENTS, stream(frame(500)), stream(frame(2, "reset", "{}"), frame(3), stay=True))
    with Watch(client) as watch:
        assert [(e.id, e.type) for e in (watch.event(), watch.event(), watch.event())] == [
            ("500", "item.updated"),
            ("2", "reset"),
            ("3", "item.updated"),
        ]


def test_a_mark_without_an_event_counts(server: Any, client: SiloClient, stream: Callable[..., Any]) -> None:
    """The server says where we are before anything happens, so that a loss then loses nothing."""
    server.on(EVENTS, stream(b"id: 41\n\n"), stream(frame(42), stay=True))
    with Watch(client) as watch:
        assert watch.event().id == "42"
    assert server.seen[2].headers["Last-Event-ID"] == "41"


def test_a_mark_that_the_server_refuses_is_given_up(
    server: Any, client: SiloClient, stream: Callable[..., Any], answer: Any
) -> None:
    """Another server's id; the gap is reported."""
    server.on(EVENTS, answer(400, {"error": "no number"}), stream(frame(1), stay=True))
    with Watch(client, last_event_id="abc") as watch:
        assert [watch.event().type, watch.event().id] == ["reset", "1"]
    assert server.seen[1].headers["Last-Event-ID"] is None


@pytest.mark.parametrize(
    ("given", "kind", "again", "word"),
    [
        ((401, {"error": "x"}), Connection.REFUSED, REFUSED_PAUSES.first, "token"),
        ((403, {"error": "x"}), Connection.REFUSED, SELDOM, "token"),
        # A proxy with single sign-on.
        ((302, "", {"Location": "/login"}), Connection.REFUSED, REFUSED_PAUSES.first, "login"),
        (
            (404, "404 page not found"),
            Connection.UNSUPPORTED,
            SELDOM,
            "",
        ),  # may be updated
        ((404, "<html>", {"Content-Type": "text/html"}), Connection.OFFLINE, 1.0, ""),  # the server restarts
        ((503, {}, {"Retry-After": "77"}), Connection.OFFLINE, 77.0, "in 77 s"),
    ],
)
def test_each_refusal_has_its_state_and_its_pause(
    server: Any,
    client: SiloClient,
    stream: Callable[..., Any],
    answer: Any,
    given: Any,
    kind: Connection,
    again: float | None,
    word: str,
) -> None:
    """The thread lives on and wakes where a person acts: a new token, or *Retry all*."""
    server.on(EVENTS, answer(*given), stream(frame(1), stay=True))
    with Watch(client, wait=lambda wake, _seconds: wake.wait(60)) as watch:
        state = watch.state(kind)
        assert (state.retry_in, word in state.message) == (again, True)
        assert len(server.seen) == 1
        watch.listener.retry_now()
        assert watch.event().id == "1"


class Shared(Pauses):
    """The pause of a server, as the queue and the live connection share it."""

    def __init__(self, pause: Pause | None = None) -> None:
        self.pause, self.now = pause, 1000.0

    def clock(self) -> float:
        return self.now

    def get(self) -> Pause | None:
        return self.pause

    def set(self, pause: Pause | None) -> None:
        self.pause = pause


def test_the_pause_of_the_queue_is_that_of_the_connection(
    server: Any, client: SiloClient, stream: Callable[..., Any], answer: Any
) -> None:
    """Noted by either, kept by both; ended by an event, unless the server named the time."""
    server.on(EVENTS, answer(503, {"error": "busy"}, {"Retry-After": "40"}), stream(frame(1), stay=True))
    pauses = Shared(Pause(1600.0, "the queue was put off", "busy", 3, told=True))
    asked: list[int] = []

    def wait(_wake: object, seconds: float) -> None:
        pauses.now += seconds
        asked.append(len(server.seen))

    with Watch(client, pauses=pauses, wait=wait) as watch:
        said = watch.state(Connection.OFFLINE)
        assert (said.message, said.retry_in) == ("the queue was put off", 600.0)
        assert watch.state(Connection.OFFLINE).retry_in == 40.0
        watch.event()
    assert asked == [0, 1]
    assert pauses.pause is not None
    assert (pauses.pause.until, pauses.pause.failures, pauses.pause.told) == (1640.0, 4, True)
    server.on(EVENTS, answer(503, {"error": "unavailable"}), stream(frame(2), stay=True))
    pauses.pause = None
    with Watch(client, pauses=pauses) as watch:
        watch.state(Connection.OFFLINE)
        watch.event()
        assert pauses.pause is None


def test_events_do_not_end_the_pause_of_a_server_that_takes_no_changes(
    server: Any, client: SiloClient, stream: Callable[..., Any]
) -> None:
    """It is read-only still: what the queue sends would be refused again."""
    server.scripts["GET /ready"].clear()
    server.on("GET /ready", {"mode": "read-only"})
    server.on(EVENTS, stream(frame(1), frame(2), stay=True))
    pauses = Shared(Pause(1600.0, "read-only", "read_only", 1, told=False))
    with Watch(client, pauses=pauses, wait=lambda _wake, _seconds: None) as watch:
        watch.state(Connection.READ_ONLY)
        watch.event()
        watch.event()
        assert pauses.pause is not None


def test_a_stream_that_falls_silent_is_dead(server: Any, stream: Callable[..., Any]) -> None:
    """No byte for the time of three heartbeats: the line is cut somewhere without anybody having said so."""
    server.on(EVENTS, stream(frame(1), stay=True))
    with SiloClient(server.url, silence=0.5) as client, Watch(client) as watch:
        watch.event()
        assert "silent for 0.5 s" in watch.state(Connection.OFFLINE).message


def test_modes_are_reported_on_connecting_and_when_they_change(
    server: Any, client: SiloClient, stream: Callable[..., Any]
) -> None:
    """/ready first, server.state then."""
    server.scripts["GET /ready"].clear()
    server.on("GET /ready", {"mode": "degraded"})
    states = [
        frame(n, "server.state", f'{{"mode": "{m}"}}') for n, m in enumerate(("read-only", "normal"), 1)
    ]
    server.on(EVENTS, stream(*states, stay=True))
    with Watch(client) as watch:
        for kind in (Connection.CONNECTING, Connection.DEGRADED, Connection.READ_ONLY, Connection.ONLINE):
            watch.state(kind)


def test_a_web_page_is_no_event_stream(server: Any, client: SiloClient, answer: Any) -> None:
    """A captive portal must not look like a silent server."""
    server.on(EVENTS, answer(200, "<html>hi</html>", {"Content-Type": "text/html"}))
    with pytest.raises(ServerFaultError, match="no event stream"):
        client.open_events()


def test_stop_wakes_a_waiting_stream_and_nothing_comes_after_it(
    server: Any, client: SiloClient, stream: Callable[..., Any]
) -> None:
    """The reader sits in the network; stop() ends it and its thread."""
    server.on(EVENTS, stream(frame(1), stay=True))
    with Watch(client) as watch:
        watch.event()
        thread = watch.listener._thread
        watch.listener.stop(timeout=60)
        assert thread is not None
        assert not thread.is_alive()
        assert watch.listener.state.kind is Connection.STOPPED
        assert watch.said.empty()


def test_a_person_and_stop_end_a_pause(client: SiloClient, server: Any, answer: Any) -> None:
    """A pause of ten minutes is not waited for."""
    server.on(EVENTS, answer(502))
    with Watch(client, backoff=Backoff(first=600, longest=600), wait=threading.Event.wait) as watch:
        watch.state(Connection.OFFLINE)
        watch.listener.retry_now()
        assert watch.state(Connection.OFFLINE).retry_in is not None
        watch.listener.stop(timeout=60)
        assert not watch.listener._thread.is_alive()  # type: ignore[union-attr]


def test_stop_from_within_a_callback_does_not_lock_up() -> None:
    """A pane that closes itself on an event."""
    silo, done = FakeSilo(), threading.Event()

    def on_event(event: ServerEvent) -> None:
        listener.stop()
        done.set()

    ready = threading.Event()
    listener = EventListener(silo, on_event, lambda s: ready.set() if s.kind is Connection.ONLINE else None)
    listener.start()
    assert ready.wait(60)
    silo.create_item("kindred-rd", "F01", "Bolt")
    silo.create_item("kindred-rd", "F01", "Nut")
    assert done.wait(60)


def test_an_error_in_a_callback_costs_only_that_call(caplog: pytest.LogCaptureFixture) -> None:
    """It is logged; the next event comes."""
    silo, seen, ready = FakeSilo(), queue.Queue[ServerEvent](), threading.Event()

    def on_event(event: ServerEvent) -> None:
        seen.put(event)
        if event.id == "1":
            raise RuntimeError("a mistake in a pane")

    listener = EventListener(silo, on_event, lambda s: ready.set() if s.kind is Connection.ONLINE else None)
    listener.start()
    assert ready.wait(60)
    for name in ("Bolt", "Nut"):
        silo.create_item("kindred-rd", "F01", name)
    assert [seen.get(timeout=60).id, seen.get(timeout=60).id] == ["1", "2"]
    listener.stop()
    assert "a mistake in a pane" in caplog.text


def test_starting_twice_is_one_connection(
    server: Any, client: SiloClient, stream: Callable[..., Any]
) -> None:
    """start() while it runs does nothing."""
    server.on(EVENTS, stream(frame(1), stay=True))
    with Watch(client) as watch:
        watch.event()
        watch.listener.start()
    assert server.paths().count("GET /api/events") == 1


def test_a_state_reads_as_a_sentence() -> None:
    """For a terminal and a log."""
    state = ConnectionState(Connection.OFFLINE, "nothing answers at host", 4.2)
    assert str(state) == "offline: nothing answers at host; next try in 4 s"
    assert str(ConnectionState(Connection.ONLINE)) == "online"


def test_events_of_one_connection_can_be_iterated(
    server: Any, client: SiloClient, stream: Callable[..., Any], answer: Any
) -> None:
    """The simple form: until the server ends it; errors as everywhere."""
    server.on(EVENTS, stream(frame(5), frame(None, "heartbeat", "{}")), answer(401), answer(drop=True))
    assert [event.type for event in client.events("4")] == ["item.updated", "heartbeat"]
    assert server.seen[0].headers["Last-Event-ID"] == "4"
    with pytest.raises(AuthError):
        list(client.events())
    with pytest.raises(UnreachableError):
        list(client.events())


def test_what_was_received_ends_the_count_of_failures(
    server: Any, client: SiloClient, stream: Callable[..., Any], answer: Any
) -> None:
    """Pauses begin again after a connection that brought something, and grow after one that only greeted."""
    server.on(
        EVENTS,
        *(
            answer(drop=True),
            answer(drop=True),
            stream(frame(1)),
            answer(drop=True),
            stream(),
            answer(drop=True),
        ),
        stream(frame(2), stay=True),
    )
    with Watch(client) as watch:
        assert [watch.event().id for _ in range(2)] == ["1", "2"]
    assert watch.pauses == [1.0, 2.0, 1.0, 2.0, 4.0, 8.0]


def test_a_connection_that_broke_after_an_event_is_the_first_failure(
    server: Any, client: SiloClient, stream: Callable[..., Any], answer: Any
) -> None:
    """However many failed before it."""
    cut = answer(200, headers={**SSE, "Content-Length": "9999"}, chunks=[frame(1)])
    server.on(
        EVENTS, answer(drop=True), answer(drop=True), cut, answer(drop=True), stream(frame(2), stay=True)
    )
    with Watch(client) as watch:
        assert [watch.event().id for _ in range(2)] == ["1", "2"]
    assert watch.pauses == [1.0, 2.0, 1.0, 2.0]


class WithoutReader:
    """A server's client where the package that reads events is missing."""

    def open_events(self, last_event_id: str | None = None) -> Any:
        raise PackageError("live events need the Python package sseclient-py, which is not installed")


def test_a_missing_package_is_a_state_of_its_own_and_tried_again_rarely() -> None:
    """It may be installed meanwhile; the server is not at fault, so nothing else pauses."""
    with Watch(WithoutReader()) as watch:
        state = watch.state(Connection.NO_READER)
        assert watch.listener._pauses.get() is None
    assert (state.retry_in, "sseclient-py" in state.message) == (SELDOM, True)
