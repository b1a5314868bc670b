# SPDX-License-Identifier: LGPL-2.1-or-later
"""``GET /metrics`` for Prometheus: requests by route, and how the server is; that for people too.

With several worker processes prometheus-client adds up what each of them writes to a shared folder
(``PROMETHEUS_MULTIPROC_DIR``, which ``run`` sets before they start).
"""

from __future__ import annotations

import importlib.metadata
import json
import math
import os
from dataclasses import asdict
from typing import Any

from prometheus_client import (
    CONTENT_TYPE_LATEST,
    CollectorRegistry,
    Counter,
    Gauge,
    Histogram,
    generate_latest,
    multiprocess,
)
from sqlalchemy import func, select, text

from silo_server import events
from silo_server.db.engine import Database, Turnstile, get_state, mode_of
from silo_server.db.tables import items, product_summaries, sessions, users
from silo_server.events import Hub
from silo_server.operation.backup import BACKED_UP
from silo_server.operation.housekeeping import Run, last_run
from silo_server.schema.catalog import find_schema
from silo_server.services.revisions import FileStore
from silo_server.settings import Clock

CONTENT_TYPE = CONTENT_TYPE_LATEST
BUCKETS = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0)
SHARED = "PROMETHEUS_MULTIPROC_DIR"


class Metrics:
    """The numbers of one process."""

    def __init__(self) -> None:
        self._registry = CollectorRegistry()
        self._seconds = Histogram(
            "silo_request_seconds",
            "Time from a request to the end of its answer, by route",
            ["method", "route"],
            buckets=BUCKETS,
            registry=self._registry,
        )
        self._answers = Counter(
            "silo_requests",
            "Answers by route and status",
            ["method", "route", "status"],
            registry=self._registry,
        )
        self._listeners = self._gauge("silo_event_listeners", "Open event streams")
        self._connections = self._gauge("silo_database_connections", "Database connections in use")

    def _gauge(self, name: str, text: str) -> Gauge:
        return Gauge(name, text, registry=self._registry, multiprocess_mode="livesum")

    def request(self, method: str, route: str, status: int, seconds: float) -> None:
        """Count an answer; ``status`` 0 for none."""
        # A method may be any word that a client sends; routes are ours.
        known = method if method in ("GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS") else "other"
        self._answers.labels(known, route, str(status)).inc()
        self._seconds.labels(known, route).observe(seconds)

    def render(self, db: Database, hub: Hub, files: FileStore) -> bytes:
        """The text for Prometheus. The database's numbers are left out while it cannot be read."""
        self._listeners.set(hub.listeners)
        self._connections.set(db.connections)
        now = CollectorRegistry()
        with db.read() as tx:
            mode, run = mode_of(tx), last_run(tx)
            horizon, head = events.bounds(tx)
        _now(now, "silo_read_only", "1 while the server takes no changes", float(mode != "normal"))
        _now(now, "silo_events_kept", "Events in the log", float(head - horizon))
        _now(now, "silo_event_newest_id", "Id of the newest event", float(head))
        _now(now, "silo_files_free_bytes", "Free space on the disk of the uploads", files.free())
        path = db.settings.sqlite_path
        if path is not None:
            _now(now, "silo_database_bytes", "Size of the SQLite database", float(path.stat().st_size))
            wal = path.with_name(path.name + "-wal")
            size = wal.stat().st_size if wal.exists() else 0
            _now(now, "silo_database_wal_bytes", "Size of the SQLite write-ahead log", float(size))
        if run is not None:
            _now(now, "silo_housekeeping_age_seconds", "Since the last run", _age(run, db.clock))
            _now(
                now, "silo_housekeeping_failed", "1 where it could not do all", float(run.problem is not None)
            )
        counted = self._registry
        if os.environ.get(SHARED):
            counted = CollectorRegistry()
            multiprocess.MultiProcessCollector(counted)  # type: ignore[no-untyped-call]
        return generate_latest(counted) + generate_latest(now)


def standing(db: Database, hub: Hub, files: FileStore, large_reads: Turnstile) -> dict[str, Any]:
    """How this server is at the moment, for an administrator; the queues are those of one process."""
    with db.read() as tx:
        row = sessions.c
        counts = {
            "users": select(func.count()).select_from(users).where(users.c.active),
            "sessions": select(func.count()).select_from(sessions).where(row.expires_at > tx.stamp),
            "items": select(func.count()).select_from(items),
            "summaries": select(func.count()).select_from(product_summaries),
        }
        told: dict[str, Any] = {name: tx.conn.scalar(query) or 0 for name, query in counts.items()}
        run, saved = last_run(tx), get_state(tx, BACKED_UP)
        schema, mode = tx.conn.scalar(text("SELECT version_num FROM alembic_version")), mode_of(tx)
        size = tx.conn.scalar(text("SELECT pg_database_size(current_database())")) if tx.postgres else None
    path = db.settings.sqlite_path
    return told | {
        "version": importlib.metadata.version("silo-mod"),
        "mode": mode,
        "database": "PostgreSQL" if path is None else str(path),
        "database_bytes": size if path is None else path.stat().st_size,
        "schema": schema,
        "storage": str(db.settings.storage),
        "free_bytes": None if math.isnan(free := files.free()) else int(free),
        "backup": None if saved is None else json.loads(saved),
        "housekeeping": None if run is None else asdict(run),
        "queues": {
            "changes": db.turn.here,
            "exports and large reads": large_reads.here,
            "event streams": hub.listeners,
            "summaries to be kept": len(db.built),
        },
        "categories": len(find_schema(None).categories),
        "warnings": list(db.settings.warnings),
    }


def _now(registry: CollectorRegistry, name: str, text: str, value: float) -> None:
    from prometheus_client.core import GaugeMetricFamily

    class One:
        def collect(self) -> list[GaugeMetricFamily]:
            return [GaugeMetricFamily(name, text, value)]

    registry.register(One())


def _age(run: Run, clock: Clock) -> float:
    from datetime import datetime

    return max(0.0, clock().timestamp() - datetime.fromisoformat(run.at).timestamp())
