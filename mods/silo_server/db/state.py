# SPDX-License-Identifier: LGPL-2.1-or-later
"""Values that the server as a whole keeps under a key, such as its mode."""

from __future__ import annotations

from sqlalchemy import select, text

from silo_server.db.tables import server_state
from silo_server.db.transaction import Tx


def mode_of(tx: Tx) -> str:
    """Read the mode, ``normal`` or ``read-only``: of the settings, else of the database (all processes)."""
    if tx.settings.read_only:
        return "read-only"
    return get_state(tx, "mode") or "normal"


def get_state(tx: Tx, key: str) -> str | None:
    """Read the value that is stored under ``key``; None if there is none."""
    return tx.conn.scalar(select(server_state.c.value).where(server_state.c.key == key))


def put_state(tx: Tx, key: str, value: str) -> None:
    """Store ``value`` under ``key``."""
    # In one statement: another process may store the first value under this key at the same moment.
    put = "INSERT INTO server_state VALUES (:key, :value) ON CONFLICT (key) DO UPDATE SET value = :value"
    tx.conn.execute(text(put), {"key": key, "value": value})
