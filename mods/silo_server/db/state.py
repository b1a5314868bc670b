# SPDX-License-Identifier: LGPL-2.1-or-later
"""Small facts that all processes of a server share."""

from __future__ import annotations

from sqlalchemy import insert, select, update

from silo_server.db.engine import Tx
from silo_server.db.tables import server_state


def get_state(tx: Tx, key: str) -> str | None:
    """The value kept under ``key``, None where there is none."""
    return tx.conn.scalar(select(server_state.c.value).where(server_state.c.key == key))


def put_state(tx: Tx, key: str, value: str) -> None:
    """Keep ``value`` under ``key``."""
    done = tx.conn.execute(update(server_state).where(server_state.c.key == key).values(value=value))
    if done.rowcount == 0:
        tx.conn.execute(insert(server_state).values(key=key, value=value))
