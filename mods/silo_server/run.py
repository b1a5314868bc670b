# SPDX-License-Identifier: LGPL-2.1-or-later
"""Run the server: in the foreground, by several worker processes, or on a thread of another program."""

from __future__ import annotations

import asyncio
import gc
import ipaddress
import multiprocessing
import multiprocessing.connection
import os
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import Any

import uvicorn
from fastapi import FastAPI
from sqlalchemy import make_url
from sqlalchemy.exc import SQLAlchemyError
from uvicorn.protocols.http.h11_impl import H11Protocol

from silo.bom.errors import ConfigError
from silo.folders import scratch_folder
from silo.platform import WORKERS_CAN_SHARE_A_SOCKET, allow_many_files, own_the_port
from silo_server.app import create_app, observed
from silo_server.bootstrap import Welcome, prepare
from silo_server.db.engine import Database
from silo_server.errors import cause_of
from silo_server.operation.metrics import SHARED
from silo_server.operation.requests import log_to_stderr
from silo_server.services.access import credentials
from silo_server.settings import Settings, settings_from_environment

START_SECONDS = 60
SHUTDOWN_SECONDS = 10


@dataclass(frozen=True, slots=True)
class RunningServer:
    """A server that runs in this process. ``login_url`` lets the first admin's browser in, once."""

    base_url: str
    token: str
    login_url: str
    settings: Settings
    app: FastAPI


@dataclass(frozen=True, slots=True)
class Greeting:
    """What a server says of itself when it starts. ``public``: other machines reach it.

    A token that was given to it is not shown whole: logs are read by many.
    """

    url: str
    token: str | None
    login_url: str | None
    database: str
    public: bool

    def lines(self) -> list[str]:
        """For people, and for scripts that look for the first address and the token."""
        lines = [
            f"Silo server: {self.url}",
            *([f"Token:       {self.token}"] if self.token else []),
            *([f"Log in:      {self.login_url}"] if self.login_url else []),
            f"Database:    {self.database}",
        ]
        if self.login_url is None:
            lines.append("There is no active admin. Start again with --reset-admin NAME to make one.")
        if self.public:
            warning = "This server can be reached from other machines. Put TLS before it (docs/server.md)."
            lines.append(warning)
        return lines


def _tell(greeting: Greeting) -> None:
    # Whoever reads the output of a pipe waits for the address, and the server never ends by itself.
    print(*greeting.lines(), sep="\n", flush=True)


class _Protocol(H11Protocol):
    """uvicorn's HTTP, which hangs up on a connection that begins no request, or half of one.

    A connection that has had an answer may be silent for uvicorn's own keep-alive time.
    """

    head_seconds = 0.0

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._late: asyncio.TimerHandle | None = None
        self._expect_a_request()

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        if self.cycle is not None and not self.cycle.response_complete:
            self._stop_expecting()
        elif self._late is None and self.timeout_keep_alive_task is None:
            self._expect_a_request()

    def connection_lost(self, exc: Exception | None) -> None:
        self._stop_expecting()
        super().connection_lost(exc)

    def _expect_a_request(self) -> None:
        self._late = self.loop.call_later(self.head_seconds, self._hang_up)

    def _stop_expecting(self) -> None:
        if self._late is not None:
            self._late.cancel()
            self._late = None

    def _hang_up(self) -> None:
        self._late = None
        if not self.transport.is_closing():
            self.transport.close()


class SiloServer(uvicorn.Server):
    """uvicorn's server, which lets its event streams go before it waits for its connections to end.

    ``on_up`` is called once it answers.
    """

    def __init__(self, config: uvicorn.Config, on_up: Callable[[], None]) -> None:
        super().__init__(config)
        self._on_up = on_up

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        self._on_up()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        app: Any = self.config.loaded_app
        while app is not None and not isinstance(app, FastAPI):
            app = getattr(app, "app", None)
        if app is not None and hasattr(app.state, "server"):
            app.state.server.hub.close()
        await super().shutdown(sockets)


def serve(
    host: str = "127.0.0.1",
    port: int = 8080,
    database_url: str | None = None,
    *,
    workers: int = 1,
    token: str | None = None,
    reset_admin: str | None = None,
    tell: Callable[[Greeting], None] = _tell,
) -> None:
    """Serve until interrupted; reports the address, a token and a login link through ``tell`` first.

    token
        the first token; ``SILO_API_TOKEN`` where None, a new one where that is not set either.
    reset_admin
        the name of the user who becomes an active admin, and is let in.
    port
        0 takes a free one.
    """
    settings = settings_from_environment(database_url=database_url)
    if workers < 1:
        raise ConfigError(f"workers: wanted at least 1, got {workers}")
    if workers > 1 and not WORKERS_CAN_SHARE_A_SOCKET:
        raise ConfigError(
            f"workers: {workers} processes cannot share one address on Windows. Serve with one "
            "(--workers 1); it answers several requests at once."
        )
    given = token or os.environ.get("SILO_API_TOKEN") or None
    sock = _bind(host, port)  # first: where the port is taken, no token is made that nobody sees
    try:
        welcome = _prepare(settings, given, reset_admin)
    except BaseException:
        sock.close()
        raise
    base_url = _base_url(host, sock.getsockname()[1])
    settings = replace(settings, public_url=settings.public_url or base_url)
    database, login_url = _without_password(settings), _login_url(settings, welcome)
    shown = welcome.token
    if shown and given:
        shown = f"{credentials.shown_prefix(given)}… (the one you gave)"
    greeting = Greeting(base_url, shown, login_url, database, not is_loopback(host))
    # uvicorn passes Ctrl-C on when it has ended in good order; to the person that is no error.
    with sock, suppress(KeyboardInterrupt):
        if workers == 1:
            _work(settings, sock, lambda: tell(greeting))
        else:
            tell(greeting)
            with scratch_folder("silo-metrics-") as shared:
                os.environ[SHARED] = shared
                _run_workers(settings, workers, sock)


