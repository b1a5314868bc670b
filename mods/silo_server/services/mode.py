# SPDX-License-Identifier: LGPL-2.1-or-later
"""The mode of the server: normal, or read-only for a while."""

from __future__ import annotations

from silo_server.db.state import mode_of, put_state
from silo_server.db.transaction import Tx
from silo_server.events import announce
from silo_server.services import audit


def change_mode(tx: Tx, mode: str) -> str:
    """Set the mode, ``normal`` or ``read-only`` (no changes); return the mode that now counts."""
    audit.note(tx, "mode.set", mode, f"{mode_of(tx)} → {mode}")
    put_state(tx, "mode", mode)
    announce.server_state(tx, mode_of(tx))
    return mode_of(tx)
