# SPDX-License-Identifier: LGPL-2.1-or-later
"""The BOMs that wait for a reviewer.

Every page shows how many BOMs wait, so finding them reads nothing but what waits
(``db.tables.UNREFERENCED``, ``INCOMPLETE``).
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Callable, Collection
from typing import NamedTuple

from sqlalchemy import ColumnElement, func, or_, select, text, true, union

from silo.bom.left_out import Reason
from silo.bom.units import PIECES, line_unit, unit_of
from silo_server.db.rows import one_of
from silo_server.db.tables import (
    INCOMPLETE,
    UNREFERENCED,
    WITH_UNIT,
    assignees,
    bom_last_syncs,
    bom_lines,
    held_boms,
    items,
    users,
)
from silo_server.db.transaction import Tx
from silo_server.services.bom.conflicts import CadQuantities, conflicts_in
from silo_server.services.bom.held import HeldBom, all_held


class Waiting(NamedTuple):
    """A BOM that waits, and for what. ``left_out`` counts what was left out, without unregistered parts.

    cad_quantities
        CAD's quantities in its conflicts, by the child's internal id.
    units
        how many lines have a unit of another kind than their part's.
    held
        the BOM that waits on a designer's computer; None if none does.
    """

    item_id: int
    part_number: str
    name: str
    version: int
    folder: str
    document_file: str
    synced_at: str | None
    cad_quantities: CadQuantities
    assignee: str
    unreferenced: int
    left_out: int
    unregistered: int
    units: int
    held: HeldBom | None

    @property
    def conflicts(self) -> int:
        """Count the lines for which CAD has another quantity."""
        return len(self.cad_quantities)

    @property
    def mark(self) -> str:
        """Make the mark of what is decided about: the BOM's version, and CAD's quantities in conflict."""
        return conflicts_mark(self.version, self.cad_quantities)


def waiting(tx: Tx) -> list[Waiting]:
    """Find all BOMs that wait for a decision, by part number; archived assemblies never wait.

    Reads only what a list of them is filtered and sorted by: there may be thousands.
    """
    unreferenced, conflicts, gaps = _unreferenced(tx), conflicts_in(tx), _gaps(tx)
    units, held = _units(tx), all_held(tx)
    row, last, none = items.c, bom_last_syncs.c, CadQuantities()
    shown = (row.id, row.part_number, row.name, row.bom_version, last.folder, last.document_file, last.at)
    query = (
        select(*shown, users.c.username)
        .outerjoin_from(items, bom_last_syncs, last.parent_id == row.id)
        .outerjoin(assignees, assignees.c.item_id == row.id)
        .outerjoin(users, users.c.id == assignees.c.user_id)
        .where(
            one_of(tx, row.id, {*unreferenced, *conflicts, *gaps, *units, *held}), row.archived_at.is_(None)
        )
    )
    waitings = [
        Waiting(
            *(record, number, name, version, *_place(folder, file, held.get(record)), at),
            *(
                conflicts.get(record, none),
                who or "",
                unreferenced[record],
                *gaps.get(record, (0, 0)),
                units[record],
                held.get(record),
            ),
        )
        for record, number, name, version, folder, file, at, who in tx.conn.execute(query)
    ]
    return sorted(waitings, key=lambda record: record.part_number.casefold())


def _place(folder: str | None, file: str | None, held: HeldBom | None) -> tuple[str, str]:
    """Return project folder and file of a BOM; a BOM that was never merged may be held."""
    if held is not None:
        folder, file = folder or held.folder, file or held.document_file
    return folder or "", file or ""


def waiting_count(tx: Tx) -> int:
    """Count the BOMs that wait."""
    return _count(tx, lambda _: true())


def open_among(tx: Tx, item_ids: Collection[int]) -> int:
    """Count how many of these BOMs wait."""
    return _count(tx, lambda element: one_of(tx, element, item_ids))


def waiting_in(tx: Tx, folder: str) -> int:
    """Count the BOMs that wait in a project folder and in the folders below it."""
    last = bom_last_syncs.c
    inside = [
        select(row.parent_id).where(
            or_(row.folder == folder, row.folder.startswith(f"{folder}/", autoescape=True))
        )
        for row in (last, held_boms.c)
    ]
    return _count(tx, lambda element: or_(*(element.in_(some) for some in inside)))


def _count(tx: Tx, which: Callable[[ColumnElement[int]], ColumnElement[bool]]) -> int:
    unreferenced = select(bom_lines.c.parent_id).where(text(f"bom_lines.{UNREFERENCED}"))
    incomplete = select(bom_last_syncs.c.parent_id).where(text(f"({INCOMPLETE})"))
    disputed = select(items.c.id).where(one_of(tx, items.c.id, conflicts_in(tx)))
    in_units = select(items.c.id).where(one_of(tx, items.c.id, _units(tx)))
    held = select(held_boms.c.parent_id)
    parent_id = union(unreferenced, incomplete, disputed, in_units, held).subquery().c.parent_id
    # Archived items are few: PostgreSQL reads all items, for each page, if asked which of these are not.
    archived = select(items.c.id).where(items.c.archived_at.is_not(None))
    return (
        tx.conn.scalar(select(func.count(parent_id)).where(parent_id.not_in(archived), which(parent_id))) or 0
    )


def conflicts_mark(version: int, conflicts: CadQuantities) -> str:
    """Make the mark of a BOM's version and of CAD's quantities in conflict."""
    # A sync that only brings other conflicts changes no line, and so not the version.
    digest = repr(sorted((child, conflict.quantity) for child, conflict in conflicts.items()))
    return f"{version}-{hashlib.sha256(digest.encode()).hexdigest()[:16]}"


def _unreferenced(tx: Tx) -> Counter[int]:
    query = select(bom_lines.c.parent_id, func.count()).where(text(f"bom_lines.{UNREFERENCED}"))
    return Counter({row[0]: row[1] for row in tx.conn.execute(query.group_by(bom_lines.c.parent_id))})


def _units(tx: Tx) -> Counter[int]:
    """Count the lines of each BOM whose unit is of another kind than their part's."""
    line, row = bom_lines.c, items.c
    shown = select(line.parent_id, line.unit, row.unit, line.source).join(items, row.id == line.child_id)
    of_lines = shown.where(
        text(f"bom_lines.{WITH_UNIT}"), line.unit != func.coalesce(func.nullif(row.unit, ""), PIECES.symbol)
    )
    counts: Counter[int] = Counter()
    for parent_id, unit, of_item, source in tx.conn.execute(of_lines):
        counts[parent_id] += not line_unit(unit, of_item, from_cad=source == "assembly").converts_to(
            unit_of(of_item)
        )
    # The items come first: in one statement SQLite would read all lines to find the few of these items.
    with_unit = select(row.id, row.unit).where(text(f"items.{WITH_UNIT}"))
    others = [
        item_id
        for item_id, unit in tx.conn.execute(with_unit)
        if not line_unit(None, unit, from_cad=True).converts_to(unit_of(unit))
    ]
    if others:
        of_items = select(line.parent_id, func.count()).where(
            one_of(tx, line.child_id, others), line.unit.is_(None), line.source == "assembly"
        )
        counts.update({row[0]: row[1] for row in tx.conn.execute(of_items.group_by(line.parent_id))})
    return +counts


def _gaps(tx: Tx) -> dict[int, tuple[int, int]]:
    """Count by BOM what its last sync left out: all but the unregistered parts, and these."""
    row = bom_last_syncs.c
    query = select(row.parent_id, row.left_out, row.refused_at).where(text(f"({INCOMPLETE})"))
    gaps: dict[int, tuple[int, int]] = {}
    for parent_id, left_out, refused_at in tx.conn.execute(query):
        reasons = [gap["reason"] for gap in json.loads(left_out)]
        unregistered = reasons.count(Reason.UNREGISTERED)
        gaps[parent_id] = len(reasons) + bool(refused_at) - unregistered, unregistered
    return gaps
