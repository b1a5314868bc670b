# SPDX-License-Identifier: LGPL-2.1-or-later
"""The BOMs that wait for a person: unreferenced lines, conflicts, syncs that left something out.

Every page shows how many there are, so finding them reads nothing but what waits (``db.tables.UNREFERENCED``,
``INCOMPLETE``).
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy import func, select, text

from silo.bom.diff import same_quantity
from silo.bom.errors import VersionConflictError
from silo.bom.left_out import Reason
from silo_server.db.bulk import one_of
from silo_server.db.engine import Tx
from silo_server.db.tables import INCOMPLETE, UNREFERENCED, bom_conflicts, bom_last_syncs, bom_lines, items
from silo_server.services.bom.last_sync import NEVER, LastSync, last_syncs
from silo_server.services.bom.review import Action, Decision, resolve, review
from silo_server.services.items import by_ids, get_item
from silo_server.values import Item


@dataclass(frozen=True, slots=True)
class Waiting:
    """A BOM that waits, and for what. ``left_out`` counts what was left out, but the unregistered.

    mark
        of what a decision is about: the BOM's version, and what CAD says of its conflicts.
    """

    item: Item
    mark: str
    last: LastSync
    unreferenced: int
    conflicts: int
    left_out: int
    unregistered: int

    @property
    def total(self) -> int:
        """All that waits."""
        return self.unreferenced + self.conflicts + self.left_out + self.unregistered


def waiting(tx: Tx) -> list[Waiting]:
    """All BOMs that wait, by part number; archived assemblies wait for nobody."""
    unreferenced, conflicts, gaps = _unreferenced(tx), _conflicts(tx), _incomplete(tx)
    found = by_ids(tx, {*unreferenced, *conflicts, *gaps})
    syncs = last_syncs(tx, found)
    rows = []
    for item_id, item in found.items():
        if item.archived_at:
            continue
        last = syncs.get(item_id, NEVER)
        missing = sum(gap["reason"] == Reason.UNREGISTERED for gap in last.gaps)
        rows.append(
            Waiting(
                item,
                _mark(item, conflicts.get(item_id, {})),
                last,
                unreferenced.get(item_id, 0),
                len(conflicts.get(item_id, ())),
                len(last.gaps) - missing,
                missing,
            )
        )
    return sorted(rows, key=lambda row: row.item.part_number.casefold())


def waiting_count(tx: Tx) -> int:
    """How many BOMs wait."""
    ids = {*_unreferenced(tx), *_conflicts(tx), *_incomplete(tx)}
    if not ids:
        return 0
    alive = (
        select(func.count())
        .select_from(items)
        .where(one_of(tx, items.c.id, ids), items.c.archived_at.is_(None))
    )
    return tx.conn.scalar(alive) or 0


def _mark(item: Item, conflicts: Mapping[int, float]) -> str:
    # A sync that only brings other conflicts changes no line, and so not the version.
    told = hashlib.sha256(repr(sorted(conflicts.items())).encode()).hexdigest()[:16]
    return f"{item.bom_version}-{told}"


def decide_all(tx: Tx, part_number: str, action: Action, reason: str | None, seen: str) -> int:
    """Decide the same about all unreferenced lines (``remove``, ``keep``) or all conflicts of a BOM.

    seen
        the mark of what the person saw.
    Returns how many lines there were. VersionConflictError where the BOM is not the one that was seen.
    """
    open_lines = review(tx, get_item(tx, part_number, lock=True).part_number)
    about_conflicts = action in (Action.TAKE_CAD, Action.KEEP_SILO)
    lines = [one.line for one in open_lines.conflicts] if about_conflicts else open_lines.unreferenced
    decisions = [Decision(line.child_part_number, action, reason, line.id) for line in lines]
    if decisions:
        conflicts = {one.line.child_id: one.cad_quantity for one in open_lines.conflicts}
        if seen != _mark(open_lines.parent, conflicts):
            raise VersionConflictError(f"the BOM of {part_number} is not as it was seen")
        resolve(tx, part_number, decisions)
    return len(decisions)


def _unreferenced(tx: Tx) -> Counter[int]:
    query = select(bom_lines.c.parent_id, func.count()).where(text(f"bom_lines.{UNREFERENCED}"))
    return Counter({row[0]: row[1] for row in tx.conn.execute(query.group_by(bom_lines.c.parent_id))})


def _conflicts(tx: Tx) -> dict[int, dict[int, float]]:
    """Parent → child → what CAD says, by the rule of ``review.open_conflicts``, for all BOMs."""
    same = (bom_lines.c.parent_id == bom_conflicts.c.parent_id) & (
        bom_lines.c.child_id == bom_conflicts.c.child_id
    )
    query = (
        select(
            bom_conflicts.c.parent_id,
            bom_conflicts.c.child_id,
            bom_conflicts.c.cad_quantity,
            bom_lines.c.quantity,
        )
        .join(bom_lines, same)
        .where(~bom_conflicts.c.accepted, bom_lines.c.source == "manual", bom_lines.c.rel_type == "component")
    )
    found: dict[int, dict[int, float]] = {}
    for row in tx.conn.execute(query):
        if not same_quantity(row.quantity, row.cad_quantity):
            found.setdefault(row.parent_id, {})[row.child_id] = row.cad_quantity
    return found


def _incomplete(tx: Tx) -> Sequence[int]:
    return tx.conn.scalars(select(bom_last_syncs.c.parent_id).where(text(f"({INCOMPLETE})"))).all()
