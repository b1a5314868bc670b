# SPDX-License-Identifier: LGPL-2.1-or-later
"""How the server is, for its administrators: version, database, disk, backup, queues and counts."""

from __future__ import annotations

import importlib.metadata
import json
import math
import shutil
from dataclasses import asdict
from pathlib import Path
from typing import Any

from sqlalchemy import func, select, text

from silo.platform.whole_files import nearest_folder
from silo_server.backup import BACKED_UP, RESTORE_TRIED
from silo_server.db.database import Database
from silo_server.db.state import get_state, mode_of
from silo_server.db.tables import items, product_summaries, sessions, users
from silo_server.db.turnstile import Turnstile
from silo_server.events.hub import Hub
from silo_server.housekeeping import last_run
from silo_server.open_secrets import open_secrets
from silo_server.services.file_store import FileStore
from silo_server.services.scheme import scheme_of


def _free(files: FileStore, storage: Path) -> int | None:
    """Return the room on the disk of the files, which the first upload makes a folder for."""
    free = files.free()
    if not math.isnan(free):
        return int(free)
    try:
        return shutil.disk_usage(nearest_folder(storage)).free
    except OSError:
        return None


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
        run, saved, tried = last_run(tx), get_state(tx, BACKED_UP), get_state(tx, RESTORE_TRIED)
        schema, mode = tx.conn.scalar(text("SELECT version_num FROM alembic_version")), mode_of(tx)
        size = tx.conn.scalar(text("SELECT pg_database_size(current_database())")) if tx.postgres else None
        categories = len(scheme_of(tx).categories)
    path = db.settings.sqlite_path
    return state | {
        "version": importlib.metadata.version("silo-mod"),
        "mode": mode,
        "database": "PostgreSQL" if path is None else str(path),
        "database_bytes": size if path is None else path.stat().st_size,
        "schema": schema,
        "storage": str(db.settings.storage),
        "free_bytes": _free(files, db.settings.storage),
        "backup": None if saved is None else json.loads(saved),
        "restore_tried": None if tried is None else json.loads(tried),
        "housekeeping": None if run is None else asdict(run),
        "queues": {
            "changes": db.turn.here,
            "exports and large reads": large_reads.here,
            "event streams": hub.listeners,
            "summaries to be kept": len(db.built),
        },
        "categories": categories,
        "public_url": db.settings.public_url,
        "secure_cookies": db.settings.secure_cookies,
        "open_secrets": open_secrets(db.settings),
        "warnings": list(db.settings.warnings),
    }
