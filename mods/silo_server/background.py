# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a server does beside its requests, on threads of its own: nobody waits for it, it waits for nobody.

:class:`Later` writes down when tokens were used, and keeps summaries of products. :class:`Probe` looks
whether the database and the file store are there, so that ``/health`` and ``/ready`` answer while every other
thread and connection is taken.
"""

from __future__ import annotations

import asyncio
import logging
import shutil
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from sqlalchemy.exc import SQLAlchemyError

from silo.bom.errors import SiloError
from silo_server.db.engine import Database, mode_of
from silo_server.services.access.credentials import note_token_uses
from silo_server.services.bom.summary import keep_looks, keep_summaries
from silo_server.services.revisions import FileStore
from silo_server.settings import cause_of

logger = logging.getLogger("silo_server")

LATER_SECONDS = 1.0
# [s] A probe that takes longer says no for the time being.
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
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """Write the rest down, and end; a database that hangs is not waited for."""
        self._stopping.set()
        self._thread.join(timeout=2)

    def _run(self) -> None:
        ending = False
        while not ending:
            ending = self._stopping.wait(LATER_SECONDS)
            try:
                note_token_uses(self._db)
                keep_summaries(self._db, self._stopping.is_set)
                keep_looks(self._db)
            except (SQLAlchemyError, SiloError) as error:
                logger.debug("the uses of tokens and the summaries are kept later: %s", cause_of(error))


@dataclass(frozen=True, slots=True)
class State:
    """How a server is. ``files``: ok, unwritable or full (so is ``database``, or unreachable)."""

    mode: str
    database: str
    files: str

    @property
    def ready(self) -> bool:
        """True where it can do all of its work."""
        return self.database == self.files == "ok"


class Probe:
    """Looks at the database and the store on a thread of its own, one look at a time."""

    def __init__(self, db: Database, files: FileStore) -> None:
        self._db = db
        self._files = files
        self._executor = ThreadPoolExecutor(1, "silo-probe")
        self._running: asyncio.Future[State] | None = None
        self.last = State("normal", "ok", "ok")

    async def look(self, seconds: float) -> State | None:
        """How the server is now, None where that does not turn out within ``seconds``."""
        if self._running is None or self._running.done():
            self._running = asyncio.get_running_loop().run_in_executor(self._executor, self._look)
        running = self._running  # while this one waits, another caller may begin the next look
        done, _ = await asyncio.wait({running}, timeout=seconds)
        return running.result() if done else None

    def stop(self) -> None:
        """Take no more looks."""
        self._executor.shutdown(wait=False, cancel_futures=True)

    def _look(self) -> State:
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
        self.last = State(mode if files == database == "ok" else "degraded", database, files)
        return self.last


def has_space(folder: Path, wanted: int) -> bool:
    """True where the disk of this folder has so many bytes free; also where nobody can say."""
    try:
        return shutil.disk_usage(folder).free >= wanted
    except OSError:
        return True
