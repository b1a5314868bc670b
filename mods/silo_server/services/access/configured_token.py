# SPDX-License-Identifier: LGPL-2.1-or-later
"""The token that the server's environment names (``SILO_API_TOKEN``).

A new value takes the place of the one before; a secret that others may know is refused.
"""

from __future__ import annotations

import re

from sqlalchemy import select

from silo.bom.errors import ConfigError
from silo.bom.message import message
from silo_server.db.tables import api_tokens, users
from silo_server.db.transaction import Tx
from silo_server.services.access.credentials import end_below
from silo_server.services.access.tokens import CONFIGURED, create_token, secret_hash
from silo_server.services.audit import note
from silo_server.times import wire_time

SHORTEST_SECRET = 20

_PLACEHOLDER = re.compile(
    "change.?me|change.?this|example|placeholder|your.?(own|token|secret)", re.IGNORECASE
)


def take_configured_token(tx: Tx, user_id: int, secret: str) -> str:
    """Make the secret of the server's environment a token of the user, and revoke its predecessors.

    Returns why it lets no one in, or "" if it works. A token that was revoked stays revoked.
    """
    query = select(api_tokens, users.c.active).join(users, users.c.id == api_tokens.c.user_id)
    row = tx.conn.execute(query.where(api_tokens.c.token_hash == secret_hash(secret))).one_or_none()
    if row is None:
        create_token(tx, user_id, CONFIGURED, secret=secret)
    elif row.revoked_at is not None:
        return message("it was revoked on {revoked_at}", revoked_at=wire_time(row.revoked_at))
    elif not row.active or (row.expires_at is not None and row.expires_at <= tx.stamp):
        return (
            message("its user is not active")
            if not row.active
            else message("it ended on {expires_at}", expires_at=wire_time(row.expires_at))
        )
    others = (api_tokens.c.name == CONFIGURED) & (api_tokens.c.token_hash != secret_hash(secret))
    gone = select(api_tokens.c.credential_id).where(others, api_tokens.c.revoked_at.is_(None))
    if replaced := list(tx.conn.scalars(gone)):
        # Who changes the secret may do so because it leaked: what was made with it ends as well.
        ended = end_below(tx, replaced, themselves=True)
        note(tx, "token.revoked", CONFIGURED, f"the environment has another; {ended} ended")
    return ""


def check_configured_secret(secret: str) -> None:
    """Raise ConfigError for a secret of the environment that others may guess or have read."""
    if not secret.isascii() or not secret.isprintable() or " " in secret:
        problem = message("visible ASCII characters without spaces, got others")
    elif _PLACEHOLDER.search(secret):
        problem = message("a secret of your own, got a placeholder that others know")
    elif len(secret) < SHORTEST_SECRET:
        problem = message(
            "at least {least} characters, got {length}", least=SHORTEST_SECRET, length=len(secret)
        )
    else:
        return
    raise ConfigError(
        message(
            "{variable}: wanted {problem}. This makes one: echo silo_$(openssl rand -hex 20)",
            variable=CONFIGURED,
            problem=problem,
        )
    )
