# SPDX-License-Identifier: LGPL-2.1-or-later
"""Housekeeping: what is old is thrown away, at each start and every ten minutes by the clock.

It runs however busy the server is. Each step deletes a bounded number of rows in a transaction of its own, so
that no request waits long for it. Of the processes of a server one does it; what the last run did is kept in
the database and shown (``/metrics``, the page of the users, ``GET /api/admin/housekeeping``).
"""

from __future__ import annotations

import asyncio
import json
import logging
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from datetime import datetime, timedelta
from functools import partial

from sqlalchemy import ColumnElement, Table, delete, func, insert, select, update
from sqlalchemy.exc import SQLAlchemyError

from silo.bom.errors import SiloError
from silo_server.db.database import Database
from silo_server.db.sizes import beyond, bytes_of
from silo_server.db.state import get_state, put_state
from silo_server.db.tables import (
    FILE_REFERENCES,
    answers,
    api_tokens,
    audit,
    bom_change_lines,
    bom_changes,
    device_logins,
    login_attempts,
    login_links,
    models,
    revisions,
    sessions,
)
from silo_server.db.transaction import Tx
from silo_server.errors import cause_of
from silo_server.events import log
from silo_server.services import items as item_service
from silo_server.services.access.tokens import START_TOKEN
from silo_server.services.bom.change import history_row
from silo_server.services.bom.history import state_at
from silo_server.services.bom.line_record import ChangeKind, LineRecord
from silo_server.services.file_store import FileStore
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
    "logins of programs": _old(device_logins, "device_hash", "expires_at", lambda tx: tx.at),
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
