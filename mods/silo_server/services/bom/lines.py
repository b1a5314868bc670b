# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reading BOM lines: of one parent, of many, and as JSON."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from sqlalchemy import Integer, Select, func, select, type_coerce

from silo.bom.errors import ConflictError, NotFoundError
from silo.bom.numbers import plain
from silo_server.db.bulk import one_of
from silo_server.db.engine import Tx
from silo_server.db.tables import bom_lines, items
from silo_server.errors import TooLargeError
from silo_server.json_values import dumps
from silo_server.values import Item, Line, LineState, names_of, to_wire

# "override" as the number that SQLite has: making a bool of it costs more than all the rest of the row.
STATE_COLUMNS = [
    type_coerce(bom_lines.c.override, Integer) if name == "override" else bom_lines.c[name]
    for name in names_of(LineState)
]


def select_lines() -> Select[*tuple[Any, ...]]:
    """The query that :func:`to_line` understands."""
    return select(
        bom_lines.c.id,
        bom_lines.c.parent_id,
        bom_lines.c.child_id,
        bom_lines.c.position,
        items.c.part_number,
        items.c.uuid,
        items.c.name,
        items.c.description,
        items.c.item_type,
        items.c.current_revision,
        items.c.archived_at,
        *STATE_COLUMNS,
    ).join(items, items.c.id == bom_lines.c.child_id)


def to_line(row: Any) -> Line:
    """A frozen line from a row of :func:`select_lines`; by position, which is what makes it quick."""
    return Line._make((*row[:10], row[10] is not None, _state(*row[11:])))


# Most lines of a BOM are in one of a few states (so many pieces, from the assembly, nothing noted); a frozen
# value can be shared, and making one costs ten times as much as finding it.
@lru_cache(maxsize=16384)
def _state(*columns: Any) -> LineState:
    state = LineState(*columns)  # the columns are in the order of the fields
    return replace(
        state,
        reference_designators=tuple(json.loads(columns[4])),
        override=bool(state.override),
        metadata=json.loads(columns[12]),
    )


def lines_of(tx: Tx, parent: Item) -> list[Line]:
    """The parent's lines in their order."""
    query = select_lines().where(bom_lines.c.parent_id == parent.id).order_by(bom_lines.c.position)
    return [to_line(row) for row in tx.conn.execute(query)]


def check_line_count(tx: Tx, parent_ids: Collection[int]) -> None:
    """TooLargeError where these BOMs have more lines in all than one answer may have."""
    within = one_of(tx, bom_lines.c.parent_id, parent_ids)
    count = tx.conn.scalar(select(func.count()).select_from(bom_lines).where(within)) or 0
    most = tx.settings.max_expanded_rows
    if count > most:
        raise TooLargeError(f"these BOMs have {count} lines, an answer at most {most}; ask for fewer")


def lines_of_many(tx: Tx, parent_ids: Collection[int]) -> dict[int, list[Line]]:
    """The lines of all these parents, by parent, each in their order."""
    query = (
        select_lines()
        .where(one_of(tx, bom_lines.c.parent_id, parent_ids))
        .order_by(bom_lines.c.parent_id, bom_lines.c.position)
    )
    found: dict[int, list[Line]] = {}
    for row in tx.conn.execute(query):
        found.setdefault(row[1], []).append(to_line(row))
    return found


@dataclass(frozen=True, slots=True)
class LineId:
    """Names a line by its own id, which stays whatever happens to the line."""

    id: str


def line_of(lines: Iterable[Line], which: str | LineId, parent: Item) -> Line:
    """The line with this id, or the one line of this child.

    Raises NotFoundError where there is none, ConflictError where a child has several: somebody would reach
    the wrong one.
    """
    if isinstance(which, LineId):
        line = next((line for line in lines if line.id == which.id), None)
        if line is None:
            raise NotFoundError(f"the BOM of {parent.part_number} has no line with the id {which.id!r}")
        return line
    key = which.casefold()
    found = [line for line in lines if line.child_part_number.casefold() == key]
    if len(found) > 1:
        ids = ", ".join(f"{line.state.rel_type}: {line.id}" for line in found)
        raise ConflictError(
            f"the BOM of {parent.part_number} has {len(found)} lines for {which!r} ({ids}); "
            "name one by its id"
        )
    if not found:
        raise NotFoundError(f"the BOM of {parent.part_number} has no line for {which!r}")
    return found[0]


def component_of(lines: Iterable[Line], which: str | LineId, parent: Item) -> Line:
    """As :func:`line_of`; of several lines of a child the component, which is the one that CAD speaks of."""
    lines = list(lines)
    if isinstance(which, str):
        key = which.casefold()
        own = [line for line in lines if line.child_part_number.casefold() == key]
        lines = [line for line in own if line.state.rel_type == "component"] or own
    return line_of(lines, which, parent)


def state_to_json(state: LineState) -> dict[str, Any]:
    """A line's state as history stores it; only what is set."""
    known = ((name, getattr(state, name)) for name in names_of(LineState))
    return {
        name: value
        for name, value in known
        if value is not None and value is not False and value != () and value != {}
    }


def mark_of(state: LineState, cad_quantity: float | None = None) -> str:
    """What a person saw of a line, as a short mark: another state has another one.

    cad_quantity
        what a conflict says beside the line.
    """
    seen = dumps([state_to_json(state), cad_quantity])
    return hashlib.sha256(seen.encode()).hexdigest()[:16]


def stored_state(text: str) -> LineState:
    """The state that :func:`state_to_json` gave and history stored."""
    values = dict(json.loads(text))
    if "reference_designators" in values:
        values["reference_designators"] = tuple(values["reference_designators"])
    return replace(LineState(values.pop("quantity"), values.pop("source")), **values)


def state_columns(state: LineState) -> dict[str, Any]:
    """A line's state as columns of the table."""
    return {name: getattr(state, name) for name in names_of(LineState)} | {
        "quantity": float(state.quantity),
        "reference_designators": dumps(list(state.reference_designators)),
        "metadata": dumps(dict(state.metadata)),
    }


def line_to_wire(line: Line, parent_part_number: str) -> dict[str, Any]:
    """A line as ``GET …/bom`` sends it: the contract's keys, and ours for overrides and newer revisions."""
    return {
        "id": line.id,
        "parent_part_number": parent_part_number,
        **child_to_wire(line),
        **line_state_to_wire(line.state),
        **revisions_to_wire(line),
    }


def child_to_wire(line: Line) -> dict[str, Any]:
    """What a line says of its child."""
    return {
        "child_part_number": line.child_part_number,
        "child_id": line.child_uuid,
        "child_name": line.child_name,
        "child_description": line.child_description,
        "child_item_type": line.child_item_type,
        "child_archived": line.child_archived,
    }


def line_state_to_wire(state: LineState) -> dict[str, Any]:
    """What a line says of itself."""
    return to_wire(state) | {"quantity": plain(state.quantity), "cad_quantity": plain(state.cad_quantity)}


def revisions_to_wire(line: Line) -> dict[str, Any]:
    """Which revision of the child is meant, and whether there is a newer one."""
    pinned, newest = line.state.child_revision, line.child_current_revision
    return {
        "effective_revision": pinned if pinned is not None else newest,
        "newer_revision_exists": pinned is not None and pinned < newest,
    }
