# SPDX-License-Identifier: LGPL-2.1-or-later
"""The application: its parts put together once, here."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import anyio.to_thread
from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi

from silo_server import failures
from silo_server.background import Probe, TokenUses
from silo_server.clock import Clock, utc_now
from silo_server.db.engine import WRITERS_WAITING, Database
from silo_server.events.hub import Hub
from silo_server.files import FileStore
from silo_server.middleware import BodyLimit, Compressed, SecurityHeaders
from silo_server.operation.housekeeping import keep_tidy
from silo_server.operation.metrics import Metrics
from silo_server.operation.requests import Observed
from silo_server.routes import auth, bom, items, review, revisions, system, transfer
from silo_server.routes.context import Server
from silo_server.routes.document import complete
from silo_server.settings import Settings, settings_from_environment
from silo_server.web import pages

VERSION = "0.1.0"
READING_THREADS = 40
# Routes are matched in this order; /items/by-uuid and /items/search stand before /items/{part_number}.
ROUTERS = (
    system.router,
    auth.router,
    items.router,
    revisions.router,
    bom.router,
    bom.several,
    review.router,
    transfer.router,
    *pages.ROUTERS,
)


def create_app(settings: Settings, clock: Clock = utc_now) -> FastAPI:
    """The server as an ASGI application; ``bootstrap.prepare`` has brought the database up to date."""
    db = Database(settings, clock)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        # Changes that wait hold a thread each; what is left is for those who read.
        anyio.to_thread.current_default_thread_limiter().total_tokens = WRITERS_WAITING + READING_THREADS
        hub, files, uses = Hub(db), FileStore(settings.storage), TokenUses(db)
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
        version=VERSION,
        openapi_url="/api/openapi.json",
        docs_url=None,
        redoc_url=None,
        lifespan=lifespan,
    )
    for router in ROUTERS:
        app.include_router(router)
    failures.install(app)
    pages.install(app)
    app.add_middleware(BodyLimit, settings=settings)
    app.add_middleware(SecurityHeaders)
    app.add_middleware(Compressed)
    app.state.metrics = metrics
    app.openapi = lambda: _openapi(app)  # type: ignore[method-assign]
    return app


def app_from_environment() -> Observed:
    """For other ASGI servers: ``uvicorn --factory silo_server.app:app_from_environment``."""
    settings = settings_from_environment()
    return observed(create_app(settings), settings)


def observed(app: FastAPI, settings: Settings) -> Observed:
    """The application as it is served: with request ids, log, metrics, below its sub-path."""
    return Observed(app, settings, app.state.metrics)


def _openapi(app: FastAPI) -> dict[str, Any]:
    if app.openapi_schema is None:
        app.openapi_schema = complete(get_openapi(title=app.title, version=app.version, routes=app.routes))
    return app.openapi_schema
