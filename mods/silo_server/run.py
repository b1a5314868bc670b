# SPDX-License-Identifier: LGPL-2.1-or-later
"""Run the server: in the foreground, by several worker processes, or on a thread of another program.

The first start: newest schema, a first admin, a first token; every start: old things are cleared away.
"""

from __future__ import annotations

import asyncio
import gc
import importlib.metadata
import ipaddress
import multiprocessing
import multiprocessing.connection
import os
import shutil
import signal
import socket
import sys
import threading
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from contextlib import asynccontextmanager, contextmanager, suppress
from dataclasses import dataclass, replace
from datetime import timedelta
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import Any

import anyio.to_thread
import uvicorn
from fastapi import APIRouter, FastAPI
from fastapi.openapi.utils import get_openapi
from sqlalchemy import func, make_url, select
from sqlalchemy.exc import SQLAlchemyError
from uvicorn.protocols.http.h11_impl import H11Protocol

from silo.bom.errors import ConfigError
from silo.bom.system_refusals import why_refused
from silo.platform.limits import allow_many_files
from silo.platform.sockets import WORKERS_CAN_SHARE_A_SOCKET, own_the_port
from silo.platform.whole_files import nearest_folder, scratch_folder
from silo_server.actors import Role
from silo_server.backup import back_up_before_upgrade
from silo_server.db.database import WRITERS_WAITING, Database
from silo_server.db.migrate import upgrade
from silo_server.db.tables import events, users
from silo_server.db.transaction import MIGRATION_LOCK, Tx
from silo_server.errors import cause_of
from silo_server.events.hub import Hub
from silo_server.housekeeping import keep_tidy, tidy
from silo_server.http import errors
from silo_server.http.body_limit import BodyLimit
from silo_server.http.compression import Compressed
from silo_server.http.escaped_slashes import EscapedSlashes
from silo_server.http.headers import SecurityHeaders
from silo_server.http.request_log import Observed, log_to_stderr
from silo_server.http.unknown_callers import UnknownCallers
from silo_server.later import Later
from silo_server.metrics import SHARED, Metrics
from silo_server.probe import Probe
from silo_server.services import search
from silo_server.services.access.configured_token import check_configured_secret, take_configured_token
from silo_server.services.access.login_links import create_login_link
from silo_server.services.access.signing import ensure_signing_key
from silo_server.services.access.tokens import START_TOKEN, create_token, shown_prefix
from silo_server.services.access.users import User, create_user, get_user, make_admin, to_user
from silo_server.services.file_store import FileStore
from silo_server.settings import MIB, Settings, settings_from_environment
from silo_server.times import Clock, stamp, utc_now

START_TOKEN_DAYS = 30.0


@dataclass(frozen=True, slots=True)
class Welcome:
    """What the person who starts the server sees. ``login_secret`` belongs behind ``/login/link/``.

    Without an active admin there is no user, no token and no link. A token of the environment that lets
    no one in is not shown: ``warnings`` say why.
    """

    username: str | None
    token: str | None
    login_secret: str | None
    warnings: Sequence[str] = ()


def prepare(db: Database, token: str | None = None, *, reset_admin: str | None = None) -> Welcome:
    """Bring the database up to date and let the first admin in.

    token
        ``SILO_API_TOKEN``, which becomes a token of the first admin; a new one is made if None.
    reset_admin
        the user with this name becomes an active admin, is made if there is none, and is let in: the way
        back for people who locked themselves out.
    """
    saved = back_up_before_upgrade(db)
    left = upgrade(db)
    if saved is not None:
        left.append(f"The database was brought up to date. The state before it is in {saved}.")
    with db.write(even_when_read_only=True) as tx:
        tx.lock(MIGRATION_LOCK)  # of two servers that start at once, one makes the first admin
        if tx.conn.scalar(select(func.count()).select_from(users)) == 0:
            settings = tx.settings
            create_user(tx, settings.admin_username, Role.ADMIN, password=settings.admin_password)
        if reset_admin is not None:
            make_admin(tx, reset_admin)
        admin = get_user(tx, reset_admin) if reset_admin else _first_admin(tx)
        secret, dead = token if admin else None, ""
        if admin and token is None:
            expires = stamp(tx.at + timedelta(days=START_TOKEN_DAYS))
            secret = create_token(tx, admin.id, START_TOKEN, expires=expires)[1]
        elif admin and token is not None and (dead := take_configured_token(tx, admin.id, token)):
            secret = None
        link = create_login_link(tx, admin.username) if admin else None
        search.ensure_index(tx)
        ensure_signing_key(tx)
        last = tx.conn.scalar(select(events.c.at).order_by(events.c.id.desc()).limit(1)) or ""
        late = stamp(tx.at + timedelta(minutes=1))
    behind = f"The clock is behind: the last change is of {last}, and now it is {stamp(db.clock())}. Set it."
    tidy(db, FileStore(db.settings.storage))
    warnings = [*left, *([behind] if last > late else [])]
    if dead:
        warnings.append(f"SILO_API_TOKEN lets nobody in: {dead}. Put a new one there.")
    return Welcome(admin.username if admin else None, secret, link, warnings)


