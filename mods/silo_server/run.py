# SPDX-License-Identifier: LGPL-2.1-or-later
"""Run the server: in the foreground, by several worker processes, or on a thread of another program."""

from __future__ import annotations

import gc
import ipaddress
import multiprocessing
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

from silo.bom.errors import ConfigError
from silo_server.app import create_app
from silo_server.bootstrap import Welcome, prepare
from silo_server.db.engine import Database
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


class SiloServer(uvicorn.Server):
    """uvicorn's server, which lets its event streams go before it waits for its connections to end."""

    def __init__(self, config: uvicorn.Config) -> None:
        super().__init__(config)
        self.up = threading.Event()

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        self.up.set()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        app: Any = self.config.loaded_app
        while app is not None and not isinstance(app, FastAPI):
            app = getattr(app, "app", None)
        if app is not None and hasattr(app.state, "server"):
            app.state.server.hub.close()
        await super().shutdown(sockets)


def serve(
    host: str = "127.0.0.1",
    port: int = 8000,
    database_url: str | None = None,
    *,
    workers: int = 1,
    token: str | None = None,
    tell: Callable[[str], None] = print,
) -> None:
    """Serve until interrupted; tells the address, a token and a login link through ``tell`` first.

    token
        the first token; ``SILO_API_TOKEN`` where None, a new one where that is not set either.
    port
        0 takes a free one.
    """
    settings = settings_from_environment(database_url=database_url)
    if workers < 1:
        raise ConfigError(f"workers: wanted at least 1, got {workers}")
    welcome = _prepare(settings, token or os.environ.get("SILO_API_TOKEN") or None)
    sock = _bind(host, port)
    base_url = _base_url(host, sock.getsockname()[1])
    for line in _greeting(base_url, welcome, settings, host):
        tell(line)
    with sock:
        if workers == 1:
            _work(settings, sock)
        else:
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
    welcome = _prepare(given, token)
    app = create_app(given)
    sock = _bind(host, port)
    server = SiloServer(_config(app))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [sock]}, name="silo-server", daemon=True)
    thread.start()
    try:
        if not server.up.wait(START_SECONDS):
            raise ConfigError(f"the embedded server did not come up within {START_SECONDS} seconds")
        base_url = _base_url(host, sock.getsockname()[1])
        login_url = f"{base_url}/login/link/{welcome.login_secret}"
        yield RunningServer(base_url, welcome.token, login_url, given, app)
    finally:
        server.should_exit = True
        thread.join(SHUTDOWN_SECONDS + 5)
        sock.close()


def _prepare(settings: Settings, token: str | None) -> Welcome:
    db = Database(settings)
    try:
        return prepare(db, token)
    finally:
        db.close()


def _config(app: FastAPI) -> uvicorn.Config:
    return uvicorn.Config(
        app,
        log_level="warning",
        # uvicorn's access log writes whole URLs; a login link must not end up there.
        access_log=False,
        timeout_graceful_shutdown=SHUTDOWN_SECONDS,
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


def _work(settings: Settings, sock: socket.socket) -> None:
    # An answer of 100 000 rows is as many small objects; Python's collector, as it is set, would look through
    # all of them (and through every loaded module) again and again while they are made. Half the time goes.
    gc.freeze()
    gc.set_threshold(50_000, 20, 100)
    _allow_many_connections()
    SiloServer(_config(create_app(settings))).run(sockets=[sock])


def _allow_many_connections() -> None:
    # Each listener is an open file; the usual soft limit of 1024 is far below what the machine allows.
    try:
        import resource
    except ImportError:  # Windows has no such limit
        return
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    with suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))


def _bind(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    # asyncio turns Nagle's algorithm off only where the protocol is named; with it each answer takes 40 ms.
    sock = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        sock.bind((host, port))
    except OSError as error:
        sock.close()
        raise ConfigError(f"cannot listen on {host}:{port}: {error.strerror}; try --port 0") from error
    sock.listen(2048)
    sock.set_inheritable(True)
    return sock


def _base_url(host: str, port: int) -> str:
    shown = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)
    return f"http://[{shown}]:{port}" if ":" in shown else f"http://{shown}:{port}"


def _greeting(base_url: str, welcome: Welcome, settings: Settings, host: str) -> list[str]:
    lines = [f"Silo server: {base_url}", f"Token:       {welcome.token}"]
    lines.append(f"Log in:      {base_url}/login/link/{welcome.login_secret}")
    lines.append(f"Database:    {_without_password(settings)}")
    if not is_loopback(host):
        lines.append("This server can be reached from other machines. Put TLS before it (docs/server.md).")
    return lines


def is_loopback(host: str) -> bool:
    """True where only this machine can reach ``host``."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _without_password(settings: Settings) -> str:
    from sqlalchemy import make_url

    return make_url(settings.sqlalchemy_url).render_as_string(hide_password=True)
