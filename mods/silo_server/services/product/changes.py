# SPDX-License-Identifier: LGPL-2.1-or-later
"""What changed in a product, over all levels, between two times.

Lines, quantities, and the data and files of its parts are compared.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from sqlalchemy import select

from silo.bom.message import message
from silo.bom.quantities import plain
from silo.file_kind import MODEL
from silo_server.db.rows import one_of
from silo_server.db.tables import bom_changes, documents, revisions
from silo_server.db.transaction import Tx
from silo_server.services.bom.differences import Difference, compare
from silo_server.services.bom.history import PastLine, change_at, state_at
from silo_server.services.bom.lines import lines_of_many
from silo_server.services.items import by_ids
from silo_server.values import Item, LineState


class PastChange(NamedTuple):
    """One thing that differs in a product between two times, and who did it last ("" if it is not known).

    what
        ``added``, ``removed``, ``quantity`` or ``line`` of a BOM, ``data`` or ``file`` of an item.
    within
        the BOM of a line; "" for an item.
    """

    what: str
    within: str
    part_number: str
    name: str
    before: str
    after: str
    at: str
    username: str


def what_changed(tx: Tx, root: Item, since: str, until: str) -> list[PastChange]:
    """Find what differs in a product between two times, by item.

    Items that were added or removed are not compared themselves.
    """
    since, until = sorted((since, until))
    walked = _Walked(tx, since, until)
    happenings: list[PastChange] = []
    before, after = (walked.reached(root.id, side) for side in (0, 1))
    common = before & after
    numbers = by_ids(tx, walked.changed.keys() & common)
    for item_id, parent in numbers.items():
        at, who = walked.changed[item_id]
        for difference in compare(*walked.states[item_id]):
            if difference.status != "unchanged":
                happenings.append(line_happened(parent.part_number, difference, at, who))
    happenings += _items_happened(tx, common, since, until)
    return in_order(happenings)


def in_order(happenings: Iterable[PastChange]) -> list[PastChange]:
    """Sort changes by BOM or item."""
    return sorted(
        happenings, key=lambda change: (change.within or change.part_number, change.part_number, change.what)
    )


class _Walked:
    """The BOMs of a product at two times; those without a change since the first are read as they are."""

    def __init__(self, tx: Tx, since: str, until: str) -> None:
        self._tx, self._since, self._until = tx, since, until
        self._children: dict[int, tuple[set[int], set[int]]] = {}
        self.states: dict[int, tuple[list[PastLine], list[PastLine]]] = {}
        self.changed: dict[int, tuple[str, str]] = {}

    def reached(self, root: int, side: int) -> set[int]:
        """Find all items of the product at the first time (``side`` 0) or at the second (1)."""
        seen, level = {root}, {root}
        while level:
            self._load(level - self._children.keys())
            level = set[int]().union(*(self._children[item_id][side] for item_id in level)) - seen
            seen |= level
        return seen

    def _load(self, ids: Collection[int]) -> None:
        tx, row = self._tx, bom_changes.c
        query = select(row.parent_id, row.at, row.username).where(row.at > self._since)
        for parent_id, at, who in tx.conn.execute(
            query.where(one_of(tx, row.parent_id, ids)).order_by(row.id)
        ):
            if at <= self._until or parent_id not in self.changed:
                self.changed[parent_id] = (at, who)
        lines = lines_of_many(tx, [item_id for item_id in ids if item_id not in self.changed])
        for item_id in ids:
            now = {line.child_id for line in lines.get(item_id, ()) if line.state.rel_type == "component"}
            self._children[item_id] = (now, now)
        for item in by_ids(tx, self.changed.keys() & ids).values():
            then, later = (
                state_at(tx, item, change_at(tx, item, when)) for when in (self._since, self._until)
            )
            self.states[item.id] = (then, later)
            sides = (
                {line.child.id for line in state if line.state.rel_type == "component"}
                for state in (then, later)
            )
            self._children[item.id] = (next(sides), next(sides))


def line_happened(within: str, difference: Difference, at: str, who: str) -> PastChange:
    what = difference.status
    before, after = (
        "" if state is None else f"{plain(state.quantity)} {state.unit or ''}".rstrip()
        for state in (difference.before, difference.after)
    )
    if what == "changed":
        others = [name for name in difference.fields if name not in ("quantity", "unit", *_BESIDE)]
        what = "line" if others else "quantity" if before != after else "line"
        if what == "line":
            names = others or list(difference.fields)
            before, after = (_fields(state, names) for state in (difference.before, difference.after))
    return PastChange(
        what, within, difference.child.part_number, difference.child.name, before, after, at, who
    )


# What changes with a quantity, or when CAD loses and finds a line.
_BESIDE = ("source", "override", "cad_quantity")


def _fields(state: LineState | None, names: Sequence[str]) -> str:
    values = ((name.replace("_", " "), getattr(state, name)) for name in names)
    return "; ".join(f"{name}: {_text(value)}" for name, value in values)


def _text(value: Any) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(map(str, value)) or "–"
    return "–" if value in (None, "", {}, False) else "yes" if value is True else str(value)[:200]


def _items_happened(tx: Tx, ids: Collection[int], since: str, until: str) -> Iterator[PastChange]:
    row = revisions.c
    within = one_of(tx, row.item_id, ids) & (row.created_at <= until)
    touched = set(tx.conn.scalars(select(row.item_id).where(within, row.created_at > since).distinct()))
    query = select(revisions).where(one_of(tx, row.item_id, touched), row.created_at <= until)
    items_before: dict[int, list[Any]] = {}
    for record in tx.conn.execute(query.order_by(row.item_id, row.revision_number)):
        items_before.setdefault(record.item_id, []).append(record)
    for item in by_ids(tx, touched).values():
        rows = items_before[item.id]
        old = [record for record in rows if record.created_at <= since]
        last = rows[-1]
        sides = json.loads(old[-1].properties) if old else {}, json.loads(last.properties)
        if differences := data_differs(*sides):
            what = ("data", "", item.part_number, item.name, *differences)
            yield PastChange(*what, last.created_at, last.created_by)
        files = [record for record in rows if record.kind == MODEL]
        older = [file for file in files if file.created_at <= since]
        if files and (not older or older[-1].file_checksum != files[-1].file_checksum):
            newest = files[-1]
            before, after = (_file(versions) for versions in (older, files))
            what = ("file", "", item.part_number, item.name, before, after)
            yield PastChange(*what, newest.created_at, newest.created_by)
    yield from _attachments_happened(tx, ids, since, until)


def _attachments_happened(tx: Tx, ids: Collection[int], since: str, until: str) -> Iterator[PastChange]:
    doc, row = documents.c, revisions.c
    query = (
        select(doc.attached_to, doc.removed_at, revisions)
        .join(revisions, row.document_id == doc.id)
        .where(one_of(tx, doc.attached_to, ids), row.created_at <= until)
        .order_by(doc.id, row.revision_number)
    )
    attachments: dict[int, list[Any]] = {}
    for record in tx.conn.execute(query):
        if record.removed_at is None or record.removed_at > since:
            attachments.setdefault(record.document_id, []).append(record)
    named = by_ids(tx, {rows[0].attached_to for rows in attachments.values()})
    for rows in attachments.values():
        older = [record for record in rows if record.created_at <= since]
        removed = rows[-1].removed_at is not None and rows[-1].removed_at <= until
        later = [] if removed else rows
        if bool(older) == bool(later) and len(older) == len(later):
            continue
        item, newest = named[rows[0].attached_to], rows[-1]
        what = ("file", "", item.part_number, item.name, _file(older), _file(later))
        # Who removed an attachment is in the log of events only.
        by = (newest.removed_at, "") if removed else (newest.created_at, newest.created_by)
        yield PastChange(*what, *by)


def data_differs(then: Mapping[str, Any], now: Mapping[str, Any]) -> tuple[str, str] | None:
    """Describe the values that differ, before and after; None if none does."""
    names = sorted(name for name in then.keys() | now.keys() if then.get(name) != now.get(name))
    before, after = ("; ".join(f"{name}: {_text(side.get(name))}" for name in names) for side in (then, now))
    return (before, after) if names else None


def _file(revisions_with_file: Sequence[Any]) -> str:
    last = revisions_with_file[-1] if revisions_with_file else None
    return (
        message("{file}, revision {revision}", file=last.file_name, revision=last.revision_number)
        if last
        else ""
    )
