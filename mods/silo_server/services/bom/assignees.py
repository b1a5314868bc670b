# SPDX-License-Identifier: LGPL-2.1-or-later
"""The assignee of a BOM: the editor who settles what is open in it."""

from __future__ import annotations

from sqlalchemy import delete, insert, select

from silo.bom.errors import ForbiddenError
from silo.bom.message import message
from silo_server.actors import Role
from silo_server.db.tables import assignees, users
from silo_server.db.transaction import Tx
from silo_server.services import audit
from silo_server.services.access.users import get_user, list_users
from silo_server.services.items import get_item
from silo_server.values import Item


def assign(tx: Tx, part_number: str, username: str) -> None:
    """Let a user settle what is open in a BOM; username "": no one in particular."""
    item = get_item(tx, part_number, lock=True)
    tx.conn.execute(delete(assignees).where(assignees.c.item_id == item.id))
    if username:
        user = get_user(tx, username)
        if not (user.active and user.role.covers(Role.EDITOR)):
            raise ForbiddenError(
                message(
                    "{username} cannot change BOMs, so cannot settle what is open in one",
                    username=user.username,
                )
            )
        tx.conn.execute(insert(assignees).values(item_id=item.id, user_id=user.id, at=tx.stamp))
    audit.note(tx, "bom.assigned", item.part_number, username or "nobody")


def assignee_of(tx: Tx, item: Item) -> str:
    """Return the name of the person who settles what is open in a BOM; "" if no one in particular does."""
    query = select(users.c.username).join(assignees, assignees.c.user_id == users.c.id)
    return tx.conn.scalar(query.where(assignees.c.item_id == item.id)) or ""


def editors(tx: Tx) -> list[str]:
    """List the names of all users who may settle what is open."""
    return [user.username for user in list_users(tx) if user.active and user.role.covers(Role.EDITOR)]
