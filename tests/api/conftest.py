# SPDX-License-Identifier: LGPL-2.1-or-later
"""A real HTTP server on loopback that does what a test's script says: answer, stall, drip, drop, redirect."""

from __future__ import annotations

import json
import socket
import struct
import threading
from collections import defaultdict, deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from email.message import Message
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import pytest

from silo.api.client import SiloClient
from silo.api.policy import Retries


@dataclass
class Answer:
    """One scripted answer. ``chunks`` are written one by one, each flushed; ``drop`` cuts the connection."""

    status: int = 200
    body: Any = None
    headers: dict[str, str] = field(default_factory=dict)
    chunks: Iterable[bytes] | None = None
    drop: bool = False
    before: Callable[[], object] = lambda: None

    def content(self) -> bytes:
        if self.body is None:
            return b""
        if isinstance(self.body, bytes):
            return self.body
        return self.body.encode() if isinstance(self.body, str) else json.dumps(self.body).encode()


@dataclass(frozen=True)
class Seen:
    """A request that arrived."""

    method: str
    path: str
    headers: Message
    body: bytes

    def json(self) -> Any:
        return json.loads(self.body)


class ScriptedServer(ThreadingHTTPServer):
    """Answers by script, per "METHOD path" (without query) or "*"; the last answer of a script stays."""

    daemon_threads = True
    allow_reuse_address = True

    def __init__(self, tls: Any = None) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.scripts: dict[str, deque[Answer]] = defaultdict(deque)
        self.seen: list[Seen] = []
        self.lock = threading.Lock()
        self.ending = threading.Event()
        self.scheme = "https" if tls else "http"
        if tls:
            self.socket = tls.wrap_socket(self.socket, server_side=True)
        self.thread = threading.Thread(target=self.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)
        self.thread.start()

    @property
    def url(self) -> str:
        return f"{self.scheme}://127.0.0.1:{self.server_address[1]}"

    def on(self, route: str, *answers: Answer | Any) -> None:
        """Script a route; what is no Answer becomes the body of a 200."""
        self.scripts[route].extend(a if isinstance(a, Answer) else Answer(body=a) for a in answers)

    def next_answer(self, route: str) -> Answer:
        with self.lock:
            script = self.scripts.get(route) or self.scripts.get("*")
            if not script:
                return Answer(404, {"error": "not_found", "message": f"nothing is scripted for {route}"})
            return script.popleft() if len(script) > 1 else script[0]

    def paths(self, method: str = "") -> list[str]:
        """The requests so far, as "METHOD path?query"."""
        return [f"{s.method} {s.path}" for s in self.seen if method in ("", s.method)]

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A client that went away is part of many a test."""

    def end(self) -> None:
        self.ending.set()
        self.shutdown()
        self.server_close()
        self.thread.join()


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server: ScriptedServer

    def log_message(self, *_: object) -> None:
        return None

    def _any(self) -> None:
        body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
        with self.server.lock:
            self.server.seen.append(Seen(self.command, self.path, self.headers, body))
        answer = self.server.next_answer(f"{self.command} {self.path.partition('?')[0]}")
        answer.before()
        if answer.drop:
            # A reset, not an orderly end: what a dying server or a pulled cable looks like.
            self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            self.connection.close()
            self.close_connection = True
            return
        self._write(answer)

    do_GET = do_POST = do_PUT = do_DELETE = _any

    def _write(self, answer: Answer) -> None:
        content = answer.content()
        self.send_response(answer.status)
        headers = {"Content-Type": "application/json"} | answer.headers
        if answer.chunks is None:
            headers.setdefault("Content-Length", str(len(content)))
        for name, value in headers.items():
            self.send_header(name, value)
        if answer.chunks is not None:
            self.send_header("Connection", "close")
            self.close_connection = True
        self.end_headers()
        self.wfile.write(content)
        for chunk in answer.chunks or ():
            self.wfile.write(chunk)
            self.wfile.flush()
        if int(headers.get("Content-Length", len(content))) > len(content):
            self.close_connection = True


@pytest.fixture
def server() -> Iterator[ScriptedServer]:
    """A scripted server."""
    running = ScriptedServer()
    yield running
    running.end()


@pytest.fixture
def other_server() -> Iterator[ScriptedServer]:
    """Another one, for redirects."""
    running = ScriptedServer()
    yield running
    running.end()


@pytest.fixture
def pauses() -> list[float]:
    """The pauses that the client made between attempts."""
    return []


@pytest.fixture
def client(server: ScriptedServer, pauses: list[float]) -> Iterator[SiloClient]:
    """A client of the scripted server that does not really pause."""
    retries = Retries(first=0.5, chance=lambda: 0.0, sleep=pauses.append)
    with SiloClient(server.url, "silo_secret", timeout=(60, 60), retries=retries) as made:
        yield made


@pytest.fixture
def answer() -> type[Answer]:
    """The class of scripted answers."""
    return Answer


@pytest.fixture
def new_server() -> Iterator[Callable[..., ScriptedServer]]:
    """Makes more servers; all end with the test."""
    made: list[ScriptedServer] = []

    def make(tls: Any = None) -> ScriptedServer:
        made.append(ScriptedServer(tls))
        return made[-1]

    yield make
    for running in made:
        running.end()
