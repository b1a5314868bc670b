# SPDX-License-Identifier: LGPL-2.1-or-later
"""Edits of a single BOM line by a user: add, change, remove; each is one change in the history."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from silo.api.wire import LineTexts
from silo.bom.errors import RejectedError
from silo.bom.message import Message, joined, message
from silo.bom.quantities import plain, same_quantity
from silo.bom.text import character_problem
from silo.bom.units import PIECES, counts_pieces, line_unit, stored_unit
from silo_server.db.transaction import Tx
from silo_server.errors import DuplicateError, LinesChangedError
from silo_server.schema import text_hints
from silo_server.services.bom.change import ChangeNote, apply_changes, new_line_id, parent_to_change
from silo_server.services.bom.cycles import check_no_cycle
from silo_server.services.bom.line_record import ChangeKind, LineRecord
from silo_server.services.bom.line_state import mark_of
from silo_server.services.bom.lines import LineId, line_of, lines_of
from silo_server.services.field_checks import quantity_problem
from silo_server.services.items import get_item
from silo_server.user_json import json_problem
from silo_server.values import Item, Line, LineState

REL_TYPES = ("component", "alternate", "reference")

SOURCES = ("manual", "assembly")


@dataclass(frozen=True, slots=True)
class Edited:
    """The line after an edit (None once removed), its parent, and the BOM's version and change."""

    parent: Item
    line: Line | None
    version: int
    change_id: int
    child_part_number: str


def add_line(
    tx: Tx,
    part_number: str,
    child_part_number: str,
    state: LineState,
    expected: int | None = None,
    *,
    why: str | None = None,
) -> Edited:
    """Add a line. Raises DuplicateError if the BOM has the child already, CycleError, RejectedError."""
    parent = parent_to_change(tx, part_number, expected)
    child = get_item(tx, child_part_number)
    state = replace(state, unit=stored_unit(state.unit))
    check_state(state)
    for line in lines_of(tx, parent):
        if line.child_id == child.id and line.state.rel_type == state.rel_type:
            raise DuplicateError(
                message(
                    "{part_number} is in the BOM of {parent} already; change its line instead",
                    part_number=child.part_number,
                    parent=parent.part_number,
                )
            )
    check_no_cycle(tx, parent, [child.id])
    change = LineRecord(new_line_id(), child.id, None, state)
    text = message(
        "{part_number} added, quantity {quantity}",
        part_number=child.part_number,
        quantity=plain(state.quantity),
    )
    return _apply(tx, parent, change, child.part_number, text, why)


def change_line(
    tx: Tx,
    part_number: str,
    which: str | LineId,
    changes: Mapping[str, Any],
    expected: int | None = None,
    *,
    why: str | None = None,
) -> Edited:
    """Change the fields (those of LineState that people own) of the line with this id, or of this child.

    A different quantity, or a unit other than pieces, makes an assembly line a manual override, which
    remembers the quantity of the assembly; that quantity, in pieces again, ends the override. A ``source``
    among the changes wins over this.
    """
    parent = parent_to_change(tx, part_number, expected)
    lines = lines_of(tx, parent)
    line = line_of(lines, which, parent)
    after = edited_state(line.state, changes, line.child_unit)
    check_state(after)
    if after == line.state:
        return Edited(parent, line, parent.bom_version, 0, line.child_part_number)
    child = line.child_part_number
    if after.rel_type != line.state.rel_type and any(
        (other.child_id, other.state.rel_type) == (line.child_id, after.rel_type) for other in lines
    ):
        raise DuplicateError(
            message(
                "{part_number} is in this BOM as {rel_type} already",
                part_number=child,
                rel_type=after.rel_type,
            )
        )
    fields = sorted(k for k in {*changes, "unit"} if getattr(after, k) != getattr(line.state, k))
    if not same_quantity(after.quantity, line.state.quantity):
        quantity = message(
            "quantity {before} → {after}", before=plain(line.state.quantity), after=plain(after.quantity)
        )
        fields = [quantity, *(name for name in fields if name != "quantity")]
    words = joined(", ", [Message(name.replace("_", " ")) for name in fields] or [Message("source")])
    change = LineRecord(line.id, line.child_id, line.state, after, line.position)
    return _apply(
        tx,
        parent,
        change,
        child,
        message("{part_number} changed: {words}", part_number=child, words=words),
        why,
    )