def _first_admin(tx: Tx) -> User | None:
    row = tx.conn.execute(
        select(users).where(users.c.role == Role.ADMIN.value, users.c.active).order_by(users.c.id).limit(1)
    ).one_or_none()
    return to_user(row) if row is not None else None


READING_THREADS = 40
# Routes are matched in this order; /items/by-uuid and /items/search stand before /items/{part_number}.


def routers() -> tuple[APIRouter, ...]:
    """Import and return all routers; late, as this takes half of the import, and a backup needs none."""
    from silo_server.routes import (
        attachments,
        device_logins,
        items,
        orders,
        parts_table,
        releases,
        scene,
        sessions,
        streams,
        system,
        tokens,
    )
    from silo_server.routes import users as user_routes
    from silo_server.routes.bom import (
        changes,
        exports,
        held,
        history,
        imports,
        lines,
        merge,
        review,
        summary,
        tree,
    )
    from silo_server.web import pages

    return (
        system.router,
        streams.router,
        sessions.router,
        device_logins.router,
        tokens.router,
        user_routes.router,
        parts_table.router,
        items.router,
        items.revisions_router,
        items.by_uuid,
        attachments.router,
        releases.router,
        scene.router,
        lines.router,
        merge.router,
        held.router,
        tree.router,
        summary.router,
        lines.several,
        review.router,
        history.router,
        exports.router,
        changes.router,
        imports.router,
        orders.router,
        *pages.ROUTERS,
    )


def create_app(settings: Settings, clock: Clock = utc_now) -> FastAPI:
    """Make the server as an ASGI application; :func:`prepare` has brought the database up to date."""
    from silo_server.routes.call import Server, find_user
    from silo_server.services.access.passwords import password_memory

    password_memory(os.environ)  # an unusable number is named at the start, not at the first login
    db = Database(settings, clock)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        # Each change that waits holds a thread; the other threads are for readers.
        anyio.to_thread.current_default_thread_limiter().total_tokens = WRITERS_WAITING + READING_THREADS
        hub, files, uses = Hub(db), FileStore(settings.storage), Later(db)
        probe = Probe(db, files)
        app.state.server = Server(settings, db, hub, files, probe)
        await hub.start()
        uses.start()
        ending = asyncio.Event()
        tidying = asyncio.create_task(keep_tidy(db, files, ending))
        yield
        ending.set()
        await tidying
        await hub.stop()
        probe.stop()
        await asyncio.to_thread(uses.stop)
        db.close()

    # The interactive pages of FastAPI load scripts from elsewhere, which our CSP forbids; the document stays.
    metrics = Metrics()
    app = FastAPI(
        title="silo-mod server",
        version=importlib.metadata.version("silo-mod"),
        openapi_url=None,  # a route of our own may ask for a login
        docs_url=None,
        redoc_url=None,
        lifespan=lifespan,
    )
    from silo_server.web import pages

    for router in routers():
        app.include_router(router, dependencies=pages.DEPENDENCIES if router in pages.ROUTERS else ())
    errors.install(app)
    pages.install(app)
    app.add_middleware(BodyLimit, settings=settings)
    app.add_middleware(UnknownCallers, find_user=find_user)
    app.add_middleware(SecurityHeaders)
    app.add_middleware(Compressed)
    app.add_middleware(EscapedSlashes)
    app.state.metrics = metrics
    app.openapi = lambda: _openapi(app)  # type: ignore[method-assign]
    return app


def app_from_environment() -> Observed:
    """Make the application for another ASGI server.

    ``uvicorn --factory silo_server.run:app_from_environment``
    """
    settings = settings_from_environment()
    return observed(create_app(settings), settings)


def observed(app: FastAPI, settings: Settings) -> Observed:
    """Wrap the application as it is served: with request ids, log, metrics, below its sub-path."""
    return Observed(app, settings, app.state.metrics)


