# SPDX-License-Identifier: LGPL-2.1-or-later
"""The audit list: who did what to whom, append-only. Never a secret in it."""

from __future__ import annotations

from dataclasses import dataclass

from sqlalchemy import insert, select

from silo_server.db.engine import Tx, newest_first
from silo_server.db.tables import audit
from silo_server.values import from_row


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
    """Write one line, together with what it records."""
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
    """The newest entries first; ``before`` and ``after`` are ids to page on and back."""
    rows = newest_first(tx, select(audit), audit.c.id, limit, before, after)
    return [from_row(AuditEntry, row) for row in rows]