@contextmanager
def running_server(
    database_url: str,
    *,
    token: str | None = None,
    host: str = "127.0.0.1",
    port: int = 0,
    files_dir: Path | None = None,
    settings: Settings | None = None,
) -> Iterator[RunningServer]:
    """A server on a background thread, for the demo and for tests; ends with the ``with`` block.

    settings
        everything else; ``database_url`` and ``files_dir`` win over it.
    """
    base = settings or Settings(database_url=database_url)
    given = replace(base, database_url=database_url, files_dir=files_dir or base.files_dir)
    sock = _bind(host, port)
    try:
        welcome = _prepare(given, token)
    except BaseException:
        sock.close()
        raise
    base_url = _base_url(host, sock.getsockname()[1])
    given = replace(given, public_url=given.public_url or base_url)
    app = create_app(given)
    up = threading.Event()
    server = SiloServer(_config(app, given), up.set)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [sock]}, name="silo-server", daemon=True)
    thread.start()
    try:
        if not up.wait(START_SECONDS):
            raise ConfigError(f"the embedded server did not come up within {START_SECONDS} seconds")
        yield RunningServer(base_url, welcome.token or "", _login_url(given, welcome) or "", given, app)
    finally:
        server.should_exit = True
        thread.join(SHUTDOWN_SECONDS + 5)
        sock.close()


def _login_url(settings: Settings, welcome: Welcome) -> str | None:
    return f"{settings.public_url}/login/link/{welcome.login_secret}" if welcome.login_secret else None


def _prepare(settings: Settings, token: str | None, reset_admin: str | None = None) -> Welcome:
    try:
        db = Database(settings)
        try:
            return prepare(db, token, reset_admin=reset_admin)
        finally:
            db.close()
    except (SQLAlchemyError, OSError) as error:
        raise ConfigError(
            f"the database {_without_password(settings)} cannot be used: {cause_of(error)}"
        ) from error


def _config(app: FastAPI, settings: Settings) -> uvicorn.Config:
    return uvicorn.Config(
        observed(app, settings),
        http=type("Protocol", (_Protocol,), {"head_seconds": settings.request_head_seconds}),
        log_level="warning",
        # uvicorn's access log writes whole URLs; a login link must not end up there.
        access_log=False,
        forwarded_allow_ips=settings.trusted_proxies,
        timeout_graceful_shutdown=SHUTDOWN_SECONDS,
        # Longer than a proxy keeps its connections, so that it is never the server who hangs up first.
        timeout_keep_alive=75,
        server_header=False,
    )


def _run_workers(settings: Settings, workers: int, sock: socket.socket) -> None:
    """Worker processes on one socket; one that dies is replaced, a signal ends all."""
    context = multiprocessing.get_context("spawn")
    ending = threading.Event()
    for name in (signal.SIGINT, signal.SIGTERM):
        signal.signal(name, lambda *_: ending.set())

    def start() -> SpawnProcess:
        process = context.Process(target=_work, args=(settings, sock), daemon=True)
        process.start()
        return process

    processes = [start() for _ in range(workers)]
    while not ending.wait(0.5):
        processes = [process if process.is_alive() else start() for process in processes]
    for process in processes:
        process.terminate()
    for process in processes:
        process.join(SHUTDOWN_SECONDS + 5)


def _work(settings: Settings, sock: socket.socket, on_up: Callable[[], None] | None = None) -> None:
    spare_the_collector()
    allow_many_files()
    log_to_stderr(settings)
    server = SiloServer(_config(create_app(settings), settings), on_up or (lambda: None))
    parent = multiprocessing.parent_process()
    if parent is not None:
        # A parent that was killed cannot stop its workers; they must not serve on without it.
        watch = threading.Thread(target=_end_with, args=(parent.sentinel, server), daemon=True)
        watch.start()
    server.run(sockets=[sock])


def spare_the_collector() -> None:
    """Set Python's garbage collector for large answers; for a process that does nothing but serve.

    An answer of 100 000 rows is as many small objects; the collector, as it is set, would look through all of
    them (and through every loaded module) again and again while they are made. Half the time would go.
    """
    gc.freeze()
    gc.set_threshold(50_000, 20, 100)


def _end_with(sentinel: int, server: SiloServer) -> None:
    multiprocessing.connection.wait([sentinel])
    server.should_exit = True


def _bind(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    # asyncio turns Nagle's algorithm off only where the protocol is named; with it each answer takes 40 ms.
    sock = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    own_the_port(sock)
    try:
        sock.bind((host, port))
    except (OSError, OverflowError) as error:
        sock.close()
        cause = getattr(error, "strerror", None) or "wanted a port from 0 to 65535"
        raise ConfigError(f"cannot listen on {host}:{port}: {cause}; --port 0 takes a free one") from error
    sock.listen(2048)
    sock.set_inheritable(True)
    return sock


def _base_url(host: str, port: int) -> str:
    shown = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)
    return f"http://[{shown}]:{port}" if ":" in shown else f"http://{shown}:{port}"


def is_loopback(host: str) -> bool:
    """True where only this machine can reach ``host``."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _without_password(settings: Settings) -> str:
    return make_url(settings.sqlalchemy_url).render_as_string(hide_password=True)
