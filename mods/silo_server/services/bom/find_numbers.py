# SPDX-License-Identifier: LGPL-2.1-or-later
"""The find numbers of the lines that a change of a BOM brings (:mod:`silo.bom.find_numbers` has the rule).

A line that comes back, by undo or restore, keeps its number unless another line has it by now. A line that
CAD owns and that is older than the rule gets its number with the next merge that changes the BOM.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace

from sqlalchemy import select, update

from silo.bom.find_numbers import NewLine, give_numbers
from silo_server.db.tables import bom_lines, items
from silo_server.db.transaction import Tx
from silo_server.services.bom.line_record import ChangeKind, LineRecord
from silo_server.services.bom.lines import select_lines, to_line
from silo_server.user_json import dumps
from silo_server.values import Item

BY_HAND = (ChangeKind.EDIT, ChangeKind.IMPORT)


def with_numbers(tx: Tx, parent: Item, changes: Sequence[LineRecord], kind: ChangeKind) -> list[LineRecord]:
    """Give the new lines among the changes their numbers, and keep those of removed lines from reuse."""
    older = _unnumbered(tx, parent, changes) if kind is ChangeKind.MERGE and changes else []
    every = [*(change if kind in BY_HAND else _keeping(change) for change in changes), *older]
    new = sorted(
        (change for change in every if _is_new(change, kind)), key=lambda change: change.position or 0
    )
    gone_now = [change for change in changes if change.before is not None and change.after is None]
    if not new and not gone_now:
        return every
    row, changed = bom_lines.c, {change.line_id: change for change in every}
    there = dict(tx.conn.execute(select(row.id, row.find_number).where(row.parent_id == parent.id)).all())
    there |= {line_id: change.after and change.after.find_number for line_id, change in changed.items()}
    for change in new:
        there.pop(change.line_id, None)
    stored = tx.conn.scalar(select(items.c.gone_find_numbers).where(items.c.id == parent.id))
    before: dict[str, int] = json.loads(stored or "{}")
    gone = before | {
        change.before.find_number: change.child_id
        for change in gone_now
        if change.before is not None and change.before.find_number
    }
    asking = [
        NewLine(change.child_id, change.after.find_number if change.after else None, kind in BY_HAND)
        for change in new
    ]
    numbers, left = give_numbers(asking, filter(None, there.values()), gone, tx.settings.find_number_step)
    given = {change.line_id: number for change, number in zip(new, numbers, strict=True)}
    left = {number: part for number, part in left.items() if number not in there.values()}
    if left != before:
        text = dumps(left) if left else None
        tx.conn.execute(update(items).where(items.c.id == parent.id).values(gone_find_numbers=text))
    return [
        replace(change, after=replace(change.after, find_number=given[change.line_id]))
        if change.after is not None and change.line_id in given
        else change
        for change in every
    ]


def forget_gone(tx: Tx, item: Item) -> None:
    """Let the numbers of removed lines be given again: the item is released."""
    tx.conn.execute(update(items).where(items.c.id == item.id).values(gone_find_numbers=None))


def _keeping(change: LineRecord) -> LineRecord:
    """Keep the number of a line in a state from before it had one."""
    if change.before is None or change.after is None or change.after.find_number:
        return change
    return replace(change, after=replace(change.after, find_number=change.before.find_number))


def _is_new(change: LineRecord, kind: ChangeKind) -> bool:
    """Report whether a change brings a line that needs a number."""
    if change.after is None:
        return False
    of_cad = kind is ChangeKind.MERGE and not change.after.find_number
    return change.before is None or of_cad


def _unnumbered(tx: Tx, parent: Item, changes: Sequence[LineRecord]) -> list[LineRecord]:
    """Find CAD's lines without a number that this change does not touch."""
    row, touched = bom_lines.c, {change.line_id for change in changes}
    query = select_lines().where(row.parent_id == parent.id, row.find_number.is_(None))
    lines = map(to_line, tx.conn.execute(query.where(row.source == "assembly").order_by(row.position)))
    return [
        LineRecord(line.id, line.child_id, line.state, line.state, line.position)
        for line in lines
        if line.id not in touched
    ]
