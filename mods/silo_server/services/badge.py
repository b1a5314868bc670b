# SPDX-License-Identifier: LGPL-2.1-or-later
"""The number beside a user's name, on every page: the open BOMs that the user settles, the reviews that wait
for the user's approval, and the news."""

from __future__ import annotations

from sqlalchemy import select

from silo_server.actors import Actor
from silo_server.db.tables import assignees
from silo_server.db.transaction import Tx
from silo_server.services.bom.waiting import open_among
from silo_server.services.following import followed
from silo_server.services.releases import reviews_for


def badge(tx: Tx, actor: Actor) -> int:
    """Count what waits for a user: the open BOMs that are theirs, their reviews, the news of what they
    follow."""
    theirs = select(assignees.c.item_id).where(assignees.c.user_id == actor.own_id)
    ids = list(tx.conn.scalars(theirs))
    mine = open_among(tx, ids) if ids else 0
    return (
        mine + len(reviews_for(tx, actor)) + sum(subject.news for subject in followed(tx, actor, whole=False))
    )
