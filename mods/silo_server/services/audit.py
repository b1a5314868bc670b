# SPDX-License-Identifier: LGPL-2.1-or-later
"""The audit list: who did what.

It is append-only, and never has a secret in it.
"""

from __future__ import annotations

from dataclasses import dataclass

from sqlalchemy import insert, select

from silo_server.db.rows import newest_first
from silo_server.db.tables import audit
from silo_server.db.transaction import Tx
from silo_server.fields import from_row


@dataclass(frozen=True, slots=True)
class AuditEntry:
    """One line of the audit list."""

    id: int
    at: str
    username: str
    action: str
    target: str
    detail: str
    address: str


def note(tx: Tx, action: str, target: str = "", detail: str = "") -> None:
    """Write a line of the audit list, in the same transaction as what it records."""
    tx.conn.execute(
        insert(audit).values(
            at=tx.stamp,
            username=tx.actor.username,
            action=action,
            target=target,
            detail=detail,
            address=tx.actor.address[:64],
        )
    )


def list_entries(
    tx: Tx, limit: int = 100, before: int | None = None, after: int | None = None
) -> list[AuditEntry]:
    """Read the audit list, newest first; ``before`` and ``after`` are ids to page from."""
    rows = newest_first(tx, select(audit), audit.c.id, limit, before, after)
    return [from_row(AuditEntry, row) for row in rows]
