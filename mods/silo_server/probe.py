# SPDX-License-Identifier: LGPL-2.1-or-later
"""Whether the database and the file store are there.

``/health`` and ``/ready`` answer while every other thread and connection is taken: the probe has a thread of
its own.
"""

from __future__ import annotations

import asyncio
import shutil
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from sqlalchemy.exc import SQLAlchemyError

from silo_server.db.database import Database
from silo_server.db.state import mode_of
from silo_server.services.file_store import FileStore

# [s] How long /health and /ready wait for a probe.
HEALTH_SECONDS, READY_SECONDS = 0.2, 2.0
# [bytes] With less, a database soon cannot write what is asked of it.
MIN_FREE = 64 * 1024 * 1024


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
