# SPDX-License-Identifier: LGPL-2.1-or-later
"""Merging on servers of every age: the answer read strictly, else the BOM read back, else line by line.

A server without merge (the real Silo's first phase) gets the same plan as single calls: added lines are
added, changed quantities changed, nothing is removed and no line of a user is touched. That is not one
step: what breaks off half-way continues with the next run, which plans from the lines as they are then.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from pydantic import ValidationError

from silo.api.replies import Reply, complaint
from silo.api.transport import Cancel, stop_if
from silo.api.wire import (
    BomLine,
    MergeDiff,
    MergeEntry,
    MergeRequest,
    MergeResult,
    MergeWarning,
    QuantityLine,
)
from silo.bom.compare.answer import answer_of, conflict_warning
from silo.bom.compare.bom_diff import BomDiff, QuantityChange
from silo.bom.compare.merge import plan_merge
from silo.bom.compare.owner import is_manual
from silo.bom.errors import (
    ConflictError,
    CycleError,
    NotFoundError,
    RejectedError,
    RouteMissingError,
    ServerFaultError,
    SiloError,
    listed,
)
from silo.bom.message import joined, message
from silo.bom.quantities import same_quantity
from silo.bom.units import says_the_same

if TYPE_CHECKING:
    from silo.api.boms import BomCalls

UNCLEAR = "answer_not_understood"
"""The warning of a merge whose answer was not understood, and that the BOM shows anyway."""

NOT_ATOMIC = "not_atomic"
"""The warning of a merge that was made of single calls."""


def unusual(result: MergeResult | None) -> list[str]:
    """List, in sentences, what a user must know about a merge that was not a usual one."""
    warnings = result.warnings if result is not None else ()
    return [warning.message for warning in warnings if warning.type in (UNCLEAR, NOT_ATOMIC)]


def merge_result(reply: Reply) -> MergeResult | None:
    """Read the answer to a merge strictly: only an answer that states what was done counts as success.

    None: neither success nor failure can be read from it. Raises :class:`ServerFaultError` for an answer that
    reports a failure, whatever its status.
    """
    if reply.is_html:
        return None
    failure = complaint(reply)
    try:
        data = json.loads(reply.content)
    except (ValueError, RecursionError):
        return None
    if not isinstance(data, dict):
        return None
    word = str(data.get("status") or "").casefold()
    if data.get("error") or data.get("success") is False or data.get("ok") is False or word in _FAILED:
        raise ServerFaultError(
            message(
                "{asked}: the server answered {status} but reports a failure{text}",
                asked=reply.where.asked,
                status=reply.status,
                text=": " + failure.text if failure.text else "",
            )
        )
    diff = data.get("diff")
    if not isinstance(diff, dict) or not _LISTS.intersection(diff) or (word and word not in _DONE):
        return None
    try:
        return MergeResult.model_validate(data)
    except ValidationError:
        return None


_DONE = {"merged", "ok", "success", "done", "unchanged", "no_changes", "dry_run", "preview"}
_FAILED = {"error", "failed", "failure", "rejected", "rolled_back", "aborted"}
_LISTS = {"added", "removed", "quantity_changed", "unchanged"}


def result_of(diff: BomDiff, part_number: str, request: MergeRequest) -> MergeResult:
    """Make the answer of spec §5 for a planned merge."""
    left_out = [part.model_dump() for part in request.left_out or ()]
    return MergeResult.model_validate(answer_of(diff, part_number, request.sync_id, left_out))


def read_back(api: BomCalls, part_number: str, request: MergeRequest, host: str) -> MergeResult:
    """Read the BOM again after a merge whose answer says neither success nor failure, and make the result
    from it. Raises :class:`ServerFaultError` if the BOM does not show the merge.
    """
    sent = message(
        "{host}: the BOM of {part_number} was sent, but the answer was not understood",
        host=host,
        part_number=part_number,
    )
    if request.dry_run:
        raise ServerFaultError(message("{sent}; nothing was to be changed", sent=sent))
    try:
        lines = {line.child_part_number.casefold(): line for line in api.get_bom(part_number)}
    except SiloError as error:
        raise ServerFaultError(
            message("{sent}, and the BOM cannot be read back ({error})", sent=sent, error=error)
        ) from error
    wrong = [entry for entry in request.entries if not _shows(lines.get(_key(entry)), entry)]
    if wrong:
        names = listed([entry.child_part_number for entry in wrong])
        raise ServerFaultError(
            message("{sent}, and its BOM does not show {names} as in the assembly", sent=sent, names=names)
        )
    lines_of = [lines[_key(entry)] for entry in request.entries]
    shown = [QuantityLine(part_number=line.child_part_number, quantity=line.quantity) for line in lines_of]
    return MergeResult(
        diff=MergeDiff(unchanged=shown),
        warnings=[
            MergeWarning(
                type=UNCLEAR,
                part_number=part_number,
                message=message("{sent}; the BOM shows all of its lines", sent=sent),
            )
        ],
        sync_id=request.sync_id,
    )


def without_manual(
    api: BomCalls, part_number: str, request: MergeRequest, merge: Callable[[MergeRequest], MergeResult]
) -> MergeResult | None:
    """Merge all children but those that people own; None if people own none. For a server that answers 409.

    The children of people are reported as conflicts if the quantities differ.
    """
    manual = {line.child_part_number.casefold(): line for line in api.get_bom(part_number) if is_manual(line)}
    manual_entries = [entry for entry in request.entries if _key(entry) in manual]
    if not manual_entries:
        return None
    others = [entry for entry in request.entries if _key(entry) not in manual]
    result = merge(request.model_copy(update={"entries": others}))
    marked = {warning.part_number.casefold() for warning in result.warnings if warning.type == "conflict"}
    warnings = [
        MergeWarning.model_validate(
            conflict_warning(
                QuantityChange(entry.child_part_number, entry.quantity, line.quantity, line.unit or "")
            )
        )
        for entry in manual_entries
        if not says_the_same(
            entry.quantity, (line := manual[_key(entry)]).quantity, line.unit, line.child_unit
        )
        and _key(entry) not in marked
    ]
    return result.model_copy(update={"warnings": [*result.warnings, *warnings]})


def merge_by_lines(
    api: BomCalls, part_number: str, request: MergeRequest, host: str, *, cancelled: Cancel | None = None
) -> MergeResult:
    """Merge with one call for each line. Raises :class:`RejectedError` with all children that were refused.

    Raises :class:`RouteMissingError` if the server has no calls for single lines either.
    """
    lines = api.get_bom(part_number)
    plan = plan_merge([entry.model_dump() for entry in request.entries], lines)
    result = result_of(plan.diff, part_number, request)
    if request.dry_run:
        return result
    refused: list[str] = []
    for change in plan.diff.added:
        stop_if(cancelled)
        values = {"quantity": change.quantity, "rel_type": "component", "source": "assembly"}
        add = partial(api.add_bom_line, part_number, change.part_number, **values)
        _try(refused, change.part_number, add)
    for changed in plan.diff.quantity_changed:
        stop_if(cancelled)
        number, quantity = changed.part_number, changed.local_quantity
        _try(refused, number, partial(api.update_bom_line, part_number, number, quantity=quantity))
    written = len(plan.diff.added) + len(plan.diff.quantity_changed) - len(refused)
    if refused:
        raise RejectedError(
            message(
                "{host} has no merge; of the BOM of {part_number}, {written} lines were written one by "
                "one and {count} were refused: {refused}",
                host=host,
                part_number=part_number,
                written=written,
                count=len(refused),
                refused=joined("; ", refused[:5]),
            ),
            refused,
        )
    text = message(
        "{host} has no merge: {written} lines were written one by one, not in one step",
        host=host,
        written=written,
    )
    warning = MergeWarning(type=NOT_ATOMIC, part_number=part_number, message=text)
    return result.model_copy(update={"warnings": [*result.warnings, warning]} if written else {})


def _try(refused: list[str], child: str, call: Callable[[], object]) -> None:
    """Collect an error that concerns this line alone; any other error ends the run, and the next run
    continues there.
    """
    try:
        call()
    except (CycleError, RouteMissingError):
        raise
    except (RejectedError, NotFoundError, ConflictError) as error:
        refused.append(message("{child}: {error}", child=child, error=error))


def _key(entry: MergeEntry) -> str:
    return entry.child_part_number.casefold()


def _shows(line: BomLine | None, entry: MergeEntry) -> bool:
    # A line that a user owns may have another quantity: a merge leaves it.
    return line is not None and (is_manual(line) or same_quantity(line.quantity, entry.quantity))
