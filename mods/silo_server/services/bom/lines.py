# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reading BOM lines: of one parent, of many, and one line by what names it."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from sqlalchemy import Integer, Select, func, literal_column, select, type_coerce

from silo.bom.errors import ConflictError, NotFoundError
from silo.bom.message import message
from silo_server.db.rows import one_of
from silo_server.db.tables import bom_lines, items
from silo_server.db.transaction import Tx
from silo_server.errors import TooLargeError
from silo_server.fields import names_of
from silo_server.values import Item, Line, LineState

# "override" as the number that SQLite has: making a bool of it costs more than all the rest of the row.
STATE_COLUMNS = [
    type_coerce(bom_lines.c.override, Integer) if name == "override" else bom_lines.c[name]
    for name in names_of(LineState)
]


def select_lines(*, bare: bool = False) -> Select[*tuple[Any, ...]]:
    """Select lines with their children, in the columns that :func:`to_line` reads.

    ``bare``: without UUID, name and description of the children, which take a third of the time.
    """
    texts = (items.c.uuid, items.c.name, items.c.description)
    return select(
        bom_lines.c.id,
        bom_lines.c.parent_id,
        bom_lines.c.child_id,
        bom_lines.c.position,
        items.c.part_number,
        *(literal_column("''").label(text.name) if bare else text for text in texts),
        items.c.item_type,
        items.c.current_revision,
        items.c.archived_at,
        items.c.unit,
        *STATE_COLUMNS,
    ).join(items, items.c.id == bom_lines.c.child_id)


def to_line(row: Any, child: tuple[Any, ...] = ()) -> Line:
    """Make a line from a row of :func:`select_lines`; reading by position makes this fast.

    ``child``: the same child as read from another row (:func:`child_of`).
    """
    return Line._make((*row[:4], *(child or child_of(row)), _state(*row[12:])))


def child_of(row: Any) -> tuple[Any, ...]:
    """Return the values of a row of :func:`select_lines` that describe the child."""
    return (*row[4:10], row[10] is not None, row[11] or None)


# Most lines of a BOM are in one of a few states (so many pieces, from the assembly, nothing noted); a frozen
# value can be shared, and making one costs ten times as much as finding it.
@lru_cache(maxsize=16384)
def _state(*columns: Any) -> LineState:
    raw: Any = LineState(*columns)  # the columns are in the order of the fields
    designators, metadata = (json.loads(text) for text in (raw.reference_designators, raw.metadata))
    state: LineState = replace(
        raw, reference_designators=tuple(designators), override=bool(raw.override), metadata=metadata
    )
    return state


def lines_of(tx: Tx, parent: Item) -> list[Line]:
    """Read the lines of a BOM, in their order."""
    query = select_lines().where(bom_lines.c.parent_id == parent.id).order_by(bom_lines.c.position)
    return [to_line(row) for row in tx.conn.execute(query)]


# The most lines of several BOMs in one answer; one BOM alone may have any number.
MOST_LINES_AT_ONCE = 10_000


def check_line_count(tx: Tx, parent_ids: Sequence[int]) -> None:
    """Raise TooLargeError if several BOMs together have more lines than one answer may have.

    A BOM that is named twice counts twice.
    """
    row = bom_lines.c.parent_id
    query = select(row, func.count()).where(one_of(tx, row, set(parent_ids))).group_by(row)
    counts: dict[int, int] = dict(tx.conn.execute(query).all())
    count = sum(counts.get(parent_id, 0) for parent_id in parent_ids)
    most = min(MOST_LINES_AT_ONCE, tx.settings.max_expanded_rows)
    if count > most and len(parent_ids) > 1:
        raise TooLargeError(
            message(
                "these BOMs have {lines} lines, an answer at most {most}; ask for fewer",
                lines=count,
                most=most,
            )
        )


def lines_of_many(tx: Tx, parent_ids: Collection[int]) -> dict[int, list[Line]]:
    """Read the lines of many BOMs, by parent, each in their order."""
    query = (
        select_lines()
        .where(one_of(tx, bom_lines.c.parent_id, parent_ids))
        .order_by(bom_lines.c.parent_id, bom_lines.c.position)
    )
    lines: dict[int, list[Line]] = {}
    for row in tx.conn.execute(query):
        lines.setdefault(row[1], []).append(to_line(row))
    return lines


@dataclass(frozen=True, slots=True)
class LineId:
    """Names a line by its own id, which stays whatever happens to the line."""

    id: str


def line_of(lines: Iterable[Line], which: str | LineId, parent: Item) -> Line:
    """Find the line with this id, or the only line of this child.

    Raises NotFoundError if there is none, ConflictError if the child has several lines: none is chosen by
    chance.
    """
    if isinstance(which, LineId):
        line = next((line for line in lines if line.id == which.id), None)
        if line is None:
            raise NotFoundError(
                message(
                    "the BOM of {part_number} has no line with the id {line}",
                    part_number=parent.part_number,
                    line=repr(which.id),
                )
            )
        return line
    key = which.casefold()
    matches = [line for line in lines if line.child_part_number.casefold() == key]
    if len(matches) > 1:
        ids = ", ".join(f"{line.state.rel_type}: {line.id}" for line in matches)
        raise ConflictError(
            message(
                "the BOM of {part_number} has {n} lines for {child} ({lines}); name a line by its id",
                part_number=parent.part_number,
                n=len(matches),
                child=repr(which),
                lines=ids,
            )
        )
    if not matches:
        raise NotFoundError(
            message(
                "the BOM of {part_number} has no line for {child}",
                part_number=parent.part_number,
                child=repr(which),
            )
        )
    return matches[0]


def component_of(lines: Iterable[Line], which: str | LineId, parent: Item) -> Line:
    """Find a line as :func:`line_of` does; of several lines of a child take the component, as CAD does."""
    lines = list(lines)
    if isinstance(which, str):
        key = which.casefold()
        own = [line for line in lines if line.child_part_number.casefold() == key]
        lines = [line for line in own if line.state.rel_type == "component"] or own
    return line_of(lines, which, parent)
