# SPDX-License-Identifier: LGPL-2.1-or-later
"""News from other processes of the server, by PostgreSQL's NOTIFY."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable

from silo_server.db.database import Database
from silo_server.errors import cause_of

logger = logging.getLogger("silo_server.events")


class PostgresListener:
    """A thread that waits for NOTIFY on its own connection and comes back when that is lost."""

    def __init__(self, db: Database, heard: Callable[[], None], access: Callable[[], None]) -> None:
        self._db = db
        self._heard, self._access = heard, access
        self._away = False
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="silo-listen", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        self._stopping.set()
        self._thread.join(timeout=5)

    def _run(self) -> None:
        from psycopg import Error

        while not self._stopping.is_set():
            try:
                self._listen()
            except (Error, OSError) as error:
                if not self._away:
                    logger.warning("PostgreSQL cannot be listened to, trying again: %s", cause_of(error))
                self._away = True
                self._stopping.wait(1.0)

    def _listen(self) -> None:
        import psycopg

        from silo_server.db.transaction import EVENT_CHANNEL

        url = self._db.engine.url.set(drivername="postgresql").render_as_string(hide_password=False)
        with psycopg.connect(url, autocommit=True) as connection:
            connection.execute(psycopg.sql.SQL("LISTEN {}").format(psycopg.sql.Identifier(EVENT_CHANNEL)))
            self._away = False
            self._heard()  # what happened before the LISTEN is in the log
            self._access()
            while not self._stopping.is_set():
                for notice in connection.notifies(timeout=0.5):
                    (self._access if notice.payload == "access" else self._heard)()
                    if self._stopping.is_set():
                        return
