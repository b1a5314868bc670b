# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a server does beside its requests, and how it is: for Prometheus and for people.

:func:`tidy` throws away what is old, at each start and every ten minutes by the clock, however busy the
server. Each step deletes a bounded number of rows in a transaction of its own, so that nobody waits long
for it. Of the processes of a server one does it; what the last run did is kept in the database and shown
(``/metrics``, the page of the users, ``GET /api/admin/housekeeping``).

:class:`Later` writes down when tokens were used, and keeps summaries of products. :class:`Probe` looks
whether the database and the file store are there, so that ``/health`` and ``/ready`` answer while every other
thread and connection is taken. Each has a thread of its own: nobody waits for it, it waits for nobody.

:class:`Metrics` counts requests by route. With several worker processes prometheus-client adds up what each
of them writes to a shared folder (``PROMETHEUS_MULTIPROC_DIR``, which ``run`` sets before they start).
"""

from __future__ import annotations

import asyncio
import importlib.metadata
import json
import logging
import math
import os
import shutil
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from datetime import datetime, timedelta
from functools import partial
from pathlib import Path
from typing import Any

from prometheus_client import (
    CollectorRegistry,
    Counter,
    Gauge,
    Histogram,
    generate_latest,
    multiprocess,
)
from prometheus_client.core import GaugeMetricFamily, Metric
from sqlalchemy import ColumnElement, Table, delete, func, insert, select, text, update
from sqlalchemy.exc import SQLAlchemyError

from silo.bom.errors import SiloError
from silo_server.backup import BACKED_UP
from silo_server.db.database import Database
from silo_server.db.sizes import beyond, bytes_of
from silo_server.db.state import get_state, mode_of, put_state
from silo_server.db.tables import (
    FILE_REFERENCES,
    answers,
    api_tokens,
    audit,
    bom_change_lines,
    bom_changes,
    items,
    login_attempts,
    login_links,
    models,
    product_summaries,
    revisions,
    sessions,
    users,
)
from silo_server.db.transaction import Tx
from silo_server.db.turnstile import Turnstile
from silo_server.errors import cause_of
from silo_server.events import log
from silo_server.events.hub import Hub
from silo_server.schema import find_schema
from silo_server.services import items as item_service
from silo_server.services.access import START_TOKEN, note_token_uses
from silo_server.services.bom.history import state_at
from silo_server.services.bom.lines import ChangeKind, LineRecord, history_row
from silo_server.services.bom.summary import keep_summaries
from silo_server.services.looks import keep_looks
from silo_server.services.revisions import FileStore
from silo_server.times import stamp
from silo_server.user_json import dumps

logger = logging.getLogger("silo_server.housekeeping")

STATE = "housekeeping"
FILES_STATE = "housekeeping_of_files"
BATCH = 1000
# For so long a name may log in from an address where it did before, whatever strangers try.
PLACE_DAYS = 90
# An upload is in the store before the row that refers to it is committed; a day is far more than that takes.
ORPHAN_SECONDS = 24 * 3600.0

Step = Callable[[Tx], int]


@dataclass(frozen=True, kw_only=True)
class Run:
    """What a run did: rows (and files) deleted by what they were, how long it took, what went wrong."""

    at: str
    seconds: float = 0.0
    removed: dict[str, int] = field(default_factory=dict)
    problem: str | None = None


def last_run(tx: Tx) -> Run | None:
    """Read the newest run of any process; None if there was none yet."""
    kept = get_state(tx, STATE)
    return None if kept is None else Run(**json.loads(kept))


def tidy(db: Database, store: FileStore) -> Run:
    """Do all housekeeping once; note in the run what cannot be done, and do the rest."""
    started, at = time.monotonic(), stamp(db.clock())
    removed: dict[str, int] = {}
    problems: list[str] = []
    steps = {name: partial(_repeat, db, step) for name, step in _STEPS.items()}
    for name, work in {**steps, "files": partial(_remove_orphans, db, store)}.items():
        try:
            removed[name] = work()
        except (OSError, SQLAlchemyError, SiloError) as error:
            problems.append(f"{name}: {cause_of(error)}")
        except Exception as error:
            logger.exception("housekeeping of %s failed", name)
            problems.append(f"{name}: {cause_of(error)}")
    run = Run(
        at=at,
        seconds=round(time.monotonic() - started, 3),
        removed={name: count for name, count in removed.items() if count},
        problem="; ".join(problems) or None,
    )
    if run.problem:
        logger.warning("housekeeping could not do all: %s", run.problem)
    with db.write(even_when_read_only=True) as tx:
        put_state(tx, STATE, dumps(asdict(run)))
    return run


async def keep_tidy(db: Database, store: FileStore, ending: asyncio.Event) -> None:
    """Run :func:`tidy` every ``housekeeping_seconds`` until ``ending``; a run that has begun is finished."""
    while not ending.is_set():
        with suppress(TimeoutError):
            await asyncio.wait_for(ending.wait(), db.settings.housekeeping_seconds)
            return
        try:
            if await asyncio.to_thread(_due, db):
                await asyncio.to_thread(tidy, db, store)
        except Exception:
            logger.exception("housekeeping failed")


def _due(db: Database) -> bool:
    # Another process of this server may have done it a moment ago.
    with db.read() as tx:
        run = last_run(tx)
    before = db.clock() - timedelta(seconds=db.settings.housekeeping_seconds / 2)
    return run is None or run.at <= stamp(before)


def _repeat(db: Database, step: Step) -> int:
    count = 0
    while True:
        with db.write(even_when_read_only=True) as tx:
            gone = step(tx)
        if not gone:
            return count
        count += gone


def _old(
    table: Table, key: str, when: str, age: Callable[[Tx], datetime | None], *also: ColumnElement[bool]
) -> Step:
    """Make the step that deletes the rows with a time ``when`` up to ``age``; none if ``age`` gives None."""

    def step(tx: Tx) -> int:
        before = age(tx)
        if before is None:
            return 0
        over = select(table.c[key]).where(table.c[when] <= stamp(before), *also).limit(BATCH)
        return tx.conn.execute(delete(table).where(table.c[key].in_(over))).rowcount

    return step


def _days(setting: str) -> Callable[[Tx], datetime | None]:
    def age(tx: Tx) -> datetime | None:
        days = getattr(tx.settings, setting)
        return tx.at - timedelta(days=days) if days else None

    return age


def _answers(tx: Tx) -> int:
    """Delete answers beyond their age, or beyond their bytes; the oldest first."""
    by_age = _days("sync_days")(tx)
    newest = select(answers.c.at, bytes_of(tx, answers.c.answer)).order_by(answers.c.at.desc())
    by_size = beyond(tx, newest, tx.settings.sync_bytes)
    before = max(stamp(by_age) if by_age else "", by_size or "")
    oldest = select(answers.c.at).where(answers.c.at <= before).order_by(answers.c.at).limit(BATCH)
    last = max(tx.conn.scalars(oldest), default=None)
    if last is None:
        return 0
    return tx.conn.execute(delete(answers).where(answers.c.at <= last)).rowcount


def _events(tx: Tx) -> int:
    return log.trim(tx, tx.settings.event_log_size, tx.settings.event_log_bytes, BATCH)


def _history(tx: Tx) -> int:
    """Fold the changes of one BOM older than ``history_days`` into one, with the state they led to."""
    before = _days("history_days")(tx)
    if before is None:
        return 0
    old = (
        select(bom_changes.c.parent_id, func.max(bom_changes.c.id))
        .where(bom_changes.c.at <= stamp(before))
        .group_by(bom_changes.c.parent_id)
        .having(func.count() > 1)
        .limit(1)
    )
    row = tx.conn.execute(old).one_or_none()
    if row is None:
        return 0
    parent = item_service.by_ids(tx, [row[0]])[row[0]]
    parent = item_service.get_item(tx, parent.part_number, include_archived=True, lock=True)
    newest: int = row[1]
    lines = state_at(tx, parent, newest)
    ours = bom_changes.c.parent_id == parent.id
    gone = select(bom_changes.c.id).where(ours, bom_changes.c.id <= newest)
    tx.conn.execute(delete(bom_change_lines).where(bom_change_lines.c.change_id.in_(gone)))
    tx.conn.execute(delete(answers).where(answers.c.change_id.in_(gone)))
    count = tx.conn.execute(delete(bom_changes).where(ours, bom_changes.c.id < newest)).rowcount
    tx.conn.execute(
        update(bom_changes)
        .where(bom_changes.c.id == newest)
        .values(
            kind=ChangeKind.FOLDED.value,
            summary=f"the state after {count + 1} older changes, which are no longer kept",
            decisions=None,
            refers_to=None,
        )
    )
    added = [LineRecord(line.line_id, line.child.id, None, line.state, line.position) for line in lines]
    rows = [{"change_id": newest, **history_row(change)} for change in added]
    if rows:
        tx.conn.execute(insert(bom_change_lines), rows)
    return count


def _models(tx: Tx) -> int:
    """Delete what is drawn of contents that no revision has any more."""
    used = select(revisions.c.file_checksum).where(revisions.c.file_checksum == models.c.file_checksum)
    gone = select(models.c.file_checksum).where(~used.exists()).limit(BATCH)
    return tx.conn.execute(delete(models).where(models.c.file_checksum.in_(gone))).rowcount


_STEPS: dict[str, Step] = {
    "sessions": _old(sessions, "id_hash", "expires_at", lambda tx: tx.at),
    "login links": _old(login_links, "token_hash", "expires_at", lambda tx: tx.at),
    "login attempts": _old(
        login_attempts,
        "id",
        "at",
        lambda tx: tx.at - timedelta(seconds=10 * tx.settings.login_window_seconds),
        login_attempts.c.outcome != "proved",
    ),
    "places of logins": _old(login_attempts, "id", "at", lambda tx: tx.at - timedelta(days=PLACE_DAYS)),
    "start tokens": _old(api_tokens, "id", "expires_at", lambda tx: tx.at, api_tokens.c.name == START_TOKEN),
    "answers": _answers,
    "events": _events,
    "audit": _old(audit, "id", "at", _days("audit_days")),
    "history": _history,
    "models": _models,
}


def _remove_orphans(db: Database, store: FileStore) -> int:
    """Delete the files that no revision and no thumbnail refers to, a day after they came."""
    now = db.clock().timestamp()
    with db.write(even_when_read_only=True) as tx:
        # Looking at every file of a large store takes seconds; once a day is enough.
        if now - float(get_state(tx, FILES_STATE) or 0) < ORPHAN_SECONDS:
            return 0
        put_state(tx, FILES_STATE, str(now))
    before = now - ORPHAN_SECONDS
    old = store.older_than(before)
    if not old:
        return 0
    with db.read() as tx:
        used: set[str] = set()
        for place in FILE_REFERENCES:
            used.update(tx.conn.scalars(select(place).distinct().where(place.is_not(None))))
    return sum(store.remove_old(path, before) for path in old if path.name not in used)


LATER_SECONDS = 1.0
# [s] How long /health and /ready wait for a probe.
HEALTH_SECONDS, READY_SECONDS = 0.2, 2.0
# [bytes] With less, a database soon cannot write what is asked of it.
MIN_FREE = 64 * 1024 * 1024


class Later:
    """The thread that writes down what no request waits for: uses of tokens, summaries of products."""

    def __init__(self, db: Database) -> None:
        self._db = db
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="silo-later", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """Write the rest down, and end; does not wait long for a database that hangs."""
        self._stopping.set()
        self._thread.join(timeout=2)

    def _run(self) -> None:
        ending = False
        while not ending:
            ending = self._stopping.wait(LATER_SECONDS)
            for keep in note_token_uses, partial(keep_summaries, ended=self._stopping.is_set), keep_looks:
                try:
                    keep(self._db)
                except (SQLAlchemyError, SiloError) as error:
                    logger.debug("what no request waits for is kept later: %s", cause_of(error))
                except Exception:  # the thread must live on
                    logger.exception("what no request waits for cannot be kept")


@dataclass(frozen=True, slots=True)
class ServerStanding:
    """How a server is. ``files``: ok, unwritable or full (so is ``database``, or unreachable)."""

    mode: str
    database: str
    files: str

    @property
    def ready(self) -> bool:
        """Return True if the server can do all of its work."""
        return self.database == self.files == "ok"


class Probe:
    """Looks at the database and the store on a thread of its own, one look at a time."""

    def __init__(self, db: Database, files: FileStore) -> None:
        self._db = db
        self._files = files
        self._executor = ThreadPoolExecutor(1, "silo-probe")
        self._running: asyncio.Future[ServerStanding] | None = None
        self.last = ServerStanding("normal", "ok", "ok")

    async def look(self, seconds: float) -> ServerStanding | None:
        """Look at database and store; None if that takes longer than ``seconds``."""
        if self._running is None or self._running.done():
            self._running = asyncio.get_running_loop().run_in_executor(self._executor, self._look)
        running = self._running  # while this one waits, another caller may begin the next look
        done, _ = await asyncio.wait({running}, timeout=seconds)
        return running.result() if done else None

    def stop(self) -> None:
        """Begin no more looks."""
        self._executor.shutdown(wait=False, cancel_futures=True)

    def _look(self) -> ServerStanding:
        files = self._files.state(MIN_FREE)
        database = "ok"
        path = self._db.settings.sqlite_path
        if path is not None and not has_space(path.parent, MIN_FREE):
            database = "full"
        try:
            with self._db.read() as tx:
                mode = mode_of(tx)
        except SQLAlchemyError:
            mode, database = "degraded", "unreachable"
        self.last = ServerStanding(mode if files == database == "ok" else "degraded", database, files)
        return self.last


def has_space(folder: Path, wanted: int) -> bool:
    """Check if the disk of a folder has ``wanted`` bytes free; True if that is unknown."""
    try:
        return shutil.disk_usage(folder).free >= wanted
    except OSError:
        return True


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


def standing(db: Database, hub: Hub, files: FileStore, large_reads: Turnstile) -> dict[str, Any]:
    """Collect the state of this server for an administrator; the queues are those of one process."""
    with db.read() as tx:
        row = sessions.c
        counts = {
            "users": select(func.count()).select_from(users).where(users.c.active),
            "sessions": select(func.count()).select_from(sessions).where(row.expires_at > tx.stamp),
            "items": select(func.count()).select_from(items),
            "summaries": select(func.count()).select_from(product_summaries),
        }
        state: dict[str, Any] = {name: tx.conn.scalar(query) or 0 for name, query in counts.items()}
        run, saved = last_run(tx), get_state(tx, BACKED_UP)
        schema, mode = tx.conn.scalar(text("SELECT version_num FROM alembic_version")), mode_of(tx)
        size = tx.conn.scalar(text("SELECT pg_database_size(current_database())")) if tx.postgres else None
    path = db.settings.sqlite_path
    return state | {
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


class _Gauges:
    """Numbers of this moment."""

    def __init__(self, gauges: Sequence[Metric]) -> None:
        self._gauges = gauges

    def collect(self) -> Sequence[Metric]:
        return self._gauges
