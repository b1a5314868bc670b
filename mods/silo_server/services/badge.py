# SPDX-License-Identifier: LGPL-2.1-or-later
"""The number beside a user's name, on every page: the open BOMs that the user settles, and the news."""

from __future__ import annotations

from sqlalchemy import select

from silo_server.actors import Actor
from silo_server.db.tables import assignees
from silo_server.db.transaction import Tx
from silo_server.services.bom.waiting import open_among
from silo_server.services.following import followed


def badge(tx: Tx, actor: Actor) -> int:
    """Count what waits for a decision: the open BOMs that are theirs, and the news of what they follow."""
    theirs = select(assignees.c.item_id).where(assignees.c.user_id == actor.own_id)
    ids = list(tx.conn.scalars(theirs))
    mine = open_among(tx, ids) if ids else 0
    return mine + sum(subject.news for subject in followed(tx, actor, whole=False))
