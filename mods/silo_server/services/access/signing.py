# SPDX-License-Identifier: LGPL-2.1-or-later
"""The secret by which this server knows again what it wrote itself; in the database, for all processes."""

from __future__ import annotations

import secrets

from silo_server.db.state import get_state, put_state
from silo_server.db.transaction import Tx

_STATE = "signing_key"


def ensure_signing_key(tx: Tx) -> None:
    """Make the secret if there is none yet."""
    if get_state(tx, _STATE) is None:
        put_state(tx, _STATE, secrets.token_hex(32))


def signing_key(tx: Tx) -> bytes:
    """Return the secret, which :func:`ensure_signing_key` made at the start."""
    kept = get_state(tx, _STATE)
    assert kept is not None
    return bytes.fromhex(kept)
