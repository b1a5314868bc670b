# SPDX-License-Identifier: LGPL-2.1-or-later
"""The time that a user names: a date, a time with its zone, or a revision."""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta

from sqlalchemy import select

from silo.api.wire import RELEASE_LABEL
from silo.bom.errors import NotFoundError, RejectedError
from silo.bom.message import message
from silo.bom.numbers import whole_number
from silo_server.db.tables import revisions
from silo_server.db.transaction import Tx
from silo_server.times import stamp
from silo_server.values import Item


def moment(tx: Tx, item: Item, text: str, *, end: bool = False) -> str:
    """Read the time that a user names: a date (its ``end``), a time, or a revision such as ``r3``.

    Returns it as stored. Raises RejectedError; NotFoundError for a revision, frozen or not, that the item
    does not have.
    """
    if text.startswith("r") and (number := whole_number(text[1:], 9)) is not None:
        row = revisions.c
        value = tx.conn.scalar(
            select(row.created_at).where(row.item_id == item.id, row.revision_number == number)
        )
        if value is None:
            raise NotFoundError(
                message(
                    "{part_number} has no revision {revision}", part_number=item.part_number, revision=number
                )
            )
        return str(value)
    try:
        when = datetime.fromisoformat(text.replace(" ", "+"))
        if when.tzinfo is None and len(text) == 10:
            when = when.replace(tzinfo=UTC) + timedelta(days=int(end))
        if when.tzinfo is not None:
            return stamp(when)
    except (ValueError, OverflowError):
        pass
    is_label = re.fullmatch(RELEASE_LABEL, text, re.ASCII)
    raise (NotFoundError if is_label else RejectedError)(
        message(
            "wanted a date such as 2026-02-08, a time with its zone such as 2026-02-08T22:15:00Z, a "
            "revision of {part_number} such as r3, or one of its frozen revisions, got {time}",
            part_number=item.part_number,
            time=repr(text[:60]),
        )
    )
