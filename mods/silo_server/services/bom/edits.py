# SPDX-License-Identifier: LGPL-2.1-or-later
"""What people do to single BOM lines: add, change, remove. Each is one change in the history."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from silo.bom.diff import same_quantity
from silo.bom.errors import RejectedError
from silo.bom.numbers import plain
from silo_server.db.engine import Tx
from silo_server.errors import DuplicateError, LinesChangedError
from silo_server.json_values import json_problem
from silo_server.services.bom.changes import (
    ChangeKind,
    ChangeNote,
    LineChange,
    apply_changes,
    check_no_cycle,
    new_line_id,
    parent_to_change,
)
from silo_server.services.bom.lines import LineId, line_of, lines_of, mark_of
from silo_server.services.bom.merge_json import quantity_problem
from silo_server.services.items import get_item
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
    """Add a line. Raises DuplicateError where the child is there already, CycleError, RejectedError."""
    parent = parent_to_change(tx, part_number, expected)
    child = get_item(tx, child_part_number)
    check_state(state)
    for line in lines_of(tx, parent):
        if line.child_id == child.id and line.state.rel_type == state.rel_type:
            raise DuplicateError(
                f"{child.part_number} is in the BOM of {parent.part_number} already; change its line instead"
            )
    check_no_cycle(tx, parent, [child.id])
    change = LineChange(new_line_id(), child.id, None, state)
    text = f"{child.part_number} added, quantity {plain(state.quantity)}"
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

    Another quantity on an assembly line makes it a manual override, which remembers what the assembly said;
    giving that quantity back ends the override. A ``source`` that is given wins over this.
    """
    parent = parent_to_change(tx, part_number, expected)
    line = line_of(lines_of(tx, parent), which, parent)
    after = edited_state(line.state, changes)
    check_state(after)
    if after == line.state:
        return Edited(parent, line, parent.bom_version, 0, line.child_part_number)
    if after.rel_type != line.state.rel_type:
        _check_free(tx, parent, line, after.rel_type)
    fields = sorted(k for k in changes if getattr(after, k) != getattr(line.state, k))
    if not same_quantity(after.quantity, line.state.quantity):
        quantity = f"quantity {plain(line.state.quantity)} → {plain(after.quantity)}"
        fields = [quantity, *(name for name in fields if name != "quantity")]
    what = ", ".join(name.replace("_", " ") for name in fields) or "source"
    change = LineChange(line.id, line.child_id, line.state, after, line.position)
    return _apply(
        tx, parent, change, line.child_part_number, f"{line.child_part_number} changed: {what}", why
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
        the :func:`mark_of` the line as the person saw it; LinesChangedError where it is another one by now.
    """
    parent = parent_to_change(tx, part_number, expected)
    line = line_of(lines_of(tx, parent), which, parent)
    if seen is not None and seen != mark_of(line.state):
        raise LinesChangedError(f"{line.child_part_number} was changed meanwhile", [line.id])
    change = LineChange(line.id, line.child_id, line.state, None, line.position)
    return _apply(tx, parent, change, line.child_part_number, f"{line.child_part_number} removed", why)


def edited_state(before: LineState, changes: Mapping[str, Any]) -> LineState:
    """The state after a person's edit; pure, so that the import's preview says the same."""
    after = replace(before, **changes)
    if "source" in changes:
        if after.source == "assembly":
            return replace(after, override=False, cad_quantity=None, reason=None)
        return replace(after, unreferenced_since=None)
    if same_quantity(after.quantity, before.quantity):
        return after
    if before.override and same_quantity(after.quantity, before.cad_quantity):
        return replace(after, source="assembly", override=False, cad_quantity=None)
    if before.source == "assembly":
        return replace(
            after, source="manual", override=True, cad_quantity=before.quantity, unreferenced_since=None
        )
    return after


def check_state(state: LineState) -> None:
    """Raise RejectedError, with everything that is wrong, unless the line's state is usable."""
    problems = []
    problem = quantity_problem(state.quantity)
    if problem:
        problems.append(f"quantity: {problem}")
    if state.rel_type not in REL_TYPES:
        problems.append(f"rel_type: wanted one of {', '.join(REL_TYPES)}, got {state.rel_type!r}")
    if state.source not in SOURCES:
        problems.append(f"source: wanted one of {', '.join(SOURCES)}, got {state.source!r}")
    for name, limit in (("unit", 32), ("find_number", 32)):
        value = getattr(state, name)
        if value is not None and len(value) > limit:
            problems.append(f"{name}: wanted at most {limit} characters, got {len(value)}")
    if state.metadata and (problem := json_problem(state.metadata)):
        problems.append(f"metadata: {problem}")
    if problems:
        raise RejectedError("; ".join(problems), problems)


def _check_free(tx: Tx, parent: Item, line: Line, rel_type: str) -> None:
    for other in lines_of(tx, parent):
        if other.child_id == line.child_id and other.state.rel_type == rel_type:
            raise DuplicateError(f"{line.child_part_number} is in this BOM as {rel_type} already")


def _apply(tx: Tx, parent: Item, change: LineChange, child: str, text: str, why: str | None = None) -> Edited:
    note = ChangeNote(kind=ChangeKind.EDIT, summary=text, reason=why)
    change_id, version = apply_changes(tx, parent, [change], note)
    after = None
    if change.after is not None:
        after = next(line for line in lines_of(tx, parent) if line.id == change.line_id)
    return Edited(parent, after, version, change_id, child)
