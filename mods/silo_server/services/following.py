# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a user follows: items with all that is in them, and project folders.

News are what other users changed since the user looked.
"""

from __future__ import annotations

from typing import NamedTuple

from sqlalchemy import delete, func, insert, or_, select

from silo.bom.errors import RejectedError
from silo.bom.message import message
from silo_server.actors import Actor
from silo_server.db.rows import one_of
from silo_server.db.tables import bom_last_syncs, follows, items, product_looks
from silo_server.db.tables import events as event_log
from silo_server.db.transaction import Tx
from silo_server.events import log
from silo_server.services.bom.waiting import waiting_in
from silo_server.services.items import get_by_uuids
from silo_server.services.product.summary import LastChange, Summary
from silo_server.services.product.summary_read import at_once
from silo_server.values import Item

ITEM, FOLDER = "item:", "folder:"

MOST_FOLLOWED = 200


class Followed(NamedTuple):
    """What a user follows: an item or (item None) a folder.

    since
        when the person looked at the item.
    news
        somebody else changed something in it since then.
    waiting
        how many BOMs with something open are in a folder.
    """

    target: str
    item: Item | None
    folder: str
    summary: Summary | None
    changed: LastChange | None
    news: bool
    waiting: int = 0
    since: str = ""


def follow(tx: Tx, target: str, *, on: bool) -> None:
    """Begin or stop following ``item:UUID`` or ``folder:PATH``."""
    kind, _, name = target.partition(":")
    folder = name.strip("/")
    if kind == "item" and get_by_uuids(tx, [name], include_archived=True):
        target = ITEM + name.lower()
    elif kind == "folder" and folder and len(folder) <= 1000:
        target = FOLDER + folder
    else:
        raise RejectedError(
            message("target: wanted an item or a project folder, got {target}", target=repr(target[:80]))
        )
    row, user_id = follows.c, tx.actor.own_id
    tx.conn.execute(delete(follows).where(row.user_id == user_id, row.target == target))
    count = tx.conn.scalar(select(func.count()).select_from(follows).where(row.user_id == user_id)) or 0
    if on and count >= MOST_FOLLOWED:
        raise RejectedError(
            message(
                "you can follow at most {most} items and folders; stop following some first",
                most=MOST_FOLLOWED,
            )
        )
    if on:
        seen = {"seen": tx.stamp, "event": log.bounds(tx)[1]}
        tx.conn.execute(insert(follows).values(user_id=user_id, target=target, **seen))


def is_followed(tx: Tx, user_id: int, item: Item) -> bool:
    """Return True if this user follows the item."""
    row = follows.c
    query = select(row.seen).where(row.user_id == user_id, row.target == ITEM + item.uuid)
    return tx.conn.scalar(query) is not None


def have_seen(tx: Tx) -> None:
    """Mark all news of the person as seen."""
    seen = {"seen": tx.stamp, "event": log.bounds(tx)[1]}
    tx.conn.execute(follows.update().where(follows.c.user_id == tx.actor.own_id).values(seen))


def followed(tx: Tx, actor: Actor, *, whole: bool = True) -> list[Followed]:
    """Read what a user follows, news first. Not ``whole``: does not count the BOMs that wait in folders."""
    rows = tx.conn.execute(select(follows).where(follows.c.user_id == actor.own_id)).all()
    if not rows:
        return []
    by_uuid = {row.target.removeprefix(ITEM): row for row in rows if row.target.startswith(ITEM)}
    items_followed = get_by_uuids(tx, list(by_uuid), include_archived=True)
    sums = at_once(tx, {item.id for item in items_followed})
    look = product_looks.c
    query = select(look.item_id, look.at).where(look.user_id == actor.own_id, one_of(tx, look.item_id, sums))
    looked = dict(tx.conn.execute(query).all())
    subjects = []
    for item in items_followed:
        row, summary = by_uuid[item.uuid], sums.get(item.id)
        changed = summary.changed if summary else None
        last = max(row.seen, looked.get(item.id, ""))
        news = changed is not None and changed.at > last and changed.username != actor.username
        subjects.append(Followed(row.target, item, "", summary, changed, news, since=last))
    for row in rows:
        if row.target.startswith(FOLDER):
            folder = row.target.removeprefix(FOLDER)
            changed = _newest_in(tx, folder, row.event, actor.username)
            waits = waiting_in(tx, folder) if whole else 0
            subjects.append(Followed(row.target, None, folder, None, changed, changed is not None, waits))
    return sorted(
        subjects,
        key=lambda subject: (not subject.news, subject.item.part_number if subject.item else subject.folder),
    )


def _newest_in(tx: Tx, folder: str, after: int, but: str) -> LastChange | None:
    """Find the newest event in the BOMs of a folder, after event ``after``, that is not by user ``but``."""
    event, last = event_log.c, bom_last_syncs.c
    query = (
        select(event.at, event.username, items.c.part_number)
        .join(items, items.c.uuid == event.item_uuid)
        .join(bom_last_syncs, last.parent_id == items.c.id)
        .where(event.id > after, event.username != but)
        .where(or_(last.folder == folder, last.folder.startswith(f"{folder}/", autoescape=True)))
    )
    row = tx.conn.execute(query.order_by(event.id.desc()).limit(1)).one_or_none()
    return None if row is None else LastChange(*row)
