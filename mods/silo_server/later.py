# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is written down after its request: the uses of tokens, looks at products, and kept summaries.

A thread of its own does it: no request waits for it, and it waits for none.
"""

from __future__ import annotations

import logging
import threading
from functools import partial

from sqlalchemy.exc import SQLAlchemyError

from silo.bom.errors import SiloError
from silo_server.db.database import Database
from silo_server.errors import cause_of
from silo_server.services.access.tokens import note_token_uses
from silo_server.services.looks import keep_looks
from silo_server.services.product.summary_keep import keep_summaries

logger = logging.getLogger("silo_server.housekeeping")

LATER_SECONDS = 1.0


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