def remove_line(
    tx: Tx,
    part_number: str,
    which: str | LineId,
    expected: int | None = None,
    *,
    seen: str | None = None,
    why: str | None = None,
) -> Edited:
    """Remove the line with this id, or of this child; only people do this.

    seen
        the :func:`mark_of` the line as the person saw it; LinesChangedError if the line has changed since.
    """
    parent = parent_to_change(tx, part_number, expected)
    line = line_of(lines_of(tx, parent), which, parent)
    if seen is not None and seen != mark_of(line.state):
        raise LinesChangedError(
            message("{part_number} was changed meanwhile", part_number=line.child_part_number), [line.id]
        )
    change = LineRecord(line.id, line.child_id, line.state, None, line.position)
    return _apply(
        tx,
        parent,
        change,
        line.child_part_number,
        message("{part_number} removed", part_number=line.child_part_number),
        why,
    )


def edited_state(before: LineState, changes: Mapping[str, Any], child_unit: str | None = None) -> LineState:
    """Apply a user's edit to a state; pure, so that the import's preview gives the same result.

    child_unit
        the unit of the line's child, in which a line without a unit is, unless CAD counted it.
    """
    after = replace(before, **changes)
    if "unit" in changes:  # what the user did not edit stays as it is written
        after = replace(after, unit=stored_unit(after.unit))
    same_unit = means_the_same_unit(before, after.unit, child_unit)
    if "source" in changes:
        if after.source == "assembly":
            return replace(after, override=False, cad_quantity=None, reason=None)
        return replace(owned_by_users(after, before, child_unit), unreferenced_since=None)
    if same_unit and same_quantity(after.quantity, before.quantity):
        return after
    pieces = counts_pieces(after.unit, child_unit)
    if before.override and pieces and same_quantity(after.quantity, before.cad_quantity):
        return replace(after, source="assembly", override=False, cad_quantity=None)
    if before.source == "assembly":
        return replace(
            after, source="manual", override=True, cad_quantity=before.quantity, unreferenced_since=None
        )
    return after


def means_the_same_unit(before: LineState, unit: str | None, child_unit: str | None) -> bool:
    """Return True if a line with this unit in the place of its own would say the same."""
    from_cad = before.source == "assembly"
    return line_unit(unit, child_unit, from_cad=from_cad) == line_unit(
        before.unit, child_unit, from_cad=from_cad
    )


def owned_by_users(after: LineState, before: LineState, child_unit: str | None) -> LineState:
    """Name the unit of a line that CAD counted, and that users own from now on, where none is named.

    Without a name its pieces would become metres if its part is counted in metres.
    """
    counted = before.source == "assembly" and after.unit is None
    return after if not counted or counts_pieces(None, child_unit) else replace(after, unit=PIECES.symbol)


def check_state(state: LineState) -> None:
    """Raise RejectedError, with everything that is wrong, unless the line's state is usable."""
    problems = []
    problem = quantity_problem(state.quantity)
    if problem:
        problems.append(message("quantity: {problem}", problem=problem))
    if state.rel_type not in REL_TYPES:
        problems.append(
            message(
                "rel_type: wanted one of {known}, got {rel_type}",
                known=", ".join(REL_TYPES),
                rel_type=repr(state.rel_type),
            )
        )
    if state.source not in SOURCES:
        problems.append(
            message(
                "source: wanted one of {known}, got {source}",
                known=", ".join(SOURCES),
                source=repr(state.source),
            )
        )
    for name, field in LineTexts.model_fields.items():
        value, limit = getattr(state, name), text_hints(field).get("maxLength")
        if value is not None and limit and len(value) > limit:
            problems.append(
                message(
                    "{field}: wanted at most {most} characters, got {length}",
                    field=name,
                    most=limit,
                    length=len(value),
                )
            )
    for name in (*LineTexts.model_fields, "reason", "reference_designators"):
        for written in (value,) if isinstance(value := getattr(state, name), str) else value or ():
            if problem := character_problem(written):
                problems.append(message("{field}: {problem}", field=name, problem=problem))
    if state.metadata and (problem := json_problem(state.metadata)):
        problems.append(message("metadata: {problem}", problem=problem))
    if problems:
        raise RejectedError(joined("; ", problems), problems)


def _apply(tx: Tx, parent: Item, change: LineRecord, child: str, text: str, why: str | None = None) -> Edited:
    note = ChangeNote(kind=ChangeKind.EDIT, summary=text, reason=why)
    change_id, version = apply_changes(tx, parent, [change], note)
    after = None
    if change.after is not None:
        after = next(line for line in lines_of(tx, parent) if line.id == change.line_id)
    return Edited(parent, after, version, change_id, child)