def _openapi(app: FastAPI) -> dict[str, Any]:
    if app.openapi_schema is None:
        from silo_server.routes.openapi import complete

        app.openapi_schema = complete(get_openapi(title=app.title, version=app.version, routes=app.routes))
    return app.openapi_schema


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

    A token that was given to it is not shown whole: logs are read by many. ``warnings``: what is wrong with
    its settings.
    """

    url: str
    token: str | None
    login_url: str | None
    database: str
    public: bool
    warnings: Sequence[str] = ()

    def lines(self) -> list[str]:
        """Write the lines for people, and for scripts that look for the first address and the token."""
        lines = [
            f"Silo server: {self.url}",
            *([f"Token:       {self.token}"] if self.token else []),
            *([f"Log in:      {self.login_url}"] if self.login_url else []),
            f"Database:    {self.database}",
        ]
        if self.login_url is None:
            lines.append("There is no active admin. Start again with --reset-admin NAME to make one.")
        if self.public:
            warning = (
                "This server can be reached from other machines. Put TLS before it (docs/install-server.md)."
            )
            lines.append(warning)
        return [*lines, *(f"Warning:     {warning}" for warning in self.warnings)]


def _tell(greeting: Greeting) -> None:
    # A reader of a pipe waits for the address, and the server never ends by itself.
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
            app.state.server.large_reads.close()
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
    """Serve until interrupted; report the address, a token and a login link through ``tell`` first.

    token
        the first token; if None, ``SILO_API_TOKEN``; if that is not set either, a new one.
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
    if given:
        check_configured_secret(given)
    sock = _bind(host, port)  # first: if the port is taken, no token is made that is not seen
    try:
        welcome = _prepare(settings, given, reset_admin)
    except BaseException:
        sock.close()
        raise
    base_url = _base_url(host, sock.getsockname()[1])
    own = settings
    settings = replace(settings, public_url=settings.public_url or base_url)
    database, login_url = _without_password(settings), _login_url(settings, welcome)
    shown = welcome.token
    if shown and given:
        shown = f"{shown_prefix(given)}… (the one you gave)"
    free = shutil.disk_usage(nearest_folder(own.storage)).free
    warnings = [*start_warnings(own, is_loopback(host), free), *welcome.warnings]
    settings = replace(settings, warnings=tuple(warnings))
    greeting = Greeting(base_url, shown, login_url, database, not is_loopback(host), warnings)
    # uvicorn passes Ctrl-C on when it has ended in good order; to the person that is no error.
    with sock, suppress(KeyboardInterrupt):
        if workers == 1:
            _work(settings, sock, lambda: tell(greeting))
        else:
            tell(greeting)
            with scratch_folder("silo-metrics-") as shared:
                os.environ[SHARED] = shared
                _run_workers(settings, workers, sock)


def start_warnings(settings: Settings, loopback: bool, free: int) -> list[str]:
    """List what is wrong with the settings of a server.

    loopback
        only this machine sees it.
    free
        room on the disk of its files [bytes].
    """
    public = settings.public_url or ""
    conditions = {
        "SILO_PUBLIC_URL is not set: login links begin with the address that the server listens on.": not (
            public or loopback
        ),
        "SILO_PUBLIC_URL begins with https and SILO_SECURE_COOKIES is off: set it to yes.": public.startswith(
            "https:"
        )
        and not settings.secure_cookies,
        "SILO_TRUSTED_PROXIES is *: who reaches the server chooses the address that it writes down.": (
            "*" in settings.trusted_proxies
        ),
        f"The disk of {settings.storage} has {free // MIB} MiB left: make room, or changes fail.": free
        < 1024 * MIB,
    }
    return [warning for warning, wrong in conditions.items() if wrong]


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
    """Run a server on a background thread, for the demo and for tests; ends with the ``with`` block.

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
            raise ConfigError(f"the embedded server did not start within {START_SECONDS} seconds")
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
    """Run worker processes on one socket; one that dies is replaced, a signal ends all."""
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
    share_the_processor()
    allow_many_files()
    log_to_stderr(settings)
    server = SiloServer(_config(create_app(settings), settings), on_up or (lambda: None))
    parent = multiprocessing.parent_process()
    if parent is not None:
        # A parent that was killed cannot stop its workers; they must not serve on without it.
        watch = threading.Thread(target=_end_with, args=(parent.sentinel, server), daemon=True)
        watch.start()
    server.run(sockets=[sock])


def share_the_processor() -> None:
    """Tune Python for large answers beside small ones; for a process that does nothing but serve.

    An answer of 100 000 rows is as many small objects; the collector, as it is set, would look through all of
    them (and through every loaded module) again and again while they are made. Half the time would go. And
    while a thread makes it, each other one would wait 5 ms for its turn, many times in each request.
    """
    sys.setswitchinterval(0.0005)
    gc.freeze()
    gc.set_threshold(50_000, 20, 100)


def _end_with(sentinel: int, server: SiloServer) -> None:
    multiprocessing.connection.wait([sentinel])
    server.should_exit = True


def _bind(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    # asyncio turns Nagle's algorithm off only if the protocol is named; with it each answer takes 40 ms.
    sock = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    own_the_port(sock)
    try:
        sock.bind((host, port))
    except (OSError, OverflowError) as error:
        sock.close()
        cause = why_refused(error) if isinstance(error, OSError) else "wanted a port from 0 to 65535"
        raise ConfigError(f"cannot listen on {host}:{port}: {cause}; --port 0 takes a free one") from error
    sock.listen(2048)
    sock.set_inheritable(True)
    return sock


def _base_url(host: str, port: int) -> str:
    shown = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)
    return f"http://[{shown}]:{port}" if ":" in shown else f"http://{shown}:{port}"


def is_loopback(host: str) -> bool:
    """Return True if only this machine can reach ``host``."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _without_password(settings: Settings) -> str:
    return make_url(settings.sqlalchemy_url).render_as_string(hide_password=True)
