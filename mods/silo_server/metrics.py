# SPDX-License-Identifier: LGPL-2.1-or-later
"""Metrics for Prometheus: requests by route, and how the server is.

With several worker processes prometheus-client adds up what each of them writes to a shared folder
(``PROMETHEUS_MULTIPROC_DIR``, which ``run`` sets before they start).
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from datetime import datetime

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest, multiprocess
from prometheus_client.core import GaugeMetricFamily, Metric

from silo_server.db.database import Database
from silo_server.db.state import mode_of
from silo_server.events import log
from silo_server.events.hub import Hub
from silo_server.housekeeping import last_run
from silo_server.services.file_store import FileStore

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
        """Count an answer, and its time; ``status`` 0: there was none."""
        # A method may be any word that a client sends; routes are ours.
        method_name = (
            method if method in ("GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS") else "other"
        )
        self._answers.labels(method_name, route, str(status)).inc()
        self._seconds.labels(method_name, route).observe(seconds)

    def render(self, db: Database, hub: Hub, files: FileStore) -> bytes:
        """Write the numbers of this process, or of all workers, and of the database, for Prometheus."""
        self._listeners.set(hub.listeners)
        self._connections.set(db.connections)
        now = CollectorRegistry()
        with db.read() as tx:
            mode, run = mode_of(tx), last_run(tx)
            horizon, head = log.bounds(tx)
        gauges: list[Metric] = [
            GaugeMetricFamily("silo_read_only", "1 while the server takes no changes", mode != "normal"),
            GaugeMetricFamily("silo_events_kept", "Events in the log", head - horizon),
            GaugeMetricFamily("silo_event_newest_id", "Id of the newest event", head),
            GaugeMetricFamily("silo_files_free_bytes", "Free space on the disk of the uploads", files.free()),
        ]
        path = db.settings.sqlite_path
        if path is not None:
            wal = path.with_name(path.name + "-wal")
            size = wal.stat().st_size if wal.exists() else 0
            gauges += [
                GaugeMetricFamily("silo_database_bytes", "Size of the SQLite database", path.stat().st_size),
                GaugeMetricFamily("silo_database_wal_bytes", "Size of the SQLite write-ahead log", size),
            ]
        if run is not None:
            age = db.clock().timestamp() - datetime.fromisoformat(run.at).timestamp()
            gauges += [
                GaugeMetricFamily("silo_housekeeping_age_seconds", "Since the last run", max(0.0, age)),
                GaugeMetricFamily(
                    "silo_housekeeping_failed", "1 where it could not do all", run.problem is not None
                ),
            ]
        now.register(_Gauges(gauges))
        counted = self._registry
        if os.environ.get(SHARED):
            counted = CollectorRegistry()
            multiprocess.MultiProcessCollector(counted)  # type: ignore[no-untyped-call]
        return generate_latest(counted) + generate_latest(now)


class _Gauges:
    """Numbers of this moment."""

    def __init__(self, gauges: Sequence[Metric]) -> None:
        self._gauges = gauges

    def collect(self) -> Sequence[Metric]:
        return self._gauges
