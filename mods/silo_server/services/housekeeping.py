# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is thrown away, and when: at each start and every ten minutes after."""

from __future__ import annotations

from datetime import timedelta

from sqlalchemy import delete

from silo_server.clock import stamp
from silo_server.db.engine import Tx
from silo_server.db.tables import api_tokens, bom_syncs, login_links, sessions
from silo_server.services import events

START_TOKEN = "given out at start"
# For so long a client may be away and still get its first answer to a repeated request.
SYNC_DAYS = 90.0


def clear_away(tx: Tx) -> None:
    """Forget what is over: sessions, links, start tokens, old sync answers, events beyond the log's size."""
    now = tx.stamp
    tx.conn.execute(delete(sessions).where(sessions.c.expires_at <= now))
    tx.conn.execute(delete(login_links).where(login_links.c.expires_at <= now))
    tx.conn.execute(
        delete(api_tokens).where(api_tokens.c.name == START_TOKEN, api_tokens.c.expires_at <= now)
    )
    tx.conn.execute(delete(bom_syncs).where(bom_syncs.c.at <= stamp(tx.at - timedelta(days=SYNC_DAYS))))
    events.trim(tx, tx.settings.event_log_size)
